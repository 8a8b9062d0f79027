// SPDX-License-Identifier: Apache-2.0
//! Recordings: how they are written, into which files, and how they are read.
mod archive;
mod common;
mod files;
mod recording;
