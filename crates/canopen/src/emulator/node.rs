// SPDX-License-Identifier: Apache-2.0
//! An emulated node: its states, its heartbeat, its process data.
use super::machine::Machine;
use super::objects::made;
use super::said::{NodeOptions, Out};
use super::server::Server;
use super::terminals::terminal;
use crate::frame::Frame;
use crate::nmt::{Command, NodeState, heartbeat};
use cia402::Entry;
use cia402::emulated::{MappedObject, Objects};

/// Bits of a PDO's COB-ID: flag for an unused PDO, and the identifier itself.
const UNUSED: u32 = 0x8000_0000;
const IDENTIFIER: u32 = 0x7FF;
const CONTROLLER_MISSED: u16 = 0x8130;

/// A drive or a module on the bus.
pub(super) struct Node {
    options: NodeOptions,
    state: NodeState,
    objects: Objects,
    machine: Machine,
    server: Server,
    received: [Pdo; 4],
    sent: [Pdo; 4],
    /// Times elapsed since the node's own heartbeat, since its controller's heartbeat (`None`: never received), and since its axis was
    /// last advanced.
    beaten_ns: i64,
    heard_ns: Option<i64>,
    stepped_ns: i64,
    error: u16,
    pub is_on: bool,
}

/// A PDO as configured when the node was started.
#[derive(Default)]
struct Pdo {
    /// Identifier; 0 if the PDO is unused.
    id: u16,
    is_synchronous: bool,
    mapped: Vec<MappedObject>,
    /// Received data waiting for the next SYNC.
    waiting: Option<[u8; 8]>,
}

impl Node {
    pub fn new(options: &NodeOptions) -> Node {
        let (objects, machine) = made(options);
        Node {
            options: options.clone(),
            state: NodeState::PreOperational,
            objects,
            machine,
            server: Server::default(),
            received: Default::default(),
            sent: Default::default(),
            beaten_ns: 0,
            heard_ns: None,
            stepped_ns: 0,
            error: 0,
            is_on: true,
        }
    }

    pub fn id(&self) -> u8 {
        self.options.node
    }

    pub fn state(&self) -> NodeState {
        self.state
    }

    pub fn number(&self, index: u16, sub: u8) -> i64 {
        self.objects.find(Entry { index, sub }).map_or(0, |at| self.objects.number(at))
    }

    fn bits(&self, index: u16, sub: u8) -> u32 {
        self.objects.find(Entry { index, sub }).map_or(0, |at| self.objects.bits(at))
    }

    /// Sends the boot-up message.
    pub fn boot(&mut self, out: &mut Out<'_>) {
        out.say(&heartbeat(self.id(), NodeState::BootUp));
    }

    pub fn power(&mut self, is_on: bool, out: &mut Out<'_>) {
        if is_on && !self.is_on {
            self.renew(out);
        }
        self.is_on = is_on;
    }

    fn renew(&mut self, out: &mut Out<'_>) {
        let position = self.number(0x6064, 0) as i32;
        *self = Node::new(&NodeOptions { position, ..self.options.clone() });
        self.boot(out);
    }

    pub fn is_module(&self) -> bool {
        matches!(self.machine, Machine::Module(_))
    }

    /// Returns the value of a terminal of a module, or `None` if it does not exist.
    pub fn terminal(&self, what: &str, number: u8) -> Option<i64> {
        let (of, bit) = terminal(what, number)?;
        let value = self.objects.number(self.objects.find(of).ok()?);
        Some(bit.map_or(value, |bit| value >> bit & 1))
    }

    /// Sets the value at a terminal of a module, if it exists.
    pub fn put(&mut self, what: &str, number: u8, value: i64) {
        let found = terminal(what, number).and_then(|(of, bit)| Some((self.objects.find(of).ok()?, bit)));
        if let Some((at, bit)) = found {
            let before = self.objects.number(at);
            let changed = bit.map_or(value, |bit| before & !(1 << bit) | i64::from(value != 0) << bit);
            self.objects.set_number(at, changed);
        }
    }

    /// Closes or opens the enable input of the node's drive.
    pub fn set_enable_input(&mut self, is_closed: bool) {
        self.machine.set_enable_input(is_closed);
    }

    /// Triggers a fault.
    pub fn fail(&mut self, error: u16, out: &mut Out<'_>) {
        self.machine.fail(error, &mut self.objects);
        self.complain(out);
    }

    /// Sends an emergency message if an error has occurred or been cleared since the last call.
    fn complain(&mut self, out: &mut Out<'_>) {
        let error = self.machine.error(&self.objects);
        if error != std::mem::replace(&mut self.error, error) {
            let [low, high] = error.to_le_bytes();
            out.say(&Frame::new(0x80 + u16::from(self.id()), &[low, high, u8::from(error != 0), 0, 0, 0, 0, 0]));
        }
    }

