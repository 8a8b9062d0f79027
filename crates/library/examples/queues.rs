// SPDX-License-Identifier: Apache-2.0
//! Writes random programs of moves as JSON, one line each, with their paths, their durations and the time that a set-point takes, for
//! `bench/rows/queues.py`, which compares the durations with those of other implementations. Only the joints' limits bound the motion.
//!
//! The argument is the number of programs of each kind.
#[path = "../tests/queue/programs.rs"]
mod programs;
#[path = "../tests/queue/travel.rs"]
mod travel;

use library::kinematics::pose::Pose;
use library::profile::Limits;
use library::queue::{QueuedMove, Run};
use programs::{Program, joints_to, line_to, new_path, numbers, seven, six, wide};
use std::time::Instant;
use travel::{CYCLE_S, Travel};

/// Kinds of programs: one line of the joints; several, blended; lines of the tool, blended.
const KINDS: [&str; 3] = ["line", "joints", "tool"];

fn main() {
    let count: u64 = std::env::args().nth(1).map_or(20, |count| count.parse().expect("a number of programs"));
    for kind in KINDS {
        for seed in 1..=count {
            println!("{}", described(kind, seed));
        }
    }
}

/// Returns a random program whose moves are bounded by the joints' limits only.
fn program(kind: &str, seed: u64) -> Program {
    let mut number = numbers(seed);
    let (chain, home) = if seed.is_multiple_of(2) { six() } else { seven() };
    let n = home.len();
    let joints = vec![Limits { speed: number(1.5, 3.5), acceleration: number(5.0, 15.0), jerk: number(50.0, 300.0) }; n];
    let mut program = Program { chain, n, start: wide(&home), joints, moves: Vec::new() };
    let arm = chain.read(n).expect("a chain");
    let mut q = home.clone();
    let wanted = if kind == "line" { 1 } else { 5 };
    while program.moves.len() < wanted {
        let k = program.moves.len() as i64 + 1;
        let mut asked = if kind == "tool" {
            let tool = arm.posture(&home).tool;
            let position: [f64; 3] = std::array::from_fn(|i| tool.position[i] + number(-0.2, 0.2));
            QueuedMove { linear: [4.0, 1e3, 1e5], angular: [10.0, 1e3, 1e5], ..line_to(k, &Pose { position, ..tool }, 4.0) }
        } else {
            joints_to(k, &home.iter().map(|q| q + number(-0.9, 0.9)).collect::<Vec<f64>>(), &program.joints)
        };
        asked.blend = 0.3;
        let mut path = new_path();
        path.clear(&wide(&q), n);
        // A move that the arm cannot make at a good speed is not part of the program.
        if path.append(&asked, &program.around(&arm), &Run::default()).is_ok() {
            q = path.end[..n].to_vec();
            program.moves.push(asked);
        }
    }
    program
}

/// Returns the program as JSON: the joints' limits, the durations, and the path as polynomials.
fn described(kind: &str, seed: u64) -> String {
    let program = program(kind, seed);
    let stopped_s = Travel::begin(&program).finish(seed, |asked| asked.blend = 0.0);
    let mut travel = Travel::begin(&program);
    while travel.append(|_| ()) {}
    let path = travel.path.clone();
    let duration_s = travel.finish(seed, |_| ());
    let setpoint_ns = setpoint_ns(&path, duration_s);
    let pieces: Vec<String> = (path.first_piece..path.end_piece).map(|k| piece(&path, k, program.n)).collect();
    let [speed, acceleration, jerk] = [|l: &Limits| l.speed, |l: &Limits| l.acceleration, |l: &Limits| l.jerk].map(|of| of(&program.joints[0]));
    format!(
        r#"{{"kind":"{kind}","seed":{seed},"speed":{speed},"acceleration":{acceleration},"jerk":{jerk},"duration":{duration_s},"stopped":{stopped_s},"setpoint_ns":{setpoint_ns},"pieces":[{}]}}"#,
        pieces.join(",")
    )
}

/// Returns the median time of a set-point on a whole path: the time law and the polynomials.
fn setpoint_ns(path: &library::queue::QueuedPath, duration_s: f64) -> u128 {
    let mut run = Run::default();
    let mut taken: Vec<u128> = Vec::with_capacity((duration_s / CYCLE_S) as usize);
    while taken.len() < taken.capacity() {
        let begun = Instant::now();
        run.advance(path, CYCLE_S, 1.0);
        std::hint::black_box(run.sample(path));
        taken.push(begun.elapsed().as_nanos());
    }
    taken.sort_unstable();
    taken.get(taken.len() / 2).copied().unwrap_or(0)
}

fn piece(path: &library::queue::QueuedPath, number: i64, n: usize) -> String {
    let piece = path.piece(number);
    let spans: Vec<String> = (piece.first..piece.first + piece.spans)
        .map(|k| {
            let span = path.span(k);
            format!(r#"{{"length":{},"points":{:?}}}"#, span.length, &span.points[..n])
        })
        .collect();
    format!(r#"{{"stops":{},"spans":[{}]}}"#, piece.stops, spans.join(","))
}
