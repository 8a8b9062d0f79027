// SPDX-License-Identifier: Apache-2.0
//! Sequences: the remaining kernel work for a verb instance, in order.
//!
//! A command list may span several sources. Operations on one source are sent as one script; if the order matters, a source receives its
//! script only after the previous ones have been acknowledged (a barrier). Operations on a single source need no barrier: they form one
//! script, which takes effect as a whole between two firings.
use crate::wiring::installed::Homes;
use kernel::{Cell, Inbound, Op, SourceId};
use model::plan::Target;
use std::collections::VecDeque;
use std::sync::Arc;

/// A movement, which begins when all previous ones have been acknowledged.
pub(crate) enum Movement {
    /// One script per source, all sent together.
    Scripts(Vec<(SourceId, Vec<Op>)>),
    /// First scripts of a start: they reset everything and store these values of ψ. If the start is replaced before it reaches this
    /// movement, the replacement runs them first. If `ends` is true, they also end the instance.
    Opening {
        scripts: Vec<(SourceId, Vec<Op>)>,
        stores: Vec<(Target, Vec<u8>)>,
        ends: bool,
    },
    /// New tables for these sources, for the state of the system at the time of the movement.
    Tables(Vec<SourceId>),
    /// A new table for the only source of an instance, and the operations that follow it, in one script.
    Together {
        source: SourceId,
        ops: Vec<Op>,
        ends: bool,
    },
    /// New tables for instances that now follow a different writer of an SVV, and the operations that update the conditions under which
    /// their activations are due.
    Follow {
        sources: Vec<SourceId>,
        follows: Vec<(SourceId, Op)>,
    },
    /// Replaces the inbound ends of the same writers with these, then sends new tables to their sources.
    Inbound(Vec<Inlet>),
    /// Brings home cells that blocks are about to write and that may be located in other sources: (planned cell, block).
    Home(Vec<(usize, usize)>),
    /// Captures, in their previous home, the values of cells that move to another source.
    Carry(Vec<CarriedCell>),
    /// Stores the carried values in the new home.
    Arrive(Vec<CarriedCell>),
    /// Waits until the machines report that they follow commands. They report this in these channels, which the previous script captured.
    Operating(Vec<(SourceId, Cell)>),
    /// Initialises the SVVs of a logical device that start as copies of others, from the values captured by the previous script.
    CopyInitial,
    /// `gpac.ready()`: the device that this verb operates is enabled.
    Ready,
    /// Marks the stage (list, stage) as entered: its wait starts.
    Entered {
        list: usize,
        stage: usize,
    },
    Suspended,
    Resumed,
    /// Completes the end: the captured values complete the report.
    Ended,
}

impl Movement {
    /// Returns true if this is a new table for this source and no other.
    pub fn is_table_of(&self, source: SourceId) -> bool {
        matches!(self, Movement::Tables(sources) if !sources.is_empty() && sources.iter().all(|of| *of == source))
    }

    /// Returns true if the system needs the movement whatever happens to the instance: tables, connections, values of SVVs.
    pub fn is_structural(&self) -> bool {
        matches!(self, Movement::Tables(_) | Movement::Follow { .. } | Movement::Inbound(_) | Movement::Home(_) | Movement::Carry(_) | Movement::Arrive(_))
    }
}

/// Object whose value is carried.
#[derive(Clone)]
pub(crate) enum Object {
    Svv(String),
    /// A private cell of the instance.
    Private(usize),
}

/// A cell whose value moves from the image of one source to that of another.
#[derive(Clone)]
pub(crate) struct CarriedCell {
    pub object: Object,
    pub from: SourceId,
    pub to: SourceId,
}

/// Number of a connection, in order of creation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Serial(u64);

impl Serial {
    /// Returns the next number.
    pub fn next(self) -> Serial {
        Serial(self.0 + 1)
    }
}

/// Reading end of a connection, and its destination.
pub(crate) struct Inlet {
    /// Number of the connection; only the latest connection of each pair is used.
    pub serial: Serial,
    pub reader: SourceId,
    pub writer: SourceId,
    /// Inbound end; `None` if the pair has no members left.
    pub inbound: Option<Arc<Inbound>>,
}

/// Builds movements from operations, in the order in which they must take effect.
#[derive(Default)]
pub(crate) struct Builder {
    done: VecDeque<Movement>,
    group: Vec<(SourceId, Vec<Op>)>,
    barrier: bool,
    /// Known locations of cells that are written by blocks of several sources.
    pub homes: Homes,
}

impl Builder {
    /// Creates a builder with the current locations of cells.
    pub fn at_home(homes: Homes) -> Builder {
        Builder { homes, ..Builder::default() }
    }

    /// Adds an operation. After a barrier, it waits for all previous operations, unless they are all in the same source.
    pub fn add(&mut self, source: SourceId, op: Op) {
        if self.barrier && !(self.group.len() == 1 && self.group[0].0 == source) {
            self.flush();
        }
        self.barrier = false;
        put(&mut self.group, source, op);
    }

    /// Makes subsequent operations take effect after all previous ones.
    pub fn barrier(&mut self) {
        self.barrier = true;
    }

    /// Makes subsequent operations wait until all previous ones have been acknowledged, in any source.
    pub fn divide(&mut self) {
        self.flush();
    }

    /// Adds a movement that is not an operation; everything before it must be acknowledged first.
    pub fn then(&mut self, movement: Movement) {
        self.flush();
        self.done.push_back(movement);
    }

    pub fn finish(mut self) -> VecDeque<Movement> {
        self.flush();
        self.done
    }

    fn flush(&mut self) {
        self.barrier = false;
        if !self.group.is_empty() {
            self.done.push_back(Movement::Scripts(std::mem::take(&mut self.group)));
        }
    }
}

/// Returns one script per source from operations whose order between sources does not matter.
pub(crate) fn by_source(ops: impl IntoIterator<Item = (SourceId, Op)>) -> Vec<(SourceId, Vec<Op>)> {
    let mut scripts = Vec::new();
    ops.into_iter().for_each(|(source, op)| put(&mut scripts, source, op));
    scripts
}

fn put(scripts: &mut Vec<(SourceId, Vec<Op>)>, source: SourceId, op: Op) {
    match scripts.iter_mut().find(|(s, _)| *s == source) {
        Some((_, ops)) => ops.push(op),
        None => scripts.push((source, vec![op])),
    }
}
