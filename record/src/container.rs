//! MCAP, the container of records and exports. The one file that names the library.
//!
//! Writing goes through the library. Reading walks over the records of the file itself, because a record of a killed run
//! has no index at its end, and because each length is checked before memory is taken for it; what the records hold is
//! parsed by the library.

use mcap::read::parse_record;
use mcap::records::{MessageHeader, Metadata, Record, op};
use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};
use mcap::write::NoSeek;
use mcap::{Attachment, Compression, McapError, WriteOptions, Writer};
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::io::{self, BufWriter, Write};

/// How every MCAP file begins and ends.
pub(crate) const MAGIC: &[u8] = mcap::MAGIC;
/// Opcode and length: what stands before the content of a record of the file.
pub(crate) const HEAD: usize = 9;
/// Bytes that go to the file at once.
const BUFFER: usize = 128 * 1024;
/// No chunk holds more when it is unpacked, bytes.
const UNPACKED_MAX: u64 = 64 << 20;
/// What follows the texts of an attachment besides its content: a length and a checksum, bytes.
const ATTACHMENT_REST_MIN: usize = 8 + 4;
/// LZ4 packs at most this many bytes into one.
const LZ4_RATIO_MAX: u64 = 255;

/// The kinds of records of a file that are told apart.
pub(crate) mod kind {
    use super::op;
    pub(crate) const HEADER: u8 = op::HEADER;
    pub(crate) const CHUNK: u8 = op::CHUNK;
    pub(crate) const MESSAGE_INDEX: u8 = op::MESSAGE_INDEX;
    pub(crate) const ATTACHMENT: u8 = op::ATTACHMENT;
    pub(crate) const METADATA: u8 = op::METADATA;
    pub(crate) const DATA_END: u8 = op::DATA_END;
}

/// An MCAP file that is being written. Messages are gathered until [`Container::end_chunk`].
pub(crate) struct Container<W: Write> {
    writer: Writer<NoSeek<BufWriter<W>>>,
    chunk_bytes: usize,
}

/// How the messages of a channel are encoded.
pub(crate) struct Encoding<'a> {
    /// Of messages: `protobuf`, `cdr`, `json`.
    pub(crate) message: &'a str,
    /// Of the schema: `protobuf`, `ros2msg`, `jsonschema`.
    pub(crate) schema: &'a str,
}

impl<W: Write> Container<W> {
    /// Begins a file. `profile` is `ros2` or empty.
    pub(crate) fn begin(to: W, profile: &str, library: &str) -> io::Result<Container<W>> {
        let options = WriteOptions::new()
            .profile(profile)
            .library(library)
            .compression(Some(Compression::Lz4))
            .chunk_size(None)
            .disable_seeking(true);
        let writer = options.create(NoSeek::new(BufWriter::with_capacity(BUFFER, to))).map_err(to_io)?;
        Ok(Container { writer, chunk_bytes: 0 })
    }

    /// Declares a channel; its number.
    pub(crate) fn channel(
        &mut self,
        topic: &str,
        schema: &str,
        encoding: &Encoding,
        definition: &[u8],
        metadata: &BTreeMap<String, String>,
    ) -> io::Result<u16> {
        let schema = self.writer.add_schema(schema, encoding.schema, definition).map_err(to_io)?;
        self.writer.add_channel(schema, topic, encoding.message, metadata).map_err(to_io)
    }

    /// Adds a message to the chunk. Times are simulated, ns.
    pub(crate) fn message(&mut self, channel: u16, time_ns: u64, sequence: u32, data: &[u8]) -> io::Result<()> {
        self.chunk_bytes += data.len();
        let header = MessageHeader { channel_id: channel, sequence, log_time: time_ns, publish_time: time_ns };
        self.writer.write_to_known_channel(&header, data).map_err(to_io)
    }

    /// What the messages of the open chunk hold, bytes.
    pub(crate) fn chunk_bytes(&self) -> usize {
        self.chunk_bytes
    }

    /// Ends the chunk: what was written so far can be read from now on, whatever happens.
    pub(crate) fn end_chunk(&mut self) -> io::Result<()> {
        self.chunk_bytes = 0;
        self.writer.flush().map_err(to_io)
    }

