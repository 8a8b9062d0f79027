// SPDX-License-Identifier: Apache-2.0
//! Fused blocks equal the blocks run one by one: the same values, numbers, conditions and faults to the bit, whatever happens in the
//! middle of them.
//!
//! Of the first twelve random programs, four run each day. `OPENGPAC_FUSED=1000 OPENGPAC_SEED=7 cargo test -p kernel --test
//! fused -- --nocapture` is the large campaign.
#![allow(clippy::undocumented_unsafe_blocks, reason = "headers of blocks are read between firings")]
mod support;
use kernel::*;
use modules::fused::{Member, Wire, fuse};
use modules::{BuildOptions, LoadOptions, load};
use opengpac::abi::{Descriptor, Header, NONE, kind};
use opengpac::bank::Bank;
use runtime::{Group, Host, groups};
use std::collections::HashMap;
use std::ffi::CStr;
use std::path::Path;
use std::sync::{Arc, Mutex, OnceLock};
use std::time::{SystemTime, UNIX_EPOCH};
use support::*;

const MS: i64 = 1_000_000;

mod act {
    pub const NOTHING: u32 = 0;
    pub const REPORT: u32 = 1;
    pub const RETURN: u32 = 2;
    pub const NONFINITE: u32 = 4;
    pub const NULL_POINTER: u32 = 5;
    pub const DIVIDE: u32 = 6;
    pub const LOOP: u32 = 7;
}

/// Returns the blocks of `told.c` and `several.c`, as a system downloads them; the first is `told`, the second cannot be fused.
fn kinds() -> &'static [&'static Descriptor] {
    static KINDS: OnceLock<Vec<&Descriptor>> = OnceLock::new();
    KINDS.get_or_init(|| {
        let of = |name: &str| loaded(&Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/blocks").join(name));
        [of("told.c"), of("several.c")].concat()
    })
}

fn loaded(path: &Path) -> Vec<&'static Descriptor> {
    let loaded = load(path, &LoadOptions { build: BuildOptions::default(), ..LoadOptions::default() }).unwrap();
    loaded.blocks.iter().map(|block| block.descriptor).collect()
}

fn named(name: &str) -> usize {
    kinds().iter().position(|kind| unsafe { CStr::from_ptr(kind.name) }.to_str() == Ok(name)).unwrap()
}

/// Returns the entry of a group, compiled once.
fn entry(members: &[Member]) -> Bank {
    static MADE: Mutex<Option<HashMap<Vec<Member>, Bank>>> = Mutex::new(None);
    let mut made = MADE.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    *made.get_or_insert_default().entry(members.to_vec()).or_insert_with(|| fuse(members).unwrap())
}

/// One block of a program.
#[derive(Clone, Debug)]
struct ProgramBlock {
    kind: usize,
    /// Block and output that each input reads, possibly a later block; or a constant.
    reads: Vec<Option<(usize, usize)>>,
    /// Index of its activation, due at every firing or at every second one.
    slot: usize,
    drivers: Vec<u32>,
    /// Invocation on which `told` acts, and the act.
    told: (u64, u32),
}

/// Makes `told` blocks, each of which reads the one before it.
fn chain(n: usize) -> Vec<ProgramBlock> {
    (0..n)
        .map(|at| ProgramBlock { kind: 0, reads: vec![at.checked_sub(1).map(|before| (before, 0))], slot: 0, drivers: vec![], told: (0, act::NOTHING) })
        .collect()
}

/// Returns the indices of a kind's items: inputs and outputs.
fn ports(kind: usize) -> [Vec<usize>; 2] {
    let of = |wanted: u8| {
        let descriptor = kinds()[kind];
        (0..descriptor.item_count as usize).filter(|&at| unsafe { (*descriptor.items.add(at)).kind } == wanted).collect()
    };
    [of(kind::INPUT), of(kind::OUTPUT)]
}

fn type_of(kind: usize, item: usize) -> &'static str {
    unsafe { CStr::from_ptr((*kinds()[kind].items.add(item)).type_text) }.to_str().unwrap()
}

#[derive(Debug, PartialEq)]
struct RunResult {
    values: Vec<Vec<u8>>,
    /// The instance after its addresses, and the header, of each block.
    blocks: Vec<(Vec<Vec<u8>>, u64, u64)>,
    told: Vec<String>,
    stopped: bool,
}

