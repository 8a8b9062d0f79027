// SPDX-License-Identifier: Apache-2.0
//! Random programs of moves of arms with 6 and 7 joints, travelled at overrides that jump, with pauses, steps back and halts: no limit is
//! exceeded, nothing jumps, and the path is the same. `OPENGPAC_QUEUES=100000` runs more than the thousand of `make test`,
//! `OPENGPAC_QUEUES_FROM=seed` others.
mod programs;
mod random;
mod steps;
mod travel;

use library::kinematics::pose::Pose;
use library::online::{Profile, State};
use library::profile::Limits;
use library::queue::marks::{MarkWish, Outputs};
use library::queue::{QueuedMove, Refusal, Run, Sample, Shrunk};
use programs::{Program, joints_to, line_to, new_path, numbers, six, wide};
use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use travel::{CYCLE_S, Travel};

struct Counting;

thread_local! {
    static ALLOCATIONS: Cell<u64> = const { Cell::new(0) };
}

// SAFETY: every call goes to the system's allocator unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ALLOCATIONS.with(|count| count.set(count.get() + 1));
        // SAFETY: the caller's contract is the one that is required.
        unsafe { System.alloc(layout) }
    }
    unsafe fn dealloc(&self, place: *mut u8, layout: Layout) {
        // SAFETY: as above.
        unsafe { System.dealloc(place, layout) }
    }
}

#[global_allocator]
static COUNTING: Counting = Counting;

fn cases() -> u64 {
    std::env::var("OPENGPAC_QUEUES").map_or(1000, |count| count.parse().expect("a number"))
}

/// Travels a program with moves that come at any time, overrides that jump, pauses, steps back, and a halt at the end of some.
fn random_travel(program: &Program, seed: u64) -> (u64, u64) {
    let mut number = numbers(seed ^ 0x5eed);
    let mut travel = Travel::begin(program);
    let mut rate = 1.0;
    let halts_at = if number(0.0, 1.0) < 0.2 { number(10.0, 3000.0) as u64 } else { u64::MAX };
    while !travel.is_over() {
        if number(0.0, 1.0) < 0.01 {
            travel.append(|_| ());
        }
        if number(0.0, 1.0) < 0.008 {
            rate = match number(0.0, 5.0) as u32 {
                0 => 0.0,
                1 => 1.0,
                2 => -number(0.0, 1.0),
                _ => number(0.1, 1.0),
            };
        }
        if travel.steps > 5_000 {
            rate = 1.0;
        }
        if travel.steps == halts_at {
            while !travel.run.is_at_rest() {
                travel.step(CYCLE_S, 0.0, seed);
            }
            break;
        }
        travel.step(CYCLE_S, rate, seed);
    }
    if travel.is_over() {
        let end = travel.path.end;
        assert_eq!(travel.before.q[..program.n], end[..program.n], "seed {seed}: it ends exactly at the goal");
    }
    (travel.digest, travel.steps)
}

#[test]
fn no_limit_is_exceeded_whatever_happens_and_a_second_run_has_the_same_bits() {
    let (mut moves, mut steps) = (0, 0);
    let first = std::env::var("OPENGPAC_QUEUES_FROM").map_or(1, |seed| seed.parse().expect("a number"));
    for seed in first..first + cases() {
        let program = random::program(seed);
        moves += program.moves.len();
        let first = random_travel(&program, seed);
        assert_eq!(first, random_travel(&program, seed), "seed {seed}");
        steps += first.1;
    }
    println!("{} programs of {moves} moves, {steps} set-points, each twice", cases());
    assert!(moves as u64 > 2 * cases(), "only {moves} moves were possible");
}

#[test]
fn a_blend_that_comes_late_is_made_only_if_the_moves_before_it_can_slow_down() {
    // In these programs the arm enters a move, at the speed from which it can stop at its end, when that end becomes a blend.
    for seed in [17_144, 30_616] {
        let program = random::program(seed);
        random_travel(&program, seed);
    }
}

#[test]
fn the_path_is_the_same_at_every_override_and_through_pauses_and_steps_back() {
    for seed in 1..=cases() / 10 {
        let program = random::program(seed);
        let mut first = Travel::begin(&program);
        while first.append(|_| ()) {}
        let mut reference = vec![first.before];
        while !first.is_over() {
            reference.push(first.step(CYCLE_S / 4.0, 1.0, seed));
        }
        let mut number = numbers(seed + 77);
        let mut second = Travel::begin(&program);
        while second.append(|_| ()) {}
        let mut rate = 0.3;
        while !second.is_over() {
            if number(0.0, 1.0) < 0.01 {
                rate = if second.steps > 10_000 { 1.0 } else { number(-0.5, 1.0) };
            }
            let now = second.step(CYCLE_S, rate, seed);
            let k = reference.partition_point(|sample| sample.place() < now.place()).clamp(1, reference.len() - 1);
            let (a, b) = (&reference[k - 1], &reference[k]);
            if a.number != b.number {
                // Between two moves the fraction has another scale.
                continue;
            }
            let share = (now.place() - a.place()) / (b.place() - a.place()).max(1e-300);
            for i in 0..program.n {
                let there = a.q[i] + (b.q[i] - a.q[i]) * share.clamp(0.0, 1.0);
                assert!((now.q[i] - there).abs() <= 1e-6, "seed {seed}: joint {i} is {} off the path at {}", now.q[i] - there, now.place());
            }
        }
        assert_eq!(first.path.spans, second.path.spans, "seed {seed}: the geometry has the same bits");
    }
}

