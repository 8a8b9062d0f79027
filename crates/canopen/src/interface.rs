// SPDX-License-Identifier: Apache-2.0
//! Interface to a bus. `can0` is a SocketCAN interface, `local:NAME` a local socket on which an emulated bus answers, `emulated:NAME` an
//! emulated bus of this process, and `emulated` a private one.
use crate::emulator::{Bus, NodeOptions, SharedBus, Within, published};
use crate::link::{Link, Socket};
use std::fmt;
use std::io;
use std::sync::Arc;

const EMULATED: &str = "emulated";

/// Interface to a bus.
#[derive(Clone)]
pub enum Interface {
    Named(String),
    Own(Arc<SharedBus>),
}

impl Interface {
    /// Returns the interface with this name. A private emulated bus has these nodes.
    pub fn of(interface: &str, nodes: impl FnOnce() -> Vec<NodeOptions>) -> Interface {
        if interface == EMULATED { Interface::Own(SharedBus::new(Bus::new(&nodes()))) } else { Interface::Named(interface.to_owned()) }
    }

    /// Opens an endpoint that receives these identifiers, each with a mask. Bus reports are always received.
    ///
    /// # Errors
    /// Fails if the interface does not exist, or no bus answers on it.
    pub fn open(&self, heard: &[(u16, u16)]) -> io::Result<Box<dyn Link>> {
        match self {
            Interface::Own(bus) => Ok(Box::new(Within::new(bus.clone(), heard))),
            Interface::Named(name) if name.starts_with("emulated:") => {
                let bus = published(name).ok_or_else(|| io::Error::new(io::ErrorKind::NotFound, "there is no such emulated bus in this process"))?;
                Ok(Box::new(Within::new(bus, heard)))
            }
            Interface::Named(name) => Ok(Box::new(Socket::open(name, heard)?)),
        }
    }
}

impl fmt::Display for Interface {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Interface::Named(name) => f.write_str(name),
            Interface::Own(_) => f.write_str(EMULATED),
        }
    }
}
