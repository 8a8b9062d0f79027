// SPDX-License-Identifier: Apache-2.0
//! An emulated bus with two drives, and the driver that has opened it. Time is a number set by the test.
#![allow(dead_code)]
use canopen::emulator::{Bus, NodeOptions};
use canopen::emulator::{SharedBus, publish};
use device::{DeviceError, Direction, Driver};
use serde_json::{Value, json};
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};

pub const COUNTS: f64 = 1000.0;
pub const PERIOD_NS: i64 = 10_000_000;
pub const SWITCH_ON_DISABLED: u16 = 0x40;
pub const OPERATION_ENABLED: u16 = 0x27;
/// Node IDs of the axes `x` and `y`.
pub const X: u8 = 5;
pub const Y: u8 = 6;

pub struct Rig {
    pub bus: Arc<SharedBus>,
    pub interface: String,
    pub driver: Box<dyn Driver>,
    pub readings: Vec<u8>,
    pub now_ns: i64,
    axes: Value,
    more: Value,
}

/// Two drives, at 1 rad and at 2 rad.
pub fn two_drives() -> Bus {
    let drive = |name: &str, node, position| NodeOptions { name: name.into(), node, position, ..NodeOptions::default() };
    Bus::new(&[drive("first", X, 1000), drive("second", Y, 2000)])
}

/// Returns two axes, each limited to 10 rad/s.
pub fn two_axes() -> Value {
    json!([{ "name": "x", "node": X, "counts": COUNTS, "speed_max": 10 }, { "name": "y", "node": Y, "counts": COUNTS, "speed_max": 10 }])
}

impl Rig {
    pub fn new() -> Rig {
        Rig::of(two_axes(), json!({}))
    }

    pub fn of(axes: Value, more: Value) -> Rig {
        Rig::on(two_drives(), axes, more)
    }

    /// Opens a driver with these axes on this bus.
    pub fn on(bus: Bus, axes: Value, more: Value) -> Rig {
        static NEXT: AtomicU32 = AtomicU32::new(0);
        let interface = format!("emulated:test-{}", NEXT.fetch_add(1, Ordering::Relaxed));
        let bus = SharedBus::new(bus);
        publish(&interface, &bus);
        let driver = opened(&interface, &axes, &more).expect("opened");
        Rig { bus, interface, driver, readings: vec![0; 512], now_ns: 0, axes, more }
    }

    /// Reads and writes once, as a firing does.
    pub fn exchange(&mut self, goals: &[Option<f64>]) -> Result<(), DeviceError> {
        self.now_ns += PERIOD_NS;
        self.driver.read(self.now_ns, &mut self.readings)?;
        let axes = self.axes.as_array().expect("a list").len();
        let engaged: Vec<bool> = (0..axes).map(|of| goals.get(of).copied().flatten().is_some()).collect();
        let mut commands: Vec<u8> = (0..axes).flat_map(|of| goals.get(of).copied().flatten().unwrap_or(f64::NAN).to_ne_bytes()).collect();
        // All other channels carry their safe values.
        for channel in self.driver.channels().iter().filter(|channel| channel.direction == Direction::Write).skip(axes) {
            commands.resize(channel.offset, 0);
            commands.extend(&channel.safe);
        }
        self.driver.write(self.now_ns, &commands, &engaged)
    }

    /// Reads once and writes these raw commands.
    pub fn raw(&mut self, commands: &[u8], engaged: &[bool]) -> Result<(), DeviceError> {
        self.now_ns += PERIOD_NS;
        self.driver.read(self.now_ns, &mut self.readings)?;
        self.driver.write(self.now_ns, commands, engaged)
    }

    /// Exchanges until a condition holds.
    pub fn until(&mut self, goals: &[Option<f64>], what: &str, mut holds: impl FnMut(&Rig) -> bool) {
        for _ in 0..10_000 {
            if holds(self) {
                return;
            }
            self.exchange(goals).expect("exchanged");
        }
        panic!("{what}");
    }

    /// Exchanges until the device is lost.
    pub fn lost(&mut self, goals: &[Option<f64>]) -> (i64, String) {
        let begun_ns = self.now_ns;
        for _ in 0..1000 {
            if let Err(why) = self.exchange(goals) {
                return (self.now_ns - begun_ns, why.message);
            }
        }
        panic!("it is not lost");
    }

    pub fn double(&self, name: &str) -> f64 {
        f64::from_ne_bytes(self.bytes(name).try_into().expect("8 bytes"))
    }

    pub fn word(&self, name: &str) -> u16 {
        u16::from_ne_bytes(self.bytes(name).try_into().expect("2 bytes"))
    }

    pub fn byte(&self, name: &str) -> u8 {
        self.bytes(name)[0]
    }

    pub fn status(&self, axis: &str) -> u16 {
        self.word(&format!("{axis}.status")) & 0x6F
    }

    fn bytes(&self, name: &str) -> &[u8] {
        let channel = self.driver.channels().iter().find(|channel| channel.name == name).expect("a channel");
        &self.readings[channel.offset..channel.offset + channel.len]
    }

    pub fn counter(&self, name: &str) -> u64 {
        let counters = self.driver.counters().expect("counters");
        counters.all().find(|(word, _)| word.name == name).expect("a counter").1
    }

    pub fn call(&self, service: &str, arguments: Value) -> Result<Value, String> {
        self.driver.services().expect("services").call(service, &arguments).map_err(|error| error.message)
    }

    /// Replaces the bus.
    pub fn put(&mut self, bus: Bus) {
        self.driver.close();
        self.bus = SharedBus::new(bus);
        publish(&self.interface, &self.bus);
    }

    /// Opens another driver with these axes and closes it.
    pub fn open_again(&mut self, axes: Value) -> Result<(), String> {
        self.driver.close();
        opened(&self.interface, &axes, &self.more).map(|mut driver| driver.close())
    }

    /// Replaces the driver with a new one, as a reset of the device does.
    pub fn reset(&mut self) {
        self.driver.close();
        self.driver = opened(&self.interface, &self.axes, &self.more).expect("opened again");
    }
}

pub fn opened(interface: &str, axes: &Value, more: &Value) -> Result<Box<dyn Driver>, String> {
    let _ = device::register(&canopen::DRIVER);
    let mut options = more.clone();
    options["interface"] = interface.into();
    options["axes"] = axes.clone();
    let (mut driver, _) = device::open("canopen", &options).map_err(|why| why.to_string())?;
    driver.open(0).map_err(|why| why.message)?;
    Ok(driver)
}
