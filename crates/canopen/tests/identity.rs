// SPDX-License-Identifier: Apache-2.0
//! Nodes that differ from the first opening or from the options are named, and nothing is configured.
mod common;
use canopen::emulator::{Bus, NodeOptions};
use common::{Rig, X, Y, two_axes};
use serde_json::{Value, json};

fn drives(x: u32, y: u32) -> Bus {
    let drive = |name: &str, node, serial| NodeOptions { name: name.into(), node, serial: Some(serial), ..NodeOptions::default() };
    Bus::new(&[drive("first", X, x), drive("second", Y, y)])
}

fn with_serial(serial: u32) -> Value {
    let mut axes = two_axes();
    axes[0]["serial"] = serial.into();
    axes
}

#[test]
fn nodes_whose_numbers_were_exchanged_are_named_and_not_configured() {
    let mut rig = Rig::on(drives(70, 80), two_axes(), json!({}));
    rig.exchange(&[]).unwrap();
    rig.put(drives(80, 70));
    let refused = rig.open_again(two_axes()).expect_err("swapped");
    assert!(refused.contains("node 5 (axis 'x') is a different device than when it was first opened"), "{refused}");
    assert!(refused.contains("serial 80, and was") && refused.contains("connected as node 6 (axis 'y'): the two are swapped"), "{refused}");
    rig.put(drives(70, 80));
    rig.open_again(two_axes()).expect("as before");
    rig.put(drives(90, 80));
    let refused = rig.open_again(two_axes()).expect_err("another one");
    assert!(refused.contains("give its option serial (90)"), "{refused}");
    rig.open_again(with_serial(90)).expect("replaced on purpose");
}

#[test]
fn the_serial_number_of_the_options_is_compared() {
    let mut rig = Rig::on(drives(70, 80), with_serial(70), json!({}));
    rig.exchange(&[]).unwrap();
    let refused = rig.open_again(with_serial(80)).expect_err("another one");
    assert!(refused.contains("its serial is 70 (0x46), not 80 (0x50); the right one is connected as node 6 (axis 'y')"), "{refused}");
}
