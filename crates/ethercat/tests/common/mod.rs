// SPDX-License-Identifier: Apache-2.0
//! An emulated segment with two drives, and the driver that has opened it. The segment's time is set by the test and advances with the
//! cycles, so that nothing depends on the machine's load.
#![allow(dead_code)]
use device::{DeviceError, Driver};
use ethercat::emulator::{DriveOptions, Segment, Server, serve_at};
use serde_json::{Value, json};
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, AtomicU64, Ordering};
use std::time::{Duration, Instant};

pub const COUNTS: f64 = 1000.0;
pub const PERIOD_NS: i64 = 1_000_000;
pub const LONG: Duration = Duration::from_secs(300);
pub const SWITCH_ON_DISABLED: u16 = 0x40;
pub const OPERATION_ENABLED: u16 = 0x27;
/// Transit time of a frame to the segment, in addition to the test's time.
const FRAME_NS: u64 = 10_000;

/// A segment, and the driver that has opened it.
pub struct Rig {
    pub server: Server,
    pub interface: String,
    pub driver: Box<dyn Driver>,
    /// Time of the segment, ns.
    time_ns: Arc<AtomicU64>,
    options: Value,
    readings: Vec<u8>,
    now_ns: i64,
    axes: usize,
}

impl Rig {
    /// Creates two axes, at 1 rad and at 2 rad.
    pub fn new() -> Rig {
        Rig::of(two_axes())
    }

    pub fn of(axes: Value) -> Rig {
        Rig::with(&[drive("first", 1000), drive("second", 2000)], json!({ "axes": axes }))
    }

    /// Creates these drives, and a driver with these options.
    pub fn with(drives: &[DriveOptions], options: Value) -> Rig {
        static NEXT: AtomicU32 = AtomicU32::new(0);
        let interface = format!("local:test-{}-{}", std::process::id(), NEXT.fetch_add(1, Ordering::Relaxed));
        Rig::on(&interface, &interface, drives, options)
    }

    /// Creates a rig with the segment on one end and the driver on the other.
    pub fn on(answering: &str, interface: &str, drives: &[DriveOptions], mut options: Value) -> Rig {
        let time_ns = Arc::new(AtomicU64::new(1_000_000_000));
        let time = time_ns.clone();
        let server = serve_at(answering, Segment::new(drives), move || time.fetch_add(FRAME_NS, Ordering::Relaxed))
            .expect("the interface is there, and the right to use it");
        options["interface"] = interface.into();
        let axes = options["axes"].as_array().expect("a list").len();
        let driver = opened(&options);
        Rig { server, interface: interface.to_owned(), driver, time_ns, options, readings: vec![0; 512], now_ns: 0, axes }
    }

    /// Writes, waits until the segment has received it, and reads.
    pub fn exchange(&mut self, goals: &[Option<f64>]) -> Result<(), DeviceError> {
        self.write(goals);
        self.read()
    }

    /// Writes, and waits until the segment has received it.
    pub fn write(&mut self, goals: &[Option<f64>]) {
        let seen = self.server.lock().counts().frames;
        self.tell(goals);
        self.wait_beyond(seen);
    }

    /// Writes without waiting.
    pub fn tell(&mut self, goals: &[Option<f64>]) {
        let engaged: Vec<bool> = (0..self.axes).map(|of| goals.get(of).copied().flatten().is_some()).collect();
        let commands: Vec<u8> = (0..self.axes).flat_map(|of| goals.get(of).copied().flatten().unwrap_or(f64::NAN).to_ne_bytes()).collect();
        self.now_ns += PERIOD_NS;
        self.time_ns.fetch_add(PERIOD_NS as u64 - FRAME_NS, Ordering::Relaxed);
        self.driver.write(self.now_ns, &commands, &engaged).expect("written");
    }

    /// Writes a command of the first axis again at the time of the last one.
    pub fn write_again(&mut self, goal: f64) {
        self.now_ns -= PERIOD_NS;
        self.write(&[Some(goal)]);
    }

    /// Reads.
    pub fn read(&mut self) -> Result<(), DeviceError> {
        self.driver.read(self.now_ns, &mut self.readings)
    }

    /// Exchanges these commands once; returns how much a count rose within the driver's calls.
    pub fn raw(&mut self, commands: &[u8], engaged: &[bool], count: impl Fn() -> u64) -> u64 {
        let before = count();
        let seen = self.tell_raw(commands, engaged);
        let mut counted = count() - before;
        self.wait_beyond(seen);
        let before = count();
        self.read().expect("read");
        counted += count() - before;
        counted
    }

    /// Exchanges these commands once.
    pub fn exchange_raw(&mut self, commands: &[u8], engaged: &[bool]) -> Result<(), DeviceError> {
        let seen = self.tell_raw(commands, engaged);
        self.wait_beyond(seen);
        self.read()
    }

    /// Writes these commands; returns the number of frames that the segment had seen before.
    fn tell_raw(&mut self, commands: &[u8], engaged: &[bool]) -> u64 {
        let seen = self.server.lock().counts().frames;
        self.now_ns += PERIOD_NS;
        self.time_ns.fetch_add(PERIOD_NS as u64 - FRAME_NS, Ordering::Relaxed);
        self.driver.write(self.now_ns, commands, engaged).expect("written");
        seen
    }

    /// Waits until the segment has seen more than `seen` frames.
    pub fn wait_beyond(&self, seen: u64) {
        let until = Instant::now() + LONG;
        while self.server.lock().counts().frames == seen {
            assert!(Instant::now() < until, "the segment answers");
            std::thread::yield_now();
        }
    }

    /// Exchanges until a condition holds.
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

    /// Replaces the driver with a new one, as a reset of the device does.
    pub fn reset(&mut self) {
        self.driver.close();
        self.driver = opened(&self.options);
    }

    /// Opens a new driver, as a reset of the device does; returns why that is refused.
    pub fn refusal(&mut self) -> String {
        self.driver.close();
        let (mut driver, _) = device::open("ethercat", &self.options).expect("made");
        let refused = driver.open(0).expect_err("refused").message;
        self.driver = driver;
        refused
    }

    /// Sets the axes that the driver gets at the next reset.
    pub fn set_axes(&mut self, axes: Value) {
        self.options["axes"] = axes;
    }

    /// Lets time pass for the segment without a frame.
    pub fn pass_by(&self, time_ns: u64) {
        self.time_ns.fetch_add(time_ns, Ordering::Relaxed);
    }
}

fn opened(options: &Value) -> Box<dyn Driver> {
    let _ = device::register(&ethercat::DRIVER);
    let (mut driver, _) = device::open("ethercat", options).expect("made");
    driver.open(0).expect("opened");
    driver
}

/// Returns two axes, each limited to 10 rad/s.
pub fn two_axes() -> Value {
    json!([{ "name": "x", "counts": COUNTS, "speed_max": 10 }, { "name": "y", "counts": COUNTS, "speed_max": 10 }])
}

/// Returns a drive at this position in counts.
pub fn drive(name: &str, position: i32) -> DriveOptions {
    DriveOptions { name: name.into(), position, ..DriveOptions::default() }
}
