// SPDX-License-Identifier: Apache-2.0
//! Creates the driver of a plant, which runs in a process of its own.
use super::driver;
use super::plant_link::{LINK, SERVICES, ask};
use super::plant_messages::{Answer, Ask, PlantDescription, PlantOrigin};
use device::{DeclaredServices, DriverError, GivenOptions, OpenedDriver};
use process_kit::{Child, Launch, UnixLink, connect};
use std::ffi::OsString;
use std::path::PathBuf;
use std::time::Duration;

/// Opens the process with this origin: connects to it if it is running, or starts it with this command.
pub(super) fn opened(
    given: &GivenOptions<'_>,
    kind: &'static str,
    made: PlantOrigin,
    command: Vec<OsString>,
    bounds: driver::Bounds,
    path: Option<PathBuf>,
) -> Result<OpenedDriver, DriverError> {
    let lost = |problem: String| DriverError::Process { kind: kind.into(), problem };
    let (link, child, services) = match path.as_deref().and_then(|path| connect(path).ok()) {
        Some(link) => (link, None, None),
        None => start(command).map_err(lost)?,
    };
    let answer = ask(&link, if child.is_some() { Ask::Make(made.clone()) } else { Ask::Describe });
    let described = match answer {
        Ok(Answer::Described(described)) => *described,
        Ok(Answer::Refused(problem)) => return Err(lost(problem)),
        Ok(_) => return Err(lost("the process that answers is not a plant".to_owned())),
        Err(problem) => {
            let how = child.as_ref().and_then(|child| child.wait(Duration::from_secs(1))).map_or(problem, |status| format!("its process {status}"));
            return Err(lost(how));
        }
    };
    if described.made != made {
        let name = made.name.unwrap_or_default();
        let problem = format!("the plant '{name}' is already running with different options; close it, or give this one another name");
        return Err(given.wrong("name", problem));
    }
    let PlantDescription { channels, mut about, .. } = described;
    // Services and counters of a machine's driver are not offered from here.
    let foreign = if made.rest_ns.is_some() { &["class", "safe_state"][..] } else { &["class", "safe_state", "services", "counters"] };
    for word in foreign {
        about.as_object_mut().and_then(|about| about.remove(*word));
    }
    let told = DeclaredServices::read(&about).map_err(lost)?;
    let channels = channels.into_iter().map(Into::into).collect();
    let driver = driver::PlantProcess::new(link, child, (channels, &about), bounds, path).serving(told, services);
    Ok((Box::new(driver), about))
}

fn start(command: Vec<OsString>) -> Result<(UnixLink, Option<Child>, Option<UnixLink>), String> {
    let pair = || UnixLink::pair().map_err(|error| format!("cannot create a link to its process: {error}"));
    let ((link, theirs), (services, their_services)) = (pair()?, pair()?);
    let launch = Launch::new(command).descriptor(LINK, theirs).descriptor(SERVICES, their_services);
    let child = launch.start().map_err(|error| error.to_string())?;
    Ok((link, Some(child), Some(services)))
}
