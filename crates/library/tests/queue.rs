// SPDX-License-Identifier: Apache-2.0
//! Random programs of moves of arms with 6 and 7 joints, travelled at overrides that jump, with pauses, steps back and halts: no limit is
//! exceeded, nothing jumps, and the path is the same. `OPENGPAC_QUEUES=100000` runs more than the thousand of `make test`,
//! `OPENGPAC_QUEUES_FROM=seed` others.
use library::kinematics::chain::{Arm, Chain, HINGE};
use library::kinematics::inverse::Ranges;
use library::kinematics::pose::Pose;
use library::online::{Profile, State};
use library::profile::{JOINTS_MAX, Limits};
use library::queue::marks::{MarkWish, Outputs};
use library::queue::{QueuedMove, QueuedPath, Refusal, Run, Sample, Shrunk, Surroundings};
use opengpac::Type;
use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::f64::consts::FRAC_PI_2;

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

const CYCLE_S: f64 = 1e-3;

/// Returns numbers from a small deterministic generator.
fn numbers(seed: u64) -> impl FnMut(f64, f64) -> f64 {
    let mut x = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
    move |low, high| {
        x ^= x << 13;
        x ^= x >> 7;
        x ^= x << 17;
        low + (high - low) * ((x >> 11) as f64 / (1u64 << 53) as f64)
    }
}

