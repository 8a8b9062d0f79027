// SPDX-License-Identifier: Apache-2.0
//! A driver on its own thread: newest readings with their age, commands, safe state, and the ways to lose a device.
use device::{Channel, Class, Declaration, DeviceError, Driver, DriverError, GivenOptions, Kind, Layout, OpenedDriver, OptionWord, Slot, Type};
use serde_json::{Value, json};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicI64, AtomicU64, Ordering};
use std::time::{Duration, Instant};

/// Actions and observations of a test's device; each test has its own, by number.
#[derive(Default)]
struct Bench {
    exchanges: AtomicU64,
    /// Bits of the last commanded value.
    commanded: AtomicU64,
    rests: AtomicU64,
    closed: AtomicBool,
    fails: AtomicBool,
    /// Exchanges block as long as this is locked.
    hangs: Mutex<()>,
    opened_ns: AtomicI64,
}

static BENCHES: [std::sync::LazyLock<Bench>; 5] = [const { std::sync::LazyLock::new(Bench::default) }; 5];

static DRIVER: Declaration = Declaration { class: Class::Worker, ..Declaration::new("bench", "a device of a test", &OPTIONS, open) };
const OPTIONS: [OptionWord; 1] = [OptionWord::needed("bench", Kind::Whole, "which")];

struct Device {
    bench: &'static Bench,
    channels: Vec<Channel>,
    count: Slot,
    value: Slot,
}

fn open(given: &GivenOptions<'_>) -> Result<OpenedDriver, DriverError> {
    let bench = given.value()["bench"].as_u64().unwrap_or_default() as usize;
    let mut layout = Layout::default();
    let count = layout.add(Channel::read("count", Type::DOUBLE));
    let value = layout.add(Channel::write("value", Type::DOUBLE));
    Ok((Box::new(Device { bench: &BENCHES[bench], channels: layout.into_channels(), count, value }), json!({ "parts": [] })))
}

impl Driver for Device {
    fn channels(&self) -> &[Channel] {
        &self.channels
    }

    fn open(&mut self, now_ns: i64) -> Result<(), DeviceError> {
        self.bench.opened_ns.store(now_ns, Ordering::Relaxed);
        Ok(())
    }

    fn read(&mut self, _: i64, readings: &mut [u8]) -> Result<(), DeviceError> {
        if self.bench.fails.load(Ordering::Relaxed) {
            return Err(DeviceError { message: "the cable is out".to_owned() });
        }
        drop(self.bench.hangs.lock());
        let count = self.bench.exchanges.fetch_add(1, Ordering::Relaxed) + 1;
        self.count.set_double(readings, 0, count as f64);
        Ok(())
    }

    fn write(&mut self, _: i64, commands: &[u8], engaged: &[bool]) -> Result<(), DeviceError> {
        let value = if engaged[0] { self.value.double(commands, 0) } else { 0.0 };
        self.bench.commanded.store(value.to_bits(), Ordering::Relaxed);
        Ok(())
    }

    fn safe_state(&mut self) {
        self.bench.commanded.store(0.0_f64.to_bits(), Ordering::Relaxed);
        self.bench.rests.fetch_add(1, Ordering::Relaxed);
    }

    fn close(&mut self) {
        self.bench.closed.store(true, Ordering::Relaxed);
    }
}

/// Time limit far longer than any operation here.
const LONG: Duration = Duration::from_secs(300);

fn wait_until(what: &str, mut holds: impl FnMut() -> bool) {
    let until = Instant::now() + LONG;
    while !holds() {
        assert!(Instant::now() < until, "in vain: {what}");
        std::thread::yield_now();
    }
}

/// A clock of the test's source; the worker's clock follows it.
struct Source {
    driver: Box<dyn Driver>,
    epoch: Instant,
}

impl Source {
    fn open(bench: usize, more: Value) -> Source {
        driver_kit::lend();
        device::register(&DRIVER).expect("nobody else has its name");
        let mut options = json!({ "bench": bench, "period_ns": 1_000_000 });
        options.as_object_mut().expect("a table").extend(more.as_object().expect("a table").clone());
        let (mut driver, _) = device::open("bench", &options).expect("its options are right");
        driver.open(0).expect("it is there");
        Source { driver, epoch: Instant::now() }
    }

    fn now_ns(&self) -> i64 {
        self.epoch.elapsed().as_nanos() as i64
    }

