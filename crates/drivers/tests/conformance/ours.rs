// SPDX-License-Identifier: Apache-2.0
//! The drivers that ship with OpenGPAC, and the example in C.
use crate::{built, checked};
use serde_json::{Value, json};
use std::io::{BufRead, BufReader, Write};
use std::net::TcpListener;
use std::path::Path;

/// Checks that a driver passes every check.
#[track_caller]
fn passes(kind: &str, options: &Value) {
    let report = checked(kind, options);
    assert!(report.failed().is_empty(), "{report}");
    assert!(report.outcomes.len() >= 40, "{report}");
}

#[test]
fn loopback() {
    passes("loopback", &json!({ "parts": ["a", "b"], "initial": [0.5, 1.0], "slew": 2.0 }));
}

#[test]
fn scripted() {
    let channels = json!([
        { "name": "io.button", "direction": "read", "type": "bool" },
        { "name": "io.lamp", "direction": "write", "type": "bool", "safe": true },
        { "name": "io.force", "direction": "read", "type": "double[3]", "unit": "N" },
        { "name": "io.goal", "direction": "write", "type": "double" }
    ]);
    passes("scripted", &json!({ "channels": channels, "table": [{ "at_ns": 5_000_000, "values": { "io.button": true } }] }));
}

#[test]
fn plant_process() {
    let inner = json!({ "kind": "loopback", "options": { "parts": ["a"] } });
    passes(
        "plant_process",
        &json!({ "driver": inner, "command": [env!("CARGO_BIN_EXE_opengpac-plant")], "silent_ns": 60_000_000_000_i64, "linger_ns": 1_000_000_000 }),
    );
}

#[test]
fn mujoco() {
    let Some(library) = std::env::var_os("OPENGPAC_MUJOCO").filter(|library| Path::new(library).is_dir()) else { return };
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../python/opengpac/robots/ur5e.xml");
    passes("mujoco", &json!({ "path": path, "library": library.to_string_lossy() }));
}

/// Returns a loopback address unique to one test, so that its port is free.
fn address(test: u8) -> String {
    let process = std::process::id();
    format!("tcp/127.{test}.{}.{}:15020", process / 250 % 250, process % 250 + 1)
}

#[test]
fn modbus_server() {
    let channels =
        json!({ "wanted": { "holding": 100, "type": "double" }, "place": { "input": 0, "type": "int32", "scale": 0.001, "write": true, "safe": -1.0 } });
    passes("modbus_server", &json!({ "address": address(101), "channels": channels }));
}

#[test]
fn modbus() {
    let offered = json!({ "wanted": { "holding": 100, "type": "double" }, "place": { "input": 0, "type": "int32", "scale": 0.001, "write": true } });
    let server = json!({ "address": address(102), "channels": offered, "period_ns": 100_000, "clients": 64 });
    let (mut server, _) = drivers::open("modbus_server", &server).expect("its options are right");
    server.open(0).expect("it listens");
    let channels = json!({ "wanted": { "holding": 100, "type": "double", "write": true }, "place": { "input": 0, "type": "int32", "scale": 0.001 } });
    passes("modbus", &json!({ "address": address(102), "channels": channels, "answer_ns": 30_000_000_000_i64 }));
    server.close();
}

#[test]
fn text() {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port is free");
    let address = format!("tcp/{}", listener.local_addr().expect("it is bound"));
    // Emulates a scale for each connection; the thread ends with the program.
    std::thread::spawn(move || {
        for stream in listener.incoming().map_while(Result::ok) {
            std::thread::spawn(move || {
                let lines = BufReader::new(stream.try_clone().expect("it is open")).lines();
                let asked = lines.map_while(Result::ok).filter(|line| line == "P");
                asked.take_while(|_| (&stream).write_all(b"ST,12.5 kg\r\n").is_ok()).for_each(drop)
            });
        }
    });
    let fields = json!({ "weight": { "unit": "kg" }, "stable": { "when": "ST" }, "setpoint": { "safe": 0.0 } });
    passes(
        "text",
        &json!({ "address": address, "asks": "P", "reads": ["{stable},{weight} kg"], "writes": ["SP {setpoint}"], "fields": fields, "answer_ns": 60_000_000_000_i64 }),
    );
}

#[test]
fn canopen() {
    let axes = json!([{ "name": "x", "node": 5, "counts": 1000, "speed_max": 5 }, { "name": "y", "node": 6, "counts": 1000, "mode": "velocity" }]);
    passes("canopen", &json!({ "interface": "emulated", "axes": axes }));
}

#[test]
fn ethercat() {
    use ethercat::emulator::{DriveOptions, Segment, serve};
    let interface = format!("local:conformance-{}", std::process::id());
    let names = ["x", "belt", "winch"];
    let drives = names.map(|name| DriveOptions { name: name.into(), watchdog: Some(false), ..DriveOptions::default() });
    let _segment = serve(&interface, Segment::new(&drives)).expect("nobody has that name");
    let axes = json!([
        { "name": "x", "counts": 1e4, "speed_max": 5.0 },
        { "name": "belt", "counts": 1e4, "mode": "velocity" },
        { "name": "winch", "counts": 1e4, "mode": "torque", "rated_torque": 1.0 }
    ]);
    // The segment is a program and the kit does not wait for it, so the device must never be lost.
    passes("ethercat", &json!({ "interface": interface, "axes": axes, "lost_after": 1_000_000_000 }));
}

#[test]
fn the_example_in_c() {
    let source = std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/drivers/conveyor.c")).expect("it is there");
    assert!(source.lines().count() <= 60);
    passes(&format!("conveyor@{}", built("conveyor", &source).display()), &json!({}));
}

#[test]
fn what_is_no_driver_fails_the_first_check() {
    let report = checked("no_such", &json!({}));
    assert_eq!(report.failed().len(), 1);
    assert!(report.to_string().contains("no driver 'no_such'"), "{report}");
}
