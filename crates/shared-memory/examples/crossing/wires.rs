// SPDX-License-Identifier: Apache-2.0
//! Wires of the round trips: our connections, bare memory, and iceoryx2.
use crate::place::bare;
use iceoryx2::port::publisher::Publisher;
use iceoryx2::port::subscriber::Subscriber;
use iceoryx2::prelude::*;
use interconnect::{Carrier, ConnectionSpec, Ends, Memory, Receiver, Sender};
use shared_memory::SharedMemory;
use std::ptr::NonNull;
use std::sync::atomic::{AtomicU64, Ordering};

/// Both directions of a wire, as seen from one side.
pub trait Wire {
    fn send(&mut self, number: u64, values: &[u8]);
    /// Copies out the values of a new group, once, and returns the group's number.
    fn poll(&mut self, values: &mut [u8]) -> Option<u64>;
}

/// A pair of our connections, one per direction.
pub struct Connections {
    sender: Box<dyn Sender>,
    receiver: Box<dyn Receiver>,
}

fn spec(len: usize) -> ConnectionSpec {
    ConnectionSpec { writer: 0, reader: 1, asynchronous_len: len, queue_row_len: 0, queue_depth: 0 }
}

impl Connections {
    /// Creates both sides, in memory.
    pub fn in_memory(len: usize) -> (Self, Self) {
        let ((to, at), (from, back)) = (Memory.connect(&spec(len)), Memory.connect(&spec(len)));
        (Connections { sender: to, receiver: back }, Connections { sender: from, receiver: at })
    }

    /// Creates one side (`side` is 0 or 1) in shared memory.
    pub fn shared(side: u64, len: usize, run: u64) -> Self {
        let mut ends = SharedMemory::new("crossing", run).expect("there is shared memory");
        let sender = ends.sender(side, &spec(len)).expect("the end is free");
        Connections { sender, receiver: ends.receiver(1 - side, &spec(len), Box::new(|| ())).expect("the end is free") }
    }
}

impl Wire for Connections {
    fn send(&mut self, number: u64, values: &[u8]) {
        self.sender.group().copy_from_slice(values);
        self.sender.publish(number, 0);
    }

    fn poll(&mut self, values: &mut [u8]) -> Option<u64> {
        let header = self.receiver.latch(0)?;
        values.copy_from_slice(self.receiver.group());
        Some(header.number)
    }
}

/// A word followed by the values, in each direction. It is correct only if neither side writes before the other has read.
pub struct Word {
    to: NonNull<u8>,
    from: NonNull<u8>,
    seen: u64,
}

// SAFETY: the addresses lie in memory that stays mapped.
unsafe impl Send for Word {}

impl Word {
    /// Maps the words of one side; `within` names the pair and is the same on both sides.
    pub fn new(within: &str, side: u64, len: usize, run: u64) -> Self {
        let half = (8 + len).next_multiple_of(128);
        let base = bare(&format!("word-{within}-{len}"), 2 * half, run);
        // SAFETY: the address lies inside the mapping.
        let at = |side: u64| unsafe { base.add(side as usize * half) };
        Word { to: at(side), from: at(1 - side), seen: 0 }
    }
}

impl Wire for Word {
    fn send(&mut self, number: u64, values: &[u8]) {
        // SAFETY: the word and the bytes after it lie inside the mapping, and the other side reads them only after the store.
        unsafe {
            self.to.add(8).as_ptr().copy_from_nonoverlapping(values.as_ptr(), values.len());
            self.to.cast::<AtomicU64>().as_ref().store(number, Ordering::Release);
        }
    }

    fn poll(&mut self, values: &mut [u8]) -> Option<u64> {
        // SAFETY: as above; the other side writes again only after it has been answered.
        let number = unsafe { self.from.cast::<AtomicU64>().as_ref() }.load(Ordering::Acquire);
        if number == self.seen {
            return None;
        }
        self.seen = number;
        // SAFETY: as above.
        unsafe { self.from.add(8).as_ptr().copy_to_nonoverlapping(values.as_mut_ptr(), values.len()) };
        Some(number)
    }
}

/// Publish-subscribe services with history 1, buffer 1 and safe overflow.
pub struct PublishSubscribe {
    publisher: Publisher<ipc::Service, [u8], ()>,
    subscriber: Subscriber<ipc::Service, [u8], ()>,
}

/// Creates an iceoryx2 node whose files are in the folder of the measurement.
pub fn participant(run: u64) -> Node<ipc::Service> {
    set_log_level(LogLevel::Error);
    let mut config = Config::global_config().clone();
    let folder = crate::place::folder(run).join("iceoryx2");
    std::fs::create_dir_all(&folder).expect("there is shared memory");
    config.global.prefix = FileName::new(crate::place::prefix(run).as_bytes()).expect("a file's name");
    config.global.set_root_path(&Path::new(folder.as_os_str().as_encoded_bytes()).expect("a path"));
    NodeBuilder::new().config(&config).create().expect("iceoryx2 starts")
}

pub fn name(text: &str) -> ServiceName {
    text.try_into().expect("a name")
}

impl PublishSubscribe {
    pub fn new(side: u64, len: usize, run: u64) -> Self {
        let participant = participant(run);
        let service = |side: u64| {
            let service = participant.service_builder(&name(&format!("crossing/{run:x}/{len}/{side}"))).publish_subscribe::<[u8]>();
            service.history_size(1).subscriber_max_buffer_size(1).enable_safe_overflow(true).open_or_create().expect("the service is free")
        };
        let publisher = service(side).publisher_builder().initial_max_slice_len(8 + len).create().expect("there is room");
        PublishSubscribe { publisher, subscriber: service(1 - side).subscriber_builder().create().expect("there is room") }
    }
}

impl Wire for PublishSubscribe {
    fn send(&mut self, number: u64, values: &[u8]) {
        let mut sample = self.publisher.loan_slice_uninit(8 + values.len()).expect("a sample is free");
        let payload = sample.payload_mut();
        payload[..8].write_copy_of_slice(&number.to_ne_bytes());
        payload[8..].write_copy_of_slice(values);
        // SAFETY: the whole payload was written above.
        unsafe { sample.assume_init() }.send().expect("it is delivered");
    }

    fn poll(&mut self, values: &mut [u8]) -> Option<u64> {
        let sample = self.subscriber.receive().expect("the service lives")?;
        let (number, group) = sample.payload().split_at(8);
        values.copy_from_slice(group);
        Some(u64::from_ne_bytes(number.try_into().expect("eight bytes")))
    }
}
