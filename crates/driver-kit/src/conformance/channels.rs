// SPDX-License-Identifier: Apache-2.0
//! Checks of channels: their layout, and their values when no verb commands them.
use super::check::{Check, CheckResult, NO_PARTS, PassedCheck, holds, none_of};
use super::declaration::wrong_line;
use super::subject::Subject;
use device::{Channel, Direction, Slot, Type};

pub(super) const CHECKS: &[Check] = &[
    Check { name: "channels", sentence: "it has channels, and their values need at most 1 MiB each way", run: there },
    Check { name: "channel-names", sentence: "each channel has a unique name, 'part.channel'", run: names },
    Check { name: "channel-docs", sentence: "the description of each channel is at most one line, and a unit contains no blanks", run: docs },
    Check { name: "channel-types", sentence: "each channel has a type, and as many bytes as that", run: types },
    Check { name: "channel-alignment", sentence: "each channel is aligned to its numbers", run: alignment },
    Check { name: "channel-overlap", sentence: "no channel overlaps another one of its direction", run: overlap },
    Check {
        name: "safe-values",
        sentence: "each written channel has a safe value of its type, and it is finite (of a goal or a decoupled effort: none, NaN)",
        run: safe_values,
    },
    Check { name: "slews", sentence: "only a written double has a limit of change, and it is above 0", run: slews },
    Check { name: "channels-stable", sentence: "the same options give the same channels", run: stable },
    Check { name: "parts", sentence: "each part has the channels that belong to it, and limits that can be kept", run: parts },
    Check { name: "watchdog", sentence: "a watchdog is at least 1 ms", run: watchdog },
];

fn channels(subject: &Subject) -> Result<Vec<Channel>, String> {
    Ok(subject.rig()?.driver.channels().to_vec())
}

fn there(subject: &Subject) -> CheckResult {
    let channels = channels(subject)?;
    holds(!channels.is_empty(), || "it has none".to_owned())?;
    none_of([Direction::Read, Direction::Write].into_iter().filter_map(|direction| {
        let len = super::rig::len(&channels, direction);
        (len > 1 << 20).then(|| format!("{direction:?}: {len} bytes"))
    }))
}

fn names(subject: &Subject) -> CheckResult {
    let channels = channels(subject)?;
    none_of(channels.iter().enumerate().filter_map(|(i, channel)| {
        let name = &channel.name;
        if name.is_empty() || name.contains(char::is_whitespace) || name.starts_with('.') || name.ends_with('.') {
            return Some(format!("'{name}' is not a valid name"));
        }
        channels[..i].iter().any(|other| other.name == *name).then(|| format!("'{name}' appears twice"))
    }))
}

fn docs(subject: &Subject) -> CheckResult {
    none_of(channels(subject)?.iter().filter_map(|channel| {
        let wrong = if channel.doc.is_empty() { None } else { wrong_line(&channel.doc) };
        let wrong = wrong.or_else(|| channel.unit.contains(char::is_whitespace).then(|| format!("'{}' is not a unit", channel.unit)));
        wrong.map(|wrong| format!("'{}': {wrong}", channel.name))
    }))
}

fn types(subject: &Subject) -> CheckResult {
    none_of(channels(subject)?.iter().filter_map(|channel| match channel.type_text.parse::<Type>() {
        Err(what) => Some(format!("'{}': {what}", channel.name)),
        Ok(of) => (of.len() != channel.len || of.len() == 0).then(|| format!("'{}' is {} but has {} bytes", channel.name, channel.type_text, channel.len)),
    }))
}

fn alignment(subject: &Subject) -> CheckResult {
    none_of(channels(subject)?.iter().filter_map(|channel| {
        let width = channel.type_text.parse::<Type>().map_or(1, |of| of.number.width());
        (channel.offset % width != 0).then(|| format!("'{}' is at {}", channel.name, channel.offset))
    }))
}

fn overlap(subject: &Subject) -> CheckResult {
    let channels = channels(subject)?;
    let on = |a: &Channel, b: &Channel| a.direction == b.direction && a.offset < b.offset + b.len && b.offset < a.offset + a.len;
    none_of((1..channels.len()).flat_map(|i| {
        let (before, one) = (&channels[..i], &channels[i]);
        before.iter().filter(move |other| on(other, one)).map(move |other| format!("'{}' overlaps '{}'", one.name, other.name))
    }))
}

fn safe_values(subject: &Subject) -> CheckResult {
    none_of(channels(subject)?.iter().filter(|channel| channel.direction == Direction::Write).filter_map(|channel| {
        if channel.safe.len() != channel.len {
            return Some(format!("that of '{}' has {} bytes, not {}", channel.name, channel.safe.len(), channel.len));
        }
        let slot = Slot { offset: 0, len: channel.len };
        let is_double = channel.type_text.starts_with("double");
        let may_be_none = [".goal", ".decoupled"].iter().any(|end| channel.name.ends_with(end));
        (is_double && !may_be_none && (0..channel.len / 8).any(|i| !slot.double(&channel.safe, i).is_finite()))
            .then(|| format!("that of '{}' is not finite", channel.name))
    }))
}

fn slews(subject: &Subject) -> CheckResult {
    none_of(channels(subject)?.iter().filter_map(|channel| {
        let slew = channel.slew_max?;
        let fits = slew > 0.0 && slew.is_finite() && channel.direction == Direction::Write && channel.type_text.starts_with("double");
        (!fits).then(|| format!("that of '{}' is {slew}", channel.name))
    }))
}

fn stable(subject: &Subject) -> CheckResult {
    let (first, second) = (format!("{:?}", channels(subject)?), format!("{:?}", channels(subject)?));
    holds(first == second, || "a second driver has different ones".to_owned())
}

fn parts(subject: &Subject) -> CheckResult {
    let rig = subject.rig()?;
    let parts = rig.about["parts"].as_array().cloned().unwrap_or_default();
    let joints = rig.joints();
    for part in &parts {
        let name = part["name"].as_str().unwrap_or_default();
        if !joints.iter().any(|joint| joint.name == name) {
            return Err(format!(
                "part '{name}' needs the channels position, velocity, bias and effort (or goal, if it is commanded by its position), as double"
            ));
        }
        let number = |of: &str| part[of].as_f64().unwrap_or(f64::NAN);
        holds(number("range_min") <= number("range_max"), || format!("part '{name}' has a range from {} to {}", number("range_min"), number("range_max")))?;
        holds(number("effort_max") > 0.0 && number("speed_max") > 0.0, || format!("part '{name}' needs an effort limit and a speed limit above 0"))?;
    }
    Ok(if parts.is_empty() { NO_PARTS } else { PassedCheck::Yes })
}

fn watchdog(subject: &Subject) -> CheckResult {
    match subject.rig()?.driver.watchdog_ns() {
        None => Ok(PassedCheck::NotApplicable("it has none with these options")),
        Some(ns) => holds(ns >= 1_000_000, || format!("it is {ns} ns")),
    }
}
