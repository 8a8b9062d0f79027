// SPDX-License-Identifier: Apache-2.0
//! Arming of servos: checks each servo, switches its torque on and off, and carries out services in the meantime.
use super::calibration::{Calibration, Entry};
use super::driver::Servos;
use super::frame::{Ask, BROADCAST, Frame};
use super::protocol::Protocol;
use super::registers::{Model, Register, TURN};
use device::DeviceError;
use serde_json::{Value, json};
use std::time::{Duration, Instant};

/// Time limit for a servo to restart.
const REBOOT: Duration = Duration::from_secs(2);
/// Bit of an error number which indicates that there is an error to be read.
const ALERT: u8 = 0x80;

impl Servos {
    /// Checks that every servo is as described, and switches its torque off.
    pub(super) fn meet(&mut self) -> Result<(), DeviceError> {
        let (first, model) = (self.joints[0].wired.id, self.map.model);
        self.line()?.find_echo(first, model).map_err(|why| self.gone(&why))?;
        for joint in 0..self.joints.len() {
            self.recognise(joint)?;
            self.store(joint, self.map.torque, &[0])?;
            self.forget_watchdog(joint)?;
            self.check_settings(joint)?;
            self.clear(joint)?;
        }
        Ok(())
    }

    fn recognise(&mut self, joint: usize) -> Result<(), DeviceError> {
        let number = self.ask(joint, self.map.model)?.value;
        let model = self.joints[joint].wired.model;
        match model.number {
            Some(asked) if asked != number => {
                let called = Model::called(self.protocol, number);
                Err(self.wrong(joint, &format!("is of model {number} ({called}), not {asked} ({}); correct option 'servos'", model.name)))
            }
            _ => Ok(()),
        }
    }

    fn check_settings(&mut self, joint: usize) -> Result<(), DeviceError> {
        let map = self.map;
        let (answers, mode) = (self.ask(joint, map.answers)?.value, self.ask(joint, map.mode)?.value);
        if answers < map.answers_min {
            let (address, least) = (map.answers.address, map.answers_min);
            return Err(self.wrong(joint, &format!("does not answer writes; set its register {address} to {least}")));
        }
        if !map.modes.contains(&mode) {
            let (address, asked) = (map.mode.address, map.modes[0]);
            return Err(self.wrong(joint, &format!("is in mode {mode}, in which it does not accept positions; set its register {address} to {asked}")));
        }
        let Some(asked) = self.joints[joint].wired.homing_offset else { return Ok(()) };
        let offset = self.protocol.offset(self.ask(joint, map.offset)?.value);
        if offset != asked {
            return Err(self.wrong(joint, &format!("has an offset of {offset} counts, but the calibration was made with {asked}; calibrate it again")));
        }
        Ok(())
    }

    /// Clears a critical error of a servo, if possible.
    fn clear(&mut self, joint: usize) -> Result<(), DeviceError> {
        let (map, id) = (self.map, self.joints[joint].wired.id);
        let grave = self.ask(joint, map.error)?.value as u8 & map.grave;
        if grave == 0 {
            return Ok(());
        }
        let left = if self.protocol == Protocol::Dynamixel {
            self.line()?.reboot(id).map_err(|why| self.gone(&why))?;
            let until = Instant::now() + REBOOT;
            while !self.line()?.ping(id).map_err(|why| self.gone(&why))? {
                if Instant::now() > until {
                    return Err(self.wrong(joint, &format!("reported {} and did not recover after it was restarted", map.named(grave))));
                }
            }
            self.ask(joint, map.error)?.value as u8 & map.grave
        } else {
            grave
        };
        if left == 0 { Ok(()) } else { Err(self.wrong(joint, &format!("reports {}; reduce its load, let it cool, then reset()", map.named(left)))) }
    }

    /// Writes to a register of one servo, which must acknowledge the write.
    pub(super) fn store(&mut self, joint: usize, register: Register, bytes: &[u8]) -> Result<(), DeviceError> {
        let id = self.joints[joint].wired.id;
        let written = self.line()?.write(id, register.address, bytes).map_err(|why| self.gone(&why))?;
        let Some(answered) = written else { return Err(self.wrong(joint, "does not answer; check its power and its cable")) };
        match (self.protocol, answered.error & !ALERT) {
            (Protocol::Dynamixel, error @ 1..) => Err(self.wrong(joint, &format!("refuses {bytes:?} for its register {}: error {error}", register.address))),
            _ => Ok(()),
        }
    }

    /// Switches torque on at the current position, so that the servo does not move, whatever its goal was.
    pub(super) fn hold(&mut self, joint: usize) -> Result<(), DeviceError> {
        let counts = self.joints[joint].present.counts;
        self.store(joint, self.map.goal, &self.protocol.goal(counts)[..usize::from(self.map.goal.len)])?;
        self.set_watchdog(joint)?;
        self.store(joint, self.map.torque, &[1])?;
        if self.ask(joint, self.map.torque)?.value == 0 {
            return Err(self.wrong(joint, "was commanded to hold but reports that its torque is off; check its supply and its load, then reset()"));
        }
        let held = &mut self.joints[joint];
        (held.goal, held.has_torque) = (held.wired.angle(counts), true);
        Ok(())
    }

    pub(super) fn release(&mut self, joint: usize) -> Result<(), DeviceError> {
        self.store(joint, self.map.torque, &[0])?;
        self.joints[joint].has_torque = false;
        Ok(())
    }

