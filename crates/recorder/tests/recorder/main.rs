// SPDX-License-Identifier: Apache-2.0
//! Recordings: writing, splitting into files, and reading.
mod archive;
mod common;
mod files;
mod recording;
