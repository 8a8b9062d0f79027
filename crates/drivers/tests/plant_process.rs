// SPDX-License-Identifier: Apache-2.0
//! Plants in their own processes: the channels of the driver that they run, at their own pace, surviving the process that commands them.
mod common;
use common::{Machine, robot, with_mujoco};
use device::SafeHandle;
use drivers::{PlantState, in_virtual_time as in_place, process_state as state};
use guard::{Cause, Guard, GuardCommand, GuardEvent};
use interconnect::Link;
use process_kit::{Child, Launch, UnixLink, now_ns};
use serde_json::{Value, json};
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::mpsc::channel;
use std::time::{Duration, Instant};

/// Limit of any wait in these tests: it only ends a test that hangs.
const LIMIT: Duration = Duration::from_secs(300);
const MS: i64 = 1_000_000;

fn loopback(parts: &[&str]) -> Value {
    json!({ "driver": { "kind": "loopback", "options": { "parts": parts } }, "command": [env!("CARGO_BIN_EXE_opengpac-plant")] })
}

fn with(mut options: Value, name: &str, value: impl Into<Value>) -> Value {
    options[name] = value.into();
    options
}

/// Returns a name that no other test uses.
fn fresh_name() -> String {
    static NUMBER: AtomicU32 = AtomicU32::new(0);
    format!("test-{}-{}", std::process::id(), NUMBER.fetch_add(1, Ordering::Relaxed))
}

fn refused(options: Value) -> String {
    drivers::open("plant_process", &options).err().expect("refused").to_string()
}

fn until<T>(what: &str, mut found: impl FnMut() -> Option<T>) -> T {
    let deadline = Instant::now() + LIMIT;
    loop {
        if let Some(found) = found() {
            return found;
        }
        assert!(Instant::now() < deadline, "{what}: not within {LIMIT:?}");
        std::thread::yield_now();
    }
}

/// Returns the first reading of the plant's first part.
fn position(state: &PlantState) -> f64 {
    f64::from_ne_bytes(state.readings[..8].try_into().unwrap())
}

#[test]
fn a_plant_apart_has_the_channels_and_parts_of_its_driver() {
    let same = |kind: &str, inner: Value| {
        let apart = json!({ "driver": { "kind": kind, "options": inner }, "command": [env!("CARGO_BIN_EXE_opengpac-plant")] });
        assert_eq!(in_place("plant_process", &apart), (kind.to_owned(), inner.clone()));
        let (here, there) = (drivers::open(kind, &inner).unwrap(), drivers::open("plant_process", &apart).unwrap());
        assert_eq!(format!("{:?}", here.0.channels()), format!("{:?}", there.0.channels()));
        assert_eq!(here.1["parts"], there.1["parts"]);
    };
    same("loopback", json!({ "parts": ["a", "b"], "initial": [0.5, 1.0], "slew": 2.0 }));
    with_mujoco(|library| same("mujoco", json!({ "path": robot("ur5e.xml"), "library": library })));
    assert_eq!(in_place("loopback", &json!({ "parts": ["a"] })), ("loopback".to_owned(), json!({ "parts": ["a"] })));
}

#[test]
fn parts_move_at_their_own_pace_while_they_are_claimed() {
    let mut machine = Machine::open("plant_process", loopback(&["a", "b"]));
    machine.read(0);
    assert_eq!((machine.get("a.position"), machine.get("a.velocity")), (vec![0.0], vec![0.0]));
    machine.set("a.effort", &[1.0]);
    machine.set("b.effort", &[1.0]);
    machine.write(0, &[true, true]);
    until("both move", || {
        machine.read(0);
        assert_eq!(machine.get("a.position"), machine.get("b.position"), "a group of readings is whole");
        (machine.get("a.position")[0] > 0.02).then_some(())
    });
    machine.write(0, &[false, true]);
    until("the part that nobody claims stands", || {
        machine.read(0);
        (machine.get("a.velocity") == [0.0]).then_some(())
    });
    assert_eq!(machine.get("b.velocity"), [1.0]);
    machine.driver.safe_state();
    until("safe", || {
        machine.read(0);
        (machine.get("b.velocity") == [0.0]).then_some(())
    });
}

#[test]
fn an_arm_falls_and_is_held_by_its_brakes() {
    with_mujoco(|library| {
        let inner = json!({ "path": robot("ur5e.xml"), "library": library });
        let options = json!({ "driver": { "kind": "mujoco", "options": inner }, "command": [env!("CARGO_BIN_EXE_opengpac-plant")] });
        let mut machine = Machine::open("plant_process", options);
        machine.read(0);
        let home = machine.get("elbow.position");
        machine.write(0, &[true; 7]);
        until("the arm falls", || {
            machine.read(0);
            ((machine.get("elbow.position")[0] - home[0]).abs() > 0.01).then_some(())
        });
        machine.driver.safe_state();
        until("its brakes hold it", || {
            machine.read(0);
            (machine.get("elbow.velocity") == [0.0]).then_some(())
        });
    });
}

