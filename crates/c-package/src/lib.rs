// SPDX-License-Identifier: Apache-2.0
//! The C package: the programming system's side of OpenGPAC for C programs. `include/opengpac_ps.h` is its manual.
//!
//! It converts texts and catches panics; every call is [`api::call`].
use serde_json::Value as Json;
use std::cell::RefCell;
use std::ffi::{CStr, CString, c_char, c_int};
use std::panic::{AssertUnwindSafe, catch_unwind};

/// A real-time system in this process, opaque to C.
pub struct OpengpacSystem(api::System);

/// Refusal of the last call of this thread: as text, and as JSON.
struct LastRefusal {
    text: CString,
    json: CString,
}

thread_local! {
    static REFUSED: RefCell<LastRefusal> = RefCell::new(LastRefusal { text: CString::default(), json: CString::from(c"[]") });
}

/// Text for C. A NUL within cannot be said there and becomes the end.
fn text(of: &str) -> CString {
    let end = of.find('\0').unwrap_or(of.len());
    CString::new(&of[..end]).expect("what is before the first NUL has none")
}

fn remember(refusals: &api::Refusals) {
    let lines: Vec<String> = refusals.iter().map(|refusal| format!("{:?}: {refusal}", refusal.class)).collect();
    let json = api::to_json(refusals).unwrap_or_else(|_| "[]".to_owned());
    REFUSED.with_borrow_mut(|refused| *refused = LastRefusal { text: text(&lines.join("\n")), json: text(&json) });
}

/// Runs a call: what it refuses is remembered for this thread, and a panic is a refusal too, because none may cross into C.
fn guarded<T>(call: impl FnOnce() -> Result<T, api::Refusals>) -> Option<T> {
    remember(&Vec::new());
    let refusals = match catch_unwind(AssertUnwindSafe(call)) {
        Ok(Ok(result)) => return Some(result),
        Ok(Err(refusals)) => refusals,
        Err(_) => vec![api::refusal("the call failed inside OpenGPAC; please report it with what was called")],
    };
    remember(&refusals);
    None
}

/// The text that C gave; nothing counts as empty.
///
/// # Safety
/// `given` is NULL, or ends in NUL and stays as it is during the call.
unsafe fn given<'a>(given: *const c_char, what: &str) -> Result<&'a str, api::Refusals> {
    if given.is_null() {
        return Ok("");
    }
    // SAFETY: the caller's promise.
    unsafe { CStr::from_ptr(given) }.to_str().map_err(|_| vec![api::refusal(&format!("{what}: not UTF-8 text"))])
}

/// Opens a system; NULL where it is refused.
///
/// # Safety
/// Each text is NULL or ends in NUL.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn opengpac_open(name: *const c_char, clock: *const c_char, options: *const c_char) -> *mut OpengpacSystem {
    let opened = guarded(|| {
        // SAFETY: the caller's promise, for each.
        let (name, clock, options) = unsafe { (given(name, "the name")?, given(clock, "the clock")?, given(options, "the options")?) };
        api::open(name, clock, if options.trim().is_empty() { "{}" } else { options })
    });
    opened.map_or(std::ptr::null_mut(), |system| Box::into_raw(Box::new(OpengpacSystem(system))))
}

/// Makes a call; its result is JSON text that `opengpac_free` takes, NULL where it is refused.
///
/// # Safety
/// `system` came from `opengpac_open` and is not closed, or is NULL; each text is NULL or ends in NUL.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn opengpac_call(system: *mut OpengpacSystem, call: *const c_char, arguments: *const c_char) -> *mut c_char {
    let answer = guarded(|| {
        // SAFETY: the caller's promise: it is alive, or NULL.
        let system = unsafe { system.as_ref() }.ok_or_else(|| vec![api::refusal("there is no system: opengpac_open() gave NULL, or it was not called")])?;
        // SAFETY: the caller's promise, for each.
        let (call, arguments) = unsafe { (given(call, "the name of the call")?, given(arguments, "the arguments")?) };
        api::call(&system.0, call, arguments)
    });
    answer.map_or(std::ptr::null_mut(), |json: Json| text(&json.to_string()).into_raw())
}

/// Returns why the last call of this thread was refused, as text; valid until the next one.
#[unsafe(no_mangle)]
pub extern "C" fn opengpac_error() -> *const c_char {
    REFUSED.with_borrow(|refused| refused.text.as_ptr())
}

/// The same as JSON.
#[unsafe(no_mangle)]
pub extern "C" fn opengpac_error_json() -> *const c_char {
    REFUSED.with_borrow(|refused| refused.json.as_ptr())
}

/// A descriptor that becomes readable when an instance has ended; -1 for NULL.
///
/// # Safety
/// `system` came from `opengpac_open` and is not closed, or is NULL.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn opengpac_ended_fd(system: *mut OpengpacSystem) -> c_int {
    // SAFETY: the caller's promise.
    unsafe { system.as_ref() }.map_or(-1, |system| system.0.ended_fd())
}

/// Gives back a text of `opengpac_call`.
///
/// # Safety
/// `text` came from `opengpac_call` and was not given back yet, or is NULL.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn opengpac_free(text: *mut c_char) {
    if !text.is_null() {
        // SAFETY: it was made by `CString::into_raw` in `opengpac_call`.
        drop(unsafe { CString::from_raw(text) });
    }
}

/// Closes a system and frees it.
///
/// # Safety
/// `system` came from `opengpac_open` and was not closed yet, or is NULL; nobody else is in a call on it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn opengpac_close(system: *mut OpengpacSystem) {
    if !system.is_null() {
        // SAFETY: it was made by `Box::into_raw` in `opengpac_open`.
        let system = unsafe { Box::from_raw(system) };
        let _ = guarded(|| {
            system.0.close();
            drop(system);
            Ok(())
        });
    }
}
