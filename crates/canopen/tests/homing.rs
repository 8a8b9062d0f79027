// SPDX-License-Identifier: Apache-2.0
//! Homing by the drive, and a load whose brake is operated by the driver.
mod common;
use canopen::emulator::{Bus, NodeOptions};
use common::{COUNTS, OPERATION_ENABLED, Rig, SWITCH_ON_DISABLED, X, Y, two_axes};
use serde_json::{Value, json};
use std::time::{Duration, Instant};

const LONG: Duration = Duration::from_secs(300);

/// Returns a rig with two drives: one whose machine has switches at -5 rad and 5 rad, and one without switches.
fn rig() -> Rig {
    let drive = |name: &str, node, position, limits| NodeOptions { name: name.into(), node, position, limits, ..NodeOptions::default() };
    let bus = Bus::new(&[drive("first", X, 1000, Some([-5_000.0, 5_000.0])), drive("second", Y, 2000, None)]);
    Rig::on(bus, two_axes(), json!({}))
}

/// Calls the service while the cycle continues, and returns its result.
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
    let mut minimum = f64::INFINITY;
    let watch = |rig: &mut Rig| {
        rig.exchange(&[]).unwrap();
        minimum = minimum.min(rig.double("x.position"));
    };
    assert_eq!(home(&mut rig, arguments, watch), Ok(Value::Null));
    assert!(minimum < -4.9, "it went to the switch: {minimum}");
    rig.until(&[], "off", |rig| rig.status("x") == SWITCH_ON_DISABLED);
    assert_eq!((rig.double("x.position"), rig.byte("x.homing")), (0.25, 2));
    // Afterwards it is a normal axis again, and starts from its present position.
    rig.until(&[Some(0.26)], "there", |rig| rig.double("x.position") == 0.26);
    assert_eq!((rig.status("x"), rig.bus.with(|bus| bus.number(X, 0x6061, 0))), (OPERATION_ENABLED, 8));
    assert_eq!(home(&mut rig, json!({ "axis": "x", "method": 35, "position": 0.0 }), idle), Ok(Value::Null), "it holds, and nobody has it engaged");
    assert_eq!(rig.double("x.position"), 0.0);
}

#[test]
fn what_cannot_be_home_is_named() {
    let mut rig = rig();
    let failed = "axis 'y' (node 6): homing failed: the drive did not find home, has a fault, or was stopped; check its error and its method";
    assert_eq!(home(&mut rig, json!({ "axis": "y", "method": 17 }), idle).unwrap_err(), failed, "it has no switch");
    rig.until(&[], "off", |rig| rig.status("y") == SWITCH_ON_DISABLED && rig.byte("y.homing") == 3);
    let engaged = home(&mut rig, json!({ "axis": "x" }), |rig| rig.exchange(&[Some(1.0)]).unwrap()).unwrap_err();
    assert_eq!(engaged, "axis 'x' (node 5): it is engaged: disable it, then home it");
    let slow = home(&mut rig, json!({ "axis": "x", "speed": 0.0 }), idle).unwrap_err();
    assert_eq!(slow, "speed must be 1 to 4294967295 counts, but 0 is 0 counts");
    let lost = home(&mut rig, json!({ "axis": "x", "method": 18, "speed": 0.01 }), |rig| {
        if rig.exchange(&[]).is_ok() && rig.byte("x.homing") == 1 {
            rig.bus.with(|bus| bus.power(X, false));
        }
    });
    assert_eq!(lost.unwrap_err(), "axis 'x' (node 5): homing ended: the device was lost or closed");
}

#[test]
fn under_a_latched_stop_nothing_goes_home() {
    let mut rig = rig();
    let services = rig.driver.services().expect("services");
    let refused = services.call_moving("home", &json!({ "axis": "x", "method": 35 }), &|| true).unwrap_err().message;
    assert_eq!(refused, format!("axis 'x' (node 5): {}", device::under_a_stop("home").message));
    rig.exchange(&[]).unwrap();
    rig.driver.safe_state();
    rig.exchange(&[]).unwrap();
    assert_eq!((rig.byte("x.homing"), rig.status("x")), (0, SWITCH_ON_DISABLED), "it was not asked");
    assert_eq!(home(&mut rig, json!({ "axis": "x", "method": 35 }), idle), Ok(Value::Null));
}

#[test]
fn a_load_never_falls() {
    let drive = NodeOptions { name: "hoist".into(), node: X, position: 1000, falls: Some(50_000.0), ..NodeOptions::default() };
    let brake = json!({ "release_ns": 50_000_000, "close_ns": 30_000_000 });
    let axes = json!([{ "name": "hoist", "node": X, "counts": COUNTS, "speed_max": 10, "brake": brake }]);
    let mut rig = Rig::on(Bus::new(&[drive]), axes, json!({}));
    let watched = |rig: &mut Rig, goals: &[Option<f64>], minimum: f64| {
        rig.exchange(goals).unwrap();
        assert!(rig.double("hoist.position") >= minimum, "it fell to {}", rig.double("hoist.position"));
    };
    for _ in 0..50 {
        watched(&mut rig, &[], 1.0);
    }
    while rig.double("hoist.position") != 1.5 {
        watched(&mut rig, &[Some(1.5)], 1.0);
    }
    // The axis is not engaged: the motor holds it.
    for _ in 0..50 {
        watched(&mut rig, &[], 1.5);
    }
    assert_eq!(rig.status("hoist"), OPERATION_ENABLED);
    rig.driver.safe_state();
    while rig.status("hoist") != SWITCH_ON_DISABLED {
        watched(&mut rig, &[], 1.5);
    }
    for _ in 0..50 {
        watched(&mut rig, &[], 1.5);
    }
    while rig.double("hoist.position") != 1.2 {
        watched(&mut rig, &[Some(1.2)], 1.2);
    }
    // The guard's writes close the brake together with the quick stop.
    let handle = rig.driver.safe_handles().remove(0);
    let socket = std::os::unix::net::UnixDatagram::from(handle.descriptor);
    for (_, frame) in &handle.writes {
        socket.send(frame).unwrap();
    }
    assert_eq!(handle.writes.len(), 3, "control word and target, brake, SYNC");
    assert_eq!(rig.bus.with(|bus| bus.number(X, 0x60FE, 1)), 0, "not yet taken");
    let lost = rig.lost(&[Some(1.2)]).1;
    assert!(lost.contains("has left operation by itself"), "{lost}");
}
