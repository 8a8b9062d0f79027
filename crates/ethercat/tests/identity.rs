// SPDX-License-Identifier: Apache-2.0
//! Drives that have moved or differ from the options are named, and nothing is switched on.
mod common;
use common::{COUNTS, Rig, SWITCH_ON_DISABLED, drive, two_axes};
use ethercat::emulator::{DriveOptions, PRODUCT, VENDOR};
use ethercat::states::State;
use serde_json::{Value, json};

fn axes(x: Value) -> Value {
    let mut axes = two_axes();
    for (option, value) in x.as_object().expect("a table") {
        axes[0][option] = value.clone();
    }
    axes
}

#[test]
fn drives_that_were_swapped_are_named_and_stay_off_until_they_are_back() {
    let mut rig = Rig::new();
    rig.exchange(&[]).unwrap();
    rig.server.lock().swap(0, 1);
    assert!((0..3).any(|_| rig.exchange(&[]).is_err()), "its drives were without voltage");
    let refused = rig.refusal();
    assert!(refused.contains("axis 'x' at place 0 is a different device than when it was first opened: it is vendor"), "{refused}");
    assert!(refused.contains("serial 2, and was"), "{refused}");
    assert!(refused.contains("the right one is connected as axis 'y' at place 1: the two are swapped"), "{refused}");
    assert_eq!(rig.server.lock().state(0), Some(State::Init), "nothing was switched on");
    rig.server.lock().swap(0, 1);
    rig.reset();
    rig.exchange(&[]).unwrap();
    assert_eq!((rig.double("x.position"), rig.status("x")), (1.0, SWITCH_ON_DISABLED));
}

#[test]
fn a_drive_that_was_replaced_is_taken_when_its_serial_number_is_given() {
    let mut rig = Rig::with(&[drive("first", 1000), drive("second", 2000), drive("spare", 3000)], json!({ "axes": two_axes() }));
    rig.exchange(&[]).unwrap();
    rig.server.lock().swap(0, 2);
    let refused = rig.refusal();
    assert!(refused.contains("give its option serial (3) or restart the program"), "{refused}");
    rig.set_axes(axes(json!({ "serial": 3 })));
    rig.reset();
    rig.exchange(&[]).unwrap();
    assert_eq!(rig.double("x.position"), 3.0);
}

#[test]
fn a_drive_is_compared_with_each_number_of_its_options() {
    let drives = [DriveOptions { serial: Some(77), alias: 12, ..drive("first", 1000) }, drive("second", 2000)];
    let right = json!({ "vendor": VENDOR, "product": PRODUCT, "revision": 1, "serial": 77, "alias": 12 });
    let mut rig = Rig::with(&drives, json!({ "axes": axes(right) }));
    rig.exchange(&[]).unwrap();
    for (option, is) in [("vendor", VENDOR), ("product", PRODUCT), ("revision", 1), ("serial", 77), ("alias", 12)] {
        let mut wrong = json!({});
        wrong[option] = 999.into();
        rig.set_axes(axes(wrong));
        let refused = rig.refusal();
        let said = format!("axis 'x' at place 0 does not match its options: its {option} is {is} ({is:#x}), not 999");
        assert!(refused.contains(&said), "{refused}");
    }
    rig.set_axes(json!([{ "name": "x", "counts": COUNTS, "serial": 2 }, { "name": "y", "counts": COUNTS }]));
    assert!(rig.refusal().contains("the right one is connected as axis 'y' at place 1: the two are swapped"));
}
