// SPDX-License-Identifier: Apache-2.0
//! Reasons why an arm does not follow, in the wording of the teach pendant.
use super::sample::Sample;

const RUNNING: i32 = 7;
const PLAYING: u32 = 2;
const PAUSED: u32 = 4;
/// State that the script reports when no set-point arrived in time.
pub(super) const SILENT: i32 = -1;

/// Returns the reason why an arm cannot move at all: its mode or its safety system. Each message includes the remedy.
pub(super) fn hindrance(sample: &Sample) -> Option<&'static str> {
    let safety = match sample.safety {
        1 | 2 => None,
        3 => Some("protective stop: find its cause, call the service unlock_protective_stop (5 s after it at the earliest), then reset() and enable()"),
        4 => Some("recovery mode: a joint is outside the safety limits; move it back on the pendant"),
        5 => Some("safeguard stop: close the safeguard and reset it, then reset() and enable()"),
        6 => Some("emergency stop of the system: release it, then power the arm on, reset() and enable()"),
        7 => Some("emergency stop at the robot: release its button, then power the arm on, reset() and enable()"),
        8 => Some("violation of a safety limit: find its cause, then call the service restart_safety"),
        9 => Some("fault of the safety system: find its cause, then call the service restart_safety"),
        10 => Some("a joint has a different identity than before: confirm it on the pendant"),
        12 => Some("safeguard stop of the automatic mode: close the safeguard and reset it, then reset() and enable()"),
        13 => Some("the three-position enabling device is not held: the pendant is in manual mode"),
        _ => Some("its safety system is in an unknown state: check the pendant"),
    };
    safety.or(match sample.robot_mode {
        RUNNING => None,
        -1 | 0 => Some("the arm is not connected to its controller"),
        1 => Some("the safety configuration waits to be confirmed on the pendant"),
        2 => Some("the controller is booting"),
        3 => Some("the arm is powered off: call the service power_on, or open it with power_on=True"),
        4 => Some("the arm is being powered on"),
        5 => Some("the brakes are engaged: call the service power_on, or open it with power_on=True"),
        6 => Some("the arm is moved by hand (backdrive): end that on the pendant"),
        8 => Some("the firmware is being updated"),
        _ => Some("the arm is in an unknown mode: check the pendant"),
    })
}

/// Returns true if only the power is off, and no intervention at the machine is needed.
pub(super) fn is_off(sample: &Sample) -> bool {
    matches!(sample.safety, 1 | 2) && matches!(sample.robot_mode, 3..=5)
}

/// Returns the reason why the script does not follow although the arm could.
pub(super) fn interruption(sample: &Sample, session: i32) -> Option<&'static str> {
    match (sample.script, sample.runtime) {
        (script, PLAYING) if script == session => None,
        (SILENT, _) => Some("its program stopped the arm by itself: no setpoint arrived within its timeout; call reset(), then enable()"),
        (script, PAUSED) if script == session => Some("its program was paused on the pendant; call reset(), which restarts it, then enable()"),
        (script, _) if script == session => Some("its program was stopped on the pendant; call reset(), which restarts it, then enable()"),
        _ => Some("a program other than this driver's runs on it; call reset(), which starts ours, then enable()"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GOOD: Sample = Sample {
        timestamp: 0.0,
        position: [0.0; 6],
        velocity: [0.0; 6],
        force: [0.0; 6],
        robot_mode: RUNNING,
        safety: 1,
        runtime: PLAYING,
        speed_scaling: 1.0,
        inputs: 0,
        outputs: 0,
        analog: [0.0; 2],
        script: 9,
    };

    #[test]
    fn each_state_has_its_sentence() {
        assert_eq!((hindrance(&GOOD), interruption(&GOOD, 9)), (None, None));
        let mut seen = std::collections::HashSet::new();
        for safety in 3..=13 {
            seen.insert(hindrance(&Sample { safety, ..GOOD }).expect("it does not move"));
        }
        for robot_mode in (0..=8).filter(|mode| *mode != RUNNING) {
            seen.insert(hindrance(&Sample { robot_mode, ..GOOD }).expect("it does not move"));
        }
        assert_eq!(seen.len(), 11 + 8);
        assert!(interruption(&Sample { runtime: 1, ..GOOD }, 9).is_some_and(|why| why.contains("stopped on the pendant")));
        assert!(interruption(&Sample { runtime: 4, ..GOOD }, 9).is_some_and(|why| why.contains("paused")));
        assert!(interruption(&Sample { script: SILENT, runtime: 1, ..GOOD }, 9).is_some_and(|why| why.contains("no setpoint")));
        assert!(interruption(&Sample { script: 8, ..GOOD }, 9).is_some_and(|why| why.contains("a program other than")));
    }
}
