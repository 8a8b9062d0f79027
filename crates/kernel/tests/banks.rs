// SPDX-License-Identifier: Apache-2.0
//! A bank equals its steps run one by one: the same values, numbers, conditions and faults to the bit, whatever happens in the middle of
//! it.
//!
//! `OPENGPAC_BANKS=100000 OPENGPAC_SEED=7 cargo test -p kernel --test banks -- --nocapture` is the large campaign.
#![allow(clippy::undocumented_unsafe_blocks, reason = "entries of blocks that count their calls, and blocks that do what no block may")]
#[path = "support/modules.rs"]
mod modules;
mod support;
use kernel::*;
use opengpac::abi::{Descriptor, Header, Invocation};
use opengpac::bank::{self, Bank, Call};
use opengpac::{ConditionOf, FunctionBlock, Outcome};
use runtime::Host;
use std::cell::Cell as Local;
use std::ffi::{CStr, c_void};
use std::hint::black_box;
use std::sync::{Arc, OnceLock};
use support::*;

const MS: i64 = 1_000_000;

/// Adds its input to a sum, and performs a scripted act on one invocation: y = sum + u.
#[derive(FunctionBlock)]
struct ScriptedSum {
    /// value that is added
    #[input]
    u: f64,
    /// sum
    #[output]
    y: f64,
    /// the sum has reached this value
    #[condition(preset = 0.0)]
    high: ConditionOf<f64>,
    /// on this invocation
    #[param(default = 0)]
    when: u64,
    /// act that follows: one of `act`
    #[param(default = 0)]
    act: u32,
    /// sum of what was read
    #[state]
    sum: f64,
}

const WHEN: usize = 3;
const ACT: usize = 4;

mod act {
    pub const NOTHING: u32 = 0;
    pub const REPORT: u32 = 1;
    pub const RETURN: u32 = 2;
    pub const PANIC: u32 = 3;
    pub const NONFINITE: u32 = 4;
    pub const NULL_POINTER: u32 = 5;
    pub const DIVIDE: u32 = 6;
    pub const LOOP: u32 = 7;
}

impl opengpac::Step for ScriptedSum {
    fn step(&mut self, invocation: &Invocation) -> Outcome {
        self.sum += self.u;
        self.y = self.sum + invocation.number as f64;
        match if invocation.number == self.when { self.act } else { act::NOTHING } {
            act::REPORT => self.high.report(self.sum),
            act::RETURN => return Outcome::Fault(7),
            act::PANIC => panic!("as it was told"),
            act::NONFINITE => self.y = f64::NAN,
            act::NULL_POINTER => self.y = unsafe { black_box(std::ptr::dangling::<f64>()).read_volatile() },
            act::DIVIDE => unsafe {
                std::arch::asm!("div {0}", in(reg) black_box(0u64), inout("rax") 1u64 => _, inout("rdx") 0u64 => _);
            },
            act::LOOP => {
                while black_box(self.act) == act::LOOP {
                    std::hint::spin_loop();
                }
            }
            _ => {}
        }
        Outcome::Done
    }
}

thread_local! {
    /// Invocations through the block's entry, and through its bank entry. The virtual clock fires on the calling thread.
    static SINGLE: Local<u64> = const { Local::new(0) };
    static BANKED: Local<u64> = const { Local::new(0) };
}

/// Implementation language of a `ScriptedSum`.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Language {
    Rust,
    C,
}

const LANGUAGES: [Language; 2] = [Language::Rust, Language::C];

/// Returns `ScriptedSum`, and the bank entry of its module.
fn told(language: Language) -> (&'static Descriptor, Bank) {
    static IN_C: OnceLock<(&Descriptor, Bank)> = OnceLock::new();
    match language {
        Language::Rust => (ScriptedSum::descriptor(), bank::of(ScriptedSum::descriptor().run).unwrap()),
        Language::C => *IN_C.get_or_init(|| {
            let blocks = modules::with_banks_of("told", &modules::AS_A_USER);
            let of = |name: &CStr| *blocks.iter().find(|(block, _)| unsafe { CStr::from_ptr(block.name) } == name).unwrap();
            assert!(of(c"large").1.is_none(), "a large block has its body once");
            let (block, bank) = of(c"told");
            // Installing registers the block's code, so that a signal in it can end it.
            drop(install(0, block, None, None));
            (block, bank.expect("a small one is run in a bank"))
        }),
    }
}

