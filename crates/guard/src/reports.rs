// SPDX-License-Identifier: Apache-2.0
//! Reports of two guards that observe the same events: each event is forwarded once.
use crate::guard_event::GuardEvent;
use process_kit::now_ns;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Mutex, PoisonError};

/// Merges the reports of the two guards: each event is forwarded once.
pub(crate) struct Reports {
    state: Mutex<State>,
    tell: Box<dyn Fn(GuardEvent) + Send + Sync>,
}

#[derive(Default)]
struct State {
    lost: BTreeSet<u64>,
    /// Processes that were made safe and spared, by name.
    spared: BTreeMap<String, SparedWard>,
    missing: Option<Vec<String>>,
    one_is_gone: bool,
}

#[derive(Clone, Copy, Default)]
struct SparedWard {
    stands_still: bool,
    /// Time at which the process was reported to have resumed, ns. A stall observed before this time is the one that was already
    /// reported.
    went_on_ns: i64,
}

impl Reports {
    pub fn new(tell: Box<dyn Fn(GuardEvent) + Send + Sync>) -> Reports {
        Reports { state: Mutex::default(), tell }
    }

    /// Processes a report of one guard. Forwards it unless the other guard has already reported the event.
    pub fn hear(&self, event: GuardEvent) {
        let told = self.state.lock().unwrap_or_else(PoisonError::into_inner).news(event, now_ns());
        if let Some(event) = told {
            (self.tell)(event);
        }
    }

    /// Forgets a loss recorded under this number, which is now used for another process.
    pub fn begin(&self, ward: u64) {
        self.state.lock().unwrap_or_else(PoisonError::into_inner).lost.remove(&ward);
    }
}

impl State {
    fn news(&mut self, event: GuardEvent, now_ns: i64) -> Option<GuardEvent> {
        let is_news = match &event {
            GuardEvent::Lost(loss) => self.lost.insert(loss.ward),
            GuardEvent::MadeSafe(loss) => {
                let spared = self.spared.entry(loss.name.clone()).or_default();
                let is_news = !spared.stands_still && loss.seen_ns > spared.went_on_ns;
                spared.stands_still |= is_news;
                is_news
            }
            GuardEvent::GoesOn(name) => match self.spared.get_mut(name) {
                Some(spared) if spared.stands_still => {
                    *spared = SparedWard { stands_still: false, went_on_ns: now_ns };
                    true
                }
                _ => false,
            },
            GuardEvent::Missing(missing) => self.missing.replace(missing.clone()).as_ref() != Some(missing),
            GuardEvent::Gone(why) if !self.one_is_gone => {
                self.one_is_gone = true;
                return Some(GuardEvent::Alone(why.clone()));
            }
            GuardEvent::Restarted { .. } | GuardEvent::Alone(_) | GuardEvent::Gone(_) => true,
        };
        is_news.then_some(event)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::messages::Loss;
    use crate::watch::Cause;

    fn loss(seen_ns: i64) -> Loss {
        Loss { ward: 1, name: "rtp1".into(), cause: Cause::Stopped, seen_ns, safe_ns: seen_ns, written: 1, failed: Vec::new() }
    }

    #[test]
    fn what_both_say_is_told_once() {
        let mut state = State::default();
        let goes_on = || GuardEvent::GoesOn("rtp1".into());
        assert!(state.news(GuardEvent::MadeSafe(loss(100)), 0).is_some());
        assert!(state.news(goes_on(), 200).is_some());
        assert!(state.news(GuardEvent::MadeSafe(loss(110)), 210).is_none(), "the other one saw the same standstill");
        assert!(state.news(goes_on(), 220).is_none());
        assert!(state.news(GuardEvent::MadeSafe(loss(300)), 400).is_some(), "the next standstill is another one");
        assert!(state.news(GuardEvent::MadeSafe(loss(310)), 410).is_none());
        assert!(state.news(goes_on(), 420).is_some() && state.news(goes_on(), 430).is_none());
        assert!(state.news(GuardEvent::Lost(loss(500)), 500).is_some() && state.news(GuardEvent::Lost(loss(501)), 501).is_none());
    }

    #[test]
    fn a_guard_is_gone_when_both_are() {
        let mut state = State::default();
        assert_eq!(state.news(GuardEvent::Gone("a".into()), 0), Some(GuardEvent::Alone("a".into())));
        assert_eq!(state.news(GuardEvent::Gone("b".into()), 0), Some(GuardEvent::Gone("b".into())));
    }
}
