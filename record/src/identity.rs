//! Which build of shoal this is: the identity that the linker gave the executable, from its own file.

use std::fs::File;
use std::os::unix::fs::FileExt;

/// Sizes that no sane executable exceeds.
const HEADERS_MAX: u64 = 64;
const NOTES_MAX: usize = 64 * 1024;
/// Kind of a program header that is for notes, and kind of the note that is looked for.
const PT_NOTE: u32 = 4;
const NT_GNU_BUILD_ID: u32 = 3;

/// The build, in hexadecimal; `None` if the linker gave it none.
pub fn build() -> Option<String> {
    #[expect(clippy::disallowed_methods, reason = "the executable knows who it is")]
    let file = File::open("/proc/self/exe").ok()?;
    let mut head = [0; 64];
    file.read_exact_at(&mut head, 0).ok()?;
    if !head.starts_with(b"\x7fELF\x02\x01") {
        return None;
    }
    let (at, count) = (long(&head, 32)?, u64::from(u16::from_le_bytes([head[56], head[57]])));
    (0..count.min(HEADERS_MAX)).find_map(|i| {
        let mut header = [0; 56];
        file.read_exact_at(&mut header, at.checked_add(i * 56)?).ok()?;
        let (offset, length) = (long(&header, 8)?, long(&header, 32)?);
        if word(&header, 0)? != PT_NOTE {
            return None;
        }
        let mut notes = vec![0; NOTES_MAX.min(usize::try_from(length).ok()?)];
        file.read_exact_at(&mut notes, offset).ok()?;
        build_id(&notes)
    })
}

/// The identity among notes: length of the name, length of the content, kind, name, content.
fn build_id(mut notes: &[u8]) -> Option<String> {
    loop {
        let (name, content, kind) = (word(notes, 0)? as usize, word(notes, 4)? as usize, word(notes, 8)?);
        let from = 12 + name.next_multiple_of(4);
        if kind == NT_GNU_BUILD_ID && notes.get(12..12 + name)? == b"GNU\0" {
            let bytes = notes.get(from..from + content)?;
            return Some(bytes.iter().map(|byte| format!("{byte:02x}")).collect());
        }
        notes = notes.get(from + content.next_multiple_of(4)..)?;
    }
}

fn word(bytes: &[u8], at: usize) -> Option<u32> {
    Some(u32::from_le_bytes(bytes.get(at..at + 4)?.try_into().ok()?))
}

fn long(bytes: &[u8], at: usize) -> Option<u64> {
    Some(u64::from_le_bytes(bytes.get(at..at + 8)?.try_into().ok()?))
}