#[test]
fn neither_a_move_nor_a_cycle_allocates() {
    let before = ALLOCATIONS.with(Cell::get);
    drop(std::hint::black_box(Box::new(1)));
    assert_eq!(ALLOCATIONS.with(Cell::get), before + 1, "the counter counts");
    for seed in 1..40 {
        let program = random::program(seed);
        let arm = program.chain.read(program.n).expect("a chain");
        let (mut path, mut run) = (new_path(), Run::default());
        let before = ALLOCATIONS.with(Cell::get);
        path.clear(&program.start, program.n);
        for asked in &program.moves {
            path.append(asked, &program.around(&arm), &run).expect("a move");
            run.renew();
            for k in 0..300 {
                run.advance(&path, CYCLE_S, if k == 100 { 0.3 } else { 1.0 });
                std::hint::black_box(run.sample(&path));
            }
        }
        assert_eq!(ALLOCATIONS.with(Cell::get), before, "seed {seed}");
    }
}

#[test]
fn a_blend_is_never_slower_than_a_stop() {
    let (mut blended_s, mut stopped_s) = (0.0, 0.0);
    for seed in 1..=cases() / 5 {
        let program = random::program(seed);
        let blended = Travel::begin(&program).finish(seed, |_| ());
        let stopped = Travel::begin(&program).finish(seed, |asked| asked.blend = 0.0);
        assert!(blended <= stopped + 2.0 * CYCLE_S, "seed {seed}: {blended} s with blends, {stopped} s with stops");
        (blended_s, stopped_s) = (blended_s + blended, stopped_s + stopped);
    }
    println!("with blends {blended_s:.1} s, with stops {stopped_s:.1} s");
    assert!(blended_s < 0.98 * stopped_s, "{blended_s} s with blends, {stopped_s} s with stops");
}

#[test]
fn a_line_of_the_joints_takes_as_long_as_the_motion_to_a_position() {
    for seed in 1..200 {
        let mut program = random::program(seed);
        let mut number = numbers(seed);
        let goal: Vec<f64> = program.start[..program.n].iter().map(|q| q + number(-1.0, 1.0)).collect();
        program.moves = vec![joints_to(1, &goal, &program.joints)];
        let ours = Travel::begin(&program).finish(seed, |_| ());
        let line = |of: fn(&Limits) -> f64| (0..program.n).map(|i| of(&program.joints[i]) / (goal[i] - program.start[i]).abs()).fold(f64::INFINITY, f64::min);
        let limits = Limits { speed: line(|l| l.speed), acceleration: line(|l| l.acceleration), jerk: line(|l| l.jerk) };
        let theirs = Profile::to(State::default(), 1.0, limits).duration_s();
        assert!(ours < theirs * 1.0001 + CYCLE_S && ours > theirs - CYCLE_S, "seed {seed}: {ours} s of {theirs} s");
    }
}

#[test]
fn a_blend_that_does_not_fit_is_smaller_and_says_why() {
    let (chain, home) = six();
    let arm = chain.read(6).expect("a chain");
    let joints = vec![Limits { speed: 3.0, acceleration: 10.0, jerk: 100.0 }; 6];
    let by = |i: usize, way: f64| home.iter().enumerate().map(|(k, q)| if k == i { q + way } else { *q }).collect::<Vec<f64>>();
    let program = Program { chain, n: 6, start: wide(&home), joints: joints.clone(), moves: Vec::new() };
    let reason = |blend: f64, first: f64, second: f64, mode: i32, steps: u32| {
        let mut path = new_path();
        path.clear(&wide(&home), 6);
        let mut run = Run::default();
        let one = QueuedMove { blend, blend_unit: 1, ..joints_to(1, &by(0, first), &joints) };
        path.append(&one, &program.around(&arm), &run).expect("a line");
        run.renew();
        (0..steps).for_each(|_| run.advance(&path, CYCLE_S, 1.0));
        let mut goal = by(0, first);
        goal[1] += second;
        path.append(&QueuedMove { mode, ..joints_to(2, &goal, &joints) }, &program.around(&arm), &run).expect("a line");
        let end = *path.end_of(1);
        (end.reason, (end.kept * 1000.0).round() / 1000.0)
    };
    assert_eq!(reason(0.1, 1.0, 1.0, 1, 0), (Shrunk::No as i64, 1.0));
    assert_eq!(reason(0.5, 1.0, 1.0, 1, 0), (Shrunk::No as i64, 1.0));
    assert_eq!(reason(0.8, 1.0, 2.0, 1, 0), (Shrunk::HalfOfMove as i64, 0.625));
    assert_eq!(reason(0.4, 1.0, 0.2, 1, 0), (Shrunk::HalfOfNext as i64, 0.25));
    assert_eq!(reason(0.0, 1.0, 1.0, 1, 0), (Shrunk::No as i64, 0.0));
    assert_eq!(reason(0.1, 1.0, 1.0, 0, 0), (Shrunk::Stopped as i64, 0.0));
    assert_eq!(reason(0.2, 1.0, 1.0, 1, 2000), (Shrunk::Late as i64, 0.0));
}

