// SPDX-License-Identifier: Apache-2.0
//! The kernel's benchmark rows, as JSON lines: `bench/run.py` compiles the C side, runs this program, and prints the table.
//!
//!     bench PEER.so BLOCKS.so ROUNDS [ROW…]
//!
//! Rows run the real kernel: a host with real threads, sources pinned to one core, at real-time priorities if permitted, and tables
//! installed by scripts. Peers run on the same core with the same scheduling policy and priority, alternating with the kernel.
mod bank;
mod blocks;
mod crossing;
mod dispatch;
mod fused;
mod install;
mod jitter;
mod loaded;
mod reader;
mod report;
mod rig;
mod transition;

use loaded::LoadResult;

/// Resources that a row needs.
pub struct Bench {
    pub loaded: LoadResult,
    pub rounds: usize,
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [peer, blocks, rounds, only @ ..] = arguments.as_slice() else {
        eprintln!("bench PEER.so BLOCKS.so ROUNDS [ROW…]");
        std::process::exit(2);
    };
    let bench = Bench { loaded: LoadResult::open(peer, blocks), rounds: rounds.parse().expect("ROUNDS is a number") };
    type Row = (&'static str, fn(&Bench));
    let rows: [Row; 8] = [
        ("dispatch", dispatch::rows),
        ("dispatch", bank::rows),
        ("dispatch", fused::rows),
        ("reader", reader::rows),
        ("transition", transition::rows),
        ("install", install::rows),
        ("crossing", crossing::rows),
        ("jitter", jitter::rows),
    ];
    for (name, row) in rows {
        if only.is_empty() || only.iter().any(|wanted| wanted == name) {
            row(&bench);
        }
    }
}
