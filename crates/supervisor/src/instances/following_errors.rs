// SPDX-License-Identifier: Apache-2.0
//! Messages for conditions reported by a servo. The message for a following error contains its size and limit, the effort of the motor or
//! else of the servo, the lost time, and a remedy; the message for an unstable servo contains its frequency.
//!
//! The numbers are those that the condition returns under the names `error_limit`, `effort`, `effort_limit`, `motor_effort`,
//! `motor_limit` and `time_lost`, as the servos of `robots` do; if a verb returns fewer of them, the message is shorter.
use crate::ending::report::Report;
use crate::registry::Registry;
use indexmap::IndexMap;
use model::value::Value;

/// Condition that these messages describe.
const FOLLOWING_ERROR: &str = "following_error";
const SERVO_UNSTABLE: &str = "servo_unstable";
/// Output of a servo that contains the lost time.
const TIME_LOST: &str = "time_lost";
/// Condition that a servo's block reports when it has brought its joint to rest because of a gap in time.
pub(crate) const GAP: &str = "gap";
/// Parameter of a joint that contains the maximum lost time, s.
pub(crate) const GAP_MAX: &str = "max_gap";

/// Fraction of its limit above which an effort counts as saturated.
const SATURATED: f64 = 0.999;

/// A following error, with the details that are known.
#[derive(Default)]
struct FollowingError<'a> {
    /// Logical device; determines the units of positions and efforts.
    joint: Option<&'a str>,
    unit: &'a str,
    effort_unit: &'a str,
    error: f64,
    error_limit: Option<f64>,
    effort: Option<f64>,
    effort_limit: Option<f64>,
    /// Effort of the motor, if the drive adds the effort for gravity and the other joints to that of the servo.
    motor: Option<f64>,
    motor_limit: Option<f64>,
    lost_s: f64,
}

/// Returns the message for a condition that a servo reported with this value; empty for any other condition. `owner` is the logical
/// device whose own verb reported it.
pub(crate) fn servo_text(
    registry: &Registry,
    condition: &str,
    owner: Option<&str>,
    value: Option<&Value>,
    outputs: &IndexMap<String, Option<Value>>,
) -> String {
    match (condition, value.and_then(number)) {
        (FOLLOWING_ERROR, Some(error)) => following_text(registry, owner, error, outputs),
        (SERVO_UNSTABLE, Some(frequency)) => unstable_text(owner, frequency),
        _ => String::new(),
    }
}

/// Returns the time lost in a single gap, if it exceeds the device's `gap_max_s` and therefore explains a servo's following error. The
/// joint was not commanded during the gap, so the motion ends by its rule for lost time, not because of the resulting error.
pub(crate) fn lost_beyond(report: &Report, gap_max_s: Option<f64>) -> Option<f64> {
    let lost_s = report.outputs.get(TIME_LOST)?.as_ref().and_then(number)?;
    (report.condition == FOLLOWING_ERROR && lost_s > gap_max_s?).then_some(lost_s)
}

/// Returns the message for verbs that used a joint whose servo has brought it to rest after a gap.
pub(crate) fn gap_text(device: &str, lost_s: f64, gap_max_s: Option<f64>) -> String {
    let moved = match gap_max_s {
        Some(most) if lost_s > most => format!(", more than max_gap ({}) of '{device}' allows, and it moved on in that time", quantity(most, "s")),
        _ => format!(", and '{device}' moved on by more than max_following_error in that time"),
    };
    format!(
        "{} were lost at once{moved}: its servo brought it to rest from its position at that time, and it is still enabled; find what delayed the servo \
         (statistics), check the position of the joint, and start again",
        quantity(lost_s, "s")
    )
}

/// Returns the message for a motion whose generator has brought its joints to rest after a gap. `gap_max_s` is the smallest limit of its
/// joints.
pub(crate) fn motion_gap_text(lost_s: f64, gap_max_s: Option<f64>) -> String {
    let most = gap_max_s.map_or_else(|| "max_gap".to_owned(), |most| format!("max_gap ({})", quantity(most, "s")));
    format!(
        "{} were lost at once, more than {most} allows: a block ran for too long, or the computer was suspended; the joints have come to rest: start the \
         motion again, or raise max_gap= of the joint",
        quantity(lost_s, "s")
    )
}

