// SPDX-License-Identifier: Apache-2.0
//! Conditions: reactions in the same firing, priorities, remembered conditions, claims, `execute`.
#![allow(clippy::undocumented_unsafe_blocks, clippy::macro_metavars_in_unsafe, reason = "test blocks are written by hand against the ABI")]
mod support;
use kernel::*;
use runtime::Host;
use std::sync::Arc;
use support::*;

const MS: i64 = 1_000_000;

/// Returns a block that counts in its state and reports `done` when the count reaches its parameter.
fn count_to() -> &'static opengpac::abi::Descriptor {
    block!(|this, _| {
        this.state += 1;
        this.y = this.state;
        this.report = 10 * this.state;
        if this.state == this.parameter { DONE } else { 0 }
    })
}

fn counter(id: u32, to: i64, output: &Cell) -> Arc<Block> {
    let mut block = install(id, count_to(), None, Some(output));
    block.set(PARAMETER, &to.to_ne_bytes());
    Arc::new(block)
}

fn watch(block: u32, condition: u16, priority: i32, response: Response) -> Watch {
    Watch { block: Some(BlockId(block)), item: CONDITION as u8, condition, priority, response }
}

fn react(ops: Vec<Op>, next: Option<u16>) -> Response {
    Response::React { script: Arc::new(Script { id: 0, ops }), next }
}

struct Program {
    host: Host,
    source: SourceId,
    cells: Vec<Cell>,
    process: Arc<Process>,
    activations: Vec<Arc<Activation>>,
    blocks: Vec<Arc<Block>>,
}

/// Creates blocks 1, 2, … that count to `to`, each with its own activation, initially off.
fn program(to: &[i64]) -> Program {
    let host = virtual_host(1);
    let source = host.add_source(timer("fast", MS as u64, 80)).unwrap();
    let cells = cells(to.len());
    let process = Process::new(5, 1);
    let activations: Vec<_> = to.iter().map(|_| interval()).collect();
    let blocks: Vec<_> = to.iter().zip(&cells).zip(1..).map(|((to, cell), id)| counter(id, *to, cell)).collect();
    let steps = blocks.iter().zip(&activations).map(|(block, activation)| step(block, activation, &process, &[])).collect();
    host.submit(source, script(vec![Op::Table(Box::new(table(steps)))]));
    Program { host, source, cells, process, activations, blocks }
}

impl Program {
    fn start(&self, on: &[usize]) {
        let mut ops = vec![Op::Stage { process: self.process.clone(), stage: 0, generation: Some(1) }, Op::StartClock(self.process.clone())];
        ops.extend(on.iter().map(|&index| Op::On(self.activations[index].clone(), 1)));
        self.host.submit(self.source, script(ops));
    }

    fn values(&self) -> Vec<i64> {
        self.cells.iter().map(value).collect()
    }

    /// Returns (condition, acted, ended, stage, time in ms) of the conditions reported so far.
    fn conditions(&self) -> Vec<(u16, bool, bool, Option<u16>, i64)> {
        let told = events(&self.host).into_iter();
        told.filter_map(|event| {
            if let Event::Condition { condition, acted, ended, stage, time_ns, .. } = event {
                Some((condition, acted, ended, stage, time_ns / MS))
            } else {
                None
            }
        })
        .collect()
    }
}

