// SPDX-License-Identifier: Apache-2.0
//! Calls that pause and resume a program.
use crate::core::Core;
use crate::instances::instance::State;
use crate::pausing::program::{pause_program, resume_program};
use crate::precedence::first;
use crate::system::{System, WaitResult};
use model::refusal::Refusals;
use std::time::Duration;

impl System {
    /// Pauses the program, or the actions on these devices; returns the numbers and names of the instances that this suspends. Wait for
    /// completion with [`System::paused`].
    pub fn pause(&self, devices: Option<&[String]>) -> Result<Vec<(u64, String)>, Refusals> {
        let pause = |core: &mut Core| {
            let stopped = pause_program(core, devices)?;
            Ok(named(core, stopped))
        };
        first(|| self.shared.command(pause))
    }

    /// Waits at most `slice` of real time until none of these instances is running.
    pub fn paused(&self, instances: &[u64], slice: Duration) -> Result<WaitResult<()>, Refusals> {
        self.shared.wait_for(None, slice, |core| {
            let runs = |id: &u64| core.instances.get(id).is_some_and(|i| i.state() == State::Running);
            Ok((!instances.iter().any(runs)).then_some(()))
        })
    }

    /// Ends a pause; returns the numbers and names of the instances that resume.
    pub fn resume_program(&self, devices: Option<&[String]>) -> Result<Vec<(u64, String)>, Refusals> {
        self.shared.command(|core| {
            let going = resume_program(core, devices)?;
            Ok(named(core, going))
        })
    }
}

/// Returns the instances with their names.
fn named(core: &Core, ids: Vec<u64>) -> Vec<(u64, String)> {
    ids.into_iter().filter_map(|id| Some((id, core.instances.get(&id)?.name.clone()))).collect()
}
