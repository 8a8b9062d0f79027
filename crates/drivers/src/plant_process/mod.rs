// SPDX-License-Identifier: Apache-2.0
//! A plant in a process of its own: any other driver, at its own pace, like a real machine. It outlives the process that commands it.
//!
//! Its channels and parts are those of the driver that it runs. A read takes the newest complete group of readings, and a write leaves a
//! group of commands; neither blocks, allocates or makes system calls.
//!
//! When the process that commands it has exited, the plant continues under the last commands, like a drive without a watchdog. By
//! default, the plant has no watchdog, so that the effect of the guard can be observed. With a watchdog, the plant switches to its safe
//! commands if no new group of commands arrives within the timeout after one that claims a channel. Its safe handle is a flag and safe
//! commands in the shared memory: the plant obeys them from its next step on, until a driver opens it again.
//!
//! Time is that of the wall clock; under the virtual clock, the driver runs in place.
mod driver;
mod plant_link;
mod plant_messages;
mod python;
mod region;
mod serve;
mod services;
mod starting;

pub use plant_messages::PlantState;
pub(crate) use python::DRIVER as PYTHON;
pub(crate) use serve::run;

use device::{Declaration, DriverError, FoundDevice, Geometry, GivenOptions, Kind, OpenedDriver, OptionWord, Reach, SafeBy, SafeState};
use driver::Bounds;
use plant_link::{SOCKET, ask, place};
use plant_messages::{Answer, Ask, PlantDescription, PlantOrigin};
use process_kit::{connect, is_abandoned, run_folder};
use serde::Deserialize;
use serde_json::Value;
use starting::opened;
use std::ffi::OsString;
use std::path::PathBuf;
use std::time::Duration;

const LINGER_NS: i64 = 10_000_000_000;
const SILENT_NS: i64 = 500_000_000;
const NAME_MAX: usize = 40;
/// Minimum age at which a socket may be considered abandoned, because the plant of a newer one may not be listening yet.
const NEW: Duration = Duration::from_secs(1);

pub(crate) static DRIVER: Declaration = Declaration {
    geometry: Some(geometry),
    in_virtual_time: Some(in_place),
    scan: Some(scan),
    safe_state: SafeState { by: &[SafeBy::Driver, SafeBy::Guard], ..SafeState::BY_DRIVER },
    ..Declaration::new(KIND, "another driver in a separate process, with its own step time, which outlives the process that commands it", &OPTIONS, open)
};

const KIND: &str = "plant_process";
const OPTIONS: [OptionWord; 7] = [
    OptionWord::needed("driver", Kind::Table, "driver that the process runs, {\"kind\": …, \"options\": {…}}").reaches(Reach::Driver),
    OptionWord::with_default("command", Kind::List, "that of this installation", "command line of a process that runs it").reaches(Reach::Code),
    OptionWord::with_default("name", Kind::Text, "only this driver has it", "name under which a later program finds and opens it again"),
    OptionWord::with_default("linger_ns", Kind::Whole, "10 s", "how long it continues without a connection").unit("ns").within(1e4, f64::INFINITY),
    OptionWord::with_default("step_ns", Kind::Whole, "the driver's 'timestep', else 1 ms", "its period").unit("ns").within(1e4, 3.6e12),
    OptionWord::with_default("silent_ns", Kind::Whole, "500 ms", "time without a step of the plant before it is lost").unit("ns").within(1e4, f64::INFINITY),
    OptionWord::with_default("timeout_ns", Kind::Whole, "none", "its watchdog: after this time without new commands it goes to its safe commands")
        .unit("ns")
        .within(1e6, 3.6e12),
];

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Options {
    driver: Inner,
    command: Option<Vec<String>>,
    name: Option<String>,
    linger_ns: Option<i64>,
    step_ns: Option<i64>,
    silent_ns: Option<i64>,
    timeout_ns: Option<i64>,
}

#[derive(Clone, Deserialize)]
#[serde(deny_unknown_fields)]
struct Inner {
    kind: String,
    #[serde(default)]
    options: Value,
}

/// Returns the driver for virtual time: the inner driver, in this process.
fn in_place(options: &Value) -> Option<(String, Value)> {
    let mut inner: Inner = serde_json::from_value(options["driver"].clone()).ok()?;
    if let (Some(timeout_ns), Some(of)) = (options["timeout_ns"].as_i64(), inner.options.as_object_mut()) {
        of.insert("timeout_ns".to_owned(), timeout_ns.into());
    }
    Some((inner.kind, inner.options))
}

/// Returns the shapes of the inner driver's machine.
fn geometry(given: &GivenOptions<'_>) -> Result<Option<Geometry>, DriverError> {
    let options: Options = given.read()?;
    device::geometry(&options.driver.kind, &options.driver.options)
}

