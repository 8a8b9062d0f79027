// SPDX-License-Identifier: Apache-2.0
//! Registrations of a supervisor with its guard, kept so that they can be handed over to another guard.
use crate::guard_event::FoundWard;
use crate::messages::{Ask, HandleText, Loss, WardText};
use device::SafeHandle;
use process_kit::{Child, Heartbeat};
use std::collections::BTreeMap;
use std::io;
use std::os::fd::OwnedFd;

/// A request with its descriptors.
pub(crate) type Request = (Ask, Vec<OwnedFd>);

/// Registered processes, by number.
#[derive(Debug, Default)]
pub(crate) struct Registry {
    wards: BTreeMap<u64, Ward>,
}

/// A process and its devices.
#[derive(Debug)]
pub(crate) struct Ward {
    text: WardText,
    process: OwnedFd,
    heartbeat: Option<Heartbeat>,
    handles: Vec<(String, SafeHandle)>,
    loss: Option<Loss>,
}

impl Ward {
    pub fn new(text: WardText, process: OwnedFd, heartbeat: Option<Heartbeat>) -> Ward {
        Ward { text, process, heartbeat, handles: Vec::new(), loss: None }
    }

    fn copied(&self) -> io::Result<Ward> {
        let heartbeat = self.heartbeat.as_ref().map(|heart| heart.descriptor().and_then(Heartbeat::received)).transpose()?;
        let handle = |(device, handle): &(String, SafeHandle)| Ok((device.clone(), copied(handle)?));
        let handles = self.handles.iter().map(handle).collect::<io::Result<_>>()?;
        Ok(Ward { text: self.text.clone(), process: self.process.try_clone()?, heartbeat, handles, loss: None })
    }

    /// Takes out the safe handles.
    pub fn take_handles(&mut self) -> Vec<(String, SafeHandle)> {
        std::mem::take(&mut self.handles)
    }

    fn ask(&self) -> io::Result<Request> {
        let mut descriptors = vec![self.process.try_clone()?];
        if let Some(heartbeat) = &self.heartbeat {
            descriptors.push(heartbeat.descriptor()?);
        }
        Ok((Ask::Ward(self.text.clone()), descriptors))
    }
}

/// Returns a copy of the handle with a duplicate of its descriptor.
pub(crate) fn copied(handle: &SafeHandle) -> io::Result<SafeHandle> {
    Ok(SafeHandle { descriptor: handle.descriptor.try_clone()?, writes: handle.writes.clone(), latches: handle.latches })
}

fn ask_to_hold(ward: u64, device: &str, handle: &SafeHandle) -> io::Result<Request> {
    let text = HandleText { ward, device: device.to_owned(), writes: handle.writes.clone(), latches: handle.latches };
    Ok((Ask::Handle(text), vec![handle.descriptor.try_clone()?]))
}

fn no_descriptor(error: io::Error) -> String {
    format!("cannot create a descriptor for the guard: {error}")
}

impl Registry {
    pub fn is_empty(&self) -> bool {
        self.wards.values().all(|ward| ward.loss.is_some())
    }

    fn ward(&mut self, ward: u64) -> Result<&mut Ward, String> {
        self.wards.get_mut(&ward).ok_or_else(|| format!("no process {ward} is registered with the guard"))
    }

    /// Returns the name of a process.
    pub fn name(&self, ward: u64) -> Option<String> {
        self.wards.get(&ward).map(|ward| ward.text.name.clone())
    }

    pub fn add(&mut self, ward: Ward) -> Result<Request, String> {
        if let Some(other) = self.wards.get(&ward.text.ward) {
            return Err(format!("process '{}' is already registered with the guard as {}", other.text.name, ward.text.ward));
        }
        let ask = ward.ask().map_err(no_descriptor)?;
        self.wards.insert(ward.text.ward, ward);
        Ok(ask)
    }

