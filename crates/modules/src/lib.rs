// SPDX-License-Identifier: Apache-2.0
//! Code modules: conversion of files into function blocks, without risk to the process.
//!
//! Each kind of file is a folder with a [`Backend`]: `native` (shared objects made of C, C++ or Rust), `source` (C and C++ sources, which
//! are built first). A backend of another crate calls [`register`]; [`load`] finds the right one for a file.
mod backend;
mod error;
mod folder;
mod native;
mod onnx;
mod registry;
mod source;

pub use backend::{Backend, Description, LoadOptions, LoadedModule};
pub use error::LoadError;
#[doc(hidden)]
pub use native::elf;
pub use native::{PYTHON_PROBE, Probe};
pub use onnx::whole as whole_network;
pub use registry::{backends, load, load_bytes, register, source_endings};
pub use source::fused;
pub use source::{BuildError, BuildOptions, build, compiler, is_word_of_c, write_header};