struct Program {
    host: Host,
    source: SourceId,
    blocks: Vec<Arc<Block>>,
    made: Vec<ProgramBlock>,
    cells: Vec<Vec<Cell>>,
    activations: [Arc<Activation>; 2],
    process: Arc<Process>,
    told: Vec<String>,
}

impl Program {
    fn new(made: &[ProgramBlock], is_fused: bool) -> Program {
        let host = virtual_host(1);
        let source = host.add_source(timer("fast", MS as u64, 80)).unwrap();
        let process = Process::new(1, 1);
        process.set_stages(vec![Stage { watches: vec![Watch { block: None, item: Watch::FAULT, condition: 9, priority: 0, response: Response::Tell }] }]);
        // Cells per block: its outputs, then a constant for each input.
        let place = |made: &ProgramBlock| {
            let items: Vec<usize> = ports(made.kind).into_iter().rev().flatten().collect();
            items.into_iter().map(|item| unsafe { (*kinds()[made.kind].items.add(item)).size } as usize).map(|size| Extent::new(size).cell(0, size)).collect()
        };
        let cells: Vec<Vec<Cell>> = made.iter().map(place).collect();
        let mut program = Program { host, source, blocks: vec![], made: made.to_vec(), cells, activations: [limited(), limited()], process, told: vec![] };
        program.blocks = (0..made.len()).map(|at| program.block(at)).collect();
        let [first, second] = program.activations.clone();
        let stage = Op::Stage { process: program.process.clone(), stage: 0, generation: Some(1) };
        program.submit(vec![Op::Table(Box::new(program.table(is_fused))), stage, Op::On(first, 1), Op::On(second, 2)]);
        program
    }

    fn block(&self, at: usize) -> Arc<Block> {
        let made = &self.made[at];
        let mut block = install(at as u32, kinds()[made.kind], None, None);
        let [inputs, outputs] = ports(made.kind);
        for (place, item) in outputs.iter().enumerate() {
            block.bind(*item, &self.cells[at][place]);
        }
        for (place, item) in inputs.iter().enumerate() {
            let constant = &self.cells[at][outputs.len() + place];
            if type_of(made.kind, *item) == "double" {
                constant.store(&(at as f64 + 1.0).to_ne_bytes());
            }
            block.bind(*item, made.reads[place].map_or(constant, |(from, output)| &self.cells[from][output]));
        }
        if made.kind == 0 {
            block.set(3, &made.told.0.to_ne_bytes());
            block.set(4, &made.told.1.to_ne_bytes());
        }
        Arc::new(block)
    }

    fn single(&self) -> Table {
        let steps = self.blocks.iter().zip(&self.made).map(|(block, made)| step(block, &self.activations[made.slot], &self.process, &made.drivers));
        table(steps.collect())
    }

    fn table(&self, is_fused: bool) -> Table {
        let table = self.single();
        if is_fused { table.fused(|blocks| groups(blocks).into_iter().map(|Group { blocks, members }| (blocks, entry(&members))).collect()) } else { table }
    }

    /// Returns the ranges of blocks that are fused.
    fn groups(&self) -> Vec<(usize, usize)> {
        let mut found = vec![];
        let _ = self.single().fused(|blocks| {
            let first = blocks.first().map_or(0, |block| block.id().0 as usize);
            found.extend(groups(blocks).into_iter().map(|group| (first + group.blocks.start, first + group.blocks.end)));
            vec![]
        });
        found
    }

    fn submit(&self, ops: Vec<Op>) {
        self.host.submit(self.source, script(ops));
    }

    /// Runs `firings` more firings.
    fn fire(&mut self, firings: i64) {
        run_until(&self.host, self.host.now_ns() + firings * MS);
        self.told.extend(events(&self.host).iter().filter(|event| !matches!(event, Event::Done { .. })).map(|event| format!("{event:?}")));
    }

