// SPDX-License-Identifier: Apache-2.0
//! Summaries of a channel's samples: first, last, minimum and maximum, and exact sums.

/// Samples: values, each with its time and number.
#[derive(Clone, Debug, Default)]
pub struct Samples {
    pub times_ns: Vec<i64>,
    pub numbers: Vec<u64>,
    /// Values in sequence; the components of each value are adjacent.
    pub values: Vec<f64>,
}

impl Samples {
    pub fn len(&self) -> usize {
        self.times_ns.len()
    }

    pub fn is_empty(&self) -> bool {
        self.times_ns.is_empty()
    }

    pub(crate) fn push(&mut self, other: &Samples, at: usize) {
        let size = other.values.len() / other.len().max(1);
        self.times_ns.push(other.times_ns[at]);
        self.numbers.push(other.numbers[at]);
        self.values.extend_from_slice(&other.values[at * size..][..size]);
    }

    pub(crate) fn clear(&mut self) {
        self.times_ns.clear();
        self.numbers.clear();
        self.values.clear();
    }
}

/// Digest of one component of a channel over a span; every finite value counts once.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "schema", schemars(rename = "RecordedSums"))]
pub struct Sums {
    pub count: u64,
    /// Minimum; 0 if there are no values.
    pub min: f64,
    pub max: f64,
    pub sum: f64,
    /// Sum of squares.
    pub squares: f64,
    /// Sum of squared differences from the mean, updated directly: deriving it from the sum of squares would lose precision for large
    /// values.
    pub spread: f64,
}

pub(crate) const NONE: Sums = Sums { count: 0, min: 0.0, max: 0.0, sum: 0.0, squares: 0.0, spread: 0.0 };

impl Sums {
    pub(crate) fn take(&mut self, value: f64) {
        if value.is_finite() {
            self.add(&Sums { count: 1, min: value, max: value, sum: value, squares: value * value, spread: 0.0 });
        }
    }

    pub(crate) fn add(&mut self, other: &Sums) {
        if other.count == 0 {
            return;
        }
        if self.count == 0 {
            *self = *other;
            return;
        }
        let (min, max) = (self.min.min(other.min), self.max.max(other.max));
        // The formula of Chan, Golub and LeVeque, 1979, combines two spreads and the distance of their means.
        let (here, there) = (self.count as f64, other.count as f64);
        let apart = other.sum / there - self.sum / here;
        let spread = self.spread + other.spread + apart * apart * here * there / (here + there);
        *self = Sums { count: self.count + other.count, min, max, sum: self.sum + other.sum, squares: self.squares + other.squares, spread };
    }
}

/// Digest of a whole chunk of one channel, shown as one column.
#[derive(Clone, Debug, Default)]
pub(crate) struct Digest {
    pub samples: Samples,
    pub sums: Vec<Sums>,
}

impl Digest {
    pub(crate) fn of(samples: &Samples, size: usize) -> Digest {
        let mut sums = vec![NONE; size];
        for value in samples.values.chunks_exact(size.max(1)) {
            sums.iter_mut().zip(value).for_each(|(sums, value)| sums.take(*value));
        }
        let mut kept = Samples::default();
        extremes(samples, size).into_iter().for_each(|at| kept.push(samples, at));
        Digest { samples: kept, sums }
    }
}

/// Returns, in order, the indices of the first and last samples, and of the minimum and maximum of each component.
pub(crate) fn extremes(samples: &Samples, size: usize) -> Vec<usize> {
    let Some(last) = samples.len().checked_sub(1) else { return Vec::new() };
    let mut found = vec![0, last];
    for part in 0..size {
        let value = |at: usize| samples.values[at * size + part];
        let finite = || (0..samples.len()).filter(|at| value(*at).is_finite());
        found.extend(finite().reduce(|least, at| if value(at) < value(least) { at } else { least }));
        found.extend(finite().reduce(|most, at| if value(at) > value(most) { at } else { most }));
    }
    found.sort_unstable();
    found.dedup();
    found
}