    /// Switches the torque of all servos off: first with a single frame for all, then one by one with acknowledgement.
    pub(super) fn rest(&mut self) {
        self.rows.clear();
        for joint in &mut self.joints {
            joint.has_torque = false;
            self.rows.extend_from_slice(&[joint.wired.id, 0]);
        }
        let torque = self.map.torque;
        let told = self.bus.as_mut().map(|bus| bus.sync_write(torque, &self.rows));
        if told.is_some_and(|told| told.is_ok()) {
            for joint in 0..self.joints.len() {
                // A servo that does not answer has received the frame for all.
                let _ = self.store(joint, torque, &[0]);
            }
        }
    }

    /// Encodes the frame that switches off the torque of all servos, for the guard.
    pub(super) fn relax(&self, frame: &mut Frame, rows: &[u8]) -> bool {
        let Register { address, len } = self.map.torque;
        self.protocol.write(frame, BROADCAST, Ask::SyncWrite { address, len, rows })
    }

    /// Updates the ends of the ranges that are being recorded.
    pub(super) fn record(&mut self) {
        // Feetech's counts wrap around after a turn, those of Dynamixel continue.
        let has_seam = self.protocol == Protocol::Sts;
        for joint in &mut self.joints {
            let counts = joint.present.counts;
            if joint.ends.is_some() && has_seam && (counts - joint.last).abs() > 0.5 * TURN {
                joint.seam = joint.seam.or(Some((joint.last, counts)));
            }
            joint.last = counts;
            joint.ends = joint.ends.map(|(low, high)| (low.min(counts), high.max(counts)));
        }
    }

    /// Carries out a service, if one is requested.
    pub(super) fn serve(&mut self) {
        if let Some(request) = self.desk.take() {
            let answer = self.carry_out(&request.service, &request.arguments);
            request.answered(answer);
        }
    }

    fn carry_out(&mut self, service: &str, arguments: &Value) -> Result<Value, DeviceError> {
        match service {
            "read" => {
                let (joint, register) = self.addressed(arguments)?;
                Ok(json!(self.ask(joint, register)?.value))
            }
            "write" => {
                let (joint, register) = self.addressed(arguments)?;
                if self.joints[joint].has_torque {
                    return Err(self.wrong(joint, "is holding its position; disable it before you write a register"));
                }
                let value = arguments["value"].as_i64().unwrap_or_default().to_le_bytes();
                self.store(joint, register, &value[..usize::from(register.len)]).map(|()| Value::Null)
            }
            "record_zero" => self.record_zero(arguments["servo"].as_str()),
            "record_ranges" => {
                for joint in &mut self.joints {
                    let counts = joint.present.counts;
                    (joint.ends, joint.seam, joint.last) = (Some((counts, counts)), None, counts);
                }
                Ok(self.counts())
            }
            _ => self.calibration(),
        }
    }

    fn named(&self, name: &str) -> Result<usize, DeviceError> {
        self.joints.iter().position(|joint| joint.wired.name == name).ok_or_else(|| {
            let meant = hints::did_you_mean(name, self.joints.iter().map(|joint| joint.wired.name.as_str()));
            DeviceError { message: format!("there is no servo '{name}' on {}; {meant}", self.port) }
        })
    }

    fn addressed(&self, arguments: &Value) -> Result<(usize, Register), DeviceError> {
        let joint = self.named(arguments["servo"].as_str().unwrap_or_default())?;
        let number = |name: &str| arguments[name].as_u64().and_then(|number| u16::try_from(number).ok());
        match (number("address"), number("length")) {
            (Some(address), Some(len @ (1 | 2 | 4))) => Ok((joint, Register { address, len })),
            _ => Err(self.wrong(joint, "does not have this register; give an address of its control table and a length of 1, 2 or 4")),
        }
    }

    fn record_zero(&mut self, name: Option<&str>) -> Result<Value, DeviceError> {
        let only = name.map(|name| self.named(name)).transpose()?;
        for (index, joint) in self.joints.iter_mut().enumerate() {
            if only.is_none_or(|only| only == index) {
                joint.zero = Some(joint.present.counts);
            }
        }
        Ok(self.counts())
    }

    /// Returns the current positions of all joints, in counts.
    fn counts(&self) -> Value {
        self.joints.iter().map(|joint| (joint.wired.name.clone(), json!(joint.present.counts))).collect()
    }

    fn calibration(&mut self) -> Result<Value, DeviceError> {
        let mut entries = Calibration::new();
        for joint in 0..self.joints.len() {
            let homing_offset = self.protocol.offset(self.ask(joint, self.map.offset)?.value);
            let of = &self.joints[joint];
            let in_force = [of.wired.counts(of.wired.min).round(), of.wired.counts(of.wired.max).round()];
            if let Some((from, to)) = of.seam {
                let why = format!("was moved across the zero point of its encoder, from count {from} to {to}, so its end positions are not known");
                return Err(self.wrong(joint, &format!("{why}; shift its middle to count 2048 (with its offset or its horn), then call record_ranges again")));
            }
            let (range_min, range_max) = of.ends.unwrap_or((in_force[0].min(in_force[1]), in_force[0].max(in_force[1])));
            if range_min >= range_max {
                return Err(self.wrong(joint, "has not been moved since record_ranges; move it from end to end"));
            }
            let zero = of.zero.unwrap_or(of.wired.zero);
            let zero = Some(zero).filter(|zero| *zero != 0.5 * (range_min + range_max));
            let entry = Entry { id: of.wired.id, drive_mode: u8::from(of.wired.direction < 0.0), homing_offset, range_min, range_max, zero };
            entries.insert(of.wired.name.clone(), entry);
        }
        serde_json::to_value(entries).map_err(|why| DeviceError { message: why.to_string() })
    }
}
