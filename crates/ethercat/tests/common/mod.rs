// SPDX-License-Identifier: Apache-2.0
//! An emulated segment with two drives, and the driver that has it open.
#![allow(dead_code)]
use device::{DeviceError, Driver};
use ethercat::emulator::{DriveOptions, Segment, Server, serve};
use serde_json::{Value, json};
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::{Duration, Instant};

pub const COUNTS: f64 = 1000.0;
const PERIOD_NS: i64 = 1_000_000;
pub const LONG: Duration = Duration::from_secs(60);
pub const SWITCH_ON_DISABLED: u16 = 0x40;
pub const OPERATION_ENABLED: u16 = 0x27;

/// A segment, and the driver that has it open.
pub struct Rig {
    pub server: Server,
    pub interface: String,
    pub driver: Box<dyn Driver>,
    readings: Vec<u8>,
    now_ns: i64,
    axes: usize,
}

impl Rig {
    /// Two axes, at 1 rad and at 2 rad.
    pub fn new() -> Rig {
        Rig::of(two_axes())
    }

    pub fn of(axes: Value) -> Rig {
        static NEXT: AtomicU32 = AtomicU32::new(0);
        let interface = format!("local:test-{}-{}", std::process::id(), NEXT.fetch_add(1, Ordering::Relaxed));
        Rig::on(&interface, &interface, axes)
    }

    /// With the segment on one end, the driver on the other.
    pub fn on(answering: &str, interface: &str, axes: Value) -> Rig {
        let drive = |name: &str, position| DriveOptions { name: name.into(), position, watchdog: Some(false) };
        let server = serve(answering, Segment::new(&[drive("first", 1000), drive("second", 2000)])).expect("the interface is there, and the right to use it");
        let count = axes.as_array().expect("a list").len();
        let driver = opened(interface, &axes);
        Rig { server, interface: interface.to_owned(), driver, readings: vec![0; 512], now_ns: 0, axes: count }
    }

    /// Writes, waits until the segment has seen it, and reads.
    pub fn exchange(&mut self, goals: &[Option<f64>]) -> Result<(), DeviceError> {
        self.write(goals);
        self.read()
    }

    /// Writes, and waits until the segment has seen it.
    pub fn write(&mut self, goals: &[Option<f64>]) {
        let seen = self.server.segment().counts().frames;
        self.tell(goals);
        let until = Instant::now() + LONG;
        while self.server.segment().counts().frames == seen {
            assert!(Instant::now() < until, "the segment answers");
            std::thread::yield_now();
        }
    }

    /// Writes.
    pub fn tell(&mut self, goals: &[Option<f64>]) {
        let engaged: Vec<bool> = (0..self.axes).map(|of| goals.get(of).copied().flatten().is_some()).collect();
        let commands: Vec<u8> = (0..self.axes).flat_map(|of| goals.get(of).copied().flatten().unwrap_or(f64::NAN).to_ne_bytes()).collect();
        self.now_ns += PERIOD_NS;
        self.driver.write(self.now_ns, &commands, &engaged).expect("written");
    }

    /// Reads.
    pub fn read(&mut self) -> Result<(), DeviceError> {
        self.driver.read(self.now_ns, &mut self.readings)
    }

    /// Exchanges until something holds.
    pub fn until(&mut self, goals: &[Option<f64>], what: &str, mut holds: impl FnMut(&Rig) -> bool) {
        let until = Instant::now() + LONG;
        while !holds(self) {
            assert!(Instant::now() < until, "{what}");
            self.exchange(goals).expect("exchanged");
        }
    }

    pub fn double(&self, name: &str) -> f64 {
        f64::from_ne_bytes(self.bytes(name).try_into().expect("8 bytes"))
    }

    pub fn status(&self, axis: &str) -> u16 {
        u16::from_ne_bytes(self.bytes(&format!("{axis}.status")).try_into().expect("2 bytes")) & 0x6F
    }

    pub fn bytes(&self, name: &str) -> &[u8] {
        let channel = self.driver.channels().iter().find(|channel| channel.name == name).expect("a channel");
        &self.readings[channel.offset..channel.offset + channel.len]
    }

    pub fn counter(&self, name: &str) -> u64 {
        let counters = self.driver.counters().expect("counters");
        counters.all().find(|(word, _)| word.name == name).expect("a counter").1
    }

    /// A driver made anew, as a reset of the device makes one.
    pub fn reset(&mut self) {
        self.driver.close();
        self.driver = opened(&self.interface, &two_axes());
    }
}

fn opened(interface: &str, axes: &Value) -> Box<dyn Driver> {
    let _ = device::register(&ethercat::DRIVER);
    let options = json!({ "interface": interface, "axes": axes, "timeout_ns": 6_000_000_000i64 });
    let (mut driver, _) = device::open("ethercat", &options).expect("made");
    driver.open(0).expect("opened");
    driver
}

/// Axes of which each moves 10 rad/s at most.
pub fn two_axes() -> Value {
    json!([{ "name": "x", "counts": COUNTS, "speed_max": 10 }, { "name": "y", "counts": COUNTS, "speed_max": 10 }])
}
