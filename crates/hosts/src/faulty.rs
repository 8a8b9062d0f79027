// SPDX-License-Identifier: Apache-2.0
//! A test wire that drops, repeats, reorders and corrupts packets, as chosen by a seed. It wraps any other wire, between the protocol and
//! zenoh. (On a byte stream such faults end the session, so they never appear above it.)
use crate::network::{Arrival, Network, NetworkError, Outlet, Subscription, Urgency};
use std::collections::VecDeque;
use std::sync::{Arc, Mutex, PoisonError};

/// Faults of a wire. Probabilities range from 0 to 1 and apply to each packet.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct WireFaults {
    /// Probability that a packet is lost.
    pub drop: f64,
    /// Probability that a packet arrives twice.
    pub repeat: f64,
    /// Probability that a packet is held back until one to eight others have been sent.
    pub reorder: f64,
    /// Probability that one to three bits of a packet are flipped.
    pub corrupt: f64,
}

impl WireFaults {
    /// Returns faults of every kind: one packet in ten is lost, repeated, held back or corrupted.
    pub fn every() -> Self {
        WireFaults { drop: 0.1, repeat: 0.1, reorder: 0.1, corrupt: 0.1 }
    }

    /// Returns the faults of a cut cable: every packet is lost.
    pub fn cut() -> Self {
        WireFaults { drop: 1.0, ..WireFaults::default() }
    }
}

/// A wire with faults. Clones share the same wire.
#[derive(Clone)]
pub struct Faulty {
    wire: Arc<dyn Network>,
    state: Arc<Mutex<State>>,
}

struct State {
    faults: WireFaults,
    random: u64,
}

impl Faulty {
    /// Adds faults, chosen by `seed`, to the packets sent over `wire`.
    pub fn new(wire: Arc<dyn Network>, seed: u64, faults: WireFaults) -> Self {
        Faulty { wire, state: Arc::new(Mutex::new(State { faults, random: seed })) }
    }

    /// Changes the faults.
    pub fn set(&self, faults: WireFaults) {
        self.state.lock().unwrap_or_else(PoisonError::into_inner).faults = faults;
    }
}

impl Network for Faulty {
    fn outlet(&self, key: &str, urgency: Urgency) -> Result<Box<dyn Outlet>, NetworkError> {
        let outlet = self.wire.outlet(key, urgency)?;
        Ok(Box::new(FaultyOutlet { outlet, state: self.state.clone(), held: Mutex::default() }))
    }

    fn subscribe(&self, key: &str, came: Arrival) -> Result<Subscription, NetworkError> {
        self.wire.subscribe(key, came)
    }

    fn answered(&self) {
        self.wire.answered();
    }
}

struct FaultyOutlet {
    outlet: Box<dyn Outlet>,
    state: Arc<Mutex<State>>,
    /// Packets that are held back, each with the number of packets to send before it.
    held: Mutex<VecDeque<(u64, Vec<u8>)>>,
}

impl Outlet for FaultyOutlet {
    fn send(&self, packet: Vec<u8>) {
        let leaving = {
            let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
            let mut held = self.held.lock().unwrap_or_else(PoisonError::into_inner);
            let mut leaving = Vec::new();
            for (others, _) in held.iter_mut() {
                *others = others.saturating_sub(1);
            }
            state.fate(packet, &mut leaving, &mut held);
            while let Some(free) = held.iter().position(|(others, _)| *others == 0) {
                leaving.extend(held.remove(free).map(|(_, packet)| packet));
            }
            leaving
        };
        leaving.into_iter().for_each(|packet| self.outlet.send(packet));
    }
}

impl State {
    fn fate(&mut self, mut packet: Vec<u8>, leaving: &mut Vec<Vec<u8>>, held: &mut VecDeque<(u64, Vec<u8>)>) {
        let WireFaults { drop, repeat, reorder, corrupt } = self.faults;
        if self.chance(drop) {
            return;
        }
        if self.chance(repeat) {
            leaving.push(packet.clone());
        }
        if self.chance(corrupt) && !packet.is_empty() {
            let (bits, first) = (packet.len() as u64 * 8, self.next());
            for step in 0..=self.next() % 3 {
                let bit = (first % bits + step * 13) % bits;
                packet[(bit / 8) as usize] ^= 1 << (bit % 8);
            }
        }
        if self.chance(reorder) {
            held.push_back((1 + self.next() % 8, packet));
        } else {
            leaving.push(packet);
        }
    }

    fn chance(&mut self, probability: f64) -> bool {
        // A double has 53 bits.
        ((self.next() >> 11) as f64) < probability * (1u64 << 53) as f64
    }

    /// Returns the next SplitMix64 number (Steele, Lea, Flood 2014).
    fn next(&mut self) -> u64 {
        self.random = self.random.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.random ^ (self.random >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }
}
