// SPDX-License-Identifier: Apache-2.0
//! Guarantees of every carrier of connections, with both ends in this process, and with the writing ends in another.
mod processes;

use interconnect::conformance::{Interconnect, JoinedCarrier};
use processes::far_ends::FarEnds;
use shared_memory::{SharedMemory, new_run};

interconnect::conformance!(on_each);

fn on_each(check: fn(&mut Interconnect)) {
    let enter = |run| SharedMemory::new("conformance", run).expect("there is shared memory");
    let run = new_run();
    check(&mut Interconnect::new("one process", JoinedCarrier::new(enter(run), enter(run))));
    let run = new_run();
    check(&mut Interconnect::new("two processes", JoinedCarrier::new(FarEnds::start("conformance", run), enter(run))));
}
