// SPDX-License-Identifier: Apache-2.0
//! Scenarios: faults of blocks, and the resulting states of the verb instance.
use crate::common::*;
use serde_json::json;

#[test]
fn a_fault_names_its_block_and_ends_the_verb() {
    on_both(|rig| {
        for (how, words) in [(1, "returned fault 1"), (2, "panicked"), (3, "not finite")] {
            for (placement, n) in [("*@rtp0.fast", 0), ("other@rtp1.other", 1)] {
                let name = format!("v{how}{n}");
                rig.define(verb(
                    &name,
                    &[("bad", "t.faulty"), ("other", "t.count")],
                    json!({"cells": {"y": ["bad.y"], "o": ["other.y"], "t": ["other.total"]}, "output_values": {"y": "bad.y"}, "conditions": {"fault": {"returns": ["y"], "raises": true}},
                           "input_parameters": {"how": {"targets": ["bad.how"]}},
                           "command_lists": lists(&[("start", &["+bad 1ms", "+other 1ms"])])}),
                ));
                let id = rig.instance(&name, &[placement, "bad@rtp0.fast"]);
                for _ in 0..2 {
                    rig.start_with(id, json!({"how": how}));
                    let report = rig.wait(id);
                    assert_eq!((report.condition.as_str(), report.normal, report.block.as_deref()), ("fault", false, Some("bad")));
                    assert!(report.message.contains(words) && report.message.contains("'bad'"), "{}", report.message);
                    assert_eq!(output(&report, "y"), 3.0, "the invocation that faulted stored nothing");
                }
            }
        }
    });
}

#[test]
fn a_transition_takes_a_fault_and_the_state_is_kept() {
    on_both(|rig| {
        for (placement, n) in [("other@rtp0.fast", 0), ("other@rtp1.other", 1)] {
            let name = format!("v{n}");
            rig.define(verb(
                &name,
                &[("bad", "t.faulty"), ("other", "t.count")],
                json!({"cells": {"y": ["bad.y"], "o": ["other.y"], "t": ["other.total"]}, "output_values": {"y": "bad.y"}, "conditions": {"halted": {"returns": ["y"]}},
                       "initial": "start", "transitions": tau(&["start, fault -> again"]),
                       "command_lists": lists(&[("start", &["+bad 1ms", "+other 1ms"]), ("again", &["+bad 1ms"])])}),
            ));
            let id = rig.instance(&name, &[placement, "bad@rtp0.fast"]);
            rig.start(id);
            rig.advance(10);
            rig.system.halt(id).unwrap();
            let report = rig.wait(id);
            assert_eq!((report.condition.as_str(), report.command_list.as_str(), output(&report, "y")), ("halted", "again", 9.0));
        }
    });
}

#[test]
fn a_fault_of_an_execute_ends_the_verb_before_anything_is_activated() {
    on_both(|rig| {
        rig.define(verb(
            "v",
            &[("bad", "t.faulty"), ("watch", "t.watch")],
            json!({"cells": {"y": ["bad.y", "watch.u"], "w": ["watch.y"]},
                   "input_parameters": {"at": {"targets": ["bad.at"], "default": 0}, "trace": {"targets": ["watch.trace"], "default": 303}},
                   "command_lists": lists(&[("start", &["!bad", "+watch 1ms"])])}),
        ));
        for placement in [&["*@rtp0.fast"][..], &["bad@rtp0.fast", "watch@rtp1.other"][..]] {
            let id = rig.instance("v", placement);
            rig.start(id);
            let report = rig.wait_for(id, 5).expect("it ends at once");
            assert_eq!((report.condition.as_str(), report.time_s - report.started_s), ("fault", 0.0));
            rig.advance(5);
            assert_eq!(seen(303), []);
        }
    });
}
