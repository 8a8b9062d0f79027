// SPDX-License-Identifier: Apache-2.0
//! The C package: the programming-system side of OpenGPAC for C programs. `include/opengpac_ps.h` is its manual.
//!
//! This crate converts strings and catches panics; every call is [`api::call`].
use serde_json::Value as Json;
use std::cell::RefCell;
use std::ffi::{CStr, CString, c_char, c_int};
use std::panic::{AssertUnwindSafe, catch_unwind};

/// A real-time system in this process, opaque to C.
pub struct OpengpacSystem(api::System);

/// Refusal of this thread's last call, as text and as JSON.
struct LastRefusal {
    text: CString,
    json: CString,
}

thread_local! {
    static REFUSED: RefCell<LastRefusal> = RefCell::new(LastRefusal { text: CString::default(), json: CString::from(c"[]") });
}

/// Converts a string to a C string; the result ends at the first NUL.
fn text(of: &str) -> CString {
    let end = of.find('\0').unwrap_or(of.len());
    CString::new(&of[..end]).expect("what is before the first NUL has none")
}

fn remember(refusals: &api::Refusals) {
    let lines: Vec<String> = refusals.iter().map(|refusal| format!("{:?}: {refusal}", refusal.class)).collect();
    let json = api::to_json(refusals).unwrap_or_else(|_| "[]".to_owned());
    REFUSED.with_borrow_mut(|refused| *refused = LastRefusal { text: text(&lines.join("\n")), json: text(&json) });
}

/// Runs a call. A refusal is stored for this thread; a panic also becomes a refusal, because it must not unwind into C.
fn guarded<T>(call: impl FnOnce() -> Result<T, api::Refusals>) -> Option<T> {
    remember(&Vec::new());
    let refusals = match catch_unwind(AssertUnwindSafe(call)) {
        Ok(Ok(result)) => return Some(result),
        Ok(Err(refusals)) => refusals,
        Err(_) => vec![api::refusal("internal error in OpenGPAC; please report it, and include the call that caused it")],
    };
    remember(&refusals);
    None
}

/// Returns a string from C; NULL counts as an empty string.
///
/// # Safety
/// `given` is NULL, or is NUL-terminated and does not change during the call.
unsafe fn given<'a>(given: *const c_char, what: &str) -> Result<&'a str, api::Refusals> {
    if given.is_null() {
        return Ok("");
    }
    // SAFETY: guaranteed by the caller.
    unsafe { CStr::from_ptr(given) }.to_str().map_err(|_| vec![api::refusal(&format!("{what}: not UTF-8 text"))])
}

/// Opens a system; returns NULL if this is refused.
///
/// # Safety
/// Each string is NULL or NUL-terminated.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn opengpac_open(name: *const c_char, clock: *const c_char, options: *const c_char) -> *mut OpengpacSystem {
    let opened = guarded(|| {
        // SAFETY: guaranteed by the caller, for each.
        let (name, clock, options) = unsafe { (given(name, "the name")?, given(clock, "the clock")?, given(options, "the options")?) };
        api::open(name, clock, if options.trim().is_empty() { "{}" } else { options })
    });
    opened.map_or(std::ptr::null_mut(), |system| Box::into_raw(Box::new(OpengpacSystem(system))))
}

/// Makes a call; returns JSON text, to be freed with `opengpac_free`, or NULL if the call is refused.
///
/// # Safety
/// `system` came from `opengpac_open` and has not been closed, or is NULL; each string is NULL or NUL-terminated.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn opengpac_call(system: *mut OpengpacSystem, call: *const c_char, arguments: *const c_char) -> *mut c_char {
    let answer = guarded(|| {
        // SAFETY: the caller guarantees that it is alive, or NULL.
        let system = unsafe { system.as_ref() }.ok_or_else(|| vec![api::refusal("there is no system: opengpac_open() returned NULL, or was not called")])?;
        // SAFETY: guaranteed by the caller, for each.
        let (call, arguments) = unsafe { (given(call, "the name of the call")?, given(arguments, "the arguments")?) };
        api::call(&system.0, call, arguments)
    });
    answer.map_or(std::ptr::null_mut(), |json: Json| text(&json.to_string()).into_raw())
}

/// Returns the reason why the last call on this thread was refused, as text; valid until the next call.
#[unsafe(no_mangle)]
pub extern "C" fn opengpac_error() -> *const c_char {
    REFUSED.with_borrow(|refused| refused.text.as_ptr())
}

/// Returns the refusal of the last call on this thread as JSON.
#[unsafe(no_mangle)]
pub extern "C" fn opengpac_error_json() -> *const c_char {
    REFUSED.with_borrow(|refused| refused.json.as_ptr())
}

/// Returns a descriptor that becomes readable when an instance has ended; -1 if `system` is NULL.
///
/// # Safety
/// `system` came from `opengpac_open` and has not been closed, or is NULL.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn opengpac_ended_fd(system: *mut OpengpacSystem) -> c_int {
    // SAFETY: guaranteed by the caller.
    unsafe { system.as_ref() }.map_or(-1, |system| system.0.ended_fd())
}

/// Frees a string returned by `opengpac_call`.
///
/// # Safety
/// `text` came from `opengpac_call` and has not been freed, or is NULL.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn opengpac_free(text: *mut c_char) {
    if !text.is_null() {
        // SAFETY: it was created by `CString::into_raw` in `opengpac_call`.
        drop(unsafe { CString::from_raw(text) });
    }
}

/// Closes a system and frees it.
///
/// # Safety
/// `system` came from `opengpac_open` and has not been closed, or is NULL; no other thread is executing a call on it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn opengpac_close(system: *mut OpengpacSystem) {
    if !system.is_null() {
        // SAFETY: it was created by `Box::into_raw` in `opengpac_open`.
        let system = unsafe { Box::from_raw(system) };
        let _ = guarded(|| {
            system.0.close();
            drop(system);
            Ok(())
        });
    }
}
