// SPDX-License-Identifier: Apache-2.0
//! Commands in the log, with their callers. A command that is repeated for the same subject many times a second is logged once a second
//! with its count, so that a program that sets an override in a loop leaves space for other entries. A command of the program is logged
//! when it has its first effect on the log, or when it completes, because only then is it known not to be refused.
use std::collections::VecDeque;

/// Time during which a repeated command is only counted, ns of the system's clock.
const REPEATED_NS: i64 = 1_000_000_000;
/// Maximum number of commands to remember.
const REMEMBERED_MAX: usize = 64;

/// A command in the log.
struct GivenCommand {
    who: String,
    call: String,
    about: String,
    is_refused: bool,
    time_ns: i64,
    /// Number of repetitions since the log entry.
    repeats: u64,
}

/// Most recent commands.
#[derive(Default)]
pub(crate) struct LatestCommands(VecDeque<GivenCommand>);

impl LatestCommands {
    /// Returns the number of repetitions of a command since its last log entry; `None` if the command is not to be logged now.
    pub fn enter(&mut self, who: &str, call: &str, about: &str, is_refused: bool, now_ns: i64) -> Option<u64> {
        let same = |given: &GivenCommand| given.who == who && given.call == call && given.about == about && given.is_refused == is_refused;
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
        self.0.push_back(GivenCommand { who: who.to_owned(), call: call.to_owned(), about: about.to_owned(), is_refused, time_ns: now_ns, repeats: 0 });
        Some(before)
    }
}

/// A command, issued by the program, that is still in progress.
pub(crate) struct AnnouncedCommand {
    pub number: u64,
    pub call: String,
    pub about: String,
    pub time_ns: i64,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_repeated_is_counted() {
        let mut commanded = LatestCommands::default();
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
