// SPDX-License-Identifier: Apache-2.0
//! Servos at the other end of a pseudo terminal, emulated by a thread that stores their registers. With torque on, a goal is reached
//! immediately.
use super::codecs::answer;
use crate::serial::tests::pty;
use crate::servos::frame::BROADCAST;
use crate::servos::protocol::Protocol;
use crate::servos::registers::{Map, Register, whole};
use std::collections::BTreeMap;
use std::fs::{File, OpenOptions};
use std::io::{Read, Write};
use std::os::unix::fs::OpenOptionsExt;
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;

type Tables = Arc<Mutex<BTreeMap<u8, Vec<u8>>>>;

pub(super) struct Peer {
    pub(super) path: String,
    pub(super) protocol: Protocol,
    tables: Tables,
    /// Keeps the line open between two users.
    held: Option<File>,
    thread: Option<JoinHandle<()>>,
}

impl Peer {
    /// Returns servos 1 and 2 in their middle positions.
    pub(super) fn new(protocol: Protocol) -> Peer {
        Peer::with(protocol, false)
    }

    /// Returns the same servos on an adapter that echoes sent bytes.
    pub(super) fn echoing(protocol: Protocol) -> Peer {
        Peer::with(protocol, true)
    }

    fn with(protocol: Protocol, echoes: bool) -> Peer {
        let (device, path) = pty();
        let held = OpenOptions::new().read(true).write(true).custom_flags(libc::O_NOCTTY).open(&path).expect("it opens");
        let map = Map::of(protocol);
        let number: &[u8] = if protocol == Protocol::Sts { &[9, 3] } else { &[0xb0, 4] };
        let mut table = vec![0; 256];
        for (register, value) in [(map.model, number), (map.answers, &[2]), (map.mode, &[map.modes[0] as u8]), (position(protocol), &[0, 8])] {
            table[usize::from(register.address)..][..value.len()].copy_from_slice(value);
        }
        let tables: Tables = Arc::new(Mutex::new([(1, table.clone()), (2, table)].into()));
        let thread = std::thread::spawn({
            let tables = tables.clone();
            move || serve(protocol, echoes, device, &tables)
        });
        Peer { path, protocol, tables, held: Some(held), thread: Some(thread) }
    }

    pub(super) fn get(&self, id: u8, register: Register) -> u32 {
        let tables = self.tables.lock().expect("nobody panics with it");
        whole(&tables[&id][usize::from(register.address)..][..usize::from(register.len)])
    }

    pub(super) fn set(&self, id: u8, register: Register, value: u32) {
        let mut tables = self.tables.lock().expect("nobody panics with it");
        let table = tables.get_mut(&id).expect("there is such a servo");
        table[usize::from(register.address)..][..usize::from(register.len)].copy_from_slice(&value.to_le_bytes()[..usize::from(register.len)]);
    }

    /// Silences the servo with this ID.
    pub(super) fn lose(&self, id: u8) {
        self.tables.lock().expect("nobody panics with it").remove(&id);
    }

    pub(super) fn position(&self, id: u8) -> u32 {
        self.get(id, position(self.protocol))
    }

    pub(super) fn torque(&self, id: u8) -> u32 {
        self.get(id, Map::of(self.protocol).torque)
    }

    /// Stops the thread after the line has been closed everywhere else.
    pub(super) fn join(mut self) {
        self.held = None;
        self.thread.take().expect("it is joined once").join().expect("it understood everything");
    }
}

fn position(protocol: Protocol) -> Register {
    Register { address: if protocol == Protocol::Sts { 56 } else { 132 }, len: if protocol == Protocol::Sts { 2 } else { 4 } }
}

fn serve(protocol: Protocol, echoes: bool, mut device: File, tables: &Tables) {
    let (before, head) = if protocol == Protocol::Sts { (4, 2) } else { (7, 4) };
    let mut frame = vec![0; before];
    while device.read_exact(&mut frame).is_ok() {
        let rest = if protocol == Protocol::Sts { usize::from(frame[3]) } else { usize::from(frame[5]) };
        frame.resize(before + rest, 0);
        device.read_exact(&mut frame[before..]).expect("a frame comes whole");
        let sum = if protocol == Protocol::Sts { 1 } else { 2 };
        let body = &frame[before + 1..before + rest - sum];
        let mut said = said(protocol, frame[head], frame[before], body, &mut tables.lock().expect("nobody panics with it"));
        if echoes {
            said.splice(0..0, frame.iter().copied());
        }
        if device.write_all(&said).is_err() {
            return;
        }
        frame.resize(before, 0);
    }
}

fn said(protocol: Protocol, id: u8, word: u8, body: &[u8], tables: &mut BTreeMap<u8, Vec<u8>>) -> Vec<u8> {
    let wide = if protocol == Protocol::Sts { 1 } else { 2 };
    let number = |at: usize| body.get(at * wide..(at + 1) * wide).map_or(0, |bytes| whole(bytes) as usize);
    let (address, len) = (number(0), number(1));
    let read = |table: &Vec<u8>| table[address..address + len].to_vec();
    match (word, id) {
        (0x82, _) => body[2 * wide..].iter().filter_map(|id| tables.get(id).map(|table| answer(protocol, *id, 0, &read(table)))).collect::<Vec<_>>().concat(),
        (0x83, _) => {
            for row in body[2 * wide..].chunks(len + 1) {
                tables.get_mut(&row[0]).into_iter().for_each(|table| store(protocol, table, address, &row[1..]));
            }
            Vec::new()
        }
        (_, BROADCAST) => Vec::new(),
        (word, id) => tables.get_mut(&id).map_or_else(Vec::new, |table| match word {
            1 if protocol == Protocol::Dynamixel => answer(protocol, id, 0, &[table[0], table[1], 46]),
            2 => answer(protocol, id, 0, &read(table)),
            3 => {
                store(protocol, table, address, &body[wide..]);
                answer(protocol, id, 0, &[])
            }
            8 => {
                store(protocol, table, usize::from(Map::of(protocol).error.address), &[0]);
                answer(protocol, id, 0, &[])
            }
            _ => answer(protocol, id, 0, &[]),
        }),
    }
}

fn store(protocol: Protocol, table: &mut [u8], address: usize, bytes: &[u8]) {
    table[address..address + bytes.len()].copy_from_slice(bytes);
    let (map, position) = (Map::of(protocol), position(protocol));
    if table[usize::from(map.torque.address)] == 1 {
        let goal = usize::from(map.goal.address);
        table.copy_within(goal..goal + usize::from(map.goal.len), usize::from(position.address));
    }
}
