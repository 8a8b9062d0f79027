// SPDX-License-Identifier: Apache-2.0
//! Reminder of the supervisor. While a caller attends in the supervisor's place ([`Host::attend`](crate::Host::attend)), reports of a
//! source wait for that caller, which has no real-time priority. The source, which has real-time priority, reminds the supervisor if the
//! caller does not poll in time.
use kernel::bell::Bell;

/// Time within which the caller must poll, ns.
const REMIND_NS: i64 = 1_000_000;

/// Reminder of one source.
#[derive(Default)]
pub(crate) struct Reminder {
    since_ns: Option<i64>,
}

impl Reminder {
    /// Reminds the supervisor if a reminder is due. Returns the time of the next check, ns of the host's clock; `None` if no reminder is
    /// owed. Real-time safe.
    pub fn look(&mut self, supervisor: &Bell, now_ns: i64) -> Option<i64> {
        if !supervisor.is_owed() {
            self.since_ns = None;
            return None;
        }
        let due_ns = *self.since_ns.get_or_insert(now_ns) + REMIND_NS;
        if now_ns < due_ns {
            return Some(due_ns);
        }
        supervisor.remind();
        self.since_ns = None;
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_reminds_a_millisecond_after_something_was_owed_however_often_it_looks() {
        let (bell, mut reminder) = (Bell::default(), Reminder::default());
        assert_eq!(reminder.look(&bell, 5), None);
        bell.attend();
        bell.tell();
        for now_ns in [10, 500_000, REMIND_NS + 9] {
            assert_eq!(reminder.look(&bell, now_ns), Some(REMIND_NS + 10), "{now_ns}");
            assert!(bell.is_owed());
        }
        assert_eq!(reminder.look(&bell, REMIND_NS + 10), None);
        assert!(!bell.is_owed(), "the supervisor was woken");
    }

    #[test]
    fn what_a_caller_has_looked_at_needs_no_reminder() {
        let (bell, mut reminder) = (Bell::default(), Reminder::default());
        bell.attend();
        bell.tell();
        assert_eq!(reminder.look(&bell, 0), Some(REMIND_NS));
        bell.leave(bell.rings());
        assert_eq!(reminder.look(&bell, 10), None);
        bell.attend();
        bell.tell();
        assert_eq!(reminder.look(&bell, 20), Some(REMIND_NS + 20), "the time begins anew");
    }
}