/// Returns an arm with the geometry of a UR5e.
fn six() -> (Chain, Vec<f64>) {
    let (d1, a2, a3, d4, d5, d6) = (0.1625, -0.425, -0.3922, 0.1333, 0.0997, 0.0996);
    let (x, half) = (a2 + a3, std::f64::consts::FRAC_1_SQRT_2);
    let axes = [[0.0, 0.0, 1.0], [0.0, -1.0, 0.0], [0.0, -1.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [0.0, -1.0, 0.0]];
    let anchors = [[0.0; 3], [0.0, 0.0, d1], [a2, 0.0, d1], [x, 0.0, d1], [x, -d4, d1], [x, -d4, d1 - d5]];
    let chain = chain(&axes, &anchors, [x, -d4 - d6, d1 - d5, half, half, 0.0, 0.0]);
    (chain, vec![0.0, -FRAC_PI_2, FRAC_PI_2, -FRAC_PI_2, -FRAC_PI_2, 0.0])
}

/// Returns an arm with the geometry of a Panda.
fn seven() -> (Chain, Vec<f64>) {
    let (z, y) = ([0.0, 0.0, 1.0], [0.0, 1.0, 0.0]);
    let axes = [z, y, z, [0.0, -1.0, 0.0], z, [0.0, -1.0, 0.0], [0.0, 0.0, -1.0]];
    let anchors = [[0.0; 3], [0.0, 0.0, 0.333], [0.0; 3], [0.0825, 0.0, 0.649], [0.0, 0.0, 1.033], [0.0, 0.0, 1.033], [0.088, 0.0, 0.0]];
    let chain = chain(&axes, &anchors, [0.088, 0.0, 0.926, 0.0, 1.0, 0.0, 0.0]);
    (chain, vec![0.0, -0.4, 0.2, -2.0, 0.1, 1.6, 0.7])
}

fn chain(axes: &[[f64; 3]], anchors: &[[f64; 3]], home: [f64; 7]) -> Chain {
    let n = axes.len();
    let mut chain = Chain { joints: n as i32, home, ..Chain::NOTHING };
    chain.kind[..n].fill(HINGE);
    chain.axis[..n].copy_from_slice(axes);
    chain.anchor[..n].copy_from_slice(anchors);
    chain
}

/// A program: an arm, its limits, and its moves.
struct Program {
    chain: Chain,
    n: usize,
    start: [f64; JOINTS_MAX],
    joints: Vec<Limits>,
    moves: Vec<QueuedMove>,
}

fn wide(values: &[f64]) -> [f64; JOINTS_MAX] {
    std::array::from_fn(|i| values.get(i).copied().unwrap_or(0.0))
}

/// Returns a move of the joints at their maximum speeds.
fn joints_to(number: i64, goal: &[f64], joints: &[Limits]) -> QueuedMove {
    let speed: Vec<f64> = joints.iter().map(|joint| joint.speed).collect();
    let acceleration: Vec<f64> = joints.iter().map(|joint| joint.acceleration).collect();
    QueuedMove { number, mode: 1, joints: wide(goal), speed: wide(&speed), acceleration: wide(&acceleration), ..<QueuedMove as Type>::zero() }
}

/// Returns a move of the tool on a straight line.
fn line_to(number: i64, goal: &Pose, speed: f64) -> QueuedMove {
    let (linear, angular) = ([speed, 1.5, 15.0], [2.0, 6.0, 60.0]);
    QueuedMove { number, kind: 1, mode: 1, pose: goal.numbers(), linear, angular, ..<QueuedMove as Type>::zero() }
}

impl Program {
    fn random(seed: u64) -> Program {
        let mut number = numbers(seed);
        let (chain, home) = if seed.is_multiple_of(2) { six() } else { seven() };
        let n = home.len();
        let joints: Vec<Limits> = (0..n).map(|_| Limits { speed: number(1.0, 3.5), acceleration: number(3.0, 15.0), jerk: number(20.0, 200.0) }).collect();
        let start: Vec<f64> = home.iter().map(|q| q + number(-0.3, 0.3)).collect();
        let mut program = Program { chain, n, start: wide(&start), joints, moves: Vec::new() };
        let arm = chain.read(n).expect("a chain");
        let mut q = start;
        for k in 1..=2 + number(0.0, 5.0) as i64 {
            let tool = arm.posture(&q).tool;
            let mut shift = |by: f64| -> [f64; 3] { std::array::from_fn(|_| number(-by, by)) };
            let beside = Pose::of_rpy(shift(0.15), shift(0.4));
            let further = Pose { position: shift(0.12), ..Pose::IDENTITY };
            let moved = |frame: &Pose, pose: &Pose| Pose {
                position: frame.then(&Pose { position: pose.position, ..Pose::IDENTITY }).position,
                quaternion: pose.then(&Pose { position: [0.0; 3], quaternion: frame.quaternion }).quaternion,
            };
            let mut asked = match number(0.0, 3.0) as u32 {
                0 => joints_to(k, &home.iter().map(|q| q + number(-0.9, 0.9)).collect::<Vec<f64>>(), &program.joints),
                1 => line_to(k, &moved(&beside, &tool), number(0.05, 1.0)),
                _ => QueuedMove {
                    kind: 2,
                    via: moved(&further, &tool).numbers(),
                    orientation: number(0.0, 3.0) as i32,
                    angle: if number(0.0, 1.0) < 0.2 { number(0.5, 7.0) } else { 0.0 },
                    ..line_to(k, &moved(&beside, &tool), number(0.05, 1.0))
                },
            };
            asked.blend = if number(0.0, 1.0) < 0.2 { 0.0 } else { number(0.0, 0.55) };
            asked.blend_unit = if asked.kind == 0 { [0, 1][number(0.0, 2.0) as usize] } else { [0, 2][number(0.0, 2.0) as usize] };
            asked.mode = i32::from(number(0.0, 1.0) < 0.9);
            if asked.kind == 0 {
                let share = number(0.1, 1.0);
                asked.speed.iter_mut().for_each(|speed| *speed *= share);
            }
            // A move that an arm cannot make is not part of the program.
            let mut path = new_path();
            path.clear(&wide(&q), n);
            if path.append(&asked, &program.around(&arm), &Run::default()).is_ok() {
                q = path.end[..n].to_vec();
                asked.number = program.moves.len() as i64 + 1;
                program.moves.push(asked);
            }
        }
        program
    }

    fn around<'a>(&'a self, arm: &'a Arm<'a>) -> Surroundings<'a> {
        Surroundings { arm, joints: &self.joints, ranges: Ranges { min: &[-6.5; JOINTS_MAX], max: &[6.5; JOINTS_MAX] } }
    }
}

fn new_path() -> Box<QueuedPath> {
    let memory = Box::<QueuedPath>::new_zeroed();
    // SAFETY: the fields are numbers, for which all-zero bytes are valid.
    unsafe { memory.assume_init() }
}

