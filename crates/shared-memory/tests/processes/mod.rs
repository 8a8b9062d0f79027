// SPDX-License-Identifier: Apache-2.0
//! Processes on the other side, and their remains.
#![allow(dead_code, reason = "each test uses a part")]
pub mod far_ends;
pub mod groups;

use std::io::{BufRead, BufReader, Write};
use std::os::unix::process::ExitStatusExt;
use std::path::PathBuf;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

/// A process of the program `far-end`; ended on drop.
pub struct FarEnd {
    child: Child,
    /// Input of an obeying process, which ends when this is closed.
    input: Option<ChildStdin>,
    output: BufReader<ChildStdout>,
}

impl FarEnd {
    pub fn start(mode: &str, system: &str, run: u64, more: &[u64]) -> Self {
        let mut command = Command::new(env!("CARGO_BIN_EXE_far-end"));
        command.args([mode, system, &run.to_string()]).args(more.iter().map(u64::to_string));
        let mut child = command.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().expect("the program was built");
        let (input, output) = (child.stdin.take().filter(|_| mode == "obey"), child.stdout.take().expect("it is piped"));
        FarEnd { child, input, output: BufReader::new(output) }
    }

    pub fn tell(&mut self, line: &str) {
        let input = self.input.as_mut().expect("it obeys");
        writeln!(input, "{line}").expect("the process listens");
    }

    /// Returns the next line that it prints.
    pub fn hear(&mut self) -> String {
        let mut line = String::new();
        self.output.read_line(&mut line).expect("the process speaks");
        line.trim_end().to_owned()
    }

    /// Returns true while it runs.
    pub fn lives(&mut self) -> bool {
        self.child.try_wait().expect("it is our child").is_none()
    }

    /// Kills it, as `kill -9` does, and waits until it has exited. It must not have ended by itself, as it does if it detects a fault.
    pub fn kill(mut self) {
        self.child.kill().expect("it is our child");
        let status = self.child.wait().expect("it is our child");
        assert_eq!(status.signal(), Some(9), "the process found a fault: {status}");
    }
}

impl Drop for FarEnd {
    fn drop(&mut self) {
        if self.input.take().is_none() {
            self.child.kill().ok();
        }
        self.child.wait().ok();
    }
}

/// Returns the existing folders of a system's runs.
pub fn folders(system: &str) -> Vec<PathBuf> {
    let entries = std::fs::read_dir("/dev/shm").expect("there is shared memory").flatten().map(|entry| entry.path());
    let start = format!("opengpac-{system}-");
    entries.filter(|path| path.file_name().and_then(|name| name.to_str()).is_some_and(|name| name.starts_with(&start))).collect()
}
