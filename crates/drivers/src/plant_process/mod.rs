// SPDX-License-Identifier: Apache-2.0
//! A plant in a process of its own: any other driver, at its own pace, as a machine has it. It outlives the process that commands it.
//!
//! Options: `driver` (`{"kind": …, "options": {…}}`: what the process runs), `command` (the command line of a process that calls
//! [`run`]; else `opengpac-plant` beside this program), `name` (where it is found by whoever opens it anew; else only this driver has it),
//! `linger_ns` (how long it goes on when nobody is connected, default 10 s), `step_ns` (its period; default the driver's `timestep`, else 1 ms),
//! `silent_ns` (a plant that makes no step for that long is lost, default 500 ms).
//!
//! Channels and parts are those of the driver that it runs. A read takes the newest whole group of readings, a write leaves a
//! group of commands: neither waits, allocates or calls the operating system.
//!
//! When the process of its driver is gone, the plant goes on under the last commands, as a drive without a watchdog does; it has none on purpose, so
//! that what the guard does shows. Its safe handle is a flag and safe commands in the memory that both share: the plant obeys them from
//! its next step on, until a driver opens it anew.
//!
//! Time runs as it does on the wall; under the virtual clock the driver runs in place: [`in_place`].
mod driver;
mod region;
mod serve;
mod words;

pub use serve::run;
pub use words::PlantState;

use crate::{DriverError, driver as door};
use ::kernel::Driver;
use guard::{Child, Launch, UnixLink, connect, run_folder};
use serde::Deserialize;
use serde_json::Value;
use std::ffi::OsString;
use std::path::PathBuf;
use std::time::Duration;
use words::{Answer, Ask, Described, Made};

/// How long a plant may take to make, load and describe itself.
const ANSWER: Duration = Duration::from_secs(30);
const LINGER_NS: i64 = 10_000_000_000;
const SILENT_NS: i64 = 500_000_000;
const NAME_MAX: usize = 40;
/// The name of the descriptor of the first link.
const LINK: &str = "link";

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Options {
    driver: Inner,
    command: Option<Vec<String>>,
    name: Option<String>,
    linger_ns: Option<i64>,
    step_ns: Option<i64>,
    silent_ns: Option<i64>,
}

#[derive(Clone, Deserialize)]
#[serde(deny_unknown_fields)]
struct Inner {
    kind: String,
    #[serde(default)]
    options: Value,
}

/// The driver that stands for `kind` where time is virtual: the one that a plant process would run, in this process. Other kinds stay.
pub fn in_place(kind: &str, options: &Value) -> (String, Value) {
    let inner = if kind == "plant_process" { serde_json::from_value::<Inner>(options["driver"].clone()).ok() } else { None };
    inner.map_or_else(|| (kind.to_owned(), options.clone()), |inner| (inner.kind, inner.options))
}

/// Starts the process, or finds the one of that name that runs already.
pub(crate) fn open(options: &Value) -> Result<(Box<dyn Driver>, Value), DriverError> {
    let options: Options = door::options("plant_process", options)?;
    check(&options)?;
    let made = Made {
        kind: options.driver.kind.clone(),
        options: options.driver.options.clone(),
        step_ns: options.step_ns,
        linger_ns: options.linger_ns.unwrap_or(LINGER_NS),
        name: options.name.clone(),
    };
    let path = options.name.as_deref().map(place).transpose().map_err(|error| lost(error.to_string()))?;
    let (link, child) = match path.as_deref().and_then(|path| connect(path).ok()) {
        Some(link) => (link, None),
        None => start(options.command)?,
    };
    let answer = ask(&link, if child.is_some() { Ask::Make(made.clone()) } else { Ask::Describe });
    let described = match answer {
        Ok(Answer::Described(described)) => described,
        Ok(Answer::Refused(problem)) => return Err(lost(problem)),
        Ok(_) => return Err(lost("what answers is no plant".to_owned())),
        Err(problem) => {
            let how = child.as_ref().and_then(|child| child.wait(Duration::from_secs(1))).map_or(problem, |status| format!("its process {status}"));
            return Err(lost(how));
        }
    };
    if described.made != made {
        let name = options.name.unwrap_or_default();
        return Err(DriverError::Option {
            kind: "plant_process".into(),
            option: "name".into(),
            problem: format!("the plant '{name}' that runs already was made with other options; close it, or give this one another name"),
        });
    }
    let Described { channels, about, .. } = described;
    let channels = channels.into_iter().map(Into::into).collect();
    Ok((Box::new(driver::PlantProcess::new(link, child, channels, options.silent_ns.unwrap_or(SILENT_NS), path)), about))
}

