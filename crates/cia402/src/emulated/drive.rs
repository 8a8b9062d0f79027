// SPDX-License-Identifier: Apache-2.0
//! An emulated drive: the state machine and modes of CiA 402, and a motor that follows the targets.
use super::brake::Brake;
use super::homing::{Limits, Search};
use super::objects::{Access, Handle, Objects};
use crate::states::{DriveState, FOLLOWING_ERROR, Mode, RESET};

/// Vendor ID of the emulated drives, which is unassigned.
pub const VENDOR: u32 = 0x0000_6A1C;
pub const PRODUCT: u32 = 0x0000_0402;
/// Faults, as in object 0x603F.
const COMMUNICATION: u16 = 0x8130;
const BLOCKED: u16 = 0x7121;
/// Distance that an axis can move while its brake is closed, counts.
const SLACK: f64 = 2.0;
/// Minimum quick-stop option code with which a drive stays in the state "quick stop active".
const STAYS: i64 = 5;
/// Acceleration caused by torque, counts/s² per thousandth of the rated torque; and friction coefficient, which reduces the velocity,
/// 1/s.
const ACCELERATION: f64 = 100.0;
const FRICTION: f64 = 2.0;
/// Deceleration at which the drive stops by itself, counts/s².
const STOPPING: f64 = 2_000_000.0;

/// An emulated drive with its axis.
pub struct Drive {
    at: Handles,
    state: DriveState,
    /// Position and velocity, counts and counts/s.
    position: f64,
    velocity: f64,
    had_reset: bool,
    search: Search,
    brake: Brake,
    limits: Limits,
    /// Offset from a machine position to the drive's position value, counts.
    origin: f64,
    /// True if the enable input is open: the drive then stays in "switch on disabled".
    is_disabled: bool,
}

struct Handles {
    control: Handle,
    status: Handle,
    error: Handle,
    mode: Handle,
    mode_shown: Handle,
    target_position: Handle,
    target_velocity: Handle,
    target_torque: Handle,
    position: Handle,
    velocity: Handle,
    torque: Handle,
    window: Handle,
    quick_stop: Handle,
}

impl Drive {
    /// Creates a drive at this position, and adds its objects to the existing ones.
    pub fn new(objects: &mut Objects, position: i32) -> Drive {
        let mut word = |index, access, len: usize, value: i64| objects.add(index, 0, access, &value.to_le_bytes()[..len]);
        use Access::{Measured, Written};
        let at = Handles {
            control: word(0x6040, Written, 2, 0),
            status: word(0x6041, Measured, 2, 0),
            error: word(0x603F, Measured, 2, 0),
            mode: word(0x6060, Written, 1, 0),
            mode_shown: word(0x6061, Measured, 1, 0),
            target_position: word(0x607A, Written, 4, i64::from(position)),
            target_velocity: word(0x60FF, Written, 4, 0),
            target_torque: word(0x6071, Written, 2, 0),
            position: word(0x6064, Measured, 4, i64::from(position)),
            velocity: word(0x606C, Measured, 4, 0),
            torque: word(0x6077, Measured, 2, 0),
            window: word(0x6065, Written, 4, 20_000),
            quick_stop: word(0x605A, Written, 2, 2),
        };
        objects.add(0x60C2, 0, Access::Constant, &[2]);
        objects.add(0x60C2, 1, Access::Written, &[1]);
        objects.add(0x60C2, 2, Access::Written, &[0xFD]);
        let position = f64::from(position);
        Drive {
            at,
            state: DriveState::SwitchOnDisabled,
            position,
            velocity: 0.0,
            had_reset: false,
            search: Search::new(objects),
            brake: Brake::new(objects),
            limits: None,
            origin: 0.0,
            is_disabled: false,
        }
    }

    /// Sets the positions of the machine's limit switches, in counts from the drive's initial zero position.
    pub fn set_limits(&mut self, limits: Limits) {
        self.limits = limits;
    }

    /// Adds a brake, and a load that falls at this speed if neither the brake nor the motor holds it, counts/s.
    pub fn set_load(&mut self, falls: Option<f64>) {
        self.brake.set_load(falls);
    }

    /// Closes or opens the enable input of the drive; it is closed initially.
    pub fn set_enable_input(&mut self, is_closed: bool) {
        self.is_disabled = !is_closed;
    }

