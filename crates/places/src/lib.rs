// SPDX-License-Identifier: Apache-2.0
//! Where processors elsewhere run: processes of this host that are started for them.
//!
//! [`Places`] is given to a system; [`processor`] is what such a process does from its start to its end. The command line
//! that starts one is the programming system's: whatever it runs must come to call [`processor`].
mod started;

use guard::UnixLink;
use interconnect::{Ends, Link};
use modules::Probe;
use rtp::Reaches;
use shared_memory::SharedMemory;
use std::ffi::OsString;
use std::sync::Arc;

pub use started::Places;

/// Environment variables that a process gets with its link: name of the system, number of its run, the interpreter that tries code modules.
pub(crate) const SYSTEM: &str = "OPENGPAC_SYSTEM_NAME";
pub(crate) const RUN: &str = "OPENGPAC_SYSTEM_RUN";
pub(crate) const PYTHON: &str = "OPENGPAC_PYTHON";

/// Name of the descriptor of the link.
pub(crate) const LINK: &str = "link";

/// The life of a process that was started for a processor.
///
/// # Errors
/// In words: it was not started by a system, or the other side is of another version.
pub fn processor() -> Result<(), String> {
    let descriptor = guard::inherited(LINK).map_err(|why| why.to_string())?;
    let link: Arc<dyn Link> = Arc::new(UnixLink::from_descriptor(descriptor).map_err(|why| why.to_string())?);
    let variable = |name: &str| std::env::var(name).map_err(|_| format!("the environment has no {name}: a system starts this process"));
    let run: u64 = variable(RUN)?.parse().map_err(|_| format!("{RUN} is no number"))?;
    let shared = SharedMemory::new(&variable(SYSTEM)?, run).map_err(|why| why.message)?;
    let python = variable(PYTHON)?;
    let probe = Probe::of([OsString::from(python), "-I".into(), "-c".into(), modules::PYTHON_PROBE.into()]);
    rtp::serve(&link, Reaches { host: Some(Box::new(shared) as Box<dyn Ends>), network: None }, probe)
}