/// Starts the process, or connects to the running process with that name.
fn open(given: &GivenOptions<'_>) -> Result<OpenedDriver, DriverError> {
    let options: Options = given.read()?;
    check(given, &options)?;
    let made = PlantOrigin {
        kind: options.driver.kind.clone(),
        options: options.driver.options.clone(),
        step_ns: options.step_ns,
        linger_ns: options.linger_ns.unwrap_or(LINGER_NS),
        timeout_ns: options.timeout_ns,
        rest_ns: None,
        name: options.name.clone(),
    };
    clean();
    let path = made.name.as_deref().map(place).transpose().map_err(|error| lost(error.to_string()))?;
    let bounds = Bounds { silent_ns: options.silent_ns.unwrap_or(SILENT_NS), taken_max_ns: None, timeout_ns: options.timeout_ns };
    opened(given, KIND, made, options.command.map_or_else(beside, |words| Ok(words.into_iter().map(OsString::from).collect()))?, bounds, path)
}

/// Searches for running plants that have a name.
fn scan(_: &GivenOptions<'_>) -> Result<Vec<FoundDevice>, DriverError> {
    clean();
    let folder = run_folder().map_err(|error| lost(error.to_string()))?;
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let mut names: Vec<String> = entries.filter_map(|entry| Some(entry.file_name().to_str()?.strip_prefix(SOCKET)?.to_owned())).collect();
    names.sort();
    Ok(names.iter().filter_map(|name| found(name)).collect())
}

/// Returns the plant with that name; `None` if the listener does not describe itself.
fn found(name: &str) -> Option<FoundDevice> {
    let link = connect(&place(name).ok()?).ok()?;
    let Ok(Answer::Described(described)) = ask(&link, Ask::Describe) else { return None };
    let PlantDescription { made, channels, .. } = *described;
    let options = serde_json::json!({
        "driver": { "kind": made.kind, "options": made.options }, "name": name, "linger_ns": made.linger_ns, "step_ns": made.step_ns,
        "timeout_ns": made.timeout_ns,
    });
    Some(FoundDevice { what: format!("plant '{name}' of driver '{}', {} channels", made.kind, channels.len()), options })
}

/// Returns the state of the plant with that name.
///
/// # Errors
/// Returns a message if there is none.
pub fn state(name: &str) -> Result<PlantState, String> {
    let path = place(name).map_err(|error| error.to_string())?;
    let link = connect(&path).map_err(|error| format!("there is no plant '{name}' running: {error}"))?;
    match ask(&link, Ask::State)? {
        Answer::State(state) => Ok(state),
        other => Err(format!("the plant '{name}' gave an unexpected answer, {other:?}")),
    }
}

fn check(given: &GivenOptions<'_>, options: &Options) -> Result<(), DriverError> {
    let wrong = |option: &str, problem: String| Err(given.wrong(option, problem));
    let inner = options.driver.kind.as_str();
    let others: Vec<&str> = device::declarations().iter().map(|driver| driver.kind).filter(|kind| *kind != KIND).collect();
    if !others.contains(&inner) {
        return wrong("driver", format!("'{inner}' is not a driver that a process can run; choose one of {}", others.join(", ")));
    }
    if let Some(name) = &options.name
        && (name.is_empty() || name.len() > NAME_MAX || !name.bytes().all(|byte| byte.is_ascii_alphanumeric() || b"_-".contains(&byte)))
    {
        return wrong("name", format!("'{name}' is not a valid name; use 1 to {NAME_MAX} letters, digits, _ and -"));
    }
    Ok(())
}

/// Removes the sockets of this user's plants that were killed and therefore could not remove them.
pub fn clean() {
    let Ok(folder) = run_folder() else { return };
    let is_plant = |path: &PathBuf| path.file_name().is_some_and(|name| name.as_encoded_bytes().starts_with(SOCKET.as_bytes()));
    let paths = std::fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path());
    // A new socket may not be listened to yet.
    let is_old = |path: &PathBuf| path.metadata().and_then(|about| about.modified()).is_ok_and(|made| made.elapsed().is_ok_and(|age| age > NEW));
    for path in paths.filter(|path| is_plant(path) && is_old(path) && is_abandoned(path)) {
        // It may already have been removed.
        let _removed = std::fs::remove_file(path);
    }
}

/// Returns the command line that runs plants: that of the program next to this one, or that of the package in this program's interpreter.
fn beside() -> Result<Vec<OsString>, DriverError> {
    let beside = std::env::current_exe().map(|program| program.with_file_name("opengpac-plant"));
    let beside = beside.map_err(|error| lost(format!("the folder of this program cannot be found: {error}")))?;
    if beside.exists() {
        return Ok(vec![beside.into_os_string()]);
    }
    Ok([device::interpreter(), "-c".into(), "import sys; from opengpac import _native; sys.exit(_native.run_plant())".into()].into())
}

fn lost(problem: String) -> DriverError {
    DriverError::Process { kind: KIND.into(), problem }
}