    /// Returns everything observable: values, items and headers of the blocks, and the events.
    fn seen(&self) -> RunResult {
        let of = |block: &Arc<Block>| {
            let Header { number, activated } = unsafe { *block.header() };
            let items = block.items().iter().enumerate().filter(|(_, item)| item.offset != NONE && item.kind != kind::INPUT);
            (items.map(|(item, _)| block.value(item).load().to_vec()).collect(), number, activated)
        };
        let values = self.cells.iter().flatten().map(|cell| cell.load().to_vec()).collect();
        let stopped = self.host.statistics(self.source).stopped;
        RunResult { values, blocks: self.blocks.iter().map(of).collect(), told: self.told.clone(), stopped }
    }

    fn numbers(&self) -> Vec<u64> {
        self.blocks.iter().map(|block| unsafe { (*block.header()).number }).collect()
    }
}

/// Runs the program fused for `firings`, and checks that it equals the unfused one, and one that is fused and unfused while it runs.
fn alike(made: &[ProgramBlock], firings: i64, origin: &str) -> Program {
    let [single, fused] = [false, true].map(|is_fused| {
        let mut program = Program::new(made, is_fused);
        program.fire(firings);
        program
    });
    let mut by_turns = Program::new(made, false);
    for firing in 0..firings {
        by_turns.submit(vec![Op::Table(Box::new(by_turns.table(firing % 3 == 1)))]);
        by_turns.fire(1);
    }
    assert_eq!(single.seen(), fused.seen(), "{origin} {made:?}");
    assert_eq!(single.seen(), by_turns.seen(), "by turns, {origin} {made:?}");
    fused
}

#[test]
fn blocks_that_read_each_other_are_fused_and_no_others() {
    let of = |made: &[ProgramBlock]| Program::new(made, false).groups();
    assert_eq!(of(&chain(9)), [(0, 9)]);
    assert_eq!(of(&chain(250)), [(0, 100), (100, 200), (200, 250)]);
    let mut made = chain(9);
    made[4].slot = 1;
    assert_eq!(of(&made), [(0, 4), (5, 9)]);
    let mut made = chain(9);
    made[4] = ProgramBlock { kind: named("large"), reads: vec![], ..made[4].clone() };
    made[5].reads = vec![None];
    assert_eq!(of(&made), [(0, 4), (5, 9)]);
    // A block without a wire to the others gains nothing; a value of the previous firing is not a wire.
    let mut made = chain(6);
    made[0].reads = vec![None];
    made[1].reads = vec![None];
    made[5].reads = vec![Some((5, 0))];
    assert_eq!(of(&made), [(1, 5)]);
    made.iter_mut().for_each(|made| made.reads = vec![None]);
    assert_eq!(of(&made), []);
}

#[test]
fn a_chain_is_the_same_fused() {
    let program = alike(&chain(9), 7, "");
    assert_eq!(program.numbers(), [7; 9]);
}

#[test]
fn what_comes_in_the_middle_is_told_of_its_block_and_the_others_run() {
    for act in [act::REPORT, act::RETURN, act::NONFINITE] {
        let mut made = chain(9);
        made[4].told = (2, act);
        made[6].drivers = vec![4];
        let program = alike(&made, 5, "");
        let is_told = |text: &&String| text.contains("BlockId(4)");
        assert_eq!((program.told.len(), program.told.iter().filter(is_told).count()), (1, 1), "{:?}", program.told);
        assert_eq!(program.numbers(), [5; 9]);
    }
}

#[test]
fn a_signal_in_the_middle_ends_its_block() {
    for (act, fault) in [(act::NULL_POINTER, "Signal(11)"), (act::DIVIDE, "Signal(8)"), (act::LOOP, "Budget")] {
        let mut made = chain(9);
        made[4].told = (2, act);
        let program = alike(&made, 5, "");
        let stopped = program.told.iter().find(|text| text.starts_with("Stopped")).unwrap();
        assert!(stopped.contains("BlockId(4)") && stopped.contains(fault), "{stopped}");
        assert_eq!(program.numbers(), [3, 3, 3, 3, 3, 2, 2, 2, 2], "it has the number of its invocation, without a mark; none behind it ran");
        let again = [false, true].map(|is_fused| {
            let mut program = Program::new(&made, is_fused);
            program.fire(5);
            program.host.restart(program.source);
            program.fire(2);
            program
        });
        assert_eq!(again[0].seen(), again[1].seen());
    }
}