    /// Adds a file to the file.
    pub(crate) fn attach(&mut self, name: &str, media_type: &str, time_ns: u64, data: &[u8]) -> io::Result<()> {
        self.end_chunk()?;
        let attachment = Attachment {
            log_time: time_ns,
            create_time: 0,
            name: name.to_owned(),
            media_type: media_type.to_owned(),
            data: Cow::Borrowed(data),
        };
        self.writer.attach(&attachment).map_err(to_io)
    }

    /// Adds pairs of texts.
    pub(crate) fn metadata(&mut self, name: &str, metadata: BTreeMap<String, String>) -> io::Result<()> {
        self.end_chunk()?;
        self.writer.write_metadata(&Metadata { name: name.to_owned(), metadata }).map_err(to_io)
    }

    /// Ends the file with its index; gives back what it was written to.
    pub(crate) fn finish(mut self) -> io::Result<W> {
        self.writer.finish().map_err(to_io)?;
        self.writer.into_inner().into_inner().into_inner().map_err(io::IntoInnerError::into_error)
    }
}

fn to_io(error: McapError) -> io::Error {
    match error {
        McapError::Io(error) => error,
        other => io::Error::new(io::ErrorKind::InvalidData, other),
    }
}

/// Opcode and length of the record that begins with these bytes.
pub(crate) fn head(bytes: &[u8; HEAD]) -> (u8, u64) {
    let [kind, length @ ..] = bytes;
    (*kind, u64::from_le_bytes(length.to_owned()))
}

/// What a record of the file holds. The library takes memory for a text as long as the text says it is before it looks whether
/// that is there: so it is looked for here, first.
fn parsed(opcode: u8, data: &[u8]) -> Option<Record<'_>> {
    let mut texts = Texts(data);
    match opcode {
        op::HEADER => texts.text().and_then(|()| texts.text()),
        op::METADATA => texts.text().and_then(|()| texts.pairs()),
        // A length and a checksum follow, which the library takes for granted.
        op::ATTACHMENT => texts
            .skip(16)
            .and_then(|()| texts.text())
            .and_then(|()| texts.text())
            .filter(|()| texts.0.len() >= ATTACHMENT_REST_MIN),
        op::CHUNK => texts.skip(28).and_then(|()| texts.text()),
        op::CHANNEL => {
            texts.skip(4).and_then(|()| texts.text()).and_then(|()| texts.text()).and_then(|()| texts.pairs())
        }
        op::MESSAGE => Some(()),
        _ => None,
    }?;
    parse_record(opcode, data).ok()
}

/// Goes over texts, each behind its length.
struct Texts<'a>(&'a [u8]);

impl Texts<'_> {
    fn skip(&mut self, length: usize) -> Option<()> {
        self.0 = self.0.get(length..)?;
        Some(())
    }

    /// The length that stands here, bytes.
    fn length(&mut self) -> Option<usize> {
        let length = u32::from_le_bytes(*self.0.first_chunk()?) as usize;
        self.skip(4).map(|()| length)
    }

    fn text(&mut self) -> Option<()> {
        let length = self.length()?;
        self.skip(length)
    }

    /// Keys and values, behind the length of them all.
    fn pairs(&mut self) -> Option<()> {
        let length = self.length()?;
        let mut inner = Texts(self.0.get(..length)?);
        while !inner.0.is_empty() {
            inner.text()?;
        }
        self.skip(length)
    }
}

/// The library that a file says it was written with.
pub(crate) fn library(header: &[u8]) -> Option<String> {
    match parsed(op::HEADER, header)? {
        Record::Header(header) => Some(header.library),
        _ => None,
    }
}

/// Name and pairs of a metadata record.
pub(crate) fn metadata(record: &[u8]) -> Option<(String, BTreeMap<String, String>)> {
    match parsed(op::METADATA, record)? {
        Record::Metadata(metadata) => Some((metadata.name, metadata.metadata)),
        _ => None,
    }
}

/// Name and content of an attachment whose checksum fits.
pub(crate) fn attachment(record: &[u8]) -> Option<(String, &[u8])> {
    if record.len() < 40 {
        return None;
    }
    match parsed(op::ATTACHMENT, record)? {
        Record::Attachment { header, data: Cow::Borrowed(data), .. } => Some((header.name, data)),
        _ => None,
    }
}

/// First and last time in a chunk, ns, by the beginning of its record.
pub(crate) fn chunk_times(beginning: &[u8]) -> Option<(u64, u64)> {
    let number = |at: usize| Some(u64::from_le_bytes(beginning.get(at..at + 8)?.try_into().ok()?));
    Some((number(0)?, number(8)?))
}

