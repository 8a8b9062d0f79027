// SPDX-License-Identifier: Apache-2.0
//! A Modbus device as a driver: its channels are polled and written on a dedicated thread.
use super::link::{Answer, Count, Fault, Link};
use super::map::{Block, MappedChannel, Write, blocks};
use super::pdu::{Exception, PDU_MAX, Request, Space};
use super::services::Desk;
use device::{Channel, Counters, DeviceError, Driver, Services};
use std::sync::Arc;

pub(super) struct Client {
    channels: Vec<Channel>,
    /// Link; `None` after closing. A serial line is released when its last unit drops its link.
    link: Option<Link>,
    counters: Arc<Counters>,
    blocks: Vec<Block>,
    outputs: Vec<Output>,
    desk: Arc<Desk>,
    /// Latest readings of all channels. Kept because a firing polls only the blocks that are due.
    readings: Vec<u8>,
    /// True while mask writes are attempted, until the device refuses the function.
    has_mask_write: bool,
}

/// A write channel.
struct Output {
    place: MappedChannel,
    /// Index among the write channels.
    index: usize,
    /// Value in its wire format, and the value last accepted by the device.
    wire: [u8; 8],
    taken: Option<[u8; 8]>,
    is_due: bool,
}

impl Client {
    pub(super) fn new(channels: Vec<Channel>, places: &[MappedChannel], link: Link, gap: u16) -> Client {
        let written = places.iter().filter(|place| place.write != Write::Never).enumerate();
        let mut outputs: Vec<Output> = written.map(|(index, place)| Output { place: place.clone(), index, wire: [0; 8], taken: None, is_due: false }).collect();
        outputs.sort_by_key(|output| (output.place.space, output.place.address));
        let readings = places.iter().filter(|place| place.write == Write::Never).map(|place| place.slot.offset + place.slot.len).max().unwrap_or(0);
        let desk = Arc::new(Desk::new(link.downgrade(), outputs.iter().map(|output| output.place.clone()).collect()));
        Client {
            channels,
            blocks: blocks(places, gap),
            outputs,
            counters: link.counters.clone(),
            link: Some(link),
            desk,
            readings: vec![0; readings],
            has_mask_write: true,
        }
    }

    /// Reads the blocks that are due.
    fn poll(&mut self, now_ns: i64) -> Result<(), DeviceError> {
        let link = self.link.as_ref().ok_or_else(closed)?;
        for block in self.blocks.iter_mut().filter(|block| now_ns >= block.due_ns) {
            let answer = link.ask(&Request::Read { space: block.space, address: block.address, count: block.count })?;
            block.store(answer.data(), &mut self.readings);
            block.due_ns = now_ns.saturating_add(block.every_ns);
        }
        Ok(())
    }

    /// Converts the value of each output to its wire format; `value` returns the bytes of a channel.
    fn prepare(&mut self, value: impl Fn(&Output) -> (Vec<u8>, bool)) {
        for output in &mut self.outputs {
            let (bytes, engaged) = value(output);
            let (wire, fits) = match output.place.form.write(&bytes) {
                Some(written) => written,
                // NaN is never sent.
                None => (output.place.form.write(&output.place.safe).map_or([0; 8], |(wire, _)| wire), false),
            };
            if !fits {
                self.counters.add(Count::Limited, 1);
            }
            output.is_due = output.taken != Some(wire) || engaged && output.place.write == Write::Each;
            output.wire = wire;
        }
    }

    /// Writes the outputs that are due; adjacent ones share a request. With `once`, failed requests are not repeated, and the first
    /// failure ends the call.
    fn send(&mut self, once: bool) -> Result<(), DeviceError> {
        let link = self.link.as_ref().ok_or_else(closed)?;
        let mut at = 0;
        while at < self.outputs.len() {
            if !self.outputs[at].is_due {
                at += 1;
                continue;
            }
            let end = run_from(&self.outputs, at);
            let run = &self.outputs[at..end];
            if run[0].place.is_part() {
                send_parts(link, run, &mut self.has_mask_write, once)?;
            } else {
                let (data, count) = data_of(run);
                let MappedChannel { space, address, .. } = run[0].place;
                asked(link, &Request::Write { space, address, count, data: &data[..space.bytes(count)] }, once)?;
            }
            for output in self.outputs[at..end].iter_mut().filter(|output| output.is_due) {
                output.taken = Some(output.wire);
            }
            at = end;
        }
        Ok(())
    }
}

/// Returns the answer to a request. With `once`, the request is not repeated.
fn asked(link: &Link, request: &Request<'_>, once: bool) -> Result<Answer, DeviceError> {
    if once { link.ask_once(request).map_err(|fault| link.error(request, &fault)) } else { link.ask(request) }
}

