// SPDX-License-Identifier: Apache-2.0
//! The watchdog available to every driver.
use serde_json::json;

const MS: i64 = 1_000_000;

fn position(bytes: &[u8]) -> f64 {
    f64::from_ne_bytes(bytes[..8].try_into().unwrap())
}

#[test]
fn a_device_that_is_not_commanded_goes_to_its_safe_state_and_says_so() {
    let (mut device, about) = drivers::open("loopback", &json!({ "parts": ["x"], "timeout_ns": 50 * MS })).unwrap();
    assert_eq!((device.watchdog_ns(), &about["watchdog_ns"]), (Some(50 * MS), &json!(50 * MS)));
    device.open(0).unwrap();
    let mut readings = [0; 24];
    // At rest the watchdog does not expire.
    device.read(1_000 * MS, &mut readings).unwrap();
    for firing in 1_001..1_010 {
        device.write(firing * MS, &1.0_f64.to_ne_bytes(), &[true]).unwrap();
        device.read((firing + 1) * MS, &mut readings).unwrap();
    }
    device.read(1_059 * MS, &mut readings).unwrap();
    let lost = device.read(5_000 * MS, &mut readings).unwrap_err().message;
    assert!(lost.contains("no command arrived within its timeout of 50 ms"), "{lost}");
    assert!((position(&readings) - 0.059).abs() < 1e-9, "it moved until its timeout was over: {}", position(&readings));
    device.write(5_000 * MS, &1.0_f64.to_ne_bytes(), &[true]).unwrap();
    assert!(device.read(5_001 * MS, &mut readings).is_err(), "until it is opened anew");
}

#[test]
fn a_device_that_was_made_safe_has_nothing_to_time_out() {
    let channels = json!([{ "name": "a.u", "direction": "write", "type": "double", "safe": 0.0 }]);
    let (mut device, _) = drivers::open("scripted", &json!({ "channels": channels, "timeout_ns": 50 * MS })).unwrap();
    device.open(0).unwrap();
    device.write(0, &1.0_f64.to_ne_bytes(), &[true]).unwrap();
    device.safe_state();
    device.read(1_000 * MS, &mut []).unwrap();
    device.write(1_000 * MS, &[0; 8], &[false]).unwrap();
    device.read(2_000 * MS, &mut []).unwrap();
    device.write(2_000 * MS, &[0; 8], &[true]).unwrap();
    assert!(device.read(2_051 * MS, &mut []).is_err());
}

#[test]
fn a_timeout_that_nobody_can_keep_is_refused() {
    for (kind, options) in [("loopback", json!({ "parts": ["x"], "timeout_ns": 10 })), ("scripted", json!({ "channels": [], "timeout_ns": -1 }))] {
        let refused = drivers::open(kind, &options).err().expect("refused").to_string();
        assert!(refused.contains("timeout") && refused.contains("its range is 1 ms to"), "{refused}");
    }
}

#[test]
fn a_device_says_whether_anything_makes_it_safe_when_its_process_is_gone() {
    let register = |write: bool| json!({ "address": "tcp/127.0.0.1:1", "channels": { "x": { "holding": 1, "write": write } } });
    let with = |mut options: serde_json::Value, name: &str, value: serde_json::Value| {
        options[name] = value;
        options
    };
    let cases = [
        ("modbus", register(true), true, true),
        ("modbus", register(false), false, false),
        // The generic watchdog runs in the driver's process.
        ("modbus", with(register(true), "timeout_ns", json!(50 * MS)), true, true),
        ("modbus_server", json!({ "address": "tcp/127.0.0.1:1502", "channels": { "x": { "holding": 1, "write": true } } }), false, false),
        ("loopback", json!({ "parts": ["x"] }), false, false),
        ("loopback", json!({ "parts": ["x"], "timeout_ns": 50 * MS }), false, false),
        ("ur", json!({ "host": "127.0.0.1" }), false, false),
        // Only the guard makes it safe, and a lent host has no guard.
        ("feetech", json!({ "port": "/dev/null", "servos": { "x": { "id": 1 } } }), false, true),
    ];
    for (kind, options, is_unguarded, is_unguarded_without_guard) in cases {
        let (_, about) = drivers::open(kind, &options).unwrap_or_else(|why| panic!("{kind}: {why}"));
        assert_eq!(about["unguarded"] == json!(true), is_unguarded, "{kind} {options}");
        assert_eq!(about[device::UNGUARDED_WITHOUT_GUARD] == json!(true), is_unguarded_without_guard, "{kind} {options}");
    }
}
