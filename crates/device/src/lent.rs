// SPDX-License-Identifier: Apache-2.0
//! Interpreter and functions that a program provides to the drivers that it opens.
use std::ffi::OsString;
use std::sync::OnceLock;

static INTERPRETER: OnceLock<OsString> = OnceLock::new();

/// Sets the Python interpreter that a driver may start to try something in a separate process. Only the first call has an effect.
pub fn lend_interpreter(interpreter: impl Into<OsString>) {
    INTERPRETER.get_or_init(|| interpreter.into());
}

/// Returns the interpreter set by [`lend_interpreter`]; `python3` if none was set.
pub fn interpreter() -> OsString {
    INTERPRETER.get().cloned().unwrap_or_else(|| "python3".into())
}
