// SPDX-License-Identifier: Apache-2.0
//! Fuzz target for the message link: forged packets with correct checksums, between the publications and rows of a connection.
use interconnect::{Carrier, ConnectionSpec, Faults, Message};

const GROUP: usize = 8;
const ROW: usize = 4;
const DEPTH: usize = 3;

/// Fuzzes the link with pieces that consist of a length, an action, and a packet without its checksum and length. Checks that the reader
/// sees only rows of the declared length, that it never sees more rows than are reported, and that the link comes to rest.
pub(crate) fn packets(mut bytes: &[u8]) {
    let mut link = Message::new(1, Faults::none());
    let (mut sender, mut receiver) = link.connect(&ConnectionSpec { writer: 1, reader: 5, asynchronous_len: GROUP, queue_depth: DEPTH, queue_row_len: ROW });
    let mut now_ns = 0;
    while let [len, way, rest @ ..] = bytes {
        let (packet, after) = rest.split_at(rest.len().min(usize::from(*len)));
        bytes = after;
        match way % 4 {
            0 => {
                sender.group().fill(7);
                sender.publish(7, now_ns);
            }
            1 => {
                let _ = sender.push(9, now_ns, &mut |row| row.fill(9));
            }
            way => {
                link.arrive(0, way == 2, &interconnect::message::sealed(packet));
            }
        }
        now_ns += 1_000;
        link.deliver(now_ns, &mut |_| ());
        receiver.latch(now_ns);
        assert_eq!(receiver.group().len(), GROUP);
        if receiver.peek_row().map(|(_, row)| row.len()).inspect(|len| assert_eq!(*len, ROW)).is_some() {
            assert!(receiver.rows() > 0 && receiver.pop_row());
        }
    }
    drop((sender, receiver));
    assert_eq!(link.next_arrival(), None, "nothing is under way where both ends are gone");
}