    /// Advances by a time span, applying the commands in the objects, and stores the measurements.
    pub fn step(&mut self, objects: &mut Objects, span_s: f64) {
        let control = objects.bits(self.at.control) as u16;
        self.change_state(control, objects);
        let mode = Mode::of(objects.number(self.at.mode) as i8);
        let target = objects.number(self.at.target_position) as f64;
        if mode != Some(Mode::Homing) {
            self.search.leave();
        }
        let is_powered = matches!(self.state, DriveState::OperationEnabled | DriveState::QuickStopActive);
        let is_held = self.brake.is_closed(objects, is_powered);
        let place = self.position - self.origin;
        if self.state == DriveState::OperationEnabled {
            self.move_by_mode(mode, target, objects, control, span_s);
        } else {
            let slower = (self.velocity.abs() - STOPPING * span_s).max(0.0);
            self.velocity = slower.copysign(self.velocity);
            self.position += self.velocity * span_s;
            if self.state == DriveState::QuickStopActive && self.velocity == 0.0 && objects.number(self.at.quick_stop) < STAYS {
                self.state = DriveState::SwitchOnDisabled;
            }
        }
        if is_held {
            if is_powered && (self.position - self.origin - place).abs() > SLACK {
                self.fail(BLOCKED, objects);
            }
            (self.position, self.velocity) = (place + self.origin, 0.0);
        } else if !is_powered {
            self.position -= self.brake.fall(span_s);
        }
        let is_home = self.search.is_home();
        let follows = self.state == DriveState::OperationEnabled && mode != Some(Mode::Homing) || is_home;
        // "Remote" is always set; "voltage enabled" is cleared only by a fault.
        let homing = u16::from(is_home) << 10 | u16::from(self.search.has_failed()) << 13;
        let status = self.state.status() | 1 << 9 | u16::from(follows) << 12 | homing;
        let at = &self.at;
        let mode_shown = objects.number(at.mode);
        let torque = if mode == Some(Mode::Torque) && self.state == DriveState::OperationEnabled { objects.number(at.target_torque) } else { 0 };
        let measured = [
            (at.status, i64::from(status)),
            (at.mode_shown, mode_shown),
            (at.position, self.position.round() as i32 as i64),
            (at.velocity, self.velocity.round() as i32 as i64),
            (at.torque, torque),
        ];
        measured.into_iter().for_each(|(to, value)| objects.set_number(to, value));
    }

    fn move_by_mode(&mut self, mode: Option<Mode>, target: f64, objects: &mut Objects, control: u16, span_s: f64) {
        match mode {
            Some(Mode::Position) => {
                if (target - self.position).abs() > objects.number(self.at.window) as f64 {
                    return self.fail(FOLLOWING_ERROR, objects);
                }
                self.velocity = if span_s > 0.0 { (target - self.position) / span_s } else { self.velocity };
                self.position = target;
                return;
            }
            Some(Mode::Velocity) => self.velocity = objects.number(self.at.target_velocity) as f64,
            Some(Mode::Torque) => {
                let torque = objects.number(self.at.target_torque) as f64;
                self.velocity += (torque * ACCELERATION - FRICTION * self.velocity) * span_s;
            }
            Some(Mode::Homing) => {
                let moved = self.search.step(objects, control & 0x10 != 0, self.position - self.origin, self.limits, span_s);
                self.velocity = moved.velocity;
                if let Some(position) = moved.position {
                    let place = self.position + self.velocity * span_s - self.origin;
                    (self.position, self.velocity, self.origin) = (position, 0.0, position - place);
                }
            }
            None => self.velocity = 0.0,
        }
        self.position += self.velocity * span_s;
    }

    fn change_state(&mut self, control: u16, objects: &mut Objects) {
        use DriveState::*;
        let reset = control & RESET != 0;
        if self.state == Fault && reset && !self.had_reset {
            self.state = SwitchOnDisabled;
            objects.set_number(self.at.error, 0);
        }
        self.had_reset = reset;
        let next = match control & 0x0F {
            _ if control & 0x02 == 0 => Some(SwitchOnDisabled),
            _ if control & 0x04 == 0 => Some(if self.state == OperationEnabled { QuickStopActive } else { SwitchOnDisabled }),
            word if word & 0x07 == 0x06 => Some(ReadyToSwitchOn),
            0x07 => Some(SwitchedOn),
            0x0F => Some(OperationEnabled),
            _ => None,
        };
        self.state = match (self.state, next) {
            (Fault, _) | (_, None) => self.state,
            (QuickStopActive, Some(SwitchOnDisabled)) if control & 0x02 != 0 => self.state,
            (QuickStopActive, Some(to)) if to != SwitchOnDisabled => self.state,
            // Upwards, only one step is made at a time.
            (SwitchOnDisabled, Some(ReadyToSwitchOn | SwitchOnDisabled)) => next.unwrap_or(self.state),
            (SwitchOnDisabled, _) => self.state,
            (ReadyToSwitchOn, Some(OperationEnabled)) => SwitchedOn,
            (_, Some(to)) => to,
        };
        if self.is_disabled && matches!(self.state, ReadyToSwitchOn | SwitchedOn | OperationEnabled | QuickStopActive) {
            self.state = SwitchOnDisabled;
        }
    }

    /// Reacts to the loss of outputs as a drive does.
    pub fn lose_communication(&mut self, objects: &mut Objects) {
        objects.set_number(self.at.control, 0);
        if self.state == DriveState::OperationEnabled {
            self.fail(COMMUNICATION, objects);
        }
    }

    /// Triggers a fault in the drive.
    pub fn fail(&mut self, error: u16, objects: &mut Objects) {
        self.state = DriveState::Fault;
        objects.set_number(self.at.error, i64::from(error));
    }
}
