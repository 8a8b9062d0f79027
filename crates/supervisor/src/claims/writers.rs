// SPDX-License-Identifier: Apache-2.0
//! Current writer of an SVV, and the source of this writer. Of the possible writers, the current one is a port of the instance that has
//! claimed the SVV.
use crate::registry::Registry;
use crate::svvs::cells::WriterRecord;
use indexmap::IndexMap;
use kernel::{BlockId, SourceId};
use model::plan::{CellKind, Claim, Plan};

/// Pair of the writing source and the reading source.
pub(crate) type Pair = (SourceId, SourceId);

impl Registry {
    /// Returns the current writer of an SVV: the active block of the instance that has claimed it, or else the first possible writer.
    pub fn driver_of(&self, svv: &str) -> Option<&WriterRecord> {
        let record = self.svvs.get(svv)?;
        let holder = self.claims.get(&Claim::Svv { id: record.id, name: svv.to_owned() });
        let held = || record.writers.iter().filter(|writer| Some(&writer.instance) == holder);
        held().find(|writer| Some(writer.block) == record.written_by).or_else(|| held().next()).or_else(|| record.writers.first())
    }

    /// Makes `source` the home of an SVV, that is, the source whose cell holds the current value. Returns the pairs that change.
    pub fn hand_over(&mut self, svv: &str, source: SourceId) -> Vec<Pair> {
        let Some(record) = self.svvs.get_mut(svv) else { return Vec::new() };
        if record.home == Some(source) {
            return Vec::new();
        }
        record.comes_to(source);
        let before = record.home.replace(source);
        let readers: Vec<SourceId> = record.readers.iter().filter(|(_, n)| **n > 0).map(|(s, _)| *s).collect();
        let mut pairs: Vec<Pair> = readers.iter().filter(|r| **r != source).map(|r| (source, *r)).collect();
        if let Some(before) = before {
            pairs.extend(readers.iter().filter(|r| **r != before).map(|r| (before, *r)));
        }
        pairs
    }

    /// Makes a block of the claiming instance the writer of an SVV; returns true if this changes the writer.
    pub fn writes(&mut self, svv: &str, block: BlockId) -> bool {
        self.svvs.get_mut(svv).is_some_and(|svv| svv.written_by.replace(block) != Some(block))
    }

    /// Returns the SVVs that a plan writes and to which other instances are bound.
    pub fn shared_svvs(&self, plan: &Plan) -> Vec<String> {
        let written = plan.cells.iter().filter(|cell| !cell.writers.is_empty());
        let svvs = written.filter_map(|cell| if let CellKind::Svv { name, .. } = &cell.kind { Some(name) } else { None });
        svvs.filter(|svv| self.svvs.get(*svv).is_some_and(|record| record.bound > 1)).cloned().collect()
    }

    /// Returns the instances that a new instance follows, by the SVV that they write.
    pub fn followed(&self, plan: &Plan) -> IndexMap<String, u64> {
        let svvs = plan.blocks.iter().flat_map(|block| &block.external_drivers).map(|(_, svv)| svv);
        svvs.filter_map(|svv| Some((svv.clone(), self.driver_of(svv)?.instance))).collect()
    }
}
