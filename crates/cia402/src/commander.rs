// SPDX-License-Identifier: Apache-2.0
//! The side that commands a drive: which control word and which target it is told in each cycle.
use crate::{DISABLE_VOLTAGE, DriveState, Mode, QUICK_STOP, RESET};

/// Scales and limits of an axis.
#[derive(Clone, Copy, Debug)]
pub struct Scale {
    pub mode: Mode,
    /// Counts to a unit of position, negative where it turns the other way.
    pub counts: f64,
    /// Counts at position 0.
    pub offset: f64,
    /// Units of position per second.
    pub speed_max: f64,
    /// N.m or N; 1 where it is not known.
    pub rated_torque: f64,
}

/// What a drive is told. It is switched on while it is engaged, its target begins where it is, and it comes to rest when it is stopped.
#[derive(Clone, Debug)]
pub struct Commander {
    scale: Scale,
    state: DriveState,
    /// Counts: where it is, and what it is told.
    position: f64,
    target: f64,
    /// It has been engaged, and is kept in operation until it is stopped.
    is_wanted: bool,
    /// It is stopped until nobody engages it any more.
    is_stopped: bool,
    /// It has been in operation since it was engaged.
    was_enabled: bool,
    resets: bool,
}

impl Commander {
    pub fn new(scale: Scale) -> Commander {
        Commander { scale, state: DriveState::NotReady, position: 0.0, target: 0.0, is_wanted: false, is_stopped: false, was_enabled: false, resets: false }
    }

    /// Takes its status word, and where it is (counts).
    pub fn see(&mut self, status: u16, position: i32) {
        (self.state, self.position) = (DriveState::of(status), f64::from(position));
        self.was_enabled = self.is_wanted && (self.was_enabled || self.state == DriveState::OperationEnabled);
    }

    pub fn state(&self) -> DriveState {
        self.state
    }

    /// Units.
    pub fn position(&self) -> f64 {
        (self.position - self.scale.offset) / self.scale.counts
    }

    /// Units per second.
    pub fn velocity(&self, counts: i32) -> f64 {
        f64::from(counts) / self.scale.counts
    }

    /// N.m or N, from thousandths of the rated torque.
    pub fn torque(&self, thousandths: i32) -> f64 {
        f64::from(thousandths) * 1e-3 * self.scale.rated_torque * self.scale.counts.signum()
    }

    /// Whether it has a fault, and nobody is about to reset it.
    pub fn is_faulty(&self) -> bool {
        matches!(self.state, DriveState::Fault | DriveState::FaultReaction) && !self.resets
    }

    /// Whether it is to move, or to hold.
    pub fn is_wanted(&self) -> bool {
        self.is_wanted
    }

    /// Whether it has left operation without being told so: by itself, by its own watchdog, by an input of its own.
    pub fn has_dropped(&self) -> bool {
        self.was_enabled && self.is_wanted && self.state != DriveState::OperationEnabled
    }

    /// Resets a fault with the next command.
    pub fn reset(&mut self) {
        self.resets = true;
    }

    /// Comes to rest, until nobody engages it any more.
    pub fn stop(&mut self) {
        (self.is_wanted, self.is_stopped, self.was_enabled) = (false, true, false);
    }

    /// The control word and the target (in the drive's own units) until the next cycle, which comes after `span_s`.
    pub fn tell(&mut self, command: f64, is_engaged: bool, span_s: f64) -> (u16, f64) {
        self.is_stopped &= is_engaged;
        let is_torque = self.scale.mode == Mode::Torque;
        self.is_wanted = !self.is_stopped && (is_engaged || self.is_wanted && !is_torque);
        self.was_enabled &= self.is_wanted;
        let is_moving = is_engaged && command.is_finite() && self.state == DriveState::OperationEnabled && self.is_wanted;
        let target = self.target(is_moving.then_some(command), span_s);
        (self.control(), target)
    }

    /// The same without a command: its target is where it is.
    pub fn tell_idle(&mut self) -> (u16, f64) {
        self.target = self.position;
        let target = if self.scale.mode == Mode::Position { self.position } else { 0.0 };
        (self.control(), target)
    }

    fn control(&mut self) -> u16 {
        if std::mem::take(&mut self.resets) && self.state == DriveState::Fault {
            return RESET;
        }
        match (self.is_stopped, self.is_wanted) {
            (true, _) if matches!(self.state, DriveState::OperationEnabled | DriveState::QuickStopActive) => QUICK_STOP,
            (false, true) => self.state.towards_operation(),
            _ => DISABLE_VOLTAGE,
        }
    }

    /// Never further than its greatest speed leads in the time.
    fn target(&mut self, command: Option<f64>, span_s: f64) -> f64 {
        let Scale { mode, counts, offset, speed_max, rated_torque } = self.scale;
        match mode {
            Mode::Position | Mode::Homing => {
                if self.state != DriveState::OperationEnabled {
                    // Where it is: so it does not jump when it comes into operation.
                    self.target = self.position;
                } else if let Some(position) = command {
                    // Without a limit of speed there is none, whatever the time.
                    let most = if speed_max.is_finite() { (speed_max * counts.abs() * span_s).max(0.0) } else { f64::INFINITY };
                    let wish = (position * counts + offset).clamp(f64::from(i32::MIN), f64::from(i32::MAX));
                    self.target += (wish - self.target).clamp(-most, most);
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
    use crate::{ENABLE, SHUT_DOWN, SWITCH_ON};

    const OFF: u16 = 0x50;
    const ENABLED: u16 = 0x37;

    fn commander(mode: Mode) -> Commander {
        Commander::new(Scale { mode, counts: -1000.0, offset: 500.0, speed_max: 2.0, rated_torque: 4.0 })
    }

    #[test]
    fn an_axis_comes_into_operation_where_it_is_and_moves_no_faster_than_it_may() {
        let mut x = commander(Mode::Position);
        for (status, control) in [(OFF, SHUT_DOWN), (0x31, SWITCH_ON), (0x33, ENABLE)] {
            x.see(status, 400);
            assert_eq!(x.tell(9.0, true, 0.01), (control, 400.0));
        }
        x.see(ENABLED, 400);
        assert_eq!(x.tell(9.0, true, 0.01), (ENABLE, 380.0));
        assert_eq!(x.tell(f64::NAN, true, 0.01), (ENABLE, 380.0));
        assert_eq!(x.tell(0.0, false, 0.01), (ENABLE, 380.0), "nobody engages it: it holds");
    }

    #[test]
    fn a_stop_lasts_until_nobody_engages_it() {
        let mut x = commander(Mode::Velocity);
        x.see(ENABLED, 0);
        assert_eq!(x.tell(1.0, true, 0.01), (ENABLE, -1000.0));
        x.stop();
        assert_eq!(x.tell(1.0, true, 0.01), (QUICK_STOP, 0.0));
        x.see(OFF, 0);
        assert_eq!(x.tell(1.0, true, 0.01), (DISABLE_VOLTAGE, 0.0));
        x.tell(0.0, false, 0.01);
        assert_eq!(x.tell(1.0, true, 0.01).0, SHUT_DOWN);
    }

    #[test]
    fn one_that_leaves_operation_by_itself_is_not_switched_on_again_unseen() {
        let mut x = commander(Mode::Torque);
        x.see(OFF, 0);
        x.tell(0.0, true, 0.01);
        assert!(!x.has_dropped(), "it is on its way");
        x.see(ENABLED, 0);
        assert_eq!(x.tell(2.0, true, 0.01), (ENABLE, -500.0));
        x.see(OFF, 0);
        assert!(x.has_dropped());
    }
}