    /// Reads the count and its age.
    fn read(&mut self) -> Result<(f64, f64), String> {
        let mut readings = [0; 16];
        let now_ns = self.now_ns();
        self.driver.read(now_ns, &mut readings).map_err(|why| why.message)?;
        let [count, age] = [0, 8].map(|at| Slot { offset: at, len: 8 }.double(&readings, 0));
        Ok((count, age))
    }

    fn write(&mut self, value: f64) {
        let now_ns = self.now_ns();
        self.driver.write(now_ns, &value.to_ne_bytes(), &[true]).expect("it is open");
    }
}

fn commanded(bench: &Bench) -> f64 {
    f64::from_bits(bench.commanded.load(Ordering::Relaxed))
}

#[test]
fn the_newest_readings_come_with_their_age_and_commands_arrive() {
    let bench = &BENCHES[0];
    let mut source = Source::open(0, json!({ "age_max_ns": 20_000_000_000_i64 }));
    assert_eq!(source.driver.channels().last().map(|channel| (channel.name.as_str(), channel.unit.as_str(), channel.offset)), Some(("age", "s", 8)));
    let (first, age) = source.read().expect("the first exchange is part of opening it");
    assert!(first >= 1.0 && age >= 0.0, "{first} {age}");
    wait_until("newer readings", || source.read().expect("it answers").0 > first);
    source.write(2.5);
    wait_until("the command", || commanded(bench) == 2.5);
    let before = bench.rests.load(Ordering::Relaxed);
    source.driver.safe_state();
    wait_until("the safe state", || bench.rests.load(Ordering::Relaxed) > before && commanded(bench) == 0.0);
    source.write(1.5);
    wait_until("a command behind it", || commanded(bench) == 1.5);
    source.driver.close();
    assert!(bench.closed.load(Ordering::Relaxed) && commanded(bench) == 0.0, "it is at rest when it is closed");
}

#[test]
fn a_failed_exchange_loses_the_device_with_its_cause() {
    let bench = &BENCHES[1];
    let mut source = Source::open(1, json!({ "age_max_ns": 20_000_000_000_i64 }));
    source.read().expect("it answers");
    bench.fails.store(true, Ordering::Relaxed);
    wait_until("the loss", || source.read().is_err());
    assert_eq!(source.read(), Err("the cable is out".to_owned()));
    wait_until("its end", || bench.closed.load(Ordering::Relaxed));
}

#[test]
fn an_exchange_that_hangs_makes_readings_old_and_holds_up_nobody() {
    let bench = &BENCHES[2];
    let mut source = Source::open(2, json!({ "age_max_ns": 5_000_000 }));
    let held = bench.hangs.lock().expect("no holder panics");
    wait_until("the loss", || source.read().is_err());
    let why = source.read().expect_err("it stays lost");
    assert!(why.contains("more than 5 ms: it answers too slowly or not at all"), "{why}");
    drop(held);
}

#[test]
fn commands_that_stop_coming_bring_the_outputs_to_rest() {
    let bench = &BENCHES[3];
    let mut source = Source::open(3, json!({ "age_max_ns": 50_000_000 }));
    source.write(2.0);
    wait_until("the command or its end", || commanded(bench) == 2.0 || bench.rests.load(Ordering::Relaxed) > 0);
    wait_until("the rest", || bench.rests.load(Ordering::Relaxed) > 0 && commanded(bench) == 0.0);
}

#[test]
fn in_place_it_exchanges_with_its_source_and_options_are_checked() {
    let bench = &BENCHES[4];
    driver_kit::lend();
    device::register(&DRIVER).expect("nobody else has its name");
    let (kind, options) = device::in_virtual_time("bench", &json!({ "bench": 4 }));
    let (mut driver, _) = device::open(&kind, &options).expect("its options are right");
    driver.open(0).expect("it is there");
    let mut readings = [0; 16];
    driver.read(7, &mut readings).expect("it answers");
    assert_eq!(bench.exchanges.load(Ordering::Relaxed), 1, "once for each reading");
    driver.write(7, &3.0_f64.to_ne_bytes(), &[true]).expect("it is open");
    assert_eq!(commanded(bench), 3.0);
    for (options, words) in [
        (json!({ "bench": 4, "period_ns": 5 }), "100 us to 10 s"),
        (json!({ "bench": 4, "period_ns": 10_000_000, "age_max_ns": 10_000_000 }), "it must be at least two periods, 20 ms"),
        (json!({ "bench": 4, "perod_ns": 1 }), "did you mean 'period_ns'?"),
    ] {
        let refused = device::open("bench", &options).err().expect("it is refused").to_string();
        assert!(refused.contains(words), "{refused}");
    }
}
