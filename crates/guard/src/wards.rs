// SPDX-License-Identifier: Apache-2.0
//! Processes that are watched: the guard, and the supervisor's watcher beside it, hold the same and judge alike.
use crate::messages::Ask;
use crate::ward::{Ward, WardReport};
use process_kit::{Heartbeat, now_ns};
use std::collections::VecDeque;
use std::os::fd::{BorrowedFd, OwnedFd};

/// Processes that are watched.
#[derive(Default)]
pub(crate) struct Wards(Vec<Ward>);

impl Wards {
    pub fn iter(&self) -> impl Iterator<Item = &Ward> {
        self.0.iter()
    }

    /// Returns whether any of them has to be waited for.
    pub fn has_reason(&self) -> bool {
        self.0.iter().any(|ward| !ward.is_settled())
    }

    /// Returns the descriptors to wait for: the end of each.
    pub fn waits(&self) -> impl Iterator<Item = BorrowedFd<'_>> {
        self.0.iter().flat_map(Ward::waits_for)
    }

    /// Returns when to look again though nothing comes; none: never.
    pub fn interval_ns(&self) -> Option<i64> {
        self.0.iter().filter_map(Ward::interval_ns).min()
    }

    /// Looks at every one; what is lost is safe before anybody is told.
    /// `leads`: not beside a guard that serves.
    pub fn look(&mut self, leads: bool, now_ns: i64) -> Vec<WardReport> {
        self.0.iter_mut().filter_map(|ward| ward.look(leads, now_ns)).collect()
    }

    /// Changes what is watched. Errors: what is wrong with what was asked, in words.
    pub fn act(&mut self, ask: Ask, descriptors: Vec<OwnedFd>) -> Result<(), String> {
        let mut descriptors = VecDeque::from(descriptors);
        let mut next = |what: &str| descriptors.pop_front().ok_or_else(|| format!("{what} did not come along"));
        match ask {
            Ask::Ward(text) => {
                let process = next("the process")?;
                let heartbeat = text.bounds.map(|_| next("the heartbeat")).transpose()?;
                if self.0.iter().any(|ward| ward.text.ward == text.ward) {
                    return Err(format!("process {} is guarded already", text.ward));
                }
                let heartbeat = heartbeat.map(Heartbeat::received).transpose().map_err(|error| error.to_string())?;
                self.0.push(Ward::new(text, process, heartbeat, now_ns()));
            }
            Ask::Handle(text) => {
                let descriptor = next("the descriptor of the handle")?;
                self.ward(text.ward)?.add(text, descriptor);
            }
            Ask::Release { ward, device } => self.ward(ward)?.release(&device),
            Ask::Forget { ward } => self.0.retain(|one| one.text.ward != ward),
            Ask::Lead | Ask::Adopt => {}
        }
        Ok(())
    }

    fn ward(&mut self, ward: u64) -> Result<&mut Ward, String> {
        self.0.iter_mut().find(|one| one.text.ward == ward).ok_or_else(|| format!("no process {ward} is guarded"))
    }
}
