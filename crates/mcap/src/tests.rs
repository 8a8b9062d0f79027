// SPDX-License-Identifier: Apache-2.0
//! Tests that a written file can be read completely, that a truncated file can be read up to the cut, and that a damaged file yields
//! nothing that was not written.
use crate::records::{CHUNK, CHUNK_INDEX, DATA_END, FOOTER, Fields, MAGIC, Rest};
use crate::sound::HEAD;
use crate::{Reader, Record, Schema, Unreadable, Writer};
use proptest::prelude::*;
use std::collections::BTreeMap;

/// A record of a file, as its reader returns it.
#[derive(Clone, Debug, PartialEq)]
enum WrittenRecord {
    Channel {
        id: u16,
        topic: String,
        encoding: String,
        metadata: BTreeMap<String, String>,
    },
    Message {
        channel: u16,
        sequence: u32,
        time: u64,
        data: Vec<u8>,
    },
    Metadata {
        name: String,
        texts: BTreeMap<String, String>,
    },
    /// Not a record; marks where the chunk is finished.
    Chunk,
}

impl From<Record<'_>> for WrittenRecord {
    fn from(record: Record<'_>) -> WrittenRecord {
        match record {
            Record::Channel { id, topic, encoding, metadata } => WrittenRecord::Channel { id, topic, encoding, metadata },
            Record::Message { channel, sequence, time, data } => WrittenRecord::Message { channel, sequence, time, data: data.to_vec() },
            Record::Metadata { name, texts } => WrittenRecord::Metadata { name, texts },
        }
    }
}

fn texts() -> impl Strategy<Value = BTreeMap<String, String>> {
    prop::collection::btree_map("[a-z]{0,4}", "\\PC{0,4}", 0..3)
}

fn written() -> impl Strategy<Value = WrittenRecord> {
    prop_oneof![
        1 => ("[a-z/]{0,8}", "[a-z]{0,8}", texts()).prop_map(|(topic, encoding, metadata)| WrittenRecord::Channel { id: 0, topic, encoding, metadata }),
        6 => (any::<u16>(), any::<u32>(), any::<u64>(), prop::collection::vec(any::<u8>(), 0..60))
            .prop_map(|(channel, sequence, time, data)| WrittenRecord::Message { channel, sequence, time, data }),
        1 => ("[a-z]{0,4}", texts()).prop_map(|(name, texts)| WrittenRecord::Metadata { name, texts }),
        1 => Just(WrittenRecord::Chunk),
    ]
}

/// Creates a file with these records. Returns the file, the expected output of its reader, and the end of each chunk with the number of
/// records up to that point.
fn file(of: &[WrittenRecord]) -> (Vec<u8>, Vec<WrittenRecord>, Vec<(usize, usize)>) {
    let schema = Schema { name: "form".to_owned(), encoding: "jsonschema", text: "{}".to_owned() };
    let mut writer = Writer::new(Vec::new(), "tests").expect("memory has room");
    let (mut expected, mut ends) = (Vec::new(), Vec::new());
    for (place, record) in of.iter().enumerate() {
        match record {
            WrittenRecord::Channel { topic, encoding, metadata, .. } => {
                let id = writer.channel(topic, encoding, Some(&schema).filter(|_| place % 2 == 0), metadata).expect("a file has many numbers");
                expected.push(WrittenRecord::Channel { id, topic: topic.clone(), encoding: encoding.clone(), metadata: metadata.clone() });
                continue;
            }
            WrittenRecord::Message { channel, sequence, time, data } => {
                writer.put(*channel, *sequence, *time, data);
                expected.push(record.clone());
                continue;
            }
            WrittenRecord::Metadata { name, texts } => {
                // The chunk must come first.
                writer.finish_chunk().expect("memory has room");
                ends.push((writer.position() as usize, expected.len()));
                writer.metadata(name, texts).expect("memory has room");
                expected.push(record.clone());
            }
            WrittenRecord::Chunk => writer.finish_chunk().expect("memory has room"),
        }
        ends.push((writer.position() as usize, expected.len()));
    }
    writer.finish().expect("memory has room");
    (writer.into_sink(), expected, ends)
}

