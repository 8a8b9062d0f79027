// SPDX-License-Identifier: Apache-2.0
//! Services of the driver outside its cycle: object dictionary access, network management, fault reset, homing.
use crate::client::Client;
use crate::eds::Eds;
use crate::nmt::Command;
use cia402::Entry;
use cia402::axis::{HOME, RESET_FAULT, Reach, ServiceState, is_told_of_stops};
use device::{DeviceError, Kind, OptionWord, ServiceWord, Services};
use serde_json::Value;
use std::sync::Arc;

const NODE: OptionWord = OptionWord::needed("axis", Kind::Text, "the name of the axis or module");
const OBJECT: OptionWord =
    OptionWord::with_default("object", Kind::Text, "that of index and sub", "its name in the EDS file: `Position actual value`, `Identity object.Vendor-ID`");
const INDEX: OptionWord =
    OptionWord::with_default("index", Kind::Whole, "that of object", "the index of the object; 0x6064 is a drive's position").within(0.0, 65535.0);
const SUB: OptionWord = OptionWord::with_default("sub", Kind::Whole, "0", "the subindex").within(0.0, 255.0);

pub const SERVICES: [ServiceWord; 6] = [
    ServiceWord {
        name: "read_object",
        doc: "reads an object of a node: its bytes, also as a number if it has up to 8, and with an EDS file as that type",
        arguments: &[NODE, INDEX, SUB, OBJECT],
        answer: Some(Kind::Table),
        moves: false,
    },
    ServiceWord {
        name: "write_object",
        doc: "writes an object of a node; while an emergency stop is latched, none that moves it or defines how it stops",
        arguments: &[
            NODE,
            INDEX,
            SUB,
            OBJECT,
            OptionWord::needed("value", Kind::Whole, "its value").within(-9.3e18, 1.9e19),
            OptionWord::with_default("bits", Kind::Whole, "that of object", "8, 16, 32 or 64: its length").within(8.0, 64.0),
        ],
        answer: None,
        moves: false,
    },
    ServiceWord {
        name: "nmt",
        doc: "commands a node to change its state; a node that leaves operation loses the device",
        arguments: &[NODE, OptionWord::needed("command", Kind::Text, "start, stop, pre_operational, reset or reset_communication")],
        answer: None,
        moves: false,
    },
    ServiceWord {
        name: "save",
        doc: "makes a node store its settings (object 0x1010), so that they survive a power cycle",
        arguments: &[NODE],
        answer: None,
        moves: false,
    },
    RESET_FAULT,
    HOME,
];

/// A connection to the nodes, separate from that of the cycle.
pub struct Nodes {
    pub client: Client,
    pub of_axes: Vec<u8>,
}

impl Reach for Nodes {
    fn upload(&mut self, axis: usize, of: Entry) -> Result<Vec<u8>, String> {
        self.client.upload(self.of_axes[axis], of).map_err(|why| why.to_string())
    }

    fn download(&mut self, axis: usize, of: Entry, value: &[u8]) -> Result<(), String> {
        self.client.download(self.of_axes[axis], of, value).map_err(|why| why.to_string())
    }
}

/// Services of an open device, for its axes and for its bus.
pub struct Beside {
    pub shared: ServiceState<Nodes>,
    /// Number of axis nodes; the other nodes are modules.
    pub axes: usize,
    pub data_sheets: Vec<Option<Arc<Eds>>>,
}

impl Beside {
    fn carry_out(&self, service: &str, arguments: &Value, is_stopped: &dyn Fn() -> bool) -> Result<Value, String> {
        let node = self.shared.axis(arguments)?;
        match service {
            "save" => {
                self.shared.on(node, |nodes| nodes.download(node, Entry { index: 0x1010, sub: 1 }, b"save"))?;
                Ok(Value::Null)
            }
            "nmt" => {
                let command = arguments["command"].as_str().and_then(Command::named);
                let command = command.ok_or_else(|| format!("command must be {}", Command::NAMES))?;
                self.shared.on(node, |nodes| nodes.client.send(&command.frame(nodes.of_axes[node])).map_err(|error| error.to_string()))?;
                Ok(Value::Null)
            }
            "home" | "reset_fault" if node >= self.axes => Err(format!("'{}' is a module: it has no axis", arguments["axis"].as_str().unwrap_or_default())),
            "home" => self.shared.home(arguments, is_stopped),
            "reset_fault" => self.shared.carry_out(service, arguments, is_stopped),
            _ => self.object(node, service, arguments, is_stopped),
        }
    }

    /// Reads or writes an object dictionary entry, which may be addressed by its name in the EDS file.
    fn object(&self, node: usize, service: &str, arguments: &Value, is_stopped: &dyn Fn() -> bool) -> Result<Value, String> {
        let Some(name) = arguments["object"].as_str() else {
            if arguments["index"].is_null() {
                return Err("give an index, or, with an EDS file, the name of an object".to_owned());
            }
            return self.shared.carry_out(service, arguments, is_stopped);
        };
        let Some(eds) = &self.data_sheets[node] else {
            return Err(format!("object '{name}' cannot be found by its name without an EDS file: give the node one (option eds), or give the object's index"));
        };
        let (of, object) = eds.named(name)?;
        let mut arguments = arguments.clone();
        (arguments["index"], arguments["sub"]) = (of.index.into(), of.sub.into());
        if arguments["bits"].is_null() {
            arguments["bits"] = object.kind.bits().map_or(Value::Null, Value::from);
        }
        let mut answer = self.shared.carry_out(service, &arguments, is_stopped)?;
        if let (Some(number), Some(bits)) = (answer["number"].as_u64(), object.kind.bits())
            && object.kind.is_signed()
        {
            let unused = 64 - bits;
            answer["number"] = (((number << unused) as i64) >> unused).into();
        }
        Ok(answer)
    }
}

impl Services for Beside {
    fn is_told_of_stops(&self, service: &str) -> bool {
        is_told_of_stops(service)
    }

    fn call(&self, service: &str, arguments: &Value) -> Result<Value, DeviceError> {
        self.carry_out(service, arguments, &|| false).map_err(|message| DeviceError { message })
    }

    fn call_moving(&self, service: &str, arguments: &Value, is_stopped: &dyn Fn() -> bool) -> Result<Value, DeviceError> {
        self.carry_out(service, arguments, is_stopped).map_err(|message| DeviceError { message })
    }
}
