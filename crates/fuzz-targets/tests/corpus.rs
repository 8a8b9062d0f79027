// SPDX-License-Identifier: Apache-2.0
//! Corpus of each fuzzer, unchanged and with random mutations: a few seconds of the work that `make faults` does for ten minutes per
//! fuzzer.
use fuzz_targets::{TARGETS, Target};
use std::path::Path;

/// Number of mutated inputs per target.
const CHANGED: usize = 4_000;
/// Number of mutated inputs for the control interface; fewer, because each creates and serves a system.
const CHANGED_CONTROL: usize = 150;

fn corpus(name: &str) -> Vec<Vec<u8>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("corpus").join(name);
    let mut files: Vec<_> = std::fs::read_dir(&folder).expect("each target has a corpus").map(|entry| entry.expect("it can be read").path()).collect();
    files.sort();
    files.iter().map(|file| std::fs::read(file).expect("it can be read")).collect()
}

/// Generator of pseudo-random numbers, which are the same in each run.
struct NumberGenerator(u64);

impl NumberGenerator {
    fn below(&mut self, bound: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 % bound.max(1) as u64) as usize
    }
}

/// Makes one to four changes: modifies a byte or a bit, or removes, repeats or inserts a piece, possibly from another input.
fn change(chosen: &mut NumberGenerator, corpus: &[Vec<u8>]) -> Vec<u8> {
    let mut bytes = corpus[chosen.below(corpus.len())].clone();
    for _ in 0..=chosen.below(4) {
        let at = chosen.below(bytes.len());
        let end = (at + 1 + chosen.below(24)).min(bytes.len());
        match chosen.below(5) {
            _ if bytes.is_empty() => bytes.push(0),
            0 => bytes[at] = chosen.below(256) as u8,
            1 => bytes[at] ^= 1 << chosen.below(8),
            2 => drop(bytes.drain(at..end)),
            3 => {
                let piece = bytes[at..end].to_vec();
                bytes.splice(at..at, piece);
            }
            _ => {
                let other = &corpus[chosen.below(corpus.len())];
                let from = chosen.below(other.len());
                let piece = other[from..(from + 24).min(other.len())].to_vec();
                bytes.splice(at..end, piece);
            }
        }
    }
    bytes
}

fn hold(name: &str, changed: usize) {
    let target: Target = TARGETS.iter().find(|(known, _)| *known == name).expect("it is a target").1;
    let corpus = corpus(name);
    assert!(!corpus.is_empty());
    for input in &corpus {
        target(input);
    }
    let mut chosen = NumberGenerator(0x9e37_79b9_7f4a_7c15);
    for _ in 0..changed {
        target(&change(&mut chosen, &corpus));
    }
}

#[test]
fn packets_hold() {
    hold("packets", CHANGED);
}

#[test]
fn types_hold() {
    hold("types", CHANGED);
}

#[test]
fn definitions_hold() {
    hold("definitions", CHANGED);
}

#[test]
fn modules_hold() {
    hold("modules", CHANGED);
}

#[test]
fn frames_hold() {
    hold("frames", CHANGED);
}

#[test]
fn parcels_hold() {
    hold("parcels", CHANGED);
}

#[test]
fn control_holds() {
    hold("control", CHANGED_CONTROL);
}

#[test]
fn journal_holds() {
    hold("journal", CHANGED);
}

#[test]
fn recordings_hold() {
    hold("recordings", CHANGED);
}

#[test]
fn every_target_is_tested_and_has_a_corpus() {
    let text = include_str!("corpus.rs");
    for (name, _) in TARGETS {
        assert!(text.contains(&format!("hold(\"{name}\",")), "{name}");
        assert!(!corpus(name).is_empty(), "{name}");
    }
}

#[test]
fn canopen_holds() {
    hold("canopen", CHANGED);
}

#[test]
fn ethercat_holds() {
    hold("ethercat", CHANGED);
}

#[test]
fn modbus_holds() {
    hold("modbus", CHANGED);
}

#[test]
fn servos_hold() {
    hold("servos", CHANGED);
}

#[test]
fn text_holds() {
    hold("text", CHANGED);
}

#[test]
fn rtde_holds() {
    hold("rtde", CHANGED);
}
