// SPDX-License-Identifier: Apache-2.0
//! Names used in a replayable record.
use crate::svvs::cells::SvvRecord;
use indexmap::IndexMap;
use kernel::{Cell, SourceId};
use runtime::Host;
use std::collections::HashMap;

/// Names the cells of SVVs in the image of `source`, for replay.
pub(crate) fn name_cells(host: &Host, svvs: &IndexMap<String, SvvRecord>, recorded: &mut HashMap<(String, SourceId), Cell>, source: SourceId) {
    let Some(trace) = host.trace() else { return };
    for (name, svv) in svvs {
        let Some(cell) = svv.cells.get(&source) else { continue };
        let known = recorded.insert((name.clone(), source), cell.clone());
        if known.is_none_or(|known| !known.is_same(cell)) {
            trace.name(source, name, &svv.type_text, &svv.unit, cell);
        }
    }
}
