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
    /// The bytes are no such value.
    #[error("cannot decode: {0}")]
    Decode(#[from] bincode::error::DecodeError),
    /// Bytes are left over.
    #[error("cannot decode: {0} bytes left over")]
    LeftOver(usize),
}

/// The value as bytes.
///
/// # Errors
/// When serde refuses the value.
pub fn encode<T: Serialize>(value: &T) -> Result<Vec<u8>, CodecError> {
    Ok(bincode::serde::encode_to_vec(value, bincode::config::standard())?)
}

/// The value that the bytes hold, all of them.
///
/// # Errors
/// When the bytes are no such value, or hold more than it.
pub fn decode<T: DeserializeOwned>(bytes: &[u8]) -> Result<T, CodecError> {
    let (value, used) = bincode::serde::decode_from_slice(bytes, bincode::config::standard())?;
    if used < bytes.len() { Err(CodecError::LeftOver(bytes.len() - used)) } else { Ok(value) }
}
