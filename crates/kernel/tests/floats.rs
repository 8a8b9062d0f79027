// SPDX-License-Identifier: Apache-2.0
//! A block in Rust that changes floating-point control words: the kernel detects it, first at the end of the firing, then block by block.
#![allow(clippy::undocumented_unsafe_blocks, clippy::macro_metavars_in_unsafe, reason = "test blocks are written by hand against the ABI")]
#![cfg(target_arch = "x86_64")]
mod support;
use kernel::*;
use opengpac::abi::{Descriptor, mark};
use opengpac::floats::Words;
use std::hint::black_box;
use std::sync::Arc;
use support::*;

const MS: i64 = 1_000_000;

/// Rounds upward in its third invocation.
fn attack() -> &'static Descriptor {
    block!(|this, told| {
        this.y = told.number as i64;
        this.state += 1;
        if told.number == 2 {
            std::arch::asm!("ldmxcsr [{}]", in(reg) &0x5f80_u32);
        }
        0
    })
}

/// Leaves the direction flag set in its third invocation.
fn backwards() -> &'static Descriptor {
    block!(|this, told| {
        this.y = told.number as i64;
        this.state += 1;
        if told.number == 2 {
            std::arch::asm!("std", options(nomem, nostack));
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

/// Runs a firing after the attack; returns the values stored by the attacker and by the witness after it, the faults reported, and
/// whether the source stopped.
fn attacked(descriptor: &'static Descriptor) -> ([i64; 2], Vec<(BlockId, Fault)>, bool) {
    let host = virtual_host(1);
    let source = host.add_source(timer("fast", MS as u64, 80)).unwrap();
    let (cells, on, process) = (cells(2), interval(), Process::new(1, 1));
    let steps = vec![
        step(&Arc::new(install(1, descriptor, None, Some(&cells[0]))), &on, &process, &[]),
        step(&Arc::new(install(2, witness(), None, Some(&cells[1]))), &on, &process, &[]),
    ];
    host.submit(source, script(vec![Op::Table(Box::new(table(steps))), Op::On(on, 1)]));
    run_until(&host, 5 * MS);
    let told = events(&host).into_iter().filter_map(|event| match event {
        Event::Unwatched { block, fault: Some(fault), .. } | Event::Stopped { block, fault, .. } => Some((block, fault)),
        _ => None,
    });
    assert_eq!(Words::present(), Words::STANDARD, "the thread of the program has what it had");
    ([value(&cells[0]), value(&cells[1])], told.collect(), host.statistics(source).stopped)
}

#[test]
fn who_changes_the_words_is_found() {
    let marked = Box::leak(Box::new(Descriptor { reserved: mark::LOADED | mark::FLOATS, ..*attack() }));
    assert_eq!(attacked(marked), ([4, 0], vec![(BlockId(1), Fault::Floats)], false), "the loader has warned: a fault of that block");
    let (_, told, stopped) = attacked(attack());
    assert!(stopped, "nobody has warned: the source stops before anything is published");
    assert_eq!(told[0].1, Fault::Floats);
    assert_eq!(attacked(attack()), ([4, 0], vec![(BlockId(1), Fault::Floats)], false), "now everybody is looked at");
}

#[test]
fn who_leaves_the_direction_flag_set_is_found() {
    let marked = Box::leak(Box::new(Descriptor { reserved: mark::LOADED | mark::FLOATS, ..*backwards() }));
    assert_eq!(attacked(marked), ([4, 0], vec![(BlockId(1), Fault::Floats)], false), "the copies behind it go forwards");
}
