// SPDX-License-Identifier: Apache-2.0
//! Fused blocks: cost of 100 chained gains, in addition to the firing that contains them, if they are fused, run one by one, or written
//! out in one C function.
use crate::Bench;
use crate::dispatch::{Shape, table, wiring};
use crate::loaded::Loop;
use crate::report::{Line, least, time};
use crate::rig::{Rig, image, rest};
use kernel::Op;
use modules::fused::fuse;
use modules::{LoadOptions, load};
use runtime::groups;
use std::path::Path;

const BLOCKS: usize = 100;
const FIRINGS: usize = 2_500;
const BURSTS: usize = 10;

pub fn rows(bench: &Bench) {
    let rig = Rig::new();
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../bench/c/blocks.c");
    let loaded = load(&source, &LoadOptions::default()).expect("the blocks of the benchmark can be loaded");
    let gain = loaded.block("gain").expect("one of them is a gain").descriptor;
    let (reads, writes, values) = wiring(Shape::Chain, BLOCKS);
    let [empty, chain] = [vec![], vec![gain; BLOCKS]].map(|kinds| image(&kinds, &reads, &writes, values));
    let mut fused = table(&rig, &chain, Shape::Chain, None);
    let Op::Table(made) = fused.remove(0) else { unreachable!("a table comes first") };
    let made = made.fused(|blocks| groups(blocks).into_iter().map(|group| (group.blocks, fuse(&group.members).expect("it can be compiled"))).collect());
    fused.insert(0, Op::Table(Box::new(made)));
    let peer = bench.loaded.peer(&[], &[], &[], 1);
    let mut taken = [const { Vec::new() }; 5];
    let ours = |program: usize, ops: Vec<Op>, taken: &mut [Vec<f64>; 5]| {
        rig.carry_out(rig.source, ops);
        for _ in 0..bench.rounds * BURSTS {
            rig.burst(FIRINGS / 10);
            taken[program].push(rig.burst(FIRINGS) / FIRINGS as f64);
            for (loops, of) in [(Loop::Calls, 3), (Loop::WrittenOut, 4)] {
                taken[of].push(peer.run(loops, FIRINGS) / FIRINGS as f64);
            }
            rest(1_000_000);
        }
    };
    ours(0, table(&rig, &empty, Shape::Chain, None), &mut taken);
    ours(1, fused, &mut taken);
    ours(2, table(&rig, &chain, Shape::Chain, None), &mut taken);
    // The minimum of each: disturbances only ever slow a program down.
    let [without, fused, single, clocks, written] = taken.map(least);
    let each = |firing: f64, beside: f64| (firing - beside) / BLOCKS as f64;
    let (fused, single, written) = (each(fused, without), each(single, without), each(written, clocks));
    Line {
        row: "dispatch",
        what: format!("{BLOCKS} gains in C, a chain, fused"),
        ours: format!("{} a block", time(fused)),
        peer: format!("one C function: {}", time(written)),
        value: fused / written,
        shown: format!("{:.2} ×", fused / written),
        bar: Some(1.1),
        bar_text: "≤ 1.1 ×",
        note: format!("one by one {}", time(single)),
    }
    .print();
}
