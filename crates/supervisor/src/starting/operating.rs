// SPDX-License-Identifier: Apache-2.0
//! Drives that need time before they follow commands: a verb's commands begin when the drives report that they follow, without making up
//! for the wait.
//!
//! A part reports this in a read Boolean channel, `PART.operating`, next to the written channels. A verb that claims one of the written
//! channels claims it first and delays everything else until all reports are true; meanwhile, the channels carry their safe values. If a
//! drive does not become ready, its driver reports it as lost, with the reason.
use crate::instances::instance::Instance;
use crate::registry::Registry;
use device::{Direction, Type};
use kernel::{Cell, Op, SourceId};
use model::plan::Claim;

/// Channel in which a part reports whether it follows commands.
const OPERATING: &str = "operating";

/// Returns the operations that capture the reports of machines.
pub(crate) fn looks(cells: &[(SourceId, Cell)]) -> impl Iterator<Item = (SourceId, Op)> + '_ {
    cells.iter().map(|(source, cell)| (*source, Op::Capture(vec![cell.clone()])))
}

/// Returns the channels in which the machines to be commanded by an instance report whether they follow commands; empty if all of them
/// follow immediately.
pub(crate) fn operating(registry: &Registry, instance: &Instance) -> Vec<(SourceId, Cell)> {
    let mut found: Vec<(&str, usize)> = Vec::new();
    for claim in &instance.plan.claims {
        let Claim::Channel { device, channel } = claim else { continue };
        let channels = registry.physical[device].device.channels();
        let Some((part, _)) = channels[*channel].name.rsplit_once('.') else { continue };
        let says = channels
            .iter()
            .position(|of| of.direction == Direction::Read && of.type_text == Type::BOOL.to_string() && of.name.rsplit_once('.') == Some((part, OPERATING)));
        found.extend(says.map(|at| (device.as_str(), at)).filter(|at| !found.contains(at)));
    }
    found.into_iter().map(|(device, channel)| (registry.physical[device].source, registry.physical[device].device.cell(channel))).collect()
}
