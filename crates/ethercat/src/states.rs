// SPDX-License-Identifier: Apache-2.0
//! States of a subdevice and their names, and names of its errors.
use std::fmt;

/// State of a subdevice in the EtherCAT state machine.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum State {
    Init = 1,
    PreOp = 2,
    Boot = 3,
    SafeOp = 4,
    Op = 8,
}

/// Error flag, which is set in addition to a state if the subdevice did not execute the request; the status code contains the reason. In
/// a request, the flag acknowledges the error.
pub const ERROR: u16 = 0x10;

impl State {
    /// Returns the state encoded in the low four bits of a register.
    pub fn of(register: u16) -> Option<State> {
        [State::Init, State::PreOp, State::Boot, State::SafeOp, State::Op].into_iter().find(|state| *state as u16 == register & 0x0F)
    }
}

impl fmt::Display for State {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            State::Init => "INIT",
            State::PreOp => "PREOP",
            State::Boot => "BOOT",
            State::SafeOp => "SAFEOP",
            State::Op => "OP",
        })
    }
}

/// Describes the value of a state register, and its status code if it has the error flag.
pub fn describe(status: u16, code: u16) -> String {
    let state = State::of(status).map_or_else(|| format!("state {:#06x}", status & 0x0F), |state| state.to_string());
    if status & ERROR == 0 { state } else { format!("{state} with error {code:#06x}, {}", code_name(code)) }
}

/// Returns the meaning of an AL status code.
pub fn code_name(code: u16) -> &'static str {
    match code {
        0x0000 => "no error",
        0x0001 => "unspecified error",
        0x0002 => "no memory",
        0x0003 => "invalid device setup",
        0x0011 => "invalid requested state change",
        0x0012 => "unknown requested state",
        0x0013 => "bootstrap not supported",
        0x0014 => "no valid firmware",
        0x0015 | 0x0016 => "invalid mailbox configuration",
        0x0017 => "invalid SyncManager configuration",
        0x0018 => "no valid inputs available",
        0x0019 => "no valid outputs",
        0x001A => "synchronisation error",
        0x001B => "SyncManager watchdog: no outputs arrived in time",
        0x001C => "invalid SyncManager types",
        0x001D => "invalid output configuration",
        0x001E => "invalid input configuration",
        0x001F => "invalid watchdog configuration",
        0x0020 => "cold start needed",
        0x0021 => "INIT needed",
        0x0022 => "PREOP needed",
        0x0023 => "SAFEOP needed",
        0x0024 => "invalid input mapping",
        0x0025 => "invalid output mapping",
        0x0026 => "inconsistent settings",
        0x0029 => "FreeRun needs three-buffer mode",
        0x002A => "background watchdog",
        0x002B => "no valid inputs and outputs",
        0x002C => "fatal synchronisation error",
        0x002D => "no synchronisation",
        0x0030 => "invalid DC synchronisation configuration",
        0x0031 => "invalid DC latch configuration",
        0x0032 => "PLL error",
        0x0033 => "DC input-output error",
        0x0034 => "DC timeout",
        0x0035 => "invalid DC synchronisation cycle time",
        0x0050 => "EEPROM no access",
        0x0051 => "EEPROM error",
        0x0060 => "restarted locally",
        0x0061 => "device identification value updated",
        0x00F0 => "application controller available",
        _ => "a vendor-specific code",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_state_says_what_is_wrong() {
        assert_eq!(describe(0x08, 0), "OP");
        assert_eq!(describe(0x14, 0x1B), "SAFEOP with error 0x001b, SyncManager watchdog: no outputs arrived in time");
        assert_eq!(describe(0x00, 0), "state 0x0000");
    }
}