/// Returns the messages of a file up to its end or its damage, and its state: complete, cut off, or the error.
fn read(bytes: &[u8]) -> (Vec<WrittenRecord>, Result<bool, Unreadable>) {
    let mut found = Vec::new();
    let mut reader = match Reader::new(bytes) {
        Ok(reader) => reader,
        Err(why) => return (found, Err(why)),
    };
    loop {
        match reader.next_record() {
            Ok(Some(record)) => {
                let record = WrittenRecord::from(record);
                // Chunks repeat channels.
                if !matches!(record, WrittenRecord::Channel { .. }) || !found.contains(&record) {
                    found.push(record);
                }
            }
            Ok(None) => {
                assert_ne!(reader.is_whole(), reader.is_cut_off());
                assert!(reader.next_record().expect("nothing more").is_none());
                return (found, Ok(reader.is_whole()));
            }
            Err(why) => {
                assert!(reader.next_record().expect("nothing more").is_none() && !reader.is_whole() && !reader.is_cut_off());
                return (found, Err(why));
            }
        }
    }
}

/// Returns a file with the records of `compressed`, in which `chunk` recreates the chunks from their content.
pub(crate) fn with_chunks(compressed: &[u8], chunk: impl Fn(&[u8]) -> Vec<u8>) -> Vec<u8> {
    let (mut rest, mut out) = (Rest(&compressed[MAGIC.len()..]), MAGIC.to_vec());
    while let Some((code, mut fields)) = rest.record() {
        if code == CHUNK {
            let times = fields.take(8 + 8).expect("fields of a chunk");
            fields.take(8 + 4 + 4 + "lz4".len() + 8).expect("fields of a chunk");
            let mut records = Vec::new();
            std::io::copy(&mut lz4_flex::frame::FrameDecoder::new(fields.0), &mut records).expect("what was compressed");
            let mut made = chunk(&records);
            if made[0] == CHUNK {
                made[HEAD as usize..HEAD as usize + times.len()].copy_from_slice(times);
            }
            out.extend(made);
        } else {
            let mut fields = fields.0.to_vec();
            if code == FOOTER {
                // The footer's positions are those of the other file, so its checksum is omitted.
                let sum = fields.len() - size_of::<u32>();
                fields[sum..].fill(0);
            }
            Fields(fields).record(code, &mut out);
        }
    }
    out.extend(rest.0);
    out
}

fn chunk(size: usize, sum: u32, compression: &str, bytes: &[u8]) -> Vec<u8> {
    let mut fields = Fields::default().u64(0).u64(0).u64(size as u64).u32(sum).text(compression).u64(bytes.len() as u64);
    fields.0.extend(bytes);
    let mut out = Vec::new();
    fields.record(CHUNK, &mut out);
    out
}

pub(crate) fn plain(records: &[u8]) -> Vec<u8> {
    chunk(records.len(), crc32fast::hash(records), "", records)
}

fn message(channel: u16, data: &[u8]) -> WrittenRecord {
    WrittenRecord::Message { channel, sequence: 7, time: 9, data: data.to_vec() }
}

/// Creates a file with three chunks and two metadata records.
fn example() -> (Vec<u8>, Vec<WrittenRecord>, Vec<(usize, usize)>) {
    let channel = WrittenRecord::Channel { id: 0, topic: "/here".to_owned(), encoding: "json".to_owned(), metadata: BTreeMap::new() };
    let told = |name: &str| WrittenRecord::Metadata { name: name.to_owned(), texts: [("by".to_owned(), "us".to_owned())].into() };
    let messages = |from: u8| [message(1, &[from; 40]), message(1, &[]), message(1, &[from + 1; 40])];
    let mut all = vec![told("begin"), channel];
    for from in [1, 3, 5] {
        all.extend(messages(from));
        all.push(WrittenRecord::Chunk);
    }
    all.push(told("end"));
    file(&all)
}

