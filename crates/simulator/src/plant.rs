// SPDX-License-Identifier: Apache-2.0
//! A small plant: a physical device that logs all its outputs.
//!
//! Its parts `p0`, `p1`, … have an `actuator` with safe value -10, -11, … and a `sensor` (the value most recently written to the
//! actuator); `gate` is an input for an emergency stop. A world acts on it through its [`Ledger`].
use device::{Channel, Declaration, DeviceError, Driver, DriverError, GivenOptions, Kind, Layout, OpenedDriver, OptionWord, Type};
use serde_json::json;
use std::cell::RefCell;
use std::collections::HashMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Kind of the plant's driver.
pub const KIND: &str = "simulated plant";

static DRIVER: Declaration = Declaration::new(KIND, "a small plant that writes down what goes out to it", &OPTIONS, make);

const OPTIONS: [OptionWord; 2] =
    [OptionWord::with_default("outputs", Kind::Whole, "1", "how many parts it has"), OptionWord::needed("name", Kind::Text, "whose ledger it writes")];

/// Returns the safe value of the actuator of part `index`.
pub fn safe(index: usize) -> f64 {
    -10.0 - index as f64
}

/// Outputs written at one time, each as (value, whether the channel is claimed).
#[derive(Clone, Debug)]
pub struct Write {
    pub time_ns: i64,
    pub outputs: Vec<(f64, bool)>,
}

/// History and pending faults of the plant.
#[derive(Default)]
pub struct Ledger {
    pub writes: Vec<Write>,
    /// Current outputs.
    pub outputs: Vec<f64>,
    /// True if every read fails.
    pub fails: bool,
    /// Reading of the gate.
    pub gate: f64,
    /// True if the process of its driver is suspended or has exited, so that writes do not arrive.
    pub is_cut: bool,
    /// Number of times the plant was opened, and number of times it was closed.
    pub opened: usize,
    pub closed: usize,
}

impl Ledger {
    /// Sets the outputs to their safe values, as a guard or the driver would.
    pub fn make_safe(&mut self) {
        self.outputs.iter_mut().enumerate().for_each(|(index, output)| *output = safe(index));
    }

    pub fn is_safe(&self) -> bool {
        self.outputs.iter().enumerate().all(|(index, output)| *output == safe(index))
    }
}

pub type SharedLedger = Arc<Mutex<Ledger>>;

thread_local! {
    /// Ledgers by plant name; a world runs in one thread.
    static LEDGERS: RefCell<HashMap<String, SharedLedger>> = RefCell::default();
}

/// Creates the ledger for the plant with this name that this thread opens.
pub fn ledger(name: &str) -> SharedLedger {
    device::register(&DRIVER).expect("nobody else has its name");
    let ledger = SharedLedger::default();
    LEDGERS.with_borrow_mut(|ledgers| ledgers.insert(name.to_owned(), ledger.clone()));
    ledger
}

/// Drops the ledgers of this thread.
pub fn forget() {
    LEDGERS.take();
}

pub fn locked(ledger: &SharedLedger) -> MutexGuard<'_, Ledger> {
    ledger.lock().unwrap_or_else(PoisonError::into_inner)
}

fn make(given: &GivenOptions<'_>) -> Result<OpenedDriver, DriverError> {
    let options = given.value();
    let outputs = options["outputs"].as_u64().unwrap_or(1) as usize;
    let name = options["name"].as_str().unwrap_or_default();
    let known = LEDGERS.with_borrow(|ledgers| ledgers.get(name).cloned());
    let ledger = known.ok_or_else(|| given.wrong("name", format!("there is no ledger of plant '{name}'")))?;
    Ok((Box::new(Plant { channels: channels(outputs), ledger }), json!({})))
}

fn channels(outputs: usize) -> Vec<Channel> {
    let mut layout = Layout::default();
    for part in 0..outputs {
        layout.add(Channel::read(format!("p{part}.sensor"), Type::DOUBLE));
    }
    layout.add(Channel::read("gate", Type::DOUBLE));
    for part in 0..outputs {
        layout.add(Channel::write(format!("p{part}.actuator"), Type::DOUBLE).safe(safe(part).to_ne_bytes().to_vec()));
    }
    layout.into_channels()
}

struct Plant {
    channels: Vec<Channel>,
    ledger: SharedLedger,
}

impl Plant {
    fn outputs(&self) -> usize {
        self.channels.len() / 2
    }
}

impl Driver for Plant {
    fn channels(&self) -> &[Channel] {
        &self.channels
    }

    fn open(&mut self, _: i64) -> Result<(), DeviceError> {
        let mut ledger = locked(&self.ledger);
        if ledger.fails {
            return Err(DeviceError { message: "the plant is away".to_owned() });
        }
        ledger.outputs = (0..self.outputs()).map(safe).collect();
        ledger.opened += 1;
        Ok(())
    }

    fn read(&mut self, _: i64, readings: &mut [u8]) -> Result<(), DeviceError> {
        let ledger = locked(&self.ledger);
        if ledger.fails {
            return Err(DeviceError { message: "the plant went away".to_owned() });
        }
        for (place, value) in readings.chunks_mut(8).zip(ledger.outputs.iter().chain([&ledger.gate])) {
            place.copy_from_slice(&value.to_ne_bytes());
        }
        Ok(())
    }

    fn write(&mut self, release_ns: i64, commands: &[u8], engaged: &[bool]) -> Result<(), DeviceError> {
        let mut ledger = locked(&self.ledger);
        if ledger.is_cut {
            return Ok(());
        }
        let value = |bytes: &[u8]| f64::from_ne_bytes(bytes.try_into().expect("chunks of eight"));
        let outputs: Vec<(f64, bool)> = commands.chunks(8).map(value).zip(engaged.iter().copied()).collect();
        ledger.outputs.iter_mut().zip(&outputs).for_each(|(now, (value, _))| *now = *value);
        ledger.writes.push(Write { time_ns: release_ns, outputs });
        Ok(())
    }

    fn safe_state(&mut self) {
        let mut ledger = locked(&self.ledger);
        if !ledger.is_cut {
            ledger.make_safe();
        }
    }

    fn close(&mut self) {
        self.safe_state();
        locked(&self.ledger).closed += 1;
    }
}
