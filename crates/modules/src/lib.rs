// SPDX-License-Identifier: Apache-2.0
//! Code modules: building them from C or C++, and loading them without risk to the process.
//!
//! `load` never trusts a file. It reads the header of the shared object itself, lets a sacrificial child process load a private
//! copy and walk its tables, and only then loads that same copy here. A module is never unloaded, so descriptors are `'static`.

mod build;
mod diagnosis;
#[doc(hidden)]
pub mod elf;
mod folder;
mod load;
mod probe;
mod seal;

pub use build::{BuildError, BuildOptions, build, compiler, write_header};
pub use load::{LoadError, LoadOptions, LoadedModule, load, load_bytes};
pub use probe::{PYTHON_PROBE, Probe};
