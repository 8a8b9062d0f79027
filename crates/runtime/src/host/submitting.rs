// SPDX-License-Identifier: Apache-2.0
//! Submission of scripts to their sources.
use super::*;

impl Host {
    /// Submits a script to a source. It is carried out between two firings, in the order of submission, and immediately if the source is
    /// idle (the source is woken). Acknowledged by `Event::Done`. May be called by any thread. Under the virtual clock, the script is
    /// carried out before this returns or, if a firing with a cost is in progress, at the end of that firing.
    pub fn submit(&self, source: SourceId, script: Box<Script>) {
        self.put(source, script, true);
    }

    /// Submits a script without waking a sleeping source of this process, because no caller waits for the acknowledgement. The script is
    /// carried out at the source's next activity; on a timer, before the next firing.
    pub fn submit_at_leisure(&self, source: SourceId, script: Box<Script>) {
        self.put(source, script, false);
    }

    fn put(&self, source: SourceId, mut script: Box<Script>, wakes: bool) {
        self.remote_sources.announce(source, &script);
        if let Some(remote) = self.remote(source) {
            return remote.submit(source, script);
        }
        self.prepare(source, &mut script);
        let mut submission = Submission::new(script);
        submission.recorded = self.trace.get().map_or(0, |trace| trace.script(source, &submission.script));
        let to = self.source(source);
        to.mailbox.put(submission);
        match &self.executor {
            Some(executor) => executor.lock().expect("nobody panics with the lock held").carry_out(source.0 as usize, self.now_ns()),
            None if wakes => to.bell().ring(),
            None => {}
        }
    }

    /// Prepares a script's tables and processes for its source.
    pub(crate) fn prepare(&self, source: SourceId, script: &mut Script) {
        let sources = self.sources();
        for op in &mut script.ops {
            match op {
                Op::Table(table) => {
                    let raised = |source: SourceId| sources.get(source.0 as usize).map(|source| source.requests.clone());
                    table.place(source, raised, self.tape(source).is_some());
                }
                Op::StartClock(process)
                | Op::StopClock(process)
                | Op::ResumeClock(process)
                | Op::KeepClock(process, _)
                | Op::Stage { process, .. }
                | Op::Advance { process, .. } => {
                    process.prepare_time(source);
                }
                _ => {}
            }
        }
    }
}
