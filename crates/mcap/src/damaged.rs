// SPDX-License-Identifier: Apache-2.0
//! Tests of damaged files: every message of an intact chunk is read, no message appears that was not written, and losses are reported.
use crate::records::{CHUNK, MAGIC, Rest};
use crate::sound::HEAD;
use crate::tests::{plain, with_chunks};
use crate::{Damage, IndexedFile, Schema, Unreadable, Writer};
use proptest::prelude::*;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{Seek, Write};
use std::ops::Range;
use std::os::fd::FromRawFd;

/// Message: its channel, time, and bytes.
type RawMessage = (u16, u64, Vec<u8>);

/// Positions of chunks, and the messages of each.
type Chunks = Vec<(Range<usize>, Vec<RawMessage>)>;

const CHUNKS: u64 = 12;

/// Creates a recording of several chunks. Returns it with the messages of each chunk and the chunk's position in the file.
fn recording(is_packed: bool, has_end: bool) -> (Vec<u8>, Chunks) {
    let schema = Schema { name: "form".to_owned(), encoding: "jsonschema", text: "{}".to_owned() };
    let mut writer = Writer::new(Vec::new(), "tests").expect("memory has room");
    writer.metadata("begin", &[("by".to_owned(), "us".to_owned())].into()).expect("memory has room");
    let channels: Vec<u16> = ["a", "b", "c"].iter().filter_map(|topic| writer.channel(topic, "json", Some(&schema), &BTreeMap::new())).collect();
    let mut chunks: Vec<Vec<RawMessage>> = Vec::new();
    for at in 0..CHUNKS {
        let messages: Vec<RawMessage> =
            (0..10 + at).map(|n| (channels[(n % 3) as usize], 1000 * at + n, format!("{{\"value\":{},\"number\":{n}}}", n * n * 7919).into_bytes())).collect();
        messages.iter().for_each(|(channel, time, data)| writer.put(*channel, 0, *time, data));
        chunks.push(messages);
        writer.finish_chunk().expect("memory has room");
    }
    writer.metadata("end", &BTreeMap::new()).expect("memory has room");
    if has_end {
        writer.finish().expect("memory has room");
    }
    let packed = writer.into_sink();
    let bytes = if is_packed { packed } else { with_chunks(&packed, plain) };
    let places = places(&bytes);
    (bytes, places.into_iter().zip(chunks).collect())
}

/// Returns the positions of the chunks of an intact file.
fn places(bytes: &[u8]) -> Vec<Range<usize>> {
    let (mut rest, mut at, mut found) = (Rest(&bytes[MAGIC.len()..]), MAGIC.len(), Vec::new());
    while let Some((code, fields)) = rest.record() {
        let end = at + HEAD as usize + fields.0.len();
        if code == CHUNK {
            found.push(at..end);
        }
        at = end;
    }
    found
}

/// Creates a file in memory.
fn file(bytes: &[u8]) -> File {
    // SAFETY: a new descriptor, which has no other owner.
    let mut file = unsafe { File::from_raw_fd(libc::memfd_create(c"recording".as_ptr(), libc::MFD_CLOEXEC)) };
    file.write_all(bytes).expect("memory has room");
    file.rewind().expect("a file in memory");
    file
}

/// Reads a file. Returns its messages and the reported damage.
fn read(bytes: &[u8]) -> Result<(Vec<RawMessage>, Vec<Damage>, bool), Unreadable> {
    let indexed = IndexedFile::open(file(bytes))?;
    let (mut said, mut damage) = (Vec::new(), indexed.damage());
    for at in 0..indexed.chunks.len() {
        match indexed.chunk(at) {
            Ok(chunk) => {
                for (channel, messages) in &chunk.messages {
                    said.extend(messages.iter().map(|message| (*channel, message.time, chunk.data(message).to_vec())));
                }
            }
            Err(Unreadable::Damaged { what, .. }) => damage.push(indexed.damage_of(at, what)),
            Err(why) => return Err(why),
        }
    }
    Ok((said, damage, indexed.is_whole()))
}