#[test]
fn what_an_arm_cannot_do_is_refused_and_changes_nothing() {
    let (chain, home) = six();
    let arm = chain.read(6).expect("a chain");
    let joints = vec![Limits { speed: 3.0, acceleration: 10.0, jerk: 100.0 }; 6];
    let program = Program { chain, n: 6, start: wide(&home), joints: joints.clone(), moves: Vec::new() };
    let mut path = new_path();
    path.clear(&wide(&home), 6);
    path.append(&joints_to(1, &home.iter().map(|q| q + 0.2).collect::<Vec<f64>>(), &joints), &program.around(&arm), &Run::default()).expect("a line");
    let before = (path.end_piece, path.end_span, path.tip, path.end);
    let tool = arm.posture(&path.end[..6]).tool;
    let far = Pose { position: [3.0, 0.0, 0.0], ..tool };
    let refused = [
        path.append(&line_to(2, &far, 0.2), &program.around(&arm), &Run::default()),
        path.append(&joints_to(2, &[0.0, 0.0, 0.0, 0.0, 9.0, 0.0], &joints), &program.around(&arm), &Run::default()),
        path.append(&joints_to(2, &[f64::NAN; 6], &joints), &program.around(&arm), &Run::default()),
        path.append(&QueuedMove { kind: 2, via: tool.numbers(), ..line_to(2, &far, 0.2) }, &program.around(&arm), &Run::default()),
    ];
    assert!(matches!(refused[0], Err(Refusal::Unreachable(distance)) if distance > 1.0), "{refused:?}");
    assert_eq!(refused[1..], [Err(Refusal::Limit(4)), Err(Refusal::Bad), Err(Refusal::NoArc(1))]);
    assert_eq!(before, (path.end_piece, path.end_span, path.tip, path.end));
}

#[test]
fn outputs_are_switched_at_their_places_at_any_override_and_back_on_the_way_back() {
    let (chain, home) = six();
    let arm = chain.read(6).expect("a chain");
    let joints = vec![Limits { speed: 3.0, acceleration: 10.0, jerk: 100.0 }; 6];
    let start = arm.posture(&home).tool;
    let goal = Pose { position: [start.position[0] + 0.2, start.position[1], start.position[2]], ..start };
    let program = Program { chain, n: 6, start: wide(&home), joints, moves: Vec::new() };
    let mark = |output: i32, on: i32, before: f64, ahead: f64| MarkWish { output, on, before, unit: 2, ahead };
    let asked = QueuedMove { marks: [mark(1, 1, 0.15, 0.0), mark(2, 1, 0.1, 0.02), mark(1, 0, 0.05, 0.0), mark(0, 0, 0.0, 0.0)], ..line_to(1, &goal, 0.2) };
    for rate in [0.1, 0.35, 1.0] {
        let mut path = new_path();
        path.clear(&wide(&home), 6);
        path.append(&asked, &program.around(&arm), &Run::default()).expect("a line");
        let mut run = Run::default();
        let way = |sample: &Sample| arm.posture(&sample.q[..6]).tool.position[0] - start.position[0];
        let mut seen = [f64::NAN; 3];
        let mut before = path.outputs(&run.sample(&path));
        assert_eq!(before, Outputs::default());
        while !run.is_at_end(&path) {
            run.advance(&path, CYCLE_S, rate);
            let now = run.sample(&path);
            let outputs = path.outputs(&now);
            for (k, changed) in [before.on & 1 < outputs.on & 1, before.on & 2 < outputs.on & 2, before.on & 1 > outputs.on & 1].iter().enumerate() {
                if *changed {
                    seen[k] = way(&now);
                }
            }
            before = outputs;
        }
        assert_eq!((before.switched, before.on), (3, 2));
        let cycle = 0.2 * rate * CYCLE_S + 1e-6;
        for (found, place) in seen.iter().zip([0.05, 0.1 - 0.2 * rate * 0.02, 0.15]) {
            assert!((place..place + cycle).contains(&(found + 5e-7)), "{seen:?} at {rate}: {found} for {place}");
        }
        while run.s > 0.0 || !run.is_at_rest() {
            run.advance(&path, CYCLE_S, -1.0);
        }
        assert_eq!(path.outputs(&run.sample(&path)), Outputs::default(), "back at the start nothing is switched");
    }
}
