// SPDX-License-Identifier: Apache-2.0
//! Driver of a device that communicates in texts.
use super::frame::{FRAME_MAX, Framing, ScannedFrame};
use super::pattern::Order;
use crate::stream::{Address, Stream};
use device::{Channel, Counters, DeviceError, Driver, Kind, Layout, OptionWord, ServiceWord, Services, Slot};
use serde_json::{Value, json};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

device::counters! {
    /// Counters of the driver.
    pub(super) enum Count {
        Taken: "taken", "", "texts that matched a declared one";
        Unmatched: "unmatched", "", "texts that matched no declared one";
        Damaged: "damaged", "", "texts that were damaged, and noise between them";
        Timeouts: "timeouts", "", "questions that were not answered in time";
        Sent: "sent", "", "texts sent";
    }
}

pub(super) static SERVICES: [ServiceWord; 2] = [
    ServiceWord {
        name: "send",
        doc: "sends one text, framed like the others",
        arguments: &[OptionWord::needed("text", Kind::Text, "without start, checksum and end")],
        answer: None,
        moves: false,
    },
    ServiceWord { name: "last_text", doc: "the latest text, whether it was declared or not", arguments: &[], answer: Some(Kind::Text), moves: false },
];

/// Time limit for a device to accept a text.
const SENDING: Duration = Duration::from_secs(1);

/// State that the driver shares with its services.
struct Line {
    address: Address,
    framing: Framing,
    counters: Arc<Counters>,
    stream: Mutex<Option<Stream>>,
    last: Mutex<(usize, [u8; FRAME_MAX])>,
}

impl Line {
    fn stream(&self) -> MutexGuard<'_, Option<Stream>> {
        self.stream.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn count(&self, what: Count) {
        self.counters.add(what, 1);
    }

    fn failed(&self, why: &std::io::Error) -> DeviceError {
        DeviceError { message: format!("the device at {}: {why}", self.address) }
    }

    /// Sends a complete frame.
    fn send(&self, frame: &[u8]) -> Result<(), DeviceError> {
        let stream = self.stream();
        let stream = stream.as_ref().ok_or_else(|| DeviceError { message: "it is not open".to_owned() })?;
        stream.write_all(frame, Instant::now() + SENDING).map_err(|why| self.failed(&why))?;
        self.count(Count::Sent);
        Ok(())
    }
}

impl Services for Line {
    fn call(&self, service: &str, arguments: &Value) -> Result<Value, DeviceError> {
        match (service, arguments["text"].as_str()) {
            ("send", Some(text)) => self.send(&self.framing.framed(text.as_bytes())).map(|()| Value::Null),
            ("last_text", _) => {
                let last = self.last.lock().unwrap_or_else(PoisonError::into_inner);
                Ok(json!(String::from_utf8_lossy(&last.1[..last.0])))
            }
            _ => Err(DeviceError { message: format!("there is no service '{service}'") }),
        }
    }
}

pub(super) struct Talker {
    channels: Vec<Channel>,
    line: Arc<Line>,
    reads: Vec<Order>,
    /// Orders to be sent, each with the text that was sent last.
    writes: Vec<(Order, Option<Vec<u8>>)>,
    asks: Option<Vec<u8>>,
    answer: Duration,
    silent_ns: Option<i64>,
    /// Release time of the firing in which the device last sent something, ns; `None` if nothing has been received since opening.
    heard_ns: Option<i64>,
    came: [u8; FRAME_MAX],
    filled: usize,
    /// True inside a line that is too long, until its end.
    is_skipping: bool,
    count: Slot,
    taken: u64,
    readings: Vec<u8>,
}

impl Talker {
    pub(super) fn new(layout: Layout, count: Slot, address: Address, framing: Framing, reads: Vec<Order>, writes: Vec<Order>) -> Talker {
        let line = Line { address, framing, counters: Arc::new(Counters::new(Count::WORDS)), stream: Mutex::new(None), last: Mutex::new((0, [0; FRAME_MAX])) };
        Talker {
            readings: vec![0; layout.readings_len()],
            channels: layout.into_channels(),
            line: Arc::new(line),
            reads,
            writes: writes.into_iter().map(|order| (order, None)).collect(),
            asks: None,
            answer: SENDING,
            silent_ns: None,
            heard_ns: None,
            came: [0; FRAME_MAX],
            filled: 0,
            is_skipping: false,
            count,
            taken: 0,
        }
    }

    /// Configures the talker for a device that sends only on request.
    pub(super) fn asking(self, asks: Option<Vec<u8>>, answer: Duration) -> Talker {
        Talker { asks, answer, ..self }
    }

    /// Sets the duration of silence after which the device counts as lost.
    pub(super) fn silent(self, silent_ns: Option<i64>) -> Talker {
        Talker { silent_ns, ..self }
    }

    /// Processes all received bytes, then waits for a declared text until the deadline. Ends soon after the deadline even if the device
    /// never stops sending.
    fn hear(&mut self, deadline: Instant, release_ns: i64) -> Result<bool, DeviceError> {
        let mut heard = false;
        loop {
            let until = if heard { deadline.min(Instant::now()) } else { deadline };
            let more = {
                let stream = self.line.stream();
                let stream = stream.as_ref().ok_or_else(|| DeviceError { message: "it is not open".to_owned() })?;
                stream.read(&mut self.came[self.filled..], until).map_err(|why| self.line.failed(&why))?
            };
            if more == 0 {
                return Ok(heard);
            }
            self.filled += more;
            if self.take() {
                (heard, self.heard_ns) = (true, Some(release_ns));
            }
        }
    }