/// How the plant of that name is.
///
/// # Errors
/// There is none, in words.
pub fn state(name: &str) -> Result<PlantState, String> {
    let path = place(name).map_err(|error| error.to_string())?;
    let link = connect(&path).map_err(|error| format!("no plant '{name}' runs: {error}"))?;
    match ask(&link, Ask::State)? {
        Answer::State(state) => Ok(state),
        other => Err(format!("the plant '{name}' answers {other:?}")),
    }
}

fn check(options: &Options) -> Result<(), DriverError> {
    let wrong = |option: &str, problem: String| Err(DriverError::Option { kind: "plant_process".into(), option: option.into(), problem });
    let inner = options.driver.kind.as_str();
    if inner == "plant_process" || !door::KINDS.contains(&inner) {
        return wrong("driver", format!("'{inner}' is no driver that a process can run; one of {}", door::KINDS.join(", ")));
    }
    for (name, ns) in [("linger_ns", options.linger_ns), ("step_ns", options.step_ns), ("silent_ns", options.silent_ns)] {
        if ns.is_some_and(|ns| ns < 10_000) {
            return wrong(name, "at least 10 us".to_owned());
        }
    }
    if let Some(name) = &options.name
        && (name.is_empty() || name.len() > NAME_MAX || !name.bytes().all(|byte| byte.is_ascii_alphanumeric() || b"_-".contains(&byte)))
    {
        return wrong("name", format!("'{name}' is not 1 to {NAME_MAX} letters, digits, _ and -"));
    }
    Ok(())
}

/// Where the plant of that name listens.
fn place(name: &str) -> std::io::Result<PathBuf> {
    Ok(run_folder()?.join(format!("plant-{name}")))
}

fn start(command: Option<Vec<String>>) -> Result<(UnixLink, Option<Child>), DriverError> {
    let command: Vec<OsString> = match command {
        Some(words) => words.into_iter().map(OsString::from).collect(),
        None => {
            let beside = std::env::current_exe().map(|program| program.with_file_name("opengpac-plant"));
            vec![beside.map_err(|error| lost(format!("this program has no folder: {error}")))?.into_os_string()]
        }
    };
    let (link, theirs) = UnixLink::pair().map_err(|error| lost(format!("no link to its process can be made: {error}")))?;
    let child = Launch::new(command).descriptor(LINK, theirs).start().map_err(|error| lost(error.to_string()))?;
    Ok((link, Some(child)))
}

fn lost(problem: String) -> DriverError {
    DriverError::Process { kind: "plant_process".into(), problem }
}

/// Asks a plant; its answer, or in words why there is none.
fn ask(link: &UnixLink, ask: Ask) -> Result<Answer, String> {
    ask_with(link, ask).map(|(answer, _)| answer)
}

fn ask_with(link: &UnixLink, ask: Ask) -> Result<(Answer, Vec<std::os::fd::OwnedFd>), String> {
    let gone = |_| "its process is gone".to_owned();
    let frame = serde_json::to_vec(&ask).expect("an ask has no map with keys that are no texts");
    link.send_with(&frame, &[], Some(ANSWER)).map_err(gone)?;
    let (frame, descriptors) = link.receive_with(ANSWER).map_err(gone)?.ok_or_else(|| format!("its process does not answer for {} s", ANSWER.as_secs()))?;
    let answer = serde_json::from_slice(&frame).map_err(|_| "its process answers what no plant does".to_owned())?;
    Ok((answer, descriptors))
}