/// Checks that reading a damaged file has the required properties. `touched` lists the ranges that differ from those written, including
/// those beyond the end of a truncated file.
fn check(bytes: &[u8], chunks: &[(Range<usize>, Vec<RawMessage>)], touched: &[Range<usize>]) -> Result<(), TestCaseError> {
    // The file has lost both its magic and the record that identifies it.
    if touched.iter().any(|range| range.start < 8) && touched.iter().any(|range| (8..60).contains(&range.start) || range.end > 8) {
        let _no_panic = read(bytes);
        return Ok(());
    }
    let (said, damage, is_whole) = read(bytes).map_err(|why| TestCaseError::fail(why.to_string()))?;
    for one in &said {
        prop_assert!(chunks.iter().any(|(_, messages)| messages.contains(one)), "{one:?} was not written");
    }
    for (place, messages) in chunks {
        let is_read = messages.iter().all(|one| said.contains(one));
        let hit = touched.iter().find(|range| range.start < place.end && place.start < range.end);
        let Some(hit) = hit else {
            prop_assert!(is_read, "the sound chunk at {place:?} is not read; {touched:?} was touched, {damage:?}");
            continue;
        };
        let begins = hit.start.max(place.start) as u64;
        let told: Vec<&Damage> = damage.iter().filter(|damage| damage.bytes.start <= place.end as u64 && damage.bytes.end >= place.start as u64).collect();
        let is_cut = !is_whole && begins >= bytes.len() as u64;
        prop_assert!(!told.is_empty() || is_cut, "the damage of the chunk at {place:?} is not told: {touched:?} was touched, {damage:?}");
        if !is_read && touched.len() == 1 && !told.is_empty() {
            let is_right = |damage: &&Damage| damage.counts.as_ref().is_none_or(|counts| counts.values().sum::<usize>() == messages.len());
            prop_assert!(told.iter().any(is_right), "{} messages are lost of the chunk at {place:?}: {damage:?}", messages.len());
        }
    }
    Ok(())
}

/// Returns the positions of bytes that differ from those written. There may be fewer than expected: a byte may be overwritten with the
/// same value, or a bit flipped twice.
fn changed<'a>(written: &'a [u8], bytes: &'a [u8]) -> impl Iterator<Item = usize> + 'a {
    (0..bytes.len()).filter(|at| written[*at] != bytes[*at])
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 100, ..ProptestConfig::default() })]

    #[test]
    fn turned_bits_cost_the_chunks_that_they_hit(is_packed: bool, has_end: bool, bits in prop::collection::vec((any::<prop::sample::Index>(), 0..8u8), 1..9)) {
        let (mut bytes, chunks) = recording(is_packed, has_end);
        let written = bytes.clone();
        for (index, bit) in bits {
            let at = index.index(bytes.len());
            bytes[at] ^= 1 << bit;
        }
        let touched: Vec<_> = changed(&written, &bytes).map(|at| at..at + 1).collect();
        check(&bytes, &chunks, &touched)?;
    }

    #[test]
    fn a_block_that_is_gone_costs_the_chunks_that_it_hits(
        is_packed: bool, has_end: bool, at: prop::sample::Index, len in 1..2000usize, with in prop_oneof![Just(Some(0)), Just(Some(0xff)), Just(None)],
    ) {
        let (mut bytes, chunks) = recording(is_packed, has_end);
        let written = bytes.clone();
        let begins = at.index(bytes.len());
        let ends = (begins + len).min(bytes.len());
        match with {
            Some(byte) => bytes[begins..ends].fill(byte),
            None => (begins..ends).for_each(|at| bytes[at] = ((at * 2_654_435_761) >> 7) as u8),
        }
        let touched: Vec<_> = changed(&written, &bytes).min().zip(changed(&written, &bytes).max()).map(|(first, last)| first..last + 1).into_iter().collect();
        check(&bytes, &chunks, &touched)?;
    }

    #[test]
    fn a_cut_costs_what_lies_behind_it(is_packed: bool, has_end: bool, at: prop::sample::Index) {
        let (bytes, chunks) = recording(is_packed, has_end);
        let cut = at.index(bytes.len());
        check(&bytes[..cut], &chunks, std::slice::from_ref(&(cut..bytes.len())))?;
    }

    #[test]
    fn any_bytes_are_read_to_an_end(bytes in prop::collection::vec(0..16u8, 0..3000)) {
        let _no_panic = read(&[&recording(true, true).0[..100], &bytes].concat());
    }
}

#[test]
fn each_bit_of_a_recording_may_turn() {
    for (is_packed, has_end) in [(true, true), (true, false), (false, true)] {
        let (bytes, chunks) = recording(is_packed, has_end);
        // These are the heads of chunks and the indexes before them, in full.
        let is_head = |at: usize| chunks.iter().any(|(place, _)| (place.start.saturating_sub(30)..place.start + 70).contains(&at));
        for at in (0..bytes.len()).filter(|at| at % 7 == 0 || is_head(*at) || *at > bytes.len() - 100) {
            let mut turned = bytes.clone();
            turned[at] ^= 1 << (at % 8);
            check(&turned, &chunks, std::slice::from_ref(&(at..at + 1))).unwrap_or_else(|why| panic!("bit {} of byte {at}: {why}", at % 8));
        }
    }
}

#[test]
fn a_chunk_whose_code_and_length_are_both_damaged_is_read_and_told() {
    let (bytes, chunks) = recording(true, true);
    let place = &chunks[8].0;
    for (code, length) in [(0xff, 0xff), (0x09, 0x00), (0x05, 0xf0), (0x80, 0x01)] {
        let mut damaged = bytes.clone();
        (damaged[place.start], damaged[place.start + 1]) = (code, length);
        check(&damaged, &chunks, std::slice::from_ref(&(place.start..place.start + 2))).unwrap_or_else(|why| panic!("{code:#x}, {length:#x}: {why}"));
        let (said, ..) = read(&damaged).expect("it is read");
        assert_eq!(said.len(), chunks.iter().map(|(_, messages)| messages.len()).sum::<usize>(), "{code:#x}, {length:#x}");
    }
}

