//! Protocol Buffers, as much of it as records need: writing fields, reading them back, and the descriptors that other
//! programs decode the messages with.

/// Appends an unsigned number, seven bits a byte, the lowest first.
pub(crate) fn put_varint(mut value: u64, out: &mut Vec<u8>) {
    while value >= 0x80 {
        out.push(value as u8 | 0x80);
        value >>= 7;
    }
    out.push(value as u8);
}

/// Takes a byte off the front.
pub(crate) fn take_byte(bytes: &mut &[u8]) -> Option<u8> {
    let (first, rest) = bytes.split_first()?;
    *bytes = rest;
    Some(*first)
}

/// Takes a number off the front.
pub(crate) fn take_varint(bytes: &mut &[u8]) -> Option<u64> {
    let mut value = 0;
    for shift in (0..64).step_by(7) {
        let byte = take_byte(bytes)?;
        value |= u64::from(byte & 0x7f) << shift;
        if byte < 0x80 {
            return Some(value);
        }
    }
    None
}

/// How the value of a field follows its key.
const VARINT: u64 = 0;
const FIXED64: u64 = 1;
const LENGTH: u64 = 2;
const FIXED32: u64 = 5;

/// A message that is being written. Fields that have the value 0 are left out, as proto3 has it.
#[derive(Debug, Default)]
pub(crate) struct Message(Vec<u8>);

impl Message {
    /// Begins a message in memory that may have held another one.
    pub(crate) fn reuse(mut memory: Vec<u8>) -> Message {
        memory.clear();
        Message(memory)
    }

    /// Its bytes.
    pub(crate) fn into_bytes(self) -> Vec<u8> {
        self.0
    }

    pub(crate) fn bytes(&self) -> &[u8] {
        &self.0
    }

    fn key(&mut self, field: u32, kind: u64) {
        put_varint(u64::from(field) << 3 | kind, &mut self.0);
    }

    pub(crate) fn uint(&mut self, field: u32, value: u64) -> &mut Message {
        if value != 0 {
            self.key(field, VARINT);
            put_varint(value, &mut self.0);
        }
        self
    }

    pub(crate) fn double(&mut self, field: u32, value: f64) -> &mut Message {
        if value.to_bits() != 0 {
            self.key(field, FIXED64);
            self.0.extend_from_slice(&value.to_le_bytes());
        }
        self
    }

    pub(crate) fn text(&mut self, field: u32, value: &str) -> &mut Message {
        self.blob(field, value.as_bytes())
    }

    pub(crate) fn blob(&mut self, field: u32, value: &[u8]) -> &mut Message {
        if !value.is_empty() {
            self.embed(field, value);
        }
        self
    }

    fn embed(&mut self, field: u32, value: &[u8]) {
        self.key(field, LENGTH);
        put_varint(value.len() as u64, &mut self.0);
        self.0.extend_from_slice(value);
    }

    /// A message in the message.
    pub(crate) fn message(&mut self, field: u32, write: impl FnOnce(&mut Message)) -> &mut Message {
        let mut inner = Message::default();
        write(&mut inner);
        self.embed(field, &inner.0);
        self
    }
}

/// The value of a field.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Value<'a> {
    Number(u64),
    Double(f64),
    Bytes(&'a [u8]),
}

impl<'a> Value<'a> {
    pub(crate) fn number(self) -> Option<u64> {
        if let Value::Number(value) = self { Some(value) } else { None }
    }

    pub(crate) fn bytes(self) -> Option<&'a [u8]> {
        if let Value::Bytes(value) = self { Some(value) } else { None }
    }

    pub(crate) fn double(self) -> Option<f64> {
        if let Value::Double(value) = self { Some(value) } else { None }
    }

    pub(crate) fn text(self) -> Option<&'a str> {
        std::str::from_utf8(self.bytes()?).ok()
    }
}

/// Goes through the fields of a message: number and value of each, but for doubles, which shoal itself reads none of. `None` for bytes that are not a message.
pub(crate) fn fields<'a>(mut bytes: &'a [u8], mut see: impl FnMut(u32, Value<'a>) -> Option<()>) -> Option<()> {
    while !bytes.is_empty() {
        let key = take_varint(&mut bytes)?;
        let value = match key & 7 {
            VARINT => Value::Number(take_varint(&mut bytes)?),
            FIXED64 => {
                let (value, rest) = bytes.split_first_chunk()?;
                bytes = rest;
                Value::Double(f64::from_le_bytes(*value))
            }
            LENGTH => {
                let length = usize::try_from(take_varint(&mut bytes)?).ok()?;
                let (value, rest) = bytes.split_at_checked(length)?;
                bytes = rest;
                Value::Bytes(value)
            }
            FIXED32 => {
                bytes = bytes.get(4..)?;
                continue;
            }
            _ => return None,
        };
        see(u32::try_from(key >> 3).ok()?, value)?;
    }
    Some(())
}
