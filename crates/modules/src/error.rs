// SPDX-License-Identifier: Apache-2.0
//! Reasons why a file provides no blocks.
use crate::source::build::BuildError;
use std::path::PathBuf;

/// Reason why a module was refused. No trace of the module remains in the process.
#[derive(Debug, thiserror::Error)]
pub enum LoadError {
    #[error("there is no file '{}'", path.display())]
    NotFound { path: PathBuf },
    #[error("'{}' cannot be read: {what}", path.display())]
    Unreadable { path: PathBuf, what: String },
    #[error("module '{}' is damaged: {what}; build it again", path.display())]
    Damaged { path: PathBuf, what: String },
    #[error("module '{}' is for {have}, but this system is {want}: build it for this system", path.display())]
    ForeignTarget { path: PathBuf, have: String, want: String },
    #[error("'{}' is a shared object but not a code module: it has no function opengpac_module; include opengpac.h and declare a FUNCTION_BLOCK, or use opengpac::module! in Rust", path.display())]
    NotAModule { path: PathBuf },
    #[error("module '{}' has ABI version {module}, but this system has {here}: build it again with this system's opengpac.h", path.display())]
    AbiVersion { path: PathBuf, module: u32, here: u32 },
    #[error("module '{}' has no function block: declare one with FUNCTION_BLOCK", path.display())]
    NoBlocks { path: PathBuf },
    #[error("module '{}' is refused: {}{what}", path.display(), subject(block, item))]
    Invalid { path: PathBuf, block: String, item: String, what: String },
    #[error("module '{}' crashed the process that tried to load it (signal {signal}): it is damaged, or its initialisation faults; build it again", path.display())]
    Crashed { path: PathBuf, signal: i32 },
    #[error("module '{}' did not load within {seconds} s: its initialisation does not end, or the machine is overloaded", path.display())]
    TimedOut { path: PathBuf, seconds: u64 },
    #[error("cannot start a process in which to try loading modules: {what}")]
    NoProbe { what: String },
    #[error("{first_error}, at {}:{line}", file.display())]
    BuildFailed { first_error: String, file: PathBuf, line: u32 },
    #[error(transparent)]
    CannotBuild(BuildError),
    #[error("'{}' is not a file that can contain blocks: give {known}", path.display())]
    Unknown { path: PathBuf, known: String },
    #[error("policy '{}' is refused: {what}", path.display())]
    Network { path: PathBuf, what: String },
    /// Error message from a backend of another crate.
    #[error("{0}")]
    Failed(String),
}

fn subject(block: &str, item: &str) -> String {
    match (block, item) {
        ("", "") => String::new(),
        (block, "") => format!("block '{block}': "),
        ("", item) => format!("type '{item}': "),
        (block, item) => format!("item '{block}.{item}': "),
    }
}
