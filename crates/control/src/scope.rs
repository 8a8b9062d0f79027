// SPDX-License-Identifier: Apache-2.0
//! The scope topic of a stream: sends every value of its channels, at the full rate at which they are stored, in binary frames.
//!
//! A frame is sent immediately or not at all. Values that a slow reader misses are counted, and the next frame that it receives contains
//! the count. Displayed values are therefore never stale, and the number of missing values is exact.
use crate::told::{ScopeChannel, ScopeHead, StreamAnswer};
use api::Refusals;
use model::types::{Scalar, Type};
use model::value::Value;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;
use supervisor::{Run, Samples, System, Tap, TapChannel};

/// Maximum number of channels of one stream.
pub(crate) const CHANNELS_MAX: usize = 256;
/// Maximum number of frames of one subscription in transit; any further frames would arrive late.
const ON_THE_WAY_MAX: usize = 4;
/// Maximum time between two frames; a tap keeps values for twice this time.
pub(crate) const EVERY_MAX: Duration = Duration::from_secs(1);
/// `GSC1`, the first word of every frame.
const MAGIC: u32 = 0x4753_4331;

/// Offsets and types of the numbers within the bytes of a value.
type Components = Vec<(usize, Scalar)>;

/// A subscription to a set of channels.
pub(crate) struct Scope {
    id: String,
    tap: Tap,
    samples: Samples,
    components: Vec<Components>,
    sizes: Vec<usize>,
    /// Number of values of each channel that the reader has missed since the last frame.
    lost: Vec<u64>,
    on_the_way: Arc<AtomicUsize>,
    is_virtual: bool,
}

/// Slot of a frame in transit; the frame counts as in transit until the slot is dropped.
pub(crate) struct Slot(Arc<AtomicUsize>);

impl Drop for Slot {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::AcqRel);
    }
}

impl Scope {
    /// Attaches to the named SVVs and private cells.
    pub fn open(system: &System, id: &str, names: &[String]) -> Result<Scope, Refusals> {
        let tap = system.tap(names)?;
        let types: Vec<Type> = tap.channels().iter().map(|c| Type::parse(&c.type_text, &Default::default())).collect::<Result<_, _>>().map_err(|r| vec![r])?;
        // Virtual time passes as fast as it can, so it is held when the tap contains a full frame.
        tap.hold_time();
        Ok(Scope {
            id: id.to_owned(),
            samples: Samples::default(),
            components: types.iter().map(|of| components(of, 0)).collect(),
            sizes: tap.channels().iter().map(|c| c.size).collect(),
            lost: vec![0; tap.channels().len()],
            on_the_way: Arc::default(),
            is_virtual: system.is_virtual(),
            tap,
        })
    }

    /// Returns true if time is virtual, that is, advanced by a program.
    pub fn is_virtual(&self) -> bool {
        self.is_virtual
    }

    /// Returns the first frame, which describes the channels.
    pub fn head(&self) -> StreamAnswer {
        let channel = |(of, components): (&TapChannel, &Vec<_>)| ScopeChannel {
            name: of.name.clone(),
            type_text: of.type_text.clone(),
            unit: of.unit.clone(),
            components: components.len(),
        };
        let channels = self.tap.channels().iter().zip(&self.components).map(channel).collect();
        StreamAnswer { scope: Some(ScopeHead { channels }), ..StreamAnswer::of(&self.id) }
    }

    /// Waits until the next frame is due: for the period, or for less if virtual time is being held for it.
    pub fn wait(&self, every: Duration) {
        if self.is_virtual {
            self.tap.wait(every);
        }
    }

    /// Returns the next frame with its slot, or `None` if there are no new values or too many frames are in transit.
    pub fn next(&mut self) -> Option<(Vec<u8>, Slot)> {
        self.tap.take(&mut self.samples);
        let empty = self.samples.is_empty() && self.lost.iter().all(|lost| *lost == 0);
        if empty {
            return None;
        }
        if self.on_the_way.load(Ordering::Acquire) >= ON_THE_WAY_MAX {
            self.pass_over();
            return None;
        }
        self.on_the_way.fetch_add(1, Ordering::AcqRel);
        let frame = self.frame();
        Some((frame, Slot(self.on_the_way.clone())))
    }

    /// Counts the most recently taken values as lost, because the reader does not receive them.
    pub fn pass_over(&mut self) {
        for (lost, run) in self.lost.iter_mut().zip(&self.samples.runs) {
            *lost += run.len() as u64 + run.lost;
        }
    }

    /// Records that the frame with the most recently taken values was sent, so its count of lost values was reported.
    pub fn sent(&mut self) {
        self.lost.fill(0);
    }

    fn frame(&self) -> Vec<u8> {
        let runs = || self.samples.runs.iter().enumerate().filter(|(channel, run)| !run.is_empty() || run.lost + self.lost[*channel] > 0);
        let size: usize = runs().map(|(channel, run)| 16 + run.len() * (16 + 8 * self.components[channel].len())).sum();
        let mut frame = Vec::with_capacity(24 + self.id.len() + size);
        let word = |frame: &mut Vec<u8>, value: usize| frame.extend_from_slice(&u32::try_from(value).unwrap_or(u32::MAX).to_le_bytes());
        frame.extend_from_slice(&MAGIC.to_le_bytes());
        word(&mut frame, self.id.len());
        frame.extend_from_slice(self.id.as_bytes());
        frame.resize(frame.len().next_multiple_of(8), 0);
        word(&mut frame, runs().count());
        word(&mut frame, 0);
        for (channel, run) in runs() {
            word(&mut frame, channel);
            word(&mut frame, run.len());
            frame.extend_from_slice(&(run.lost + self.lost[channel]).to_le_bytes());
            self.values(&mut frame, channel, run);
        }
        frame
    }

    fn values(&self, frame: &mut Vec<u8>, channel: usize, run: &Run) {
        for (time_ns, number) in run.times_ns.iter().zip(&run.numbers) {
            frame.extend_from_slice(&time_ns.to_le_bytes());
            frame.extend_from_slice(&number.to_le_bytes());
        }
        for value in run.bytes.chunks_exact(self.sizes[channel].max(1)) {
            for (offset, scalar) in &self.components[channel] {
                frame.extend_from_slice(&number(*scalar, &value[*offset..]).to_le_bytes());
            }
        }
    }
}

/// Returns the numbers of a type in order: the elements of an array, the members of a struct.
fn components(of: &Type, at: usize) -> Components {
    match of {
        Type::Scalar(scalar) => vec![(at, *scalar)],
        Type::Array(element, count) => (0..*count).flat_map(|index| components(element, at + index * element.size())).collect(),
        Type::Struct(members) => members.iter().zip(of.offsets()).flat_map(|(member, offset)| components(&member.member_type, at + offset)).collect(),
    }
}

/// Returns a number as a double; a Boolean becomes 0 or 1.
fn number(scalar: Scalar, bytes: &[u8]) -> f64 {
    match Type::Scalar(scalar).decode(bytes) {
        Value::Number(number) => number,
        Value::Integer(integer) => integer as f64,
        Value::Unsigned(integer) => integer as f64,
        Value::Bool(truth) => f64::from(u8::from(truth)),
        // The number exceeds the integers of JSON.
        Value::Text(text) => text.parse().unwrap_or(f64::NAN),
        Value::List(_) | Value::Record(_) => f64::NAN,
    }
}
