// SPDX-License-Identifier: Apache-2.0
//! The driver and a bus on the two ends of a local socket, as in users' tests.
mod common;
use canopen::emulator::serve;
use serde_json::json;

#[test]
fn an_axis_moves_over_a_local_socket_in_the_time_of_its_exchange() {
    let interface = format!("local:test-{}", std::process::id());
    let server = serve(&interface, common::two_drives()).unwrap();
    let mut driver = common::opened(&interface, &common::two_axes(), &json!({ "timeout_ns": 60_000_000_000_i64 })).unwrap();
    let mut readings = vec![0; 512];
    let (goal, engaged) = ([1.5f64.to_ne_bytes(), f64::NAN.to_ne_bytes()].concat(), [true, false]);
    // Enough cycles to block the others if an end does not read its input, as services do between two calls.
    for cycle in 1..=1000 {
        driver.read(cycle * common::PERIOD_NS, &mut readings).unwrap();
        driver.write(cycle * common::PERIOD_NS, &goal, &engaged).unwrap();
    }
    let slot = driver.channels().iter().find(|channel| channel.name == "x.position").map(|channel| channel.offset).unwrap();
    assert_eq!(readings[slot..slot + 8], 1.5f64.to_ne_bytes(), "the same cycle each time: nothing depends on how fast this runs");
    assert_eq!(device::scan("canopen", &json!({ "interface": interface })).unwrap().len(), 2);
    drop(server);
    let gone = driver.read(1001 * common::PERIOD_NS, &mut readings).unwrap_err().message;
    assert!(gone.starts_with(&format!("interface '{interface}'")), "{gone}");
}