#[test]
fn an_index_that_looks_like_a_message_is_not_taken_for_one() {
    let (bytes, chunks) = recording(false, true);
    let at = chunks[9].0.end;
    for (place, bit) in [(at + 1, 0), (at + 1, 4), (at + 11, 4), (at + 12, 0)] {
        let mut damaged = bytes.clone();
        damaged[at] ^= 2;
        damaged[place] ^= 1 << bit;
        check(&damaged, &chunks, &[at..at + 1, place..place + 1]).unwrap_or_else(|why| panic!("byte {place}, bit {bit}: {why}"));
    }
}

#[test]
fn damage_is_told_with_its_times_and_messages() {
    let (mut bytes, chunks) = recording(true, true);
    let (place, messages) = &chunks[4];
    bytes[place.end - 9] ^= 4;
    let (said, damage, is_whole) = read(&bytes).expect("it is read");
    assert_eq!((said.len(), is_whole), (chunks.iter().map(|(_, messages)| messages.len()).sum::<usize>() - messages.len(), true));
    let [damage] = &damage[..] else { panic!("{damage:?}") };
    assert_eq!(damage.bytes, place.start as u64..place.end as u64);
    assert_eq!(damage.span, Some((4000, 4013)));
    assert_eq!(damage.counts, Some([(1, 5), (2, 5), (3, 4)].into()));
}

#[test]
fn channels_survive_the_loss_of_the_first_chunk_and_of_the_summary() {
    for has_end in [true, false] {
        let (mut bytes, chunks) = recording(true, has_end);
        let (first, last) = (&chunks[0].0, &chunks[chunks.len() - 1].0);
        bytes[first.end - 9] ^= 4;
        // Everything after the last chunk: its index, and the summary with its channels.
        bytes[last.end..].fill(0);
        let indexed = IndexedFile::open(file(&bytes)).expect("it is read");
        let topics: Vec<&str> = indexed.channels.values().map(|channel| channel.topic.as_str()).collect();
        assert_eq!(topics, ["a", "b", "c"], "with its end: {has_end}");
    }
}

#[test]
fn a_damaged_length_loses_nothing() {
    for (is_packed, has_end) in [(true, true), (true, false), (false, true)] {
        let (bytes, chunks) = recording(is_packed, has_end);
        for bit in 0..64 {
            let mut turned = bytes.clone();
            turned[chunks[4].0.start + 1 + bit / 8] ^= 1 << (bit % 8);
            let (said, damage, _) = read(&turned).expect("it is read");
            assert_eq!(said.len(), chunks.iter().map(|(_, messages)| messages.len()).sum::<usize>(), "bit {bit}: {damage:?}");
            assert!(damage.iter().all(|damage| damage.counts.as_ref().is_some_and(BTreeMap::is_empty)), "bit {bit}: {damage:?}");
            assert_eq!(damage.len(), 1, "bit {bit}");
        }
    }
}

#[test]
fn a_damaged_time_in_the_head_of_a_chunk_is_told_and_loses_nothing() {
    for (is_packed, has_end) in [(true, true), (true, false), (false, true)] {
        let (bytes, chunks) = recording(is_packed, has_end);
        for bit in 0..128 {
            let (mut turned, begins) = (bytes.clone(), chunks[4].0.start + HEAD as usize);
            turned[begins + bit / 8] ^= 1 << (bit % 8);
            let (said, damage, _) = read(&turned).expect("it is read");
            assert_eq!(said.len(), chunks.iter().map(|(_, messages)| messages.len()).sum::<usize>(), "bit {bit}: {damage:?}");
            let [damage] = &damage[..] else { panic!("bit {bit}: {damage:?}") };
            assert_eq!((damage.bytes.start, damage.what), (begins as u64, "the times in the header of a chunk are damaged"), "bit {bit}");
            let indexed = IndexedFile::open(file(&turned)).expect("it is read");
            assert_eq!((indexed.chunks[4].first, indexed.chunks[4].last), (4000, 4013), "bit {bit}: what is looked up by time is found");
        }
    }
}

#[test]
fn a_sound_file_has_no_damage() {
    for (is_packed, has_end) in [(true, true), (true, false), (false, true)] {
        let (bytes, chunks) = recording(is_packed, has_end);
        let (said, damage, is_whole) = read(&bytes).expect("it is read");
        assert_eq!((said.len(), damage.len(), is_whole), (chunks.iter().map(|(_, messages)| messages.len()).sum(), 0, has_end));
    }
}