#[test]
fn a_plant_that_is_gone_or_fails_loses_the_device() {
    let name = fresh_name();
    let mut machine = Machine::open("plant_process", with(loopback(&["a"]), "name", name.clone()));
    machine.read(0);
    let plant = state(&name).unwrap();
    // SAFETY: signals the plant of this test.
    unsafe { libc::kill(plant.pid.cast_signed(), libc::SIGKILL) };
    until("it is gone", || state(&name).err());
    // The last step may not have been read yet.
    let _newer = machine.try_read(MS);
    (2..=500).for_each(|ms| assert_eq!(machine.try_read(ms * MS), Ok(()), "{ms} ms"));
    assert_eq!(machine.try_read(502 * MS), Err("the plant process has not executed a step for 501 ms".to_owned()));

    drop(machine);
    let left = process_kit::run_folder().unwrap().join(format!("plant-{name}"));
    assert!(!left.exists(), "its socket is taken away by who closes the device");

    let mut options = loopback(&["a"]);
    options["driver"]["options"]["fail_at_ns"] = json!(20 * MS);
    let mut machine = Machine::made("plant_process", options);
    // On a loaded machine the plant may fail before it is opened here.
    let why = match machine.driver.open(0) {
        Err(why) => why.message,
        Ok(()) => until("it fails", || machine.try_read(0).err()),
    };
    assert_eq!(why, "the loopback device fails at 20000000 ns, as its options ask");
}

#[test]
fn a_plant_is_put_away_with_its_driver() {
    let name = fresh_name();
    let options = with(loopback(&["a"]), "name", name.clone());
    let pid = |name: &str| state(name).unwrap().pid;
    // Created but never opened.
    let (driver, _) = drivers::open("plant_process", &options).unwrap();
    let first = pid(&name);
    drop(driver);
    assert!(!std::path::Path::new(&format!("/proc/{first}")).exists());
    let mut machine = Machine::open("plant_process", options);
    let second = pid(&name);
    assert_ne!(first, second);
    machine.driver.close();
    assert!(!std::path::Path::new(&format!("/proc/{second}")).exists());
    assert!(state(&name).expect_err("it is gone").contains("no plant"));
}

#[test]
fn a_driver_that_opens_a_plant_anew_cuts_the_one_before_off() {
    let name = fresh_name();
    let options = with(loopback(&["a"]), "name", name.clone());
    let mut before = Machine::open("plant_process", options.clone());
    let mut after = Machine::open("plant_process", options.clone());
    before.set("a.effort", &[1.0]);
    before.write(0, &[true]);
    let steps = state(&name).unwrap().steps;
    let later = until("three more steps", || state(&name).ok().filter(|state| state.steps > steps + 3));
    assert_eq!(position(&later), 0.0, "nobody reads what it commands");
    assert_eq!(before.try_read(0), Ok(()));
    assert!(before.try_read(600 * MS).is_err_and(|error| error.contains("not executed a step")));
    // Its close must not remove the plant, which belongs to the new device.
    before.driver.close();
    after.set("a.effort", &[1.0]);
    after.write(0, &[true]);
    until("the new one commands", || state(&name).ok().filter(|state| position(state) > 0.0));
    let other = refused(with(options, "step_ns", 2 * MS));
    assert!(other.contains("'name'") && other.contains("different options"), "{other}");
}

#[test]
fn a_plant_with_a_watchdog_makes_itself_safe_and_says_so() {
    let name = fresh_name();
    let options = with(with(loopback(&["a"]), "name", name.clone()), "timeout_ns", 50 * MS);
    let mut machine = Machine::open("plant_process", options.clone());
    assert_eq!(machine.driver.watchdog_ns(), Some(50 * MS));
    machine.set("a.effort", &[1.0]);
    machine.write(0, &[true]);
    let safe = until("it makes itself safe", || state(&name).ok().filter(|state| state.is_safe));
    assert!(position(&safe) > 0.0, "it moved until then");
    let why = machine.try_read(MS).expect_err("it did not wait");
    assert!(why.contains("no command arrived within its timeout of 50 ms"), "{why}");
    machine.write(2 * MS, &[true]);
    let steps = state(&name).unwrap().steps;
    let later = until("three more steps", || state(&name).ok().filter(|state| state.steps > steps + 3));
    assert!(later.is_safe, "until it is opened anew");
    let mut anew = Machine::open("plant_process", options);
    assert_eq!(anew.try_read(0), Ok(()));
    assert!(!state(&name).unwrap().is_safe);
    anew.driver.close();
}

