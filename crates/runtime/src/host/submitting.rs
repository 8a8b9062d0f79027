// SPDX-License-Identifier: Apache-2.0
//! Scripts on their way to their sources.
use super::*;

impl Host {
    /// Hands a script to a source; carried out between two firings, in the order of submission, at once if the source is idle
    /// (it is woken). Acknowledged by `Event::Done`. Any thread may call it. Under the virtual clock it is carried out before this returns, but where
    /// a
    /// firing with a cost is not over there: then at its end.
    pub fn submit(&self, source: SourceId, script: Box<Script>) {
        self.put(source, script, true);
    }

    /// Submits a script without a wait for its acknowledgement: a source of this process that sleeps is not woken for it. It is carried out with what comes next,
    /// of a timer before its next firing.
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

    /// Makes the place of a script's tables and processes in its source.
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
