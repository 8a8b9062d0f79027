// SPDX-License-Identifier: Apache-2.0
//! Planner of tool paths, as a block, for tables of a given length.

/// Declares the block. `at_once` is the work done in one invocation; `shares` are the fractions of a line that one blend may use.
macro_rules! polyline_planner {
    (
        $(#[$about:meta])* $name:ident, at_once: $at_once:expr, shares: $shares:expr,
        $(#[$poses:meta])* poses: $poses_type:ty,
        $(#[$blend:meta])* blend, $(#[$speed:meta])* speed: $each_type:ty,
        $(#[$path:meta])* path: $path_type:ty
    ) => {
        $(#[$about])*
        #[derive(FunctionBlock)]
        pub struct $name {
            /// number of joints
            #[size(1, 16)]
            n: u32,
            /// current commanded positions of the joints, rad or m
            #[input(asynchronous, sized)]
            start: [f64; 16],
            /// current speeds at which the servos move the joints
            #[input(asynchronous, default = [0.0; 16], sized, unit = "rad/s|m/s", range = "[-inf, inf)")]
            start_velocity: [f64; 16],
            /// speeds of the last set-points, whichever motion generated them
            #[input(asynchronous, default = [0.0; 16], sized, unit = "rad/s|m/s", range = "[-inf, inf)")]
            last_velocity: [f64; 16],
            /// accelerations of the last set-points
            #[input(asynchronous, default = [0.0; 16], sized, unit = "rad/s^2|m/s^2", range = "[-inf, inf)")]
            last_acceleration: [f64; 16],
            /// time at which the last set-points were stored, ns of the system clock
            #[input(asynchronous, default = [i64::MIN; 16], sized, range = "[-inf, inf)")]
            last_time: [i64; 16],
            /// braking by the servos themselves because set-points did not arrive in time: see `joint_servo`
            #[input(asynchronous, default = [[0.0; 4]; 16], sized, range = "[-inf, inf)")]
            braking: [[f64; 4]; 16],
            /// poses of the tool, one row each: x y z in m, quaternion w x y z
            $(#[$poses])*
            poses: $poses_type,
            /// for each pose: maximum distance at which the tool may pass it, m
            $(#[$blend])*
            blend: $each_type,
            /// for each pose: maximum speed of the tool on the line to it, m/s
            $(#[$speed])*
            speed: $each_type,
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
            /// planned path
            $(#[$path])*
            path: $path_type,
            /// joint positions at the end of the path, for comparison by other blocks
            #[output(sized)]
            target: [f64; 16],
            /// duration of the motion
            #[output(unit = "s")]
            duration: f64,
            /// index of the pose to which a condition applies, from 0
            #[output]
            refused: i32,
            /// the arm
            #[param(default = Chain::NOTHING)]
            chain: Chain,
            /// maximum acceleration of the tool
            #[param(default = 1.0, unit = "m/s^2", range = "(0, 1000]")]
            acceleration: f64,
            /// maximum angular acceleration of the tool
            #[param(default = 5.0, unit = "rad/s^2", range = "(0, 10000]")]
            angular_acceleration: f64,
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
            /// a pose is unreachable; the value is the distance of the tool from it, m
            #[condition]
            unreachable: ConditionOf<f64>,
            /// the path leaves the range of a joint; the value is the index of the joint, from 0
            #[condition]
            limit: ConditionOf<i32>,
            /// the path passes too close to a singularity; the value is the fraction of the speed that would be possible
            #[condition]
            singular: ConditionOf<f64>,
            /// true if a plan has been made
            #[state]
            has_planned: bool,
            /// progress of the plan
            #[state(opaque)]
            planning: PolylinePlanning,
        }

        impl $name {
            /// Returns the limits of the tool's position and of its orientation; `None` if any is not positive, or a blend is below 0.
            fn limits(&self) -> Option<(Limits, Limits)> {
                let fastest = self.speed.iter().fold(0.0, |most: f64, s| most.max(*s));
                let linear = Limits { speed: fastest, acceleration: self.acceleration, jerk: 1.0 };
                let angular = Limits { speed: self.angular_speed, acceleration: self.angular_acceleration, jerk: 1.0 };
                let ways = self.speed.iter().all(|s| s.is_finite() && *s > 0.0) && self.blend.iter().all(|b| b.is_finite() && *b >= 0.0);
                (ways && linear.are_positive() && angular.are_positive()).then_some((linear, angular))
            }
        }

        impl Step for $name {
            fn step(&mut self, invocation: &Invocation) -> Outcome {
                let n = self.n as usize;
                let last = crate::takeover::last_setpoints!(self, n);
                let begins = !self.planning.is_under_way();
                if begins && self.waits && (self.has_planned || last.is_moving(invocation.now_ns, self.lead)) {
                    return Outcome::Done;
                }
                self.has_planned = true;
                let chain = self.chain;
                let Some(arm) = chain.read(n) else { return Outcome::Fault(BAD_CHAIN) };
                if !self.start[..n].iter().all(|q| q.is_finite()) || begins && self.poses.iter().any(|pose| Pose::of(pose).is_none()) {
                    return Outcome::Fault(BAD_POSE);
                }
                let joints = Limits::of_joints(&self.speed_max[..n], &self.acceleration_max[..n]);
                let (Some(joints), Some((linear, angular))) = (joints, self.limits()) else { return Outcome::Fault(BAD_LIMIT) };
                let ranges = Ranges { min: &self.position_min[..n], max: &self.position_max[..n] };
                let wish = Wish { from: &self.start[..n], goal: Pose::IDENTITY, linear, angular, joints: &joints[..n], ranges, slowest: self.slowest };
                if begins {
                    let passing = self.blend.iter().zip(self.speed.iter()).map(|(blend, speed)| Passing { blend: *blend, speed: *speed });
                    self.planning = PolylinePlanning::begin(&mut self.path.table(), &arm, (&self.poses[..], $shares), passing, &wish);
                    (self.target, self.duration, self.refused) = (self.start, 0.0, -1);
                }
                match self.planning.advance(&mut self.path.table(), &arm, &wish, $at_once) {
                    Ok(false) => {}
                    Ok(true) => {
                        (self.target, self.duration) = (self.path.to, self.path.path.duration);
                        self.path.path.plan = (invocation.number + 1) as f64;
                    }
                    Err((at, obstacle)) => {
                        // An empty path: a generator bound to it does not move.
                        (self.path.path.plan, self.target, self.duration) = (0.0, self.start, 0.0);
                        self.refused = which(arm.posture(wish.from).tool, &self.poses[..], at) as i32;
                        obstacle.report(&mut self.unreachable, &mut self.limit, &mut self.singular);
                    }
                }
                Outcome::Done
            }
        }
    };
}
pub(crate) use polyline_planner;
