// SPDX-License-Identifier: Apache-2.0
//! A recording on disk, read in place: looks up the state at a time, and the values over a span, without reading the rest of the file.
use crate::reader::{DamagedPart, OURS, cannot_read};
use crate::{ABOUT, LOST, json};
use indexmap::IndexMap;
use mcap::{Chunk, IndexedFile, Message, Unreadable};
use model::refusal::Refusals;
use model::types::Type;
use model::value::Value;
use serde::Serialize;
use serde_json::Value as Json;
use std::collections::{BTreeMap, HashMap, HashSet, VecDeque};
use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, RwLock, RwLockReadGuard};

use crate::digest::Digest;

/// Number of chunks cached in memory, about 1 MiB each.
const CHUNKS_KEPT: usize = 16;

/// Channel of a recording, with the positions of its messages.
#[derive(Clone, Debug, Default)]
pub(crate) struct Track {
    /// Type of the SVV or cell, its kind (`svv` or `cell`), and its unit.
    pub values: Option<Values>,
    ids: Vec<u16>,
    /// Chunks that contain messages of the channel.
    pub chunks: Vec<usize>,
    /// Floor of each of these chunks: no message in or after the chunk is earlier.
    floors: Vec<u64>,
    /// Number of the channel's messages that precede each of these chunks.
    before: Vec<usize>,
    messages: usize,
}

#[derive(Clone, Debug)]
pub(crate) struct Values {
    pub value_type: Type,
    pub kind: String,
    pub unit: String,
}

impl Track {
    fn take(&mut self, chunk: usize, messages: usize) {
        if self.chunks.last() != Some(&chunk) {
            self.chunks.push(chunk);
            self.before.push(self.messages);
        }
        self.messages += messages;
    }

    /// Returns the channel's messages in a chunk.
    pub fn of<'a>(&'a self, chunk: &'a Chunk) -> impl DoubleEndedIterator<Item = &'a Message> {
        self.ids.iter().filter_map(|id| chunk.messages.get(id)).flatten()
    }
}

/// Description of a file, without its messages.
pub(crate) struct Index {
    pub file: IndexedFile,
    pub tracks: IndexMap<String, Track>,
    /// Bounds of each chunk: no value in or after it is earlier than the floor, and no value in or before it is later than the ceiling.
    pub floors: Vec<u64>,
    pub ceilings: Vec<u64>,
    taken: usize,
}

/// A recording on disk. If it is still being recorded, [`Archive::refresh`] reads the new part.
pub struct Archive {
    pub(crate) path: PathBuf,
    index: RwLock<Index>,
    chunks: Mutex<VecDeque<(usize, Arc<Chunk>)>>,
    /// Chunks that were found to be damaged when read, with the kind of damage.
    damaged: Mutex<BTreeMap<usize, &'static str>>,
    /// Digests by channel and chunk.
    digests: Mutex<HashMap<(String, usize), Arc<Digest>>>,
}

/// A value, its number, and its time in ns.
pub(crate) type Reading = (Vec<u8>, u64, i64);

/// A message of a channel without values.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct RecordedMessage {
    /// Time on the system's clock.
    pub time_ns: i64,
    pub message: Json,
}

impl RecordedMessage {
    fn of(chunk: &Chunk, message: &Message) -> Option<RecordedMessage> {
        Some(RecordedMessage { time_ns: message.time.cast_signed(), message: serde_json::from_slice(chunk.data(message)).ok()? })
    }
}

impl Archive {
    /// Opens a file. Fails if it cannot be read or is not a recording of OpenGPAC.
    pub fn open(path: &Path) -> Result<Archive, Refusals> {
        let file = File::open(path).map_err(|why| cannot_read(path, &why, "check that the file exists"))?;
        let file = IndexedFile::open(file).map_err(|why| cannot_read(path, &why, OURS))?;
        if !file.metadata.contains_key(ABOUT) && (file.damage().is_empty() || file.channels.is_empty()) {
            return Err(cannot_read(path, &"it was not made by OpenGPAC", OURS));
        }
        let mut index = Index { file, tracks: IndexMap::new(), floors: Vec::new(), ceilings: Vec::new(), taken: 0 };
        index.take();
        let (chunks, damaged, digests) = Default::default();
        Ok(Archive { path: path.to_owned(), index: RwLock::new(index), chunks, damaged, digests })
    }

    /// Reads the part of an unfinished recording written since the last call.
    pub fn refresh(&self) -> Result<(), Refusals> {
        if self.index().file.is_whole() {
            return Ok(());
        }
        let mut index = self.index.write().unwrap_or_else(PoisonError::into_inner);
        if index.file.go_on().map_err(|why| self.cannot(&why))? {
            index.take();
        }
        Ok(())
    }

