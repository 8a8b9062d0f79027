// SPDX-License-Identifier: Apache-2.0
//! A driver in Python on the thread of its source: what a process of driver `python` runs, and what stands for that where time is virtual.
//! `python/opengpac/driver_process.py` has its other half, which packs and unpacks what its exchange reads and writes.
use crate::convert::to_json;
use device::{Channel, Declaration, DeviceError, Direction, Driver, DriverError, Given, Kind, Layout, Opened, OptionWord, Slot, Type};
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use serde::Deserialize;
use serde_json::json;

pub static DRIVER: Declaration =
    Declaration::new("python_object", "a driver written in Python, on the thread of its source: for tests, and where time is virtual", &OPTIONS, open);

const OPTIONS: [OptionWord; 5] = [
    OptionWord::with_default("path", Kind::Text, "none: module is given", "the file with its class"),
    OptionWord::with_default("module", Kind::Text, "none: path is given", "the module with its class"),
    OptionWord::with_default("class", Kind::Text, "the only one there", "its class"),
    OptionWord::with_default("options", Kind::Table, "none", "what the class declares as Option"),
    OptionWord::with_default("paths", Kind::List, "those of this interpreter", "where else modules are looked for"),
];

/// Its last channel: how old its readings are.
const AGE: &str = "age";

/// A channel as its class declares it.
#[derive(Deserialize)]
struct Declared {
    name: String,
    write: bool,
    #[serde(rename = "type")]
    type_text: String,
    unit: String,
    doc: String,
    safe: Vec<u8>,
    slew: Option<f64>,
}

struct PythonDriver {
    exchange: Py<PyAny>,
    channels: Vec<Channel>,
    age: Slot,
    commands: Vec<u8>,
}

/// Makes an object of its class; nothing is opened yet.
fn open(given: &Given<'_>) -> Result<Opened, DriverError> {
    let made = Python::attach(|py| {
        let module = py.import("opengpac.driver_process")?;
        let exchange = module.getattr("Exchange")?.call1((to_json(given.value())?,))?;
        let channels: String = exchange.getattr("channels")?.extract()?;
        Ok::<_, PyErr>((exchange.unbind(), channels))
    });
    let (exchange, channels) = made.map_err(|why| DriverError::Failed(told(&why)))?;
    let declared: Vec<Declared> = serde_json::from_str(&channels).map_err(|why| DriverError::Failed(format!("its channels: {why}")))?;
    let mut layout = Layout::default();
    let mut offsets = Vec::with_capacity(declared.len());
    for channel in declared {
        let of: Type = channel.type_text.parse().map_err(|why| DriverError::Failed(format!("channel '{}': {why}", channel.name)))?;
        let made = if channel.write { Channel::write(channel.name, of).safe(channel.safe).slew(channel.slew) } else { Channel::read(channel.name, of) };
        offsets.push(layout.add(made.unit(channel.unit).doc(channel.doc)).offset);
    }
    let age = layout.add(Channel::read(AGE, Type::DOUBLE).unit("s").doc("how old the readings are"));
    let placed = Python::attach(|py| exchange.call_method1(py, "place", (offsets, layout.readings_len())).map(drop));
    placed.map_err(|why| DriverError::Failed(told(&why)))?;
    let mut commands = vec![0; layout.commands_len()];
    for channel in layout.channels().iter().filter(|channel| channel.direction == Direction::Write) {
        commands[channel.offset..channel.offset + channel.len].copy_from_slice(&channel.safe);
    }
    Ok((Box::new(PythonDriver { exchange, channels: layout.into_channels(), age, commands }), json!({ "age": AGE })))
}

impl PythonDriver {
    fn call(&self, name: &str) -> Result<(), DeviceError> {
        Python::attach(|py| self.exchange.call_method0(py, name).map(drop).map_err(|why| failed(py, &why)))
    }
}

/// What an exception says; the driver's process has its traceback on its standard error.
fn failed(py: Python<'_>, why: &PyErr) -> DeviceError {
    why.display(py);
    DeviceError { message: told(why) }
}

fn told(why: &PyErr) -> String {
    why.to_string()
}

impl Driver for PythonDriver {
    fn channels(&self) -> &[Channel] {
        &self.channels
    }

    fn open(&mut self, _: i64) -> Result<(), DeviceError> {
        self.call("open")
    }

    fn read(&mut self, _: i64, readings: &mut [u8]) -> Result<(), DeviceError> {
        Python::attach(|py| {
            let read = self.exchange.call_method1(py, "exchange", (PyBytes::new(py, &self.commands),)).map_err(|why| failed(py, &why))?;
            let bytes: &[u8] = read.extract(py).map_err(|why| failed(py, &PyErr::from(why)))?;
            readings.copy_from_slice(bytes);
            Ok(())
        })?;
        self.age.set_double(readings, 0, 0.0);
        Ok(())
    }

    fn write(&mut self, _: i64, commands: &[u8], _: &[bool]) -> Result<(), DeviceError> {
        self.commands.copy_from_slice(commands);
        Ok(())
    }

    fn safe_state(&mut self) {
        // What keeps it from that has been printed; there is nobody else to tell.
        let _told = self.call("safe_state");
    }

    fn close(&mut self) {
        let _told = self.call("close");
    }
}
