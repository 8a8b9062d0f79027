// SPDX-License-Identifier: Apache-2.0
//! Banks: adjacent steps with the same block, run by one entry, so that the compiler sees the body inside the loop.
//!
//! A bank entry does for each of its steps exactly what the entry of the block does, in order. It is not part of the ABI: blocks of a
//! module without bank entries are run one by one.

use crate::abi::{Invocation, Run};
use core::ffi::c_void;
use std::collections::HashMap;
use std::sync::RwLock;

/// Call in the step loop: 24 bytes, also read by the kernel's `containment.c`. The first word of each instance contains `abi::RUNNING`
/// while the instance may be aborted.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct Call {
    pub run: Run,
    pub instance: *mut c_void,
    pub invocation: *const Invocation,
}

/// Bank entry of a block: runs the calls `from..to`, writes the index of each to `step` before it begins, and returns at the first
/// non-zero result, with `step` at that call. Returns 0 if all ran, with `step` at the last one.
///
/// # Safety
/// `calls` must have at least `to` calls; each of `from..to` must be a call of this block and meet the requirements of [`Run`]. `from` must be less than `to`.
pub type Bank = unsafe extern "C" fn(calls: *const Call, step: *mut u32, from: u32, to: u32) -> u64;

/// Name of the function with which a code module may provide the bank entries of its own blocks, like [`of`]. The number is the version
/// of [`Call`] and [`Bank`].
pub const BANK_SYMBOL: &str = "opengpac_bank_1";

static BANKS: RwLock<Option<HashMap<usize, Bank>>> = RwLock::new(None);

/// Registers this bank entry for blocks whose entry is `run`; existing tables continue without it. Not for the real-time path.
pub fn add(run: Run, bank: Bank) {
    BANKS.write().expect("nobody panics with the lock held").get_or_insert_default().insert(run as usize, bank);
}

/// Returns the bank entry of the blocks whose entry is `run`, if they have one. Not for the real-time path.
pub fn of(run: Run) -> Option<Bank> {
    BANKS.read().expect("nobody panics with the lock held").as_ref()?.get(&(run as usize)).copied()
}

/// Implements a bank entry; `once` does what `run` of the block does. For generated code.
///
/// # Safety
/// Same as for [`Bank`].
#[doc(hidden)]
#[inline(always)]
pub unsafe fn run(calls: *const Call, step: *mut u32, from: u32, to: u32, once: impl Fn(*mut c_void, *const Invocation) -> u64) -> u64 {
    use core::sync::atomic::{Ordering, compiler_fence};
    for index in from..to {
        // The results of the previous step are in memory, and nothing of this one has begun: a signal may end it from this point.
        compiler_fence(Ordering::SeqCst);
        // SAFETY: the caller's promise.
        let result = unsafe {
            step.write_volatile(index);
            compiler_fence(Ordering::SeqCst);
            let call = &*calls.add(index as usize);
            once(call.instance, call.invocation)
        };
        if result != 0 {
            return result;
        }
    }
    0
}
