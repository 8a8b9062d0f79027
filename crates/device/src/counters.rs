// SPDX-License-Identifier: Apache-2.0
//! What a driver counts while it exchanges: frames that were lost, answers that came too late.
use std::sync::atomic::{AtomicU64, Ordering};

/// A counter of a driver.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CounterWord {
    pub name: &'static str,
    /// Unit, or empty for a mere number.
    pub unit: &'static str,
    /// One line.
    pub doc: &'static str,
}

/// The counters of one open device: the driver counts, anyone reads, nobody waits.
#[derive(Debug)]
pub struct Counters {
    words: &'static [CounterWord],
    values: Box<[AtomicU64]>,
}

impl Counters {
    /// All of them at 0.
    pub fn new(words: &'static [CounterWord]) -> Counters {
        Counters { words, values: words.iter().map(|_| AtomicU64::new(0)).collect() }
    }

    /// What is counted, in the order of the indices.
    pub fn words(&self) -> &'static [CounterWord] {
        self.words
    }

    /// Counts `more`. Real-time safe.
    #[inline]
    pub fn add(&self, index: usize, more: u64) {
        self.values[index].fetch_add(more, Ordering::Relaxed);
    }

    /// Stores a value, as the age of the newest answer. Real-time safe.
    #[inline]
    pub fn set(&self, index: usize, value: u64) {
        self.values[index].store(value, Ordering::Relaxed);
    }

    /// The value of one.
    #[inline]
    pub fn get(&self, index: usize) -> u64 {
        self.values[index].load(Ordering::Relaxed)
    }

    /// Where one is counted, for code of another language. It is there as long as these counters.
    pub fn address(&self, index: usize) -> *const AtomicU64 {
        &raw const self.values[index]
    }

    /// Names and values.
    pub fn all(&self) -> impl Iterator<Item = (&'static CounterWord, u64)> {
        self.words.iter().zip(self.values.iter().map(|value| value.load(Ordering::Relaxed)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_counts_for_itself() {
        const WORDS: [CounterWord; 2] = [
            CounterWord { name: "frames_lost", unit: "", doc: "frames without an answer" },
            CounterWord { name: "age", unit: "ns", doc: "of the newest answer" },
        ];
        let counters = Counters::new(&WORDS);
        counters.add(0, 2);
        counters.add(0, 1);
        counters.set(1, 7);
        assert_eq!(counters.all().map(|(word, value)| (word.name, value)).collect::<Vec<_>>(), [("frames_lost", 3), ("age", 7)]);
        assert_eq!(counters.get(0), 3);
    }
}
