// SPDX-License-Identifier: Apache-2.0
//! Homing by the drive: a service that waits while the cycle continues.
mod common;
use common::{LONG, OPERATION_ENABLED, Rig, SWITCH_ON_DISABLED, drive, two_axes};
use ethercat::emulator::DriveOptions;
use serde_json::{Value, json};
use std::time::Instant;

/// Returns a rig with two drives: one whose machine has switches at -5 rad and 5 rad, and one without switches.
fn rig() -> Rig {
    let switched = DriveOptions { limits: Some([-5_000.0, 5_000.0]), ..drive("first", 1000) };
    Rig::with(&[switched, drive("second", 2000)], json!({ "axes": two_axes() }))
}

/// Calls the service while the cycle continues; returns its result.
fn home(rig: &mut Rig, arguments: Value, mut cycle: impl FnMut(&mut Rig)) -> Result<Value, String> {
    let services = rig.driver.services().expect("services");
    let calling = std::thread::spawn(move || services.call("home", &arguments).map_err(|error| error.message));
    let until = Instant::now() + LONG;
    while !calling.is_finished() {
        assert!(Instant::now() < until, "the service answers");
        cycle(rig);
    }
    calling.join().expect("it did not panic")
}

fn idle(rig: &mut Rig) {
    rig.exchange(&[]).unwrap();
}

#[test]
fn the_switch_at_an_end_gets_the_position_that_home_has() {
    let mut rig = rig();
    let arguments = json!({ "axis": "x", "method": 17, "speed": 40.0, "acceleration": 100.0, "position": 0.25 });
    let mut least = f64::INFINITY;
    let watch = |rig: &mut Rig| {
        rig.exchange(&[]).unwrap();
        least = least.min(rig.double("x.position"));
    };
    assert_eq!(home(&mut rig, arguments, watch), Ok(Value::Null));
    assert!(least < -4.9, "it went to the switch: {least}");
    rig.until(&[], "off", |rig| rig.status("x") == SWITCH_ON_DISABLED);
    assert_eq!((rig.double("x.position"), rig.bytes("x.homing")), (0.25, &[2][..]));
    // Afterwards it is a normal axis again, and starts from its present position.
    rig.exchange(&[Some(0.26)]).unwrap();
    assert_eq!(rig.double("x.position"), 0.25);
    rig.until(&[Some(0.26)], "there", |rig| rig.double("x.position") == 0.26);
    assert_eq!(rig.status("x"), OPERATION_ENABLED);
    // An axis that holds without being engaged can be homed too.
    assert_eq!(home(&mut rig, json!({ "axis": "x", "method": 35, "position": 0.0 }), idle), Ok(Value::Null));
    assert_eq!(rig.double("x.position"), 0.0);
}

#[test]
fn an_index_is_found_either_way() {
    for (method, place) in [(33, 0.0), (34, 4096.0)] {
        let mut rig = rig();
        home(&mut rig, json!({ "axis": "y", "method": method, "speed_zero": 5.0, "position": 0.0 }), idle).unwrap();
        rig.exchange(&[]).unwrap();
        // From 2000 counts to a multiple of 4096.
        assert_eq!(rig.double("y.position"), 0.0, "{place}");
        assert_eq!(rig.bytes("y.homing"), [2]);
    }
}

#[test]
fn what_cannot_be_home_is_named() {
    let mut rig = rig();
    let failed = "axis 'y': homing failed: the drive did not find home, has a fault, or was stopped; check its error and its method";
    assert_eq!(home(&mut rig, json!({ "axis": "y", "method": 17 }), idle).unwrap_err(), failed, "it has no switch");
    rig.exchange(&[]).unwrap();
    assert_eq!(rig.bytes("y.homing"), [3]);
    rig.until(&[], "off", |rig| rig.status("y") == SWITCH_ON_DISABLED);
    let engaged = home(&mut rig, json!({ "axis": "x" }), |rig| rig.exchange(&[Some(1.0)]).unwrap()).unwrap_err();
    assert_eq!(engaged, "axis 'x': it is engaged: disable it, then home it");
    rig.exchange(&[]).unwrap();
    let wrong = home(&mut rig, json!({ "axis": "x", "method": 300 }), idle).unwrap_err();
    assert_eq!(wrong, "method must be -128 to 127");
    let slow = home(&mut rig, json!({ "axis": "x", "speed": 0.0 }), idle).unwrap_err();
    assert_eq!(slow, "speed must be 1 to 4294967295 counts, but 0 is 0 counts");
}

#[test]
fn under_a_latched_stop_nothing_goes_home() {
    let mut rig = rig();
    let services = rig.driver.services().expect("services");
    let refused = services.call_moving("home", &json!({ "axis": "x", "method": 35 }), &|| true).unwrap_err().message;
    assert_eq!(refused, format!("axis 'x': {}", device::under_a_stop("home").message));
    rig.exchange(&[]).unwrap();
    rig.driver.safe_state();
    rig.exchange(&[]).unwrap();
    assert_eq!((rig.bytes("x.homing"), rig.status("x")), (&[0][..], SWITCH_ON_DISABLED), "it was not asked");
    assert_eq!(home(&mut rig, json!({ "axis": "x", "method": 35 }), idle), Ok(Value::Null));
}

#[test]
fn a_stop_a_fault_a_limit_of_time_and_a_lost_device_end_it() {
    let slowly = json!({ "axis": "x", "method": 18, "speed": 0.01 });
    let begun = |rig: &mut Rig| {
        rig.exchange(&[]).unwrap();
        rig.bytes("x.homing") == [1] && rig.status("x") == OPERATION_ENABLED
    };
    let mut rig = rig();
    let stopped = home(&mut rig, slowly.clone(), |rig| {
        if begun(rig) {
            rig.driver.safe_state()
        }
    })
    .unwrap_err();
    assert!(stopped.contains("was stopped"), "{stopped}");
    rig.until(&[], "off", |rig| rig.status("x") == SWITCH_ON_DISABLED);

    let failed = home(&mut rig, slowly.clone(), |rig| {
        if begun(rig) {
            rig.server.lock().fail(0, 0x7121)
        }
    })
    .unwrap_err();
    assert!(failed.contains("has a fault"), "{failed}");
    rig.reset();

    let late = json!({ "axis": "x", "method": 18, "speed": 0.01, "timeout_s": 0.05 });
    let late = home(&mut rig, late, idle).unwrap_err();
    assert_eq!(late, "axis 'x': homing did not finish within 0.05 s, so the axis was stopped");
    rig.until(&[], "off", |rig| rig.status("x") == SWITCH_ON_DISABLED);

    // An engaging source expects the axis to follow, so homing stops.
    let engaged = home(&mut rig, slowly.clone(), |rig| {
        if begun(rig) {
            rig.exchange(&[Some(1.0)]).unwrap()
        }
    })
    .unwrap_err();
    assert!(engaged.contains("was stopped"), "{engaged}");
    rig.until(&[], "off", |rig| rig.status("x") == SWITCH_ON_DISABLED);

    let lost = home(&mut rig, slowly, |rig| {
        if rig.exchange(&[]).is_ok() && rig.bytes("x.homing") == [1] {
            rig.server.lock().cut(1);
        }
    });
    assert_eq!(lost.unwrap_err(), "axis 'x': homing ended: the device was lost or closed");
}
