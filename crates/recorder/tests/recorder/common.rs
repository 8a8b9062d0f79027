// SPDX-License-Identifier: Apache-2.0
//! A system with a wave, a scratch file, and the values of a recording.
use interconnect::Memory;
use model::configuration::SourceKind;
use model::definition::{Application, Verb};
use recorder::Recording;
use runtime::ClockKind;
use serde_json::{Value as Json, json};
use std::path::PathBuf;
use supervisor::{Limits, SvvRequest, System};

pub const MS: i64 = 1_000_000;

/// Returns a system with a timer of 1 kHz and a verb `wave` that writes an SVV.
pub fn system() -> System {
    let system = System::new("cell", ClockKind::Virtual { seed: 1 }, Box::new(Memory)).expect("a system");
    system.processor("rtp0", None, true).unwrap();
    system.source("rtp0", "fast", SourceKind::Timer { period_ns: 1_000_000 }, 80, 0).unwrap();
    let verb: Verb = serde_json::from_value(json!({
        "name": "wave",
        "blocks": { "wave": { "block": { "subroutine": "library.signal_generator" }, "constants": { "shape": 1, "frequency": 5.0 } } },
        "instantiation_parameters": { "y": ["wave.y"] },
        "command_lists": { "start": { "commands": [{ "command": "activate", "block": "wave", "every_ns": 1_000_000 }] } },
    }))
    .unwrap();
    system.define_verb(verb).unwrap();
    system
}

pub fn svv(system: &System, name: &str, request: Json) {
    let request: SvvRequest = serde_json::from_value(request).unwrap();
    system.svv(name, &request, None).unwrap();
}

pub fn wave(system: &System, svv: &str) -> u64 {
    let application: Application =
        serde_json::from_value(json!({ "verb": "wave", "arguments": { "y": { "svv": svv } }, "placement": { "*": "rtp0.fast" } })).unwrap();
    let id = system.create(&application).unwrap();
    system.start(id, &Default::default(), Limits::default()).unwrap();
    id
}

/// An unused path; its file is deleted on drop.
pub struct Scratch(pub PathBuf);

impl Scratch {
    pub fn new(name: &str) -> Scratch {
        let path = std::env::temp_dir().join(format!("opengpac-recording-{}-{name}.mcap", std::process::id()));
        let _absent = std::fs::remove_file(&path);
        Scratch(path)
    }

    pub fn read(&self) -> Recording {
        Recording::open(&self.0).unwrap_or_else(|why| panic!("{}", why[0]))
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        let _gone = std::fs::remove_file(&self.0);
    }
}

pub fn values(recording: &Recording, name: &str) -> Vec<f64> {
    recording.series[name].bytes.chunks(8).map(|value| f64::from_le_bytes(value.try_into().unwrap())).collect()
}
