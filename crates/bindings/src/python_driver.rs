// SPDX-License-Identifier: Apache-2.0
//! A Python driver, called on the thread of its source. It runs in a separate process for the driver `python`, or in simulation if time
//! is virtual. The other half, in `python/opengpac/driver/process.py`, packs and unpacks the exchanged values.
use crate::convert::to_json;
use device::{
    Channel, Counters, Declaration, DeclaredServices, DeviceError, Direction, Driver, DriverError, GivenOptions, Kind, Layout, OpenedDriver, OptionWord, Reach,
    ServiceWord, Services, Slot, Type,
};
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use serde::Deserialize;
use serde_json::Value;
use std::sync::Arc;

pub static DRIVER: Declaration =
    Declaration::new("python_object", "a driver written in Python, on the thread of its source: for tests, and for the virtual clock", &OPTIONS, open);

const OPTIONS: [OptionWord; 5] = [
    OptionWord::with_default("path", Kind::Text, "none: module is given", "file that contains its class").reaches(Reach::Code),
    OptionWord::with_default("module", Kind::Text, "none: path is given", "module that contains its class").reaches(Reach::Code),
    OptionWord::with_default("class", Kind::Text, "the only one in it", "name of its class"),
    OptionWord::with_default("options", Kind::Table, "none", "what the class declares as Option"),
    OptionWord::with_default("paths", Kind::List, "those of this interpreter", "further folders in which modules are looked for").reaches(Reach::Code),
];

/// Name of the driver's last channel, which contains the age of its readings.
const AGE: &str = "age";

/// A channel as declared by the driver's class.
#[derive(Deserialize)]
struct ChannelDeclaration {
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
    /// Time at which the machine took the latest readings, on the clock of the release times.
    taken_ns: i64,
    commands: Vec<u8>,
    /// Flag for each written channel: 1 if a verb commands it.
    engaged: Vec<u8>,
    counters: Option<Arc<Counters>>,
    services: Option<Arc<ObjectServices>>,
}

/// Services of an object. A Python lock serialises the calls to the object's methods, because its class expects to be called from one
/// thread.
struct ObjectServices {
    exchange: Py<PyAny>,
    words: &'static [ServiceWord],
}

impl Services for ObjectServices {
    fn words(&self) -> Option<&'static [ServiceWord]> {
        Some(self.words)
    }

    fn call(&self, service: &str, arguments: &Value) -> Result<Value, DeviceError> {
        let failed = |why: String| DeviceError { message: why };
        let answer = Python::attach(|py| {
            let arguments = to_json(arguments).map_err(|why| told(&why))?;
            let answer = self.exchange.call_method1(py, "serve", (service, arguments)).and_then(|answer| answer.extract::<String>(py));
            answer.map_err(|why| told(&why))
        });
        serde_json::from_str(&answer.map_err(failed)?).map_err(|why| failed(why.to_string()))
    }
}

