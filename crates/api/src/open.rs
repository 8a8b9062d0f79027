// SPDX-License-Identifier: Apache-2.0
//! Creation of a system with its clock and its interconnect.
use crate::from_json;
use interconnect::{Carrier, Faults, Memory, Message};
use model::refusal::{Class, Refusal, Refusals};
use places::{Commands, Places};
use runtime::ClockKind;
use serde::Deserialize;
use std::sync::Arc;
use supervisor::System;

#[derive(Deserialize)]
#[serde(default)]
struct Options {
    seed: u64,
    interconnect: Interconnect,
    processes: Option<Processes>,
    /// True to search for processes that lost a system with this name.
    adopt: bool,
}

/// Command lines for starting processes.
#[derive(Deserialize)]
struct Processes {
    /// Command line of a program that calls `places::processor`.
    command: Vec<String>,
    /// Command line of a program that calls `guard::run`.
    guard: Vec<String>,
    /// Command line of a program that calls `replay::serve`.
    #[serde(default)]
    replay: Vec<String>,
    /// Interpreter that tests code modules.
    python: String,
}

impl Default for Options {
    fn default() -> Self {
        Options { seed: 1, interconnect: Interconnect::Memory, processes: None, adopt: false }
    }
}

#[derive(Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
enum Interconnect {
    Memory,
    Message {
        #[serde(default)]
        seed: u64,
        #[serde(default)]
        delay_ns: (i64, i64),
        #[serde(default)]
        drop: f64,
        #[serde(default)]
        repeat: f64,
        #[serde(default)]
        reorder: f64,
        #[serde(default)]
        corrupt: f64,
    },
}

/// Opens a real-time system in this process. `clock` is `monotonic` or `virtual`. `options` is `{"seed": n, "interconnect": {"kind":
/// "memory"}}`, where the interconnect may also be `message`, with `seed`, `delay_ns`, `drop`, `repeat`, `reorder` and `corrupt`, under
/// the virtual clock. `"processes": {"command": [...], "python": "..."}` sets the commands for processors in separate processes. With
/// `"adopt": true`, this first searches for processes that lost a system with this name, and `take_over` then continues everything that
/// runs in them.
pub fn open(name: &str, clock: &str, options: &str) -> Result<System, Refusals> {
    let options: Options = from_json(options)?;
    let refuse = |message: String, remedy: &str| Err(vec![Refusal::new(Class::DefinitionError, message).remedy(remedy)]);
    let kind = match clock {
        "monotonic" => ClockKind::Monotonic,
        "virtual" => ClockKind::Virtual { seed: options.seed },
        other => return refuse(format!("there is no clock '{other}'"), "use \"monotonic\" or \"virtual\""),
    };
    if kind == ClockKind::Monotonic && matches!(options.interconnect, Interconnect::Message { .. }) {
        return refuse("the message interconnect needs the virtual clock".to_owned(), "use clock=\"virtual\"");
    }
    let system = System::new(name, kind, carrier(options.interconnect)?)?;
    if let Some(Processes { command, guard, replay, python }) = options.processes {
        let words = |command: Vec<String>| command.into_iter().map(Into::into).collect();
        let commands = Commands { processor: words(command), guard: words(guard), replay: words(replay), python: python.into() };
        system.set_places(Arc::new(Places::new(name, commands, options.adopt)));
    }
    Ok(system)
}

fn carrier(of: Interconnect) -> Result<Box<dyn Carrier>, Refusals> {
    Ok(match of {
        Interconnect::Memory => Box::new(Memory),
        Interconnect::Message { seed, delay_ns, drop, repeat, reorder, corrupt } => {
            let refuse = |message: String, remedy: &str| Err(vec![Refusal::new(Class::ValueRefused, message).remedy(remedy)]);
            for (name, share) in [("drop", drop), ("repeat", repeat), ("reorder", reorder), ("corrupt", corrupt)] {
                if !(0.0..=1.0).contains(&share) {
                    return refuse(format!("the message interconnect cannot have {name}={share}"), "give the share of packets, 0 to 1");
                }
            }
            if delay_ns.0 < 0 || delay_ns.0 > delay_ns.1 || delay_ns.1 > DELAY_NS_MAX {
                let message = format!("the message interconnect cannot have delay_ns=({}, {})", delay_ns.0, delay_ns.1);
                return refuse(message, "give the minimum and the maximum delay in ns: 0 or more, the minimum first, at most one hour");
            }
            let faults = Faults { drop, repeat, reorder, corrupt, ..Faults::delay(delay_ns.0, delay_ns.1) };
            Box::new(Message::new(seed, faults))
        }
    })
}

/// Maximum delay: one hour, longer than any test observes.
const DELAY_NS_MAX: i64 = 3_600_000_000_000;
