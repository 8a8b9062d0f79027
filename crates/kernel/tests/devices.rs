// SPDX-License-Identifier: Apache-2.0
//! Devices: read at the start of a firing, written at its end; safe values, slew limits, loss.
#![allow(clippy::undocumented_unsafe_blocks, clippy::macro_metavars_in_unsafe, reason = "test blocks are written by hand against the ABI")]
mod support;
use device::{Channel, DeviceError, Direction, Driver};
use kernel::*;
use runtime::{Heritage, Holding, Host, open_seen};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use support::*;

const MS: i64 = 1_000_000;

/// A device with one channel in each direction. Reads the time of the release in ms; fails to write from `fails_ns` on.
struct Drive {
    channels: Vec<Channel>,
    log: Arc<Mutex<Vec<String>>>,
    fails_ns: i64,
}

impl Driver for Drive {
    fn channels(&self) -> &[Channel] {
        &self.channels
    }
    fn open(&mut self, _: i64) -> Result<(), DeviceError> {
        Ok(())
    }
    fn read(&mut self, release_ns: i64, readings: &mut [u8]) -> Result<(), DeviceError> {
        readings.copy_from_slice(&(release_ns / MS).to_ne_bytes());
        Ok(())
    }
    fn write(&mut self, release_ns: i64, commands: &[u8], engaged: &[bool]) -> Result<(), DeviceError> {
        if release_ns >= self.fails_ns {
            return Err(DeviceError { message: "no answer".into() });
        }
        self.log.lock().unwrap().push(format!("{} {}", f64::from_ne_bytes(commands.try_into().unwrap()), engaged[0]));
        Ok(())
    }
    fn safe_state(&mut self) {
        self.log.lock().unwrap().push("safe".into());
    }
    fn close(&mut self) {
        self.log.lock().unwrap().push("closed".into());
    }
}

type Log = Arc<Mutex<Vec<String>>>;

fn drive(slew_max: Option<f64>, fails_ns: i64) -> (Arc<Device>, Log) {
    let (driver, log) = driver(slew_max, fails_ns);
    (Device::open("drive", driver, 0).unwrap(), log)
}

fn driver(slew_max: Option<f64>, fails_ns: i64) -> (Box<dyn Driver>, Log) {
    let channel = |name: &str, direction| Channel {
        name: name.into(),
        direction,
        type_text: "double".into(),
        unit: String::new(),
        doc: String::new(),
        offset: 0,
        len: 8,
        safe: vec![0; 8],
        slew_max,
    };
    let log = Arc::default();
    let driver = Drive { channels: vec![channel("position", Direction::Read), channel("effort", Direction::Write)], log: Arc::clone(&log), fails_ns };
    (Box::new(driver), log)
}

/// Returns a block that turns the reading (an integer) into a command of ten times that.
fn servo() -> &'static opengpac::abi::Descriptor {
    block!(|this, _| {
        this.y = (10.0 * this.u as f64).to_bits() as i64;
        0
    })
}

fn program(device: &Arc<Device>) -> (Host, SourceId) {
    let (host, source, _) = running(device, servo());
    (host, source)
}

/// Returns a block that commands its number of runs, kept in its state.
fn counting() -> &'static opengpac::abi::Descriptor {
    block!(|this, _| {
        this.state += 1;
        this.y = (this.state as f64).to_bits() as i64;
        0
    })
}

fn running(device: &Arc<Device>, code: &'static opengpac::abi::Descriptor) -> (Host, SourceId, Holding) {
    let host = virtual_host(1);
    let source = host.add_source(timer("fast", MS as u64, 80)).unwrap();
    let on = interval();
    let steps = vec![step(&Arc::new(install(1, code, Some(&device.cell(0)), Some(&device.cell(1)))), &on, &Process::new(1, 1), &[])];
    let table = Table::new(steps, vec![], vec![], vec![device.clone()], None);
    let holding = Holding::of(&table, source);
    host.submit(source, script(vec![Op::Table(Box::new(table)), Op::On(on, 1)]));
    (host, source, holding)
}

#[test]
fn an_heir_looks_on_and_then_goes_on_where_the_other_stopped() {
    let (driver, log) = driver(None, i64::MAX);
    let device = open_seen("drive", driver, 0).unwrap();
    let (before, _, held) = running(&device, counting());
    device.engage(1, true);
    run_until(&before, 3 * MS);
    let heir = runtime::heir(&device).unwrap();
    assert!(runtime::heir(&device).is_err(), "there is one already");
    assert_eq!(value(&heir.cell(0)), 3, "it sees what was read last");
    let (after, source, holding) = running(&heir, counting());
    heir.engage(1, true);
    run_until(&after, MS);
    before.leave();
    assert_eq!(*log.lock().unwrap(), ["1 true", "2 true", "3 true"], "the heir has reached nobody, and nothing was made safe");
    // 1 ms of one clock is 3 ms of the other.
    let (heritage, passed) = Heritage::between(&holding, &[held], 2 * MS);
    assert_eq!((passed.carried.as_slice(), passed.anew.len()), (["b1".to_owned()].as_slice(), 0));
    after.submit(source, script(vec![Op::Inherit(Box::new(heritage))]));
    run_until(&after, 2 * MS);
    assert_eq!(log.lock().unwrap()[3..], ["4 true"], "the block counts on");
    assert_eq!((value(&heir.cell(0)), heir.seen().gap_ns()), (4, Some(MS)), "the driver's time goes on");
    after.close();
    drop((before, after, device, heir));
    assert_eq!(log.lock().unwrap()[4..], ["safe", "safe", "closed"], "once");
}

