// SPDX-License-Identifier: Apache-2.0
//! The probe: which blocks it visits, when, and that it changes nothing.
#![allow(clippy::undocumented_unsafe_blocks, clippy::macro_metavars_in_unsafe, reason = "test blocks are written by hand against the ABI")]
mod support;
use kernel::*;
use runtime::Host;
use std::sync::Arc;
use support::*;

const MS: i64 = 1_000_000;
/// Interval longer than any test.
const LONG: u64 = 3_600_000_000_000;

/// Returns a block that counts its invocations.
fn count() -> &'static opengpac::abi::Descriptor {
    block!(|this, _| {
        this.state += 1;
        this.y = this.state;
        0
    })
}

struct Program {
    host: Host,
    source: SourceId,
    blocks: Vec<Arc<Block>>,
    cells: Vec<Cell>,
}

impl Program {
    /// Creates blocks with an activation each, at these intervals of a timer of 1 ms.
    fn of(intervals: &[u32]) -> Program {
        let host = virtual_host(1);
        let source = host.add_source(timer("fast", MS as u64, 80)).unwrap();
        let cells = cells(intervals.len());
        let process = Process::new(1, 1);
        let blocks: Vec<_> = (0..intervals.len()).map(|at| Arc::new(install(at as u32, count(), None, Some(&cells[at])))).collect();
        let activations: Vec<_> = intervals.iter().map(|_| interval()).collect();
        let steps = blocks.iter().zip(&activations).map(|(block, activation)| step(block, activation, &process, &[])).collect();
        let on = activations.iter().zip(intervals).map(|(activation, every)| Op::On(activation.clone(), *every));
        host.submit(source, script(std::iter::once(Op::Table(Box::new(table(steps)))).chain(on).collect()));
        Program { host, source, blocks, cells }
    }

    fn samples(&self) -> Vec<u64> {
        self.blocks.iter().map(|block| self.host.block_times(self.source, block).samples).collect()
    }

    fn values(&self) -> Vec<i64> {
        self.cells.iter().map(value).collect()
    }
}

#[test]
fn nothing_is_visited_until_somebody_looks_and_then_one_block_a_firing_in_turn() {
    let program = Program::of(&[1, 1, 1]);
    run_until(&program.host, 5 * MS);
    assert_eq!((program.samples(), program.host.probes(program.source)), (vec![0, 0, 0], false));
    program.host.probe(program.source, LONG);
    run_until(&program.host, 9 * MS);
    assert_eq!((program.samples(), program.host.probes(program.source)), (vec![2, 1, 1], true));
    run_until(&program.host, 14 * MS);
    assert_eq!(program.samples(), [3, 3, 3]);
}

#[test]
fn a_block_that_is_seldom_due_is_visited_when_it_is() {
    let program = Program::of(&[1, 1, 6, 4]);
    program.host.probe(program.source, LONG);
    run_until(&program.host, 24 * MS);
    assert_eq!(program.samples(), [8, 8, 4, 4], "of each firing one, of two that are due that which has waited longer");
}

#[test]
fn the_blocks_of_one_strip_are_visited_in_turn_and_copies_are_not() {
    let host = virtual_host(1);
    let source = host.add_source(timer("fast", MS as u64, 80)).unwrap();
    let cells = cells(3);
    let (process, activation) = (Process::new(1, 1), interval());
    let blocks: Vec<_> = (0..2).map(|at| Arc::new(install(at, count(), None, Some(&cells[at as usize])))).collect();
    let copy =
        Step { kind: StepKind::Copy(vec![(cells[0].clone(), cells[2].clone())]), activation: activation.clone(), process: process.clone(), drivers: vec![] };
    let steps = vec![step(&blocks[0], &activation, &process, &[]), copy, step(&blocks[1], &activation, &process, &[])];
    host.submit(source, script(vec![Op::Table(Box::new(table(steps))), Op::On(activation, 1)]));
    host.probe(source, LONG);
    run_until(&host, 7 * MS);
    assert_eq!(blocks.iter().map(|block| block.block_times().samples).collect::<Vec<_>>(), [4, 3]);
    assert_eq!(value(&cells[2]), 7);
}

#[test]
fn looking_changes_nothing_that_is_computed_and_a_fault_goes_its_way() {
    let faulty = || {
        block!(|this, invocation| {
            this.y = 100 + invocation.number as i64;
            if invocation.number == 2 { FAULT } else { 0 }
        })
    };
    let run = |looks: bool| {
        let host = virtual_host(1);
        let source = host.add_source(timer("fast", MS as u64, 80)).unwrap();
        let cells = cells(2);
        let (process, activation) = (Process::new(1, 1), interval());
        let first = Arc::new(install(1, faulty(), None, Some(&cells[0])));
        let other = Arc::new(install(2, count(), None, Some(&cells[1])));
        let steps = vec![step(&first, &activation, &process, &[]), step(&other, &activation, &process, &[])];
        host.submit(source, script(vec![Op::Table(Box::new(table(steps))), Op::On(activation, 1)]));
        if looks {
            host.probe(source, LONG);
        }
        let values: Vec<_> = (1..6)
            .map(|ms| {
                run_until(&host, ms * MS);
                (value(&cells[0]), value(&cells[1]))
            })
            .collect();
        (values, host.statistics(source).faults)
    };
    assert_eq!(run(true), run(false));
}

#[test]
fn what_is_executed_is_timed_too() {
    let host = virtual_host(1);
    let source = host.add_source(timer("fast", MS as u64, 80)).unwrap();
    let cells = cells(1);
    let (process, activation) = (Process::new(1, 1), interval());
    let block = Arc::new(install(1, count(), None, Some(&cells[0])));
    let steps = vec![step(&block, &activation, &process, &[])];
    host.probe(source, LONG);
    host.submit(source, script(vec![Op::Table(Box::new(table(steps))), Op::Execute(vec![block.clone()])]));
    run_until(&host, 3 * MS);
    assert_eq!((block.block_times().samples, value(&cells[0])), (1, 1));
}

#[test]
fn times_add_up() {
    let program = Program::of(&[1]);
    program.host.probe(program.source, LONG);
    run_until(&program.host, 100 * MS);
    let times = program.blocks[0].block_times();
    assert_eq!((times.samples, times.number, program.values()), (100, 100, vec![100]));
    assert!(times.max_ns >= times.last_ns && times.sum_ns >= times.max_ns && times.sum_ns <= 100 * times.max_ns, "{times:?}");
}

#[test]
fn a_look_that_is_over_visits_nothing_more() {
    let program = Program::of(&[1]);
    program.host.probe(program.source, 0);
    run_until(&program.host, 10 * MS);
    assert_eq!(program.samples(), [0]);
}