/// Counted entries of `ScriptedSum`; `KIND` distinguishes them as different blocks; the odd ones are in C.
unsafe extern "C" fn single<const KIND: usize>(memory: *mut c_void, given: *const Invocation) -> u64 {
    SINGLE.set(SINGLE.get() + 1);
    unsafe { (told(LANGUAGES[black_box(KIND) % 2]).0.run)(memory, given) }
}

unsafe extern "C" fn banked<const KIND: usize>(calls: *const Call, step: *mut u32, from: u32, to: u32) -> u64 {
    let result = unsafe { told(LANGUAGES[black_box(KIND) % 2]).1(calls, step, from, to) };
    BANKED.set(BANKED.get() + u64::from(unsafe { step.read() } + 1 - from));
    result
}

/// Two kinds of blocks with the same behaviour.
type Kinds = [&'static Descriptor; 2];

/// Returns the kinds with a bank entry, and without one.
fn kinds(language: Language, has_bank: bool) -> Kinds {
    static KINDS: OnceLock<[[Kinds; 2]; 2]> = OnceLock::new();
    let kinds = KINDS.get_or_init(|| {
        let with = |language, run| -> &'static Descriptor { Box::leak(Box::new(Descriptor { run, ..*told(language).0 })) };
        bank::add(single::<4>, banked::<4>);
        bank::add(single::<5>, banked::<5>);
        bank::add(single::<6>, banked::<6>);
        bank::add(single::<7>, banked::<7>);
        [
            [[with(Language::Rust, single::<0>), with(Language::Rust, single::<2>)], [with(Language::Rust, single::<4>), with(Language::Rust, single::<6>)]],
            [[with(Language::C, single::<1>), with(Language::C, single::<3>)], [with(Language::C, single::<5>), with(Language::C, single::<7>)]],
        ]
    });
    kinds[usize::from(language == Language::C)][usize::from(has_bank)]
}

/// One block of a program.
#[derive(Clone, Debug)]
struct ProgramBlock {
    kind: usize,
    reads: usize,
    /// Index of its activation, due at every firing or at every second one.
    slot: usize,
    drivers: Vec<u32>,
    told: (u64, u32),
}

/// Returns independent blocks, each with its own value.
fn side_by_side(n: usize) -> Vec<ProgramBlock> {
    (0..n).map(|at| ProgramBlock { kind: 0, reads: at, slot: 0, drivers: vec![], told: (0, act::NOTHING) }).collect()
}

#[derive(Debug, PartialEq)]
struct RunResult {
    values: Vec<Vec<u8>>,
    /// Output, sum, number, number at activation.
    blocks: Vec<(Vec<u8>, Vec<u8>, u64, u64)>,
    told: Vec<String>,
    stopped: bool,
}

struct Program {
    host: Host,
    source: SourceId,
    blocks: Vec<Arc<Block>>,
    cells: Vec<Cell>,
    activations: [Arc<Activation>; 2],
    process: Arc<Process>,
    told: Vec<String>,
}

impl Program {
    fn new(made: &[ProgramBlock], kinds: Kinds) -> Program {
        let host = virtual_host(1);
        let source = host.add_source(timer("fast", MS as u64, 80)).unwrap();
        let cells = cells(2 * made.len());
        for (cell, value) in cells.iter().zip(1..) {
            cell.store(&f64::from(value).to_ne_bytes());
        }
        let process = Process::new(1, 1);
        process.set_stages(vec![Stage { watches: vec![Watch { block: None, item: Watch::FAULT, condition: 9, priority: 0, response: Response::Tell }] }]);
        let mut program = Program { host, source, blocks: vec![], cells, activations: [limited(), limited()], process, told: vec![] };
        program.blocks = made.iter().enumerate().map(|(at, made)| program.block(at, made, made.reads, kinds[made.kind])).collect();
        let [first, second] = program.activations.clone();
        let stage = Op::Stage { process: program.process.clone(), stage: 0, generation: Some(1) };
        program.submit(vec![Op::Table(Box::new(program.table(made))), stage, Op::On(first, 1), Op::On(second, 2)]);
        program
    }

    fn block(&self, at: usize, made: &ProgramBlock, reads: usize, kind: &'static Descriptor) -> Arc<Block> {
        let mut block = install(at as u32, kind, Some(&self.cells[reads]), Some(&self.cells[self.cells.len() / 2 + at]));
        block.set(WHEN, &made.told.0.to_ne_bytes());
        block.set(ACT, &made.told.1.to_ne_bytes());
        Arc::new(block)
    }

    fn table(&self, made: &[ProgramBlock]) -> Table {
        let steps = self.blocks.iter().zip(made).map(|(block, made)| step(block, &self.activations[made.slot], &self.process, &made.drivers));
        table(steps.collect())
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
            (block.value(1).load(), block.value(5).load(), number, activated)
        };
        let values = self.cells.iter().map(|cell| cell.load().to_vec()).collect();
        let blocks = self.blocks.iter().map(of).collect();
        let stopped = self.host.statistics(self.source).stopped;
        RunResult { values, blocks, told: self.told.clone(), stopped }
    }

    fn numbers(&self) -> Vec<u64> {
        self.blocks.iter().map(|block| unsafe { (*block.header()).number }).collect()
    }
}

