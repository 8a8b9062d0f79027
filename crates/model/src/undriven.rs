// SPDX-License-Identifier: Apache-2.0
//! Cells that no block writes, and inputs whose value is never new.
use crate::flatten::{Flat, Origin, Port};
use crate::interface::Kind;
use crate::parameters::CheckedInput;
use crate::plan::Remark;
use crate::refusal::{Class, Refusal};

/// Refuses a synchronous or ratio input if no block writes its cell. A value stored by an input parameter does not drive the input,
/// because it does not count as a new value.
pub(crate) fn undriven(flat: &mut Flat<'_>, inputs: &[CheckedInput]) {
    let groups = flat.groups.iter().filter(|group| group.origin == Origin::InputOnly);
    let ports: Vec<Port> = groups.flat_map(|group| group.ports.iter().copied()).filter(|port| flat.waits(*port)).collect();
    for port in ports {
        let mode = flat.blocks[port.0].mode(port.1).name();
        let (described, name) = (flat.described(port), flat.port_name(port));
        let given = inputs.iter().find(|input| input.ports.contains(&port));
        let why = given.map_or_else(
            || "no block writes its cell".to_owned(),
            |input| format!("only the input parameter '{}' stores into it, which does not count as a new value", input.name),
        );
        let refusal = Refusal::new(Class::SchedulingError, format!("nothing drives {described}: it is {mode}, and {why}"));
        let refusal = refusal.remedy(format!("relax it with modes={{'{name}': 'asynchronous'}}, or bind a writer to it"));
        let place = flat.blocks[port.0].place.clone();
        flat.push(refusal.end(described, &place).at(&place).about([flat.part(port)]));
    }
}

/// Remarks on each cell that has no writer, input parameter, constant or default, and therefore keeps its initial value. Marks all cells
/// without a writer as constants or as input-only.
pub(crate) fn cells_without_writer(flat: &mut Flat<'_>, given: &[Port]) -> Vec<Remark> {
    let mut remarks = Vec::new();
    for at in 0..flat.groups.len() {
        let group = &flat.groups[at];
        if group.origin != Origin::Cell || group.ports.iter().any(|port| flat.item_kind(*port) == Kind::Output) {
            continue;
        }
        let is_given = group.ports.iter().any(|port| given.contains(port));
        if !is_given && group.ports.iter().any(|port| flat.has_value(*port)) {
            flat.groups[at].origin = Origin::Constant;
            continue;
        }
        if !is_given {
            let text = format!("cell '{}' has no writer and no input parameter: it keeps its initial value", group.name);
            remarks.push(Remark { text, place: group.place.clone() });
        }
        flat.groups[at].origin = Origin::InputOnly;
    }
    remarks
}
