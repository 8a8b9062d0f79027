// SPDX-License-Identifier: Apache-2.0
//! State of the system that readers need to display a recording as they display the running system: definitions, statistics, alarms, and
//! device shapes.
use crate::page::{ChannelId, Page};
use crate::shapes::Shapes;
use crate::{ALARMS, GEOMETRY, INSTALLED, STATISTICS};
use serde::Serialize;
use serde_json::json;
use std::collections::{BTreeMap, HashSet};
use supervisor::{Alarm, AlarmList, InstalledInstances, InstanceState, System};

const SECOND_NS: i64 = 1_000_000_000;
/// Minimum interval between records of the state during frequent changes; the log contains each event.
const SOON_NS: i64 = 100_000_000;

/// State of the system: the installed definitions whenever they change, statistics and alarms once a second and when the log has new
/// entries, and the shape of each device once.
pub(crate) struct State {
    system: System,
    version: u64,
    structure: String,
    alarms: String,
    /// Time of the last record of alarms; before the first record, the time at which the recording started.
    alarms_ns: i64,
    alarm_times: AlarmTimes,
    next_ns: i64,
    soon_ns: i64,
    happened: bool,
    shapes: Shapes,
    channels: BTreeMap<String, ChannelId>,
}

impl State {
    pub fn new(system: System) -> State {
        let now_ns = system.now_ns();
        State {
            version: 0,
            structure: String::new(),
            alarms: String::new(),
            alarms_ns: now_ns,
            alarm_times: AlarmTimes::default(),
            next_ns: now_ns,
            soon_ns: now_ns,
            happened: false,
            shapes: Shapes::default(),
            channels: BTreeMap::new(),
            system,
        }
    }

    /// Appends the changes. `happened` is true if the log has new entries.
    pub fn drain(&mut self, page: &mut Page, happened: bool) {
        self.happened |= happened;
        let now_ns = self.system.now_ns();
        let version = self.system.installed_version();
        if version != self.version {
            self.version = version;
            self.installed(page, now_ns);
        }
        if now_ns >= self.next_ns || (self.happened && now_ns >= self.soon_ns) {
            (self.next_ns, self.soon_ns, self.happened) = (now_ns + SECOND_NS, now_ns + SOON_NS, false);
            self.statistics(page, now_ns);
        }
        self.shapes(page, false);
    }

    /// Schedules the whole state to be recorded again, because a new file starts.
    pub fn renew(&mut self) {
        (self.version, self.next_ns) = (0, self.system.now_ns());
        self.structure.clear();
        self.alarms.clear();
    }

    /// Appends the shapes that have become available; if `all` is true, every requested shape.
    pub fn shapes(&mut self, page: &mut Page, all: bool) {
        for (device, asked_ns, geometry) in self.shapes.take(all) {
            self.put(page, &format!("{GEOMETRY}{device}"), asked_ns, &geometry);
        }
    }

    /// Records changes other than those of the lists and states of instances, which readers take from the log with the times logged
    /// there.
    fn installed(&mut self, page: &mut Page, now_ns: i64) {
        let installed = self.system.installed();
        let structure = text_of(&without_states(&installed));
        if structure != self.structure {
            self.structure = structure;
            self.put(page, INSTALLED, now_ns, &installed);
        }
    }

    fn statistics(&mut self, page: &mut Page, now_ns: i64) {
        let statistics = self.system.statistics();
        self.shapes.ask(&self.system, statistics.physical_devices.keys(), now_ns);
        self.put(page, STATISTICS, now_ns, &statistics);
        let alarms = self.system.alarms();
        let text = text_of(&alarms.current);
        if text != self.alarms {
            self.alarms = text;
            // An observation is later than the change that it observes, under the virtual clock by seconds.
            let changed_ns = self.alarm_times.newest(&alarms).filter(|&ns| ns >= self.alarms_ns && ns <= now_ns);
            self.alarms_ns = changed_ns.unwrap_or(now_ns);
            self.put(page, ALARMS, self.alarms_ns, &alarms);
        }
    }