fn unstable_text(owner: Option<&str>, frequency: f64) -> String {
    let joint = owner.map_or_else(String::new, |name| format!(" of joint '{name}'"));
    format!(
        "the servo{joint} is unstable: it oscillates at {}: lower kd= and kp=, remove delay from its loop (a faster source, a drive that answers \
         sooner), or check for play between drive and joint",
        quantity(frequency, "Hz")
    )
}

fn following_text(registry: &Registry, owner: Option<&str>, error: f64, outputs: &IndexMap<String, Option<Value>>) -> String {
    let output = |name: &str| outputs.get(name)?.as_ref().and_then(number);
    let unit_of = |member: &str| owner.and_then(|joint| Some(registry.svvs.get(&format!("{joint}.{member}"))?.unit.as_str())).unwrap_or_default();
    FollowingError {
        joint: owner,
        unit: unit_of("sensed"),
        effort_unit: unit_of("load_effort"),
        error,
        error_limit: output("error_limit"),
        effort: output("effort"),
        effort_limit: output("effort_limit"),
        motor: output("motor_effort"),
        motor_limit: output("motor_limit"),
        lost_s: output(TIME_LOST).unwrap_or(0.0),
    }
    .text()
}

impl FollowingError<'_> {
    fn text(&self) -> String {
        let joint = self.joint.map_or("the position".to_owned(), |name| format!("joint '{name}'"));
        let mut text = format!("{joint} is {} from its commanded position", quantity(self.error.abs(), self.unit));
        if let Some(limit) = self.error_limit {
            text += &format!(", but max_following_error is {}", quantity(limit, self.unit));
        }
        let state = |is_saturated: bool| if is_saturated { "saturated" } else { "not saturated" };
        if let (Some(motor), Some(limit)) = (self.motor, self.motor_limit) {
            let said = state(self.is_motor_saturated());
            text += &format!("; its motor is at {} of {} ({said})", quantity(motor, ""), quantity(limit, self.effort_unit));
        }
        let is_told = self.motor.is_none() || (self.is_saturated() && !self.is_motor_saturated());
        if let (Some(effort), Some(limit), true) = (self.effort, self.effort_limit, is_told) {
            let said = state(self.is_saturated());
            text += &format!("; its servo's effort is {} of max_effort {} ({said})", quantity(effort, ""), quantity(limit, self.effort_unit));
        }
        if self.lost_s > 0.0 {
            text += &format!("; {} had been lost at once just before, because releases were skipped", quantity(self.lost_s, "s"));
        }
        format!("{text}: {}", self.remedy())
    }

    fn is_motor_saturated(&self) -> bool {
        self.motor.zip(self.motor_limit).is_some_and(|(effort, limit)| effort.abs() >= SATURATED * limit)
    }

    fn is_saturated(&self) -> bool {
        self.effort.zip(self.effort_limit).is_some_and(|(effort, limit)| effort.abs() >= SATURATED * limit)
    }

    /// Returns the remedy for the most likely cause.
    fn remedy(&self) -> &'static str {
        if self.error_limit.is_none() {
            return "move more slowly, find what blocks the joint, or raise the preset of the condition";
        }
        if self.lost_s == 0.0 && self.is_motor_saturated() {
            return "move with less speed= or acceleration=, reduce the load, find what blocks the joint, or give its motor more effort in the model";
        }
        match (self.lost_s > 0.0, self.effort.is_some(), self.is_saturated()) {
            (true, ..) => "find what delayed the servo (statistics), or raise max_following_error=",
            (_, _, true) => {
                "move with less speed= or acceleration=, reduce the load, find what blocks the joint, or raise max_effort= if the drive can give more"
            }
            (_, true, false) => "move with less speed= or acceleration=, raise kp= and kd=, or raise max_following_error=",
            (_, false, false) => {
                "move with less speed= or acceleration=, find what blocks the joint, check the load and the torque limit of its drive, or raise \
                 max_following_error="
            }
        }
    }
}

/// Formats a number with four significant digits and its unit.
fn quantity(number: f64, unit: &str) -> String {
    let digits = if number == 0.0 || !number.is_finite() { 0 } else { (3 - number.abs().log10().floor() as i32).clamp(0, 12) };
    let text = format!("{number:.*}", digits as usize);
    let text = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
    if unit.is_empty() { text.to_owned() } else { format!("{text} {unit}") }
}

