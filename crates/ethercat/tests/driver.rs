// SPDX-License-Identifier: Apache-2.0
//! The driver on an emulated segment, over a local socket: without privileges or real-time waits.
mod common;
use common::{COUNTS, OPERATION_ENABLED, Rig, SWITCH_ON_DISABLED};
use device::Services;
use ethercat::states::State;
use serde_json::{Value, json};

#[test]
fn a_segment_comes_to_op_and_nothing_moves_before_it_is_engaged() {
    let mut rig = Rig::new();
    for _ in 0..100 {
        rig.exchange(&[]).unwrap();
    }
    assert_eq!((rig.double("x.position"), rig.double("y.position")), (1.0, 2.0));
    assert_eq!((rig.status("x"), rig.status("y")), (SWITCH_ON_DISABLED, SWITCH_ON_DISABLED));
    let segment = rig.server.lock();
    assert_eq!((segment.state(0), segment.state(1)), (Some(State::Op), Some(State::Op)));
    assert_eq!((segment.number(0, 0x607A), segment.number(1, 0x607A)), (1000, 2000), "what is commanded is what is measured");
}

#[test]
fn an_axis_follows_its_goal_at_its_maximum_speed_and_holds_where_it_is_left() {
    let mut rig = Rig::new();
    let mut before = 1.0;
    for _ in 0..1000 {
        rig.exchange(&[Some(3.0)]).unwrap();
        let position = rig.double("x.position");
        assert!((position - before).abs() <= 0.0101, "10 rad/s are 0.01 rad in a cycle, and it went {}", position - before);
        before = position;
    }
    assert_eq!((before, rig.status("x")), (3.0, OPERATION_ENABLED));
    assert_eq!((rig.double("y.position"), rig.status("y")), (2.0, SWITCH_ON_DISABLED), "the other one was not engaged");
    for _ in 0..10 {
        rig.exchange(&[]).unwrap();
    }
    assert_eq!((rig.double("x.position"), rig.status("x")), (3.0, OPERATION_ENABLED));
}

#[test]
fn the_safe_state_is_a_quick_stop_that_lasts_until_somebody_engages_the_axis_anew() {
    let mut rig = Rig::new();
    rig.until(&[Some(1.0)], "in operation", |rig| rig.status("x") == OPERATION_ENABLED);
    rig.driver.safe_state();
    rig.until(&[Some(3.0)], "off", |rig| rig.status("x") == SWITCH_ON_DISABLED);
    for _ in 0..20 {
        rig.exchange(&[Some(3.0)]).unwrap();
    }
    assert_eq!((rig.double("x.position"), rig.status("x")), (1.0, SWITCH_ON_DISABLED));
    rig.exchange(&[]).unwrap();
    rig.until(&[Some(1.1)], "in operation again", |rig| rig.status("x") == OPERATION_ENABLED);
    // It is not engaged and holds its position, as when an emergency stop reaches an axis at standstill.
    rig.exchange(&[]).unwrap();
    assert_eq!(rig.status("x"), OPERATION_ENABLED);
    rig.driver.safe_state();
    rig.until(&[], "off", |rig| rig.status("x") == SWITCH_ON_DISABLED);
    for _ in 0..20 {
        rig.exchange(&[]).unwrap();
    }
    assert_eq!(rig.status("x"), SWITCH_ON_DISABLED);
    rig.until(&[Some(1.2)], "in operation once more", |rig| rig.status("x") == OPERATION_ENABLED);
}

#[test]
fn a_pulled_cable_is_named_in_the_third_cycle() {
    for (cut, named) in [(0, "the cable to 'x' is unplugged"), (1, "axis 'y' at place 1 does not answer")] {
        let mut rig = Rig::new();
        rig.exchange(&[]).unwrap();
        rig.server.lock().cut(cut);
        rig.exchange(&[]).unwrap();
        rig.exchange(&[]).unwrap();
        let lost = rig.exchange(&[]).unwrap_err().message;
        assert!(lost.contains(named), "{lost}");
        rig.server.lock().heal();
        rig.reset();
        rig.exchange(&[]).unwrap();
        assert_eq!(rig.double("y.position"), 2.0);
    }
}

#[test]
fn a_drive_that_was_switched_off_joins_again_and_does_not_move() {
    let mut rig = Rig::new();
    rig.until(&[None, Some(2.5)], "there", |rig| rig.double("y.position") == 2.5);
    rig.server.lock().power(1, false);
    let lost = (0..3).find_map(|_| rig.exchange(&[None, Some(2.5)]).err()).expect("lost within three cycles").message;
    assert!(lost.contains("axis 'y' at place 1 does not answer"), "{lost}");
    rig.server.lock().power(1, true);
    assert_eq!(rig.server.lock().state(1), Some(State::Init));
    rig.reset();
    for _ in 0..50 {
        rig.exchange(&[]).unwrap();
    }
    assert_eq!((rig.double("y.position"), rig.status("y")), (2.5, SWITCH_ON_DISABLED));
    rig.until(&[None, Some(2.6)], "there again", |rig| rig.double("y.position") == 2.6);
}