/// Writes the parts of one register that are due, and preserves its other bits. A mask write preserves concurrent writes by other
/// masters; if the device does not support it, the register is read and then written, and a write by another master between the two is
/// lost.
fn send_parts(link: &Link, parts: &[Output], has_mask_write: &mut bool, once: bool) -> Result<(), DeviceError> {
    let address = parts[0].place.address;
    let due = parts.iter().filter(|part| part.is_due);
    let (keep, set) = due.fold((u16::MAX, 0), |(keep, set), part| {
        let mask = part.place.form.mask();
        (keep & !mask, set | u16::from_be_bytes([part.wire[0], part.wire[1]]) & mask)
    });
    if *has_mask_write {
        let request = Request::Mask { address, keep, set };
        match link.ask_once(&request) {
            Err(Fault::Exception(Exception::ILLEGAL_FUNCTION)) => *has_mask_write = false,
            Err(fault) if once => return Err(link.error(&request, &fault)),
            Err(_) => return link.ask(&request).map(drop),
            Ok(_) => return Ok(()),
        }
    }
    let read = asked(link, &Request::Read { space: Space::Holding, address, count: 1 }, once)?;
    let held = read.data().first_chunk::<2>().map_or(0, |two| u16::from_be_bytes(*two));
    asked(link, &Request::Write { space: Space::Holding, address, count: 1, data: &(held & keep | set).to_be_bytes() }, once).map(drop)
}

/// Returns the index after the last output that shares a request with the one at `at`: adjacent outputs, or the other parts of its
/// register.
fn run_from(outputs: &[Output], at: usize) -> usize {
    let first = &outputs[at].place;
    let mut end = at + 1;
    if first.is_part() {
        let others = outputs[end..].iter().take_while(|next| (next.place.space, next.place.address) == (first.space, first.address));
        return end + others.count();
    }
    while let Some(next) = outputs.get(end).filter(|next| next.is_due) {
        let follows = !next.place.is_part() && next.place.space == first.space && u32::from(next.place.address) == outputs[end - 1].place.end();
        if !follows || next.place.end() - u32::from(first.address) > u32::from(first.space.write_max()) {
            break;
        }
        end += 1;
    }
    end
}

fn closed() -> DeviceError {
    DeviceError { message: "it is closed; open the device again".to_owned() }
}

/// Returns the data of one request, and the number of registers or bits.
fn data_of(outputs: &[Output]) -> ([u8; PDU_MAX], u16) {
    let (mut data, mut count) = ([0; PDU_MAX], 0_u16);
    for output in outputs {
        let at = usize::from(count);
        match output.place.space {
            Space::Coil | Space::Discrete => data[at / 8] |= (output.wire[0] & 1) << (at % 8),
            Space::Holding | Space::Input => {
                let len = 2 * usize::from(output.place.count());
                data[2 * at..2 * at + len].copy_from_slice(&output.wire[..len]);
            }
        }
        count += output.place.count();
    }
    (data, count)
}

impl Driver for Client {
    fn channels(&self) -> &[Channel] {
        &self.channels
    }

    fn open(&mut self, now_ns: i64) -> Result<(), DeviceError> {
        // Neither the values in the device nor its functions are known.
        self.has_mask_write = true;
        self.outputs.iter_mut().for_each(|output| output.taken = None);
        self.blocks.iter_mut().for_each(|block| block.due_ns = i64::MIN);
        // A missing device is refused here, not lost later.
        self.poll(now_ns)
    }

    fn read(&mut self, release_ns: i64, readings: &mut [u8]) -> Result<(), DeviceError> {
        self.poll(release_ns)?;
        readings[..self.readings.len()].copy_from_slice(&self.readings);
        Ok(())
    }

    fn write(&mut self, _: i64, commands: &[u8], engaged: &[bool]) -> Result<(), DeviceError> {
        self.prepare(|output| (output.place.slot.of(commands).to_vec(), engaged.get(output.index).copied().unwrap_or(false)));
        self.send(false)
    }

    fn safe_state(&mut self) {
        self.prepare(|output| (output.place.safe.clone(), false));
        // All outputs, whatever values the device is assumed to have.
        self.outputs.iter_mut().for_each(|output| output.is_due = true);
        // A device that does not answer receives nothing: its loss is in the log, and only its own watchdog remains.
        let _ = self.send(true);
    }

    fn close(&mut self) {
        if let Some(link) = self.link.take() {
            link.close();
        }
    }

    fn services(&self) -> Option<Arc<dyn Services>> {
        Some(self.desk.clone())
    }

    fn counters(&self) -> Option<Arc<Counters>> {
        Some(self.counters.clone())
    }
}