    /// Returns true if the recording has a channel with that name.
    pub fn has(&self, channel: &str) -> bool {
        self.index().tracks.contains_key(channel)
    }

    /// Returns the most recent value of an SVV or cell at a given time, with its number and its time in ns; `None` if no value had been
    /// stored yet or the name does not exist.
    pub fn reading_at(&self, name: &str, time_ns: i64) -> Result<Option<(Value, u64, i64)>, Refusals> {
        let found = self.value_at(name, time_ns)?;
        let index = self.index();
        let of = index.tracks.get(name).and_then(|track| track.values.as_ref());
        Ok(found.zip(of).map(|((bytes, number, at_ns), of)| (of.value_type.decode(&bytes), number, at_ns)))
    }

    /// Returns the same as [`Archive::reading_at`], but with the value as bytes in the memory layout of its type.
    pub(crate) fn value_at(&self, name: &str, time_ns: i64) -> Result<Option<Reading>, Refusals> {
        let index = self.index();
        let Some(Track { values: Some(values), .. }) = index.tracks.get(name) else { return Ok(None) };
        let found = self.last_at(&index, name, time_ns)?;
        Ok(found.and_then(|RecordedMessage { time_ns: at_ns, message }| {
            let mut bytes = Vec::new();
            let read = json::read(&values.value_type, &message["value"], &mut bytes);
            read.then(|| (bytes, message["number"].as_u64().unwrap_or(0), at_ns))
        }))
    }

    /// Returns the last message of another channel at or before a time.
    pub fn record_at(&self, topic: &str, time_ns: i64) -> Result<Option<RecordedMessage>, Refusals> {
        self.last_at(&self.index(), topic, time_ns)
    }

    /// Returns messages of another channel in order, starting with number `since` (counted from 0), and the number at which the next page
    /// begins, if there is one. Reads at most `chunks_max` chunks, and skips earlier ones using the counts in the file's index.
    pub fn records(&self, topic: &str, since: usize, chunks_max: usize) -> Result<(Vec<RecordedMessage>, Option<usize>), Refusals> {
        let index = self.index();
        let mut found = Vec::new();
        let Some(track) = index.tracks.get(topic).filter(|track| since < track.messages) else { return Ok((found, None)) };
        let first = track.before.partition_point(|before| *before <= since).saturating_sub(1);
        let end = track.chunks.len().min(first.saturating_add(chunks_max));
        for (at, before) in track.chunks[first..end].iter().zip(&track.before[first..]) {
            let chunk = self.chunk(&index, *at)?;
            let new = track.of(&chunk).skip(since.saturating_sub(*before));
            found.extend(new.filter_map(|message| RecordedMessage::of(&chunk, message)));
        }
        Ok((found, track.before.get(end).copied()))
    }

    /// Returns the nearest time at which a value of any SVV or cell was stored, after this time if `forward` is true, otherwise before
    /// it. This is the next or previous firing that stored a value.
    pub fn firing(&self, time_ns: i64, forward: bool) -> Result<Option<i64>, Refusals> {
        let index = self.index();
        let time = unsigned(time_ns);
        let chunks = index.file.chunks.len();
        let mut found: Option<u64> = None;
        let order: Box<dyn Iterator<Item = usize>> = if forward {
            Box::new(index.ceilings.partition_point(|ceiling| *ceiling <= time)..chunks)
        } else {
            Box::new((0..index.floors.partition_point(|floor| *floor < time)).rev())
        };
        for at in order {
            let beyond = found.is_some_and(|found| if forward { index.floors[at] >= found } else { index.ceilings[at] <= found });
            if beyond {
                break;
            }
            let chunk = self.chunk(&index, at)?;
            for track in index.tracks.values().filter(|track| track.values.is_some()) {
                for message in track.of(&chunk) {
                    let is_nearer = if forward {
                        message.time > time && found.is_none_or(|found| message.time < found)
                    } else {
                        message.time < time && found.is_none_or(|found| message.time > found)
                    };
                    if is_nearer {
                        found = Some(message.time);
                    }
                }
            }
        }
        Ok(found.map(u64::cast_signed))
    }

    /// Returns the number of lost messages by channel. If the file has no end record, the number is unknown.
    pub fn lost(&self) -> BTreeMap<String, u64> {
        let index = self.index();
        let lost = index.file.metadata.get(LOST).into_iter().flatten();
        lost.map(|(channel, count)| (channel.clone(), count.parse().unwrap_or(0))).collect()
    }

