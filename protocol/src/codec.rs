//! Bytes for everything that is not in the loop: the control plane and the files of a run. The one file that
//! names bincode.

use serde::Serialize;
use serde::de::DeserializeOwned;

/// Why bytes and values do not fit together. Both ends are the same binary, so this means damage.
#[derive(Debug, thiserror::Error)]
pub enum CodecError {
    /// The value cannot be written.
    #[error("cannot encode: {0}")]
    Encode(#[from] bincode::error::EncodeError),
    /// The bytes are not such a value.
    #[error("cannot decode: {0}")]
    Decode(#[from] bincode::error::DecodeError),
    /// Bytes are left over.
    #[error("cannot decode: {0} bytes left over")]
    LeftOver(usize),
    /// The input is larger than anything that is sent or stored.
    #[error("cannot decode: {0} bytes are too many")]
    TooLarge(usize),
}

/// The value as bytes.
///
/// # Errors
/// When serde refuses the value.
pub fn encode<T: Serialize>(value: &T) -> Result<Vec<u8>, CodecError> {
    Ok(bincode::serde::encode_to_vec(value, bincode::config::standard())?)
}

/// The value that the bytes hold, all of them. Bytes that claim to hold more than they can are refused before memory is
/// taken for it: decoding never holds more than [`EXPANSION_MAX`] times the length of the input and [`RESERVE_MAX`].
///
/// # Errors
/// When the bytes are not such a value, or hold more than it.
pub fn decode<T: DeserializeOwned>(bytes: &[u8]) -> Result<T, CodecError> {
    // bincode's limit is a constant: the smallest of these that the input may need.
    macro_rules! decode_within {
        ($($limit:literal)*) => {
            match bytes.len().saturating_mul(EXPANSION).saturating_add(1024) {
                $(needed if needed <= 1 << $limit => decode_limited::<T, { 1 << $limit }>(bytes),)*
                _ => Err(CodecError::TooLarge(bytes.len())),
            }
        };
    }
    decode_within!(12 14 16 18 20 22 24 26 28 30 32 34 36)
}

/// A number of eight bytes may be encoded in one, and bincode counts it as eight.
const EXPANSION: usize = 8;
/// Memory that decoding takes at most for what it has read, as a multiple of the input: an element of a list takes up to
/// 23 times its encoding (a [`model::Problem`] of empty texts), and while a list grows, its memory is there
/// three times.
pub const EXPANSION_MAX: usize = 96;
/// Memory that decoding may take for what it has not read, bytes: serde reserves up to 1 MiB for a list before its first
/// element, and lists of messages are two deep; a text is reserved up to the limit of bincode, 4 KiB for short inputs.
pub const RESERVE_MAX: usize = (2 << 20) + (8 << 10);

fn decode_limited<T: DeserializeOwned, const LIMIT: usize>(bytes: &[u8]) -> Result<T, CodecError> {
    let config = bincode::config::standard().with_limit::<LIMIT>();
    let (value, used) = bincode::serde::decode_from_slice(bytes, config)?;
    if used < bytes.len() { Err(CodecError::LeftOver(bytes.len() - used)) } else { Ok(value) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::operator_to_daemon::Request;

    #[test]
    fn a_length_that_the_input_cannot_hold_is_refused_before_memory_is_taken_for_it() {
        // A task for a robot whose name has 2^62 bytes.
        assert!(decode::<Request>(&[0x02, 0xfd, 0, 0, 0, 0, 0, 0, 0, 0x40]).is_err());
        // Lists of as many elements.
        assert!(decode::<Vec<u64>>(&[0xfd, 0, 0, 0, 0, 0, 0, 0, 0x40, 1]).is_err());
        assert!(decode::<Vec<String>>(&[0xfd, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 1, 65]).is_err());
    }

    #[test]
    fn what_fits_is_read_whatever_its_size() {
        for count in [0, 1, 100, 10_000, 1_000_000] {
            let small: Vec<u64> = vec![1; count];
            assert_eq!(decode::<Vec<u64>>(&encode(&small).unwrap()).unwrap(), small);
            let text = "x".repeat(count);
            assert_eq!(decode::<String>(&encode(&text).unwrap()).unwrap(), text);
        }
    }
}
