// SPDX-License-Identifier: Apache-2.0
//! Silences panics in blocks: such a panic is a condition, not a message, so the panic hook prints nothing for it. Other panics are
//! printed.
//!
//! A flag set by each entry would cost every invocation more than the block itself. Instead the hook, which runs only on a panic,
//! searches the stack for the entry of a block. That takes some microseconds and no lock.

use core::ffi::{c_int, c_void};
use std::panic;
use std::sync::Once;
use std::sync::atomic::{AtomicPtr, Ordering};

/// Entry point whose panics are not printed; an element of a linked list. The list never shrinks: each block of the process adds two
/// elements.
struct Entry {
    run: *const c_void,
    next: *const Entry,
}

static ENTRIES: AtomicPtr<Entry> = AtomicPtr::new(core::ptr::null_mut());

/// Silences panics under this entry of a block or of its bank.
pub fn contain_entry(run: *const c_void) {
    static HOOK: Once = Once::new();
    let entry = Box::into_raw(Box::new(Entry { run, next: core::ptr::null() }));
    let mut head = ENTRIES.load(Ordering::Acquire);
    loop {
        // SAFETY: `entry` is ours until the exchange below succeeds.
        unsafe { (*entry).next = head };
        match ENTRIES.compare_exchange_weak(head, entry, Ordering::AcqRel, Ordering::Acquire) {
            Ok(_) => break,
            Err(now) => head = now,
        }
    }
    HOOK.call_once(|| {
        let before = panic::take_hook();
        panic::set_hook(Box::new(move |what| {
            if !is_under_an_entry() {
                before(what);
            }
        }));
    });
}

fn is_under_an_entry() -> bool {
    let mut found = false;
    // SAFETY: `visit` is called with the pointer given here while `found` lives; the unwinder is the one that the panic uses.
    unsafe { _Unwind_Backtrace(visit, (&raw mut found).cast()) };
    found
}

extern "C" fn visit(frame: *mut c_void, found: *mut c_void) -> c_int {
    const GO_ON: c_int = 0;
    const STOP: c_int = 4;
    // SAFETY: the unwinder passes a frame; one byte before the return address is inside the call. Entries are never freed.
    unsafe {
        let function = _Unwind_FindEnclosingFunction(_Unwind_GetIP(frame).wrapping_sub(1) as *mut c_void);
        let mut entry = ENTRIES.load(Ordering::Acquire).cast_const();
        while !entry.is_null() {
            if core::ptr::eq((*entry).run, function) {
                *found.cast::<bool>() = true;
                return STOP;
            }
            entry = (*entry).next;
        }
    }
    GO_ON
}

// The unwinder, which the standard library links anyway.
unsafe extern "C" {
    fn _Unwind_Backtrace(visit: extern "C" fn(*mut c_void, *mut c_void) -> c_int, argument: *mut c_void) -> c_int;
    fn _Unwind_GetIP(frame: *mut c_void) -> usize;
    fn _Unwind_FindEnclosingFunction(address: *mut c_void) -> *mut c_void;
}