proptest! {
    #[test]
    fn what_was_written_is_read(of in prop::collection::vec(written(), 0..60)) {
        let (bytes, expected, _) = file(&of);
        for bytes in [with_chunks(&bytes, plain), with_chunks(&bytes, <[u8]>::to_vec), bytes] {
            let (found, whole) = read(&bytes);
            prop_assert_eq!(&found, &expected);
            prop_assert!(whole.is_ok_and(|whole| whole));
        }
    }

    #[test]
    fn any_bytes_are_no_panic(bytes in prop::collection::vec(any::<u8>(), 0..200), code in 0..16u8, len in 0..250u64) {
        let mut file = MAGIC.to_vec();
        file.push(code);
        file.extend(len.to_le_bytes());
        file.extend(&bytes);
        let _as_it_is = read(&file);
        let _inside = read(&with_chunks(&example().0, |_| plain(&file[MAGIC.len()..])));
        let _packed = read(&with_chunks(&example().0, |_| chunk(bytes.len(), 0, "lz4", &bytes)));
    }
}

#[test]
fn a_file_that_is_cut_off_is_read_up_to_its_last_whole_chunk() {
    let (bytes, expected, ends) = example();
    let data_end = bytes.len() - {
        let mut rest = Rest(&bytes[MAGIC.len()..]);
        while rest.record().expect("a whole file").0 != DATA_END {}
        rest.0.len()
    };
    for cut in 0..bytes.len() {
        let (found, whole) = read(&bytes[..cut]);
        if cut < MAGIC.len() {
            assert!(matches!(whole, Err(Unreadable::NoMcap)), "{cut}: {whole:?}");
            continue;
        }
        let count = ends.iter().take_while(|(end, _)| *end <= cut).last().map_or(0, |(_, count)| *count);
        // A chunk is complete before its index is.
        let is_chunk_more = ends.iter().any(|(end, with)| *end > cut && *with == found.len());
        assert!(found.len() == count || is_chunk_more, "{} records cut at {cut}", found.len());
        assert_eq!(found, expected[..found.len()], "cut at {cut}");
        assert_eq!(whole.expect("no damage"), cut >= data_end, "cut at {cut}");
        // A file system has allocated this space, and it was never written.
        let mut unfilled = bytes[..cut].to_vec();
        unfilled.extend([0; 100]);
        if ends.iter().any(|(end, _)| *end == cut) {
            let (found, whole) = read(&unfilled);
            assert_eq!((found, whole.ok()), (expected[..count].to_vec(), Some(false)));
        }
    }
}

#[test]
fn damage_brings_nothing_that_was_not_written() {
    let (bytes, expected, _) = example();
    for bytes in [with_chunks(&bytes, plain), bytes] {
        let mut rest = Rest(&bytes[MAGIC.len()..]);
        while let Some((code, fields)) = rest.record() {
            let end = bytes.len() - rest.0.len();
            for place in end - fields.0.len()..end {
                for bit in 0..8 {
                    let mut damaged = bytes.clone();
                    damaged[place] ^= 1 << bit;
                    let (found, whole) = read(&damaged);
                    if code == CHUNK {
                        assert_eq!(found, expected[..found.len()], "bit {bit} of byte {place}");
                        assert!(whole.is_err() || found.len() == expected.len(), "bit {bit} of byte {place}");
                    }
                }
            }
        }
        for place in 0..bytes.len() {
            let mut damaged = bytes.clone();
            damaged[place] = !damaged[place];
            let _no_panic = read(&damaged);
        }
    }
}

