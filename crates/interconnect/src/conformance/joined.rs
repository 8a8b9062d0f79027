// SPDX-License-Identifier: Apache-2.0
//! Carrier composed of ends that were created separately.
use crate::carrier::{Carrier, ConnectionSpec, Full, Header, Receiver, Sender};
use crate::link::Ends;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// Maximum time until a raise is delivered.
const RAISE_MAX: Duration = Duration::from_secs(60);

/// Carrier that creates the writing ends with one [`Ends`] and the reading ends with another. Publications and rows are readable
/// immediately; [`deliver`](Carrier::deliver) waits for the raises.
pub struct JoinedCarrier {
    writing: Box<dyn Ends>,
    reading: Box<dyn Ends>,
    connections: u64,
    raises: Arc<Raises>,
}

impl JoinedCarrier {
    /// Joins the two sides. Connecting panics later if an end cannot be created.
    pub fn new(writing: impl Ends + 'static, reading: impl Ends + 'static) -> Self {
        JoinedCarrier { writing: Box::new(writing), reading: Box::new(reading), connections: 0, raises: Arc::default() }
    }
}

impl Carrier for JoinedCarrier {
    fn connect(&mut self, spec: &ConnectionSpec) -> (Box<dyn Sender>, Box<dyn Receiver>) {
        let number = self.connections;
        self.connections += 1;
        self.raises.rows().push(Rows { reader: spec.reader, ..Rows::default() });
        let made = "the carrier under test makes its ends";
        let raises = self.raises.clone();
        let receiver = self.reading.receiver(number, spec, Box::new(move || raises.count(number, |rows| rows.raised += 1))).expect(made);
        let sender = self.writing.sender(number, spec).expect(made);
        let sender = CountingSender { sender, number, raises: self.raises.clone() };
        (Box::new(sender), Box::new(CountingReceiver { receiver, number, raises: self.raises.clone() }))
    }

    fn next_arrival(&self) -> Option<i64> {
        self.raises.rows().iter().any(|rows| rows.delivered < rows.pushed).then_some(i64::MIN)
    }

    fn deliver(&mut self, _now_ns: i64, raise: &mut dyn FnMut(u32)) {
        let arriving: Vec<u32> = {
            let coming = |rows: &mut Vec<Rows>| rows.iter().any(|rows| rows.raised < rows.pushed);
            let (mut rows, late) = self.raises.come.wait_timeout_while(self.raises.rows(), RAISE_MAX, coming).expect("no other test has these");
            assert!(!late.timed_out(), "rows that were pushed raised nobody");
            let take = |rows: &mut Rows| std::iter::repeat_n(rows.reader, rows.raised - std::mem::replace(&mut rows.delivered, rows.raised));
            rows.iter_mut().flat_map(take).collect()
        };
        arriving.into_iter().for_each(raise);
    }
}

/// Rows and raises of each connection.
#[derive(Default)]
struct Raises {
    rows: Mutex<Vec<Rows>>,
    come: Condvar,
}

#[derive(Default)]
struct Rows {
    reader: u32,
    /// Number of rows pushed whose reader must be raised.
    pushed: usize,
    raised: usize,
    /// Number of raises that were forwarded.
    delivered: usize,
    /// True if the reading end was dropped.
    gone: bool,
}

impl Raises {
    fn rows(&self) -> MutexGuard<'_, Vec<Rows>> {
        self.rows.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn count(&self, number: u64, change: impl FnOnce(&mut Rows)) {
        let rows = &mut self.rows()[number as usize];
        // A dropped reader is no longer raised, so there is nothing to wait for.
        if !rows.gone {
            change(rows);
        }
        self.come.notify_all();
    }
}

struct CountingSender {
    sender: Box<dyn Sender>,
    number: u64,
    raises: Arc<Raises>,
}

impl Sender for CountingSender {
    fn group(&mut self) -> &mut [u8] {
        self.sender.group()
    }

    fn publish(&mut self, number: u64, now_ns: i64) {
        self.sender.publish(number, now_ns);
    }

    fn push(&mut self, number: u64, now_ns: i64, fill: &mut dyn FnMut(&mut [u8])) -> Result<(), Full> {
        self.sender.push(number, now_ns, fill)?;
        let raises = usize::from(!self.sender.arrived());
        self.raises.count(self.number, |rows| rows.pushed += raises);
        Ok(())
    }

    fn arrived(&self) -> bool {
        self.sender.arrived()
    }
}

struct CountingReceiver {
    receiver: Box<dyn Receiver>,
    number: u64,
    raises: Arc<Raises>,
}

impl Receiver for CountingReceiver {
    fn latch(&mut self, now_ns: i64) -> Option<Header> {
        self.receiver.latch(now_ns)
    }

    fn group(&self) -> &[u8] {
        self.receiver.group()
    }

    fn peek_row(&mut self) -> Option<(u64, &[u8])> {
        self.receiver.peek_row()
    }

    fn pop_row(&mut self) -> bool {
        self.receiver.pop_row()
    }

    fn rows(&self) -> usize {
        self.receiver.rows()
    }
}

impl Drop for CountingReceiver {
    fn drop(&mut self) {
        self.raises.count(self.number, |rows| *rows = Rows { gone: true, ..Rows::default() });
    }
}
