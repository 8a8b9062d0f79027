// SPDX-License-Identifier: Apache-2.0
//! State machine of an emulated subdevice: Init, PreOp, SafeOp and Op, and the conditions of each transition.
use super::{Application, DRIVE_INPUTS, DRIVE_OUTPUTS, INPUTS, MAILBOXES, OUTPUTS, Subdevice};
use crate::emulator::controller::Wiring;
use crate::emulator::sdo::{MAILBOX_LEN, SdoServer};
use crate::registers as reg;
use crate::states::{ERROR, State};
use cia402::emulated::MappedObject;

/// AL status codes.
const INVALID_CHANGE: u16 = 0x0011;
const UNKNOWN_STATE: u16 = 0x0012;
const NO_BOOT: u16 = 0x0013;
const MAILBOX_WRONG: u16 = 0x0016;
const OUTPUTS_WRONG: u16 = 0x001D;
const INPUTS_WRONG: u16 = 0x001E;
const NO_SYNC: u16 = 0x002D;
const SYNC_WRONG: u16 = 0x0030;

impl Subdevice {
    pub(super) fn change_state(&mut self, now_ns: u64) {
        let control = self.controller.word(reg::AL_CONTROL);
        let has_error = self.controller.word(reg::AL_STATUS) & ERROR != 0;
        let Some(to) = State::of(control) else { return self.set_state(self.state, UNKNOWN_STATE) };
        if has_error && control & ERROR == 0 && to > State::Init {
            return;
        }
        let from = self.state;
        let goes = to <= from || matches!((from, to), (State::Init, State::PreOp) | (State::PreOp, State::SafeOp) | (State::SafeOp, State::Op));
        let wrong = match to {
            State::Boot => NO_BOOT,
            _ if !goes => INVALID_CHANGE,
            State::PreOp if from == State::Init => self.check_mailbox(),
            State::SafeOp if from == State::PreOp => self.check_process_data(),
            // SYNC0 has no cycle, or its start was in the past.
            State::Op if self.controller.is_synchronised() && self.controller.clock.next_sync_ns().is_none() => NO_SYNC,
            _ => 0,
        };
        if wrong != 0 {
            return self.set_state(from, wrong);
        }
        if to == State::Init {
            // The mailbox restarts: the counters of an earlier client are obsolete.
            self.sdo = SdoServer::new();
        }
        if from == State::Op && to < State::Op {
            self.lose_communication();
        }
        self.written_ns = now_ns;
        self.set_state(to, 0);
        self.give_inputs();
    }

    fn check_mailbox(&self) -> u16 {
        if !self.controller.wiring().has_mailbox {
            return 0;
        }
        let is_right = |manager: usize| self.controller.area(manager) == (MAILBOXES[manager].into(), MAILBOX_LEN) && self.controller.is_active(manager);
        if is_right(0) && is_right(1) { 0 } else { MAILBOX_WRONG }
    }

    fn check_process_data(&mut self) -> u16 {
        let is_without_cycle = self.controller.word(reg::SYNC0_CYCLE) == 0 && self.controller.word(reg::SYNC0_CYCLE + 2) == 0;
        if self.controller.is_synchronised() && is_without_cycle {
            return SYNC_WRONG;
        }
        if let Application::Terminal(terminal) = &self.application {
            let Wiring { outputs, inputs, .. } = self.controller.wiring();
            let len = |managers: &[usize]| managers.iter().filter(|of| self.controller.is_active(**of)).map(|of| self.controller.area(*of).1).sum::<usize>();
            return match (len(outputs) == terminal.outputs_len(), len(inputs) == terminal.inputs().len()) {
                (true, true) => 0,
                (false, _) => OUTPUTS_WRONG,
                _ => INPUTS_WRONG,
            };
        }
        let (Some(outputs), Some(inputs)) = (self.objects.mapping(0x1C12), self.objects.mapping(0x1C13)) else { return OUTPUTS_WRONG };
        (self.outputs, self.inputs) = (outputs, inputs);
        let is_right = |manager: usize, start: u16, of: &[MappedObject]| {
            let len: usize = of.iter().map(|mapped| mapped.len).sum();
            len == 0 || self.controller.area(manager) == (start.into(), len) && self.controller.is_active(manager)
        };
        match (is_right(DRIVE_OUTPUTS, OUTPUTS, &self.outputs), is_right(DRIVE_INPUTS, INPUTS, &self.inputs)) {
            (true, true) => 0,
            (false, _) => OUTPUTS_WRONG,
            _ => INPUTS_WRONG,
        }
    }
}
