// SPDX-License-Identifier: Apache-2.0
//! Distinguishes intact records in a damaged file, and finds the next intact record after damage.
//!
//! A record has no checksum of its own, except for the content of a chunk. But most records contain inner lengths, which must be
//! consistent with the length in the record's header. A damaged length or opcode almost always violates this.
use crate::reader::LEN_MAX;
use crate::records::{
    ATTACHMENT, ATTACHMENT_INDEX, CHANNEL, CHUNK, CHUNK_INDEX, DATA_END, FOOTER, HEADER, MESSAGE, MESSAGE_INDEX, METADATA, METADATA_INDEX, Rest, SCHEMA,
    STATISTICS, SUMMARY_OFFSET,
};
use std::fs::File;
use std::io;
use std::ops::Range;
use std::os::unix::fs::FileExt;

/// Size of a record header, bytes: its opcode and the length of its fields.
pub(crate) const HEAD: u64 = 9;
/// Number of bytes of a chunk, message or message index that are checked for consistency with the record length.
const PREFIX: u64 = 128;
/// Maximum size of any other record that is checked, bytes. Longer records are accepted unchecked.
const CHECKED_MAX: u64 = 1 << 20;
/// Number of bytes that a search reads at a time.
const WINDOW: u64 = 1 << 16;
/// First opcode that is not assigned to a record type.
const UNKNOWN: u8 = DATA_END + 1;
/// Number of consecutive records that must be intact if one of them has too few fields to rule out a chance match.
const CHAIN: u32 = 3;
/// Size of a message index entry, bytes: time and offset.
pub(crate) const INDEX_ENTRY: usize = 16;

/// Returns true if the fields of a record are consistent with its length. `fields` contains at least the first [`prefix`] bytes of them.
pub(crate) fn is_sound(code: u8, fields: &[u8], len: u64) -> bool {
    match code {
        CHUNK => is_chunk(fields, len),
        MESSAGE => len >= 22,
        MESSAGE_INDEX => is_index(fields, len),
        DATA_END => len == 4,
        FOOTER => len == 20,
        SUMMARY_OFFSET => len == 17,
        STATISTICS => sized(fields, 42, 10).is_some_and(|ends| ends == len),
        HEADER | SCHEMA | CHANNEL | METADATA | CHUNK_INDEX | METADATA_INDEX => len > CHECKED_MAX || has_all(code, Rest(fields)).is_some_and(|rest| rest == 0),
        _ => true,
    }
}

/// Returns the opcode that a record must have according to its fields, even if its stored opcode is damaged; `None` if the fields are
/// inconsistent with its length. `has_chunks` is true if messages are stored in chunks, so that a record that looks like an index is not
/// a message.
pub(crate) fn code_of(code: u8, fields: &[u8], len: u64, has_chunks: bool) -> Option<u8> {
    let is_own = is_sound(code, fields, len);
    if is_chunk(fields, len) {
        Some(CHUNK)
    } else if has_chunks && is_index(fields, len) && (is_vague(code) || !is_own) {
        Some(MESSAGE_INDEX)
    } else if code >= UNKNOWN && len <= CHECKED_MAX && is_sound(METADATA, fields, len) {
        Some(METADATA)
    } else {
        is_own.then_some(code)
    }
}

/// Returns true if records with this opcode have no inner lengths that must be consistent with their own length.
pub(crate) fn is_vague(code: u8) -> bool {
    matches!(code, MESSAGE | ATTACHMENT..=ATTACHMENT_INDEX) || code >= UNKNOWN
}

/// Returns the number of bytes of a record that [`is_sound`] checks.
pub(crate) fn prefix(code: u8, len: u64) -> u64 {
    match code {
        HEADER | SCHEMA | CHANNEL | METADATA | CHUNK_INDEX | METADATA_INDEX | UNKNOWN.. if len <= CHECKED_MAX => len,
        _ => len.min(PREFIX),
    }
}

/// Returns true if the fields of a record are those of a message index, regardless of its opcode.
fn is_index(fields: &[u8], len: u64) -> bool {
    sized(fields, 2, INDEX_ENTRY).is_some_and(|ends| ends == len)
}

/// Returns true if the fields of a record are those of a chunk, regardless of its opcode.
pub(crate) fn is_chunk(fields: &[u8], len: u64) -> bool {
    let mut rest = Rest(fields);
    let packed = rest.take(28).and_then(|_| rest.text()).and_then(|_| rest.u64());
    packed.is_some_and(|packed| packed.checked_add((fields.len() - rest.0.len()) as u64) == Some(len))
}

