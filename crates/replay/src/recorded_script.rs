// SPDX-License-Identifier: Apache-2.0
//! Code for recorded scripts, and devices and connections that reproduce the recorded values.
use device::Channel;
use interconnect::{Receiver, Sender};
use kernel::{Device, Way};
use opengpac::abi::Descriptor;
use runtime::encoding::{CodeName, Ground};
use runtime::{Host, remote_device};
use std::any::Any;
use std::collections::HashMap;
use std::sync::Arc;

type Keeper = Arc<dyn Any + Send + Sync>;

/// Source of the code of blocks.
pub trait Codes {
    /// Loads a module of the record.
    ///
    /// # Errors
    /// Fails with a message if the module cannot be loaded.
    fn load(&mut self, key: &str, name: &str, bytes: &[u8]) -> Result<(), String>;

    /// Returns the code of a block.
    fn find(&self, name: &CodeName) -> Option<(&'static Descriptor, Keeper)>;
}

impl Codes for rtp::Code {
    fn load(&mut self, key: &str, name: &str, bytes: &[u8]) -> Result<(), String> {
        rtp::Code::load(self, key, name, bytes)
    }

    fn find(&self, name: &CodeName) -> Option<(&'static Descriptor, Keeper)> {
        rtp::Code::find(self, name)
    }
}

pub(crate) struct RecordedScript {
    pub codes: Box<dyn Codes>,
    pub devices: HashMap<String, Vec<Channel>>,
    pub host: Arc<Host>,
}

impl Ground for RecordedScript {
    fn code(&self, name: &CodeName) -> Option<(&'static Descriptor, Keeper)> {
        self.codes.find(name)
    }

    fn device(&self, name: &str) -> Option<Arc<Device>> {
        remote_device::recorded(name, self.devices.get(name)?.clone()).ok()
    }

    fn sender(&mut self, way: &Way) -> Box<dyn Sender> {
        self.host.played_sender(way)
    }

    fn receiver(&mut self, way: &Way) -> Box<dyn Receiver> {
        self.host.played(way)
    }
}

/// Code of the record, in which some modules may be replaced.
pub struct ExchangedCode {
    code: rtp::Code,
    others: HashMap<String, Vec<u8>>,
}

impl ExchangedCode {
    /// Wraps the code of the record.
    pub fn new(code: rtp::Code) -> ExchangedCode {
        ExchangedCode { code, others: HashMap::new() }
    }

    /// Replaces the record's module `name` with the shared object `bytes`.
    pub fn exchange(&mut self, name: &str, bytes: Vec<u8>) {
        self.others.insert(name.to_owned(), bytes);
    }
}

impl Codes for ExchangedCode {
    fn load(&mut self, key: &str, name: &str, bytes: &[u8]) -> Result<(), String> {
        match self.others.get(name) {
            Some(other) => self.code.replace(key, name, other),
            None => self.code.load(key, name, bytes),
        }
    }

    fn find(&self, name: &CodeName) -> Option<(&'static Descriptor, Keeper)> {
        self.code.find(name)
    }
}
