// SPDX-License-Identifier: Apache-2.0
//! Groups that the reader polls for.
use crate::compare;
use crate::far::Far;
use crate::place::{core, now_ns, pin, run};
use crate::report::thousands;
use crate::wires::{Connections, PublishSubscribe, Wire, Word};

/// Number of groups in a burst; also the number in the warm-up before it, which is not counted.
const BURST: u64 = 2_000;
const WARM_UP: u64 = 200;

/// Returns the bar for a single value. A group has no bar, because it needs more than one shared cache line.
fn svv_bar(values: usize) -> Option<(f64, &'static str)> {
    (values == 1).then_some((2.0, "≤ 2 ×"))
}

/// One side of a round trip.
struct Side<W> {
    wire: W,
    far: Far,
    values: Vec<u8>,
    number: u64,
}

impl<W: Wire> Side<W> {
    fn new(wire: W, far: Far, len: usize) -> Self {
        Side { wire, far, values: vec![1; len], number: 0 }
    }

    /// Runs a burst and returns the time in one direction, ns.
    fn burst(&mut self) -> f64 {
        self.far.tell(WARM_UP + BURST);
        self.there_and_back(WARM_UP);
        let began = now_ns();
        self.there_and_back(BURST);
        (now_ns() - began) as f64 / (2 * BURST) as f64
    }

    fn there_and_back(&mut self, count: u64) {
        for _ in 0..count {
            self.number += 1;
            self.wire.send(self.number, &self.values);
            while self.wire.poll(&mut self.values) != Some(self.number) {
                std::hint::spin_loop();
            }
        }
    }
}

fn what(values: usize, to: &str) -> String {
    if values == 1 { format!("SVV (one double) to {to}, polled") } else { format!("group of {} values to {to}, polled", thousands(values)) }
}

pub fn between_threads(values: usize, rounds: usize) {
    pin(core() - 1);
    let len = values * 8;
    let (near, far) = Connections::in_memory(len);
    let mut ours = Side::new(near, Far::thread(far, len), len);
    let mut word = Side::new(Word::new("threads", 0, len, run()), Far::thread(Word::new("threads", 1, len, run()), len), len);
    let turns: Vec<_> = (0..=rounds).map(|_| (ours.burst(), word.burst())).skip(1).collect();
    compare("processes", &what(values, "another thread"), "bare word", &turns, svv_bar(values), "each copies the values in and out");
}

pub fn between_processes(values: usize, rounds: usize) {
    pin(core() - 1);
    let (len, run) = (values * 8, run());
    // The far side starts first, because a late subscriber of iceoryx2 waits for the next publication; the order is the same for all
    // peers.
    let far = |kind| Far::process(kind, len, run);
    let (ours, word, peer) = (far("connections"), far("word"), far("publish-subscribe"));
    let mut ours = Side::new(Connections::shared(0, len, run), ours, len);
    let mut word = Side::new(Word::new("processes", 0, len, run), word, len);
    let mut peer = Side::new(PublishSubscribe::new(0, len, run), peer, len);
    let turns: Vec<_> = (0..=rounds).map(|_| (ours.burst(), peer.burst(), word.burst())).skip(1).collect();
    let beside = |of: fn(&(f64, f64, f64)) -> f64| turns.iter().map(|turn| (turn.0, of(turn))).collect::<Vec<_>>();
    let what = what(values, "another process");
    compare("processes", &what, "iceoryx2", &beside(|turn| turn.1), Some((1.5, "≤ 1.5 ×")), "each copies the values in and out");
    compare("processes", &what, "bare word", &beside(|turn| turn.2), svv_bar(values), "the word is right only while each waits for the other");
}
