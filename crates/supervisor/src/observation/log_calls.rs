// SPDX-License-Identifier: Apache-2.0
//! Calls that add to the log: commands with their callers, and messages from outside the supervisor.
use crate::alarms::causes::alarm_recording;
use crate::precedence::first;
use crate::system::System;
use model::refusal::Refusals;

/// Command of the program of which the system is a part, as logged.
pub struct ProgramCommand<'a> {
    pub call: &'static str,
    pub subject: CommandSubject<'a>,
    /// True if the command stops something: even its log entry must not wait for other callers.
    pub stops: bool,
}

/// Subject of a command in the log.
pub enum CommandSubject<'a> {
    Instance(u64),
    Named(&'a str),
}

impl System {
    /// Logs a command: its caller (`who`), its call, its subject, and the reason for its refusal if it was refused.
    pub fn log_command(&self, who: &str, call: &str, about: &str, refused: Option<&str>) {
        let mut core = self.shared.locked();
        let now_ns = core.host.now_ns();
        core.observation.log.command(who, call, about, refused, now_ns);
    }

    /// Executes a command of the program of which this system is a part, and logs it.
    pub fn as_program<T>(&self, command: &ProgramCommand<'_>, act: impl FnOnce() -> Result<T, Refusals>) -> Result<T, Refusals> {
        let run = || self.announced(command, act);
        if command.stops { first(run) } else { run() }
    }

    fn announced<T>(&self, command: &ProgramCommand<'_>, act: impl FnOnce() -> Result<T, Refusals>) -> Result<T, Refusals> {
        let call = command.call;
        let (number, about) = {
            let mut core = self.shared.locked();
            let about = match command.subject {
                CommandSubject::Instance(instance) => core.instances.get(&instance).map_or_else(String::new, |i| i.name.clone()),
                CommandSubject::Named(name) => name.to_owned(),
            };
            let now_ns = core.host.now_ns();
            (core.observation.log.announce(call, &about, now_ns), about)
        };
        let result = act();
        let refused = result.as_ref().err().map(|refusals| refusals.first().map_or("", |refusal| refusal.message.as_str()));
        let mut core = self.shared.locked();
        let now_ns = core.host.now_ns();
        core.observation.log.settle(number, call, &about, refused, now_ns);
        drop(core);
        result
    }

    /// Returns the name of an instance, or its number if it has been deleted.
    pub fn instance_name(&self, instance: u64) -> String {
        self.shared.locked().instances.get(&instance).map_or_else(|| instance.to_string(), |i| i.name.clone())
    }

    /// Adds an entry about the journal to the log.
    pub fn log_journal(&self, text: &str) {
        let mut core = self.shared.locked();
        let now_ns = core.host.now_ns();
        core.observation.log.add(now_ns, "journal", "system", text);
    }

    /// Adds an entry about the control interface to the log.
    pub fn log_control(&self, text: &str) {
        let mut core = self.shared.locked();
        let now_ns = core.host.now_ns();
        core.observation.log.add(now_ns, "control", "system", text);
    }

    /// Returns the log entries starting at number `sequence`.
    pub fn log_since(&self, sequence: u64) -> Vec<crate::observation::log::Entry> {
        self.shared.locked().observation.log.since(sequence)
    }

    /// Adds an entry from outside the supervisor to the log.
    pub fn note(&self, kind: &'static str, about: &str, text: &str) {
        let mut core = self.shared.locked();
        let now_ns = core.host.now_ns();
        core.observation.log.add(now_ns, kind, about, text);
    }

    /// Raises an alarm for a recording that ended because its file can no longer be written.
    pub fn recording_failed(&self, why: &str) {
        let mut core = self.shared.locked();
        let now_ns = core.host.now_ns();
        core.observation.log.add(now_ns, "recorder", "system", why);
        alarm_recording(&mut core, why);
    }

    /// Logs that a module changed the floating-point control words of the thread that loaded it; they have already been restored.
    pub(crate) fn note_floats(&self, module: &str) -> String {
        let text = format!(
            "code module '{module}' changed the floating-point state of the thread that loaded it, which was restored: link it without -ffast-math, and do not change this state in its initialisation"
        );
        let mut core = self.shared.locked();
        let now_ns = core.host.now_ns();
        core.observation.log.add(now_ns, "module", module, text.clone());
        text
    }
}
