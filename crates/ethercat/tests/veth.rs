// SPDX-License-Identifier: Apache-2.0
//! The driver on a network interface: one end of a veth pair, with the emulated segment on the other. Needs the privilege to create a
//! network namespace; the test's thread has its own, which ends with it.
mod common;
use common::{OPERATION_ENABLED, Rig, drive, two_axes};
use serde_json::json;
use std::process::Command;

/// Creates a namespace for this thread and its descendants, with a pair of interfaces.
fn network() {
    // SAFETY: it moves this thread only.
    let moved = unsafe { libc::unshare(libc::CLONE_NEWNET) };
    assert_eq!(moved, 0, "this test makes a network namespace: run it as root, or with CAP_NET_ADMIN and CAP_SYS_ADMIN");
    for arguments in ["link add ec0 type veth peer name ec1", "link set ec0 up", "link set ec1 up"] {
        ip(arguments);
    }
}

fn ip(arguments: &str) {
    let done = Command::new("ip").args(arguments.split(' ')).status().expect("ip, of iproute2, is installed");
    assert!(done.success(), "`ip {arguments}` failed");
}

#[test]
fn a_segment_on_an_interface_moves_and_its_cable_goes_out_and_in() {
    network();
    let mut rig = Rig::on("ec1", "ec0", &[drive("first", 1000), drive("second", 2000)], json!({ "axes": two_axes() }));
    rig.until(&[Some(1.5)], "there", |rig| rig.double("x.position") == 1.5);
    assert_eq!(rig.status("x"), OPERATION_ENABLED);
    ip("link set ec1 down");
    let lost = (0..3).find_map(|_| {
        rig.tell(&[Some(1.6)]);
        rig.read().err()
    });
    let lost = lost.expect("lost within three cycles").message;
    assert!(lost.contains("the cable to 'x' is unplugged"), "{lost}");
    ip("link set ec1 up");
    rig.reset();
    rig.until(&[Some(1.6)], "there again", |rig| rig.double("x.position") == 1.6);
}
