// SPDX-License-Identifier: Apache-2.0
//! Floating-point state: ensures that no block computes with control words set by another.
//!
//! The control words are set to standard values at the beginning of a firing and checked after its steps: two accesses per firing, none
//! per block. Blocks of a module that *can* change them (as detected by the loader, [`mark::FLOATS`]) are called through [`run`], which
//! checks after each invocation: a change is a fault of that block, and is undone. A change found only at the end of a firing stops the
//! source before anything is published; from then on, every block of this process is called through [`run`], so that the next change can
//! be attributed.
use crate::block::Block;
use crate::containment::Call;
use crate::memory::Cell;
use opengpac::Invocation;
use opengpac::abi::{Header, Run, mark, outcome};
use opengpac::floats::{Words, empty_stack};
use std::ffi::c_void;
use std::ptr;
use std::sync::atomic::{AtomicBool, Ordering};

/// Set if the control words have changed unexpectedly.
pub(crate) static DISTRUST: AtomicBool = AtomicBool::new(false);

/// Sets the standard control words at the beginning of a firing.
#[inline]
pub(crate) fn begin() {
    Words::standardise();
    empty_stack();
}

/// Returns true if each invocation of `block` must be checked.
pub fn are_looked_at(block: &Block) -> bool {
    block.descriptor().reserved & mark::FLOATS != 0 || DISTRUST.load(Ordering::Relaxed)
}

/// Flag in the first word of a step's argument; the rest of the word is the address of the block's header.
const WATCHED: u64 = 1 << 62;

/// A block whose invocations are checked one by one.
#[repr(C)]
pub(crate) struct WatchedBlock {
    /// Word from which the containment determines whether the block may be aborted: the address of its header, combined with [`WATCHED`].
    header: u64,
    call: Call,
    /// Cells to which the block may store; the first is the instance itself.
    stores: Vec<Cell>,
    before: Vec<u8>,
}

impl WatchedBlock {
    /// Returns the watcher of `block`; `None` if the block cannot change the control words.
    pub(crate) fn of(block: &Block) -> Option<Box<WatchedBlock>> {
        if !are_looked_at(block) {
            return None;
        }
        let stores: Vec<Cell> = [block.memory()].into_iter().chain(block.stores().map(|(_, cell)| cell)).cloned().collect();
        let before = vec![0; stores.iter().map(Cell::len).sum()];
        let call = Call { run: block.descriptor().run, instance: block.instance().cast(), invocation: ptr::null() };
        let header = WATCHED | call.instance as u64;
        Some(Box::new(WatchedBlock { header, call, stores, before }))
    }

    fn note(&mut self) {
        let mut rest = self.before.as_mut_slice();
        for cell in &self.stores {
            let (bytes, behind) = rest.split_at_mut(cell.len());
            // SAFETY: the cell is held and as long as the bytes; its source's own thread, and no block runs.
            unsafe { bytes.as_mut_ptr().copy_from_nonoverlapping(cell.start(), bytes.len()) };
            rest = behind;
        }
    }

    fn put_back(&self) {
        let mut rest = self.before.as_slice();
        for cell in &self.stores {
            let (bytes, behind) = rest.split_at(cell.len());
            // SAFETY: as in `note`.
            unsafe { cell.start().copy_from_nonoverlapping(bytes.as_ptr(), bytes.len()) };
            rest = behind;
        }
        // SAFETY: an instance starts with its header. Whatever happens, an invocation adds one to its number.
        unsafe { (*self.call.instance.cast::<Header>()).number += 1 };
    }
}

/// Entry of a watched block.
///
/// # Safety
/// `watched` must be a [`WatchedBlock`] to which there is no other reference; `invocation` must be valid.
pub unsafe extern "C" fn run(watched: *mut c_void, invocation: *const Invocation) -> u64 {
    // SAFETY: the table keeps what it watches, and calls each with its own; no other reference to it is alive.
    let watched = unsafe { &mut *watched.cast::<WatchedBlock>() };
    watched.note();
    // SAFETY: the block is held, its memory in order.
    let result = unsafe { (watched.call.run)(watched.call.instance, invocation) };
    let is_changed = Words::standardise();
    empty_stack();
    if is_changed {
        watched.put_back();
        return outcome::FLOATS;
    }
    result
}

/// Runs `call` outside any firing (a trial, for example) with standard control words. Returns its result, and true if it changed them.
/// Restores the caller's control words.
pub fn outside<R>(call: impl FnOnce() -> R) -> (R, bool) {
    let _standard = opengpac::floats::Standard::enter();
    let result = call();
    (result, Words::standardise())
}

/// Returns the entry that the table calls for `block`: its own, or that of its watcher. The table must keep the watcher.
pub(crate) fn entry(block: &Block) -> (Run, *mut c_void, Option<Box<WatchedBlock>>) {
    match WatchedBlock::of(block) {
        None => (block.descriptor().run, block.instance().cast(), None),
        Some(mut watched) => (run, (&raw mut *watched).cast(), Some(watched)),
    }
}
