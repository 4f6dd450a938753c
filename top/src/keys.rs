//! Keys, from the bytes that a terminal sends. The bytes are read by this crate's shell: a terminal that has gone is noticed there.

/// A key.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Key {
    /// A character.
    Char(char),
    /// Enter.
    Enter,
    /// Escape.
    Esc,
    /// Backspace.
    Backspace,
    /// Tab.
    Tab,
    /// Arrow up.
    Up,
    /// Arrow down.
    Down,
    /// Page up.
    PageUp,
    /// Page down.
    PageDown,
    /// Home.
    Home,
    /// End.
    End,
    /// Ctrl-C.
    Interrupt,
}

/// The keys in what was read in one piece. What is not known is left out.
pub(crate) fn keys(bytes: &[u8]) -> Vec<Key> {
    let (mut keys, mut rest) = (Vec::new(), bytes);
    while let Some((&first, after)) = rest.split_first() {
        let (key, next) = match first {
            0x1b if after.first().is_some_and(|byte| matches!(byte, b'[' | b'O')) => sequence(&after[1..]),
            0x1b => (Some(Key::Esc), after),
            b'\r' | b'\n' => (Some(Key::Enter), after),
            b'\t' => (Some(Key::Tab), after),
            0x08 | 0x7f => (Some(Key::Backspace), after),
            0x03 => (Some(Key::Interrupt), after),
            byte if byte < 0x20 => (None, after),
            _ => character(rest),
        };
        keys.extend(key);
        rest = next;
    }
    keys
}

/// What follows `ESC [` or `ESC O`: parameters, and a letter or `~` at the end.
fn sequence(bytes: &[u8]) -> (Option<Key>, &[u8]) {
    let Some(end) = bytes.iter().position(|byte| (0x40..=0x7e).contains(byte)) else { return (None, &[]) };
    let key = match (&bytes[..end], bytes[end]) {
        (_, b'A') => Some(Key::Up),
        (_, b'B') => Some(Key::Down),
        (_, b'H') | (b"1" | b"7", b'~') => Some(Key::Home),
        (_, b'F') | (b"4" | b"8", b'~') => Some(Key::End),
        (b"5", b'~') => Some(Key::PageUp),
        (b"6", b'~') => Some(Key::PageDown),
        _ => None,
    };
    (key, &bytes[end + 1..])
}

/// The character at the front.
fn character(bytes: &[u8]) -> (Option<Key>, &[u8]) {
    let longest = bytes.len().min(4);
    for length in 1..=longest {
        if let Ok(text) = std::str::from_utf8(&bytes[..length]) {
            return (text.chars().next().map(Key::Char), &bytes[length..]);
        }
    }
    (None, &bytes[1..])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_become_keys() {
        let check = |bytes: &[u8], expected: &[Key]| assert_eq!(keys(bytes), expected, "{bytes:?}");
        check(b"q\r", &[Key::Char('q'), Key::Enter]);
        check(b"\x1b[A\x1bOB\x1b[5~\x1b[6~", &[Key::Up, Key::Down, Key::PageUp, Key::PageDown]);
        check(b"\x1b[1~\x1b[F", &[Key::Home, Key::End]);
        check(b"\x1b", &[Key::Esc]);
        check(b"\x1bx", &[Key::Esc, Key::Char('x')]);
        check("\u{e9}\t\x7f\x03".as_bytes(), &[Key::Char('\u{e9}'), Key::Tab, Key::Backspace, Key::Interrupt]);
        // A sequence that nobody knows, one that is cut, and what is no text.
        check(b"\x1b[1;5Cj", &[Key::Char('j')]);
        check(b"\x1b[1;5", &[]);
        check(b"\xffk\x1a", &[Key::Char('k')]);
    }
}
