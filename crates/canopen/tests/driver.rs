// SPDX-License-Identifier: Apache-2.0
//! The driver on an emulated bus in this process: time is a number set by the test, and nothing waits for it.
mod common;
use common::{COUNTS, OPERATION_ENABLED, PERIOD_NS, Rig, SWITCH_ON_DISABLED, X, Y};
use serde_json::json;

#[test]
fn drives_come_to_operation_and_nothing_moves_before_it_is_engaged() {
    let mut rig = Rig::new();
    for _ in 0..100 {
        rig.exchange(&[]).unwrap();
    }
    assert_eq!((rig.double("x.position"), rig.double("y.position")), (1.0, 2.0));
    assert_eq!((rig.status("x"), rig.status("y")), (SWITCH_ON_DISABLED, SWITCH_ON_DISABLED));
    rig.bus.with(|bus| {
        assert_eq!((bus.state(X), bus.state(Y)), ("operational".to_owned(), "operational".to_owned()));
        assert_eq!((bus.number(X, 0x607A, 0), bus.number(Y, 0x607A, 0)), (1000, 2000), "what is commanded is what is measured");
        // Interpolation period: 10 ms = 1 · 10^-2 s.
        assert_eq!((bus.number(X, 0x1006, 0), bus.number(X, 0x1016, 1), bus.number(X, 0x6007, 0)), (10_000, 127 << 16 | 100, 3));
    });
}

