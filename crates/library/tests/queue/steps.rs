// SPDX-License-Identifier: Apache-2.0
//! Moves that replace others, single steps, moves in a given time, and blends by orientation.
use super::random;
use super::{CYCLE_S, Program, Travel, joints_to, line_to, new_path, numbers, six, wide};
use library::kinematics::pose::Pose;
use library::profile::Limits;
use library::queue::run::ENDLESS;
use library::queue::{ABORTING, QueuedMove, Refusal, Run, Shrunk};

/// Returns a program of a UR5e's geometry without moves.
fn empty() -> Program {
    let (chain, home) = six();
    Program { chain, n: 6, start: wide(&home), joints: vec![Limits { speed: 3.0, acceleration: 10.0, jerk: 100.0 }; 6], moves: Vec::new() }
}

/// Returns the program with moves of the joints by these displacements of the first joints from the start, with a blend.
fn by(ways: &[[f64; 2]], blend: f64) -> Program {
    let mut program = empty();
    for (k, way) in ways.iter().enumerate() {
        let mut goal = program.start;
        (goal[0], goal[1]) = (goal[0] + way[0], goal[1] + way[1]);
        program.moves.push(QueuedMove { blend, ..joints_to(k as i64 + 1, &goal[..6], &program.joints) });
    }
    program
}

#[test]
fn an_aborting_move_replaces_the_others_at_any_time_within_all_limits() {
    let (mut blended, mut stopped) = (0, 0);
    for seed in 1..400 {
        let program = random::program(seed);
        let mut number = numbers(seed + 3);
        let mut travel = Travel::begin(&program);
        while travel.append(|_| ()) {}
        for _ in 0..number(0.0, 1500.0) as u64 {
            travel.step(CYCLE_S, 1.0, seed);
        }
        let place = travel.before.place();
        let goal: Vec<f64> = program.start[..program.n].iter().map(|q| q + number(-0.5, 0.5)).collect();
        let last = program.moves.len() as i64;
        let asked = QueuedMove { number: last + 1, mode: ABORTING, ..joints_to(last + 1, &goal, &program.joints) };
        let arm = program.chain.read(program.n).expect("a chain");
        travel.path.append(&asked, &program.around(&arm), &travel.run).unwrap_or_else(|refusal| panic!("seed {seed}: {refusal:?} at {:?}", travel.run));
        travel.run.renew();
        let corner = travel.path.piece((travel.path.end_piece - 2).max(0));
        let stops = corner.number <= last && corner.stops != 0;
        while !travel.run.is_at_end(&travel.path) {
            let now = travel.step(CYCLE_S, 1.0, seed);
            assert!(now.place() >= place, "seed {seed}: it goes back");
        }
        assert_eq!(travel.before.q[..program.n], goal[..], "seed {seed}");
        let aborted = (1..=last).filter(|k| travel.path.end_of(*k).reason == Shrunk::Aborted as i64).count() as i64;
        assert!(aborted >= last - place.floor() as i64 - 2, "seed {seed}: {aborted} of {last} moves were aborted at {place}");
        if stops {
            stopped += 1
        } else {
            blended += 1
        }
        // Back to the start: the path behind is kept, too.
        for _ in 0..20_000 {
            travel.step(CYCLE_S, -1.0, seed);
        }
    }
    println!("{blended} from a moving start, {stopped} after a stop");
    assert!(blended > 40, "{blended} from a moving start, {stopped} after a stop");
}

#[test]
fn an_aborting_move_forgets_the_outputs_of_those_that_it_replaces() {
    let mut program = by(&[[0.8, 0.0], [0.8, 0.8]], 0.0);
    program.moves[1].marks[0] = library::queue::marks::MarkWish { output: 1, on: 1, before: 0.0, unit: 0, ahead: 0.0 };
    let mut travel = Travel::begin(&program);
    while travel.append(|_| ()) {}
    for _ in 0..200 {
        travel.step(CYCLE_S, 1.0, 0);
    }
    let arm = program.chain.read(6).expect("a chain");
    let asked = QueuedMove { mode: ABORTING, ..joints_to(3, &program.start[..6], &program.joints) };
    travel.path.append(&asked, &program.around(&arm), &travel.run).expect("a move");
    travel.run.renew();
    while !travel.run.is_at_end(&travel.path) {
        travel.step(CYCLE_S, 1.0, 0);
    }
    assert_eq!(travel.path.outputs(&travel.before).switched, 0);
    assert_eq!(travel.path.end_of(2).reason, Shrunk::Aborted as i64);
}