pub(crate) fn number(value: &Value) -> Option<f64> {
    match value {
        Value::Number(number) => Some(*number),
        Value::Integer(number) => Some(*number as f64),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found() -> FollowingError<'static> {
        FollowingError {
            joint: Some("arm.x"),
            unit: "rad",
            effort_unit: "N.m",
            error: -0.0213,
            error_limit: Some(0.02),
            effort: Some(-28.0),
            effort_limit: Some(28.0),
            ..FollowingError::default()
        }
    }

    #[test]
    fn a_message_has_size_limit_effort_and_remedy() {
        let expected = "joint 'arm.x' is 0.0213 rad from its commanded position, but max_following_error is 0.02 rad; its servo's effort is -28 of \
                        max_effort 28 N.m (saturated): move with less speed= or acceleration=, reduce the load, find what blocks the joint, or \
                        raise max_effort= if the drive can give more";
        assert_eq!(found().text(), expected);
        let weak = FollowingError { effort: Some(3.123_456), ..found() }.text();
        assert!(weak.contains("effort is 3.123 of max_effort 28 N.m (not saturated): move with less speed= or acceleration=, raise kp= and kd="), "{weak}");
    }

    #[test]
    fn the_effort_of_the_motor_is_told_where_it_is_known() {
        let motor = FollowingError { motor: Some(28.0), motor_limit: Some(28.0), ..found() };
        let said = motor.text();
        assert!(said.contains("0.02 rad; its motor is at 28 of 28 N.m (saturated): move with less speed= or acceleration=, reduce the load"), "{said}");
        assert!(said.ends_with("or give its motor more effort in the model") && !said.contains("max_effort"), "{said}");
        let idle = FollowingError { effort: Some(3.0), motor: Some(2.5), ..motor }.text();
        assert!(idle.contains("; its motor is at 2.5 of 28 N.m (not saturated): move with less speed= or acceleration=, raise kp="), "{idle}");
        let held_back = FollowingError { motor: Some(2.5), motor_limit: Some(30.0), ..found() }.text();
        assert!(held_back.contains("of 30 N.m (not saturated); its servo's effort is -28 of max_effort 28 N.m (saturated): "), "{held_back}");
        assert!(held_back.contains("raise max_effort="), "{held_back}");
    }

    #[test]
    fn an_unstable_servo_is_named_with_its_frequency() {
        let said = unstable_text(Some("arm.x"), 124.96);
        assert!(said.starts_with("the servo of joint 'arm.x' is unstable: it oscillates at 125 Hz: lower kd= and kp="), "{said}");
    }

    #[test]
    fn a_gap_is_told_with_its_bound_and_what_became_of_the_joint() {
        let said = gap_text("arm.x", 0.7004, Some(0.5));
        assert!(said.starts_with("0.7004 s were lost at once, more than max_gap (0.5 s) of 'arm.x' allows, and it moved on in that time: "), "{said}");
        let said = motion_gap_text(20.04, Some(0.5));
        assert!(said.starts_with("20.04 s were lost at once, more than max_gap (0.5 s) allows: a block ran"), "{said}");
        let said = gap_text("arm.x", 0.3, Some(0.5));
        assert!(said.starts_with("0.3 s were lost at once, and 'arm.x' moved on by more than max_following_error in that time: "), "{said}");
    }

    #[test]
    fn time_that_was_lost_is_named_first_among_the_causes() {
        let late = FollowingError { lost_s: 0.48, ..found() }.text();
        assert!(late.contains("; 0.48 s had been lost at once just before, because releases were skipped: find what delayed the servo"), "{late}");
    }

    #[test]
    fn a_message_says_nothing_of_what_is_not_known() {
        let drive = FollowingError { effort: None, effort_limit: None, ..found() }.text();
        assert!(!drive.contains("effort is") && drive.contains("torque limit of its drive"), "{drive}");
        let bare = FollowingError { error: 12_345.6, ..FollowingError::default() }.text();
        assert!(bare.starts_with("the position is 12346 from its commanded position: move more slowly"), "{bare}");
    }
}
