// SPDX-License-Identifier: Apache-2.0
//! Generator of planned tool paths, as a block, for tables of a given length.

/// Declares the block.
macro_rules! polyline_generator {
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
            /// maximum speed of each joint
            #[input(asynchronous, default = [1e6; 16], sized, range = "(0, inf)")]
            speed_max: [f64; 16],
            /// maximum acceleration for braking joints that move at the start
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
            setpoint_velocity: [f64; 16],
            /// commanded accelerations at the set-points, rad/s^2 or m/s^2
            #[output(sized)]
            setpoint_acceleration: [f64; 16],
            /// time at which the set-points are stored, ns of the system clock
            #[output(sized)]
            setpoint_time: [i64; 16],
            /// longest time lost in a single gap so far
            #[output(unit = "s")]
            lost: f64,
            /// commanded pose of the tool: x y z in m, quaternion w x y z
            #[output]
            pose: [f64; 7],
            /// completed fraction of the path's duration, 0 to 1
            #[output]
            progress: f64,
            /// true if the last set-point has been stored
            #[output]
            complete: bool,
            /// time between two set-points
            #[param(default = 0.02, unit = "s", range = "[0, inf)")]
            lead: f64,
            /// the arm
            #[param(default = Chain::NOTHING)]
            chain: Chain,
            /// the last set-point has been stored
            #[condition]
            finished: Condition,
            /// the motion is at rest because of `holding`
            #[condition]
            held: Condition,
            /// the arm cannot follow the path beyond this point; the value is the completed fraction, 0 to 1
            #[condition]
            singular: ConditionOf<f64>,
            /// the motion is at rest because the time lost in a single gap exceeded `gap_max`; the value is the time lost, s
            #[condition]
            gap: ConditionOf<f64>,
            /// progress along the path
            #[state(opaque)]
            follower: Follower,
            /// joints that are braked to rest first
            #[state(opaque)]
            brake: Brake,
        }

        impl Step for $name {
            fn step(&mut self, invocation: &Invocation) -> Outcome {
                let n = self.n as usize;
                let last = crate::takeover::last_setpoints!(self, n);
                let (acceleration, jerk, has_plan) = (&self.acceleration_max[..n], &self.jerk_max[..n], self.path.path.plan >= 1.0);
                if let Some(now) = self.brake.step(&last, acceleration, jerk, self.lead, has_plan, invocation) {
                    (self.setpoint, self.setpoint_velocity, self.setpoint_acceleration) = (now.setpoint, now.velocity, now.acceleration);
                    (self.setpoint_time, self.complete) = ([invocation.now_ns; 16], false);
                    if now.is_at_rest && self.holding {
                        self.held.report();
                    }
                    return Outcome::Done;
                }
                let chain = self.chain;
                let Some(arm) = chain.read(n) else { return Outcome::Fault(BAD_CHAIN) };
                if self.path.path.plan == BEING_PLANNED {
                    (self.setpoint, self.setpoint_velocity, self.setpoint_acceleration) = (self.start, [0.0; 16], [0.0; 16]);
                    (self.setpoint_time, self.complete) = ([invocation.now_ns; 16], false);
                    self.pose = arm.posture(&self.start[..n]).tool.numbers();
                    if self.holding {
                        self.held.report();
                    }
                    return Outcome::Done;
                }
                if let Err(code) = check(self.path.path.plan, self.path.joints, n) {
                    return Outcome::Fault(code);
                }
                let asked = FollowerInputs {
                    r#override: &self.r#override[..n], cell_override: &self.cell_override[..n], holding: self.holding, speed_max: &self.speed_max[..n],
                    gap_max: &self.gap_max[..n], invocation,
                };
                let now = match self.follower.follow(&arm, &self.path.view(), &asked, &mut self.lost) {
                    Ok(now) => now,
                    Err(code) => return Outcome::Fault(code),
                };
                (self.setpoint, self.pose, self.progress, self.complete) = (now.setpoint, now.pose, now.progress, now.complete);
                (self.setpoint_velocity, self.setpoint_acceleration, self.setpoint_time) = (now.velocity, now.acceleration, [invocation.now_ns; 16]);
                now.report(&mut self.finished, &mut self.held, &mut self.singular, &mut self.gap);
                Outcome::Done
            }
        }
    };
}
pub(crate) use polyline_generator;
