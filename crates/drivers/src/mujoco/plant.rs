// SPDX-License-Identifier: Apache-2.0
//! The plant: advances, reads and commands an arm as a physical device.
use super::arm::Arm;
use super::channels::{Slots, channels};
use super::contacts;
use super::followers::fold_forces;
use super::functions::state;
use super::log;
use super::motion::Motion;
use super::placing::Places;
use super::prescribed::PrescribedSolver;
use device::{Channel, DeviceError, Driver, Services, Slot};
use std::sync::Arc;

/// Maximum time by which one reading advances the plant; the plant does not move during the excess time.
const ADVANCE_NS_MAX: i64 = 1_000_000_000;
/// Maximum time for which a brake slows a joint down. Needed because a joint whose weight exceeds the effort of its drive would never
/// stop.
const BRAKING_NS_MAX: i64 = 1_000_000_000;
/// Number of steps that are run and undone before the first firing, so that every page has been touched and every branch taken.
const WARM_UP_STEPS: usize = 50;

/// A simulated arm as a [`Driver`].
pub(super) struct Plant {
    // Declared before the model: data is freed first.
    pub(super) motion: Motion,
    pub(super) arm: Arm,
    channels: Vec<Channel>,
    slots: Slots,
    /// Time of the state, on the system clock: the time of the last reading, or the end of its time step.
    time_ns: i64,
    /// qpos, then qvel.
    pub(super) state: Vec<f64>,
    /// State one time step earlier.
    before: Vec<f64>,
    pub(super) positions: usize,
    /// qfrc_applied, then xfrc_applied, in the order of `mj_setState`.
    pub(super) forces: Vec<f64>,
    pub(super) bias: Vec<f64>,
    pub(super) inertia: Vec<f64>,
    pub(super) drift: Vec<f64>,
    pub(super) prescribed: PrescribedSolver,
    /// Degrees of freedom with prescribed accelerations, those accelerations, and buffers for the efforts required for them and for zero
    /// acceleration.
    pub(super) given: Vec<bool>,
    pub(super) accelerations: Vec<f64>,
    pub(super) needed: Vec<f64>,
    pub(super) standing: Vec<f64>,
    /// Dry friction assumed on each degree of freedom.
    pub(super) rubbing: Vec<f64>,
    /// True for each degree of freedom held by a brake. Initially, all brakes hold.
    pub(super) braked: Vec<bool>,
    /// Remaining time for which each joint's brake may slow the joint down before it holds it, ns; 0 if the joint is not slowing down.
    pub(super) slowing: Vec<i64>,
    /// Last written effort of each joint, and the position at which its brake holds it.
    pub(super) efforts: Vec<f64>,
    held: Vec<f64>,
    /// Last written decoupled effort of each joint; NaN if there is none.
    pub(super) decoupled: Vec<f64>,
    /// Effort of each joint's motor in the last time step.
    pub(super) motors: Vec<f64>,
    pub(super) push: [f64; 3],
    /// Buffer for the values of one sensor.
    sensed: Vec<f64>,
    /// Positions set by the service `place`, and a buffer for them.
    places: Arc<Places>,
    place: Vec<f64>,
}

impl Plant {
    pub fn new(arm: Arm) -> Plant {
        let size = |component| {
            // SAFETY: the model is valid.
            (unsafe { (arm.mujoco.mj_stateSize)(arm.model, component) }) as usize
        };
        let (nq, nv) = (size(state::QPOS), size(state::QVEL));
        let forces = vec![0.0; nv + size(state::XFRC_APPLIED)];
        let motion = Motion::new(&arm);
        let mut braked = vec![false; nv];
        for joint in &arm.joints {
            braked[joint.velocity] = true;
        }
        let count = arm.joints.len();
        let (channels, slots) = channels(&arm);
        let mut plant = Plant {
            motion,
            channels,
            slots,
            time_ns: 0,
            state: vec![0.0; nq + nv],
            before: vec![0.0; nq + nv],
            positions: nq,
            forces,
            bias: vec![0.0; nv],
            inertia: vec![0.0; nv * nv],
            drift: vec![0.0; nv],
            prescribed: PrescribedSolver::new(nv),
            given: vec![false; nv],
            accelerations: vec![0.0; nv],
            needed: vec![0.0; nv],
            standing: vec![0.0; nv],
            rubbing: vec![0.0; nv],
            braked,
            slowing: vec![0; count],
            efforts: vec![0.0; count],
            held: vec![0.0; count],
            decoupled: vec![f64::NAN; count],
            motors: vec![0.0; count],
            push: [0.0; 3],
            sensed: vec![0.0; elements_max(&arm)],
            places: Places::new(&arm.joints),
            place: vec![0.0; count],
            arm,
        };
        plant.reset();
        plant
    }

