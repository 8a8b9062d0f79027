// SPDX-License-Identifier: Apache-2.0
//! Checks that each constant of a definition is valid for its item and is actually read.
use crate::flatten::{Flat, describe};
use crate::interface::Kind;
use crate::refusal::{Class, Refusal, Refusals, Where};

/// Refuses a constant for an input that is bound elsewhere, because it would never be read.
pub(crate) fn constants_on_bound_inputs(flat: &mut Flat<'_>) {
    for group in flat.groups.iter().filter(|group| group.origin.varies()) {
        for &(block, item) in &group.ports {
            if flat.blocks[block].constants.iter().any(|(at, _)| *at == flat.blocks[block].kind.whole(item)) {
                let message = format!("{} is both given a constant and bound to '{}'", flat.described((block, item)), group.name);
                let refusal = Refusal::new(Class::CoverError, message).remedy("leave one of them out").about([flat.part((block, item))]);
                flat.refusals.push(refusal.at(&flat.blocks[block].place));
            }
        }
    }
}

/// Refuses constants that are not valid for their items: outside the range, or of the wrong type (to the extent that the size is known).
pub(crate) fn constants_of_other_types(flat: &mut Flat<'_>) {
    let mut refusals = Refusals::new();
    for block in &flat.blocks {
        for (item, value) in &block.constants {
            let declared = block.kind.item(*item);
            let what = || format!("the constant for {}", describe(block, *item));
            let drawn = || Where::Port { block: block.label.clone(), port: declared.name.clone() };
            if let Some(Err(refusal)) = declared.range.map(|range| range.check(&what(), &declared.unit, value)) {
                refusals.push(refusal.at(&block.place).about([drawn()]));
                continue;
            }
            let Some(layout) = block.kind.layout(*item, None).filter(|_| declared.kind != Kind::Size) else { continue };
            if let Err(refusal) = layout.read.encode(value, &declared.unit) {
                refusals.push(refusal.for_what(&what()).at(&block.place).about([drawn()]));
            }
        }
    }
    refusals.into_iter().for_each(|refusal| flat.push(refusal));
}
