// SPDX-License-Identifier: Apache-2.0
//! Reading end of a connection whose reader is traced: its values are recorded, or read from the record.
use crate::trace::tape::{Ask, SourceTape};
use interconnect::{ConnectionSpec, Header, Receiver};
use std::sync::Arc;

/// A reading end with the tape of its source.
pub(crate) struct TapedReceiver {
    /// Underlying reading end; `None` if all values come from the record.
    inner: Option<Box<dyn Receiver>>,
    tape: Arc<SourceTape>,
    group: Vec<u8>,
    row: Vec<u8>,
    /// Row that was peeked at; peeking again returns the same row.
    held: Option<u64>,
}

impl TapedReceiver {
    pub(crate) fn recording(inner: Box<dyn Receiver>, tape: Arc<SourceTape>) -> TapedReceiver {
        TapedReceiver { inner: Some(inner), tape, group: Vec::new(), row: Vec::new(), held: None }
    }

    pub(crate) fn playing(spec: &ConnectionSpec, tape: Arc<SourceTape>) -> TapedReceiver {
        TapedReceiver { inner: None, tape, group: vec![0; spec.asynchronous_len], row: vec![0; spec.queue_row_len], held: None }
    }
}

impl Receiver for TapedReceiver {
    fn latch(&mut self, now_ns: i64) -> Option<Header> {
        let Some(inner) = &mut self.inner else {
            if self.tape.one_of(&[Ask::NoGroup, Ask::Group])? != Ask::Group {
                return None;
            }
            let header = Header { number: self.tape.take_word(), time_ns: self.tape.take_word().cast_signed() };
            self.tape.take(&mut self.group);
            return Some(header);
        };
        let header = inner.latch(now_ns);
        match &header {
            None => self.tape.put(Ask::NoGroup, &[], &[]),
            Some(header) => self.tape.put(Ask::Group, &[header.number, header.time_ns.cast_unsigned()], inner.group()),
        }
        header
    }

    fn group(&self) -> &[u8] {
        self.inner.as_ref().map_or(&self.group, |inner| inner.group())
    }

    fn peek_row(&mut self) -> Option<(u64, &[u8])> {
        let Some(inner) = &mut self.inner else {
            if self.held.is_none() {
                if self.tape.one_of(&[Ask::NoRow, Ask::Row])? != Ask::Row {
                    return None;
                }
                self.held = Some(self.tape.take_word());
                self.tape.take(&mut self.row);
            }
            return self.held.map(|number| (number, self.row.as_slice()));
        };
        let row = inner.peek_row();
        if self.held.is_none() {
            match row {
                None => self.tape.put(Ask::NoRow, &[], &[]),
                Some((number, bytes)) => {
                    self.held = Some(number);
                    self.tape.put(Ask::Row, &[number], bytes);
                }
            }
        }
        row
    }

    fn pop_row(&mut self) -> bool {
        let held = self.held.take().is_some();
        self.inner.as_mut().map_or(held, |inner| inner.pop_row())
    }

    fn rows(&self) -> usize {
        match &self.inner {
            None => self.tape.one_of(&[Ask::Rows]).map_or(0, |_| self.tape.take_word() as usize),
            Some(inner) => {
                let rows = inner.rows();
                self.tape.put(Ask::Rows, &[rows as u64], &[]);
                rows
            }
        }
    }
}
