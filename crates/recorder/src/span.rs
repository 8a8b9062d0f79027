// SPDX-License-Identifier: Apache-2.0
//! Channels over a span, in columns: first, last, minimum and maximum of each column, with exact sums over the span.
use crate::archive::{Archive, Index, Reading, Track, Values, unsigned};
use crate::digest::{Digest, NONE, Samples, Sums, extremes};
use crate::numbers;
use mcap::Chunk;
use model::refusal::{Class, Refusal, Refusals};
use std::sync::Arc;

/// One channel over a span.
#[derive(Clone, Debug, Default)]
pub struct Trace {
    /// Samples of a span: the last value stored before it and, for every column, the first value, the last value, and the values with the
    /// minimum and maximum of each component. All are complete values with their own times.
    pub samples: Samples,
    /// Sums for each component, over all values of the span.
    pub sums: Vec<Sums>,
}

/// Channels over a span or part of it.
#[derive(Clone, Debug, Default)]
pub struct Span {
    pub traces: Vec<Trace>,
    /// Position at which to continue if this is only part of the span.
    pub next: Option<usize>,
}

impl Archive {
    /// Returns the values of channels between two times (inclusive), summarised in `columns` columns. Reads at most `chunks_max` uncached
    /// chunks, starting at `since`, which is 0 or the `next` of the previous part. A chunk shorter than a column belongs to the column in
    /// which it begins. Fails if a name is not that of an SVV or cell of the recording.
    pub fn span(&self, names: &[String], (from_ns, to_ns): (i64, i64), columns: usize, since: usize, chunks_max: usize) -> Result<Span, Refusals> {
        let index = self.index();
        let tracks: Vec<(&String, &Track, &Values)> = names.iter().map(|name| self.track(&index, name)).collect::<Result<_, _>>()?;
        let (from, to) = (unsigned(from_ns), unsigned(to_ns));
        let width = ((to.saturating_sub(from)) / columns.max(1) as u64).max(1);
        let mut columns: Vec<Columns> = tracks.iter().map(|(.., values)| Columns::new(numbers::count(&values.value_type), from, width)).collect();
        for (name, columns) in names.iter().zip(&mut columns).filter(|_| since == 0) {
            columns.begin(self.value_at(name, from_ns.saturating_sub(1))?, &index.tracks[name]);
        }
        let begin = index.ceilings.partition_point(|ceiling| *ceiling < from);
        let end = index.floors.partition_point(|floor| *floor <= to);
        let (mut read, mut next) = (0, None);
        for at in begin.max(since)..end {
            let place = &index.file.chunks[at];
            let whole = place.first >= from && place.last <= to && place.last - place.first <= width;
            let here: Vec<usize> = (0..tracks.len()).filter(|track| tracks[*track].1.chunks.binary_search(&at).is_ok()).collect();
            let known: Vec<Option<Arc<Digest>>> = {
                let digests = self.digests();
                here.iter().map(|track| digests.get(&(names[*track].clone(), at)).cloned()).collect()
            };
            if whole && known.iter().all(Option::is_some) {
                for (track, digest) in here.iter().zip(known.iter().flatten()) {
                    columns[*track].digest(digest, place.first);
                }
                continue;
            }
            if read == chunks_max {
                next = Some(at);
                break;
            }
            read += 1;
            let chunk = self.chunk(&index, at)?;
            for track in here {
                let (name, of, values) = tracks[track];
                let samples = decoded(of, values, &chunk);
                if whole {
                    let digest = Arc::new(Digest::of(&samples, columns[track].size));
                    columns[track].digest(&digest, place.first);
                    self.digests().insert((name.clone(), at), digest);
                } else {
                    columns[track].take(&samples, to);
                }
            }
        }
        Ok(Span { traces: columns.into_iter().map(Columns::finish).collect(), next })
    }

    fn track<'a>(&self, index: &'a Index, name: &'a String) -> Result<(&'a String, &'a Track, &'a Values), Refusals> {
        let found = index.tracks.get(name).and_then(|track| Some((name, track, track.values.as_ref()?)));
        found.ok_or_else(|| {
            let named = index.tracks.iter().filter(|(_, track)| track.values.is_some()).map(|(name, _)| name.as_str());
            let remedy = hints::did_you_mean(name, named);
            vec![Refusal::new(Class::UnknownName, format!("there is no SVV '{name}' in '{}'", self.path.display())).remedy(remedy)]
        })
    }
}

fn decoded(of: &Track, values: &Values, chunk: &Chunk) -> Samples {
    let mut samples = Samples::default();
    for message in of.of(chunk) {
        if let Some(number) = numbers::read(&values.value_type, chunk.data(message), &mut samples.values) {
            samples.times_ns.push(message.time.cast_signed());
            samples.numbers.push(number);
        }
    }
    samples
}

/// A channel that is being divided into columns.
struct Columns {
    size: usize,
    from: u64,
    width: u64,
    column: u64,
    /// Values of the current column.
    open: Samples,
    done: Trace,
}

impl Columns {
    fn new(size: usize, from: u64, width: u64) -> Columns {
        let done = Trace { samples: Samples::default(), sums: vec![NONE; size] };
        Columns { size, from, width, column: 0, open: Samples::default(), done }
    }

    /// Starts with the value before the span.
    fn begin(&mut self, before: Option<Reading>, of: &Track) {
        let (Some((bytes, number, time_ns)), Some(values)) = (before, &of.values) else { return };
        self.done.samples.times_ns.push(time_ns);
        self.done.samples.numbers.push(number);
        numbers::of_bytes(&values.value_type, &bytes, &mut self.done.samples.values);
    }

    fn enter(&mut self, time: u64) {
        let column = time.saturating_sub(self.from) / self.width;
        if column != self.column {
            self.close();
            self.column = column;
        }
    }

    fn take(&mut self, samples: &Samples, to: u64) {
        for at in 0..samples.len() {
            let time = unsigned(samples.times_ns[at]);
            if (self.from..=to).contains(&time) {
                self.enter(time);
                self.open.push(samples, at);
                let value = &samples.values[at * self.size..][..self.size];
                self.done.sums.iter_mut().zip(value).for_each(|(sums, value)| sums.take(*value));
            }
        }
    }

    fn digest(&mut self, digest: &Digest, first: u64) {
        self.enter(first);
        (0..digest.samples.len()).for_each(|at| self.open.push(&digest.samples, at));
        self.done.sums.iter_mut().zip(&digest.sums).for_each(|(sums, more)| sums.add(more));
    }

    fn close(&mut self) {
        extremes(&self.open, self.size).into_iter().for_each(|at| self.done.samples.push(&self.open, at));
        self.open.clear();
    }

    fn finish(mut self) -> Trace {
        self.close();
        self.done
    }
}
