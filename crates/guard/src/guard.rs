// SPDX-License-Identifier: Apache-2.0
//! The supervisor's side of the guard: two guard processes, which have the same registrations and act alike. While one of them is dead,
//! has stalled or is being replaced, the other one guards, even if the supervisor disappears in the meantime.
use crate::canary;
use crate::guard_event::{FoundWard, GuardCommand, GuardError, GuardEvent};
use crate::member::{Member, Tells};
use crate::messages::WardText;
use crate::registry::{Registry, Request, Ward, copied};
use crate::reports::Reports;
use crate::watch::Bounds;
use device::SafeHandle;
use process_kit::Heartbeat;
use std::io;
use std::os::fd::OwnedFd;
use std::sync::Arc;

/// The guard of one supervisor.
///
/// Calls wait for the answers of both processes, which takes some tens of microseconds. They must not be made by a real-time thread, nor
/// by the function that receives events; that function must not drop the guard either. When the guard is dropped, both processes continue
/// with their remaining registrations, and exit if there are none.
pub struct Guard {
    members: [Member; 2],
    reports: Arc<Reports>,
}

/// True for each member whose watcher writes in addition to the guards. One is enough: a second watcher would add nothing.
const WATCHES: [bool; 2] = [true, false];

fn no_descriptor(error: &io::Error) -> GuardError {
    GuardError(format!("cannot create a descriptor for the guard: {error}"))
}

/// Returns the commands that start the two processes, each with its own path.
fn commands(command: GuardCommand) -> [GuardCommand; 2] {
    let second = command.path.as_ref().map(|path| {
        let mut path = path.clone().into_os_string();
        path.push("2");
        path.into()
    });
    let second = GuardCommand { command: command.command.clone(), path: second };
    [command, second]
}

impl Guard {
    /// Starts the guard processes. `tell` is called from threads of this value.
    ///
    /// # Errors
    /// [`GuardError`] if they cannot be started, or exited immediately.
    pub fn start(command: GuardCommand, tell: impl Fn(GuardEvent) + Send + Sync + 'static) -> Result<Guard, GuardError> {
        let reports = Arc::new(Reports::new(Box::new(tell)));
        let [first, second] = commands(command);
        let first = Member::start(first, WATCHES[0], says(&reports))?;
        let second = Member::start(second, WATCHES[1], says(&reports))?;
        Ok(Guard { members: [first, second], reports })
    }

    /// Takes over the guard that listens at the path of `command`, with everything that it guards, from a supervisor that has exited. If
    /// one of the two processes has exited as well, another one is started with the registrations of the survivor.
    ///
    /// # Errors
    /// [`GuardError`] if no guard listens there, or the process that answers is not a guard.
    pub fn adopt(command: GuardCommand, tell: impl Fn(GuardEvent) + Send + Sync + 'static) -> Result<(Guard, Vec<FoundWard>), GuardError> {
        let reports = Arc::new(Reports::new(Box::new(tell)));
        let [first, second] = commands(command);
        let adopt = |command: &GuardCommand, watches| Member::adopt(command.clone(), watches, says(&reports));
        let members = match (adopt(&first, WATCHES[0]), adopt(&second, WATCHES[1])) {
            (Ok(first), Ok(second)) => [first, second],
            (Ok(first), Err(_)) => [first, Member::start(second, WATCHES[1], says(&reports))?],
            (Err(_), Ok(second)) => [Member::start(first, WATCHES[0], says(&reports))?, second],
            (Err(why), Err(_)) => return Err(why),
        };
        let [first, second] = &members;
        tell_unknown(first, second)?;
        tell_unknown(second, first)?;
        let found = first.registered(Registry::found).map_err(|error| no_descriptor(&error))?;
        Ok((Guard { members, reports }, found))
    }

    /// Starts guarding a process under a number chosen by the caller. If `heartbeat` is passed, the process also counts as lost if its
    /// heart, after its first beat, stalls for longer than its bounds allow. The supervisor watches the process in addition to the guard.
    ///
    /// # Errors
    /// [`GuardError`] if the number is in use, or the guard has exited.
    pub fn watch(&self, ward: u64, name: &str, process: OwnedFd, heartbeat: Option<(Heartbeat, Bounds)>) -> Result<(), GuardError> {
        self.add(ward, name, process, heartbeat, false)
    }

