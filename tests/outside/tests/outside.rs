// SPDX-License-Identifier: Apache-2.0
//! Checks that a driver and a code backend of another workspace work like our own, although no line here names them.
use api::{System, call, open};
use serde_json::{Value as Json, json};

fn system() -> System {
    outside::register().expect("nobody else has its name");
    let system = open("outside", "virtual", "{}").expect("it opens");
    say(&system, "processor", json!({ "name": "rtp0" }));
    say(&system, "source", json!({ "processor": "rtp0", "name": "fast", "kind": "timer", "period_ns": 1_000_000, "priority": 80 }));
    system
}

fn say(system: &System, name: &str, arguments: Json) -> Json {
    call(system, name, &arguments.to_string()).unwrap_or_else(|refusals| panic!("{name}: {refusals:?}"))
}

fn refused(system: &System, name: &str, arguments: Json) -> String {
    call(system, name, &arguments.to_string()).expect_err("refused").iter().map(ToString::to_string).collect::<Vec<_>>().join("\n")
}

fn axis(options: Json) -> Json {
    json!({ "processor": "rtp0", "name": "axis", "kind": "outside_axis", "options": options, "source": "rtp0.fast" })
}

fn file(name: &str, text: &str) -> std::path::PathBuf {
    let folder = std::env::temp_dir().join(format!("outside-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let path = folder.join(name);
    std::fs::write(&path, text).unwrap();
    path
}

/// Defines the verb `go`: three times 0.5 m/s to the axis.
fn go(system: &System) -> Json {
    let code = say(system, "download", json!({ "path": file("moves.blocks", "#blocks\ntriple") }));
    assert!(code.to_string().contains("triple"), "{code}");
    let block = |name: &str| json!({ "block": { "subroutine": name } });
    say(
        system,
        "define_verb",
        json!({
            "name": "go",
            "blocks": { "triple": { "block": { "subroutine": "moves.triple" }, "constants": { "u": 0.5 } }, "write": block("library.write_channel") },
            "instantiation_parameters": { "speed": ["write.channel"] },
            "cells": { "v": ["triple.y", "write.u"] },
            "command_lists": { "start": { "commands": [
                { "command": "activate", "block": "triple", "every_ns": 1_000_000 },
                { "command": "activate", "block": "write" },
            ] } },
        }),
    );
    let speed = json!({ "channel": { "device": "axis", "channel": "axis.speed" } });
    say(system, "create", json!({ "verb": "go", "arguments": { "speed": speed }, "placement": { "*": "rtp0.fast" } }))
}

#[test]
fn the_axis_moves_as_the_block_says_and_its_loss_ends_the_verb() {
    let system = system();
    let channels = say(&system, "physical_device", axis(json!({ "travel": 1.0 })));
    assert_eq!(channels["channels"][1]["name"], "axis.speed", "{channels}");
    let instance = go(&system);
    say(&system, "start", json!({ "instance": instance }));
    say(&system, "advance", json!({ "duration_ns": 500_000_000 }));
    let position = || say(&system, "read", json!({ "names": ["axis.axis.position"] }))["values"]["axis.axis.position"]["value"].as_f64().unwrap();
    assert!((position() - 0.75).abs() < 0.01, "1.5 m/s for 0.5 s: {}", position());
    say(&system, "advance", json!({ "duration_ns": 500_000_000 }));
    let report = say(&system, "report", json!({ "instance": instance }));
    assert_eq!(report["condition"], "device_lost", "{report}");
}

#[test]
fn its_options_are_checked_as_those_of_any_driver() {
    let system = system();
    let said = |options| refused(&system, "physical_device", axis(options));
    assert!(said(json!({ "travl": 1.0 })).contains("option 'travl': the driver has no such option; did you mean 'travel'?"));
    assert!(said(json!({})).contains("option 'travel': it is missing; give a number in m: its end of travel"));
    assert!(said(json!({ "travel": -1.0 })).contains("it must lie behind the start"));
    assert!(said(json!({ "travel": 1.0, "timeout_ns": 3 })).contains("its range is 1 ms to"), "the watchdog that every driver has");
    let unknown = refused(&system, "physical_device", json!({ "processor": "rtp0", "name": "a", "kind": "outside_axs", "options": {}, "source": "rtp0.fast" }));
    assert!(unknown.contains("did you mean 'outside_axis'?") && unknown.contains("loopback"), "{unknown}");
}

#[test]
fn an_unknown_file_is_refused_with_every_kind_that_there_is() {
    let system = system();
    let unknown = refused(&system, "download", json!({ "path": file("moves.txt", "triple") }));
    assert!(unknown.contains("a list of blocks (.blocks)") && unknown.contains("a shared object (.so)"), "{unknown}");
    // The kind of a file is determined by its bytes, not by its name.
    say(&system, "download", json!({ "path": file("known.txt", "#blocks\ntriple") }));
    assert!(refused(&system, "download", json!({ "path": file("wrong.blocks", "#blocks\nfour") })).contains("lists 'four'"));
}
