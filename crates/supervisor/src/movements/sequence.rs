// SPDX-License-Identifier: Apache-2.0
//! Sequences: what a verb instance still has to have done by the kernels, in order.
//!
//! A command list may reach over several sources. Operations on one source travel as one script; a source is told only when
//! those before it have acknowledged, where the order matters (a barrier). What lies in one source alone needs no barrier: it
//! is one script, and acts between two firings as one.
use crate::wiring::installed::Homes;
use kernel::{Cell, Inbound, Op, SourceId};
use model::plan::Target;
use std::collections::VecDeque;
use std::sync::Arc;

/// Movement that follows when everything before has been acknowledged.
pub(crate) enum Movement {
    /// One script a source, all at once.
    Scripts(Vec<(SourceId, Vec<Op>)>),
    /// The first scripts of a start: they set everything back and store these values of ψ. What takes the place of a start that has not come
    /// to that does it first. `ends`: they end it, too.
    Opening {
        scripts: Vec<(SourceId, Vec<Op>)>,
        stores: Vec<(Target, Vec<u8>)>,
        ends: bool,
    },
    /// New tables for these sources, as the system is at that moment.
    Tables(Vec<SourceId>),
    /// A new table for the only source of an instance and, right behind it, these operations: one script.
    Together {
        source: SourceId,
        ops: Vec<Op>,
        ends: bool,
    },
    /// The same for instances that follow another writer of an SVV: with what makes their activations due.
    Follow {
        sources: Vec<SourceId>,
        follows: Vec<(SourceId, Op)>,
    },
    /// Puts these inbound ends in the place of those of the same writer; then new tables for their sources.
    Inbound(Vec<Inlet>),
    /// Blocks are about to write cells that may lie with other sources: (planned cell, block).
    Home(Vec<(usize, usize)>),
    /// Cells get a home in another source: their values are captured in the one before …
    Carry(Vec<CarriedCell>),
    /// … and stored in the new one.
    Arrive(Vec<CarriedCell>),
    /// Waits until machines say in these channels that they follow what is written: the script before has captured them.
    Operating(Vec<(SourceId, Cell)>),
    /// Sets the SVVs of a logical device that start as copies of others, from what the script before captured.
    CopyInitial,
    /// `gpac.ready()`: the device that this instance keeps going is enabled.
    Ready,
    /// The stage (list, stage) is entered: its wait starts to count.
    Entered {
        list: usize,
        stage: usize,
    },
    Suspended,
    Resumed,
    /// The end: what was captured completes the report.
    Ended,
}

impl Movement {
    /// Returns true for a new table of this source and of no other.
    pub fn is_table_of(&self, source: SourceId) -> bool {
        matches!(self, Movement::Tables(sources) if !sources.is_empty() && sources.iter().all(|of| *of == source))
    }

    /// Returns true for what the system needs whatever becomes of the instance: tables, connections, values of SVVs.
    pub fn is_structural(&self) -> bool {
        matches!(self, Movement::Tables(_) | Movement::Follow { .. } | Movement::Inbound(_) | Movement::Home(_) | Movement::Carry(_) | Movement::Arrive(_))
    }
}

/// Object that is carried.
#[derive(Clone)]
pub(crate) enum Object {
    Svv(String),
    /// A private cell of the instance.
    Private(usize),
}

/// A cell whose value goes from the image of one source to that of another.
#[derive(Clone)]
pub(crate) struct CarriedCell {
    pub object: Object,
    pub from: SourceId,
    pub to: SourceId,
}

/// Number of a connection, in the order in which they were made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Serial(u64);

impl Serial {
    /// Returns the next one.
    pub fn next(self) -> Serial {
        Serial(self.0 + 1)
    }
}

/// The reading end of a connection, and where it goes.
pub(crate) struct Inlet {
    /// Counts the connections that were made: of a pair only the latest is taken.
    pub serial: Serial,
    pub reader: SourceId,
    pub writer: SourceId,
    /// `None`: the pair has no members left.
    pub inbound: Option<Arc<Inbound>>,
}

/// Builds movements from operations in the order in which they shall act.
#[derive(Default)]
pub(crate) struct Builder {
    done: VecDeque<Movement>,
    group: Vec<(SourceId, Vec<Op>)>,
    barrier: bool,
    /// Where cells lie that blocks of several sources write, as far as it is known.
    pub homes: Homes,
}

impl Builder {
    /// Makes a builder that begins with cells where they are.
    pub fn at_home(homes: Homes) -> Builder {
        Builder { homes, ..Builder::default() }
    }

    /// Adds one operation. Behind a barrier it waits for all before it, unless these lie in the same source alone.
    pub fn add(&mut self, source: SourceId, op: Op) {
        if self.barrier && !(self.group.len() == 1 && self.group[0].0 == source) {
            self.flush();
        }
        self.barrier = false;
        put(&mut self.group, source, op);
    }

    /// Makes what follows act after what came so far.
    pub fn barrier(&mut self) {
        self.barrier = true;
    }

    /// Makes what follows wait until everything so far has been acknowledged, in any source.
    pub fn divide(&mut self) {
        self.flush();
    }

    /// Adds a movement that is no operation; everything before it is acknowledged first.
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

/// Returns one script a source, of operations that need no order between sources.
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