/// Returns the number of invocations of `run` through single entries and through bank entries.
fn counted(run: impl FnOnce()) -> (u64, u64) {
    SINGLE.set(0);
    BANKED.set(0);
    run();
    (SINGLE.get(), BANKED.get())
}

/// Runs both programs for `firings`, checks that they are equal, and returns the one with bank entries.
fn alike(language: Language, made: &[ProgramBlock], firings: i64) -> Program {
    alike_of(language, made, firings, "")
}

/// Does the same; `origin` states how to reproduce the program.
fn alike_of(language: Language, made: &[ProgramBlock], firings: i64, origin: &str) -> Program {
    let [single, banked] = [false, true].map(|has_bank| {
        let mut program = Program::new(made, kinds(language, has_bank));
        program.fire(firings);
        program
    });
    assert_eq!(single.seen(), banked.seen(), "{origin} {language:?} {made:?}");
    banked
}

#[test]
fn blocks_of_one_kind_side_by_side_are_run_by_the_bank_entry() {
    for language in LANGUAGES {
        assert_eq!(counted(|| drop(alike(language, &side_by_side(8), 3))), (3 * 8, 3 * 8));
        // A few blocks are not worth a bank, and a bank ends where another kind or another activation begins.
        assert_eq!(counted(|| Program::new(&side_by_side(3), kinds(language, true)).fire(1)), (3, 0));
        let mut made = side_by_side(12);
        made[5].kind = 1;
        made[10].slot = 1;
        assert_eq!(counted(|| Program::new(&made, kinds(language, true)).fire(1)).1, 5 + 4);
    }
}

#[test]
fn what_comes_in_the_middle_of_a_bank_is_told_of_its_block_and_the_others_run() {
    for language in LANGUAGES {
        for act in [act::REPORT, act::RETURN, act::PANIC, act::NONFINITE] {
            let mut made = side_by_side(9);
            made[4].told = (2, act);
            made[6].drivers = vec![4];
            let program = alike(language, &made, 5);
            let is_told = |text: &&String| text.contains("BlockId(4)");
            assert_eq!((program.told.len(), program.told.iter().filter(is_told).count()), (1, 1), "{:?}", program.told);
            assert_eq!(program.numbers(), [5; 9]);
            // The blocks it drives waited for it when it faulted; their sum is an invocation short.
            let sum = |at: usize| f64::from_ne_bytes(program.blocks[at].value(5).load().try_into().unwrap());
            let through = if act == act::REPORT { 5.0 } else { 4.0 };
            assert_eq!((sum(4), sum(5), sum(6)), (5.0 * through, 6.0 * 5.0, 7.0 * through));
        }
    }
}