#[test]
fn the_probe_visits_each_block() {
    let [single, fused] = [false, true].map(|is_fused| {
        let mut program = Program::new(&chain(8), is_fused);
        program.host.probe(program.source, u64::MAX / 4);
        program.fire(16);
        program
    });
    let samples: Vec<u64> = fused.blocks.iter().map(|block| fused.host.block_times(fused.source, block).samples).collect();
    assert_eq!(samples, [2; 8]);
    assert_eq!(single.seen(), fused.seen());
}

#[test]
fn a_wire_that_leads_elsewhere_is_seen() {
    // Checks that the fused code really runs: otherwise these tests would compare unfused blocks with themselves.
    let made = chain(4);
    let mut wrong = Program::new(&made, false);
    let of = kinds()[0];
    let wires = |from| vec![Wire { input: 0, from, output: 1 }];
    let members = [vec![], wires(0), wires(0), wires(2)].map(|wires| Member { descriptor: of, wires });
    wrong.submit(vec![Op::Table(Box::new(wrong.table(false).fused(|_| vec![(0..4, entry(&members))])))]);
    let mut right = Program::new(&made, true);
    wrong.fire(3);
    right.fire(3);
    let differ: Vec<bool> = wrong.seen().blocks.iter().zip(&right.seen().blocks).map(|(wrong, right)| wrong != right).collect();
    assert_eq!(differ, [false, false, true, true]);
}

/// Returns blocks of all kinds and two activations, which read each other, drive each other, and occasionally act.
fn any(seed: &mut u64) -> Vec<ProgramBlock> {
    let n = 2 + random_below(seed, 30) as usize;
    let acts = if random_below(seed, 4) == 0 { act::DIVIDE } else { act::NONFINITE };
    let mut slot = 0;
    let kind_of: Vec<usize> = (0..n).map(|_| if random_below(seed, 3) == 0 { 0 } else { random_below(seed, kinds().len() as u64) as usize }).collect();
    let outputs: Vec<(usize, usize, &str)> = (0..n)
        .flat_map(|at| ports(kind_of[at])[1].iter().enumerate().map(|(place, item)| (at, place, type_of(kind_of[at], *item))).collect::<Vec<_>>())
        .collect();
    let made = (0..n).map(|at| {
        if random_below(seed, 8) == 0 {
            slot = random_below(seed, 2) as usize;
        }
        let [inputs, _] = ports(kind_of[at]);
        let reads = inputs.into_iter().map(|item| {
            let fit: Vec<_> = outputs.iter().filter(|(_, _, of)| *of == type_of(kind_of[at], item)).collect();
            // Usually one of the closest blocks before it.
            let near: Vec<_> = fit.iter().filter(|(from, ..)| *from < at && *from + 8 > at).copied().collect();
            let among = if random_below(seed, 5) == 0 { fit } else { near };
            (!among.is_empty()).then(|| among[random_below(seed, among.len() as u64) as usize]).map(|(from, place, _)| (*from, *place))
        });
        let reads = reads.collect();
        let drivers = (0..at as u32).filter(|_| random_below(seed, 8 * n as u64) < 8).collect();
        let told = if random_below(seed, 5) == 0 { (random_below(seed, 10), random_below(seed, u64::from(acts) + 1) as u32) } else { (0, act::NOTHING) };
        ProgramBlock { kind: kind_of[at], reads, slot, drivers, told }
    });
    made.collect()
}

#[test]
fn any_program_is_the_same_fused() {
    let day = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_secs() / 86_400);
    let (count, first) = (setting("OPENGPAC_FUSED", 4), setting("OPENGPAC_SEED", 1 + 4 * (day % 3)).max(1));
    let (mut faults, mut stopped, mut fused) = (0, 0, 0);
    for seed in first..first + count {
        let program = alike(&any(&mut seed.wrapping_mul(0x9e37_79b9_7f4a_7c15)), 12, &format!("OPENGPAC_SEED={seed} OPENGPAC_FUSED=1"));
        faults += program.host.statistics(program.source).faults;
        stopped += u64::from(program.host.statistics(program.source).stopped);
        fused += program.groups().iter().map(|(start, end)| end - start).sum::<usize>();
    }
    println!("{count} programs, {fused} blocks fused, {faults} faults, {stopped} ended by a signal");
    assert!(count < 4 || (fused > 0 && faults > 0), "something happens in fused blocks");
}