#[test]
fn single_steps_rest_exactly_at_the_boundaries_of_moves_forwards_and_backwards() {
    for (seed, blend) in [(1, 0.3), (2, 0.0)] {
        let program = by(&[[0.8, 0.0], [0.8, 0.8], [0.0, 0.8], [0.0, 0.0]], blend);
        let mut travel = Travel::begin(&program);
        while travel.append(|_| ()) {}
        for (until, rate) in [(1, 1.0), (2, 1.0), (1, -1.0), (0, -0.5), (3, 1.0), (2, -1.0), (4, 1.0)] {
            travel.run.rest_behind(until);
            loop {
                let now = travel.step(CYCLE_S, rate, seed);
                if travel.run.is_at_rest() {
                    assert_eq!(now.place(), until as f64, "until {until}, {:?}", travel.run);
                    break;
                }
            }
            let rests = travel.before.q;
            for _ in 0..50 {
                travel.step(CYCLE_S, rate, seed);
            }
            assert_eq!(travel.before.q, rests, "it stays there");
        }
        assert!(travel.is_over());
    }
}

#[test]
fn a_step_that_is_requested_too_late_rests_behind_the_boundary_and_goes_on_later() {
    for seed in 1..300 {
        let program = random::program(seed);
        let mut number = numbers(seed + 9);
        let mut travel = Travel::begin(&program);
        while travel.append(|_| ()) {}
        for _ in 0..number(0.0, 2000.0) as u64 {
            travel.step(CYCLE_S, 1.0, seed);
        }
        let until = travel.before.place().ceil() as i64;
        travel.run.rest_behind(until);
        let mut steps = 0;
        loop {
            travel.step(CYCLE_S, 1.0, seed);
            steps += 1;
            assert!(steps < 60_000, "seed {seed}: it does not rest");
            if travel.run.is_at_rest() {
                break;
            }
        }
        assert!(travel.before.place() < until as f64 + 1.0, "seed {seed}: it rests at {}, not at {until}", travel.before.place());
        travel.run.rest_behind(ENDLESS);
        travel.finish(seed, |_| ());
    }
}

#[test]
fn a_move_takes_its_duration_or_is_refused_with_the_minimum() {
    let program = by(&[[0.9, -0.4]], 0.0);
    let arm = program.chain.read(6).expect("a chain");
    let tool = arm.posture(&program.start[..6]).tool;
    let beside = Pose { position: [tool.position[0] + 0.2, tool.position[1], tool.position[2]], ..tool };
    for asked in [program.moves[0], line_to(1, &beside, 0.6)] {
        let fastest = Travel::begin(&program).finish(0, |row| *row = asked);
        for factor in [1.01, 1.5, 4.0] {
            let duration = fastest * factor;
            let taken = Travel::begin(&program).finish(0, |row| {
                *row = asked;
                row.duration = duration;
            });
            assert!((taken - duration).abs() < 1.5 * CYCLE_S, "{taken} s for {duration} s");
        }
        let mut path = new_path();
        path.clear(&program.start, 6);
        let refused = path.append(&QueuedMove { duration: 0.9 * fastest, ..asked }, &program.around(&arm), &Run::default());
        assert!(matches!(refused, Err(Refusal::TooShort(least)) if (least - fastest).abs() < 1.5 * CYCLE_S), "{refused:?}, {fastest} s");
        assert_eq!(path.append(&QueuedMove { duration: f64::NAN, ..asked }, &program.around(&arm), &Run::default()), Err(Refusal::Bad));
    }
}

#[test]
fn a_blend_by_orientation_begins_where_the_tool_is_turned_so_far() {
    let program = empty();
    let arm = program.chain.read(6).expect("a chain");
    let tool = arm.posture(&program.start[..6]).tool;
    let turned = tool.then(&Pose::of_rpy([0.0; 3], [0.0, 0.0, 0.8]));
    let goal = Pose { position: [tool.position[0] + 0.2, tool.position[1], tool.position[2]], ..turned };
    let next = Pose { position: [goal.position[0], goal.position[1] + 0.2, goal.position[2]], ..goal };
    for (blend, share) in [(0.2, 0.25), (0.7, 0.5)] {
        let mut path = new_path();
        path.clear(&program.start, 6);
        let first = QueuedMove { blend, blend_unit: 3, ..line_to(1, &goal, 0.3) };
        path.append(&first, &program.around(&arm), &Run::default()).expect("a line");
        path.append(&line_to(2, &next, 0.3), &program.around(&arm), &Run::default()).expect("a line");
        assert_eq!(path.end_of(1).reason, Shrunk::No as i64);
        assert!((path.piece(0).to - (1.0 - share)).abs() < 1e-3, "{} of the move, not {}", path.piece(0).to, 1.0 - share);
    }
}