    pub fn hold(&mut self, ward: u64, device: &str, handle: SafeHandle) -> Result<Request, String> {
        let holds = self.ward(ward)?;
        let ask = ask_to_hold(ward, device, &handle).map_err(no_descriptor)?;
        holds.handles.push((device.to_owned(), handle));
        Ok(ask)
    }

    pub fn release(&mut self, ward: u64, device: &str) -> Result<Request, String> {
        self.ward(ward)?.handles.retain(|(name, _)| name != device);
        Ok((Ask::Release { ward, device: device.to_owned() }, Vec::new()))
    }

    pub fn forget(&mut self, ward: u64) -> Result<Request, String> {
        self.wards.remove(&ward);
        Ok((Ask::Forget { ward }, Vec::new()))
    }

    /// Records a loss; returns false if it was already known, or the process has been forgotten.
    pub fn lose(&mut self, loss: &Loss) -> bool {
        match self.wards.get_mut(&loss.ward) {
            Some(ward) if ward.loss.is_none() => {
                ward.loss = Some(loss.clone());
                true
            }
            _ => false,
        }
    }

    /// Calls `say` for all registrations except those of lost processes, which have been handled.
    pub fn everything<E>(&self, mut say: impl FnMut(Ask, &[OwnedFd]) -> Result<(), E>) -> Result<(), E> {
        for (number, ward) in self.wards.iter().filter(|(_, ward)| ward.loss.is_none()) {
            let handles = ward.handles.iter().map(|(device, handle)| ask_to_hold(*number, device, handle));
            // If no descriptor is left, it is not registered; the guard has refused nothing, and the other registrations are better than
            // none.
            for (ask, descriptors) in std::iter::once(ward.ask()).chain(handles).flatten() {
                say(ask, &descriptors)?;
            }
        }
        Ok(())
    }

    /// Returns copies of the processes that another registry does not have, or has with fewer safe handles (then the third value is
    /// true).
    ///
    /// # Errors
    /// Fails if no descriptors are left.
    pub fn unknown_to(&self, there: &Registry) -> io::Result<Vec<(u64, Ward, bool)>> {
        let known = |number: &u64| there.wards.get(number).map(|ward| ward.handles.len());
        let lacks = self.wards.iter().filter(|(number, ward)| ward.loss.is_none() && known(number).is_none_or(|handles| handles < ward.handles.len()));
        lacks.map(|(number, ward)| Ok((*number, ward.copied()?, known(number).is_some()))).collect()
    }

    /// Adds a process reported by a guard that is being adopted. Returns `None` if the message is invalid.
    pub fn told_ward(&mut self, text: WardText, descriptors: Vec<OwnedFd>) -> Option<()> {
        let mut descriptors = descriptors.into_iter();
        let process = descriptors.next()?;
        let heartbeat = match text.bounds {
            Some(_) => Some(Heartbeat::received(descriptors.next()?).ok()?),
            None => None,
        };
        self.wards.insert(text.ward, Ward::new(text, process, heartbeat));
        Some(())
    }

    /// Adds a safe handle reported by a guard that is being adopted. Returns `None` if the message is invalid.
    pub fn told_handle(&mut self, text: HandleText, descriptors: Vec<OwnedFd>) -> Option<()> {
        let descriptor = descriptors.into_iter().next()?;
        self.wards.get_mut(&text.ward)?.handles.push((text.device, SafeHandle { descriptor, writes: text.writes, latches: text.latches }));
        Some(())
    }

    /// Returns each process, for the supervisor that adopts it.
    pub fn found(&self) -> io::Result<Vec<FoundWard>> {
        let found = |ward: &Ward| {
            let mut devices: Vec<String> = ward.handles.iter().map(|(device, _)| device.clone()).collect();
            devices.dedup();
            let process = Child::adopt(ward.process.try_clone()?)?;
            Ok(FoundWard { ward: ward.text.ward, name: ward.text.name.clone(), process, devices, loss: ward.loss.clone() })
        };
        self.wards.values().map(found).collect()
    }
}
