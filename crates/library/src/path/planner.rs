// SPDX-License-Identifier: Apache-2.0
//! Planner of paths in joint space, as a block, for tables of a given length.

/// A start, way-point or blend is not a finite number, or a blend is below 0.
pub(crate) const NOT_FINITE: u32 = 1;
/// A speed or acceleration limit is not above 0.
pub(crate) const BAD_LIMIT: u32 = 2;

/// Declares the block. `at_once` is the number of way-point steps planned in one invocation (about five per way-point); `shares` are the
/// fractions of a line that one blend may use, of which the better one is chosen.
macro_rules! path_planner {
    (
        $(#[$about:meta])* $name:ident, at_once: $at_once:expr, shares: $shares:expr,
        $(#[$points:meta])* points: $points_type:ty,
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
            /// way-points, one row each; columns beyond n are unused
            $(#[$points])*
            points: $points_type,
            /// for each way-point: maximum distance at which a joint may pass it, rad or m
            $(#[$blend])*
            blend: $each_type,
            /// for each way-point: maximum speed of a joint on the line to it, rad/s or m/s
            $(#[$speed])*
            speed: $each_type,
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
            /// last way-point, for comparison by other blocks
            #[output(sized)]
            target: [f64; 16],
            /// duration of the motion
            #[output(unit = "s")]
            duration: f64,
            /// index of the way-point to which `limit` applies, from 0
            #[output]
            refused: i32,
            /// time between two set-points
            #[param(default = 0.02, unit = "s", range = "[0, inf)")]
            lead: f64,
            /// true: wait until moving joints have stopped, and plan only once per start; for a planner that remains active until its
            /// generator has braked the joints
            #[param(default = false)]
            waits: bool,
            /// a way-point is outside the range of a joint; the value is the index of the joint, from 0
            #[condition]
            limit: ConditionOf<i32>,
            /// true if a plan has been made
            #[state]
            has_planned: bool,
            /// progress of the plan
            #[state(opaque)]
            planning: Planning,
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
                let positive = |x: &f64| x.is_finite() && *x > 0.0;
                let Some(limits) = Limits::of_joints(&self.speed_max[..n], &self.acceleration_max[..n]) else { return Outcome::Fault(BAD_LIMIT) };
                if begins {
                    if !self.speed.iter().all(positive) {
                        return Outcome::Fault(BAD_LIMIT);
                    }
                    let finite = |q: &[f64; 16]| q[..n].iter().all(|x| x.is_finite());
                    if !finite(&self.start) || !self.points.iter().all(finite) || !self.blend.iter().all(|b| b.is_finite() && *b >= 0.0) {
                        return Outcome::Fault(NOT_FINITE);
                    }
                    for (k, point) in self.points.iter().enumerate() {
                        let outside = |i: &usize| !(self.position_min[*i]..=self.position_max[*i]).contains(&point[*i]);
                        if let Some(joint) = (0..n).find(outside) {
                            // An empty path: a generator bound to it does not move.
                            (self.path.plan, self.target, self.duration, self.refused) = (0.0, self.start, 0.0, k as i32);
                            self.limit.report(joint as i32);
                            return Outcome::Done;
                        }
                    }
                    let mut table = self.path.table();
                    self.planning = Planning::begin(&mut table, 0, &self.start[..n], $shares);
                    for ((point, blend), speed) in self.points.iter().zip(self.blend.iter()).zip(self.speed.iter()) {
                        table.add(&point[..n], Passing { blend: *blend, speed: *speed });
                    }
                    (self.target, self.duration, self.refused) = (self.start, 0.0, -1);
                }
                if self.planning.advance(&mut self.path.table(), &limits[..n], &mut { $at_once }) {
                    (self.target, self.duration) = (self.points[self.points.len() - 1], self.path.duration);
                    self.path.plan = (invocation.number + 1) as f64;
                }
                Outcome::Done
            }
        }
    };
}
pub(crate) use path_planner;
