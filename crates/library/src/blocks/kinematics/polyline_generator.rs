// SPDX-License-Identifier: Apache-2.0
use crate::kinematics::BAD_CHAIN;
use crate::kinematics::chain::Chain;
use crate::kinematics::follower::{FollowerInputs, Follower, check};
use crate::kinematics::polyline::Polyline;
use crate::kinematics::polyline::generator::polyline_generator;
use crate::path::BEING_PLANNED;
use crate::takeover::Brake;
use opengpac::{Condition, ConditionOf, FunctionBlock, Invocation, Outcome, Step};

polyline_generator! {
    /// Polyline generator: setpoint = q with forward(q) = pose(τ) of a planned path of the tool, τ being running time scaled by the
    /// override.
    ///
    /// The joint positions are tracked from those of the previous invocation, so the arm keeps its posture. No joint is commanded a step
    /// that exceeds its maximum speed: the pace is reduced first, and if that does not help, `singular` is reported and the set-point no
    /// longer changes. Joints that move at the start are braked first, each on its own, and the planner plans from the positions where
    /// they come to rest. `override` scales the speed (0 holds), `holding` ramps down to rest and reports `held`; both change the pace no
    /// faster than the path's accelerations allow. The last set-point is exactly the planned end. Time lost because releases were skipped
    /// is not made up for; if the time lost in a single gap exceeds `gap_max`, the motion comes to rest and `gap` is reported. Faults: 1
    /// the arm is not a chain of n joints, or the path was planned for a different number of joints; 3 an override is not between 0 and
    /// 1; 4 there is no path.
    PolylineGenerator,
    #[input(asynchronous)]
    path: Polyline
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kinematics::chain::samples::{HOME, six_joints};
    use crate::kinematics::inverse::Ranges;
    use crate::kinematics::line::{Obstacle, Wish};
    use crate::kinematics::polyline::{Budget, PolylinePlanning, which};
    use crate::kinematics::pose::{Pose, length, product, subtract, turn};
    use crate::path::{BLEND_SHARES, Passing};
    use crate::path::samples::numbers;
    use crate::profile::Limits;

    const LINEAR: Limits = Limits { speed: 0.3, acceleration: 1.0, jerk: 1.0 };
    const ANGULAR: Limits = Limits { speed: 1.0, acceleration: 5.0, jerk: 1.0 };
    const JOINT: Limits = Limits { speed: 2.0, acceleration: 6.0, jerk: 1.0 };

    fn way_points(shifts: &[([f64; 3], f64)]) -> Vec<Pose> {
        let chain = six_joints();
        let here = chain.read(6).expect("a chain").posture(&HOME).tool;
        let pose = |(shift, angle): &([f64; 3], f64)| Pose {
            position: std::array::from_fn(|i| here.position[i] + shift[i]),
            quaternion: product(turn([0.0, 0.6, 0.8], *angle), here.quaternion),
        };
        shifts.iter().map(pose).collect()
    }

    const SQUARE: [([f64; 3], f64); 6] = [
        ([0.1, 0.0, 0.0], 0.0),
        ([0.1, -0.2, 0.0], 0.5),
        ([0.1, -0.2, 0.0], 0.5),
        ([0.1, -0.2, -0.1], 0.5),
        ([0.1, -0.2, -0.1], 0.0),
        ([0.0, 0.0, 0.0], -0.2),
    ];

    fn planned(poses: &[Pose], blend: f64) -> Result<Polyline, (usize, Obstacle)> {
        let chain = six_joints();
        let ranges = Ranges { min: &[-6.3; 6], max: &[6.3; 6] };
        let wish = Wish { from: &HOME, goal: Pose::IDENTITY, linear: LINEAR, angular: ANGULAR, joints: &[JOINT; 6], ranges, slowest: 0.02 };
        let (arm, numbers) = (chain.read(6).expect("a chain"), poses.iter().map(Pose::numbers).collect::<Vec<_>>());
        let mut path = <Polyline as opengpac::Type>::zero();
        let passing = std::iter::repeat(Passing { blend, speed: 0.3 });
        let mut planning = PolylinePlanning::begin(&mut path.table(), &arm, (&numbers, BLEND_SHARES), passing, &wish);
        let ready = planning.advance(&mut path.table(), &arm, &wish, Budget { steps: usize::MAX, samples: usize::MAX });
        assert!(ready.map_err(|(at, what)| (which(arm.posture(&HOME).tool, &numbers, at), what))?, "it is planned at once");
        path.path.plan = 1.0;
        Ok(path)
    }

    /// Runs a path to its end, checking the tool and the joints at every step. Returns the poses of the tool.
    fn run(path: Polyline, mut change: impl FnMut(i64, &mut PolylineGenerator)) -> Vec<Pose> {
        let chain = six_joints();
        let arm = chain.read(6).expect("a chain");
        let mut block = PolylineGenerator {
            n: 6, path, r#override: [1.0; 16], cell_override: [1.0; 16], holding: false, speed_max: [2.0; 16], setpoint: [0.0; 16], pose: [0.0; 7],
            progress: 0.0, complete: false, chain, finished: Condition::new(), held: Condition::new(), singular: ConditionOf::new(0.0), gap: ConditionOf::new(0.0), start: [0.0; 16], start_velocity: [0.0; 16], last_velocity: [0.0; 16], last_acceleration: [0.0; 16], last_time: [i64::MIN; 16], braking: [[0.0; 4]; 16], acceleration_max: [5.0; 16], jerk_max: [50.0; 16], lead: 0.02,
            brake: Brake::default(), gap_max: [0.5; 16], setpoint_velocity: [0.0; 16], setpoint_acceleration: [0.0; 16], setpoint_time: [0; 16], lost: 0.0,
            follower: Follower::default(),
        };
        let mut poses: Vec<Pose> = Vec::new();
        let (mut joints, mut rate, mut velocity) = (path.from, [0.0; 16], [0.0; 3]);
        for k in 0..5000 {
            change(k, &mut block);
            (block.finished, block.held) = (Condition::new(), Condition::new());
            assert_eq!(block.step(&Invocation { number: k as u64, time_ns: k * 20_000_000, now_ns: 0 }), Outcome::Done);
            assert!(!block.singular.is_reported());
            let tool = arm.posture(&block.setpoint[..6]).tool;
            let (off, turned) = tool.to(&Pose::of(&block.pose).expect("a pose"));
            assert!(length(off) < 1e-6 && length(turned) < 1e-6, "{k}");
            if let Some(before) = poses.last() {
                let speed = subtract(tool.position, before.position).map(|x| x / 0.02);
                assert!(length(speed) <= 0.3 * (1.0 + 1e-6), "{k}: {} m/s", length(speed));
                assert!(length(subtract(speed, velocity)) / 0.02 <= 1.0 * 1.02, "{k}: {} m/s2", length(subtract(speed, velocity)) / 0.02);
                assert!(length(before.to(&tool).1) / 0.02 <= 1.0 + 0.3, "{k}: the blends of two turns add little");
                velocity = speed;
            }
            for i in 0..6 {
                let speed = (block.setpoint[i] - joints[i]) / 0.02;
                assert!(speed.abs() <= 2.0 && (speed - rate[i]).abs() / 0.02 <= 6.0 * 1.05, "{k}: joint {i}");
                rate[i] = speed;
            }
            joints = block.setpoint;
            poses.push(tool);
            if block.complete {
                assert!(block.finished.is_reported() && block.setpoint == path.to);
                return poses;
            }
        }
        panic!("it does not end");
    }

    #[test]
    fn the_tool_passes_its_poses_within_the_blend() {
        let wanted = way_points(&SQUARE);
        for blend in [0.0, 0.01, 0.03] {
            let poses = run(planned(&wanted, blend).expect("a path"), |_, _| ());
            for goal in &wanted {
                let nearest = poses.iter().map(|p| length(subtract(p.position, goal.position))).fold(f64::INFINITY, f64::min);
                assert!(nearest <= blend + 0.003, "{nearest} for {blend}");
            }
            let (rest, turn) = poses.last().expect("an end").to(wanted.last().expect("an end"));
            assert!(length(rest) < 1e-6 && length(turn) < 1e-6);
        }
        let time = |blend| planned(&wanted, blend).expect("a path").path.duration;
        assert!(time(0.03) < time(0.0) && time(0.01) < time(0.0), "{} {} {}", time(0.03), time(0.01), time(0.0));
    }

    #[test]
    fn override_and_hold_keep_it_on_its_way_and_within_the_limits() {
        let path = planned(&way_points(&SQUARE), 0.02).expect("a path");
        for seed in 1..10 {
            let mut number = numbers(seed);
            run(path, |k, block| {
                if k % 9 == 0 {
                    (block.r#override, block.holding) = ([number(0.0, 1.0); 16], number(0.0, 1.0) < 0.3);
                }
            });
        }
    }

    #[test]
    fn the_pose_that_cannot_be_had_is_named() {
        let refused = planned(&way_points(&[([0.1, 0.0, 0.0], 0.0), ([0.1, -0.1, 0.0], 0.0), ([2.0, 0.0, 0.0], 0.0)]), 0.01);
        assert!(matches!(refused, Err((2, Obstacle::Unreachable(_)))), "{:?}", refused.err());
    }
}
