// SPDX-License-Identifier: Apache-2.0
//! Counters of a driver's exchange, such as lost frames and late responses.
use std::sync::atomic::{AtomicU64, Ordering};

/// A counter of a driver.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CounterWord {
    pub name: &'static str,
    /// Unit, or empty for a plain number.
    pub unit: &'static str,
    /// Description, one line.
    pub doc: &'static str,
}

/// Declares the counters of a driver: an enum, and `WORDS`, what each variant counts. A variant is an index of [`Counters`], so that none can
/// name another one's word.
///
/// ```
/// device::counters! {
///     /// What is counted.
///     pub enum Count {
///         Lost: "frames_lost", "", "frames without an answer";
///         Age: "age", "ns", "of the newest answer";
///     }
/// }
/// let counters = device::Counters::new(Count::WORDS);
/// counters.add(Count::Lost, 2);
/// counters.set(Count::Age, 7);
/// assert_eq!(counters.all().map(|(word, value)| (word.name, value)).collect::<Vec<_>>(), [("frames_lost", 2), ("age", 7)]);
/// ```
#[macro_export]
macro_rules! counters {
    ($(#[$about:meta])* $seen:vis enum $Count:ident { $($Variant:ident: $name:literal, $unit:literal, $doc:literal;)+ }) => {
        $(#[$about])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[repr(usize)]
        $seen enum $Count {
            $(#[doc = $doc] $Variant,)+
        }

        impl $Count {
            /// Declaration of each counter, in the order of the variants.
            $seen const WORDS: &'static [$crate::CounterWord] = &[$($crate::CounterWord { name: $name, unit: $unit, doc: $doc }),+];
        }

        impl From<$Count> for usize {
            fn from(of: $Count) -> usize {
                of as usize
            }
        }
    };
}

/// Counters of one open device: the driver counts, any thread may read, and neither blocks. An index is a variant of an enum declared by
/// [`counters!`](crate::counters), or a number if a driver outside this crate declares its counters when it is loaded.
#[derive(Debug)]
pub struct Counters {
    words: &'static [CounterWord],
    values: Box<[AtomicU64]>,
}

impl Counters {
    /// Creates counters with these declarations, all at 0.
    pub fn new(words: &'static [CounterWord]) -> Counters {
        Counters { words, values: words.iter().map(|_| AtomicU64::new(0)).collect() }
    }

    /// Returns the declarations of the counters, in the order of the indices.
    pub fn words(&self) -> &'static [CounterWord] {
        self.words
    }

    /// Adds `more` to a counter. Real-time safe.
    #[inline]
    pub fn add(&self, index: impl Into<usize>, more: u64) {
        self.values[index.into()].fetch_add(more, Ordering::Relaxed);
    }

    /// Stores a value, such as the age of the newest response. Real-time safe.
    #[inline]
    pub fn set(&self, index: impl Into<usize>, value: u64) {
        self.values[index.into()].store(value, Ordering::Relaxed);
    }

    /// Returns the value of a counter.
    #[inline]
    pub fn get(&self, index: impl Into<usize>) -> u64 {
        self.values[index.into()].load(Ordering::Relaxed)
    }

    /// Returns the address of a counter, for code in another language. It is valid as long as these counters exist.
    pub fn address(&self, index: usize) -> *const AtomicU64 {
        &raw const self.values[index]
    }

    /// Returns the declarations and values of all counters.
    pub fn all(&self) -> impl Iterator<Item = (&'static CounterWord, u64)> {
        self.words.iter().zip(self.values.iter().map(|value| value.load(Ordering::Relaxed)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_counts_for_itself() {
        crate::counters! {
            enum Count {
                Lost: "frames_lost", "", "frames without an answer";
                Age: "age", "ns", "of the newest answer";
            }
        }
        let counters = Counters::new(Count::WORDS);
        counters.add(Count::Lost, 2);
        counters.add(0_usize, 1);
        counters.set(Count::Age, 7);
        assert_eq!(counters.all().map(|(word, value)| (word.name, value)).collect::<Vec<_>>(), [("frames_lost", 3), ("age", 7)]);
        assert_eq!(counters.get(Count::Lost), 3);
    }
}