#[test]
fn an_axis_follows_its_goal_at_its_maximum_speed_and_holds_where_it_is_left() {
    let mut rig = Rig::new();
    let mut before = 1.0;
    for _ in 0..100 {
        rig.exchange(&[Some(3.0)]).unwrap();
        let position = rig.double("x.position");
        assert!((position - before).abs() <= 0.101, "10 rad/s are 0.1 rad in a cycle, and it went {}", position - before);
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
fn an_axis_takes_velocities_and_torques() {
    let axes = json!([
        { "name": "x", "node": X, "counts": COUNTS, "mode": "velocity", "speed_max": 2 },
        { "name": "y", "node": Y, "counts": COUNTS, "mode": "torque", "rated_torque": 4 }
    ]);
    let mut rig = Rig::of(axes, json!({}));
    for _ in 0..50 {
        rig.exchange(&[Some(5.0), Some(0.4)]).unwrap();
    }
    assert_eq!(rig.double("x.velocity"), 2.0, "no faster than it may");
    assert!((rig.double("y.torque") - 0.4).abs() < 1e-9 && rig.double("y.velocity") > 0.0);
    for _ in 0..3 {
        rig.exchange(&[]).unwrap();
    }
    assert_eq!((rig.double("x.velocity"), rig.status("y")), (0.0, SWITCH_ON_DISABLED));
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
fn a_node_that_is_gone_is_lost_in_the_fourth_cycle_and_joins_again_without_moving() {
    let mut rig = Rig::new();
    rig.until(&[None, Some(2.5)], "there", |rig| rig.double("y.position") == 2.5);
    rig.bus.with(|bus| bus.power(Y, false));
    let (after_ns, lost) = rig.lost(&[None, Some(2.5)]);
    assert_eq!(lost, "node 6 (axis 'y') sent no process data for 3 cycles: its cable is unplugged, or it has no power");
    assert!(after_ns <= 4 * PERIOD_NS, "{after_ns} ns");
    rig.bus.with(|bus| bus.power(Y, true));
    assert_eq!(rig.bus.with(|bus| bus.state(Y)), "pre-operational");
    rig.reset();
    for _ in 0..50 {
        rig.exchange(&[]).unwrap();
    }
    assert_eq!((rig.double("y.position"), rig.status("y")), (2.5, SWITCH_ON_DISABLED));
    rig.until(&[None, Some(2.6)], "there again", |rig| rig.double("y.position") == 2.6);
}

#[test]
fn a_node_that_started_anew_or_was_told_to_leave_is_named_with_its_state() {
    let mut rig = Rig::new();
    rig.exchange(&[]).unwrap();
    rig.bus.with(|bus| (bus.power(X, false), bus.power(X, true)));
    assert_eq!(rig.lost(&[]).1, "node 5 (axis 'x') has restarted: it lost its power, or was reset");
    rig.reset();
    rig.call("nmt", json!({ "axis": "x", "command": "pre_operational" })).unwrap();
    let lost = rig.lost(&[]).1;
    assert!(lost.starts_with("node 5 (axis 'x') sent no process data"), "{lost}");
}

#[test]
fn a_missed_heartbeat_loses_a_node_within_the_declared_time() {
    // Missing process data would be reported earlier.
    let mut rig = Rig::of(common::two_axes(), json!({ "lost_after": 1_000_000 }));
    for _ in 0..50 {
        rig.exchange(&[]).unwrap();
    }
    assert_eq!(rig.counter("heartbeats_missed"), 0);
    rig.bus.with(|bus| bus.power(Y, false));
    let (after_ns, lost) = rig.lost(&[]);
    assert_eq!(lost, "node 6 (axis 'y') missed its heartbeat: its cable is unplugged, or it has no power");
    assert!(after_ns <= canopen::DRIVER.life.lost_within_ns, "{after_ns} ns");
    assert_eq!(rig.counter("heartbeats_missed"), 3);
}

#[test]
fn without_its_controller_a_drive_stops_by_itself() {
    let mut rig = Rig::new();
    rig.until(&[Some(1.0)], "in operation", |rig| rig.status("x") == OPERATION_ENABLED);
    assert_eq!(rig.driver.watchdog_ns(), Some(100_000_000));
    rig.now_ns += 150_000_000;
    let lost = rig.exchange(&[Some(1.0)]).unwrap_err().message;
    assert_eq!(lost, "its nodes stopped by themselves: no command arrived within their timeout of 100 ms");
    assert_eq!((rig.bus.with(|bus| bus.number(X, 0x603F, 0)) as u16, rig.bus.with(|bus| bus.state(X))), (0x8130, "pre-operational".to_owned()));
    rig.reset();
    rig.until(&[Some(1.0)], "in operation again", |rig| rig.status("x") == OPERATION_ENABLED);
}

#[test]
fn a_drive_whose_enable_input_is_open_is_lost_and_does_not_move_when_it_closes() {
    let mut rig = Rig::of(json!([{ "name": "x", "node": X, "counts": COUNTS, "operating_within_s": 0.5 }]), json!({}));
    rig.bus.with(|bus| bus.set_enable_input(X, false));
    let (after_ns, lost) = rig.lost(&[Some(3.0)]);
    let what = "axis 'x' (node 5) did not come into operation within 0.5 s of being enabled: it is in 'switch on disabled', error 0x0000; check its \
                enable input and its supply, then reset the device";
    assert_eq!(lost, what);
    assert!((500_000_000..600_000_000).contains(&after_ns) && rig.byte("x.operating") == 0, "{after_ns} ns");
    rig.driver.safe_state();
    rig.bus.with(|bus| bus.set_enable_input(X, true));
    for _ in 0..50 {
        rig.exchange(&[Some(3.0)]).unwrap();
    }
    assert_eq!((rig.double("x.position"), rig.status("x")), (1.0, SWITCH_ON_DISABLED));
    // Engaged again, it is enabled and follows from its present position.
    rig.exchange(&[None]).unwrap();
    rig.until(&[Some(1.1)], "in operation", |rig| rig.byte("x.operating") == 1);
    rig.bus.with(|bus| bus.set_enable_input(X, false));
    let (_, left) = rig.lost(&[Some(1.1)]);
    assert!(left.starts_with("axis 'x' (node 5) has left operation by itself: it is in 'switch on disabled'"), "{left}");
}

#[test]
fn what_the_guard_writes_is_a_quick_stop() {
    let mut rig = Rig::new();
    rig.until(&[Some(1.0)], "in operation", |rig| rig.status("x") == OPERATION_ENABLED);
    let handle = rig.driver.safe_handles().remove(0);
    let socket = std::os::unix::net::UnixDatagram::from(handle.descriptor);
    for (_, frame) in &handle.writes {
        socket.send(frame).unwrap();
    }
    let (_, lost) = rig.lost(&[Some(1.0)]);
    assert!(lost.starts_with("axis 'x' (node 5) has left operation by itself: it is in "), "{lost}");
}

#[test]
fn lost_and_spoiled_frames_are_counted_and_two_cycles_are_survived() {
    let mut rig = Rig::new();
    rig.exchange(&[]).unwrap();
    // Two PDOs of each of two drives, twice.
    rig.bus.with(|bus| bus.lose(8));
    for _ in 0..4 {
        rig.exchange(&[]).unwrap();
    }
    assert_eq!((rig.counter("frames_lost"), rig.counter("frames_refused")), (4, 0));
    rig.bus.with(|bus| bus.spoil(4));
    for _ in 0..3 {
        rig.exchange(&[]).unwrap();
    }
    assert_eq!((rig.counter("frames_lost"), rig.counter("frames_refused")), (6, 4));
}

#[test]
fn an_adapter_that_left_the_bus_is_named() {
    let mut rig = Rig::new();
    rig.exchange(&[]).unwrap();
    rig.bus.with(|bus| bus.bus_off());
    assert!(rig.lost(&[]).1.contains("the adapter has left the bus (bus off)"));
    assert_eq!(rig.counter("bus_off"), 1);
}

#[test]
fn a_fault_is_named_and_reset() {
    let mut rig = Rig::new();
    rig.until(&[Some(1.0)], "in operation", |rig| rig.status("x") == OPERATION_ENABLED);
    rig.bus.with(|bus| bus.fail(X, 0x7121));
    let (_, fault) = rig.lost(&[Some(1.0)]);
    assert_eq!(fault, "axis 'x' (node 5) has a fault, 0x7121: motor blocked; remove its cause, then reset the device");
    assert_eq!((rig.word("x.error"), rig.counter("emergencies")), (0x7121, 1));
    rig.reset();
    rig.until(&[Some(1.0)], "in operation again", |rig| rig.status("x") == OPERATION_ENABLED);
    // A fault of an axis that is not engaged does not lose the device; the service resets it.
    rig.bus.with(|bus| bus.fail(Y, 0x7121));
    rig.until(&[], "a fault", |rig| rig.status("y") == 0x08);
    rig.call("reset_fault", json!({ "axis": "y" })).unwrap();
    rig.until(&[], "reset", |rig| rig.status("y") == SWITCH_ON_DISABLED && rig.word("y.error") == 0);
}

#[test]
fn a_following_error_of_the_drive_says_where_the_axis_is_and_what_to_change() {
    let mut rig = Rig::new();
    rig.until(&[Some(1.0)], "in operation", |rig| rig.status("x") == OPERATION_ENABLED);
    rig.bus.with(|bus| bus.fail(X, 0x8611));
    let (_, fault) = rig.lost(&[Some(1.0)]);
    for said in
        ["axis 'x' (node 5) has a fault, 0x8611: following error", "; it is at ", "(0x6065) in the drive; move with less speed=", "torque limit (0x6072)"]
    {
        assert!(fault.contains(said), "{fault}");
    }
}

#[test]
fn objects_are_read_and_written_beside_the_cycle() {
    let mut rig = Rig::new();
    let read = |rig: &Rig, index: u32| rig.call("read_object", json!({ "axis": "y", "index": index }));
    assert_eq!(read(&rig, 0x1008).unwrap()["text"], "second");
    assert!(read(&rig, 0x100A).unwrap()["text"].as_str().unwrap().starts_with("emulated node of OpenGPAC"), "in segments");
    rig.exchange(&[]).unwrap();
    rig.call("write_object", json!({ "axis": "y", "index": 0x6065, "value": 777, "bits": 32 })).unwrap();
    assert_eq!(read(&rig, 0x6065).unwrap()["number"], 777);
    rig.call("save", json!({ "axis": "y" })).unwrap();
    assert_eq!(read(&rig, 0x5555).unwrap_err(), "axis 'y' (node 6): it refuses with 0x06020000, the object does not exist");
    assert_eq!(rig.call("read_object", json!({ "axis": "z", "index": 1 })).unwrap_err(), "there is no axis 'z'; the axes are x, y");
    let wrong = rig.call("nmt", json!({ "axis": "x", "command": "go" })).unwrap_err();
    assert_eq!(wrong, "command must be start, stop, pre_operational, reset or reset_communication");
    rig.exchange(&[]).unwrap();
}

#[test]
fn a_scan_finds_nodes_by_number_and_name() {
    let rig = Rig::new();
    let found = device::scan("canopen", &json!({ "interface": rig.interface })).unwrap();
    let what: Vec<&str> = found.iter().map(|found| found.what.as_str()).collect();
    assert_eq!(what.len(), 2);
    assert!(what[0].starts_with("node 5: 'first', profile 402, vendor 0x00006a1c"), "{what:?}");
    assert_eq!(found[1].options["axes"][0]["node"], 6);
}

#[test]
fn wrong_options_are_refused_with_their_remedy() {
    let refused = |axes: serde_json::Value, more: serde_json::Value| common::opened("emulated", &axes, &more).err().expect("refused");
    let axis = |more: serde_json::Value| {
        let mut axis = json!({ "name": "x", "node": 5, "counts": 1000 });
        axis.as_object_mut().unwrap().extend(more.as_object().unwrap().clone());
        json!([axis])
    };
    assert!(refused(axis(json!({ "node": 128 })), json!({})).contains("option 'axes.x.node': it cannot be 128: its range is 1 to 127"));
    assert!(refused(axis(json!({ "node": 127 })), json!({})).contains("127 is the number of this controller (own_node)"));
    assert!(refused(axis(json!({ "counts": 0 })), json!({})).contains("counts cannot be 0"));
    assert!(refused(axis(json!({ "mode": "torque" })), json!({})).contains("needs its rated_torque"));
    assert!(refused(axis(json!({})), json!({ "cycle_ns": 1 })).contains("it cannot be 1 ns: its range is 250 us to 1 s; give 1000000 for 1 ms"));
    assert!(refused(axis(json!({})), json!({ "timeout_ns": 70_000_000_000_i64 })).contains("65.535 s"));
    assert!(refused(json!([]), json!({})).contains("1 to 32 axes"));
    let silent = common::opened("emulated:gone", &axis(json!({})), &json!({})).err().expect("refused");
    assert!(silent.contains("there is no such emulated bus"), "{silent}");
    let rig = Rig::new();
    let silent = common::opened(&rig.interface, &axis(json!({ "node": 9 })), &json!({})).err().expect("refused");
    assert!(silent.starts_with("node 9 (axis 'x') does not answer; check its power"), "{silent}");
}
