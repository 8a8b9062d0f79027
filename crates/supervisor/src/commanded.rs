// SPDX-License-Identifier: Apache-2.0
//! Commands in the log, and who gave them. One that somebody repeats about the same thing many times a second is entered once a
//! second, with their number, so that a program that sets an override in a loop leaves room for what else happens.
use crate::core::Core;
use crate::system::System;
use std::collections::VecDeque;

/// How long the same command is only counted, ns of the system's clock.
const REPEATED_NS: i64 = 1_000_000_000;
/// Commands that are remembered.
const REMEMBERED_MAX: usize = 64;

/// A command that was entered.
struct Given {
    who: String,
    call: String,
    about: String,
    time_ns: i64,
    /// How often it has come since.
    repeats: u64,
}

/// The latest commands.
#[derive(Default)]
pub(crate) struct Commanded(VecDeque<Given>);

impl Commanded {
    /// How often a command has come since it was entered last; nothing where it is not to be entered now.
    fn enter(&mut self, who: &str, call: &str, about: &str, now_ns: i64) -> Option<u64> {
        let same = |given: &Given| given.who == who && given.call == call && given.about == about;
        let mut before = 0;
        if let Some(at) = self.0.iter().position(same) {
            if now_ns - self.0[at].time_ns < REPEATED_NS {
                self.0[at].repeats += 1;
                return None;
            }
            before = self.0.remove(at).map_or(0, |given| given.repeats);
        }
        if self.0.len() == REMEMBERED_MAX {
            self.0.pop_front();
        }
        self.0.push_back(Given { who: who.to_owned(), call: call.to_owned(), about: about.to_owned(), time_ns: now_ns, repeats: 0 });
        Some(before)
    }
}

impl Core {
    /// Enters a command.
    fn command_given(&mut self, who: &str, call: &str, about: &str, refused: Option<&str>) {
        let now_ns = self.host.now_ns();
        let Some(before) = self.commanded.enter(who, call, about, now_ns) else { return };
        let refused = refused.map(|why| format!(" was refused: {why}")).unwrap_or_default();
        let times = if before > 0 { format!(", and {before} times since the last line about it") } else { String::new() };
        self.log.add_of(now_ns, "command", about, format!("{call}{refused}{times}"), who);
    }
}

impl System {
    /// Enters a command into the log: who gave it, its call, what it is about, and why it was refused, where it was.
    pub fn log_command(&self, who: &str, call: &str, about: &str, refused: Option<&str>) {
        self.shared.locked().command_given(who, call, about, refused);
    }

    /// Enters what the program commands that this system is part of: about an instance, where `about` is empty.
    pub fn log_program(&self, call: &str, about: &str, instance: u64) {
        let mut core = self.shared.locked();
        let named = if about.is_empty() { core.instances.get(&instance).map(|i| i.name.clone()) } else { None };
        core.command_given("program", call, named.as_deref().unwrap_or(about), None);
    }

    /// The name of an instance; its number where there is none any more.
    pub fn instance_name(&self, instance: u64) -> String {
        self.shared.locked().instances.get(&instance).map_or_else(|| instance.to_string(), |i| i.name.clone())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_repeated_is_counted() {
        let mut commanded = Commanded::default();
        assert_eq!(commanded.enter("program", "set", "move#1", 0), Some(0));
        assert_eq!(commanded.enter("program", "set", "move#1", 999_999_999), None);
        assert_eq!(commanded.enter("program", "set", "move#2", 999_999_999), Some(0), "it is about something else");
        assert_eq!(commanded.enter("panel", "set", "move#1", 999_999_999), Some(0), "somebody else gave it");
        assert_eq!(commanded.enter("program", "set", "move#1", 1_000_000_000), Some(1));
        for index in 0..1_000 {
            assert_eq!(commanded.enter("program", "start", &format!("move#{index}"), 0), Some(0));
        }
        assert_eq!(commanded.0.len(), REMEMBERED_MAX, "nothing grows");
    }
}
