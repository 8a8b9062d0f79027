// SPDX-License-Identifier: Apache-2.0
//! Command side of a drive: determines control word, mode and target in each cycle.
use crate::brake::{Brake, BrakeOptions};
use crate::homing::{ANSWERS, Homing, HomingState, HomingStep};
use crate::states::{DISABLE_VOLTAGE, DriveState, ENABLE, Mode, QUICK_STOP, RESET};

/// Scales and limits of an axis.
#[derive(Clone, Copy, Debug)]
pub struct Scale {
    pub mode: Mode,
    /// Counts per unit of position; negative if the directions are opposite.
    pub counts: f64,
    /// Counts at position 0.
    pub offset: f64,
    /// Maximum speed, units of position per second.
    pub speed_max: f64,
    /// Rated torque, N.m or N; 1 if unknown.
    pub rated_torque: f64,
}

/// Command to a drive until the next cycle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DriveCommand {
    pub control: u16,
    pub mode: Mode,
    /// Target in the drive's own units; only 16 bits are used for a torque.
    pub target: i32,
    /// Value of the brake's output; `None` if there is no brake, or the drive controls it.
    pub brake: Option<u32>,
}

/// Determines the commands to a drive. The drive is switched on while it is engaged, its target starts at its current position, and it
/// comes to rest when it is stopped. A brake is released only while the motor holds the axis, and the motor holds the axis until the
/// brake has closed.
#[derive(Clone, Debug)]
pub struct Commander {
    scale: Scale,
    status: u16,
    state: DriveState,
    /// Mode reported by the drive.
    mode: i8,
    /// Actual position, and commanded position, counts.
    position: f64,
    target: f64,
    /// True if the axis has been engaged; it then stays enabled until it is stopped.
    is_wanted: bool,
    /// True if the axis is stopped until it is engaged again.
    is_stopped: bool,
    /// True if the axis was engaged in the last cycle.
    was_engaged: bool,
    /// True if operation has been enabled since the axis was engaged.
    was_enabled: bool,
    /// Time for which the axis has been engaged without reaching the Operation Enabled state, s.
    awaited_s: f64,
    /// Number of cycles during which the status "operation enabled" may still be older than the command to disable operation.
    stale: u32,
    resets: bool,
    homing: Option<Homing>,
    homed: HomingState,
    brake: Option<Brake>,
}

/// Maximum speed of any axis in any unit; its product with a time is still finite.
const SPEED_MAX: f64 = 1e15;

impl Commander {
    pub fn new(scale: Scale, brake: Option<BrakeOptions>) -> Commander {
        Commander {
            scale,
            status: 0,
            state: DriveState::NotReady,
            mode: 0,
            position: 0.0,
            target: 0.0,
            is_wanted: false,
            is_stopped: false,
            was_engaged: false,
            was_enabled: false,
            awaited_s: 0.0,
            stale: 0,
            resets: false,
            homing: None,
            homed: HomingState::No,
            brake: brake.map(Brake::new),
        }
    }

    /// Processes the status word, the position (counts), and the reported mode (0 if the drive does not report it).
    pub fn see(&mut self, status: u16, position: i32, mode: i8) {
        (self.status, self.state, self.position, self.mode) = (status, DriveState::of(status), f64::from(position), mode);
        let is_enabled = self.state == DriveState::OperationEnabled;
        self.stale = if is_enabled { self.stale.saturating_sub(1) } else { 0 };
        self.was_enabled = self.is_wanted && (self.was_enabled || is_enabled && self.stale == 0);
    }

    pub fn scale(&self) -> Scale {
        self.scale
    }

    pub fn status(&self) -> u16 {
        self.status
    }

    pub fn state(&self) -> DriveState {
        self.state
    }

    /// Returns the position in the unit of position.
    pub fn position(&self) -> f64 {
        (self.position - self.scale.offset) / self.scale.counts
    }

    /// Converts a velocity from counts per second to units of position per second.
    pub fn velocity(&self, counts: i32) -> f64 {
        f64::from(counts) / self.scale.counts
    }

    /// Converts thousandths of the rated torque to N.m or N.
    pub fn torque(&self, thousandths: i32) -> f64 {
        f64::from(thousandths) * 1e-3 * self.scale.rated_torque * self.scale.counts.signum()
    }

    /// Returns true if the drive has a fault and no reset is pending.
    pub fn is_faulty(&self) -> bool {
        matches!(self.state, DriveState::Fault | DriveState::FaultReaction) && !self.resets
    }