/// Creates an object of the class. Does not open the device.
fn open(given: &GivenOptions<'_>) -> Result<OpenedDriver, DriverError> {
    let made = Python::attach(|py| {
        let module = py.import("opengpac.driver.process")?;
        let exchange = module.getattr("Exchange")?.call1((to_json(given.value())?,))?;
        let text = |name| exchange.getattr(name)?.extract::<String>();
        Ok::<_, PyErr>((text("channels")?, text("beside")?, exchange.unbind()))
    });
    let (channels, beside, exchange) = made.map_err(|why| DriverError::Failed(told(&why)))?;
    let mut about: Value = serde_json::from_str(&beside).map_err(|why| DriverError::Failed(format!("its services and counters: {why}")))?;
    let words = DeclaredServices::read(&about).map_err(DriverError::Failed)?;
    about["age"] = AGE.into();
    let declared: Vec<ChannelDeclaration> = serde_json::from_str(&channels).map_err(|why| DriverError::Failed(format!("its channels: {why}")))?;
    let mut layout = Layout::default();
    let mut offsets = Vec::with_capacity(declared.len());
    for channel in declared {
        let of: Type = channel.type_text.parse().map_err(|why| DriverError::Failed(format!("channel '{}': {why}", channel.name)))?;
        let made = if channel.write { Channel::write(channel.name, of).safe(channel.safe).slew(channel.slew) } else { Channel::read(channel.name, of) };
        offsets.push(layout.add(made.unit(channel.unit).doc(channel.doc)).offset);
    }
    let age = layout.add(Channel::read(AGE, Type::DOUBLE).unit("s").doc("age of the readings"));
    let placed = Python::attach(|py| exchange.call_method1(py, "place", (offsets, layout.readings_len())).map(drop));
    placed.map_err(|why| DriverError::Failed(told(&why)))?;
    let mut commands = vec![0; layout.commands_len()];
    for channel in layout.channels().iter().filter(|channel| channel.direction == Direction::Write) {
        commands[channel.offset..channel.offset + channel.len].copy_from_slice(&channel.safe);
    }
    let engaged = vec![0; layout.channels().iter().filter(|channel| channel.direction == Direction::Write).count()];
    let counters = (!words.counters.is_empty()).then(|| Arc::new(Counters::new(words.counters)));
    let services = Python::attach(|py| {
        let carried = || Arc::new(ObjectServices { exchange: exchange.clone_ref(py), words: words.services });
        (!words.services.is_empty()).then(carried)
    });
    Ok((Box::new(PythonDriver { exchange, channels: layout.into_channels(), age, taken_ns: 0, commands, engaged, counters, services }), about))
}

impl PythonDriver {
    fn call(&self, name: &str) -> Result<(), DeviceError> {
        Python::attach(|py| self.exchange.call_method0(py, name).map(drop).map_err(|why| failed(py, &why)))
    }
}

/// Converts an exception to an error; its traceback is written to the standard error of the driver's process.
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

    fn open(&mut self, now_ns: i64) -> Result<(), DeviceError> {
        self.taken_ns = now_ns;
        self.call("open")
    }

    fn read(&mut self, release_ns: i64, readings: &mut [u8]) -> Result<(), DeviceError> {
        Python::attach(|py| {
            let read = self
                .exchange
                .call_method1(py, "exchange", (PyBytes::new(py, &self.commands), PyBytes::new(py, &self.engaged)))
                .map_err(|why| failed(py, &why))?;
            let (bytes, counted, age_s): (&[u8], Vec<u64>, Option<f64>) = read.extract(py).map_err(|why| failed(py, &why))?;
            readings.copy_from_slice(bytes);
            if let Some(age_s) = age_s {
                self.taken_ns = release_ns.saturating_sub((age_s * 1e9) as i64);
            }
            if let Some(counters) = &self.counters {
                counted.into_iter().enumerate().for_each(|(index, value)| counters.set(index, value));
            }
            Ok(())
        })?;
        self.age.set_double(readings, 0, (release_ns - self.taken_ns).max(0) as f64 * 1e-9);
        Ok(())
    }

    fn write(&mut self, _: i64, commands: &[u8], engaged: &[bool]) -> Result<(), DeviceError> {
        self.commands.copy_from_slice(commands);
        self.engaged.iter_mut().zip(engaged).for_each(|(flag, engaged)| *flag = u8::from(*engaged));
        Ok(())
    }

    fn safe_state(&mut self) {
        // If the call fails, the error has been printed; there is no other recipient.
        let _told = self.call("safe_state");
    }

    fn close(&mut self) {
        let _told = self.call("close");
    }

    fn taken_ns(&self) -> Option<i64> {
        Some(self.taken_ns)
    }

    fn services(&self) -> Option<Arc<dyn Services>> {
        self.services.clone().map(|carried| carried as Arc<dyn Services>)
    }

    fn counters(&self) -> Option<Arc<Counters>> {
        self.counters.clone()
    }
}
