// SPDX-License-Identifier: Apache-2.0
//! Histories of SVVs, merged from the values stored by blocks, the PS and ψ.
use crate::svvs::cells::{ROWS_SPARE, Stays, StoredValue};
use interconnect::Row;
use kernel::{RowsEnd, SourceId};
use std::collections::VecDeque;
use std::sync::Arc;

/// A value with its number and time.
type Past = (u64, i64, Vec<u8>);

/// A value stored by a block, as the source and the row.
type WrittenRow = (SourceId, Row);

/// History of an SVV at one instant.
pub(crate) struct KeptHistory {
    pub history: usize,
    /// Rings, with their numbers of rows at that instant. Later rows are omitted, because stores that occurred between them would be
    /// missing.
    pub rings: Vec<(SourceId, Arc<RowsEnd>, u64)>,
    pub stays: Arc<Stays>,
    pub stores: Arc<VecDeque<StoredValue>>,
}

impl KeptHistory {
    /// Returns up to `count` most recent values, oldest first: (number, time, bytes).
    pub fn last(&self, count: usize) -> Vec<Past> {
        let mut values = self.with_stores(self.written());
        let keep = count.min(self.history);
        values.split_off(values.len().saturating_sub(keep))
    }

    /// Returns the values stored by blocks, to the extent that they are still kept, oldest first. Values with the same time are in the
    /// order of their homes.
    fn written(&self) -> Vec<WrittenRow> {
        let rows = |(source, ring, written): &(SourceId, Arc<RowsEnd>, u64)| -> Vec<WrittenRow> {
            let mut rows = ring.reader().last(self.history + ROWS_SPARE);
            rows.retain(|row| row.sequence < *written);
            let first = rows.len().saturating_sub(self.history);
            rows.drain(..first);
            rows.into_iter().map(|row| (*source, row)).collect()
        };
        let mut values: Vec<WrittenRow> = self.rings.iter().flat_map(rows).collect();
        if self.rings.len() > 1 {
            values.sort_by_cached_key(|(source, row)| (row.time_ns, self.stays.of(*source, row.sequence), row.sequence));
        }
        values
    }

    /// Returns the values stored by blocks, merged with those stored by the PS and ψ, each of which carries the number of the previous
    /// invocation.
    fn with_stores(&self, written: Vec<WrittenRow>) -> Vec<Past> {
        let mut values: Vec<Past> = Vec::with_capacity(written.len() + self.stores.len());
        let put =
            |values: &mut Vec<Past>, store: &StoredValue| values.push((values.last().map_or(0, |(number, ..)| *number), store.time_ns, store.bytes.clone()));
        let mut stores = self.stores.iter().peekable();
        for (source, row) in written {
            while let Some(store) = stores.next_if(|store| !store.comes_behind(source, &row)) {
                put(&mut values, store);
            }
            values.push((row.number, row.time_ns, row.bytes));
        }
        stores.for_each(|store| put(&mut values, store));
        values
    }
}