#[test]
fn a_signal_in_the_middle_of_a_bank_ends_its_block() {
    for language in LANGUAGES {
        for (act, fault) in [(act::NULL_POINTER, "Signal(11)"), (act::DIVIDE, "Signal(8)"), (act::LOOP, "Budget")] {
            let mut made = side_by_side(9);
            made[4].told = (2, act);
            let program = alike(language, &made, 5);
            let stopped = program.told.iter().find(|text| text.starts_with("Stopped")).unwrap();
            assert!(stopped.contains("BlockId(4)") && stopped.contains(fault), "{stopped}");
            assert_eq!(program.numbers(), [3, 3, 3, 3, 3, 2, 2, 2, 2], "it has the number of its invocation, without a mark; none behind it ran");
            // Releases during the stop count.
            let again = [false, true].map(|has_bank| {
                let mut program = Program::new(&made, kinds(language, has_bank));
                program.fire(5);
                program.host.restart(program.source);
                program.fire(2);
                program
            });
            assert_eq!(again[0].seen(), again[1].seen());
            assert_eq!(again[1].numbers(), [7, 7, 7, 7, 7, 6, 6, 6, 6]);
        }
    }
}

#[test]
fn the_probe_visits_one_by_itself_and_the_rest_are_a_bank() {
    for language in LANGUAGES {
        let made = side_by_side(8);
        let mut program = Program::new(&made, kinds(language, true));
        program.host.probe(program.source, u64::MAX / 4);
        assert_eq!(counted(|| program.fire(16)), (16, 16 * 7));
        let samples: Vec<u64> = program.blocks.iter().map(|block| program.host.block_times(program.source, block).samples).collect();
        assert_eq!(samples, [2; 8]);
        let mut single = Program::new(&made, kinds(language, false));
        single.fire(16);
        assert_eq!(single.seen(), program.seen());
    }
}

#[test]
fn a_block_is_exchanged_within_a_bank() {
    for (language, kind) in LANGUAGES.into_iter().flat_map(|language| [(language, 0), (language, 1)]) {
        let exchanged = [false, true].map(|has_bank| {
            let mut made = side_by_side(9);
            let mut program = Program::new(&made, kinds(language, has_bank));
            program.fire(3);
            made[4].kind = kind;
            program.blocks[4] = program.block(4, &made[4], 0, kinds(language, has_bank)[kind]);
            program.submit(vec![Op::Table(Box::new(program.table(&made)))]);
            let by_banks = counted(|| program.fire(3)).1;
            assert_eq!(by_banks, if has_bank { 3 * [9, 8][kind] } else { 0 });
            program
        });
        assert_eq!(exchanged[0].seen(), exchanged[1].seen());
        assert_eq!(exchanged[1].numbers(), [6, 6, 6, 6, 3, 6, 6, 6, 6]);
    }
}

/// Returns blocks of two kinds and two activations in runs of any length, which read each other, drive each other, and occasionally act.
fn any(seed: &mut u64) -> Vec<ProgramBlock> {
    let n = 1 + random_below(seed, 40) as usize;
    let acts = if random_below(seed, 4) == 0 { act::DIVIDE } else { act::NONFINITE };
    let (mut kind, mut slot) = (0, 0);
    let made = (0..n).map(|at| {
        if random_below(seed, 6) == 0 {
            (kind, slot) = (random_below(seed, 2) as usize, random_below(seed, 2) as usize);
        }
        let drivers = (0..at as u32).filter(|_| random_below(seed, 8 * n as u64) < 8).collect();
        let told = if random_below(seed, 5) == 0 { (random_below(seed, 10), random_below(seed, u64::from(acts) + 1) as u32) } else { (0, act::NOTHING) };
        ProgramBlock { kind, reads: random_below(seed, 2 * n as u64) as usize, slot, drivers, told }
    });
    made.collect()
}

#[test]
fn any_program_runs_alike_with_banks_and_without() {
    let (count, first) = (setting("OPENGPAC_BANKS", 300), setting("OPENGPAC_SEED", 1).max(1));
    let (mut faults, mut stopped) = (0, 0);
    let (_, by_banks) = counted(|| {
        for seed in first..first + count {
            let language = LANGUAGES[(seed % 2) as usize];
            let program = alike_of(language, &any(&mut seed.wrapping_mul(0x9e37_79b9_7f4a_7c15)), 12, &format!("OPENGPAC_SEED={seed} OPENGPAC_BANKS=1"));
            faults += program.host.statistics(program.source).faults;
            stopped += u64::from(program.host.statistics(program.source).stopped);
        }
    });
    println!("{count} programs, {by_banks} invocations by banks, {faults} faults, {stopped} ended by a signal");
    assert!(by_banks > 0 && faults > 0, "something happens in banks");
}