    fn put(&mut self, page: &mut Page, topic: &str, now_ns: i64, message: &impl Serialize) {
        let name = format!("opengpac{}", topic.replace('/', "."));
        let made = || page.channel(topic, (&name, &json!({"type": "object"})), BTreeMap::new());
        let channel = *self.channels.entry(topic.to_owned()).or_insert_with(made);
        page.put(channel, now_ns, 0, |out| out.extend_from_slice(text_of(message).as_bytes()));
    }
}

/// Times at which each alarm was raised, cleared and acknowledged, as last observed.
#[derive(Default)]
struct AlarmTimes(HashSet<(u64, i64)>);

impl AlarmTimes {
    /// Stores the times of a list. Returns the latest one that has not been observed before.
    fn newest(&mut self, alarms: &AlarmList) -> Option<i64> {
        let times = |alarm: &Alarm| [Some(alarm.time_ns), alarm.returned_ns, alarm.acknowledged_ns].map(|ns| ns.map(|ns| (alarm.number, ns)));
        let observed: HashSet<_> = alarms.current.iter().chain(&alarms.history).flat_map(times).flatten().collect();
        let newest = observed.difference(&self.0).map(|(_, ns)| *ns).max();
        self.0 = observed;
        newest
    }
}

fn without_states(installed: &InstalledInstances) -> InstalledInstances {
    let mut without = installed.clone();
    for instance in &mut without.instances {
        (instance.state, instance.stage, instance.starts) = (InstanceState::Created, 0, 0);
        instance.list.clear();
    }
    without
}

fn text_of(message: &impl Serialize) -> String {
    serde_json::to_string(message).expect("an answer of the supervisor has a JSON form")
}

#[cfg(test)]
mod tests {
    use super::*;
    use interconnect::Memory;
    use runtime::ClockKind;

    #[test]
    fn an_alarm_is_recorded_at_the_time_at_which_it_was_raised_even_if_that_is_the_time_of_the_last_record() {
        let system = System::new("cell", ClockKind::Virtual { seed: 1 }, Box::new(Memory)).unwrap();
        let text = serde_json::from_value(json!({"text": "the drive is too warm", "severity": "medium"})).unwrap();
        system.define_alarm("hot", text).unwrap();
        let (mut state, mut page) = (State::new(system.observer()), Page::default());
        system.advance(2 * SECOND_NS).unwrap();
        state.drain(&mut page, true);
        for source in ["drive", "motor"] {
            system.raise_alarm("hot", source, "").unwrap();
            system.advance(8 * SECOND_NS).unwrap();
            state.drain(&mut page, true);
        }
        system.raise_alarm("hot", "brake", "").unwrap();
        system.advance(8 * SECOND_NS).unwrap();
        state.drain(&mut page, true);
        let channel = state.channels[ALARMS];
        let times: Vec<i64> = page.entries.iter().filter(|entry| entry.channel == channel).map(|entry| entry.time_ns / SECOND_NS).collect();
        assert_eq!(times, [2, 2, 10, 18]);
    }

    #[test]
    fn of_two_alarms_that_were_raised_at_one_time_the_second_is_new() {
        let system = System::new("cell", ClockKind::Virtual { seed: 1 }, Box::new(Memory)).unwrap();
        system.define_alarm("hot", serde_json::from_value(json!({"text": "the drive is too warm"})).unwrap()).unwrap();
        for source in ["drive", "motor"] {
            system.raise_alarm("hot", source, "").unwrap();
        }
        let list = |first: usize, last: usize| {
            let mut alarms = system.alarms();
            alarms.current = alarms.current[first..last].to_vec();
            alarms
        };
        let mut times = AlarmTimes::default();
        assert_eq!(times.newest(&list(0, 1)), Some(0));
        assert_eq!(times.newest(&list(0, 2)), Some(0));
        assert_eq!(times.newest(&list(1, 2)), None, "only an alarm has gone");
    }
}
