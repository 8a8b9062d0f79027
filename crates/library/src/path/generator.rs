// SPDX-License-Identifier: Apache-2.0
//! Generator of planned paths in joint space, as a block, for tables of a given length.

/// There is no planned path: the planner has not run, or has not found one.
pub(crate) const NO_PLAN: u32 = 1;
/// The path was planned for a different number of joints.
pub(crate) const OTHER_SIZE: u32 = 2;
/// An override is not between 0 and 1.
pub(crate) const BAD_OVERRIDE: u32 = 3;
/// Number of intervals into which a period is divided to check a change of pace against the limits, because a short line or blend may lie
/// between two set-points.
pub(crate) const PLACES: u16 = 6;

/// Declares the block.
macro_rules! path_generator {
    ($(#[$about:meta])* $name:ident, $(#[$path:meta])* path: $path_type:ty) => {
        $(#[$about])*
        #[derive(FunctionBlock)]
        pub struct $name {
            /// number of joints
            #[size(1, 16)]
            n: u32,
            /// planned path
            $(#[$path])*
            path: $path_type,
            /// current commanded positions of the joints, rad or m
            #[input(asynchronous, default = [0.0; 16], sized, range = "[-inf, inf)")]
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
            /// permitted fraction of the speed, 0 to 1; the minimum over the joints applies to all
            #[input(asynchronous, default = [1.0; 16], sized, range = "[0, 1]")]
            r#override: [f64; 16],
            /// override of the whole cell; the two are multiplied
            #[input(asynchronous, default = [1.0; 16], sized, range = "[0, 1]")]
            cell_override: [f64; 16],
            /// true: bring the motion to rest and keep it there
            #[input(asynchronous, default = false)]
            holding: bool,
            /// maximum time lost in a single gap; if it is exceeded, the motion comes to rest
            #[input(asynchronous, default = [0.5; 16], sized, unit = "s", range = "(0, inf)")]
            gap_max: [f64; 16],
            /// maximum acceleration of each joint
            #[input(asynchronous, default = [5.0; 16], sized, range = "(0, inf)")]
            acceleration_max: [f64; 16],
            /// maximum jerk for braking joints that move at the start
            #[input(asynchronous, default = [50.0; 16], sized, range = "(0, inf)")]
            jerk_max: [f64; 16],
            /// commanded positions of the joints, rad or m
            #[output(sized)]
            setpoint: [f64; 16],
            /// commanded speeds at the set-points, rad/s or m/s
            #[output(sized)]
            velocity: [f64; 16],
            /// commanded accelerations at the set-points, rad/s^2 or m/s^2
            #[output(sized)]
            setpoint_acceleration: [f64; 16],
            /// time at which the set-points are stored, ns of the system clock
            #[output(sized)]
            setpoint_time: [i64; 16],
            /// longest time lost in a single gap so far
            #[output(unit = "s")]
            lost: f64,
            /// completed fraction of the path's duration, 0 to 1
            #[output]
            progress: f64,
            /// true if the last set-point has been stored
            #[output]
            complete: bool,
            /// time between two set-points
            #[param(default = 0.02, unit = "s", range = "[0, inf)")]
            lead: f64,
            /// the last set-point has been stored
            #[condition]
            finished: Condition,
            /// the motion is at rest because of `holding`
            #[condition]
            held: Condition,
            /// the motion is at rest because the time lost in a single gap exceeded `gap_max`; the value is the time lost, s
            #[condition]
            gap: ConditionOf<f64>,
            /// number of the path being executed
            #[state]
            plan: f64,
            /// path time, s
            #[state]
            time_s: f64,
            /// pace of the path time
            #[state]
            pace: f64,
            /// time of the previous invocation
            #[state(opaque)]
            span: Span,
            /// true if the motion is coming to rest because time was lost
            #[state]
            is_lost: bool,
            /// last set-points
            #[state(opaque)]
            tail: Tail,
            /// joints that are braked to rest first
            #[state(opaque)]
            brake: Brake,
        }

        /// Velocities and accelerations of all joints at one path time.
        struct Motion {
            velocity: [f64; 16],
            acceleration: [f64; 16],
        }

        impl Step for $name {
            fn step(&mut self, invocation: &Invocation) -> Outcome {
                let n = self.n as usize;
                let last = crate::takeover::last_setpoints!(self, n);
                let (acceleration, jerk, has_plan) = (&self.acceleration_max[..n], &self.jerk_max[..n], self.path.plan >= 1.0);
                if let Some(now) = self.brake.step(&last, acceleration, jerk, self.lead, has_plan, invocation) {
                    (self.setpoint, self.velocity, self.setpoint_acceleration) = (now.setpoint, now.velocity, now.acceleration);
                    (self.setpoint_time, self.complete) = ([invocation.now_ns; 16], false);
                    if now.is_at_rest && self.holding {
                        self.held.report();
                    }
                    return Outcome::Done;
                }
                if self.path.plan == BEING_PLANNED {
                    (self.setpoint, self.velocity, self.setpoint_acceleration) = (self.start, [0.0; 16], [0.0; 16]);
                    (self.setpoint_time, self.complete) = ([invocation.now_ns; 16], false);
                    if self.holding {
                        self.held.report();
                    }
                    return Outcome::Done;
                }
                if self.path.plan < 1.0 {
                    return Outcome::Fault(NO_PLAN);
                }
                if self.path.joints != n as i32 {
                    return Outcome::Fault(OTHER_SIZE);
                }
                let Some(allowed) = pace::allowed(&self.r#override[..n], &self.cell_override[..n]) else { return Outcome::Fault(BAD_OVERRIDE) };
                if self.path.plan != self.plan {
                    (self.plan, self.time_s, self.span, self.tail, self.is_lost) = (self.path.plan, 0.0, Span::default(), Tail::default(), false);
                    // At the start the planned speed is 0: any pace is permitted.
                    self.pace = if self.holding { 0.0 } else { allowed };
                }
                let passed = self.span.pass(invocation);
                if pace::note_lost(passed, &self.gap_max[..n], &mut self.lost) {
                    self.is_lost = true;
                }
                let wanted = if self.holding || self.is_lost { 0.0 } else { allowed };
                let span_s = passed.cycle_s();
                let pace = self.pace;
                let after = pace::next(pace, wanted, span_s, |_, slope| {
                    (0..=PLACES).all(|k| {
                        let t = span_s * f64::from(k) / f64::from(PLACES);
                        let (at, motion) = (pace + slope * t, self.motion(self.time_s + t * (pace + slope * t / 2.0)));
                        (0..n).all(|i| self.fits(&motion, i, at, slope))
                    })
                });
                self.time_s += span_s * (pace + after) / 2.0;
                self.pace = after;
                self.store(n);
                let rests = self.complete || self.pace == 0.0;
                self.tail.push(&self.setpoint[..n], span_s, rests, &mut self.velocity[..n], &mut self.setpoint_acceleration[..n]);
                self.setpoint_time = [invocation.now_ns; 16];
                Outcome::Done
            }
        }

        impl $name {
            fn motion(&self, time_s: f64) -> Motion {
                let n = self.n as usize;
                let mut motion = Motion { velocity: [0.0; 16], acceleration: [0.0; 16] };
                self.path.view().evaluate(time_s, &mut [0.0; 16][..n], &mut motion.velocity[..n], &mut motion.acceleration[..n]);
                motion
            }

            fn fits(&self, motion: &Motion, joint: usize, pace: f64, slope: f64) -> bool {
                let acceleration = pace::acceleration(motion.velocity[joint], motion.acceleration[joint], pace, slope);
                pace::within(acceleration, self.acceleration_max[joint])
            }

            fn store(&mut self, n: usize) {
                self.path.view().evaluate(self.time_s, &mut self.setpoint[..n], &mut [0.0; 16][..n], &mut [0.0; 16][..n]);
                self.complete = self.time_s >= self.path.duration;
                if self.is_lost && (self.pace == 0.0 || self.complete) {
                    // The motion may resume, if the gap does not end it.
                    self.is_lost = false;
                    self.gap.report(self.lost);
                }
                self.progress = if self.complete { 1.0 } else { self.time_s / self.path.duration };
                if self.complete {
                    self.finished.report();
                }
                if self.holding && (self.pace == 0.0 || self.complete) {
                    self.held.report();
                }
            }
        }
    };
}
pub(crate) use path_generator;