#[test]
fn a_drive_that_came_back_by_itself_is_named_with_its_state() {
    let mut rig = Rig::new();
    rig.exchange(&[]).unwrap();
    rig.server.lock().power(0, false);
    rig.server.lock().power(0, true);
    let lost = (0..3).find_map(|_| rig.exchange(&[]).err()).expect("lost within three cycles").message;
    assert!(lost.contains("axis 'x' at place 0 does not answer"), "it has no station address any more: {lost}");
}

#[test]
fn lost_and_spoiled_frames_are_counted_and_two_of_them_are_survived() {
    let mut rig = Rig::new();
    rig.exchange(&[]).unwrap();
    rig.server.lock().lose(2);
    rig.exchange(&[]).unwrap();
    rig.exchange(&[]).unwrap();
    rig.exchange(&[]).unwrap();
    assert_eq!(rig.counter("frames_lost"), 2);
    assert_eq!(rig.counter("cycles"), 4);
    rig.server.lock().power(0, true);
}

#[test]
fn a_drive_whose_enable_input_is_open_is_lost_and_does_not_move_when_it_closes() {
    let mut rig = Rig::of(json!([{ "name": "x", "counts": COUNTS, "operating_within_s": 0.05 }]));
    rig.server.lock().set_enable_input(0, false);
    let lost = (0..100).find_map(|_| rig.exchange(&[Some(3.0)]).err()).expect("it is lost").message;
    assert!(lost.starts_with("axis 'x' did not come into operation within 0.05 s of being enabled: it is in 'switch on disabled'"), "{lost}");
    rig.driver.safe_state();
    rig.server.lock().set_enable_input(0, true);
    for _ in 0..50 {
        rig.exchange(&[Some(3.0)]).unwrap();
    }
    assert_eq!((rig.double("x.position"), rig.status("x"), rig.bytes("x.operating")[0]), (1.0, SWITCH_ON_DISABLED, 0));
    rig.exchange(&[]).unwrap();
    rig.until(&[Some(1.1)], "in operation", |rig| rig.bytes("x.operating")[0] == 1);
    rig.server.lock().set_enable_input(0, false);
    let left = (0..3).find_map(|_| rig.exchange(&[Some(1.1)]).err()).expect("it is lost").message;
    assert!(left.starts_with("axis 'x' has left operation by itself"), "{left}");
}

#[test]
fn a_fault_is_named_and_reset() {
    let mut rig = Rig::new();
    rig.until(&[Some(1.0)], "in operation", |rig| rig.status("x") == OPERATION_ENABLED);
    rig.server.lock().fail(0, 0x7121);
    let fault = (0..3).find_map(|_| rig.exchange(&[Some(1.0)]).err()).expect("a fault").message;
    assert_eq!(fault, "axis 'x' has a fault, 0x7121: motor blocked; remove its cause, then reset the device");
    rig.reset();
    rig.until(&[Some(1.0)], "in operation again", |rig| rig.status("x") == OPERATION_ENABLED);
    // A fault of an axis that is not engaged does not lose the device; the service resets it.
    rig.server.lock().fail(1, 0x7121);
    rig.until(&[], "a fault", |rig| rig.status("y") == 0x08);
    call(&*services(&rig), "reset_fault", json!({ "axis": "y" })).unwrap();
    rig.until(&[], "reset", |rig| rig.status("y") == SWITCH_ON_DISABLED);
}

fn services(rig: &Rig) -> std::sync::Arc<dyn Services> {
    rig.driver.services().expect("services")
}

fn call(services: &dyn Services, service: &str, arguments: Value) -> Result<Value, String> {
    services.call(service, &arguments).map_err(|error| error.message)
}

#[test]
fn objects_are_read_and_written_beside_the_cycle() {
    let mut rig = Rig::new();
    let services = services(&rig);
    let read = |index: u32| call(&*services, "read_object", json!({ "axis": "y", "index": index }));
    assert_eq!(read(0x1008).unwrap()["text"], "second");
    assert!(read(0x100A).unwrap()["bytes"].as_array().unwrap().len() > 128, "in segments");
    rig.exchange(&[]).unwrap();
    call(&*services, "write_object", json!({ "axis": "y", "index": 0x6065, "value": 777, "bits": 32 })).unwrap();
    assert_eq!(read(0x6065).unwrap()["number"], 777);
    let word = json!({ "axis": "y", "index": 0x6040, "value": 15, "bits": 16 });
    assert!(services.is_told_of_stops("write_object"));
    let stopped = services.call_moving("write_object", &word, &|| true).unwrap_err().message;
    assert_eq!(stopped, "axis 'y': object 0x6040:0 is its control word, but an emergency stop is latched: remove its cause and reset it first");
    assert_eq!(read(0x5555).unwrap_err(), "axis 'y': object 0x5555:0: the subdevice aborted with 0x06020000, the object does not exist");
    let wrong = call(&*services, "read_object", json!({ "axis": "z", "index": 1 })).unwrap_err();
    assert_eq!(wrong, "there is no axis 'z'; the axes are x, y");
    rig.exchange(&[]).unwrap();
}

