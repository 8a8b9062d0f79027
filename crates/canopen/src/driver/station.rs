// SPDX-License-Identifier: Apache-2.0
//! A node that the driver serves: an axis or a module, and the process data that it exchanges.
use super::axis::Axis;
use super::heard::SignsOfLife;
use super::module::Module;
use super::options::PdosFrom;
use crate::eds::Eds;
use crate::frame::Frame;
use crate::pdo::{self, LEN_MAX, PDOS, Pdos, Word};
use cia402::identity::ExpectedIdentity;
use cia402::{Mode, Scale};
use std::sync::Arc;

/// Identifier of the first PDO to a node, and the difference between consecutive identifiers.
const RECEIVED: u16 = 0x200;
const NEXT: u16 = 0x100;

/// Device at a node.
pub enum What {
    Axis(Box<Axis>),
    Module(Module),
}

/// A node, its process data, and the signs of life received from it.
pub struct Station {
    pub node: u8,
    pub name: String,
    /// True if the node monitors this controller.
    pub is_watched: bool,
    /// Expected identity of the node.
    pub expected: ExpectedIdentity,
    pub what: What,
    /// Origin of the node's PDO mapping.
    pub mapping: PdosFrom,
    pub eds: Option<Arc<Eds>>,
    pub inputs: Pdos,
    pub outputs: Pdos,
    pub heard: SignsOfLife,
}

impl Station {
    pub fn new(node: u8, name: &str, what: What) -> Station {
        let mut station = Station {
            node,
            name: name.to_owned(),
            is_watched: true,
            expected: ExpectedIdentity::default(),
            what,
            mapping: PdosFrom::Written,
            eds: None,
            inputs: Pdos::default(),
            outputs: Pdos::default(),
            heard: SignsOfLife::default(),
        };
        station.expect();
        station
    }

    /// Returns the station's name in the format `axis 'x'`.
    pub fn what(&self) -> String {
        match self.what {
            What::Axis(_) => format!("axis '{}'", self.name),
            What::Module(_) => format!("module '{}'", self.name),
        }
    }

    /// Returns the station's title in the format `node 5 (axis 'x')`.
    pub fn title(&self) -> String {
        format!("node {} ({})", self.node, self.what())
    }

    /// Returns the data that the services need: name, title in errors, scale.
    pub fn beside(&self) -> (String, String, Scale) {
        let scale = match &self.what {
            What::Axis(axis) => axis.moved.commander.scale(),
            What::Module(_) => Scale { mode: Mode::Homing, counts: 1.0, offset: 0.0, speed_max: 0.0, rated_torque: 1.0 },
        };
        (self.name.clone(), format!("{} (node {})", self.what(), self.node), scale)
    }

    /// Resets the station: no data count as received from it, and all of its process data are expected again.
    pub fn expect(&mut self) {
        (self.inputs, self.outputs) = match &self.what {
            What::Axis(axis) => (pdo::inputs(), axis.outputs()),
            What::Module(module) => (module.inputs(), module.outputs()),
        };
        self.heard.expect();
    }

    /// Returns true if the exchange of an object is mandatory.
    pub fn needs(&self, word: Word) -> bool {
        match &self.what {
            What::Axis(axis) => axis.needs(word),
            What::Module(_) => true,
        }
    }

    /// Returns true if the process data with this number are the answer to a SYNC: the PDO with the status word, or the first PDO that a
    /// module sends.
    fn is_answer(&self, number: usize) -> bool {
        match self.what {
            What::Axis(_) => self.inputs[number].at(pdo::STATUS).is_some(),
            What::Module(_) => self.inputs.iter().position(|pdo| !pdo.is_empty()) == Some(number),
        }
    }

    /// Returns true if the node answers a SYNC at all; a module with only outputs does not.
    pub fn answers(&self) -> bool {
        self.inputs.iter().any(|pdo| !pdo.is_empty())
    }

