// SPDX-License-Identifier: Apache-2.0
//! Code, devices and connections to which scripts refer, in the process that runs them.
use crate::code::Code;
use crate::service::Reaches;
use crate::shared::{Devices, locked};
use interconnect::{Carrier, LostConnection, Memory, Receiver, Sender};
use kernel::Nowhere;
use kernel::{Device, Event, Reach, SourceId, Way};
use modules::Probe;
use opengpac::abi::Descriptor;
use runtime::Host;
use runtime::encoding::{CodeName, Ground};
use std::any::Any;
use std::collections::HashMap;
use std::sync::Arc;

type Keeper = Arc<dyn Any + Send + Sync>;

/// The code, devices and connections of one processor.
pub(crate) struct Grounds {
    code: Code,
    devices: Arc<Devices>,
    reaches: Reaches,
    /// Writing ends of connections within this process that were created with the reading ends but not taken yet.
    senders: HashMap<u64, Box<dyn Sender>>,
    receivers: HashMap<u64, Box<dyn Receiver>>,
    host: Arc<Host>,
}

impl Grounds {
    pub fn new(host: Arc<Host>, devices: Arc<Devices>, reaches: Reaches, probe: Probe) -> Grounds {
        Grounds { code: Code::new(probe), devices, reaches, senders: HashMap::new(), receivers: HashMap::new(), host }
    }

    /// Loads a module from its bytes. Fails with a description if the module is faulty.
    pub fn load(&mut self, key: &str, name: &str, bytes: &[u8]) -> Result<(), String> {
        self.code.load(key, name, bytes)
    }

    fn ends(&mut self, way: &Way) -> Result<&mut Box<dyn interconnect::Ends>, String> {
        let (ends, what) = match way.reach {
            Reach::Host => (&mut self.reaches.host, "other processes"),
            _ => (&mut self.reaches.network, "other hosts"),
        };
        ends.as_mut().ok_or_else(|| format!("this processor has no connection to {what}"))
    }

    /// Reports connections whose memory another process has overwritten.
    pub fn tell_lost(&mut self) {
        let lost: Vec<LostConnection> = [&mut self.reaches.host, &mut self.reaches.network].into_iter().flatten().flat_map(|ends| ends.lost()).collect();
        lost.into_iter().for_each(|lost| self.host.tell(unconnected(lost)));
    }

    fn unconnected(&self, way: &Way, message: String) {
        self.host.tell(Event::Unconnected { writer: SourceId(way.spec.writer), reader: SourceId(way.spec.reader), message });
    }
}

/// Returns the event for a lost connection.
pub(crate) fn unconnected(LostConnection { writer, reader, message }: LostConnection) -> Event {
    Event::Unconnected { writer: SourceId(writer), reader: SourceId(reader), message }
}

impl Ground for Grounds {
    fn code(&self, name: &CodeName) -> Option<(&'static Descriptor, Keeper)> {
        self.code.find(name)
    }

    fn device(&self, name: &str) -> Option<Arc<Device>> {
        locked(&self.devices).get(name).cloned()
    }

    fn sender(&mut self, way: &Way) -> Box<dyn Sender> {
        if way.reach == Reach::Process {
            return self.senders.remove(&way.number).unwrap_or_else(|| {
                let (sender, receiver) = Memory.connect(&way.spec);
                self.receivers.insert(way.number, receiver);
                sender
            });
        }
        let made = self.ends(way).and_then(|ends| ends.sender(way.number, &way.spec).map_err(|why| why.message));
        made.unwrap_or_else(|message| {
            self.unconnected(way, message);
            Box::new(Nowhere::of(&way.spec))
        })
    }

    fn receiver(&mut self, way: &Way) -> Box<dyn Receiver> {
        if way.reach == Reach::Process {
            return self.receivers.remove(&way.number).unwrap_or_else(|| {
                let (sender, receiver) = Memory.connect(&way.spec);
                self.senders.insert(way.number, sender);
                receiver
            });
        }
        let raise = self.host.raiser_of(SourceId(way.spec.reader));
        let made = self.ends(way).and_then(|ends| ends.receiver(way.number, &way.spec, raise).map_err(|why| why.message));
        made.unwrap_or_else(|message| {
            self.unconnected(way, message);
            Box::new(Nowhere::of(&way.spec))
        })
    }
}
