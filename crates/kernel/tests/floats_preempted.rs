// SPDX-License-Identifier: Apache-2.0
//! A block changes floating-point control words and is preempted: the preempting source computes as always, and the change is still
//! detected.
#![allow(clippy::undocumented_unsafe_blocks, clippy::macro_metavars_in_unsafe, reason = "test blocks are written by hand against the ABI")]
#![cfg(target_arch = "x86_64")]
mod support;
use kernel::*;
use opengpac::abi::Descriptor;
use std::hint::black_box;
use std::sync::Arc;
use support::*;

const MS: u64 = 1_000_000;

/// Rounds upward in its third invocation.
fn attack() -> &'static Descriptor {
    block!(|_, told| {
        if told.number == 2 {
            std::arch::asm!("ldmxcsr [{}]", in(reg) &0x5f80_u32);
        }
        0
    })
}

/// Returns a block that counts results that differ from 0.1.
fn witness() -> &'static Descriptor {
    block!(|this, _| {
        this.state += i64::from(black_box(1.0) / black_box(10.0) != 0.1);
        this.y = this.state;
        0
    })
}

#[test]
fn a_change_is_found_behind_a_preemption() {
    let host = virtual_host(1);
    let fast = host.add_source(timer("fast", MS, 80)).unwrap();
    let slow = host.add_source(SourceSpec { virtual_cost_ns: 9 * MS, ..timer("slow", 10 * MS, 50) }).unwrap();
    let (cells, process, other) = (cells(1), Process::new(1, 1), Process::new(2, 1));
    let (quick, on) = (interval(), interval());
    host.submit(
        fast,
        script(vec![Op::Table(Box::new(table(vec![step(&Arc::new(install(1, witness(), None, Some(&cells[0]))), &quick, &other, &[])]))), Op::On(quick, 1)]),
    );
    // Enough attacks that the firing is preempted during one of them, however rare preemption is.
    let attacker = step(&Arc::new(install(2, attack(), None, None)), &on, &process, &[]);
    let behind = (0..2000).map(|n| step(&Arc::new(install(3 + n, witness(), None, None)), &on, &process, &[]));
    let steps = [attacker].into_iter().chain(behind).collect();
    host.submit(slow, script(vec![Op::Table(Box::new(table(steps))), Op::On(on, 1)]));
    run_until(&host, 50 * MS as i64);
    assert!(host.statistics(slow).stopped);
    assert!(events(&host).iter().any(|event| matches!(event, Event::Stopped { fault: Fault::Floats, .. })));
    assert_eq!((value(&cells[0]), host.statistics(fast).stopped), (0, false), "who preempts computes as always");
}