    /// Resets the arm to the keyframe `home` (otherwise its zero configuration), within the ranges of its joints, at rest, with every
    /// brake on.
    fn reset(&mut self) {
        // SAFETY: model and data belong together; key -1 resets to the zero configuration.
        unsafe { (self.arm.mujoco.mj_resetDataKeyframe)(self.arm.model, self.motion.data(), self.arm.home) };
        self.efforts.fill(0.0);
        self.decoupled.fill(f64::NAN);
        self.motors.fill(0.0);
        self.push = [0.0; 3];
        self.slowing.fill(0);
        for joint in &self.arm.joints {
            self.braked[joint.velocity] = true;
        }
        self.sense();
        for (held, joint) in self.held.iter_mut().zip(&self.arm.joints) {
            (self.state[joint.position], *held) = (joint.part.home, joint.part.home);
        }
        // SAFETY: model and data belong together; `state` has the sizes that `mj_stateSize` gave.
        unsafe { (self.arm.mujoco.mj_setState)(self.arm.model, self.motion.data(), self.state.as_ptr(), state::QPOS | state::QVEL) };
        self.sense();
        self.before.copy_from_slice(&self.state);
    }

    /// Sets the joints to the positions of the service, at rest, and everything else to its initial state.
    fn put(&mut self) {
        self.reset();
        for (joint, (held, place)) in self.arm.joints.iter().zip(self.held.iter_mut().zip(&self.place)) {
            (self.state[joint.position], *held) = (*place, *place);
            self.state[self.positions + joint.velocity] = 0.0;
        }
        // SAFETY: model and data belong together; `state` has the sizes that `mj_stateSize` gave.
        unsafe { (self.arm.mujoco.mj_setState)(self.arm.model, self.motion.data(), self.state.as_ptr(), state::QPOS | state::QVEL) };
        self.sense();
        self.before.copy_from_slice(&self.state);
    }

    /// Runs steps with all brakes on, and with only the first joint's brake on.
    fn warm_up(&mut self) {
        (0..WARM_UP_STEPS).for_each(|_| self.step());
        for joint in &self.arm.joints[1..] {
            self.braked[joint.velocity] = false;
        }
        (0..WARM_UP_STEPS).for_each(|_| self.step());
    }

    /// Makes MuJoCo compute the quantities that depend on the state, such as kinematics and inertia, and copies the state.
    fn sense(&mut self) {
        let (mujoco, model, data) = (self.arm.mujoco, self.arm.model, self.motion.data());
        // SAFETY: model and data belong together; `state` has the sizes that `mj_stateSize` gave.
        unsafe {
            (mujoco.mj_step1)(model, data);
            (mujoco.mj_getState)(model, data, self.state.as_mut_ptr(), state::QPOS | state::QVEL);
        }
    }

    /// Computes the efforts that hold the arm. They are needed once per reading, and when a brake bears the load of moving joints.
    pub(super) fn weigh(&mut self) {
        // SAFETY: model and data belong together; `bias` has nv elements.
        unsafe { (self.arm.mujoco.mj_rne)(self.arm.model, self.motion.data(), 0, self.bias.as_mut_ptr()) };
        for spring in &self.arm.springs {
            self.bias[spring.velocity] += spring.stiffness * (self.state[spring.position] - spring.rest);
        }
    }

    /// Applies the brake of a joint. The brake slows the joint down with the maximum effort of its drive, and then holds it where it has
    /// stopped; a joint that does not stop within `BRAKING_NS_MAX` is held where it is.
    fn close_brake(&mut self, j: usize) {
        if !self.braked[self.arm.joints[j].velocity] && self.slowing[j] == 0 {
            self.slowing[j] = BRAKING_NS_MAX;
        }
    }

    /// Releases the brake of a joint.
    fn release_brake(&mut self, j: usize) {
        (self.slowing[j], self.braked[self.arm.joints[j].velocity]) = (0, false);
    }

    /// Locks the brakes of joints that come to rest within the next time step.
    fn catch(&mut self) {
        let (nv, step_ns) = (self.bias.len(), self.arm.timestep_ns);
        // SAFETY: model and data belong together; `inertia` has nv * nv elements.
        unsafe { (self.arm.mujoco.mj_fullM)(self.arm.model, self.motion.data(), self.inertia.as_mut_ptr()) };
        for (j, joint) in self.arm.joints.iter().enumerate() {
            if self.slowing[j] == 0 {
                continue;
            }
            self.slowing[j] = (self.slowing[j] - step_ns).max(0);
            let speed = self.state[self.positions + joint.velocity].abs();
            let is_caught = speed * self.inertia[joint.velocity * (nv + 1)] <= joint.part.effort_max * step_ns as f64 * 1e-9;
            if is_caught || self.slowing[j] == 0 {
                (self.slowing[j], self.braked[joint.velocity]) = (0, true);
                self.held[j] = self.state[joint.position];
            }
        }
    }

