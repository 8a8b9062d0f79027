// SPDX-License-Identifier: Apache-2.0
//! One firing of n blocks, a published connection behind it.
use crate::in_turns;
use crate::loops::{KINDS, Loops, Module, Shape};
use interconnect::ConnectionSpec;
use kernel::*;
use opengpac::abi::Descriptor;
use opengpac::{FunctionBlock, Invocation, Outcome};
use std::sync::Arc;
use std::time::Instant;

/// Gain: y = k u.
#[derive(FunctionBlock)]
struct Gain {
    /// input
    #[input]
    u: f64,
    /// output
    #[output]
    y: f64,
    /// factor
    #[param(default = 0.999)]
    k: f64,
}

impl opengpac::Step for Gain {
    fn step(&mut self, _: &Invocation) -> Outcome {
        self.y = self.k * self.u;
        Outcome::Done
    }
}

/// PID: y = kp e + ki sum(e) + kd (e - e'), e = -u.
#[derive(FunctionBlock)]
struct Pid {
    /// measured value
    #[input]
    u: f64,
    /// effort
    #[output]
    y: f64,
    /// proportional gain
    #[param(default = 0.5)]
    kp: f64,
    /// integral gain
    #[param(default = 0.001)]
    ki: f64,
    /// derivative gain
    #[param(default = 0.1)]
    kd: f64,
    /// sum of errors
    #[state]
    sum: f64,
    /// error before
    #[state]
    last: f64,
}

impl opengpac::Step for Pid {
    fn step(&mut self, _: &Invocation) -> Outcome {
        let e = -self.u;
        self.sum = 0.999 * self.sum + e;
        self.y = self.kp * e + self.ki * self.sum + self.kd * (e - self.last);
        self.last = e;
        Outcome::Done
    }
}

const SIZES: [usize; 5] = [10, 100, 1_000, 10_000, 100_000];
/// Invocations of one measurement.
const INVOCATIONS: usize = 1_000_000;
const PERIOD_NS: i64 = 1_000_000;
const INPUT: usize = 0;
const OUTPUT: usize = 1;

pub fn run(module: &Module, rounds: usize) {
    let shape = |name, chained, mixed, kind| Shape { name, chained, mixed, kind };
    let shapes = [
        shape("chain", true, false, 0),
        shape("independent", false, false, 0),
        shape("chain", true, false, 3),
        shape("independent", false, false, 3),
        shape("mixed", true, true, 0),
    ];
    for shape in shapes {
        for n in SIZES {
            measure(module, shape, n, rounds);
        }
    }
}

fn measure(module: &Module, shape: Shape, n: usize, rounds: usize) {
    let c: Vec<&'static Descriptor> = (0..n).map(|i| module.blocks[shape.kind_of(i)]).collect();
    let in_c = Program::new(shape, &c, 0);
    let in_rust = (!shape.mixed).then(|| Program::new(shape, &vec![if shape.kind == 0 { Gain::descriptor() } else { Pid::descriptor() }; n], 0));
    let loops = Loops::new(module, shape, n);
    let turns = (INVOCATIONS / n).max(1);
    let each = |spent: std::time::Duration| spent.as_nanos() as f64 / (turns * n) as f64;
    let timed = |work: &dyn Fn(usize)| {
        let start = Instant::now();
        work(turns);
        each(start.elapsed())
    };
    let mut measures: Vec<Box<dyn FnMut() -> f64 + '_>> = vec![
        Box::new(|| timed(&|turns| in_c.fire(turns))),
        Box::new(|| timed(&|turns| loops.calls(turns))),
        Box::new(|| timed(&|turns| loops.checked(turns))),
        Box::new(|| {
            timed(&|turns| {
                if !shape.mixed {
                    loops.inlined(turns)
                }
            })
        }),
    ];
    if let Some(in_rust) = &in_rust {
        measures.push(Box::new(|| timed(&|turns| in_rust.fire(turns))));
    }
    let found = in_turns(rounds, &mut measures);
    let kind = if shape.mixed { "four kinds" } else { KINDS[shape.kind] };
    let rust = found.get(4).map_or("null".to_owned(), |ns| format!("{ns:.2}"));
    let inlined = if shape.mixed { "null".to_owned() } else { format!("{:.2}", found[3]) };
    println!(
        r#"{{"bench":"dispatch","shape":"{}","kind":"{kind}","blocks":{n},"kernel_c_ns":{:.2},"kernel_rust_ns":{rust},"loop_ns":{:.2},"loop_checked_ns":{:.2},"inlined_ns":{inlined},"ratio":{:.2},"ratio_checked":{:.2}}}"#,
        shape.name,
        found[0],
        found[1],
        found[2],
        found[0] / found[1],
        found[0] / found[2]
    );
}

