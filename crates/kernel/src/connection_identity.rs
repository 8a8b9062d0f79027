// SPDX-License-Identifier: Apache-2.0
//! Identity of a connection whose ends are created separately, and the placeholder for an end that carries no data.
use interconnect::{ConnectionSpec, Full, Header, Receiver, Sender};
use std::any::Any;
use std::sync::Arc;

/// Distance between the ends of a connection.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum Reach {
    /// Both ends are in one process.
    Process,
    /// The ends are in two processes of one host.
    Host,
    /// The ends are on two hosts.
    Network,
}

/// Identity of a connection, from which each of its ends is created, regardless of where that end is located.
#[derive(Clone, Copy, Debug)]
pub struct Way {
    /// Number of the connection: unique in the system, never reused.
    pub number: u64,
    /// Sources and lengths of the connection.
    pub spec: ConnectionSpec,
    /// Distance between the ends.
    pub reach: Reach,
}

/// Placeholder for an end of a connection that carries no data: a remote end, in a table that is kept here but runs elsewhere
/// ([`Nowhere::default`]), or an end that could not be created, in a table that runs here ([`Nowhere::of`]).
#[derive(Default)]
pub struct Nowhere {
    group: Vec<u8>,
    /// Owner of resources that live as long as this end.
    _kept: Option<Arc<dyn Any + Send + Sync>>,
}

impl Nowhere {
    /// Creates the placeholder for an end of `spec` that could not be created: publications are discarded, and rows are refused as if the
    /// queue were full.
    pub fn of(spec: &ConnectionSpec) -> Nowhere {
        Nowhere { group: vec![0; spec.asynchronous_len], _kept: None }
    }

    /// Creates the placeholder for a remote end; keeps `kept` alive.
    pub fn keeping(kept: Option<Arc<dyn Any + Send + Sync>>) -> Nowhere {
        Nowhere { group: Vec::new(), _kept: kept }
    }
}

impl Sender for Nowhere {
    fn group(&mut self) -> &mut [u8] {
        &mut self.group
    }

    fn publish(&mut self, _number: u64, _now_ns: i64) {}

    fn push(&mut self, _number: u64, _now_ns: i64, _fill: &mut dyn FnMut(&mut [u8])) -> Result<(), Full> {
        Err(Full)
    }

    fn arrived(&self) -> bool {
        false
    }
}

impl Receiver for Nowhere {
    fn latch(&mut self, _now_ns: i64) -> Option<Header> {
        None
    }

    fn group(&self) -> &[u8] {
        &self.group
    }

    fn peek_row(&mut self) -> Option<(u64, &[u8])> {
        None
    }

    fn pop_row(&mut self) -> bool {
        false
    }

    fn rows(&self) -> usize {
        0
    }
}
