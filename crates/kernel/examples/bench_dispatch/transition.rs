// SPDX-License-Identifier: Apache-2.0
//! A transition as a reaction: n blocks out and n in, in the firing of its condition.
use crate::loops::Module;
use crate::median;
use kernel::*;
use opengpac::{Condition, FunctionBlock, Invocation, Outcome};
use std::sync::Arc;
use std::time::Instant;

/// Reports `now` on every invocation.
#[derive(FunctionBlock)]
struct Toggle {
    /// each time
    #[condition]
    now: Condition,
}

impl opengpac::Step for Toggle {
    fn step(&mut self, _: &Invocation) -> Outcome {
        self.now.report();
        Outcome::Done
    }
}

const PERIOD_NS: i64 = 1_000_000;
const FIRINGS: usize = 2_000;

pub fn run(module: &Module, rounds: usize) {
    for n in [10, 100] {
        let quiet = firing_ns(module, n, false, rounds);
        let moving = firing_ns(module, n, true, rounds);
        println!(r#"{{"bench":"transition","blocks":{n},"firing_ns":{quiet:.0},"with_transition_ns":{moving:.0},"transition_ns":{:.0}}}"#, moving - quiet);
    }
}

/// A firing of n blocks, with or without a reaction that switches them off and n others on. Each block has an activation of its own.
fn firing_ns(module: &Module, n: usize, moving: bool, rounds: usize) -> f64 {
    let host = Host::new(ClockKind::Virtual { seed: 1 }, Box::new(interconnect::Memory));
    let kind = SourceKind::Timer { period_ns: PERIOD_NS as u64 };
    let source = host
        .add_source(SourceSpec { rtp: 0, name: "fast".into(), kind, priority: 80, core: None, virtual_cost_ns: 0 })
        .expect("the virtual clock needs no thread");
    let process = Process::new(1, 1);
    let cells = Extent::new(8 * (2 * n + 1));
    let install = |id: usize| {
        let descriptor = module.blocks[0];
        let size = descriptor.instance_size as usize;
        let mut block = Block::install(BlockId(id as u32), "b", descriptor, Arc::new(()), Extent::new(size).cell(0, size));
        block.bind(0, &cells.cell(0, 8));
        block.bind(1, &cells.cell(8 * id, 8));
        Arc::new(block)
    };
    let activations: Vec<_> = (0..2 * n).map(|_| Activation::new(Due::Interval, None)).collect();
    let mut steps: Vec<Step> = activations
        .iter()
        .zip(1..)
        .map(|(on, id)| Step { kind: StepKind::Block(install(id)), activation: on.clone(), process: process.clone(), drivers: vec![] })
        .collect();
    let toggle = Toggle::descriptor();
    let size = toggle.instance_size as usize;
    let toggle = Block::install(BlockId(0), "toggle", toggle, Arc::new(()), Extent::new(size).cell(0, size));
    let always = Activation::new(Due::Interval, None);
    steps.push(Step { kind: StepKind::Block(Arc::new(toggle)), activation: always.clone(), process: process.clone(), drivers: vec![] });
    let swap = |off: &[Arc<Activation>], on: &[Arc<Activation>]| {
        let ops = off.iter().map(|activation| Op::Off(activation.clone())).chain(on.iter().map(|activation| Op::On(activation.clone(), 1)));
        Arc::new(Script { id: 0, ops: ops.collect() })
    };
    let (first, second) = activations.split_at(n);
    let stage = |script, next| Stage {
        watches: vec![Watch { block: Some(BlockId(0)), item: 0, condition: 0, priority: 0, response: Response::React { script, next: Some(next) } }],
    };
    process.set_stages(vec![stage(swap(first, second), 1), stage(swap(second, first), 0)]);
    let mut ops = vec![Op::Table(Box::new(Table::new(steps, vec![], vec![], vec![], None))), Op::Stage { process, stage: 0, generation: Some(1) }];
    ops.extend(first.iter().map(|activation| Op::On(activation.clone(), 1)));
    if moving {
        ops.push(Op::On(always, 1));
    }
    host.submit(source, Box::new(Script { id: 0, ops }));
    let measured = (0..rounds).map(|_| {
        let mut spent = 0;
        for _ in 0..FIRINGS {
            let start = Instant::now();
            host.fire_next(i64::MAX).expect("nobody raises anybody");
            spent += start.elapsed().as_nanos();
            while host.poll().is_some() {}
        }
        spent as f64 / FIRINGS as f64
    });
    median(measured.collect())
}
