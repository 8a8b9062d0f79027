// SPDX-License-Identifier: Apache-2.0
//! Age of a command: a delayed command is refused, so that nothing moves long after a button was pressed.
use crate::clock::told_ms;
use crate::failure::Failure;
use model::refusal::Class;

/// Maximum age of a command, ms.
const AGE_MAX_MS: u64 = 500;

/// Refuses a command that is too old, or whose time is from another run of the daemon.
pub fn check(call: &str, as_of_ms: Option<u64>) -> Result<(), Failure> {
    as_of_ms.map_or(Ok(()), |then| judge(call, told_ms(), then))
}

fn judge(call: &str, now_ms: u64, then_ms: u64) -> Result<(), Failure> {
    // Truncation may cost up to a millisecond on either side.
    let message = match (now_ms + 1).checked_sub(then_ms) {
        Some(age_ms) if age_ms <= AGE_MAX_MS + 1 => return Ok(()),
        Some(age_ms) if age_ms < 1 << 31 => {
            format!("'{call}' arrived {} ms after it was issued, but a command is carried out only within {AGE_MAX_MS} ms: it was not carried out", age_ms - 1)
        }
        _ => format!("'{call}' was issued to an earlier run of the system: it was not carried out"),
    };
    Err(Failure::new(Class::InvalidState, message, "check what the system does now, and issue the command again"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_command_is_obeyed_within_half_a_second() {
        for (age_ms, is_obeyed) in [(-1, true), (0, true), (500, true), (502, false), (4_300, false), (-2, false), (-60_000, false)] {
            let then_ms = u64::try_from(100_000 - age_ms).expect("it is positive");
            assert_eq!(judge("start", 100_000, then_ms).is_ok(), is_obeyed, "{age_ms} ms");
        }
    }

    #[test]
    fn a_refusal_names_the_age_or_the_earlier_run() {
        let said = |then_ms| judge("start", 5_000_000_000, then_ms).expect_err("it is refused").refusals[0].message.clone();
        assert!(said(4_999_995_700).contains("arrived 4300 ms after"), "{}", said(4_999_995_700));
        assert!(said(5_000_100_000).contains("an earlier run") && said(0).contains("an earlier run"));
    }
}
