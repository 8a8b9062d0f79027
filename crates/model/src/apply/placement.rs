// SPDX-License-Identifier: Apache-2.0
//! Placement: the interrupt source of each block.
use super::activity::Activity;
use super::relate::Relations;
use super::{Draft, GroupBinding};
use crate::configuration::{Source, SourceKind};
use crate::interface::Mode;
use crate::quantity::duration_text;
use crate::refusal::Class;
use hints::did_you_mean;

impl<'a> Draft<'a> {
    /// Assigns a source to each block.
    pub fn place(&mut self, activity: &Activity, relations: &Relations, given: &[GroupBinding<'a>]) {
        let patterns = self.patterns();
        let channels = self.channel_sources(given);
        let processors = self.processors(given);
        for &block in &relations.order {
            let label = &self.checked.blocks[block].label;
            let wanted = patterns.iter().find(|(part, pattern, _)| fits_within(part, pattern, label)).map(|(.., source)| *source);
            let driven = relations.of[block].iter().any(|r| r.mode == Mode::Synchronous);
            let sources = if driven { self.driver_sources(block, relations) } else { Vec::new() };
            let is_active = !activity.on[block].is_empty();
            let source = match (channels[block], wanted) {
                (Some((device, source)), wanted) => self.place_at_device(block, device, source, wanted),
                (None, Some(wanted)) => Some(wanted),
                (None, None) if !sources.is_empty() => self.place_at_drivers(block, &sources),
                (None, None) => self.place_by_interval(block, activity, &processors, driven),
            };
            let Some(source) = source else { continue };
            self.blocks[block].source = source.to_owned();
            if driven && is_active {
                self.check_driven(block, source, &sources);
            }
            if !driven && is_active {
                self.check_interval(block, source, activity);
            }
        }
    }

    /// Returns the placement patterns whose sources exist, in order of precedence: the patterns of the application, the system's patterns
    /// for this verb, and the patterns for the verbs from which its parts were created. The latter apply only within their part.
    fn patterns(&mut self) -> Vec<(&'a str, &'a str, &'a str)> {
        let (application, configuration, checked) = (self.application, self.configuration, self.checked);
        let mut patterns: Vec<(&'a str, &'a str, &'a str)> = Vec::new();
        let own = application.placement.iter().map(|(pattern, source)| ("", pattern.as_str(), source.as_str()));
        let general = configuration.placement.iter().flat_map(|(pattern, source)| {
            let (first, rest) = pattern.split_once('.').unwrap_or((pattern, "*"));
            let parts = checked.parts.iter().map(|(label, part)| (label.as_str(), part.verb.as_str()));
            let verbs = std::iter::once(("", checked.name.as_str())).chain(parts);
            verbs.filter(move |(_, verb)| fits(first, verb)).map(move |(part, _)| (part, rest, source.as_str()))
        });
        for (part, pattern, source) in own.chain(general) {
            match configuration.sources.get_key_value(source) {
                Some((source, _)) => patterns.push((part, pattern, source)),
                None => {
                    let remedy = did_you_mean(source, configuration.sources.keys().map(String::as_str));
                    self.refuse(Class::UnknownName, format!("the placement of '{pattern}' names the source '{source}', which does not exist"), &remedy, &None);
                }
            }
        }
        for pattern in application.placement.keys() {
            if !self.checked.blocks.iter().any(|block| fits(pattern, &block.label)) {
                let remedy = did_you_mean(pattern, self.checked.blocks.iter().map(|b| b.label.as_str()));
                self.refuse(Class::UnknownName, format!("the placement of '{pattern}' matches no block of verb '{}'", checked.name), &remedy, &None);
            }
        }
        let owner = application.owner.as_ref().and_then(|owner| configuration.logical_devices.get(owner));
        let source = owner.and_then(|owner| configuration.sources.get_key_value(owner.source.as_ref()?));
        patterns.extend(source.map(|(source, _)| ("", "*", source.as_str())));
        patterns
    }

    /// Returns the device and source of each block that is bound to a channel.
    fn channel_sources(&mut self, given: &[GroupBinding<'a>]) -> Vec<Option<(&'a str, &'a str)>> {
        let mut sources: Vec<Option<(&'a str, &'a str)>> = vec![None; self.blocks.len()];
        let checked = self.checked;
        for (group, given) in checked.groups.iter().zip(given) {
            let GroupBinding::Channel { device, physical, .. } = given else { continue };
            for port in &group.ports {
                let other = sources[port.0].replace((*device, physical.source.as_str()));
                if let Some((first, source)) = other.filter(|(_, source)| *source != physical.source) {
                    let flat = self.flat(port.0);
                    let message = format!("'{}' has the devices '{first}' of '{source}' and '{device}' of '{}'", flat.label, physical.source);
                    self.refuse(Class::PlacementError, message, "use one block for each device", &flat.place);
                }
            }
        }
        sources
    }

    /// Returns the real-time processors of the devices on which the verb acts, or all processors if none of these devices has one.
    fn processors(&self, given: &[GroupBinding<'a>]) -> Vec<&'a str> {
        let configuration = self.configuration;
        let mut found: Vec<&'a str> = Vec::new();
        let mut add = |processor: &'a str| {
            if !found.contains(&processor) {
                found.push(processor);
            }
        };
        let of_device = |name: &str| -> Option<&'a str> {
            let source = configuration.logical_devices.get(name)?.source.as_ref()?;
            Some(configuration.sources.get(source)?.processor.as_str())
        };
        self.application.owner.iter().filter_map(|owner| of_device(owner)).for_each(&mut add);
        self.objects.iter().flatten().filter_map(|device| of_device(device)).for_each(&mut add);
        for given in given {
            match given {
                GroupBinding::Channel { physical, .. } => add(&physical.processor),
                GroupBinding::Svvs(svvs) => svvs.iter().filter_map(|(_, svv)| of_device(svv.device.as_ref()?)).for_each(&mut add),
                GroupBinding::Private => {}
            }
        }
        if found.is_empty() {
            found = configuration.processors.iter().map(String::as_str).collect();
        }
        found
    }

    fn place_at_device(&mut self, block: usize, device: &str, source: &'a str, wanted: Option<&'a str>) -> Option<&'a str> {
        if let Some(wanted) = wanted.filter(|wanted| *wanted != source) {
            let label = &self.flat(block).label;
            let message = format!("'{label}' is placed on '{wanted}', but its device '{device}' belongs to '{source}'");
            let place = self.flat(block).place.clone();
            self.refuse(Class::PlacementError, message, &format!("place '{label}' on '{source}'"), &place);
            return None;
        }
        Some(source)
    }

    /// Returns the sources of the writers that drive a block.
    fn driver_sources(&self, block: usize, relations: &Relations) -> Vec<&'a str> {
        let mut sources: Vec<&'a str> = Vec::new();
        for relation in relations.of[block].iter().filter(|r| r.mode == Mode::Synchronous) {
            let inside = self.cells[relation.cell].writers.iter().map(|writer| self.blocks[writer.0].source.as_str());
            let outside = self.external_writers(relation.cell).iter().map(|writer| writer.source.as_str());
            let none_inside = self.cells[relation.cell].writers.is_empty();
            for source in inside.chain(outside.filter(|_| none_inside)) {
                let known = self.configuration.sources.get_key_value(source).map(|(source, _)| source.as_str());
                sources.extend(known.filter(|known| !sources.contains(known)));
            }
        }
        sources
    }

    fn place_at_drivers(&mut self, block: usize, sources: &[&'a str]) -> Option<&'a str> {
        if let [source] = sources {
            return Some(source);
        }
        let message = format!("'{}' is driven from {}", self.flat(block).label, quoted(sources));
        let place = self.flat(block).place.clone();
        self.refuse(Class::PlacementError, message, "place it on a software source, or relax all but one of its inputs with modes=", &place);
        None
    }

    fn check_driven(&mut self, block: usize, source: &'a str, sources: &[&'a str]) {
        let is_software = self.source(source).is_some_and(|s| s.kind == SourceKind::Software);
        if is_software || sources.iter().all(|driver| *driver == source) {
            return;
        }
        let message = format!("'{}' is placed on '{source}', but what drives it runs on {}", self.flat(block).label, quoted(sources));
        let place = self.flat(block).place.clone();
        self.refuse(Class::SchedulingError, message, "place it there or on a software source, or relax the input with modes=", &place);
    }

    fn source(&self, name: &str) -> Option<&'a Source> {
        self.configuration.sources.get(name)
    }

    /// Returns the slowest timer whose period divides the interval; for `execute`, the timer with the lowest priority; otherwise the
    /// trigger.
    fn place_by_interval(&mut self, block: usize, activity: &Activity, processors: &[&'a str], driven: bool) -> Option<&'a str> {
        let on = &activity.on[block];
        let intervals: Vec<u64> = on.iter().filter_map(|on| on.every_ns).collect();
        let needs_trigger = !driven && intervals.len() < on.len();
        let here = |source: &(&'a String, &'a Source)| processors.contains(&source.1.processor.as_str());
        let sources: Vec<(&'a String, &'a Source)> = self.configuration.sources.iter().filter(here).collect();
        let timers = sources.iter().filter_map(|(name, source)| match source.kind {
            SourceKind::Timer { period_ns } => Some((name.as_str(), period_ns, source.priority)),
            _ => None,
        });
        let candidates: Vec<&'a str> = if needs_trigger {
            sources.iter().filter(|(_, source)| source.kind == SourceKind::Trigger).map(|(name, _)| name.as_str()).collect()
        } else if intervals.is_empty() {
            let lowest = timers.clone().map(|timer| timer.2).min();
            timers.filter(|timer| Some(timer.2) == lowest).map(|timer| timer.0).collect()
        } else {
            let dividing = timers.filter(|timer| timer.1 > 0 && intervals.iter().all(|every| every % timer.1 == 0));
            let slowest = dividing.clone().map(|timer| timer.1).max();
            dividing.filter(|timer| Some(timer.1) == slowest).map(|timer| timer.0).collect()
        };
        if let [source] = candidates[..] {
            return Some(source);
        }
        let label = &self.flat(block).label;
        let place = self.flat(block).place.clone();
        let wanted = match (needs_trigger, intervals.first()) {
            (true, _) => "a trigger".to_owned(),
            (false, Some(every)) => format!("a {} timer", duration_text(*every)),
            (false, None) => "a timer to run on".to_owned(),
        };
        if needs_trigger && candidates.is_empty() {
            let message = format!("'{label}' is activated without an interval, and no synchronous input drives it");
            self.refuse(Class::SchedulingError, message, &format!("write activate('{label}', every='1 ms'), or place it on a trigger"), &place);
        } else if candidates.is_empty() {
            let message = format!("'{label}' needs {wanted}, but there is none on {}", quoted(processors));
            self.refuse(Class::PlacementError, message, "create one, or change the interval", &place);
        } else {
            let message = format!("'{label}' needs {wanted}, but {} fit equally well", quoted(&candidates));
            self.refuse(Class::PlacementError, message, &format!("choose one with .on({{'{label}': …}}) or place()"), &place);
        }
        None
    }

    fn check_interval(&mut self, block: usize, source: &'a str, activity: &Activity) {
        let Some(found) = self.source(source) else { return };
        let label = &self.flat(block).label;
        let refused = activity.on[block].iter().find_map(|on| match (&found.kind, on.every_ns) {
            (SourceKind::Timer { period_ns }, Some(every)) if *period_ns > 0 && every % period_ns == 0 => None,
            (SourceKind::Timer { period_ns }, Some(every)) => Some((
                format!(
                    "the interval of '{label}' ({}) is not a whole multiple of the period of '{source}' ({})",
                    duration_text(every),
                    duration_text(*period_ns)
                ),
                "change the interval, or place it on another timer".to_owned(),
            )),
            (SourceKind::Timer { .. }, None) => Some((
                format!("'{label}' is activated without an interval, but its source '{source}' is a timer"),
                format!("write activate('{label}', every='1 ms'), or place it on a trigger"),
            )),
            (SourceKind::Trigger, None) | (SourceKind::Software, None) => None,
            (SourceKind::Trigger | SourceKind::Software, Some(every)) => Some((
                format!("'{label}' has the interval {}, but its source '{source}' is not a timer", duration_text(every)),
                format!("place it on a timer, or write activate('{label}')"),
            )),
        });
        if let Some((message, remedy)) = refused {
            let place = self.flat(block).place.clone();
            self.refuse(Class::SchedulingError, message, &remedy, &place);
        }
    }
}

/// Returns true if a pattern (`planner`, `pid.*`, `*`, a graph's label) matches a flat label within a part. An empty part stands for the
/// whole verb.
fn fits_within(part: &str, pattern: &str, label: &str) -> bool {
    if part.is_empty() {
        fits(pattern, label)
    } else {
        label.strip_prefix(part).and_then(|rest| rest.strip_prefix('.')).is_some_and(|rest| fits(pattern, rest))
    }
}

pub(crate) fn fits(pattern: &str, label: &str) -> bool {
    if let Some((head, tail)) = pattern.split_once('*') {
        let Some(rest) = label.strip_prefix(head) else { return false };
        return tail.is_empty() || (0..=rest.len()).any(|at| rest.is_char_boundary(at) && fits(tail, &rest[at..]));
    }
    label.strip_prefix(pattern).is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
}

fn quoted(names: &[&str]) -> String {
    let names: Vec<String> = names.iter().map(|name| format!("'{name}'")).collect();
    if names.is_empty() { "any real-time processor".into() } else { names.join(" and ") }
}
