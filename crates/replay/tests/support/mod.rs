// SPDX-License-Identifier: Apache-2.0
//! Systems that are recorded, and records that are replayed.
#![allow(dead_code, reason = "each test file uses its part")]
use crate::common::*;
use kernel::Occasion;
use opengpac::abi::Descriptor;
use replay::{Codes, Item, Player, Recording};
use runtime::ClockKind;
use runtime::encoding::CodeName;
use runtime::trace::Entry;
use serde_json::{Value as Json, json};
use std::any::Any;
use std::collections::HashMap;
use std::ffi::CStr;
use std::sync::Arc;

/// Cost of a firing under the virtual clock, so that sources of higher priority begin inside it.
pub const COST_NS: u64 = 1_500_000;

/// Code of the rig's blocks.
pub struct Code(HashMap<String, &'static Descriptor>);

impl Code {
    pub fn of_rig() -> Code {
        Code(all().into_iter().map(|block| (name(block), block)).collect())
    }

    /// Replaces a block with another one.
    pub fn with(mut self, name: &str, other: &str) -> Code {
        let other = self.0[other];
        self.0.insert(name.to_owned(), other);
        self
    }
}

fn name(block: &'static Descriptor) -> String {
    // SAFETY: a descriptor's name is a string that lives as long as its module.
    unsafe { CStr::from_ptr(block.name) }.to_str().unwrap().to_owned()
}

impl Codes for Code {
    fn load(&mut self, _: &str, name: &str, _: &[u8]) -> Result<(), String> {
        Err(format!("module '{name}' is none of the rig's"))
    }

    fn find(&self, name: &CodeName) -> Option<(&'static Descriptor, Arc<dyn Any + Send + Sync>)> {
        self.0.get(&name.block).map(|found| (*found, Arc::new(()) as Arc<dyn Any + Send + Sync>))
    }
}

/// Creates a rig whose run is recorded.
pub fn recorded(clock: ClockKind, link: Link) -> (Rig, Recording) {
    let mut recording = None;
    let rig = Rig::begun(clock, link, COST_NS, |system| {
        let begin = |names: runtime::trace::CodeNames| {
            system.record(Box::new(move |block| names(block).or_else(|| Some(CodeName { module: "t".into(), block: block.code_name().into() }))))
        };
        recording = Some(Recording::begin(begin).unwrap_or_else(|refusals| panic!("{}", text(&refusals))));
    });
    (rig, recording.unwrap())
}

pub fn player() -> Player {
    Player::new(Box::new(Code::of_rig()))
}

/// Fingerprint of a replay, and the last values by name.
pub type PlayedRun = (u64, Vec<(String, Vec<u8>)>);

/// Replays a record; returns the number of firings, and the final values of the SVVs. Fails at the first deviation.
pub fn play(items: &[Item]) -> Result<PlayedRun, String> {
    let mut player = player();
    for item in items {
        let moment = player.play(item).map_err(|why| why.to_string())?;
        if let Some(moment) = moment.filter(|moment| !moment.same) {
            return Err(format!("{moment:?} of '{}' is not the same", player.name(moment.source)));
        }
    }
    let mut names: Vec<String> = player.svvs().map(str::to_owned).collect();
    names.sort();
    let values = names.iter().filter_map(|name| player.svv(name)).map(|svv| (svv.name, svv.bytes)).collect();
    Ok((player.firings(), values))
}

pub fn is_firing(item: &Item) -> bool {
    matches!(item, Item::Entry(Entry::Stretch(_, stretch)) if stretch.occasion == Occasion::Firing)
}

/// Returns the parts that two records of the same run share: all events and all computed values.
pub fn outline(items: &[Item]) -> Vec<String> {
    items.iter().filter(|item| matches!(item, Item::Entry(Entry::Stretch(..)))).map(|item| format!("{item:?}")).collect()
}

/// Returns a verb with blocks in several sources, waits, conditions, executes and a fault.
pub fn busy() -> Json {
    verb(
        "busy",
        &[("a", "t.count"), ("b", "t.count"), ("p", "t.probe"), ("bad", "t.faulty")],
        json!({"instantiation_parameters": {"s": ["a.y", "p.u"]},
               "cells": {"at": ["a.total"], "by": ["b.y"], "bt": ["b.total"], "py": ["p.y"], "bady": ["bad.y"]},
               "input_parameters": {"limit": {"targets": ["a.limit"], "default": 3.0}, "b_limit": {"targets": ["b.limit"], "default": 2.0}},
               "output_values": {"a": "a.y", "p": "p.y"}, "initial": "one",
               "conditions": {"halted": {"returns": ["a", "p"]}, "completed": {"returns": ["a"]}, "a_done": {"on": ["a.reached"], "returns": ["p"]},
                              "b_done": {"on": ["b.reached"], "priority": 3}},
               "command_lists": lists(&[
                   ("one", &["!b", "+a 4ms", "+p", "?a.reached", "-a", "-p", "?8ms", "+b 4ms", "?b.reached", "*a", "*b"]),
                   ("two", &["*a", "+bad 4ms", "+b 4ms", "?12ms", "-b", "-bad"]),
                   ("three", &["+a 4ms", "+p", "?8ms", "-a", "-p"]),
               ]),
               "transitions": tau(&["one, fault -> two", "one, halted -> three", "one, a_done -> one", "one, completed -> two", "two, b_done -> two"])}),
    )
}

/// Returns the placement of blocks, and the SVV for the verb.
pub fn with_svv<'a>(place: &[&'a str], svv: &'a str) -> Vec<&'a str> {
    place.iter().copied().chain([if svv == "x" { "s=x" } else { "s=y" }]).collect()
}
