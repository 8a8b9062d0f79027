// SPDX-License-Identifier: Apache-2.0
//! Checks of a descriptor before it is installed.

use super::{BlockFace, Kind, Refusal, TypeFace, TypeText, invalid};
use crate::abi::{self, Descriptor, Header, Item};

const INSTANCE_BYTES_MAX: u32 = 1 << 28;

/// Checks the memory of an instance as a whole.
pub(super) fn check_memory(block: &str, descriptor: &Descriptor) -> Result<(), Refusal> {
    let (size, align) = (descriptor.instance_size, descriptor.instance_align);
    if (size as usize) < size_of::<Header>() || size > INSTANCE_BYTES_MAX || !align.is_power_of_two() || align > 4096 || !size.is_multiple_of(align) {
        return Err(invalid(block, "", &format!("an instance of {size} bytes, aligned to {align}, is impossible")));
    }
    Ok(())
}

/// Checks that the parts of an item lie within the instance.
pub(super) fn check_item(block: &str, name: &str, descriptor: &Descriptor, item: &Item, kind: Kind) -> Result<(), Refusal> {
    let bad = |what: &str| Err(invalid(block, name, what));
    let inside = |offset: u32, size: u32| offset as usize >= size_of::<Header>() && u64::from(offset) + u64::from(size) <= u64::from(descriptor.instance_size);
    let bound = matches!(kind, Kind::Input | Kind::Output | Kind::DeviceRead | Kind::DeviceWrite);
    let in_place = matches!(kind, Kind::Input | Kind::Output) && item.offset == abi::NONE;
    if in_place && (item.size == 0 || item.flags & (abi::flag::DEFAULT | abi::flag::SIZED | abi::flag::HISTORY) != 0) {
        return bad("it is used in place but has a default, a size or a history");
    }
    let valued = !in_place && (kind != Kind::Condition || item.offset != abi::NONE);
    if valued && (item.size == 0 || !inside(item.offset, item.size)) {
        return bad("its value lies outside the instance");
    }
    if !valued && !in_place && (item.size != 0 || item.report != abi::NONE) {
        return bad("it has no value but has a size");
    }
    if bound != (item.address != abi::NONE) || (bound && (!inside(item.address, 8) || !item.address.is_multiple_of(8))) {
        return bad("its address is missing or outside the instance");
    }
    let reports = kind == Kind::Condition && valued;
    if reports != (item.report != abi::NONE) || (reports && !inside(item.report, item.size)) {
        return bad("its reported value is missing or outside the instance");
    }
    if kind == Kind::Size {
        if item.size != 4 || item.ratio == 0 || item.ratio > item.element {
            return bad("its limits are impossible");
        }
    } else if item.flags & abi::flag::HISTORY != 0 {
        let asynchronous_input = kind == Kind::Input && item.mode == abi::mode::ASYNCHRONOUS && item.flags & abi::flag::SIZED == 0;
        if !asynchronous_input || item.ratio == 0 || item.ratio.checked_mul(item.element) != Some(item.size) {
            return bad("it is not a history of a number of values");
        }
    } else if item.flags & abi::flag::SIZED == 0 && item.element != item.size {
        return bad("its size and that of its element differ");
    } else if item.flags & abi::flag::SIZED != 0 && (item.element == 0 || !item.size.is_multiple_of(item.element)) {
        return bad("its size is not a multiple of its element's");
    }
    Ok(())
}

/// Checks the items of a block as a whole: names, sizes, types.
pub(super) fn check_block(block: &BlockFace, types: &[TypeFace]) -> Result<(), Refusal> {
    let bad = |item: &str, what: &str| Err(invalid(&block.name, item, what));
    if !is_name(&block.name) {
        return bad("", "its name is not an identifier");
    }
    let mut sizes = block.items.iter().filter(|item| item.kind == Kind::Size);
    let size = sizes.next();
    if let Some(second) = sizes.next() {
        return bad(&second.name, "a block can have only one size");
    }
    for (index, item) in block.items.iter().enumerate() {
        if !is_name(&item.name) {
            return bad(&item.name, "its name is not an identifier");
        }
        if block.items[..index].iter().any(|other| other.name == item.name) {
            return bad(&item.name, "the block has two items of this name");
        }
        if item.type_text.is_empty() && item.offset.is_none() || item.kind == Kind::Size {
            continue;
        }
        let Some(text) = TypeText::parse(&item.type_text) else { return bad(&item.name, "its type cannot be read") };
        let Some(element) = text.base_size(types) else {
            return bad(&item.name, &format!("the type '{}' does not belong to the module: declare it with TYPE", text.base));
        };
        let count = match (item.sized, size) {
            (false, _) if text.size_name().is_none() => text.count(),
            (true, Some(size)) if text.size_name() == Some(&size.name) => text.count_of(size.limits.map_or(0, |limits| limits.1 as usize)),
            _ => return bad(&item.name, "the length in its type is not a number, nor the name of the block's size"),
        };
        if element * count * (item.history as usize).max(1) != item.size {
            return bad(&item.name, &format!("its type '{}' has {} bytes, but its value has {}", item.type_text, element * count, item.size));
        }
    }
    Ok(())
}

fn is_name(name: &str) -> bool {
    let mut letters = name.chars();
    letters.next().is_some_and(|c| c.is_ascii_alphabetic() || c == '_') && letters.all(|c| c.is_ascii_alphanumeric() || c == '_')
}