#[test]
fn wrong_options_are_named() {
    assert!(refused(json!({})).contains("'driver'"));
    assert!(refused(json!({ "driver": { "kind": "plant_process" } })).contains("not a driver that a process can run"));
    assert!(refused(with(loopback(&["a"]), "timeout_ns", 10)).contains("its range is 1 ms to"));
    assert!(refused(with(loopback(&["a"]), "name", "../elsewhere")).contains("letters, digits"));
    assert!(refused(with(loopback(&["a"]), "step_ns", 1)).contains("'step_ns'"));
    assert!(refused(loopback(&[])).contains("name at least one part"), "what the driver refuses in its process");
    assert!(refused(with(loopback(&["a"]), "command", json!(["/nowhere/plant"]))).contains("cannot start '/nowhere/plant'"));
    let ends = refused(with(loopback(&["a"]), "command", json!(["false"])));
    assert!(ends.contains("status 1"), "{ends}");
}

/// Starts an rtp in its own process that commands a plant; returns it and the plant's safe handle.
fn rtp(options: &Value) -> (Child, SafeHandle) {
    let (link, theirs) = UnixLink::pair().unwrap();
    let launch = Launch::new([env!("CARGO_BIN_EXE_drivers-stand-in").into(), "rtp".into()]).descriptor("link", theirs);
    let child = launch.start().unwrap();
    link.send(options.to_string().as_bytes()).unwrap();
    let (writes, mut descriptors) = link.receive_with(LIMIT).unwrap().expect("in time");
    let descriptor = descriptors.pop().expect("the memory of the session");
    (child, SafeHandle { descriptor, writes: serde_json::from_slice(&writes).unwrap(), latches: true })
}

/// Process of the guard of the test below: this program, running this test only.
#[test]
#[ignore = "the guard process of another test"]
fn the_guard_process() {
    if std::env::var_os(process_kit::DESCRIPTORS).is_some() {
        guard::run().expect("the test started it");
    }
}

#[test]
fn the_guard_makes_a_plant_safe_that_outlives_who_commanded_it() {
    let (tell, told) = channel();
    let this = std::env::current_exe().unwrap().into_os_string();
    let words = ["the_guard_process", "--exact", "--ignored", "--quiet"].map(Into::into);
    let command = GuardCommand { command: [this].into_iter().chain(words).collect(), path: None };
    let guard = Guard::start(command, move |event| tell.send(event).expect("the test is there")).unwrap();
    let name = fresh_name();
    let options = with(loopback(&["a"]), "name", name.clone());
    let mut spans_us = Vec::new();
    for ward in 0..20 {
        let (child, handle) = rtp(&options);
        guard.watch(ward, "rtp1", child.descriptor().unwrap(), None).unwrap();
        guard.hold(ward, "arm", vec![handle]).unwrap();
        let from = position(&state(&name).unwrap());
        let moving = until("it moves", || state(&name).ok().filter(|state| position(state) > from + 0.002));
        assert!(!moving.is_safe);
        let killed_ns = now_ns();
        child.kill();
        let loss = std::iter::from_fn(|| told.recv_timeout(LIMIT).ok()).find_map(|event| if let GuardEvent::Lost(loss) = event { Some(loss) } else { None });
        assert_eq!(loss.expect("told").cause, Cause::Died);
        let safe = until("it obeys", || state(&name).ok().filter(|state| state.is_safe));
        let still = until("it goes on", || state(&name).ok().filter(|state| state.steps > safe.steps + 3));
        assert_eq!((position(&still), still.pid), (position(&safe), moving.pid), "the same plant, at rest");
        spans_us.push((safe.obeyed_ns - killed_ns) / 1000);
        guard.forget(ward).unwrap();
    }
    spans_us.sort_unstable();
    println!("a plant of 1 ms obeys after kill -9 of its rtp: median {} us, most {} us", spans_us[10], spans_us[19]);
    drop(Machine::open("plant_process", options));
    assert!(state(&name).is_err(), "put away by the one that came last");
}

#[test]
fn a_plant_that_nobody_comes_back_to_ends() {
    is_left(MS);
}

#[test]
fn a_plant_of_long_steps_hears_between_them_that_it_is_alone() {
    is_left(3_600_000 * MS);
}

fn is_left(step_ns: i64) {
    let name = fresh_name();
    let slow = with(with(loopback(&["a"]), "step_ns", step_ns), "silent_ns", 10 * step_ns.max(50 * MS));
    let (child, _handle) = rtp(&with(with(slow, "name", name.clone()), "linger_ns", 300 * MS));
    let plant = state(&name).unwrap();
    child.kill();
    until("it ends", || {
        let ended = std::fs::read_to_string(format!("/proc/{}/stat", plant.pid)).map_or(true, |stat| stat.contains(") Z "));
        ended.then_some(())
    });
    assert!(state(&name).is_err());
}