/// What a chunk holds.
pub(crate) enum Entry<'a> {
    /// Channel and topic.
    Channel(u16, &'a str),
    /// Channel and content.
    Message(u16, &'a [u8]),
}

/// Goes through a chunk whose checksum fits, given with its head; `None` for what is not one.
pub(crate) fn chunk(bytes: &[u8], mut see: impl FnMut(Entry) -> Option<()>) -> Option<()> {
    chunk_records(bytes, |opcode, data| match opcode {
        op::CHANNEL | op::MESSAGE => match parsed(opcode, data)? {
            Record::Channel(channel) => see(Entry::Channel(channel.id, &channel.topic)),
            Record::Message { header, data } => see(Entry::Message(header.channel_id, &data)),
            _ => Some(()),
        },
        _ => Some(()),
    })
}

/// Unpacks a chunk and goes through its records: opcode and content.
fn chunk_records(bytes: &[u8], mut see: impl FnMut(u8, &[u8]) -> Option<()>) -> Option<()> {
    let Record::Chunk { header, .. } = parsed(op::CHUNK, bytes.get(HEAD..)?)? else { return None };
    let packed = header.compression == "lz4";
    let room = if packed { LZ4_RATIO_MAX.saturating_mul(header.compressed_size) } else { header.compressed_size };
    if header.uncompressed_size > room.min(UNPACKED_MAX) {
        return None;
    }
    let mut reader = LinearReader::new_with_options(
        LinearReaderOptions::default()
            .with_skip_start_magic(true)
            .with_skip_end_magic(true)
            .with_prevalidate_chunk_crcs(true)
            .with_record_length_limit(bytes.len().max(header.uncompressed_size as usize)),
    );
    let mut rest = bytes;
    while let Some(event) = reader.next_event() {
        match event.ok()? {
            // At the end of the chunk it asks for what would follow.
            LinearReadEvent::ReadRequest(wanted) => {
                let (next, after) = rest.split_at(wanted.min(rest.len()));
                reader.insert(next.len()).copy_from_slice(next);
                reader.notify_read(next.len());
                rest = after;
            }
            LinearReadEvent::Record { data, opcode } => see(opcode, data)?,
        }
    }
    Some(())
}

/// The same file with chunks that are not packed, and without checksums: for tests that change bytes and have them read.
#[doc(hidden)]
pub fn unpacked(file: &[u8]) -> Option<Vec<u8>> {
    let (mut out, mut rest) = (MAGIC.to_vec(), file.strip_prefix(MAGIC)?);
    let put = |out: &mut Vec<u8>, kind: u8, content: &[u8]| {
        out.push(kind);
        out.extend_from_slice(&(content.len() as u64).to_le_bytes());
        out.extend_from_slice(content);
    };
    while rest.len() > MAGIC.len() {
        let (kind, length) = head(rest.first_chunk()?);
        let (record, after) = rest.split_at_checked(HEAD + usize::try_from(length).ok()?)?;
        match kind {
            op::CHUNK => {
                let mut records = Vec::new();
                chunk_records(record, |opcode, data| {
                    put(&mut records, opcode, data);
                    Some(())
                })?;
                let length = (records.len() as u64).to_le_bytes();
                // First and last time, length, no checksum, no compression, length.
                let head = [&record[HEAD..HEAD + 16], &length, &[0; 8], &length];
                put(&mut out, kind, &[&head.concat(), records.as_slice()].concat());
            }
            op::ATTACHMENT => {
                let content = &record[HEAD..record.len().checked_sub(4)?];
                put(&mut out, kind, &[content, &[0; 4]].concat());
            }
            _ => out.extend_from_slice(record),
        }
        rest = after;
    }
    out.extend_from_slice(rest);
    Some(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_attachment_that_ends_before_its_checksum_is_refused() {
        let text = |length: u32| [&length.to_le_bytes(), vec![b'a'; length as usize].as_slice()].concat();
        for rest in 0..ATTACHMENT_REST_MIN {
            let record = [vec![0; 16], text(20), text(20), vec![0; rest]].concat();
            assert!(attachment(&record).is_none(), "{rest} bytes");
        }
        let record = [vec![0; 16], text(20), text(20), vec![0; ATTACHMENT_REST_MIN]].concat();
        assert_eq!(attachment(&record).map(|(name, content)| (name.len(), content.len())), Some((20, 0)));
    }
}
