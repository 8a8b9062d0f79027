// SPDX-License-Identifier: Apache-2.0
//! A load that falls if nothing holds it, and the brake that the driver operates.
mod common;
use common::{COUNTS, LONG, OPERATION_ENABLED, Rig, SWITCH_ON_DISABLED, drive};
use ethercat::emulator::DriveOptions;
use serde_json::{Value, json};
use std::time::Instant;

const START: f64 = 1.0;

fn rig(mode: &str) -> Rig {
    let drives = [DriveOptions { falls: Some(50_000.0), ..drive("hoist", 1000) }];
    let brake = json!({ "release_ns": 20_000_000, "close_ns": 30_000_000 });
    Rig::with(&drives, json!({ "axes": [{ "name": "hoist", "counts": COUNTS, "speed_max": 10, "mode": mode, "brake": brake }] }))
}

/// Exchanges until a condition holds, and checks that the load never falls below `least`.
fn watched(rig: &mut Rig, goals: &[Option<f64>], least: f64, holds: impl Fn(&Rig) -> bool) {
    let until = Instant::now() + LONG;
    loop {
        rig.exchange(goals).unwrap();
        assert!(rig.double("hoist.position") >= least, "it fell to {}", rig.double("hoist.position"));
        if holds(rig) {
            return;
        }
        assert!(Instant::now() < until, "it does what it is told");
    }
}

#[test]
fn a_load_never_falls() {
    let mut rig = rig("position");
    for _ in 0..100 {
        watched(&mut rig, &[], START, |_| true);
    }
    watched(&mut rig, &[Some(1.5)], START, |rig| rig.double("hoist.position") == 1.5);
    assert_eq!(rig.status("hoist"), OPERATION_ENABLED);
    // The axis is not engaged: the motor holds it.
    for _ in 0..100 {
        watched(&mut rig, &[], 1.5, |_| true);
    }
    rig.driver.safe_state();
    let seen = rig.server.lock().counts().frames;
    watched(&mut rig, &[], 1.5, |rig| rig.status("hoist") == SWITCH_ON_DISABLED);
    assert!(rig.server.lock().counts().frames - seen >= 30, "the motor has held it until the brake was closed");
    for _ in 0..100 {
        watched(&mut rig, &[], 1.5, |_| true);
    }
    watched(&mut rig, &[Some(1.2)], 1.2, |rig| rig.double("hoist.position") == 1.2);
    // A new driver takes over the line; nothing is commanded meanwhile.
    rig.reset();
    watched(&mut rig, &[], 1.2, |rig| rig.status("hoist") == SWITCH_ON_DISABLED);
    assert_eq!(rig.double("hoist.position"), 1.2);
}

#[test]
fn a_load_that_is_lost_is_held_by_nothing() {
    let drives = [DriveOptions { falls: Some(50_000.0), ..drive("hoist", 1000) }];
    // A brake with the wrong polarity: the load falls, so the tests above would fail.
    let brake = json!({ "released_by_one": true });
    let mut rig = Rig::with(&drives, json!({ "axes": [{ "name": "hoist", "counts": COUNTS, "brake": brake }] }));
    rig.until(&[], "it falls", |rig| rig.double("hoist.position") < 0.5);
}

#[test]
fn its_brake_is_open_while_it_looks_for_its_home_and_moves_by_velocity() {
    let mut rig = rig("velocity");
    watched(&mut rig, &[Some(2.0)], START, |rig| rig.double("hoist.position") > 2.0);
    watched(&mut rig, &[], START, |rig| rig.double("hoist.velocity") == 0.0);
    let services = rig.driver.services().unwrap();
    let calling = std::thread::spawn(move || {
        let arguments = json!({ "axis": "hoist", "method": 34, "speed_zero": 5.0, "position": 9.0 });
        services.call("home", &arguments).map_err(|error| error.message)
    });
    while !calling.is_finished() {
        watched(&mut rig, &[], START, |_| true);
    }
    assert_eq!(calling.join().unwrap(), Ok(Value::Null));
    watched(&mut rig, &[], START, |rig| rig.status("hoist") == SWITCH_ON_DISABLED);
    assert_eq!(rig.double("hoist.position"), 9.0);
}

#[test]
fn a_brake_that_cannot_be_is_refused() {
    let _ = device::register(&ethercat::DRIVER);
    let refused = |axis: Value| device::open("ethercat", &json!({ "interface": "local:x", "axes": [axis] })).err().expect("refused").to_string();
    let torque = refused(json!({ "name": "x", "counts": 1, "mode": "torque", "rated_torque": 1.0, "brake": {} }));
    assert!(torque.contains("a motor that holds the axis while it closes"), "{torque}");
    assert!(refused(json!({ "name": "x", "counts": 1, "brake": { "bit": 32 } })).contains("0 to 31"));
}
