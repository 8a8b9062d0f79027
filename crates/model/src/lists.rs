// SPDX-License-Identifier: Apache-2.0
//! Command lists of a definition, with resolved names, split into stages at the waits.
use crate::definition::{Command, CommandList, Verb};
use crate::flatten::{Flat, ItemTarget, Port, labelled};
use crate::interface::Kind;
use crate::plan::Wait;
use crate::refusal::{Class, SourceLocation, Where};
use hints::did_you_mean;
use std::ops::Range;

/// A command whose label has been resolved to blocks.
#[derive(Clone, Debug, PartialEq)]
pub enum CheckedCommand {
    Install(Vec<Range<usize>>),
    Execute {
        label: String,
        blocks: Range<usize>,
    },
    Activate {
        label: String,
        blocks: Range<usize>,
        every_ns: Option<u64>,
        /// True if the interval may be changed while the verb is running.
        tunable: bool,
        budget_ns: Option<u64>,
        /// Product of the `divide` values of the graphs that enclose the label, to which the blocks' own `divide` is relative.
        divide: u32,
    },
    Deactivate(Range<usize>),
    Ready,
}

/// Section of a command list, up to the next wait or the end of the list.
#[derive(Clone, Debug, PartialEq)]
pub struct CheckedStage {
    pub commands: Vec<CheckedCommand>,
    pub wait: Option<Wait>,
}

/// A command list split into stages.
#[derive(Clone, Debug, PartialEq)]
pub struct CheckedList {
    pub name: String,
    pub stages: Vec<CheckedStage>,
    pub place: Option<SourceLocation>,
}

/// Resolves all lists.
pub fn check_lists(flat: &mut Flat<'_>, verb: &Verb) -> Vec<CheckedList> {
    verb.command_lists.iter().map(|(name, list)| check_list(flat, verb, name, list)).collect()
}

fn check_list(flat: &mut Flat<'_>, verb: &Verb, name: &str, list: &CommandList) -> CheckedList {
    let place = if list.place.is_some() { &list.place } else { &verb.place };
    let mut stages = vec![CheckedStage { commands: Vec::new(), wait: None }];
    for (at, command) in list.commands.iter().enumerate() {
        flat.subject = Some(Where::Command { list: name.to_owned(), command: at });
        let what = format!("command list '{name}'");
        let checked = match command {
            Command::Install { blocks } => {
                Some(CheckedCommand::Install(blocks.iter().filter_map(|b| labelled(flat, b, &what, place)).map(|found| found.0).collect()))
            }
            Command::Execute { block } => labelled(flat, block, &what, place).map(|(blocks, _)| CheckedCommand::Execute { label: block.clone(), blocks }),
            Command::Activate { block, every_ns, tunable, budget_ns } => {
                if *every_ns == Some(0) {
                    flat.refuse(
                        Class::SchedulingError,
                        format!("{what} activates '{block}' with an interval of 0"),
                        place,
                        "give a positive interval, for example every='1 ms'",
                    );
                }
                labelled(flat, block, &what, place).map(|(blocks, divide)| CheckedCommand::Activate {
                    label: block.clone(),
                    blocks,
                    every_ns: *every_ns,
                    tunable: *tunable,
                    budget_ns: *budget_ns,
                    divide,
                })
            }
            Command::Deactivate { block } => labelled(flat, block, &what, place).map(|found| CheckedCommand::Deactivate(found.0)),
            Command::Ready => Some(CheckedCommand::Ready),
            Command::Wait { conditions, time_ns } => {
                let wait = wait(flat, verb, &what, conditions, *time_ns, place);
                stages.last_mut().expect("there is one from the start").wait = Some(wait);
                stages.push(CheckedStage { commands: Vec::new(), wait: None });
                None
            }
        };
        stages.last_mut().expect("there is one from the start").commands.extend(checked);
    }
    flat.subject = None;
    CheckedList { name: name.to_owned(), stages, place: place.clone() }
}

fn wait(flat: &mut Flat<'_>, verb: &Verb, what: &str, conditions: &[String], time_ns: Option<i64>, place: &Option<SourceLocation>) -> Wait {
    let Some(time_ns) = time_ns else {
        let mut ports = Vec::new();
        for condition in conditions {
            wait_for(flat, verb, what, condition, place, &mut ports);
        }
        return if conditions.is_empty() { Wait::Idle } else { Wait::Conditions(ports) };
    };
    if !conditions.is_empty() {
        flat.refuse(Class::DefinitionError, format!("a wait of {what} has both conditions and a time"), place, "wait for one or the other");
    } else if time_ns < 0 {
        flat.refuse(Class::DefinitionError, format!("a wait of {what} cannot be {time_ns} ns long"), place, "give a time of 0 or more");
    }
    Wait::Time(time_ns)
}