    /// Advances time: sends heartbeats, and advances an axis that has no command.
    pub fn go_on(&mut self, span_ns: i64, out: &mut Out<'_>) {
        self.stepped_ns += span_ns;
        self.beaten_ns += span_ns;
        let every_ns = i64::from(self.bits(0x1017, 0)) * 1_000_000;
        if every_ns > 0 && self.beaten_ns >= every_ns {
            self.beaten_ns = 0;
            out.say(&heartbeat(self.id(), self.state));
        }
        let consumer = self.bits(0x1016, 1);
        let most_ns = i64::from(consumer & 0xFFFF) * 1_000_000;
        self.heard_ns = self.heard_ns.map(|since| since + span_ns);
        if most_ns > 0 && self.options.watchdog != Some(false) && self.heard_ns.is_some_and(|since| since > most_ns) {
            self.heard_ns = None;
            self.machine.lose_communication(&mut self.objects);
            let [low, high] = CONTROLLER_MISSED.to_le_bytes();
            out.say(&Frame::new(0x80 + u16::from(self.id()), &[low, high, 0x11, 0, 0, 0, 0, 0]));
            self.error = self.machine.error(&self.objects);
            self.state = if self.bits(0x1029, 1) == 2 { NodeState::Stopped } else { NodeState::PreOperational };
        }
        if self.state != NodeState::Operational {
            self.step();
        }
    }

    fn step(&mut self) {
        let span_s = std::mem::take(&mut self.stepped_ns) as f64 * 1e-9;
        self.machine.step(&mut self.objects, span_s);
    }

    /// Processes a frame from the line.
    pub fn take(&mut self, frame: &Frame, out: &mut Out<'_>) {
        let own = u16::from(self.id());
        match (frame.id, frame.bytes()) {
            (0, [command, to]) if *to == 0 || u16::from(*to) == own => self.command(Command::of(*command), out),
            (0x80, _) if self.state == NodeState::Operational => self.synchronise(out),
            (id, bytes) if id == 0x600 + own && self.state != NodeState::Stopped => {
                let Ok(request) = <&[u8; 8]>::try_from(bytes) else { return };
                if let Some(answer) = self.server.answer(&mut self.objects, request) {
                    out.say(&Frame::new(0x580 + own, &answer));
                }
            }
            (id, [_]) if id & 0x780 == 0x700 && u32::from(id & 0x7F) == self.bits(0x1016, 1) >> 16 & 0x7F => self.heard_ns = Some(0),
            (id, bytes) if self.state == NodeState::Operational => self.receive(id, bytes),
            _ => {}
        }
    }

    fn command(&mut self, command: Option<Command>, out: &mut Out<'_>) {
        match command {
            Some(Command::Start) => {
                self.received = [0, 1, 2, 3].map(|number| self.configured(0x1400 + number, 0x1600 + number));
                self.sent = [0, 1, 2, 3].map(|number| self.configured(0x1800 + number, 0x1A00 + number));
                self.stepped_ns = 0;
                self.state = NodeState::Operational;
            }
            Some(Command::Stop) => self.leave(NodeState::Stopped),
            Some(Command::PreOperational) => self.leave(NodeState::PreOperational),
            Some(Command::Reset | Command::ResetCommunication) => self.renew(out),
            None => {}
        }
    }

    fn leave(&mut self, to: NodeState) {
        if self.state == NodeState::Operational {
            self.machine.lose_communication(&mut self.objects);
        }
        (self.state, self.heard_ns) = (to, None);
    }

    fn configured(&self, index: u16, mapping: u16) -> Pdo {
        let id = self.bits(index, 1);
        if id & UNUSED != 0 {
            return Pdo::default();
        }
        let words = (1..=self.bits(mapping, 0) as u8).map(|sub| self.bits(mapping, sub));
        let mapped = words.filter_map(|word| {
            let of = self.objects.find(crate::pdo::entry(word)).ok()?;
            Some(MappedObject { of, len: (word & 0xFF) as usize / 8 })
        });
        Pdo { id: (id & IDENTIFIER) as u16, is_synchronous: self.bits(index, 2) <= 240, mapped: mapped.collect(), waiting: None }
    }

    fn receive(&mut self, id: u16, bytes: &[u8]) {
        let Some(pdo) = self.received.iter_mut().find(|pdo| pdo.id == id && id != 0) else { return };
        if bytes.len() != pdo.mapped.iter().map(|mapped| mapped.len).sum::<usize>() {
            return;
        }
        let mut eight = [0; 8];
        eight[..bytes.len()].copy_from_slice(bytes);
        pdo.waiting = Some(eight);
        if !pdo.is_synchronous {
            self.apply();
        }
    }

    fn apply(&mut self) {
        for pdo in &mut self.received {
            let Some(bytes) = pdo.waiting.take() else { continue };
            let mut at = 0;
            for mapped in &pdo.mapped {
                self.objects.set_value(mapped.of, &bytes[at..at + mapped.len]);
                at += mapped.len;
            }
        }
    }

    /// Handles a SYNC: applies the received data, advances the axis, and sends its measurements.
    fn synchronise(&mut self, out: &mut Out<'_>) {
        self.apply();
        self.step();
        self.complain(out);
        for pdo in self.sent.iter().filter(|pdo| pdo.id != 0 && pdo.is_synchronous && !pdo.mapped.is_empty()) {
            let (mut eight, mut at) = ([0; 8], 0);
            for mapped in &pdo.mapped {
                eight[at..at + mapped.len].copy_from_slice(self.objects.value(mapped.of));
                at += mapped.len;
            }
            out.say(&Frame::new(pdo.id, &eight[..at]));
        }
    }
}
