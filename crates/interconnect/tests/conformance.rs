// SPDX-License-Identifier: Apache-2.0
//! Guarantees of every carrier of connections: in memory, by messages without faults, and by messages with each fault and with all of
//! them.
#![cfg(not(loom))]
use interconnect::conformance::{Interconnect, PERIOD_NS};
use interconnect::{Faults, Memory, Message};

interconnect::conformance!(on_each);

fn on_each(check: fn(&mut Interconnect)) {
    let none = Faults::delay(20_000, 100_000);
    let links = [
        ("no fault", Faults::none()),
        ("delay", none),
        ("long delay", Faults::delay(3 * PERIOD_NS, 4 * PERIOD_NS)),
        ("drop", Faults { drop: 0.3, ..none }),
        ("repeat", Faults { repeat: 0.5, ..none }),
        ("reorder", Faults { reorder: 0.5, ..none }),
        ("corrupt", Faults { corrupt: 0.3, ..none }),
        ("every fault", Faults::every()),
        ("every fault, often, no delay", Faults { drop: 0.3, repeat: 0.3, reorder: 0.3, corrupt: 0.3, ..Faults::none() }),
    ];
    check(&mut Interconnect::new("memory", Memory));
    for (name, faults) in links {
        for seed in 0..10 {
            check(&mut Interconnect::new(&format!("{name}, seed {seed}"), Message::new(seed, faults)));
        }
    }
}
