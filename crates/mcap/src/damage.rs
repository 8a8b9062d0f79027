// SPDX-License-Identifier: Apache-2.0
//! Damage in a file: its position, the time span it affects, and the number of lost messages; and the summary, which lists the original
//! content.
use crate::records::{CHUNK_INDEX, MAGIC, Rest};
use crate::sound::HEAD;
use std::collections::BTreeMap;
use std::fs::File;
use std::io;
use std::ops::Range;
use std::os::unix::fs::FileExt;

/// Cause of damage: a record is malformed.
pub(crate) const UNLIKELY: &str = "a record has an invalid opcode or length";
/// Cause of damage: a message outside any chunk, which is ignored.
pub(crate) const BESIDE: &str = "a message is between chunks, without a checksum";

/// An unreadable part of a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Damage {
    /// Position in the file.
    pub bytes: Range<u64>,
    pub what: &'static str,
    /// Bounds on the times of the lost messages, ns, if the file contains them.
    pub span: Option<(u64, u64)>,
    /// Number of lost messages of each channel, if the file contains it; empty if none are lost.
    pub counts: Option<BTreeMap<u16, usize>>,
}

impl Damage {
    /// Describes damage that loses no message.
    pub(crate) fn harmless(bytes: Range<u64>, what: &'static str) -> Damage {
        Damage { bytes, what, span: None, counts: Some(BTreeMap::new()) }
    }
}

/// List of chunks at the end of a file.
#[derive(Debug, Default)]
pub(crate) struct Summary {
    /// Position of each chunk, with its times.
    chunks: Vec<(Range<u64>, (u64, u64))>,
}

impl Summary {
    /// Reads the summary; empty if the file has none, or if it is damaged.
    pub fn read(file: &File, len: u64) -> io::Result<Summary> {
        let mut summary = Summary::default();
        let Some(footer) = len.checked_sub(HEAD + 20 + MAGIC.len() as u64) else { return Ok(summary) };
        let mut bytes = [0; 8];
        file.read_exact_at(&mut bytes, footer + HEAD)?;
        let begin = u64::from_le_bytes(bytes);
        if begin < MAGIC.len() as u64 || begin > footer || footer - begin > SUMMARY_MAX {
            return Ok(summary);
        }
        let mut records = vec![0; usize::try_from(footer - begin).map_err(io::Error::other)?];
        file.read_exact_at(&mut records, begin)?;
        let mut rest = Rest(&records);
        while let Some((code, mut fields)) = rest.record() {
            if code != CHUNK_INDEX {
                continue;
            }
            if let (Some(first), Some(last), Some(at), Some(size)) = (fields.u64(), fields.u64(), fields.u64(), fields.u64())
                && let Some(end) = at.checked_add(size).filter(|end| *end <= begin)
            {
                summary.chunks.push((at..end, (first, last)));
            }
        }
        Ok(summary)
    }

    /// Returns the positions of the chunks.
    pub fn places(&self) -> Vec<Range<u64>> {
        self.chunks.iter().map(|(place, _)| place.clone()).collect()
    }

    /// Returns true if a range is exactly that of a chunk.
    pub fn is_chunk(&self, place: &Range<u64>) -> bool {
        self.chunks.iter().any(|(chunk, _)| chunk == place)
    }

    /// Returns the times of the chunk that begins at an offset.
    pub fn span(&self, at: u64) -> Option<(u64, u64)> {
        self.chunks.iter().find(|(place, _)| place.start == at).map(|(_, span)| *span)
    }
}

/// Maximum size of a summary to be read, bytes.
pub(crate) const SUMMARY_MAX: u64 = 256 << 20;
