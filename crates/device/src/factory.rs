// SPDX-License-Identifier: Apache-2.0
//! Creates drivers from their options: finds the declaration, checks the options, and adds the watchdog and the thread that they require.
use crate::accepted::{IN_PLACE, TIMEOUT, accepted, has_own_timeout};
use crate::channel::Direction;
use crate::class::Class;
use crate::declaration::Declaration;
use crate::error::DriverError;
use crate::manual::Manual;
use crate::opening::OpenedDriver;
use crate::options::GivenOptions;
use crate::registry::find;
use crate::services::FoundDevice;
use crate::shapes::Geometry;
use crate::{watchdog, worker};
use serde_json::{Value, json};

/// Key that is `true` in a description if only a guard can make the device safe after its process has exited. It is intended for the
/// supervisor, which knows whether a guard is running.
pub const UNGUARDED_WITHOUT_GUARD: &str = "unguarded_without_guard";

/// Creates the driver `kind` from its options, a table of names and values; the driver is not opened yet.
///
/// The second value describes the machine: it is the description in [`OpenedDriver`], with `watchdog_ns` if the machine has a watchdog
/// (option `timeout_ns` of any driver). Never call this on the real-time path. Fails if the kind is unknown or an option is wrong, or
/// with the driver's own error.
pub fn open(kind: &str, options: &Value) -> Result<OpenedDriver, DriverError> {
    let of = find(kind)?;
    let given = GivenOptions::check(of.kind, options, accepted(of))?;
    let (pace, given) = match of.class {
        Class::Worker => worker::pace(&given, &of.life).map(|(pace, rest)| (Some(pace), rest))?,
        Class::Inline | Class::Process => (None, given),
    };
    let (driver, mut about) = if has_own_timeout(of) { of.make(&given)? } else { watchdog::watched(&given, of)? };
    // The watchdog that any driver can have by an option runs in the driver's process, and ends with it.
    let is_kept_here = !has_own_timeout(of) && !given.value()[TIMEOUT.name].is_null();
    let has_watchdog = !is_kept_here && driver.watchdog_ns().is_some();
    let commands = driver.channels().iter().any(|channel| channel.direction == Direction::Write);
    // If a driver runs another one, the other one's marks do not apply.
    for (word, guard) in [("unguarded", true), (UNGUARDED_WITHOUT_GUARD, false)] {
        if commands && of.safe_state.is_unguarded(has_watchdog, guard) {
            about[word] = true.into();
        } else if let Some(about) = about.as_object_mut() {
            about.remove(word);
        }
    }
    let driver = match pace {
        Some(pace) => worker::lent().ok_or_else(|| DriverError::Class { kind: kind.into(), class: of.class })?(driver, pace),
        None => driver,
    };
    if let Some(timeout_ns) = driver.watchdog_ns() {
        about["watchdog_ns"] = timeout_ns.into();
    }
    tell(of, &mut about);
    Ok((driver, about))
}

/// Adds the declared properties of the device, except for those that the driver has set itself.
fn tell(of: &'static Declaration, about: &mut Value) {
    let Manual { class, safe_state, services, counters, .. } = Manual::from(of);
    let told = [("class", json!(class)), ("safe_state", json!(safe_state)), ("services", json!(services)), ("counters", json!(counters))];
    for (name, value) in told {
        if about[name].is_null() && value != json!([]) {
            about[name] = value;
        }
    }
}

/// Checks options against the declaration of the driver `kind`, without creating a driver.
///
/// # Errors
/// Fails if the kind is unknown, or an option is wrong, unknown or missing.
pub fn check(kind: &str, options: &Value) -> Result<(), DriverError> {
    let of = find(kind)?;
    GivenOptions::check(of.kind, options, accepted(of)).map(|_| ())
}

/// Returns the bodies, joints, shapes and meshes of the machine of a driver with this kind and these options; `None` if it has none. It
/// may load the model again but does not access the machine. Because this may take some tenths of a second, never call it on the
/// real-time path. Fails like [`open`], for example if the model no longer exists.
pub fn geometry(kind: &str, options: &Value) -> Result<Option<Geometry>, DriverError> {
    let of = find(kind)?;
    of.geometry.map_or(Ok(None), |geometry| geometry(&GivenOptions::check(of.kind, options, accepted(of))?))
}

/// Tries the files named by the options, if the driver declares a trial.
///
/// # Errors
/// Fails with a description of the problem found by the trial.
pub fn try_options(kind: &str, options: &Value) -> Result<(), DriverError> {
    let of = find(kind)?;
    of.trial.map_or(Ok(()), |trial| trial(&GivenOptions::check(of.kind, options, accepted(of))?))
}

/// Returns the driver and options that replace these in virtual time, in which no thread can run at its own pace.
pub fn in_virtual_time(kind: &str, options: &Value) -> (String, Value) {
    let Ok(of) = find(kind) else { return (kind.to_owned(), options.clone()) };
    let other = of.in_virtual_time.and_then(|of| of(options));
    let (kind, mut options) = other.unwrap_or_else(|| (kind.to_owned(), options.clone()));
    // No thread has a pace of its own in virtual time.
    if let (Class::Worker, Some(options)) = (of.class, options.as_object_mut()) {
        options.insert(IN_PLACE.name.to_owned(), true.into());
    }
    (kind, options)
}

/// Searches for devices that the driver `kind` could open; `options` define where to search, and may omit all others.
///
/// # Errors
/// Fails if the kind is unknown or cannot search, or an option is wrong, or with the driver's own error.
pub fn scan(kind: &str, options: &Value) -> Result<Vec<FoundDevice>, DriverError> {
    let of = find(kind)?;
    let scan = of.scan.ok_or_else(|| DriverError::NoScan { kind: of.kind.into() })?;
    let given = GivenOptions::check_known(of.kind, options, accepted(of))?;
    of.loaded.map_or_else(|| scan(&given), |loaded| loaded.scan(&given))
}
