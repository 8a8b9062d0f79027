// SPDX-License-Identifier: Apache-2.0
//! Records damaged in ways that no checksum detects, as the maker of a file can do: they run as far as they make sense, and are refused
//! with an explanation. Nothing panics, neither during replay nor on drop.
//!
//! The bytes of scripts stay intact, and are only lost, repeated and swapped: a script states which cells of a block's memory are
//! written, so a malicious one can write anywhere (docs/replay.md). The target `scripts` of crates/fuzz-targets shows that arbitrary
//! script bytes are read safely.
#[path = "../../supervisor/tests/common/mod.rs"]
mod common;
mod support;
use common::*;
use replay::Item;
use runtime::ClockKind;
use runtime::trace::Entry;
use serde_json::json;
use std::panic::{AssertUnwindSafe, catch_unwind};
use supervisor::Limits;
use support::*;

/// Returns the number of records; the environment variable can raise it.
fn count() -> u64 {
    std::env::var("OPENGPAC_DAMAGED").ok().and_then(|count| count.parse().ok()).unwrap_or(1_000)
}

/// Returns a run with every kind of item.
fn whole() -> Vec<Vec<u8>> {
    let (rig, mut recording) = recorded(ClockKind::Virtual { seed: 1 }, Link::Memory);
    rig.svvs(&["x", "y"]);
    rig.define(busy());
    let places: [&[&str]; 2] = [&["*@rtp0.fast"], &["a@rtp0.fast", "p@rtp1.soft", "b@rtp1.other", "bad@rtp1.other"]];
    let mut items = Vec::new();
    for (place, svv) in places.iter().zip(["x", "y"]) {
        let made = rig.instance("busy", &with_svv(place, svv));
        let _started = rig.try_start(made, json!({"limit": 3.0}), Limits::default());
    }
    let _advanced = rig.system.advance(40_000_000);
    recording.take(&mut items);
    items.iter().map(Item::bytes).collect()
}

struct Numbers(u64);

impl Numbers {
    fn below(&mut self, limit: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mixed = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        ((mixed ^ (mixed >> 27)) % limit.max(1) as u64) as usize
    }
}

fn damaged(whole: &[Vec<u8>], seed: u64) -> Vec<Vec<u8>> {
    let (mut items, mut numbers) = (whole.to_vec(), Numbers(seed));
    for _ in 0..=numbers.below(4) {
        let at = numbers.below(items.len());
        if items[at].is_empty() {
            continue;
        }
        let byte = numbers.below(items[at].len());
        let is_script = matches!(Item::of(&items[at]), Ok(Item::Entry(Entry::Script { .. })));
        match if is_script { 5 + numbers.below(3) } else { numbers.below(8) } {
            0..=2 => items[at][byte] ^= 1 << numbers.below(8),
            3 => items[at][byte] = [0, 1, 127, 128, 255][numbers.below(5)],
            4 => items[at].truncate(byte),
            5 => drop(items.remove(at)),
            6 => items.insert(at, items[numbers.0 as usize % items.len()].clone()),
            _ => {
                let other = numbers.below(items.len());
                items.swap(at, other);
            }
        }
    }
    items
}

/// Plays a record as far as possible, and drops it.
fn play_on(items: &[Vec<u8>]) {
    let mut player = player();
    for bytes in items {
        let Ok(item) = Item::of(bytes) else { break };
        if player.play(&item).is_err() {
            break;
        }
    }
    let names: Vec<String> = player.svvs().map(str::to_owned).collect();
    names.iter().for_each(|name| drop(player.svv(name)));
}

#[test]
fn no_damage_makes_a_replay_panic() {
    let whole = whole();
    let first: u64 = std::env::var("OPENGPAC_DAMAGED_FIRST").ok().and_then(|first| first.parse().ok()).unwrap_or(0);
    let mut panicked = Vec::new();
    for seed in first..first + count() {
        let items = damaged(&whole, seed);
        if catch_unwind(AssertUnwindSafe(|| play_on(&items))).is_err() {
            panicked.push(seed);
        }
    }
    assert_eq!(panicked, [0_u64; 0]);
}