#[test]
fn damage_is_said_with_its_place() {
    let (bytes, expected, ends) = example();
    let why = |bytes: &[u8]| read(bytes).1.expect_err("damaged").to_string();
    // This is the third chunk, followed by its index.
    let (begin, before) = ends[ends.len() - 4];
    let mut damaged = bytes.clone();
    damaged[begin + 80] ^= 1;
    let (found, damage) = read(&damaged);
    assert_eq!(found, expected[..before], "what lies before the damage");
    assert!(damage.expect_err("damaged").to_string().starts_with(&format!("it is damaged at byte {begin}: a chunk ")));
    assert!(why(&with_chunks(&bytes, |records| chunk(records.len(), 1, "", records))).ends_with("the checksum of a chunk does not match"));
    assert!(why(&with_chunks(&bytes, |records| chunk(records.len() + 1, 0, "", records))).ends_with("the length of a chunk does not match its content"));
    assert!(why(&with_chunks(&bytes, |records| chunk(1 << 40, 0, "lz4", records))).ends_with("a chunk has an impossible length"));
    assert!(why(&with_chunks(&bytes, |records| plain(&records[1..]))).contains("a record"));
    assert!(why(&with_chunks(&bytes, |records| plain(&plain(records)))).ends_with("a chunk contains an impossible record"));
    assert!(read(&with_chunks(&bytes, |records| chunk(records.len(), 0, "", records))).1.is_ok_and(|whole| whole), "without a checksum");
}

#[test]
fn another_compression_is_named() {
    let other = with_chunks(&example().0, |records| chunk(records.len(), 0, "zstd", records));
    assert_eq!(read(&other).1.expect_err("another compression").to_string(), "it is compressed with 'zstd'");
}

#[test]
fn a_record_that_is_longer_than_its_file_takes_no_memory() {
    for code in [1, 4, 5, 6, 8, 12, 200] {
        let longer = |len: u64| [&MAGIC[..], &[code], &len.to_le_bytes(), &[0; 50]].concat();
        assert_eq!(read(&longer(51)).1.ok(), Some(false), "record {code}: cut off");
        assert_eq!(read(&longer(1 << 32)).1.ok(), Some(false), "record {code}: cut off");
        let why = read(&longer(u64::MAX)).1.expect_err("damaged").to_string();
        assert_eq!(why, "it is damaged at byte 8: a record has an impossible length");
    }
}

#[test]
fn a_file_has_no_more_channels_than_numbers() {
    let mut writer = Writer::new(Vec::new(), "tests").expect("memory has room");
    for number in 1..=u16::MAX {
        assert_eq!(writer.channel("", "", None, &BTreeMap::new()), Some(number));
    }
    assert_eq!(writer.channel("", "", None, &BTreeMap::new()), None);
}

#[test]
fn a_writer_does_not_grow_without_end() {
    let has_index = |chunks: u64| {
        let mut writer = Writer::new(Vec::new(), "tests").expect("memory has room");
        for time in 0..chunks {
            // Each channel takes space in the index of a chunk.
            (0..=u16::MAX).for_each(|channel| writer.put(channel, 0, time, &[]));
            writer.finish_chunk().expect("memory has room");
        }
        writer.finish().expect("memory has room");
        let bytes = writer.into_sink();
        assert!(read(&bytes).1.is_ok_and(|whole| whole));
        let mut rest = Rest(&bytes[MAGIC.len()..]);
        std::iter::from_fn(|| rest.record()).any(|(code, _)| code == CHUNK_INDEX)
    };
    assert!(has_index(2));
    assert!(!has_index(60));
}

#[test]
fn channels_apart_have_chunks_of_their_own() {
    let mut writer = Writer::new(Vec::new(), "tests").expect("memory has room");
    let value = writer.channel("value", "json", None, &BTreeMap::new()).expect("a number");
    let told = writer.channel("told", "json", None, &BTreeMap::new()).expect("a number");
    writer.set_apart(told);
    for time in 0..100 {
        writer.put(value, 0, time, &[1; 40_000]);
        writer.put(told, 0, time, b"{}");
        if writer.is_full() {
            writer.finish_full().expect("memory has room");
            assert!(writer.is_filling(told) && !writer.is_filling(value));
        }
    }
    writer.finish().expect("memory has room");
    let (found, whole) = read(&writer.into_sink());
    assert!(whole.is_ok_and(|whole| whole));
    let channels: Vec<u16> = found.iter().filter_map(|one| if let WrittenRecord::Message { channel, .. } = one { Some(*channel) } else { None }).collect();
    assert_eq!(channels, [vec![value; 100], vec![told; 100]].concat());
    assert!(matches!(&found[1], WrittenRecord::Channel { id, .. } if *id == told), "a channel is described before its messages");
}