#[test]
fn velocity_and_torque_move_an_axis_too() {
    let axes = json!([{ "name": "belt", "mode": "velocity", "unit": "m", "counts": COUNTS }, { "name": "winch", "mode": "torque", "counts": COUNTS, "rated_torque": 2.0, "pdos": "device" }]);
    let mut rig = Rig::of(axes);
    rig.until(&[Some(5.0), Some(1.0)], "both move", |rig| rig.double("belt.position") > 1.5 && rig.double("winch.position") > 2.1);
    assert_eq!((rig.double("belt.velocity"), rig.double("winch.torque")), (5.0, 1.0));
    rig.until(&[], "both rest", |rig| rig.double("belt.velocity") == 0.0 && rig.status("winch") == SWITCH_ON_DISABLED);
}

#[test]
fn a_scan_lists_what_is_there_and_changes_nothing() {
    let mut rig = Rig::new();
    let found = device::scan("ethercat", &json!({ "interface": rig.interface })).unwrap();
    assert_eq!(found[1].what, "1: 'second', vendor 0x00006a1c, product 0x00000402, revision 0x00000001, serial 2");
    rig.exchange(&[]).unwrap();
    assert_eq!(rig.server.lock().state(0), Some(State::Op));
}

#[test]
fn wrong_options_are_refused_with_what_to_do() {
    let _ = device::register(&ethercat::DRIVER);
    let refused = |axes: Value| device::open("ethercat", &json!({ "interface": "local:x", "axes": axes })).err().expect("refused").to_string();
    assert!(refused(json!([])).contains("name at least one axis"));
    assert!(refused(json!([{ "name": "x", "counts": 0 }])).contains("give the number of counts per unit"));
    assert!(refused(json!([{ "name": "x", "counts": 1 }, { "name": "x", "counts": 1 }])).contains("'x' is named twice"));
    assert!(refused(json!([{ "name": "x", "counts": 1 }, { "name": "y", "counts": 1, "at": 0 }])).contains("'x' and 'y' are both at place 0"));
    assert!(refused(json!([{ "name": "x", "counts": 1, "mode": "torque" }])).contains("needs its rated_torque"));
    let (mut driver, _) = device::open("ethercat", &json!({ "interface": "none0", "axes": [{ "name": "x", "counts": 1 }] })).unwrap();
    let error = driver.open(0).unwrap_err().message;
    assert!(error.starts_with("interface 'none0' cannot be opened"), "{error}");
}

#[test]
fn drives_whose_commands_stay_away_stop_by_themselves() {
    let mut rig = Rig::new();
    rig.until(&[Some(1.0)], "in operation", |rig| rig.status("x") == OPERATION_ENABLED);
    rig.pass_by(150_000_000);
    let lost = (0..3).find_map(|_| rig.exchange(&[Some(1.0)]).err()).expect("lost within three cycles").message;
    assert!(lost.contains("axis 'x' has a fault, 0x8130: communication was lost"), "{lost}");
    let status = rig.server.lock().status(1);
    assert!(status.contains("SAFEOP with error 0x001b, SyncManager watchdog"), "{status}");
}

#[test]
fn an_axis_without_a_limit_of_speed_is_commanded_twice_at_one_time() {
    let mut rig = Rig::of(json!([{ "name": "x", "counts": COUNTS }]));
    rig.until(&[Some(1.0)], "in operation", |rig| rig.status("x") == OPERATION_ENABLED);
    for goal in [f64::MAX, f64::MIN] {
        rig.write_again(goal);
    }
    assert_eq!(rig.server.lock().number(0, 0x607A), 1000, "no time has gone by");
}

#[test]
fn a_drive_whose_main_device_is_gone_stops_by_itself() {
    let interface = format!("local:gone-{}", std::process::id());
    let server = ethercat::emulator::serve(&interface, ethercat::emulator::Segment::new(&[common::drive("first", 1000)])).unwrap();
    let _ = device::register(&ethercat::DRIVER);
    let axes = json!([{ "name": "x", "counts": COUNTS }]);
    let options = json!({ "interface": interface, "axes": axes, "timeout_ns": 500_000_000, "lost_after": 60_000 });
    let (mut driver, _) = device::open("ethercat", &options).unwrap();
    driver.open(0).unwrap();
    assert!(server.lock().status(0).starts_with("OP"), "{}", server.lock().status(0));
    // As after a kill: no safe state, and no further frame.
    std::mem::forget(driver);
    let until = std::time::Instant::now() + common::LONG;
    while !server.lock().status(0).contains("SyncManager watchdog") {
        assert!(std::time::Instant::now() < until, "{}", server.lock().status(0));
        std::thread::yield_now();
    }
}
