// SPDX-License-Identifier: Apache-2.0
//! Watched processes. The guard and the supervisor's watcher watch the same processes and apply the same rules.
use crate::messages::Ask;
use crate::ward::{Ward, WardReport};
use process_kit::{Heartbeat, now_ns};
use std::collections::VecDeque;
use std::os::fd::{BorrowedFd, OwnedFd};

/// Watched processes.
#[derive(Default)]
pub(crate) struct Wards(Vec<Ward>);

impl Wards {
    pub fn iter(&self) -> impl Iterator<Item = &Ward> {
        self.0.iter()
    }

    /// Returns true if there is still a process to wait for.
    pub fn has_reason(&self) -> bool {
        self.0.iter().any(|ward| !ward.is_settled())
    }

    /// Returns the descriptors to wait on, which signal the exits of the processes.
    pub fn waits(&self) -> impl Iterator<Item = BorrowedFd<'_>> {
        self.0.iter().flat_map(Ward::waits_for)
    }

    /// Returns the time until the next check if no event occurs; `None` if no check is needed.
    pub fn interval_ns(&self) -> Option<i64> {
        self.0.iter().filter_map(Ward::interval_ns).min()
    }

    /// Checks every process; the outputs of a lost process are made safe before any supervisor is notified. `leads`: false for a watcher
    /// that runs alongside a serving guard.
    pub fn look(&mut self, leads: bool, now_ns: i64) -> Vec<WardReport> {
        self.0.iter_mut().filter_map(|ward| ward.look(leads, now_ns)).collect()
    }

    /// Changes the set of watched processes. Fails with a message if the request is invalid.
    pub fn act(&mut self, ask: Ask, descriptors: Vec<OwnedFd>) -> Result<(), String> {
        let mut descriptors = VecDeque::from(descriptors);
        let mut next = |what: &str| descriptors.pop_front().ok_or_else(|| format!("{what} was not sent with the request"));
        match ask {
            Ask::Ward(text) => {
                let process = next("the process")?;
                let heartbeat = text.bounds.map(|_| next("the heartbeat")).transpose()?;
                if self.0.iter().any(|ward| ward.text.ward == text.ward) {
                    return Err(format!("process {} is already guarded", text.ward));
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
