// SPDX-License-Identifier: Apache-2.0
//! Random programs of lines of the joints, lines and arcs of the tool, with all kinds of blends.
use super::programs::{Program, joints_to, line_to, new_path, numbers, seven, six, wide};
use library::kinematics::pose::Pose;
use library::profile::Limits;
use library::queue::{QueuedMove, Run};

/// Returns the program of a seed.
pub fn program(seed: u64) -> Program {
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