    /// Runs one time step under the last commands.
    fn step(&mut self) {
        if self.slowing.iter().any(|left_ns| *left_ns > 0) {
            self.catch();
        }
        self.load_efforts();
        self.load_push();
        let (mujoco, model, data) = (self.arm.mujoco, self.arm.model, self.motion.data());
        // SAFETY: model and data belong together; `forces` has the size of both components, `state` as in `sense`.
        unsafe {
            (mujoco.mj_setState)(model, data, self.forces.as_ptr(), state::QFRC_APPLIED | state::XFRC_APPLIED);
            if self.arm.runge_kutta { (mujoco.mj_step)(model, data) } else { (mujoco.mj_step2)(model, data) }
        }
        if self.braked.contains(&true) {
            self.hold();
        }
        self.sense();
    }

    /// Resets every joint whose brake is on to the position at which it is held.
    fn hold(&mut self) {
        let (mujoco, model, data) = (self.arm.mujoco, self.arm.model, self.motion.data());
        // SAFETY: model and data belong together; `state` has the sizes that `mj_stateSize` gave.
        unsafe { (mujoco.mj_getState)(model, data, self.state.as_mut_ptr(), state::QPOS | state::QVEL) };
        for (joint, held) in self.arm.joints.iter().zip(&self.held) {
            if self.braked[joint.velocity] {
                self.state[joint.position] = *held;
                self.state[self.positions + joint.velocity] = 0.0;
            }
        }
        // SAFETY: as above.
        unsafe { (mujoco.mj_setState)(model, data, self.state.as_ptr(), state::QPOS | state::QVEL) };
    }

    /// Reads the values of a sensor into `sensed`.
    fn take(&mut self, sensor: i32, elements: usize) -> &[f64] {
        debug_assert!(elements <= self.sensed.len(), "`sensed` has room for every sensor of the model");
        // SAFETY: the sensor is one of this model and has that number of elements, for which `sensed` has room; a null result means that
        // they were written there instead.
        unsafe {
            let place = (self.arm.mujoco.mj_readSensor)(self.arm.model, self.motion.data(), sensor, self.time_ns as f64 * 1e-9, self.sensed.as_mut_ptr(), 0);
            if !place.is_null() {
                std::ptr::copy_nonoverlapping(place.cast::<f64>(), self.sensed.as_mut_ptr(), elements);
            }
        }
        &self.sensed[..elements]
    }

    /// Copies the values of a sensor, times `factor`, into the readings.
    fn tell(&mut self, sensor: i32, elements: usize, factor: f64, readings: &mut [u8], slot: Slot) {
        for (index, value) in self.take(sensor, elements).iter().enumerate() {
            slot.set_double(readings, index, factor * value);
        }
    }

    /// Runs the time steps up to and including the one that contains the release, because an effort acts from the step after it is
    /// written.
    fn advance(&mut self, release_ns: i64) -> Result<(), DeviceError> {
        let span = release_ns - self.time_ns;
        if span > ADVANCE_NS_MAX {
            self.time_ns += (span - ADVANCE_NS_MAX) / self.arm.timestep_ns * self.arm.timestep_ns;
        }
        while self.time_ns < release_ns {
            self.time_ns += self.arm.timestep_ns;
            self.before.copy_from_slice(&self.state);
            if log::watch(|| self.step()) {
                return Err(self.lost(log::text()));
            }
        }
        match self.state.iter().position(|x| !x.is_finite()) {
            None => Ok(()),
            Some(_) => Err(self.lost("its state is not finite".into())),
        }
    }

    fn lost(&self, reason: String) -> DeviceError {
        let joint = self.blamed(&reason).map(|name| format!(" (joint '{name}')")).unwrap_or_default();
        DeviceError { message: format!("the simulated arm failed at {} ns: {reason}{joint}", self.time_ns) }
    }

    /// Returns the name of the joint whose degree of freedom appears in a message of MuJoCo: "Nan, Inf or huge value in QACC at DOF 3."
    fn blamed(&self, reason: &str) -> Option<&str> {
        let (_, behind) = reason.split_once("at DOF ")?;
        let digits = behind.split(|sign: char| !sign.is_ascii_digit()).next()?;
        self.arm.freedoms.get(digits.parse::<usize>().ok()?).map(String::as_str)
    }
}