/// A program under way: it is stepped, and every step is checked.
struct Travel<'a> {
    program: &'a Program,
    path: Box<QueuedPath>,
    run: Run,
    before: Sample,
    appended: usize,
    steps: u64,
    /// Bits of everything that was commanded.
    digest: u64,
}

impl<'a> Travel<'a> {
    fn begin(program: &'a Program) -> Travel<'a> {
        let mut path = new_path();
        path.clear(&program.start, program.n);
        let run = Run::default();
        let before = run.sample(&path);
        Travel { program, path, run, before, appended: 0, steps: 0, digest: 0 }
    }

    /// Appends the next move, if there is room.
    fn append(&mut self, change: impl Fn(&mut QueuedMove)) -> bool {
        let Some(mut asked) = self.program.moves.get(self.appended).copied() else { return false };
        change(&mut asked);
        let arm = self.program.chain.read(self.program.n).expect("a chain");
        match self.path.append(&asked, &self.program.around(&arm), &self.run) {
            Ok(()) => self.appended += 1,
            Err(Refusal::Full) => return false,
            Err(refusal) => panic!("move {} is refused: {refusal:?}", asked.number),
        }
        self.run.renew();
        true
    }

    fn step(&mut self, cycle_s: f64, rate: f64, seed: u64) -> Sample {
        self.run.advance(&self.path, cycle_s, rate);
        let (now, before, t) = (self.run.sample(&self.path), self.before, cycle_s);
        self.steps += 1;
        assert!(self.steps < 4_000_000, "seed {seed}: it never ends: {:?}", self.run);
        for (i, joint) in self.program.joints.iter().enumerate() {
            let (q, v, a) = (now.q[i], now.velocity[i], now.acceleration[i]);
            let at = || format!("seed {seed}, step {}, joint {i}, move {} at {}: {:?}", self.steps, now.number, now.fraction, self.run);
            assert!(v.abs() <= joint.speed * (1.0 + 1e-9), "speed {v} of {}: {}", joint.speed, at());
            assert!(a.abs() <= joint.acceleration * (1.0 + 1e-9), "acceleration {a} of {}: {}", joint.acceleration, at());
            let jerk = (a - before.acceleration[i]) / t;
            assert!(jerk.abs() <= joint.jerk * (1.0 + 1e-9) + 1e-9, "jerk {jerk} of {}: {}", joint.jerk, at());
            let speeds = v - before.velocity[i] - before.acceleration[i] * t;
            assert!(speeds.abs() <= joint.jerk * t * t / 2.0 * (1.0 + 1e-6) + 1e-12, "the speed jumps by {speeds}: {}", at());
            let positions = q - before.q[i] - t * (before.velocity[i] + t / 2.0 * before.acceleration[i]);
            assert!(positions.abs() <= joint.jerk * t * t * t / 6.0 * (1.0 + 1e-6) + 1e-13, "the position jumps by {positions}: {}", at());
            self.digest = (self.digest.rotate_left(5) ^ q.to_bits() ^ v.to_bits().rotate_left(20)).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        }
        self.before = now;
        now
    }

    fn is_over(&self) -> bool {
        self.appended == self.program.moves.len() && self.run.is_at_end(&self.path)
    }

    /// Goes to the end at full speed; returns the duration.
    fn finish(&mut self, seed: u64, change: impl Fn(&mut QueuedMove) + Copy) -> f64 {
        let begun = self.steps;
        while self.append(change) {}
        while !self.is_over() {
            self.step(CYCLE_S, 1.0, seed);
            self.append(change);
        }
        (self.steps - begun) as f64 * CYCLE_S
    }
}

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
        let program = Program::random(seed);
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
        let program = Program::random(seed);
        random_travel(&program, seed);
    }
}

#[test]
fn the_path_is_the_same_at_every_override_and_through_pauses_and_steps_back() {
    for seed in 1..=cases() / 10 {
        let program = Program::random(seed);
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
        let program = Program::random(seed);
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
        let program = Program::random(seed);
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
        let mut program = Program::random(seed);
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
