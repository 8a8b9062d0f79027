// SPDX-License-Identifier: Apache-2.0
//! Replacement of [`joined`](self) in builds without links between hosts: its error messages state how to get a build with them.
use crate::telling::Telling;
use rtp::{NO_HOSTS, StartedProcessor};
use serde::Deserialize;
use std::ffi::OsString;

/// Options with which a host would listen or join.
#[derive(Clone, Debug, Deserialize)]
pub struct JoinOptions {}

/// Joined hosts, which never exist in this build.
pub(crate) struct JoinedHosts;

impl JoinedHosts {
    pub fn new(_telling: Telling) -> JoinedHosts {
        JoinedHosts
    }

    pub fn listen(&self, _system: &str, _options: &str, _epoch_ns: i64) -> Result<(), String> {
        Err(NO_HOSTS.to_owned())
    }

    pub fn close(&self) {}

    pub fn start(&self, system: &str, host: &str, processor: &str) -> Result<StartedProcessor, String> {
        Err(format!("host '{host}' has not joined system '{system}' for processor '{processor}': {NO_HOSTS}"))
    }
}

/// Fails, because this build cannot lend its host.
///
/// # Errors
/// Always fails, with the remedy.
pub fn join(_system: &str, _options: JoinOptions, _python: OsString, _stop: &dyn Fn() -> bool) -> Result<(), String> {
    Err(NO_HOSTS.to_owned())
}
