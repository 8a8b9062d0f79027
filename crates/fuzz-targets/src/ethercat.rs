// SPDX-License-Identifier: Apache-2.0
//! EtherCAT fuzz targets: datagrams on a segment, mailboxes and EEPROMs.
use ethercat::coe;
use ethercat::emulator::{DriveOptions, Segment};
use ethercat::frames::{DATAGRAMS, FRAME_MAX};
use ethercat::sii;

/// Fuzzes the part selected by the first byte with the remaining bytes.
pub(crate) fn ethercat(bytes: &[u8]) {
    match bytes.split_first() {
        Some((0, rest)) => line(rest),
        Some((1, rest)) => mailbox(rest),
        Some((_, rest)) => eeprom(rest),
        None => {}
    }
}

/// Passes datagrams through a segment of two drives. Each piece is a length followed by datagrams, to which the headers of a frame are
/// added.
fn line(mut bytes: &[u8]) {
    let drive = |name: &str| DriveOptions { name: name.into(), limits: Some([-1e4, 1e4]), ..DriveOptions::default() };
    let mut segment = Segment::new(&[drive("a"), drive("b")]);
    let mut now_ns = 1_000_000_000;
    while let [low, high, rest @ ..] = bytes {
        let len = usize::from(u16::from_le_bytes([*low, *high])) % (FRAME_MAX - DATAGRAMS);
        let (datagrams, after) = rest.split_at(rest.len().min(len));
        bytes = after;
        let mut frame = [&[0; 12][..], &[0x88, 0xA4], &(0x1000 | datagrams.len() as u16).to_le_bytes(), datagrams].concat();
        segment.pass(&mut frame, now_ns);
        now_ns += 1_000_000;
    }
    for position in 0..segment.len() {
        assert!(segment.state(position).is_some(), "{} has a state", segment.status(position));
    }
}

/// Checks that a decoded message can be encoded and decoded again.
fn mailbox(bytes: &[u8]) {
    let Some(message) = coe::message(bytes) else { return };
    let read = if message.service == coe::REQUEST { coe::request(message.body) } else { coe::response(message.body) };
    let Some(sdo) = read else { return };
    let mut written = vec![0; bytes.len() + coe::SDO_LEN];
    let len = coe::write(&mut written, message.counter, message.service, &sdo);
    let again = coe::message(&written[..len.max(coe::SDO_LEN)]).expect("what was written is a message");
    let read = if again.service == coe::REQUEST { coe::request(again.body) } else { coe::response(again.body) };
    assert_eq!((again.counter, again.service, read), (message.counter, message.service, Some(sdo)));
}

/// Checks that a request for more bytes always exceeds the bytes present, and that decoded contents survive encoding and decoding again.
fn eeprom(bytes: &[u8]) {
    assert!(sii::wanted(bytes).is_none_or(|wanted| wanted > bytes.len()));
    let Some(contents) = sii::parse(bytes) else { return };
    let again = sii::parse(&sii::build(&contents)).expect("what was built is an EEPROM");
    assert_eq!(again, contents);
}
