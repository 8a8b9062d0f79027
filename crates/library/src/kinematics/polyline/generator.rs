// SPDX-License-Identifier: Apache-2.0
//! The generator of planned paths of the tool as a block, for tables of a length.

/// Declares the block.
macro_rules! polyline_generator {
    ($(#[$about:meta])* $name:ident, $(#[$path:meta])* path: $path_type:ty) => {
        $(#[$about])*
        #[derive(FunctionBlock)]
        pub struct $name {
            /// number of joints
            #[size(1, 16)]
            n: u32,
            /// the planned path
            $(#[$path])*
            path: $path_type,
            /// where the joints are commanded to be now, rad or m
            #[input(asynchronous, default = [0.0; 16], sized, range = "[-inf, inf)")]
            start: [f64; 16],
            /// speeds at which their servos move them now
            #[input(asynchronous, default = [0.0; 16], sized, unit = "rad/s|m/s", range = "[-inf, inf)")]
            start_velocity: [f64; 16],
            /// speeds of the last set-points, of whatever motion stored them
            #[input(asynchronous, default = [0.0; 16], sized, unit = "rad/s|m/s", range = "[-inf, inf)")]
            last_velocity: [f64; 16],
            /// their accelerations
            #[input(asynchronous, default = [0.0; 16], sized, unit = "rad/s^2|m/s^2", range = "[-inf, inf)")]
            last_acceleration: [f64; 16],
            /// when they were stored, ns of the system's clock
            #[input(asynchronous, default = [i64::MIN; 16], sized, range = "[-inf, inf)")]
            last_time: [i64; 16],
            /// motion that their servos give them by themselves, because no set-points came in time: see `joint_servo`
            #[input(asynchronous, default = [[0.0; 4]; 16], sized, range = "[-inf, inf)")]
            braking: [[f64; 4]; 16],
            /// share of the speed that is allowed now, 0 to 1; the smallest of the joints counts for all
            #[input(asynchronous, default = [1.0; 16], sized, range = "[0, 1]")]
            r#override: [f64; 16],
            /// the same for the whole cell; both are multiplied
            #[input(asynchronous, default = [1.0; 16], sized, range = "[0, 1]")]
            cell_override: [f64; 16],
            /// true to come to rest and wait
            #[input(asynchronous, default = false)]
            holding: bool,
            /// time that may be lost at once; beyond it the motion comes to rest
            #[input(asynchronous, default = [0.5; 16], sized, unit = "s", range = "(0, inf)")]
            gap_max: [f64; 16],
            /// maximum speed of each joint
            #[input(asynchronous, default = [1e6; 16], sized, range = "(0, inf)")]
            speed_max: [f64; 16],
            /// maximum acceleration at which joints that move are braked first
            #[input(asynchronous, default = [5.0; 16], sized, range = "(0, inf)")]
            acceleration_max: [f64; 16],
            /// maximum jerk of that
            #[input(asynchronous, default = [50.0; 16], sized, range = "(0, inf)")]
            jerk_max: [f64; 16],
            /// where the joints are to be, rad or m
            #[output(sized)]
            setpoint: [f64; 16],
            /// speeds of the joints there, rad/s or m/s
            #[output(sized)]
            setpoint_velocity: [f64; 16],
            /// accelerations of the joints there, rad/s^2 or m/s^2
            #[output(sized)]
            setpoint_acceleration: [f64; 16],
            /// when they are stored, ns of the system's clock
            #[output(sized)]
            setpoint_time: [i64; 16],
            /// the longest time that was lost at once
            #[output(unit = "s")]
            lost: f64,
            /// where the tool is to be: x y z in m, quaternion w x y z
            #[output]
            pose: [f64; 7],
            /// part of the path's time that is done, 0 to 1
            #[output]
            progress: f64,
            /// true when the last set-point is stored
            #[output]
            complete: bool,
            /// time between two set-points
            #[param(default = 0.02, unit = "s", range = "[0, inf)")]
            lead: f64,
            /// the arm
            #[param(default = Chain::NOTHING)]
            chain: Chain,
            /// the last set-point is stored
            #[condition]
            finished: Condition,
            /// it rests, as `holding` asks
            #[condition]
            held: Condition,
            /// the arm cannot follow the path from here; the value is how much of it is done, 0 to 1
            #[condition]
            singular: ConditionOf<f64>,
            /// it rests because more time than `gap_max` was lost at once; the value is how much, s
            #[condition]
            gap: ConditionOf<f64>,
            /// progress along the path
            #[state(opaque)]
            follower: Follower,
            /// joints that are brought to rest first
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