/// Adds the ports of a wait for `label.item`, or for a termination condition, which stands for its block conditions.
fn wait_for(flat: &mut Flat<'_>, verb: &Verb, what: &str, name: &str, place: &Option<SourceLocation>, ports: &mut Vec<Port>) {
    if let Some(termination) = verb.conditions.get(name) {
        if termination.on.is_empty() {
            flat.refuse(
                Class::DefinitionError,
                format!("a wait of {what} names '{name}', which is a system condition"),
                place,
                "wait for conditions of blocks",
            );
        }
        for on in &termination.on {
            ports.extend(condition_port(flat, on, place, false));
        }
    } else if name.contains('.') {
        ports.extend(condition_port(flat, name, place, true));
    } else {
        let remedy = did_you_mean(name, verb.conditions.keys().map(String::as_str));
        flat.refuse(Class::UnknownName, format!("a wait of {what} names the condition '{name}', which does not exist"), place, &remedy);
    }
}

/// Returns the condition that `label.item` denotes; if `report` is true, refuses any other name.
pub fn condition_port(flat: &mut Flat<'_>, name: &str, place: &Option<SourceLocation>, report: bool) -> Option<Port> {
    let refusals = flat.refusals.len();
    let found = match flat.resolve("", name, place) {
        Some(ItemTarget::Item(port)) => Some(port),
        _ => None,
    };
    match found {
        Some(port) if flat.item_kind(port) == Kind::Condition => return Some(port),
        Some(port) => {
            let interface = flat.blocks[port.0].kind.interface.clone();
            let conditions = interface.items.iter().filter(|item| item.kind == Kind::Condition);
            let remedy = did_you_mean(&interface.items[port.1].name, conditions.map(|item| item.name.as_str()));
            let described = flat.described(port);
            flat.refuse(Class::UnknownName, format!("'{name}' is not a condition: it is {described}"), place, &remedy);
        }
        None => {}
    }
    if !report {
        flat.refusals.truncate(refusals);
    }
    None
}

/// Returns the list with which a start begins: the declared one, or else the only list that is not an ending list.
pub fn initial(flat: &mut Flat<'_>, verb: &Verb) -> usize {
    let names = || verb.command_lists.keys().map(String::as_str);
    let mut begins = verb.command_lists.keys().enumerate().filter(|(_, name)| verb.ending.as_ref() != Some(name));
    match &verb.initial {
        Some(name) => verb.command_lists.get_index_of(name).unwrap_or_else(|| {
            let remedy = did_you_mean(name, names());
            flat.refuse(Class::UnknownName, format!("the initial command list '{name}' of verb '{}' does not exist", verb.name), &verb.place, &remedy);
            0
        }),
        None if begins.clone().count() == 1 => begins.next().map_or(0, |(at, _)| at),
        None if verb.command_lists.is_empty() => {
            flat.refuse(
                Class::DefinitionError,
                format!("verb '{}' has no command list", verb.name),
                &verb.place,
                "give one, for example {'start': [activate('block')]}",
            );
            0
        }
        None => {
            let names: Vec<&str> = names().collect();
            let message = format!("verb '{}' has {} command lists but no initial one", verb.name, names.len());
            flat.refuse(Class::DefinitionError, message, &verb.place, &format!("set initial= to one of {}", names.join(", ")));
            0
        }
    }
}

/// Checks that intervals and `execute` are used only for blocks without synchronous inputs, because all others run only when a new value
/// arrives. `drivers` contains the first synchronous input of each block.
pub fn check_scheduled(flat: &mut Flat<'_>, lists: &[CheckedList], drivers: &[Option<usize>]) {
    for list in lists {
        flat.subject = Some(Where::List { list: list.name.clone() });
        for command in list.stages.iter().flat_map(|stage| &stage.commands) {
            let (CheckedCommand::Activate { blocks, .. } | CheckedCommand::Execute { blocks, .. }) = command else { continue };
            let Some(first) = blocks.clone().next().filter(|_| blocks.clone().all(|block| drivers[block].is_some())) else { continue };
            let (message, remedy) = match command {
                CheckedCommand::Activate { label, every_ns: Some(_), .. } => (
                    format!("command list '{}' gives '{label}' an execution interval, but a synchronous input drives it", list.name),
                    format!("write activate('{label}'), or relax what drives it with {}", crate::cycles::modes_of_all(&flat.blocks[first])),
                ),
                CheckedCommand::Execute { label, .. } => {
                    let port = (first, drivers[first].expect("it was looked for above"));
                    (
                        format!(
                            "command list '{}' executes '{label}', but {} is synchronous: an execution brings it no new value",
                            list.name,
                            flat.described(port)
                        ),
                        format!(
                            "put it into a graph with the block that writes that input and execute the graph, or relax the input with modes={{'{}': 'asynchronous'}}",
                            flat.port_name(port)
                        ),
                    )
                }
                _ => continue,
            };
            flat.refuse(Class::SchedulingError, message, &list.place, &remedy);
        }
    }
    flat.subject = None;
}
