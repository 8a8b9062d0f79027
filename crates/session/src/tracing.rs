// SPDX-License-Identifier: Apache-2.0
//! A record of a system for replay, written to a file by an ordinary thread until the system is closed.
use model::refusal::{Class, Refusal, Refusals};
use replay::{Item, Recording, Writer};
use std::path::{Path, PathBuf};
use std::thread::JoinHandle;
use std::time::Duration;
use supervisor::System;

/// How often what has come is written, as a chunk of its own: kernels have room for far longer, but a process that is killed loses no more.
const PERIOD: Duration = Duration::from_millis(10);

/// A record that is being written.
pub struct Tracing {
    path: PathBuf,
    thread: Option<JoinHandle<std::io::Result<()>>>,
}

impl Tracing {
    /// Begins a record of `system` in a new file. Before its first source is made.
    ///
    /// # Errors
    /// `InvalidState`: it has sources already, or the file cannot be written.
    pub fn begin(system: &System, path: &Path) -> Result<Tracing, Refusals> {
        let refused = |why: std::io::Error| {
            let message = format!("cannot write the record '{}': {why}", path.display());
            vec![Refusal::new(Class::InvalidState, message).remedy("give a file in a folder that may be written")]
        };
        // Before anything is recorded: what nobody writes would only grow.
        let writer = Writer::create(path).map_err(refused)?;
        let mut over = None;
        let recording = Recording::begin(|names| system.record(names).inspect(|trace| over = Some(trace.clone())))?;
        let over = over.expect("a record that was begun has its trace");
        let body = move || write(recording, writer, || over.is_over());
        let thread = std::thread::Builder::new().name("records".into()).spawn(body).map_err(refused)?;
        Ok(Tracing { path: path.to_owned(), thread: Some(thread) })
    }

    /// Waits until everything is written; after the system was closed. Twice is once.
    ///
    /// # Errors
    /// `InvalidState`: the file could not be written, so that it ends before the run does.
    pub fn finish(&mut self) -> Result<(), Refusals> {
        let Some(thread) = self.thread.take() else { return Ok(()) };
        let written = thread.join().unwrap_or_else(|_| Err(std::io::Error::other("whoever wrote it has ended")));
        written.map_err(|why| {
            let message = format!("the record '{}' ends before the run: {why}", self.path.display());
            vec![Refusal::new(Class::InvalidState, message).remedy("give it a disk with more room")]
        })
    }
}

fn write(mut recording: Recording, mut writer: Writer, is_over: impl Fn() -> bool) -> std::io::Result<()> {
    let mut items: Vec<Item> = Vec::new();
    loop {
        // Asked before the last look: what comes before the end is seen.
        let ends = is_over();
        recording.take(&mut items);
        if !items.is_empty() {
            writer.write(&items)?;
            // Whatever happens to this process, the file has what came so far.
            writer.flush()?;
            items.clear();
        }
        if ends {
            return writer.finish();
        }
        std::thread::sleep(PERIOD);
    }
}
