// SPDX-License-Identifier: Apache-2.0
//! Homing performed by the drive: determines the commands in each cycle until homing is complete, and interprets the answers.
use crate::states::{DriveState, ENABLE, Mode};

/// Bit of the control word in mode 6 that starts homing on its rising edge.
const START: u16 = 0x10;
/// Bits of the status word in mode 6: target reached, homing attained, homing error.
const REACHED: u16 = 1 << 10;
const ATTAINED: u16 = 1 << 12;
const ERROR: u16 = 1 << 13;
/// Number of cycles that must elapse before an answer refers to the start of homing, not to the previous state.
pub(crate) const ANSWERS: u32 = 8;

/// State of a drive during homing.
#[derive(Clone, Debug, Default)]
pub struct Homing {
    /// Number of cycles with operation enabled in mode 6.
    cycles: u32,
}

/// State of homing, as shown by the channel of the axis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum HomingState {
    #[default]
    No = 0,
    GoingOn = 1,
    Yes = 2,
    Failed = 3,
}

/// Next step of homing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HomingStep {
    /// Sends this control word in mode 6.
    Tell(u16),
    /// Homing is complete.
    Attained,
    /// Homing has failed, or the drive has a fault.
    Failed,
}

impl Homing {
    /// Returns the next step for a drive that reports this status word and this mode. Real-time safe.
    pub fn step(&mut self, status: u16, mode: i8) -> HomingStep {
        match DriveState::of(status) {
            DriveState::Fault | DriveState::FaultReaction => HomingStep::Failed,
            DriveState::OperationEnabled if Mode::of(mode) == Some(Mode::Homing) => {
                self.cycles += 1;
                match self.cycles {
                    // The bit is first cleared, so that it rises.
                    1 => HomingStep::Tell(ENABLE),
                    ..=ANSWERS => HomingStep::Tell(ENABLE | START),
                    _ if status & ERROR != 0 => HomingStep::Failed,
                    _ if status & ATTAINED != 0 && status & REACHED != 0 => HomingStep::Attained,
                    _ => HomingStep::Tell(ENABLE | START),
                }
            }
            // The drive was switched off during homing.
            _ if self.cycles > 0 => HomingStep::Failed,
            state => HomingStep::Tell(state.towards_operation()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::states::SHUT_DOWN;

    const HOMING: i8 = Mode::Homing as i8;

    #[test]
    fn it_is_switched_on_started_by_an_edge_and_waited_for() {
        let mut homing = Homing::default();
        assert_eq!(homing.step(DriveState::SwitchOnDisabled.status(), 8), HomingStep::Tell(SHUT_DOWN));
        let enabled = DriveState::OperationEnabled.status();
        assert_eq!(homing.step(enabled | ATTAINED | REACHED, 8), HomingStep::Tell(ENABLE), "not yet in its mode");
        assert_eq!(homing.step(enabled | ATTAINED | REACHED, HOMING), HomingStep::Tell(ENABLE));
        for _ in 1..ANSWERS {
            assert_eq!(homing.step(enabled | ATTAINED | REACHED, HOMING), HomingStep::Tell(ENABLE | START), "what was there before");
        }
        assert_eq!(homing.step(enabled | ATTAINED, HOMING), HomingStep::Tell(ENABLE | START));
        assert_eq!(homing.step(enabled | ATTAINED | REACHED, HOMING), HomingStep::Attained);
        assert_eq!(homing.step(enabled | ERROR, HOMING), HomingStep::Failed);
        assert_eq!(homing.step(DriveState::Fault.status(), HOMING), HomingStep::Failed);
        assert_eq!(homing.step(DriveState::SwitchOnDisabled.status(), HOMING), HomingStep::Failed);
    }
}