/// Returns the end of a list of entries after `skip` bytes, if its length is a multiple of the entry size.
fn sized(fields: &[u8], skip: usize, entry: usize) -> Option<u64> {
    let mut rest = Rest(fields);
    rest.take(skip)?;
    let len = rest.u32()? as usize;
    len.is_multiple_of(entry).then_some((skip + 4 + len) as u64)
}

/// Returns the number of bytes that remain after the last field of a record, or `None` if the record is too short for its fields.
fn has_all(code: u8, mut rest: Rest<'_>) -> Option<usize> {
    match code {
        HEADER => {
            rest.text()?;
            rest.text()?;
        }
        SCHEMA => {
            rest.take(2)?;
            rest.text()?;
            rest.text()?;
            rest.bytes()?;
        }
        CHANNEL => {
            rest.take(4)?;
            rest.text()?;
            rest.text()?;
            rest.texts()?;
        }
        METADATA => {
            rest.text()?;
            rest.texts()?;
        }
        CHUNK_INDEX => {
            rest.take(32)?;
            rest.bytes()?;
            rest.take(8)?;
            rest.text()?;
            rest.take(16)?;
        }
        _ => {
            rest.take(16)?;
            rest.text()?;
        }
    }
    Some(rest.0.len())
}

/// Returns the offset and opcode of the first intact record at or after `from`. Positions within `known` chunks are skipped, because
/// chunks may contain bytes of another file. If `has_chunks` is true, channels and messages are skipped, because they belong to chunks,
/// possibly to the damaged one.
pub(crate) fn next_sound(file: &File, from: u64, len: u64, known: &[Range<u64>], has_chunks: bool) -> io::Result<Option<(u64, u8)>> {
    let (mut at, mut window, mut begins) = (from, Vec::new(), 0);
    while at + HEAD <= len {
        if let Some(chunk) = known.iter().find(|chunk| chunk.start < at && at < chunk.end)
            && is_record(file, chunk.end, len, 0)?
        {
            at = chunk.end;
            continue;
        }
        let within = usize::try_from(at.wrapping_sub(begins)).unwrap_or(usize::MAX);
        if window.len().saturating_sub(within) < HEAD as usize {
            window.resize(usize::try_from(WINDOW.min(len - at)).map_err(io::Error::other)?, 0);
            file.read_exact_at(&mut window, at)?;
            begins = at;
            continue;
        }
        let mut head = Rest(&window[within..]);
        if let (Some(code @ 1..=DATA_END), Some(size)) = (head.u8(), head.u64()) {
            let is_likely = size <= LEN_MAX && at + HEAD + size <= len && !(has_chunks && matches!(code, SCHEMA | CHANNEL | MESSAGE));
            if is_likely && is_record(file, at, len, 0)? {
                return Ok(Some((at, code)));
            }
        }
        at += 1;
    }
    Ok(None)
}

/// Returns true if a record begins at an offset, judging by its fields and the records after it.
pub(crate) fn is_record(file: &File, at: u64, len: u64, before: u32) -> io::Result<bool> {
    if at + HEAD > len {
        return Ok(false);
    }
    let mut head = [0; HEAD as usize];
    file.read_exact_at(&mut head, at)?;
    let mut rest = Rest(&head);
    let (Some(code @ 1..=DATA_END), Some(size)) = (rest.u8(), rest.u64()) else { return Ok(false) };
    let room = len - at - HEAD;
    if size > room {
        return Ok(false);
    }
    let mut fields = vec![0; usize::try_from(prefix(code, size)).map_err(io::Error::other)?];
    file.read_exact_at(&mut fields, at + HEAD)?;
    if !is_sound(code, &fields, size) {
        return Ok(false);
    }
    match code {
        FOOTER => Ok(room - size == 8),
        DATA_END | SUMMARY_OFFSET | MESSAGE => Ok(before == CHAIN || is_record(file, at + HEAD + size, len, before + 1)?),
        CHUNK | MESSAGE_INDEX | STATISTICS => Ok(true),
        HEADER | SCHEMA | CHANNEL | METADATA | CHUNK_INDEX | METADATA_INDEX => Ok(size <= CHECKED_MAX),
        _ => Ok(false),
    }
}
