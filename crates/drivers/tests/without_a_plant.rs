// SPDX-License-Identifier: Apache-2.0
//! Drivers without prerequisites: loopback and scripted, and opening drivers in general.
mod common;
use common::Machine;
use serde_json::json;

const MS: i64 = 1_000_000;

fn refused(kind: &str, options: serde_json::Value) -> String {
    drivers::open(kind, &options).err().expect("refused").to_string()
}

#[test]
fn an_unknown_driver_is_refused_with_the_known_ones() {
    let error = refused("profibus", json!({}));
    assert!(error.contains("'profibus'") && drivers::declarations().iter().all(|driver| error.contains(driver.kind)), "{error}");
}

#[test]
fn a_loopback_part_follows_its_effort_while_it_is_claimed() {
    let mut machine = Machine::open("loopback", json!({ "parts": ["a", "b"], "initial": [0.0, 2.0] }));
    machine.set("a.effort", &[0.5]);
    machine.set("b.effort", &[0.5]);
    machine.write(0, &[true, false]);
    machine.read(100 * MS);
    assert_eq!((machine.get("a.position"), machine.get("b.position")), (vec![0.05], vec![2.0]));
    assert_eq!(machine.get("a.velocity"), [0.5]);
    machine.driver.safe_state();
    machine.read(200 * MS);
    assert_eq!(machine.get("a.position"), [0.05]);
    assert_eq!(machine.about["parts"][1]["name"], json!("b"));
}

#[test]
fn a_loopback_device_fails_when_it_is_told_to() {
    let mut machine = Machine::open("loopback", json!({ "parts": ["a"], "nan_at_ns": 5 * MS, "fail_at_ns": 10 * MS }));
    machine.read(4 * MS);
    assert_eq!(machine.get("a.position"), [0.0]);
    machine.read(5 * MS);
    assert!(machine.get("a.position")[0].is_nan());
    assert!(machine.try_read(10 * MS).is_err_and(|e| e.contains("the loopback device fails")));
}

#[test]
fn wrong_options_are_named() {
    assert!(refused("loopback", json!({ "parts": [] })).contains("'parts'"));
    assert!(refused("loopback", json!({ "parts": ["a", "a"] })).contains("twice"));
    assert!(refused("loopback", json!({ "parts": ["a"], "speed": 1 })).contains("speed"));
    assert!(refused("loopback", json!({ "parts": ["a"], "initial": [1, 2] })).contains("'initial'"));
    assert!(refused("mujoco", json!({})).contains("path"));
    let channel = |t: &str| json!({ "channels": [{ "name": "x", "direction": "read", "type": t }] });
    assert!(refused("scripted", channel("complex")).contains("'x'"));
    assert!(refused("scripted", json!({ "channels": [], "table": [{ "at_ns": 0, "values": { "y": 1 } }] })).contains("'y'"));
}

#[test]
fn a_scripted_device_reads_its_table_and_shows_what_is_written() {
    let mut machine = Machine::open(
        "scripted",
        json!({
            "channels": [
                { "name": "force", "direction": "read", "type": "double[3]", "unit": "N" },
                { "name": "button", "direction": "read", "type": "bool" },
                { "name": "lamp", "direction": "write", "type": "double", "safe": 0.25 },
                { "name": "lamp_seen", "direction": "read", "type": "double", "loop_of": "lamp" },
            ],
            "table": [{ "at_ns": 20 * MS, "values": { "force": [1.0, "nan", 3.0], "button": true } }, { "at_ns": 10 * MS, "values": { "force": [4, 5, 6] } }],
        }),
    );
    let channels = machine.driver.channels();
    assert_eq!((channels[0].len, channels[1].len, channels[2].safe.clone()), (24, 1, 0.25f64.to_ne_bytes().to_vec()));
    let button = channels[1].offset;
    machine.read(9 * MS);
    assert_eq!(machine.get("force"), [0.0, 0.0, 0.0]);
    machine.read(10 * MS);
    assert_eq!(machine.get("force"), [4.0, 5.0, 6.0]);
    machine.set("lamp", &[0.75]);
    machine.write(10 * MS, &[true]);
    machine.read(20 * MS);
    assert!(machine.get("force")[1].is_nan() && machine.readings()[button] == 1);
    assert_eq!(machine.get("lamp_seen"), [0.75]);
    machine.driver.safe_state();
    machine.read(21 * MS);
    assert_eq!(machine.get("lamp_seen"), [0.25]);
}
