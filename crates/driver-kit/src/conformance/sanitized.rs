// SPDX-License-Identifier: Apache-2.0
//! The exchange and the safe state under the real-time sanitizer, in a process that was started with it and exits at the first call that
//! may block.
use super::check::{CheckResult, PassedCheck};
use super::cost::{WARM, mixed};
use super::measures::Sanitizer;
use super::subject::Subject;
use process_kit::inherited;
use std::os::fd::AsRawFd;

/// Name of the descriptor that receives the output of the sanitizer.
pub(super) const SAID: &str = "said";
/// Number of firings under the sanitizer.
const WATCHED: usize = 200;

/// Runs exchanges under the sanitizer, in the process that the sanitizer ends.
pub(super) fn exchange(subject: &Subject) -> CheckResult {
    if !subject.is_inline() {
        return Ok(PassedCheck::NotApplicable("it is not inline"));
    }
    let said = inherited(SAID).map_err(|why| why.to_string())?;
    // SAFETY: both descriptors are open.
    unsafe { libc::dup2(said.as_raw_fd(), libc::STDERR_FILENO) };
    let sanitizer = Sanitizer::find().ok_or("its process was started without the sanitizer")?;
    let mut rig = subject.open()?;
    let joints = rig.joints();
    mixed(&mut rig, &joints, WARM)?;
    let mut rig = rig.under(sanitizer);
    mixed(&mut rig, &joints, WATCHED)?;
    rig.safe_state();
    Ok(PassedCheck::Yes)
}