#[test]
fn an_heir_that_took_nothing_over_leaves_the_device_for_the_next() {
    let (driver, log) = driver(None, i64::MAX);
    let device = open_seen("drive", driver, 0).unwrap();
    let (before, _, held) = running(&device, servo());
    run_until(&before, MS);
    let (gone, ..) = running(&runtime::heir(&device).unwrap(), servo());
    run_until(&gone, MS);
    drop(gone);
    run_until(&before, 2 * MS);
    assert_eq!(log.lock().unwrap().len(), 2, "the device goes on");
    let heir = runtime::heir(&device).unwrap();
    assert_eq!(value(&heir.cell(0)), 2);
    let other = Block::install(BlockId(1), "b1", without_items(), Arc::new(()), Extent::new(256).cell(0, 256));
    let table = Table::new(vec![step(&Arc::new(other), &interval(), &Process::new(1, 1), &[])], vec![], vec![], vec![heir.clone()], None);
    let (_, passed) = Heritage::between(&Holding::of(&table, SourceId(0)), &[held], 0);
    assert_eq!(passed.anew, [("b1".to_owned(), "it has 0 items, but the previous one had 5".to_owned())]);
}

/// Returns a block without items.
fn without_items() -> &'static opengpac::abi::Descriptor {
    let of = servo();
    Box::leak(Box::new(opengpac::abi::Descriptor { item_count: 0, ..*of }))
}

#[test]
fn a_claimed_channel_carries_the_command_and_a_free_one_its_safe_value() {
    let (device, log) = drive(None, i64::MAX);
    let (host, source) = program(&device);
    run_until(&host, MS);
    device.engage(1, true);
    run_until(&host, 3 * MS);
    host.submit(source, script(vec![Op::Safe { device: device.clone(), channels: vec![1] }]));
    device.engage(1, false);
    run_until(&host, 4 * MS);
    assert_eq!(*log.lock().unwrap(), ["0 false", "20 true", "30 true", "0 false", "0 false"]);
    host.close();
    assert_eq!(log.lock().unwrap()[5..], ["safe", "safe", "closed"], "though the device is still held here");
    drop((host, device));
    assert_eq!(log.lock().unwrap().len(), 8, "once");
}

#[test]
fn a_slew_limit_is_enforced_and_counted_and_going_safe_is_exempt() {
    let (device, log) = drive(Some(5_000.0), i64::MAX);
    let (host, _) = program(&device);
    run_until(&host, MS);
    device.engage(1, true);
    run_until(&host, 4 * MS);
    device.engage(1, false);
    run_until(&host, 5 * MS);
    assert_eq!(*log.lock().unwrap(), ["0 false", "5 true", "10 true", "15 true", "0 false"]);
    assert_eq!(device.slew_limited(1), 3);
}

#[test]
fn a_forced_reading_replaces_the_drivers_and_a_forced_command_the_blocks() {
    let (device, log) = drive(None, i64::MAX);
    let (host, _) = program(&device);
    device.engage(1, true);
    run_until(&host, 2 * MS);
    device.force(0, Some(7));
    run_until(&host, 3 * MS);
    assert_eq!(value(&device.cell(0)), 7, "blocks see it");
    device.force(1, Some((-1.5_f64).to_bits()));
    run_until(&host, 4 * MS);
    device.force(0, None);
    run_until(&host, 5 * MS);
    device.unforce_all();
    run_until(&host, 6 * MS);
    assert_eq!(*log.lock().unwrap(), ["10 true", "20 true", "70 true", "-1.5 true", "-1.5 true", "60 true"]);
    assert_eq!(value(&device.cell(0)), 6);
}

#[test]
fn a_forced_command_obeys_claims_slew_limits_and_the_emergency_stop() {
    let (device, log) = drive(Some(5_000.0), i64::MAX);
    let stop = Arc::new(AtomicBool::new(false));
    device.obey(stop.clone());
    let (host, _) = program(&device);
    device.force(1, Some(12.0_f64.to_bits()));
    run_until(&host, MS);
    device.engage(1, true);
    run_until(&host, 4 * MS);
    stop.store(true, Ordering::Release);
    run_until(&host, 6 * MS);
    assert_eq!(*log.lock().unwrap(), ["0 false", "5 true", "10 true", "12 true", "safe", "0 false"]);
}