#[test]
fn a_reaction_takes_effect_in_the_firing_of_its_condition() {
    let p = program(&[3, 100]);
    let (a, b) = (p.activations[0].clone(), p.activations[1].clone());
    let first = Stage { watches: vec![watch(1, 4, 0, react(vec![Op::Off(a), Op::On(b, 1), Op::Capture(vec![p.cells[0].clone()])], Some(1)))] };
    p.process.set_stages(vec![first, Stage { watches: vec![] }]);
    p.start(&[0]);
    run_until(&p.host, 3 * MS);
    assert_eq!(p.values(), [3, 0]);
    run_until(&p.host, 5 * MS);
    assert_eq!(p.values(), [3, 2]);
    assert_eq!(p.process.now(), (1, 1));
    let told: Vec<_> = events(&p.host).into_iter().skip(2).collect();
    match told.as_slice() {
        [Event::Condition { condition: 4, acted: true, ended: false, stage: Some(1), number: 2, time_ns: 3_000_000, value, captured, .. }] => {
            assert_eq!(value, &30i64.to_ne_bytes());
            assert_eq!(captured, &3i64.to_ne_bytes());
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn only_the_first_by_priority_then_declaration_moves_the_process() {
    let p = program(&[2, 2, 2]);
    let stages = vec![Stage { watches: vec![watch(1, 1, 0, Response::Tell), watch(2, 2, 9, react(vec![], None)), watch(3, 3, 9, Response::Tell)] }];
    p.process.set_stages(stages);
    p.start(&[0, 1, 2]);
    run_until(&p.host, 3 * MS);
    assert_eq!(p.conditions(), [(2, true, true, None, 2), (3, false, false, None, 2), (1, false, false, None, 2)]);
    assert!(!p.process.claim(1), "the kernel was faster");
}

#[test]
fn a_condition_of_a_claimed_process_is_recorded_and_not_served() {
    let p = program(&[2]);
    p.process.set_stages(vec![Stage { watches: vec![watch(1, 1, 0, react(vec![], None))] }]);
    p.start(&[0]);
    assert!(p.process.claim(1));
    assert!(!p.process.claim(1), "once");
    run_until(&p.host, 3 * MS);
    let told = events(&p.host);
    assert!(matches!(told.last(), Some(Event::Condition { generation: 1, acted: false, ended: false, .. })), "{told:?}");
    assert_eq!(p.process.now().0, 2);
}

#[test]
fn a_remembered_condition_acts_when_its_stage_is_entered() {
    let p = program(&[2, 4]);
    let (a, b) = (p.activations[0].clone(), p.activations[1].clone());
    let first = Stage { watches: vec![watch(1, 1, 0, Response::Remember), watch(2, 2, 0, react(vec![Op::Off(b)], Some(1)))] };
    let second = Stage { watches: vec![watch(1, 1, 0, react(vec![Op::Off(a)], None))] };
    p.process.set_stages(vec![first, second]);
    p.start(&[0, 1]);
    run_until(&p.host, 8 * MS);
    assert_eq!(p.conditions(), [(1, false, false, None, 2), (2, true, false, Some(1), 4), (1, true, true, None, 4)]);
    assert_eq!(p.values(), [4, 4]);
}

#[test]
fn a_wait_finds_what_came_in_the_same_firing_whatever_the_order() {
    let p = program(&[3, 3]);
    let first = Stage { watches: vec![watch(2, 2, 5, react(vec![], Some(1))), watch(1, 1, 0, Response::Remember)] };
    let second = Stage { watches: vec![watch(1, 1, 0, react(vec![], None))] };
    p.process.set_stages(vec![first, second]);
    p.start(&[0, 1]);
    run_until(&p.host, 3 * MS);
    assert_eq!(p.conditions(), [(1, false, false, None, 3), (2, true, false, Some(1), 3), (1, true, true, None, 3)]);
}

#[test]
fn execute_is_one_firing_at_once_and_its_condition_is_served_after_the_script() {
    let p = program(&[1, 100]);
    let ended = react(vec![Op::Off(p.activations[1].clone())], None);
    p.process.set_stages(vec![Stage { watches: vec![watch(1, 1, 0, ended)] }]);
    run_until(&p.host, 2 * MS);
    let ops = vec![
        Op::Stage { process: p.process.clone(), stage: 0, generation: Some(1) },
        Op::Execute(vec![p.blocks[0].clone()]),
        Op::On(p.activations[1].clone(), 1),
    ];
    p.host.submit(p.source, script(ops));
    assert_eq!(p.values(), [1, 0]);
    run_until(&p.host, 5 * MS);
    assert_eq!(p.values(), [1, 0], "the reaction came after the whole script");
    assert_eq!(p.conditions(), [(1, true, true, None, 2)]);
    assert_eq!(p.host.statistics(p.source).firings, 5);
}

#[test]
fn what_stands_behind_a_while_is_not_started_once_an_execute_ended_the_process() {
    let p = program(&[1, 100]);
    p.process.set_stages(vec![Stage { watches: vec![watch(1, 1, 0, react(vec![], None))] }]);
    let ops = vec![
        Op::Stage { process: p.process.clone(), stage: 0, generation: Some(1) },
        Op::Execute(vec![p.blocks[0].clone()]),
        Op::While { process: p.process.clone(), generation: 1 },
        Op::On(p.activations[1].clone(), 1),
    ];
    p.host.submit(p.source, script(ops));
    run_until(&p.host, 5 * MS);
    assert_eq!(p.values(), [1, 0]);
}

#[test]
fn a_reset_restores_the_initial_state_and_number_and_its_parameters() {
    let p = program(&[100]);
    p.process.set_stages(vec![]);
    p.start(&[0]);
    run_until(&p.host, 4 * MS);
    let ops = vec![
        Op::Off(p.activations[0].clone()),
        Op::Reset(p.blocks[0].clone()),
        Op::On(p.activations[0].clone(), 2),
        Op::Capture(vec![p.blocks[0].value(PARAMETER)]),
    ];
    p.host.submit(p.source, script(ops));
    run_until(&p.host, 8 * MS);
    assert_eq!(p.values(), [2]);
    assert!(matches!(events(&p.host).pop(), Some(Event::Done { captured, .. }) if captured == 100i64.to_ne_bytes()));
}

#[test]
fn a_process_that_is_taken_before_its_stage_never_enters_it() {
    let p = program(&[2]);
    p.process.set_stages(vec![Stage { watches: vec![watch(1, 1, 0, Response::Tell)] }]);
    assert_eq!(p.process.take(1, false), TakeResult::Before);
    p.start(&[0]);
    run_until(&p.host, 4 * MS);
    assert_eq!(p.conditions(), [(1, false, false, None, 2)], "the stage of the generation that was passed is not in force");
}

#[test]
fn a_freeze_is_taken_over_only_by_who_insists() {
    let p = program(&[2]);
    p.process.set_stages(vec![Stage { watches: vec![watch(1, 1, 0, Response::Tell)] }]);
    p.start(&[0]);
    run_until(&p.host, 3 * MS);
    assert_eq!(p.process.take(1, false), TakeResult::Late);
    assert_eq!(p.process.take(1, true), TakeResult::From(0));
    assert_eq!(p.process.take(1, true), TakeResult::Late, "once");
    assert_eq!(p.process.now().0, 2);
}
