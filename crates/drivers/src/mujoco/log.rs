// SPDX-License-Identifier: Apache-2.0
//! MuJoCo's messages. Its default receiver prints and opens a log file, which allocates, so it is unsuitable for a real-time thread.
//!
//! The receiver of this driver is installed when the library is loaded. The first message of a thread that is inside a plant is kept as
//! the cause, in a fixed-size buffer of that thread; all other messages are forwarded to the previous receiver, so that a program that
//! uses MuJoCo itself still sees its messages. An error (level 3) does not return to its caller: after this receiver has returned, MuJoCo
//! ends the process. Therefore, the plant never passes unchecked sizes or indices to MuJoCo, and a model is tried before it is loaded:
//! `trial.rs`.
use super::functions::{LogMessage, LogReceiver, MuJoCo};
use std::cell::{Cell, UnsafeCell};
use std::ffi::CStr;
use std::sync::OnceLock;

const KEPT_MAX: usize = 256;

struct KeptMessage {
    inside: Cell<bool>,
    length: Cell<usize>,
    text: UnsafeCell<[u8; KEPT_MAX]>,
}

thread_local! {
    static KEPT: KeptMessage = const { KeptMessage { inside: Cell::new(false), length: Cell::new(0), text: UnsafeCell::new([0; KEPT_MAX]) } };
}
static BEFORE: OnceLock<LogReceiver> = OnceLock::new();

/// Installs this driver's receiver in the library. Messages outside a plant are forwarded to the receiver that was in place at the first
/// installation.
pub(super) fn install(mujoco: &MuJoCo) {
    // SAFETY: `receive` has the type that MuJoCo requires and lives as long as the process, and so does the library.
    if let Some(before) = unsafe { (mujoco.mju_setLogHandler)(Some(receive)) } {
        BEFORE.get_or_init(|| before);
    }
}

/// Runs `calls` into MuJoCo on behalf of a plant; returns true if MuJoCo issued a warning during them. [`text`] returns the warning.
pub(super) fn watch(calls: impl FnOnce()) -> bool {
    KEPT.with(|kept| {
        kept.inside.set(true);
        kept.length.set(0);
        calls();
        kept.inside.set(false);
        kept.length.get() > 0
    })
}

/// Returns the first message of the last [`watch`] in this thread.
pub(super) fn text() -> String {
    KEPT.with(|kept| {
        // SAFETY: only this thread accesses its own buffer, and no `receive` runs during this call.
        let text = unsafe { &*kept.text.get() };
        String::from_utf8_lossy(&text[..kept.length.get()]).into_owned()
    })
}

unsafe extern "C" fn receive(message: *const LogMessage) {
    let ours = KEPT.with(|kept| {
        if kept.inside.get() && kept.length.get() == 0 {
            // SAFETY: MuJoCo passes a message whose subject ends in NUL.
            let subject = unsafe { CStr::from_ptr(&raw const (*message).subject as *const _) }.to_bytes();
            let length = subject.len().min(KEPT_MAX);
            // SAFETY: only this thread accesses its own buffer, and there is no reference to it while MuJoCo runs.
            unsafe { (&mut *kept.text.get())[..length].copy_from_slice(&subject[..length]) };
            kept.length.set(length.max(1));
        }
        kept.inside.get()
    });
    // SAFETY: the level is the first member of every message.
    let fatal = unsafe { (*message).level } >= 3;
    if (!ours || fatal)
        && let Some(before) = BEFORE.get()
    {
        // SAFETY: it was MuJoCo's receiver before ours, and takes the same message.
        unsafe { before(message) };
    }
}