    /// Processes a PDO, numbered from 1; returns false if it has the wrong length.
    pub fn take(&mut self, number: u8, bytes: &[u8], now_ns: i64) -> bool {
        let number = usize::from(number) - 1;
        let Some(pdo) = self.inputs.get(number).filter(|pdo| !pdo.is_empty() && pdo.len() == bytes.len()) else { return false };
        match &mut self.what {
            What::Axis(axis) => axis.take(pdo, bytes),
            What::Module(module) => module.take(pdo, bytes),
        }
        if self.is_answer(number) {
            self.heard.fresh(now_ns);
        }
        true
    }

    /// Processes an emergency message; code 0 means that the error has been cleared.
    pub fn heed(&mut self, code: u16) {
        match &mut self.what {
            What::Axis(axis) => axis.heed(code),
            What::Module(module) => module.heed(code),
        }
    }

    /// Stores the values received from the node.
    pub fn show(&self, readings: &mut [u8]) {
        match &self.what {
            What::Axis(axis) => axis.moved.show(readings),
            What::Module(module) => module.show(readings),
        }
    }

    /// Returns the reason why the node cannot operate while it is engaged, if any.
    pub fn fault(&self) -> Option<String> {
        match &self.what {
            What::Axis(axis) => axis.moved.fault(),
            What::Module(_) => None,
        }
    }

    pub fn axis_mut(&mut self) -> Option<&mut Axis> {
        match &mut self.what {
            What::Axis(axis) => Some(axis),
            What::Module(_) => None,
        }
    }

    /// Returns the mode of an axis.
    pub fn mode(&self) -> Option<Mode> {
        match &self.what {
            What::Axis(axis) => Some(axis.mode),
            What::Module(_) => None,
        }
    }

    /// Returns true if the drive exchanges the objects that homing needs.
    pub fn can_home(&self) -> bool {
        let has = |pdos: &Pdos, word| pdos.iter().any(|pdo| pdo.at(word).is_some());
        has(&self.outputs, pdo::MODE) && has(&self.inputs, pdo::MODE_SHOWN)
    }

    /// Switches to the idle command: an axis holds its position, a module outputs its safe values.
    pub fn tell_idle(&mut self) {
        match &mut self.what {
            What::Axis(axis) => axis.tell_idle(),
            What::Module(module) => module.be_safe(),
        }
    }

    /// Brings the station to rest; an axis stays at rest until it is engaged again.
    pub fn stop(&mut self) {
        if let What::Axis(axis) = &mut self.what {
            axis.moved.commander.stop();
        }
    }

    /// Returns the command frames. Real-time safe.
    pub fn frames(&self) -> [Option<Frame>; PDOS] {
        self.framed(|word| match &self.what {
            What::Axis(axis) => axis.carried(word),
            What::Module(module) => module.carried(word),
        })
    }

    /// Returns the frames that another process sends on behalf of this process after it has exited.
    pub fn last_frames(&self) -> [Option<Frame>; PDOS] {
        self.framed(|word| match &self.what {
            What::Axis(axis) => axis.last_carried(word),
            What::Module(module) => module.safely_carried(word),
        })
    }

    fn framed(&self, carried: impl Fn(Word) -> u32) -> [Option<Frame>; PDOS] {
        std::array::from_fn(|number| {
            let pdo = &self.outputs[number];
            let (mut bytes, mut at) = ([0; LEN_MAX], 0);
            for word in &pdo.words {
                // An object that is longer than our 4-byte values is padded with 0.
                let (len, value) = (pdo::len(*word).min(LEN_MAX - at), u64::from(carried(*word)).to_le_bytes());
                bytes[at..at + len].copy_from_slice(&value[..len]);
                at += len;
            }
            (at > 0).then(|| Frame::new(RECEIVED + NEXT * number as u16 + u16::from(self.node), &bytes[..at]))
        })
    }
}
