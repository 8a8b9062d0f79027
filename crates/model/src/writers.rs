// SPDX-License-Identifier: Apache-2.0
//! SVVs that an instance writes, as seen by later applications.
use crate::configuration::{Configuration, Rate, Writer};
use crate::interface::Mode;
use crate::plan::{CellKind, Plan};

impl Plan {
    /// Returns the writer of each SVV that this plan writes: the entries of [`Configuration::writers`] while the instance exists.
    /// `instance` is its name (`joint_servo#2`).
    pub fn writers(&self, instance: &str, configuration: &Configuration) -> Vec<(String, Writer)> {
        let mut writers = Vec::new();
        for cell in &self.cells {
            let CellKind::Svv { name, .. } = &cell.kind else { continue };
            for (block, item) in &cell.writers {
                let block = &self.blocks[*block];
                let interface = configuration.interfaces.get(&block.block);
                let port = interface.and_then(|interface| interface.items.get(*item)).map_or("", |item| item.name.as_str());
                let mode = block.bindings.iter().find(|bound| bound.item == *item).map_or(Mode::Synchronous, |bound| bound.mode);
                let mut rates: Vec<Rate> = Vec::new();
                for (_, rate) in &self.activations[block.activation].rates {
                    if !rates.contains(rate) {
                        rates.push(rate.clone());
                    }
                }
                let port = format!("{}.{port}", block.label);
                let (instance, source, place) = (instance.to_owned(), block.source.clone(), block.place.clone());
                writers.push((name.clone(), Writer { instance, port, source, mode, rates, place }));
            }
        }
        writers
    }
}