    /// Returns true if the axis is to move or to hold its position.
    pub fn is_wanted(&self) -> bool {
        self.is_wanted
    }

    /// Returns true if the drive has disabled operation without a command: by itself, because of its watchdog, or because of one of its
    /// inputs.
    pub fn has_dropped(&self) -> bool {
        self.was_enabled && self.is_wanted && self.state != DriveState::OperationEnabled
    }

    /// Returns true if the axis follows its commands: its operation is enabled, and its brake is released.
    pub fn is_operating(&self) -> bool {
        self.was_enabled && self.state == DriveState::OperationEnabled && self.brake.is_none_or(|brake| brake.is_open())
    }

    /// Returns the time for which the axis has been engaged without reaching the Operation Enabled state, s; 0 once the state has been
    /// reached.
    pub fn awaited_s(&self) -> f64 {
        self.awaited_s
    }

    /// Requests a fault reset with the next command.
    pub fn reset(&mut self) {
        (self.resets, self.awaited_s) = (true, 0.0);
    }

    /// Starts homing. Must be called only while the axis is not engaged.
    pub fn home(&mut self) {
        (self.is_wanted, self.was_enabled, self.is_stopped, self.awaited_s) = (false, false, false, 0.0);
        (self.homing, self.homed) = (Some(Homing::default()), HomingState::GoingOn);
    }

    pub fn homed(&self) -> HomingState {
        self.homed
    }

    /// Ends homing.
    pub fn leave_homing(&mut self) {
        if self.homing.take().is_some() {
            self.homed = HomingState::Failed;
        }
    }

    /// Brings the axis to rest and switches it off, until it is engaged again.
    pub fn stop(&mut self) {
        self.leave_homing();
        if let Some(brake) = &mut self.brake {
            brake.tell(false, 0.0);
        }
        (self.is_wanted, self.is_stopped, self.was_enabled, self.awaited_s) = (false, true, false, 0.0);
    }

    /// Returns the command for the next cycle, which starts after `span_s`. Real-time safe.
    pub fn tell(&mut self, command: f64, is_engaged: bool, span_s: f64) -> DriveCommand {
        self.is_stopped &= !is_engaged || self.was_engaged;
        self.was_engaged = is_engaged;
        if is_engaged && self.homing.is_some() {
            // A verb that engages the axis expects it to follow.
            self.stop();
        }
        let is_torque = self.scale.mode == Mode::Torque;
        // An axis that is no longer engaged holds its position, unless it never reached operation: then it must not do so later by
        // itself.
        self.is_wanted = !self.is_stopped && (is_engaged || self.is_wanted && self.was_enabled && !is_torque);
        self.was_enabled &= self.is_wanted;
        self.awaited_s = if self.is_wanted && !self.was_enabled { self.awaited_s + span_s } else { 0.0 };
        let is_held = self.state == DriveState::OperationEnabled && (self.is_wanted || self.homing.is_some());
        if let Some(brake) = &mut self.brake {
            brake.tell(is_held, span_s);
        }
        let is_open = self.brake.is_none_or(|brake| brake.is_open());
        let is_moving = is_engaged && command.is_finite() && is_held && is_open;
        let target = self.target(is_moving.then_some(command), span_s);
        self.told(target)
    }

    /// Returns a command without a new target, so that the axis stays at rest. Real-time safe.
    pub fn tell_idle(&mut self) -> DriveCommand {
        self.target = self.position;
        self.told(self.rest())
    }

    /// Returns the command that another process sends after this one has exited: a quick stop, with the brake closed. Drives do not
    /// follow their target during a quick stop; one that did would hold its position.
    pub fn last_words(&self) -> DriveCommand {
        let closed = self.brake.map(|mut brake| {
            brake.tell(false, 0.0);
            brake.word()
        });
        DriveCommand { control: QUICK_STOP, mode: self.scale.mode, target: self.rest().round() as i32, brake: closed }
    }

    /// Returns the target for an axis at rest.
    fn rest(&self) -> f64 {
        if self.scale.mode == Mode::Position { self.position } else { 0.0 }
    }