    /// Guards this process itself, as [`Guard::watch`] guards another one. Only the guard watches it. If the process merely stalls (for
    /// example, because it is stopped in a debugger), its outputs are made safe; the process is not killed, provided that the outputs
    /// latch.
    ///
    /// # Errors
    /// Same as for [`Guard::watch`].
    pub fn watch_this(&self, ward: u64, name: &str, heartbeat: Heartbeat, bounds: Bounds) -> Result<(), GuardError> {
        canary::share(&self.members[0].hearts().supervisor, &heartbeat);
        let process = process_kit::this_process().map_err(|error| GuardError(format!("cannot create a descriptor of this process: {error}")))?;
        self.add(ward, name, process, Some((heartbeat, bounds)), true)
    }

    fn add(&self, ward: u64, name: &str, process: OwnedFd, heartbeat: Option<(Heartbeat, Bounds)>, is_spared: bool) -> Result<(), GuardError> {
        let text = WardText { ward, name: name.to_owned(), bounds: heartbeat.as_ref().map(|(_, bounds)| *bounds), is_spared };
        self.reports.begin(ward);
        self.request(|registry| {
            let copy = |heart: &Heartbeat| heart.descriptor().and_then(Heartbeat::received);
            let process = process.try_clone().map_err(|error| no_descriptor(&error).0)?;
            let heartbeat = heartbeat.as_ref().map(|(heart, _)| copy(heart)).transpose().map_err(|error| no_descriptor(&error).0)?;
            registry.add(Ward::new(text.clone(), process, heartbeat))
        })
    }

    /// Returns descriptors of the heartbeats of the guard and of this supervisor, for a process that checks whether it is watched.
    ///
    /// # Errors
    /// Fails if no descriptors are left.
    pub fn hearts(&self) -> io::Result<[OwnedFd; 2]> {
        self.members[0].hearts().descriptors()
    }

    /// Registers the safe handles of a device of the process `ward`, replacing the device's earlier ones.
    ///
    /// # Errors
    /// [`GuardError`] if there is no such process, or the guard has exited.
    pub fn hold(&self, ward: u64, device: &str, handles: Vec<SafeHandle>) -> Result<(), GuardError> {
        self.release(ward, device)?;
        handles.iter().try_for_each(|handle| {
            self.request(|registry| {
                let handle = copied(handle).map_err(|error| no_descriptor(&error).0)?;
                registry.hold(ward, device, handle)
            })
        })
    }

    /// Unregisters a device that was closed in an orderly way: nothing is written for it.
    ///
    /// # Errors
    /// Same as for [`Guard::hold`].
    pub fn release(&self, ward: u64, device: &str) -> Result<(), GuardError> {
        self.request(|registry| registry.release(ward, device))
    }

    /// Unregisters a process that is about to exit in an orderly way, or whose loss has been handled.
    ///
    /// # Errors
    /// [`GuardError`] if the guard has exited.
    pub fn forget(&self, ward: u64) -> Result<(), GuardError> {
        self.request(|registry| registry.forget(ward))
    }

    /// Returns the process IDs of the two guard processes, if this supervisor started them.
    pub fn pids(&self) -> [Option<i32>; 2] {
        self.members.each_ref().map(Member::pid)
    }

    /// Returns the process IDs of the guards that stand in for a guard that is stopped, or has exited and has not been replaced yet. They
    /// have received all registrations.
    pub fn stand_ins(&self) -> [Option<i32>; 2] {
        self.members.each_ref().map(Member::stand_in)
    }

    /// Sends a request to both processes. Succeeds if one has carried it out; the other one has then exited permanently, or receives the
    /// request when it is restarted.
    fn request(&self, change: impl Fn(&mut Registry) -> Result<Request, String>) -> Result<(), GuardError> {
        let [first, second] = &self.members;
        match (first.request(&change), second.request(&change)) {
            (Ok(()), _) | (_, Ok(())) => Ok(()),
            (Err(_), Err(why)) if first.is_gone() => Err(why),
            (Err(why), Err(_)) => Err(why),
        }
    }
}

fn says(reports: &Arc<Reports>) -> Tells {
    let reports = reports.clone();
    Box::new(move |event| reports.hear(event))
}

/// Sends one guard the registrations that only the other one has, because the supervisor may have exited between the two requests.
fn tell_unknown(from: &Member, to: &Member) -> Result<(), GuardError> {
    let unknown = from.registered(|from| to.registered(|to| from.unknown_to(to))).map_err(|error| no_descriptor(&error))?;
    for (ward, mut process, is_known) in unknown {
        if is_known {
            to.request(|registry| registry.forget(ward))?;
        }
        let handles = process.take_handles();
        to.request(|registry| registry.add(process))?;
        for (device, handle) in handles {
            to.request(|registry| registry.hold(ward, &device, handle))?;
        }
    }
    Ok(())
}
