// SPDX-License-Identifier: Apache-2.0
//! Banks: cost of 64 gains side by side, in addition to the firing that contains them, run by the bank entries of both languages.
use crate::Bench;
use crate::blocks::Gain;
use crate::dispatch::{Shape, table, wiring};
use crate::report::{Line, least, time};
use crate::rig::{Rig, image, rest};
use opengpac::FunctionBlock;

const BLOCKS: usize = 64;
const FIRINGS: usize = 4_000;
const BURSTS: usize = 10;

pub fn rows(bench: &Bench) {
    let rig = Rig::new();
    let (reads, writes, values) = wiring(Shape::Independent, BLOCKS);
    let image = |kinds: &[_]| image(kinds, &reads, &writes, values);
    let programs = [image(&[]), image(&[Gain::descriptor(); BLOCKS]), image(&[bench.loaded.block("gain"); BLOCKS])];
    let mut taken = [const { Vec::new() }; 3];
    for _ in 0..bench.rounds * BURSTS {
        for (program, taken) in programs.iter().zip(&mut taken) {
            rig.carry_out(rig.source, table(&rig, program, Shape::Independent, None));
            rig.burst(FIRINGS / 10);
            taken.push(rig.burst(FIRINGS) / FIRINGS as f64);
            rest(1_000_000);
        }
    }
    // The minimum of each: disturbances only ever slow a program down.
    let [without, banked, in_c] = taken.map(least);
    let each = |firing: f64| (firing - without) / BLOCKS as f64;
    Line {
        row: "dispatch",
        what: format!("{BLOCKS} gains in Rust side by side, in a bank"),
        ours: format!("{} a block", time(each(banked))),
        peer: format!("in C: {}", time(each(in_c))),
        value: each(banked),
        shown: format!("{:.2} ns", each(banked)),
        bar: Some(1.0),
        bar_text: "≤ 1.0 ns",
        note: format!("beside a firing without them, {}", time(without)),
    }
    .print();
}