    fn told(&mut self, target: f64) -> DriveCommand {
        let control = self.control();
        if self.state == DriveState::OperationEnabled && control != ENABLE && self.homing.is_none() {
            self.stale = ANSWERS;
        }
        let target = if self.scale.mode == Mode::Torque { i32::from(target.round() as i16) } else { target.round() as i32 };
        let mode = if self.homing.is_some() { Mode::Homing } else { self.scale.mode };
        DriveCommand { control, mode, target, brake: self.brake.map(|brake| brake.word()) }
    }

    fn control(&mut self) -> u16 {
        if std::mem::take(&mut self.resets) && self.state == DriveState::Fault {
            return RESET;
        }
        let (is_open, is_closed) = self.brake.map_or((true, true), |brake| (brake.is_open(), brake.is_closed()));
        if self.homing.is_some() && self.state == DriveState::OperationEnabled && !is_open {
            return ENABLE;
        }
        if let Some(homing) = &mut self.homing {
            match homing.step(self.status, self.mode) {
                HomingStep::Tell(control) => return control,
                HomingStep::Attained => self.homed = HomingState::Yes,
                HomingStep::Failed => self.homed = HomingState::Failed,
            }
            self.homing = None;
        }
        match (self.is_stopped, self.is_wanted) {
            (true, _) if self.is_powered() && (self.brake.is_none() || !is_closed) => QUICK_STOP,
            // The motor holds the axis until its brake has closed.
            (false, _) if self.state == DriveState::QuickStopActive && !is_closed => QUICK_STOP,
            (false, false) if self.state == DriveState::OperationEnabled && !is_closed => ENABLE,
            (false, true) => self.state.towards_operation(),
            (true, _) | (false, false) => DISABLE_VOLTAGE,
        }
    }

    fn is_powered(&self) -> bool {
        matches!(self.state, DriveState::OperationEnabled | DriveState::QuickStopActive)
    }

