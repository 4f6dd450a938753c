//! A look at the memory of this process, through the kernel: which of it a fleet shares, where in the rest a value is, and how
//! much stack some work takes. For tests that count copies; each of them takes this file in by its path.
#![expect(clippy::disallowed_methods, reason = "tests look at their own memory")]

use std::fs::{File, OpenOptions};
use std::ops::Range;
use std::os::unix::fs::FileExt;
use std::path::Path;

/// A mapping of this process's memory.
struct Mapping {
    range: Range<usize>,
    writable: bool,
    /// What is mapped: a path, or something like `[stack]`. And from where in it.
    what: String,
    offset: String,
}

fn mappings() -> Vec<Mapping> {
    let text = std::fs::read_to_string("/proc/self/maps").unwrap();
    let mapping = |line: &str| {
        // from-to rights offset device inode what
        let words: Vec<&str> = line.split_ascii_whitespace().collect();
        let (from, to) = words[0].split_once('-').unwrap();
        let address = |text| usize::from_str_radix(text, 16).unwrap();
        Mapping {
            range: address(from)..address(to),
            writable: words[1].starts_with("rw"),
            what: words.get(5..).unwrap_or_default().join(" "),
            offset: words[2].to_string(),
        }
    };
    text.lines().map(mapping).collect()
}

/// The memory of this process, as a file.
fn memory() -> File {
    OpenOptions::new().read(true).write(true).open("/proc/self/mem").unwrap()
}

/// The parts of this process's memory that are files of a fleet.
pub(crate) struct Shared(Vec<Mapping>);

impl Shared {
    /// Files in this directory that are mapped here.
    pub(crate) fn of(root: &Path) -> Shared {
        let root = format!("{}/", root.display());
        Shared(mappings().into_iter().filter(|mapping| mapping.what.starts_with(&root)).collect())
    }

    /// Whether all of this is shared.
    pub(crate) fn holds(&self, address: usize, bytes: usize) -> bool {
        self.0.iter().any(|Mapping { range, .. }| range.contains(&address) && address + bytes <= range.end)
    }

    /// How many bytes some work changes, of everything that is shared.
    #[allow(dead_code, reason = "not every program that counts asks for it")]
    pub(crate) fn changed_by(&self, work: impl FnOnce()) -> usize {
        let before = self.bytes();
        work();
        before.iter().zip(self.bytes()).filter(|(before, after)| **before != *after).count()
    }

    /// All of it, what is mapped twice once.
    fn bytes(&self) -> Vec<u8> {
        let mut parts: Vec<&Mapping> = self.0.iter().filter(|mapping| mapping.writable).collect();
        parts.sort_by_key(|part| (&part.what, &part.offset));
        parts.dedup_by_key(|part| (&part.what, &part.offset));
        let (memory, mut bytes) = (memory(), Vec::new());
        for Mapping { range, .. } in parts {
            let from = bytes.len();
            bytes.resize(from + range.len(), 0);
            memory.read_exact_at(&mut bytes[from..], range.start as u64).unwrap();
        }
        bytes
    }
}

/// Where in the memory that this process does not share words follow each other as `mark` numbers them: one address per
/// copy. The words are compared one at a time, so that looking for them makes no copy. What calls have left on the stack is
/// not counted: some of it is written over, some is not (see [`stack_used`]).
#[allow(dead_code, reason = "not every program that counts asks for it")]
pub(crate) fn copies_of(words: usize, mark: fn(usize) -> u64, shared: &Shared) -> Vec<usize> {
    const WORD: usize = size_of::<u64>();
    let (memory, mut found) = (memory(), Vec::new());
    let here = std::ptr::from_ref(&memory).addr();
    let calls = here - (1 << 20)..here;
    let mut page = vec![0_u8; 1 << 16];
    for Mapping { range, writable, .. } in mappings() {
        if !writable || shared.holds(range.start, 1) {
            continue;
        }
        // Pages overlap by what is looked for.
        for start in range.clone().step_by(page.len() - words * WORD) {
            let len = page.len().min(range.end - start);
            // A part that is gone since the list was read, or cannot be read, holds nothing.
            if memory.read_exact_at(&mut page[..len], start as u64).is_err() {
                continue;
            }
            let own = page.as_ptr().addr()..page.as_ptr().addr() + page.len();
            let word = |at: usize| page.get(at..at + WORD).map(|bytes| u64::from_ne_bytes(bytes.try_into().unwrap()));
            let is_marked =
                |at: &usize| *at + words * WORD <= len && (0..words).all(|n| word(at + n * WORD) == Some(mark(n)));
            let addresses = (0..len).step_by(4).filter(is_marked).map(|at| start + at);
            found.extend(addresses.filter(|address| !own.contains(address) && !calls.contains(address)));
        }
    }
    found.sort_unstable();
    found.dedup();
    found
}

/// How much of the stack some work takes, bytes, give or take 4 KiB.
#[inline(never)]
#[allow(dead_code, reason = "not every program that counts asks for it")]
pub(crate) fn stack_used(work: &mut dyn FnMut()) -> usize {
    const PAINT: u8 = 0xa5;
    const PAINTED: usize = 128 << 10;
    // What calls of this function itself have on the stack while it paints.
    const OWN: usize = 4 << 10;
    let memory = memory();
    let mut stack = vec![PAINT; PAINTED];
    let here = std::ptr::from_ref(&memory).addr();
    let below = (here - OWN - PAINTED) as u64;
    memory.write_all_at(&stack, below).unwrap();
    work();
    memory.read_exact_at(&mut stack, below).unwrap();
    let untouched = stack.iter().take_while(|byte| **byte == PAINT).count();
    if untouched == PAINTED { 0 } else { OWN + PAINTED - untouched }
}