    /// Processes the complete frames; returns true if one of them contained a declared text.
    fn take(&mut self) -> bool {
        let (mut at, mut heard) = (0, false);
        loop {
            if self.is_skipping {
                let (len, is_over) = self.line.framing.skip(&self.came[at..self.filled]);
                (at, self.is_skipping) = (at + len, !is_over);
                if !is_over {
                    break;
                }
            }
            let (len, is_fine) = match self.line.framing.scan(&self.came[at..self.filled]) {
                ScannedFrame::Wait => break,
                ScannedFrame::Noise(len) | ScannedFrame::Damaged(len) => {
                    self.line.count(Count::Damaged);
                    (len, None)
                }
                ScannedFrame::TooLong(_) => {
                    self.line.count(Count::Damaged);
                    self.is_skipping = true;
                    continue;
                }
                ScannedFrame::Frame(text, len) => {
                    let mut last = self.line.last.lock().unwrap_or_else(PoisonError::into_inner);
                    last.0 = text.len();
                    last.1[..text.len()].copy_from_slice(text);
                    drop(last);
                    (len, Some(self.reads.iter().any(|order| order.pattern.take(text, &mut self.readings))))
                }
            };
            at += len;
            match is_fine {
                Some(true) => {
                    heard = true;
                    self.taken += 1;
                    self.line.count(Count::Taken);
                }
                Some(false) => self.line.count(Count::Unmatched),
                None => {}
            }
        }
        self.came.copy_within(at..self.filled, 0);
        self.filled -= at;
        heard
    }
}

impl Driver for Talker {
    fn channels(&self) -> &[Channel] {
        &self.channels
    }

    fn open(&mut self, _: i64) -> Result<(), DeviceError> {
        let stream = Stream::open(&self.line.address, Instant::now() + SENDING).map_err(|why| self.line.failed(&why))?;
        *self.line.stream() = Some(stream);
        (self.heard_ns, self.filled, self.taken, self.is_skipping) = (None, 0, 0, false);
        Ok(())
    }

    fn read(&mut self, release_ns: i64, readings: &mut [u8]) -> Result<(), DeviceError> {
        match &self.asks {
            None => {
                self.hear(Instant::now(), release_ns)?;
            }
            Some(asks) => {
                self.line.send(asks)?;
                if !self.hear(Instant::now() + self.answer, release_ns)? {
                    self.line.count(Count::Timeouts);
                }
            }
        }
        // The duration of the opening does not count as silence.
        let heard_ns = *self.heard_ns.get_or_insert(release_ns);
        let silent = self.silent_ns.filter(|silent_ns| release_ns - heard_ns > *silent_ns);
        if let Some(silent_ns) = silent {
            let said = format!("the device at {} has sent no declared text for {} ms", self.line.address, silent_ns as f64 * 1e-6);
            return Err(DeviceError { message: said });
        }
        self.count.set_double(&mut self.readings, 0, self.taken as f64);
        readings[..self.readings.len()].copy_from_slice(&self.readings);
        Ok(())
    }

    fn write(&mut self, _: i64, commands: &[u8], engaged: &[bool]) -> Result<(), DeviceError> {
        for (order, sent) in &mut self.writes {
            let is_engaged = order.indices.iter().any(|index| engaged.get(*index) == Some(&true));
            // A text that no verb commands is sent only if it has a safe value to send, and once.
            if !is_engaged && !order.pattern.fields.iter().any(|field| field.is_safe) {
                *sent = None;
                continue;
            }
            let Some(text) = order.pattern.write(commands) else { continue };
            if sent.as_ref() != Some(&text) {
                self.line.send(&self.line.framing.framed(&text))?;
                *sent = Some(text);
            }
        }
        Ok(())
    }

    fn safe_state(&mut self) {
        let len = self.channels.iter().filter(|channel| !channel.safe.is_empty()).map(|channel| channel.offset + channel.len).max().unwrap_or(0);
        let mut commands = vec![0; len];
        for channel in self.channels.iter().filter(|channel| !channel.safe.is_empty()) {
            commands[channel.offset..channel.offset + channel.len].copy_from_slice(&channel.safe);
        }
        for (order, sent) in &mut self.writes {
            *sent = None;
            let text = order.pattern.write(&commands).filter(|_| order.pattern.fields.iter().any(|field| field.is_safe));
            // Nothing is sent to a lost device; its loss has been reported.
            if text.is_some_and(|text| self.line.send(&self.line.framing.framed(&text)).is_err()) {
                return;
            }
        }
    }

    fn close(&mut self) {
        *self.line.stream() = None;
    }

    fn taken_ns(&self) -> Option<i64> {
        self.heard_ns
    }

    fn services(&self) -> Option<Arc<dyn Services>> {
        Some(self.line.clone())
    }

    fn counters(&self) -> Option<Arc<Counters>> {
        Some(self.line.counters.clone())
    }
}