    /// Returns the target, limited to the distance that the maximum speed allows in this time.
    fn target(&mut self, command: Option<f64>, span_s: f64) -> f64 {
        let Scale { mode, counts, offset, speed_max, rated_torque } = self.scale;
        match mode {
            Mode::Position | Mode::Homing => {
                if self.state != DriveState::OperationEnabled {
                    // The target follows the position, so the axis does not jump when it reaches operation.
                    self.target = self.position;
                } else if let Some(position) = command {
                    let step_max = (speed_max * counts.abs()).min(SPEED_MAX) * span_s;
                    let wish = (position * counts + offset).clamp(i32::MIN.into(), i32::MAX.into());
                    self.target += (wish - self.target).clamp(-step_max, step_max);
                }
                self.target
            }
            Mode::Velocity => command.map_or(0.0, |velocity| velocity.clamp(-speed_max, speed_max) * counts),
            Mode::Torque => command.map_or(0.0, |torque| torque / rated_torque * 1e3 * counts.signum()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::states::{SHUT_DOWN, SWITCH_ON};

    const OFF: u16 = 0x50;
    const ENABLED: u16 = 0x37;

    fn commander(mode: Mode) -> Commander {
        Commander::new(Scale { mode, counts: -1000.0, offset: 500.0, speed_max: 2.0, rated_torque: 4.0 }, None)
    }

    fn told(of: &mut Commander, command: f64, is_engaged: bool) -> (u16, i32) {
        let DriveCommand { control, target, .. } = of.tell(command, is_engaged, 0.01);
        (control, target)
    }

    #[test]
    fn an_axis_comes_into_operation_where_it_is_and_moves_no_faster_than_it_may() {
        let mut x = commander(Mode::Position);
        for (status, control) in [(OFF, SHUT_DOWN), (0x31, SWITCH_ON), (0x33, ENABLE)] {
            x.see(status, 400, 0);
            assert_eq!(told(&mut x, 9.0, true), (control, 400));
        }
        x.see(ENABLED, 400, 0);
        assert_eq!(told(&mut x, 9.0, true), (ENABLE, 380));
        assert_eq!(told(&mut x, f64::NAN, true), (ENABLE, 380));
        assert_eq!(told(&mut x, 0.0, false), (ENABLE, 380), "nobody engages it: it holds");
    }

    #[test]
    fn a_stop_lasts_until_somebody_engages_it_anew() {
        for mode in [Mode::Position, Mode::Velocity, Mode::Torque] {
            let mut x = commander(mode);
            x.see(ENABLED, 0, 0);
            assert_eq!(told(&mut x, 1.0, true).0, ENABLE);
            x.stop();
            assert_eq!(told(&mut x, 1.0, true).0, QUICK_STOP);
            assert_eq!(told(&mut x, 0.0, false).0, QUICK_STOP, "it is not let go while it moves");
            x.see(0x17, 0, 0);
            assert_eq!(told(&mut x, 0.0, false).0, QUICK_STOP);
            x.see(OFF, 0, 0);
            assert_eq!(told(&mut x, 0.0, false).0, DISABLE_VOLTAGE);
            assert_eq!(told(&mut x, 1.0, true).0, SHUT_DOWN);
        }
    }

    #[test]
    fn one_that_stays_engaged_stays_stopped() {
        let mut x = commander(Mode::Velocity);
        x.see(ENABLED, 0, 0);
        assert_eq!(told(&mut x, 1.0, true), (ENABLE, -1000));
        x.stop();
        assert_eq!(told(&mut x, 1.0, true), (QUICK_STOP, 0));
        x.see(OFF, 0, 0);
        assert_eq!(told(&mut x, 1.0, true), (DISABLE_VOLTAGE, 0));
        told(&mut x, 0.0, false);
        assert_eq!(told(&mut x, 1.0, true).0, SHUT_DOWN);
    }

    #[test]
    fn one_that_leaves_operation_by_itself_is_not_switched_on_again_unseen() {
        let mut x = commander(Mode::Torque);
        x.see(OFF, 0, 0);
        x.tell(0.0, true, 0.01);
        assert!(!x.has_dropped(), "it is on its way");
        x.see(ENABLED, 0, 0);
        assert_eq!(told(&mut x, 2.0, true), (ENABLE, -500));
        x.see(OFF, 0, 0);
        assert!(x.has_dropped());
    }

    #[test]
    fn one_that_does_not_come_into_operation_counts_for_how_long_it_was_awaited() {
        let mut x = commander(Mode::Position);
        x.see(OFF, 0, 0);
        for cycle in 1..=20 {
            x.tell(0.0, true, 0.01);
            assert!((x.awaited_s() - 0.01 * f64::from(cycle)).abs() < 1e-12 && !x.is_operating());
        }
        x.see(ENABLED, 0, 0);
        x.tell(0.0, true, 0.01);
        assert_eq!((x.awaited_s(), x.is_operating()), (0.0, true));
    }

    #[test]
    fn one_that_is_left_before_it_came_into_operation_does_not_come_later() {
        for mode in [Mode::Position, Mode::Velocity, Mode::Torque] {
            let mut x = commander(mode);
            x.see(OFF, 0, 0);
            assert_eq!(told(&mut x, 1.0, true).0, SHUT_DOWN);
            assert_eq!(told(&mut x, 1.0, false).0, DISABLE_VOLTAGE, "nobody engages it any more");
            x.see(0x31, 0, 0);
            assert_eq!(told(&mut x, 1.0, false).0, DISABLE_VOLTAGE);
        }
    }

    #[test]
    fn a_status_from_before_it_was_switched_off_is_no_operation_that_it_could_leave() {
        let mut x = commander(Mode::Torque);
        x.see(ENABLED, 0, 0);
        x.tell(2.0, true, 0.01);
        assert_eq!(told(&mut x, 0.0, false).0, DISABLE_VOLTAGE);
        // The axis is engaged again before the drive has answered.
        x.see(ENABLED, 0, 0);
        x.tell(2.0, true, 0.01);
        x.see(ENABLED, 0, 0);
        x.tell(2.0, true, 0.01);
        x.see(OFF, 0, 0);
        assert!(!x.has_dropped(), "it was told so");
        assert_eq!(told(&mut x, 2.0, true).0, SHUT_DOWN);
    }

    #[test]
    fn the_last_words_are_a_quick_stop_where_it_is_with_the_brake_closed() {
        let scale = Scale { mode: Mode::Position, counts: 1000.0, offset: 0.0, speed_max: 2.0, rated_torque: 4.0 };
        let mut x = Commander::new(scale, Some(BrakeOptions { bit: 2, ..BrakeOptions::default() }));
        for _ in 0..20 {
            x.see(ENABLED, 400, 0);
            x.tell(0.4, true, 0.01);
        }
        assert_eq!(x.tell(0.4, true, 0.01).brake, Some(0), "released");
        assert_eq!(x.last_words(), DriveCommand { control: QUICK_STOP, mode: Mode::Position, target: 400, brake: Some(4) });
    }
}
