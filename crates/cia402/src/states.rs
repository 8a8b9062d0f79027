// SPDX-License-Identifier: Apache-2.0
//! CiA 402 drives: states, the control words that change them, modes, and names of errors.
use std::fmt;

/// Bit of the control word that resets a fault on its rising edge.
pub const RESET: u16 = 0x80;
/// Control words.
pub const DISABLE_VOLTAGE: u16 = 0x00;
pub const QUICK_STOP: u16 = 0x02;
pub const SHUT_DOWN: u16 = 0x06;
pub const SWITCH_ON: u16 = 0x07;
pub const ENABLE: u16 = 0x0F;

/// State of a drive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DriveState {
    NotReady,
    SwitchOnDisabled,
    ReadyToSwitchOn,
    SwitchedOn,
    OperationEnabled,
    QuickStopActive,
    FaultReaction,
    Fault,
}

impl DriveState {
    /// Returns the state encoded in a status word.
    pub fn of(status: u16) -> DriveState {
        use DriveState::*;
        match status & 0x6F {
            word if word & 0x4F == 0x40 => SwitchOnDisabled,
            0x21 => ReadyToSwitchOn,
            0x23 => SwitchedOn,
            0x27 => OperationEnabled,
            0x07 => QuickStopActive,
            word if word & 0x4F == 0x0F => FaultReaction,
            word if word & 0x4F == 0x08 => Fault,
            _ => NotReady,
        }
    }

    /// Returns the status word bits that represent the state, with voltage enabled.
    pub fn status(self) -> u16 {
        use DriveState::*;
        match self {
            NotReady => 0x00,
            SwitchOnDisabled => 0x50,
            ReadyToSwitchOn => 0x31,
            SwitchedOn => 0x33,
            OperationEnabled => 0x37,
            QuickStopActive => 0x17,
            FaultReaction => 0x1F,
            Fault => 0x18,
        }
    }

    /// Returns the control word that leads one step closer to the Operation Enabled state; no control word does so in a fault.
    pub fn towards_operation(self) -> u16 {
        use DriveState::*;
        match self {
            SwitchOnDisabled => SHUT_DOWN,
            ReadyToSwitchOn => SWITCH_ON,
            SwitchedOn | OperationEnabled => ENABLE,
            NotReady | QuickStopActive | FaultReaction | Fault => DISABLE_VOLTAGE,
        }
    }
}

impl fmt::Display for DriveState {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        use DriveState::*;
        f.write_str(match self {
            NotReady => "not ready to switch on",
            SwitchOnDisabled => "switch on disabled",
            ReadyToSwitchOn => "ready to switch on",
            SwitchedOn => "switched on",
            OperationEnabled => "operation enabled",
            QuickStopActive => "quick stop active",
            FaultReaction => "fault reaction active",
            Fault => "fault",
        })
    }
}

/// Mode of operation of a drive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    Homing = 6,
    /// Cyclic synchronous mode: position, velocity, torque.
    Position = 8,
    Velocity = 9,
    Torque = 10,
}

impl Mode {
    pub fn of(code: i8) -> Option<Mode> {
        [Mode::Homing, Mode::Position, Mode::Velocity, Mode::Torque].into_iter().find(|mode| *mode as i8 == code)
    }
}

/// Error code of a following error detected by the drive itself.
pub const FOLLOWING_ERROR: u16 = 0x8611;

/// Returns the meaning of an error code (0x603F) if CiA 402 defines it.
pub fn error_name(code: u16) -> &'static str {
    match code {
        0x0000 => "no error",
        0x2310 => "continuous over-current",
        0x2320 => "short circuit",
        0x2330 => "earth leakage",
        0x3110 => "mains over-voltage",
        0x3120 => "mains under-voltage",
        0x3210 => "DC link over-voltage",
        0x3220 => "DC link under-voltage",
        0x4210 => "device temperature too high",
        0x4310 => "drive temperature too high",
        0x5441 => "external enable is missing",
        0x6320 => "parameter error",
        0x7121 => "motor blocked",
        0x7305 | 0x7306 => "encoder error",
        0x8130 => "communication was lost",
        0x8311 => "torque limit exceeded",
        0x8400 => "velocity controller error",
        0x8500 => "position controller error",
        FOLLOWING_ERROR => "following error: the target is too far from the position of the axis",
        0x8612 => "a limit of the range was reached",
        _ => match code >> 12 {
            2 => "a current error",
            3 => "a voltage error",
            4 => "a temperature error",
            5 => "a hardware error",
            6 => "a software error",
            7 => "an error of an additional module",
            8 => "a supervision error",
            _ => "a vendor-specific error",
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_status_word_says_its_state() {
        use DriveState::*;
        for state in [NotReady, SwitchOnDisabled, ReadyToSwitchOn, SwitchedOn, OperationEnabled, QuickStopActive, FaultReaction, Fault] {
            assert_eq!(DriveState::of(state.status() | 0x1280), state);
        }
    }
}