    pub(crate) fn index(&self) -> RwLockReadGuard<'_, Index> {
        self.index.read().unwrap_or_else(PoisonError::into_inner)
    }

    pub(crate) fn digests(&self) -> MutexGuard<'_, HashMap<(String, usize), Arc<Digest>>> {
        self.digests.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Returns the unreadable parts of the file that have been found so far, in order. The content of a chunk is checked when it is first
    /// read.
    pub fn damage(&self) -> Vec<DamagedPart> {
        let index = self.index();
        let mut found = index.file.damage();
        found.extend(self.damaged().iter().map(|(at, what)| index.file.damage_of(*at, what)));
        DamagedPart::all(found, &index.file.channels)
    }

    fn damaged(&self) -> MutexGuard<'_, BTreeMap<usize, &'static str>> {
        self.damaged.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Returns a chunk, from the cache if it was read recently. A damaged chunk is returned empty.
    pub(crate) fn chunk(&self, index: &Index, at: usize) -> Result<Arc<Chunk>, Refusals> {
        let kept = || self.chunks.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, chunk)) = kept().iter().find(|(known, _)| *known == at) {
            return Ok(chunk.clone());
        }
        let chunk = match index.file.chunk(at) {
            Err(Unreadable::Damaged { what, .. }) => {
                self.damaged().insert(at, what);
                Chunk::default()
            }
            read => read.map_err(|why| self.cannot(&why))?,
        };
        let chunk = Arc::new(chunk);
        let mut kept = kept();
        kept.push_front((at, chunk.clone()));
        kept.truncate(CHUNKS_KEPT);
        Ok(chunk)
    }

    fn last_at(&self, index: &Index, topic: &str, time_ns: i64) -> Result<Option<RecordedMessage>, Refusals> {
        let (Some(track), Ok(time)) = (index.tracks.get(topic), u64::try_from(time_ns)) else { return Ok(None) };
        let behind = track.floors.partition_point(|floor| *floor <= time);
        for at in track.chunks[..behind].iter().rev() {
            let chunk = self.chunk(index, *at)?;
            let last = track.of(&chunk).filter(|message| message.time <= time).max_by_key(|message| message.time);
            if let Some(message) = last {
                return Ok(RecordedMessage::of(&chunk, message));
            }
        }
        Ok(None)
    }

    fn cannot(&self, why: &Unreadable) -> Refusals {
        cannot_read(&self.path, why, OURS)
    }
}

/// Converts a time to unsigned; times in a file are never negative.
pub(crate) fn unsigned(time_ns: i64) -> u64 {
    u64::try_from(time_ns).unwrap_or(0)
}

impl Index {
    /// Indexes newly found chunks.
    fn take(&mut self) {
        let Index { file, tracks, .. } = self;
        for (id, channel) in &file.channels {
            let track = tracks.entry(channel.topic.clone()).or_default();
            if !track.ids.contains(id) {
                track.ids.push(*id);
                track.values = values_of(channel);
            }
        }
        let by_id: HashMap<u16, usize> = file.channels.iter().filter_map(|(id, channel)| Some((*id, tracks.get_index_of(&channel.topic)?))).collect();
        for (at, chunk) in file.chunks.iter().enumerate().skip(self.taken) {
            for (id, messages) in &chunk.counts {
                if let Some(track) = by_id.get(id) {
                    tracks[*track].take(at, *messages);
                }
            }
        }
        self.taken = file.chunks.len();
        let of_values: HashSet<u16> = tracks.values().filter(|track| track.values.is_some()).flat_map(|track| &track.ids).copied().collect();
        let times = |chunk: &mcap::ChunkIndex| chunk.counts.keys().any(|id| of_values.contains(id)).then_some((chunk.first, chunk.last));
        let times: Vec<Option<(u64, u64)>> = file.chunks.iter().map(times).collect();
        self.ceilings = times
            .iter()
            .scan(0, |maximum, times| {
                *maximum = times.map_or(0, |(_, last)| last).max(*maximum);
                Some(*maximum)
            })
            .collect();
        self.floors = minima(times.iter().map(|times| times.map_or(u64::MAX, |(first, _)| first)));
        for track in tracks.values_mut() {
            track.floors = minima(track.chunks.iter().map(|at| file.chunks[*at].first));
        }
    }
}

/// Returns, for each position, the minimum of the values at this position and all later ones.
fn minima(of: impl DoubleEndedIterator<Item = u64>) -> Vec<u64> {
    let mut found: Vec<u64> = of
        .rev()
        .scan(u64::MAX, |minimum, one| {
            *minimum = one.min(*minimum);
            Some(*minimum)
        })
        .collect();
    found.reverse();
    found
}

fn values_of(channel: &mcap::Channel) -> Option<Values> {
    let text = |name: &str| channel.metadata.get(name).cloned().unwrap_or_default();
    let value_type = Type::parse(&text("type"), &IndexMap::new()).ok()?;
    Some(Values { value_type, kind: channel.metadata.get("kind")?.clone(), unit: text("unit") })
}