/// Returns the error for an effort that is NaN.
fn unbounded(joint: &str, channel: &str) -> DeviceError {
    DeviceError { message: format!("the effort written to '{joint}.{channel}' is not finite; find the block that writes it") }
}

/// Returns the maximum number of values of a sensor; the force at the tool has three.
fn elements_max(arm: &Arm) -> usize {
    let of_contacts = arm.contacts.map(|(_, count)| contacts::TOLD * count);
    arm.sensors.iter().map(|sensor| sensor.elements).chain(of_contacts).fold(3, usize::max)
}

impl Driver for Plant {
    fn channels(&self) -> &[Channel] {
        &self.channels
    }

    fn open(&mut self, now_ns: i64) -> Result<(), DeviceError> {
        // Installed again: the program may have replaced our receiver since.
        log::install(self.arm.mujoco);
        if log::watch(|| self.warm_up()) {
            return Err(self.lost(log::text()));
        }
        self.reset();
        self.time_ns = now_ns;
        Ok(())
    }

    fn read(&mut self, release_ns: i64, readings: &mut [u8]) -> Result<(), DeviceError> {
        self.advance(release_ns)?;
        if self.places.take(&mut self.place) {
            self.put();
        }
        self.weigh();
        fold_forces(&self.arm.followers, &self.state[..self.positions], &mut self.bias);
        let left = ((self.time_ns - release_ns) as f64 / self.arm.timestep_ns as f64).clamp(0.0, 1.0);
        let at_release = |of: usize| left * self.before[of] + (1.0 - left) * self.state[of];
        for (j, (joint, ([position, velocity, bias, motor, limit], _))) in self.arm.joints.iter().zip(&self.slots.joints).enumerate() {
            position.set_double(readings, 0, at_release(joint.position));
            velocity.set_double(readings, 0, at_release(self.positions + joint.velocity));
            bias.set_double(readings, 0, self.bias[joint.velocity]);
            motor.set_double(readings, 0, self.motors[j]);
            limit.set_double(readings, 0, joint.part.effort_max);
        }
        if let (Some(slot), Some(sensor)) = (self.slots.force, self.arm.tool.as_ref().and_then(|tool| tool.sensor)) {
            // MuJoCo reports the force of the flange on the tool.
            self.tell(sensor, 3, -1.0, readings, slot);
        }
        for ((_, first), slot) in self.arm.free.iter().zip(&self.slots.free) {
            (0..7).for_each(|k| slot.set_double(readings, k, self.state[first + k]));
        }
        if let (Some(slot), Some((sensor, count))) = (self.slots.contacts, self.arm.contacts) {
            let told = self.take(sensor, contacts::TOLD * count).as_chunks().0;
            for (contact, value) in told.iter().flat_map(contacts::given).enumerate() {
                slot.set_double(readings, contact, value);
            }
        }
        for s in 0..self.arm.sensors.len() {
            self.tell(self.arm.sensors[s].id, self.arm.sensors[s].elements, 1.0, readings, self.slots.sensors[s]);
        }
        Ok(())
    }

    fn write(&mut self, _: i64, commands: &[u8], engaged: &[bool]) -> Result<(), DeviceError> {
        for (j, joint) in self.arm.joints.iter().enumerate() {
            let command = self.slots.joints[j].1.double(commands, 0);
            if !command.is_finite() {
                return Err(unbounded(&joint.part.name, "effort"));
            }
            self.efforts[j] = command;
        }
        let is_engaged = |channel: usize| engaged.get(channel).copied().unwrap_or(false);
        for j in 0..self.efforts.len() {
            let decouples = is_engaged(self.slots.first_decoupled + j);
            self.decoupled[j] = if decouples { self.slots.decoupled[j].double(commands, 0) } else { f64::NAN };
            if self.decoupled[j].is_infinite() {
                return Err(unbounded(&self.arm.joints[j].part.name, "decoupled"));
            }
            if is_engaged(j) || decouples { self.release_brake(j) } else { self.close_brake(j) }
        }
        if let Some(slot) = self.slots.push {
            self.push = std::array::from_fn(|k| slot.double(commands, k));
            if self.push.iter().any(|f| !f.is_finite()) {
                return Err(DeviceError { message: "the force written to 'tool.push' is not finite".into() });
            }
        }
        Ok(())
    }

    fn safe_state(&mut self) {
        self.push = [0.0; 3];
        self.efforts.fill(0.0);
        self.decoupled.fill(f64::NAN);
        (0..self.efforts.len()).for_each(|j| self.close_brake(j));
    }

    fn close(&mut self) {
        self.safe_state();
    }

    fn services(&self) -> Option<Arc<dyn Services>> {
        Some(self.places.clone())
    }
}
