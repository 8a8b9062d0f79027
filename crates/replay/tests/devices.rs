// SPDX-License-Identifier: Apache-2.0
//! Readings of devices come from the record: no plant is needed to rerun a servo, or a lost device.
#[path = "../../supervisor/tests/common/mod.rs"]
mod common;
mod support;
use common::*;
use replay::Item;
use runtime::ClockKind;
use serde_json::{Value as Json, json};
use std::time::Duration;
use supervisor::{DeviceRequest, WaitResult};
use support::*;

/// Records a servo on a loopback device that is pushed for 20 ms.
fn pushed(options: Json) -> (Vec<Item>, f64) {
    let (rig, mut recording) = recorded(ClockKind::Virtual { seed: 5 }, Link::Memory);
    let mut all = json!({"parts": ["j1"], "initial": [0.5]});
    options.as_object().unwrap().iter().for_each(|(key, value)| all[key] = value.clone());
    rig.system.physical_device("rtp0", "arm", "loopback", &all, "rtp0.fast", None).unwrap_or_else(|r| panic!("{}", text(&r)));
    rig.define(verb(
        "servo",
        &[("read", "t.read_channel"), ("drive", "t.drive"), ("watch", "t.watch")],
        json!({"instantiation_parameters": {"drive.position": ["read.channel"], "drive.effort": ["drive.channel"], "sensed": ["read.y"], "commanded": ["watch.u"]},
               "cells": {"effort": ["watch.y", "drive.u"]},
               "command_lists": lists(&[("start", &["!read", "+read 1ms", "+watch 1ms", "+drive 1ms", "ready"])])}),
    ));
    rig.device_type(json!({"name": "Joint", "verb": "servo",
        "svvs": {"sensed": {"type_text": "double", "unit": "rad"}, "commanded": {"type_text": "double", "initial": {"copy_of": "sensed"}}}}));
    let request = json!({"device_type": "Joint", "source": "rtp0.fast", "arguments": {"drive": {"part": {"device": "arm", "part": "j1"}}}});
    let request: DeviceRequest = serde_json::from_value(request).unwrap();
    rig.system.device("j1", request).unwrap_or_else(|r| panic!("{}", text(&r)));
    rig.system.enable("j1").unwrap_or_else(|r| panic!("{}", text(&r)));
    let until_ns = Some(rig.system.now_ns() + 1_000 * MS);
    assert!(matches!(rig.system.wait_enabled("j1", until_ns, Duration::from_secs(60)).unwrap(), WaitResult::Done(true)));
    rig.advance(20);
    let sensed = rig.read("j1.sensed");
    rig.system.close();
    let mut items = Vec::new();
    recording.take(&mut items);
    (items, sensed)
}

#[test]
fn a_servo_runs_again_without_its_plant() {
    let (items, sensed) = pushed(json!({}));
    let (firings, values) = play(&items).unwrap();
    assert!(firings >= 20);
    let (_, again) = values.iter().find(|(name, _)| name == "j1.sensed").unwrap();
    assert_eq!(again.as_slice(), sensed.to_le_bytes());
    assert!(sensed > 0.5, "{sensed}: it moved");
}
