//! What a process of a fleet does first: it ties its life to the one that started it; and what it does when it is ready:
//! it gives back the stack that only getting ready took.

use rustix::mm::{Advice, madvise};
use rustix::process::{Pid, Signal, getppid, set_parent_process_death_signal};
use std::ops::Range;

/// This much below the present frame stays: the next calls need it at once.
const STACK_KEPT: usize = 8 << 10;
const PAGE: usize = 4096;

/// Asks the kernel to kill this process when its parent dies, and then looks whether that happened already: `false`
/// means that the process was started by somebody who is gone, and should end.
pub fn die_with_parent(parent: u32) -> bool {
    // Where it is refused (it never is on Linux) the guardian still ends this process.
    let _ = set_parent_process_death_signal(Some(Signal::KILL));
    getppid().map(Pid::as_raw_pid).and_then(|pid| u32::try_from(pid).ok()) == Some(parent)
}

/// When a process was started, in ticks of the kernel since the boot: with this, its number names one process only. `None`
/// if there is none, or it has ended.
pub fn start_of(pid: u32) -> Option<u64> {
    #[expect(clippy::disallowed_methods, reason = "the kernel tells of a process in a file")]
    let stat = std::fs::read_to_string(format!("/proc/{pid}/stat")).ok()?;
    // The name of the program may hold anything; what follows its last parenthesis is the third field, the state.
    let mut fields = stat.rsplit_once(')')?.1.split_ascii_whitespace();
    fields.next().filter(|state| !matches!(*state, "Z" | "X"))?;
    fields.nth(18)?.parse().ok()
}

/// Gives the kernel back the stack below the caller's frame. iceoryx2 opens services with some 150 KiB of it, which a
/// robot's loop never comes near again. It takes some 0.1 ms, so it has no place in a period. Where the kernel does not
/// say where the stack is, nothing happens.
#[inline(never)]
pub fn give_back_stack() {
    #[expect(clippy::disallowed_methods, reason = "the kernel tells in a file where the stack is")]
    let Ok(maps) = std::fs::read_to_string("/proc/self/maps") else { return };
    let here = (&raw const maps).addr();
    let Some(stack) = maps.lines().filter_map(range).find(|range| range.contains(&here)) else { return };
    let end = here.saturating_sub(STACK_KEPT) & !(PAGE - 1);
    let Some(len) = end.checked_sub(stack.start).filter(|len| *len > 0) else { return };
    // SAFETY: the range lies below all frames of this thread but that of `madvise` itself, which is in what is kept, and
    // in the mapping of this thread's stack, whose lower end is a guard page or free. So nothing in it is alive.
    let _ = unsafe { madvise(std::ptr::without_provenance_mut(stack.start), len, Advice::LinuxDontNeed) };
}

/// The state of a process as the kernel has it: `R` runs or could, `S` and `D` sleep, `T` is stopped by a signal, `t` by a
/// debugger, `Z` has ended. `None` when there is no such process.
pub fn state_of(pid: u32) -> Option<char> {
    #[expect(clippy::disallowed_methods, reason = "the kernel tells it in a file")]
    let stat = std::fs::read(format!("/proc/{pid}/stat")).ok()?;
    // The name in front may contain anything, parentheses included.
    let end = stat.iter().rposition(|byte| *byte == b')')?;
    stat.get(end + 2).map(|byte| char::from(*byte))
}

/// The addresses of a mapping: `begin-end permissions ...`, hexadecimal.
fn range(line: &str) -> Option<Range<usize>> {
    let (begin, end) = line.split_once(' ')?.0.split_once('-')?;
    Some(usize::from_str_radix(begin, 16).ok()?..usize::from_str_radix(end, 16).ok()?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::hint::black_box;

    const DEEP: usize = 1 << 20;

    #[inline(never)]
    fn go_deep() -> u8 {
        let mut frame = [0_u8; DEEP];
        black_box(&mut frame).fill(1);
        frame[black_box(DEEP / 2)]
    }

    /// Memory of this thread's stack, KiB.
    #[expect(clippy::disallowed_methods, reason = "the kernel tells it in a file")]
    fn resident_kib() -> usize {
        let local = 0_u8;
        let here = (&raw const local).addr();
        let maps = std::fs::read_to_string("/proc/self/smaps").unwrap();
        let stack = maps.lines().skip_while(|line| !range(line).is_some_and(|range| range.contains(&here)));
        let line = stack.skip(1).find_map(|line| line.strip_prefix("Rss:")).unwrap();
        line.split_ascii_whitespace().next().unwrap().parse().unwrap()
    }

    #[test]
    fn the_state_of_a_process_is_a_letter() {
        assert!(matches!(state_of(std::process::id()), Some('R' | 'S')), "it is there");
        assert_eq!(state_of(u32::MAX), None);
    }

    #[test]
    fn what_lies_below_is_given_back_and_what_is_in_use_stays() {
        let used: [u64; 512] = black_box(std::array::from_fn(|i| i as u64));
        assert_eq!(go_deep(), 1);
        let before = resident_kib();
        give_back_stack();
        let after = resident_kib();
        assert!(before >= DEEP / 1024, "{before} KiB");
        assert!(after < before - DEEP / 1024 / 2, "{before} KiB before, {after} KiB after");
        assert!(black_box(&used).iter().enumerate().all(|(i, value)| *value == i as u64));
        assert_eq!(go_deep(), 1);
    }
}