/// One reader that preempts at the points of the virtual clock, against none: what a firing costs beside one that reads its
/// connection ten times as often.
pub fn preempted(module: &Module, rounds: usize) {
    let shape = Shape { name: "chain", chained: true, mixed: false, kind: 0 };
    for n in [100, 1_000, 10_000] {
        let blocks = vec![module.blocks[0]; n];
        let (alone, read) = (Program::new(shape, &blocks, 0), Program::new(shape, &blocks, 1));
        let turns = (INVOCATIONS / n).max(1);
        let timed = |program: &Program| {
            let start = Instant::now();
            program.fire(turns);
            start.elapsed().as_nanos() as f64 / turns as f64
        };
        let mut measures: Vec<Box<dyn FnMut() -> f64 + '_>> = vec![Box::new(|| timed(&alone)), Box::new(|| timed(&read))];
        let found = in_turns(rounds, &mut measures);
        println!(r#"{{"bench":"reader","blocks":{n},"alone_ns":{:.0},"with_reader_ns":{:.0},"ratio":{:.2}}}"#, found[0], found[1], found[1] / found[0]);
    }
}

/// A source with `blocks` in one strip, under the virtual clock; its last cells are published once a firing.
pub struct Program {
    pub host: Host,
    pub source: SourceId,
}

impl Program {
    fn new(shape: Shape, blocks: &[&'static Descriptor], readers: usize) -> Program {
        let host = Host::new(ClockKind::Virtual { seed: 1 }, Box::new(interconnect::Memory));
        let spec = |name: &str, priority| SourceSpec {
            rtp: 0,
            name: name.into(),
            kind: SourceKind::Timer { period_ns: PERIOD_NS as u64 },
            priority,
            core: None,
            virtual_cost_ns: 0,
        };
        let source = host.add_source(spec("writer", 50)).expect("the virtual clock needs no thread");
        let cells = Extent::new(8 * (blocks.len() + 1));
        let cell = |at: usize| cells.cell(8 * at, 8);
        cell(0).store(&1f64.to_ne_bytes());
        let on = Activation::new(Due::Interval, None);
        let process = Process::new(1, 1);
        let installed = install(shape, blocks, &cell);
        let steps = installed
            .into_iter()
            .map(|block| Step { kind: StepKind::Block(Arc::new(block)), activation: on.clone(), process: process.clone(), drivers: vec![] })
            .collect();
        let members = blocks.len().min(8);
        let connection = ConnectionSpec { writer: 0, reader: 1, asynchronous_len: 8 * members, queue_row_len: 0, queue_depth: 0 };
        let (sender, receiver) = host.connect(&connection);
        let group = (blocks.len() + 1 - members..=blocks.len()).map(cell).collect();
        if readers > 0 {
            let reader = host.add_source(spec("reader", 80)).expect("the virtual clock needs no thread");
            let copy = Extent::new(8 * members);
            let inbound = Inbound::new(receiver, vec![copy.cell(0, 8 * members)], vec![]);
            host.submit(reader, Box::new(Script { id: 0, ops: vec![Op::Table(Box::new(Table::new(vec![], vec![inbound], vec![], vec![], None)))] }));
        }
        let table = Table::new(steps, vec![], vec![Outbound::new(sender, group, vec![], None)], vec![], None);
        host.submit(source, Box::new(Script { id: 0, ops: vec![Op::Table(Box::new(table)), Op::On(on, 1)] }));
        Program { host, source }
    }

    fn fire(&self, firings: usize) {
        let until = self.host.now_ns() + firings as i64 * PERIOD_NS;
        while self.host.fire_next(until).expect("nobody raises anybody") {}
        self.host.set_now(until);
        assert_eq!(self.host.statistics(self.source).faults, 0);
    }
}

/// Instances side by side in one extent, as a verb instance has them.
fn install(shape: Shape, blocks: &[&'static Descriptor], cell: &dyn Fn(usize) -> Cell) -> Vec<Block> {
    let sizes = blocks.iter().map(|block| (block.instance_size as usize).next_multiple_of(16));
    let memory = Extent::new(sizes.clone().sum());
    let module: Arc<dyn std::any::Any + Send + Sync> = Arc::new(());
    let mut at = 0;
    let place = |((i, descriptor), size): ((usize, &&'static Descriptor), usize)| {
        let mut block = Block::install(BlockId(i as u32), "b", descriptor, module.clone(), memory.cell(at, size));
        at += size;
        block.bind(INPUT, &cell(shape.input(i)));
        block.bind(OUTPUT, &cell(i + 1));
        block
    };
    blocks.iter().enumerate().zip(sizes).map(place).collect()
}
