// SPDX-License-Identifier: Apache-2.0
//! Commands in the log, and who gave them. One that somebody repeats about the same thing many times a second is entered once a
//! second, with their number, so that a program that sets an override in a loop leaves room for what else happens.
//! A command of the program is entered when it has its first effect on the log, or is through: only then is it known that it is not refused.
use crate::log::Log;
use crate::system::System;
use model::refusal::Refusals;
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
    is_refused: bool,
    time_ns: i64,
    /// How often it has come since.
    repeats: u64,
}

/// The latest commands.
#[derive(Default)]
pub(crate) struct Commanded(VecDeque<Given>);

impl Commanded {
    /// How often a command has come since it was entered last; nothing where it is not to be entered now.
    fn enter(&mut self, who: &str, call: &str, about: &str, is_refused: bool, now_ns: i64) -> Option<u64> {
        let same = |given: &Given| given.who == who && given.call == call && given.about == about && given.is_refused == is_refused;
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
        self.0.push_back(Given { who: who.to_owned(), call: call.to_owned(), about: about.to_owned(), is_refused, time_ns: now_ns, repeats: 0 });
        Some(before)
    }
}

/// A command of the program that is under way.
pub(crate) struct Announced {
    number: u64,
    call: String,
    about: String,
    time_ns: i64,
}

const PROGRAM: &str = "program";

impl Log {
    /// Enters a command, and why it was refused, where it was.
    fn command(&mut self, who: &str, call: &str, about: &str, refused: Option<&str>, now_ns: i64) {
        let Some(before) = self.commanded.enter(who, call, about, refused.is_some(), now_ns) else { return };
        let refused = refused.map(|why| format!(" was refused: {why}")).unwrap_or_default();
        let times = if before > 0 { format!(", and {before} times since the last line about it") } else { String::new() };
        self.push(now_ns, "command", about, format!("{call}{refused}{times}"), who);
    }

    /// A command of the program begins: its number.
    fn announce(&mut self, call: &str, about: &str, time_ns: i64) -> u64 {
        self.announcements += 1;
        self.announced.push(Announced { number: self.announcements, call: call.to_owned(), about: about.to_owned(), time_ns });
        self.announcements
    }

    /// It is through, or refused.
    fn settle(&mut self, number: u64, call: &str, about: &str, refused: Option<&str>, now_ns: i64) {
        let announced = self.announced.iter().position(|announced| announced.number == number).map(|at| self.announced.remove(at));
        match (announced, refused) {
            (Some(announced), None) => self.command(PROGRAM, call, about, None, announced.time_ns),
            (_, Some(why)) => self.command(PROGRAM, call, about, Some(why), now_ns),
            (None, None) => {}
        }
    }

    /// Enters what is under way.
    pub fn enter_announced(&mut self) {
        for of in std::mem::take(&mut self.announced) {
            self.command(PROGRAM, &of.call, &of.about, None, of.time_ns);
        }
    }
}

impl System {
    /// Enters a command into the log: who gave it, its call, what it is about, and why it was refused, where it was.
    pub fn log_command(&self, who: &str, call: &str, about: &str, refused: Option<&str>) {
        let mut core = self.shared.locked();
        let now_ns = core.host.now_ns();
        core.log.command(who, call, about, refused, now_ns);
    }

    /// Carries out what the program commands that this system is part of, and enters it: about an instance, where `about` is empty.
    pub fn as_program<T>(&self, call: &str, about: &str, instance: u64, act: impl FnOnce() -> Result<T, Refusals>) -> Result<T, Refusals> {
        let (number, about) = {
            let mut core = self.shared.locked();
            let named = if about.is_empty() { core.instances.get(&instance).map(|i| i.name.clone()) } else { None };
            let (about, now_ns) = (named.unwrap_or_else(|| about.to_owned()), core.host.now_ns());
            (core.log.announce(call, &about, now_ns), about)
        };
        let result = act();
        let refused = result.as_ref().err().map(|refusals| refusals.first().map_or("", |refusal| refusal.message.as_str()));
        let mut core = self.shared.locked();
        let now_ns = core.host.now_ns();
        core.log.settle(number, call, &about, refused, now_ns);
        drop(core);
        result
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
        assert_eq!(commanded.enter("program", "set", "move#1", false, 0), Some(0));
        assert_eq!(commanded.enter("program", "set", "move#1", false, 999_999_999), None);
        assert_eq!(commanded.enter("program", "set", "move#2", false, 999_999_999), Some(0), "it is about something else");
        assert_eq!(commanded.enter("panel", "set", "move#1", false, 999_999_999), Some(0), "somebody else gave it");
        assert_eq!(commanded.enter("program", "set", "move#1", false, 1_000_000_000), Some(1));
        assert_eq!(commanded.enter("program", "set", "move#1", true, 1_000_000_000), Some(0), "it is refused");
        for index in 0..1_000 {
            assert_eq!(commanded.enter("program", "start", &format!("move#{index}"), false, 0), Some(0));
        }
        assert_eq!(commanded.0.len(), REMEMBERED_MAX, "nothing grows");
    }
}
