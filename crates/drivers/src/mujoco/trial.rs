// SPDX-License-Identifier: Apache-2.0
//! Trial load of a model: a child process loads the model and evaluates it once (`mj_forward`), so that failures that MuJoCo does not
//! survive (a fatal error, an uncaught exception when out of memory, a crash on a damaged file) terminate the child instead of the
//! controller.
//!
//! The child is a Python interpreter, because the library is part of the package `mujoco`. It is limited to half of the memory, 60 s of
//! CPU time and ten minutes. A model that has passed is not tried again in this process as long as its file is unchanged; included files
//! are not checked. If no interpreter can be started, the trial is skipped and the model is loaded directly.
use std::collections::VecDeque;
use std::os::unix::process::ExitStatusExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::sync::Mutex;
use std::time::SystemTime;

const SCRIPT: &str = concat!(include_str!("limits.py"), include_str!("trial.py"));
/// CPU time limit of a child that reads a model, s.
const PROCESSOR_S: u32 = 60;
/// Wall-clock time limit of the child, s. It allows for a busy machine, and ends the wait for a file that never arrives.
const WALL_S: u32 = 600;
/// Maximum number of passed models that are remembered.
const PASSED_MAX: usize = 64;

/// Identity of a tried file: the library that tried it, its path, its length and modification time.
#[derive(Clone, PartialEq, Eq)]
struct FileIdentity {
    library: PathBuf,
    model: PathBuf,
    len: u64,
    changed: SystemTime,
}

static PASSED: Mutex<VecDeque<FileIdentity>> = Mutex::new(VecDeque::new());

/// Checks a model; the error combines MuJoCo's message and that of this driver. Blocks until the child has exited.
pub(super) fn model(library: &Path, model: &Path) -> Result<(), String> {
    let seen = seen(library, model);
    let passed = || PASSED.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
    if seen.as_ref().is_some_and(|seen| passed().contains(seen)) {
        return Ok(());
    }
    let mut command = Command::new(device::interpreter());
    command.args(["-I", "-S", "-c", SCRIPT]).args([library, model]).args(limits()).stdin(Stdio::null());
    // Without an interpreter there is no trial, and the file is not recorded as passed.
    let Ok(output) = command.output() else { return Ok(()) };
    let Some(is_sound) = verdict(&output)? else { return Ok(()) };
    if let Some(seen) = seen.filter(|_| is_sound) {
        let mut passed = passed();
        passed.truncate(PASSED_MAX - 1);
        passed.push_front(seen);
    }
    Ok(())
}

/// Returns the arguments with the time limits of a child.
pub(super) fn limits() -> [String; 2] {
    [PROCESSOR_S, WALL_S].map(|limit| limit.to_string())
}

fn seen(library: &Path, model: &Path) -> Option<FileIdentity> {
    let of = std::fs::metadata(model).ok()?;
    Some(FileIdentity { library: library.into(), model: model.into(), len: of.len(), changed: of.modified().ok()? })
}

/// Returns the verdict of the child; `None` if it did not get as far as trying the model.
fn verdict(output: &Output) -> Result<Option<bool>, String> {
    let said = String::from_utf8_lossy(&output.stdout);
    let Some(said) = said.strip_prefix("trying ") else { return Ok(None) };
    let (word, text) = said.split_once(' ').unwrap_or((said, ""));
    let line = |text: &str| text.trim().replace('\n', "; ");
    match (word, output.status.signal()) {
        ("sound", None) => Ok(Some(true)),
        ("refused", None) => Err(line(text)),
        ("fatal", None) => Err(fatal("", &line(text))),
        (_, Some(libc::SIGXCPU)) => Err(format!("it was not loaded within {PROCESSOR_S} s of processor time; check for counts that are too large")),
        (_, Some(libc::SIGALRM)) => {
            Err(format!("it was not loaded within {WALL_S} s; check for files that cannot be read, and for other load on this machine"))
        }
        (_, Some(signal)) => Err(fatal(&format!(" (signal {signal})"), &line(&String::from_utf8_lossy(&output.stderr)))),
        (_, None) => Err(fatal("", &line(&String::from_utf8_lossy(&output.stderr)))),
    }
}

fn fatal(how: &str, text: &str) -> String {
    let says = if text.is_empty() { String::new() } else { format!(" and reports '{text}'") };
    format!("MuJoCo ends the process that tries to load it{how}{says}; check for sizes that exceed the memory, and for damaged files to which it refers")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(status: i32, stdout: &str, stderr: &str) -> Result<Option<bool>, String> {
        verdict(&Output { status: std::process::ExitStatus::from_raw(status), stdout: stdout.into(), stderr: stderr.into() })
    }

    #[test]
    fn what_a_child_says_and_how_it_ends_is_the_verdict() {
        assert_eq!(of(0, "trying sound", ""), Ok(Some(true)));
        assert_eq!(of(0, "trying refused Error: no\nline 1", ""), Err("Error: no; line 1".to_owned()));
        assert!(of(0, "trying fatal stack overflow", "").unwrap_err().contains("reports 'stack overflow'"));
        assert!(of(libc::SIGABRT, "trying ", "terminating\n").unwrap_err().contains("(signal 6) and reports 'terminating'"));
        assert!(of(libc::SIGXCPU, "trying ", "").unwrap_err().contains("not loaded within 60 s of processor time"));
        assert!(of(libc::SIGALRM, "trying ", "").unwrap_err().contains("not loaded within 600 s; check for files"));
        assert!(of(1 << 8, "trying ", "").unwrap_err().starts_with("MuJoCo ends the process that tries to load it; check"));
        assert_eq!(of(1 << 8, "", "No module named ctypes"), Ok(None), "an interpreter that cannot try has no verdict");
    }
}
