// SPDX-License-Identifier: Apache-2.0
//! Steps without a block: copies, and appends to windows.
use crate::memory::Cell;
use crate::step::Append;
use opengpac::abi::Invocation;
use std::ffi::c_void;
use std::ptr;

/// Kind of a step without a block: a copy or an append of the table, by its index.
#[derive(Clone, Copy)]
pub enum Aside {
    None,
    Copy(u32),
    Append(u32),
}

/// The copies made by one step. The step loop treats the first word of every instance as `Header::number`; here it is 0, so `RUNNING` is
/// never set and the containment never aborts a copy.
#[repr(C)]
pub struct Copies(pub(crate) u64, pub Vec<(Cell, Cell)>);

#[repr(C)]
pub struct Appends(pub(crate) u64, pub Vec<Append>);

/// Entry of a copy step.
pub(crate) unsafe extern "C" fn copy(instance: *mut c_void, _: *const Invocation) -> u64 {
    // SAFETY: the table keeps its copies, and calls each with its own.
    let copies = unsafe { &*instance.cast::<Copies>() };
    for (from, to) in &copies.1 {
        // SAFETY: both cells are held and of one length (checked when the table was built).
        unsafe { ptr::copy(from.start(), to.start(), to.len()) };
    }
    0
}

/// Entry of a step that appends to windows.
pub(crate) unsafe extern "C" fn append(instance: *mut c_void, _: *const Invocation) -> u64 {
    // SAFETY: the table keeps its appends, and calls each with its own.
    let appends = unsafe { &*instance.cast::<Appends>() };
    for append in &appends.1 {
        // SAFETY: the block is held, and its invocation has returned: its number is that of the next one.
        let header = unsafe { &*append.block.header() };
        if header.number.wrapping_sub(header.activated).is_multiple_of(u64::from(append.ratio.max(1))) {
            append.window.append(&append.value);
        }
    }
    0
}
