//! What other programs need to decode the messages: descriptors, made of the `.proto` files in `schemas/`.
//!
//! The files are read with a parser of the few forms that they use, when a record is begun: no compiler of protocol
//! buffers takes part in the build.

use crate::wire::Message;

/// The messages of shoal's own channels.
const SHOAL: &str = include_str!("schemas/shoal.proto");
/// The messages that viewers know.
const FOXGLOVE: &str = include_str!("schemas/foxglove.proto");
/// What those messages take from protocol buffers.
const TIMESTAMP: &str = "package google.protobuf; message Timestamp { int64 seconds = 1; int32 nanos = 2; }";
const DURATION: &str = "package google.protobuf; message Duration { int64 seconds = 1; int32 nanos = 2; }";

/// The descriptors (a `FileDescriptorSet`) with which a message of this name, as in `foxglove.Log`, is decoded.
pub(crate) fn descriptors(name: &str) -> Vec<u8> {
    let mut set = Message::default();
    if name.starts_with("foxglove.") {
        set.message(1, |file| describe(TIMESTAMP, "google/protobuf/timestamp.proto", &[], file));
        set.message(1, |file| describe(DURATION, "google/protobuf/duration.proto", &[], file));
        let needed = ["google/protobuf/timestamp.proto", "google/protobuf/duration.proto"];
        set.message(1, |file| describe(FOXGLOVE, "foxglove.proto", &needed, file));
    } else {
        set.message(1, |file| describe(SHOAL, "shoal.proto", &[], file));
    }
    set.into_bytes()
}

/// The numbers of a `FieldDescriptorProto`.
const OPTIONAL: u64 = 1;
const REPEATED: u64 = 3;
const ENUM: u64 = 14;
const MESSAGE: u64 = 11;

fn scalar(word: &str) -> Option<u64> {
    let scalars = [
        ("double", 1),
        ("int64", 3),
        ("uint64", 4),
        ("int32", 5),
        ("fixed32", 7),
        ("bool", 8),
        ("string", 9),
        ("bytes", 12),
        ("uint32", 13),
    ];
    scalars.iter().find(|(name, _)| *name == word).map(|(_, number)| *number)
}

/// The words of a file, without its comments: braces, equals signs and semicolons are words of their own.
fn words(text: &str) -> Vec<String> {
    let code: String = text.lines().map(|line| line.split("//").next().unwrap_or("")).collect::<Vec<_>>().join("\n");
    let spaced = ["{", "}", "=", ";"].iter().fold(code, |code, mark| code.replace(mark, &format!(" {mark} ")));
    spaced.split_whitespace().map(str::to_owned).collect()
}

/// Writes the `FileDescriptorProto` of a file. The files are ours: what they do not use is not understood.
fn describe(text: &str, path: &str, needed: &[&str], file: &mut Message) {
    let words = words(text);
    let mut words = words.iter().map(String::as_str).peekable();
    let mut package = "";
    file.text(1, path);
    while let Some(word) = words.next() {
        match word {
            "syntax" => words.by_ref().take_while(|word| *word != ";").for_each(drop),
            "package" => {
                package = words.next().unwrap_or_default();
                file.text(2, package);
                for path in needed {
                    file.text(3, path);
                }
                words.next();
            }
            "message" => {
                let name = words.next().unwrap_or_default();
                words.next();
                let mut enums: Vec<&str> = Vec::new();
                file.message(4, |message| {
                    message.text(1, name);
                    while let Some(word) = words.next().filter(|word| *word != "}") {
                        if word == "enum" {
                            enums.push(words.next().unwrap_or_default());
                            words.next();
                            message.message(4, |own| {
                                own.text(1, enums.last().copied().unwrap_or_default());
                                while let Some(value) = words.next().filter(|word| *word != "}") {
                                    let number = number(&mut words);
                                    own.message(2, |entry| {
                                        entry.text(1, value).uint(2, number);
                                    });
                                }
                            });
                            continue;
                        }
                        let (label, kind) = match word {
                            "repeated" => (REPEATED, words.next().unwrap_or_default()),
                            kind => (OPTIONAL, kind),
                        };
                        let field = words.next().unwrap_or_default();
                        let number = number(&mut words);
                        message.message(2, |own| {
                            own.text(1, field).uint(3, number).uint(4, label);
                            match scalar(kind) {
                                Some(scalar) => own.uint(5, scalar),
                                None if enums.contains(&kind) => {
                                    own.uint(5, ENUM).text(6, &format!(".{package}.{name}.{kind}"))
                                }
                                None if kind.contains('.') => own.uint(5, MESSAGE).text(6, &format!(".{kind}")),
                                None => own.uint(5, MESSAGE).text(6, &format!(".{package}.{kind}")),
                            };
                        });
                    }
                });
            }
            _ => {}
        }
    }
    file.text(12, "proto3");
}

/// Takes `= NUMBER ;`.
fn number<'a>(words: &mut impl Iterator<Item = &'a str>) -> u64 {
    words.next();
    let number = words.next().and_then(|word| word.parse().ok()).unwrap_or_default();
    words.next();
    number
}
