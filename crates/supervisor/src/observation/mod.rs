// SPDX-License-Identifier: Apache-2.0
//! Looking at a running system. Nothing here disturbs what runs.
pub(crate) mod about;
pub(crate) mod commanded;
pub(crate) mod companions;
pub(crate) mod drawn;
pub(crate) mod ends;
pub(crate) mod inbox;
pub(crate) mod kept;
pub(crate) mod log;
pub(crate) mod record;
pub(crate) mod rings;
pub(crate) mod samples;
pub(crate) mod stamp;
pub(crate) mod state;
pub(crate) mod states;
pub(crate) mod taps;
pub(crate) mod workspaces;
