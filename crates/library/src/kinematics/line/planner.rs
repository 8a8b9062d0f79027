// SPDX-License-Identifier: Apache-2.0
//! Planner of a tool motion along a line or an arc, as a block.

/// Declares the block, with additional items of its own. Its method `course` returns the course from the pose of the tool to the goal;
/// the error is a fault code, or `None` if the reason is reported as a condition. `angular_jerk` is the maximum jerk of the orientation.
macro_rules! line_planner {
    ($(#[$about:meta])* $name:ident { $($items:tt)* }) => {
        $(#[$about])*
        #[derive(FunctionBlock)]
        pub struct $name {
            /// number of joints
            #[size(1, 16)]
            n: u32,
            /// current commanded positions of the joints, rad or m
            #[input(asynchronous, sized)]
            start: [f64; 16],
            /// current speed at which the servos move the joints
            #[input(asynchronous, default = [0.0; 16], sized, unit = "rad/s|m/s", range = "[-inf, inf)")]
            start_velocity: [f64; 16],
            /// speed of the last set-points, whichever motion generated them
            #[input(asynchronous, default = [0.0; 16], sized, unit = "rad/s|m/s", range = "[-inf, inf)")]
            last_velocity: [f64; 16],
            /// acceleration of the last set-points
            #[input(asynchronous, default = [0.0; 16], sized, unit = "rad/s^2|m/s^2", range = "[-inf, inf)")]
            last_acceleration: [f64; 16],
            /// time at which the last set-points were stored, ns of the system clock
            #[input(asynchronous, default = [i64::MIN; 16], sized, range = "[-inf, inf)")]
            last_time: [i64; 16],
            /// braking by the servos themselves because set-points did not arrive in time: see `joint_servo`
            #[input(asynchronous, default = [[0.0; 4]; 16], sized, range = "[-inf, inf)")]
            braking: [[f64; 4]; 16],
            /// goal pose of the tool: x y z in m, quaternion w x y z
            #[input(asynchronous, range = "[pose]")]
            goal: [f64; 7],
            /// maximum speed of the tool
            #[input(asynchronous, default = 0.25, unit = "m/s", range = "(0, 10]")]
            speed: f64,
            /// maximum angular speed of the tool
            #[input(asynchronous, default = 1.0, unit = "rad/s", range = "(0, 100]")]
            angular_speed: f64,
            /// maximum speed of each joint
            #[input(asynchronous, default = [PI; 16], sized, range = "(0, inf)")]
            speed_max: [f64; 16],
            /// maximum acceleration of each joint
            #[input(asynchronous, default = [5.0; 16], sized, range = "(0, inf)")]
            acceleration_max: [f64; 16],
            /// minimum position of each joint
            #[input(asynchronous, default = [-1e6; 16], sized, range = "[-inf, inf)")]
            position_min: [f64; 16],
            /// maximum position of each joint
            #[input(asynchronous, default = [1e6; 16], sized, range = "[-inf, inf)")]
            position_max: [f64; 16],
            /// planned line
            #[output]
            line: Line,
            /// joint positions at the end of the line, for comparison by other blocks
            #[output(sized)]
            target: [f64; 16],
            /// planned duration
            #[output(unit = "s")]
            duration: f64,
            /// the arm
            #[param(default = Chain::NOTHING)]
            chain: Chain,
            /// maximum acceleration of the tool
            #[param(default = 1.0, unit = "m/s^2", range = "(0, 1000]")]
            acceleration: f64,
            /// maximum jerk of the tool
            #[param(default = 10.0, range = "(0, 100000]")]
            jerk: f64,
            /// maximum angular acceleration of the tool
            #[param(default = 5.0, unit = "rad/s^2", range = "(0, 10000]")]
            angular_acceleration: f64,
            $($items)*
            /// minimum acceptable fraction of the requested speed, 0 to 1
            #[param(default = 0.02, range = "[0, 1]")]
            slowest: f64,
            /// time between two set-points
            #[param(default = 0.02, unit = "s", range = "[0, inf)")]
            lead: f64,
            /// true: wait until moving joints have stopped, and plan only once per start; for a planner that remains active until its
            /// generator has braked the joints
            #[param(default = false)]
            waits: bool,
            /// the goal is unreachable; the value is the distance of the tool from it, m
            #[condition]
            unreachable: ConditionOf<f64>,
            /// the path leaves the range of a joint; the value is the index of the joint, from 0
            #[condition]
            limit: ConditionOf<i32>,
            /// the path passes too close to a singularity; the value is the fraction of the speed that would be possible
            #[condition]
            singular: ConditionOf<f64>,
            /// true after a plan has been made
            #[state]
            has_planned: bool,
        }

        impl $name {
            /// Returns the limits of the tool's position and of its orientation; `None` if any is not positive.
            fn limits(&self) -> Option<(Limits, Limits)> {
                let linear = Limits { speed: self.speed, acceleration: self.acceleration, jerk: self.jerk };
                let angular = Limits { speed: self.angular_speed, acceleration: self.angular_acceleration, jerk: self.angular_jerk() };
                (linear.are_positive() && angular.are_positive()).then_some((linear, angular))
            }
        }

        impl Step for $name {
            fn step(&mut self, invocation: &Invocation) -> Outcome {
                let n = self.n as usize;
                let last = crate::takeover::last_setpoints!(self, n);
                if self.waits && (self.has_planned || last.is_moving(invocation.now_ns, self.lead)) {
                    return Outcome::Done;
                }
                self.has_planned = true;
                let chain = self.chain;
                let Some(arm) = chain.read(n) else { return Outcome::Fault(BAD_CHAIN) };
                let (Some(goal), true) = (Pose::of(&self.goal), self.start[..n].iter().all(|q| q.is_finite())) else { return Outcome::Fault(BAD_POSE) };
                let joints = Limits::of_joints(&self.speed_max[..n], &self.acceleration_max[..n]);
                let (Some(joints), Some((linear, angular))) = (joints, self.limits()) else { return Outcome::Fault(BAD_LIMIT) };
                let planned = match self.course(&arm.posture(&self.start[..n]).tool, &goal) {
                    Ok(course) => {
                        let ranges = Ranges { min: &self.position_min[..n], max: &self.position_max[..n] };
                        let wish = Wish { from: &self.start[..n], goal, linear, angular, joints: &joints[..n], ranges, slowest: self.slowest };
                        let planned = plan_line((invocation.number + 1) as f64, &arm, &course, &wish);
                        planned.map_err(|obstacle| obstacle.report(&mut self.unreachable, &mut self.limit, &mut self.singular)).ok()
                    }
                    Err(Some(code)) => return Outcome::Fault(code),
                    Err(None) => None,
                };
                match planned {
                    Some(line) => (self.line, self.target, self.duration) = (line, line.to, duration_s(&line.profile)),
                    // A generator bound to this line does not move.
                    None => (self.line.plan, self.target, self.duration) = (0.0, self.start, 0.0),
                }
                Outcome::Done
            }
        }
    };
}
pub(crate) use line_planner;