#[test]
fn a_driver_with_nothing_new_finds_its_own_readings_again_after_a_force() {
    let (driver, _) = driver(None, i64::MAX);
    let device = Device::open("drive", Box::new(Still { inner: driver }), 0).unwrap();
    let (host, _) = program(&device);
    run_until(&host, 2 * MS);
    assert_eq!(value(&device.cell(0)), 1, "it read once");
    device.force(0, Some(7));
    run_until(&host, 3 * MS);
    assert_eq!(value(&device.cell(0)), 7);
    device.force(0, Some(8));
    run_until(&host, 4 * MS);
    device.force(0, None);
    run_until(&host, 5 * MS);
    assert_eq!(value(&device.cell(0)), 1);
}

/// A drive that has something new in its first reading only.
struct Still {
    inner: Box<dyn Driver>,
}

impl Driver for Still {
    fn channels(&self) -> &[Channel] {
        self.inner.channels()
    }
    fn open(&mut self, now_ns: i64) -> Result<(), DeviceError> {
        self.inner.open(now_ns)
    }
    fn read(&mut self, release_ns: i64, readings: &mut [u8]) -> Result<(), DeviceError> {
        if release_ns == MS { self.inner.read(release_ns, readings) } else { Ok(()) }
    }
    fn write(&mut self, release_ns: i64, commands: &[u8], engaged: &[bool]) -> Result<(), DeviceError> {
        self.inner.write(release_ns, commands, engaged)
    }
    fn safe_state(&mut self) {
        self.inner.safe_state();
    }
    fn close(&mut self) {
        self.inner.close();
    }
}

#[test]
fn a_device_that_fails_is_lost_once_and_safe() {
    let (device, log) = drive(None, 2 * MS);
    let (host, _) = program(&device);
    run_until(&host, 5 * MS);
    let lost: Vec<_> = events(&host)
        .into_iter()
        .filter(|event| matches!(event, Event::DeviceLost { device, message, time_ns: 2_000_000, .. } if device == "drive" && message == "no answer"))
        .collect();
    assert_eq!(lost.len(), 1);
    assert_eq!(*log.lock().unwrap(), ["0 false", "safe"]);
    assert!(device.is_lost());
}

#[test]
fn outputs_are_safe_in_the_firing_that_read_a_stop() {
    let (device, log) = drive(None, i64::MAX);
    let (host, _) = program(&device);
    let stop = Arc::new(AtomicBool::new(false));
    device.obey(stop.clone());
    device.engage(1, true);
    run_until(&host, 2 * MS);
    // Effective from the next reading: that is 3, not 0.
    device.ask(0, Ask::Stop, false);
    run_until(&host, 4 * MS);
    assert_eq!(*log.lock().unwrap(), ["10 true", "20 true", "safe", "0 false"]);
    assert!(stop.load(Ordering::Acquire) && device.asks(0) && device.asked(0));
    let told = events(&host).into_iter().filter(|event| matches!(event, Event::Asked { time_ns: 3_000_000, .. })).count();
    assert_eq!(told, 1, "it is told when it begins, not in each firing");
    stop.store(false, Ordering::Release);
    device.forget(0);
    run_until(&host, 5 * MS);
    assert!(stop.load(Ordering::Acquire) && device.asked(0), "a cause that is present stops again");
    assert_eq!(log.lock().unwrap().last().unwrap(), "0 false", "nothing went out meanwhile: it is in its safe state");
}

#[test]
fn a_channel_that_only_tells_stops_nothing() {
    let (device, log) = drive(None, i64::MAX);
    let (host, _) = program(&device);
    let stop = Arc::new(AtomicBool::new(false));
    device.obey(stop.clone());
    device.ask(0, Ask::Tell, true);
    device.engage(1, true);
    run_until(&host, 2 * MS);
    assert!(!device.asks(0) && !stop.load(Ordering::Acquire), "it asks at 0 only, and reads 1 and 2");
    device.ask(0, Ask::Tell, false);
    run_until(&host, 3 * MS);
    assert!(device.asks(0) && !stop.load(Ordering::Acquire));
    assert_eq!(*log.lock().unwrap(), ["10 true", "20 true", "30 true"]);
}

#[test]
fn a_lost_device_asks_for_good() {
    let (device, _) = drive(None, 2 * MS);
    let (host, _) = program(&device);
    let stop = Arc::new(AtomicBool::new(false));
    device.obey(stop.clone());
    device.ask(0, Ask::Stop, true);
    run_until(&host, 2 * MS);
    assert!(!stop.load(Ordering::Acquire) && !device.asks(0));
    run_until(&host, 5 * MS);
    assert!(device.is_lost() && device.asks(0) && stop.load(Ordering::Acquire), "what cannot be read is not known to be safe");
    let told = events(&host).into_iter().filter(|event| matches!(event, Event::Asked { .. })).count();
    assert_eq!(told, 1);
}
