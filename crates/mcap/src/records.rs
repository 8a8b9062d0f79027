// SPDX-License-Identifier: Apache-2.0
//! Byte layout of the records of an MCAP file (mcap.dev/spec): an opcode, a length, and little-endian fields.
use std::collections::BTreeMap;

/// Magic bytes at the start and end of a file.
pub(crate) const MAGIC: &[u8; 8] = b"\x89MCAP0\r\n";

/// Opcode that no record has.
pub(crate) const NONE: u8 = 0x00;
pub(crate) const HEADER: u8 = 0x01;
pub(crate) const FOOTER: u8 = 0x02;
pub(crate) const SCHEMA: u8 = 0x03;
pub(crate) const CHANNEL: u8 = 0x04;
pub(crate) const MESSAGE: u8 = 0x05;
pub(crate) const CHUNK: u8 = 0x06;
pub(crate) const MESSAGE_INDEX: u8 = 0x07;
pub(crate) const CHUNK_INDEX: u8 = 0x08;
pub(crate) const ATTACHMENT: u8 = 0x09;
pub(crate) const ATTACHMENT_INDEX: u8 = 0x0a;
pub(crate) const STATISTICS: u8 = 0x0b;
pub(crate) const METADATA: u8 = 0x0c;
pub(crate) const METADATA_INDEX: u8 = 0x0d;
pub(crate) const SUMMARY_OFFSET: u8 = 0x0e;
pub(crate) const DATA_END: u8 = 0x0f;

/// Builder that writes fields consecutively.
#[derive(Default)]
pub(crate) struct Fields(pub Vec<u8>);

impl Fields {
    pub fn u16(mut self, value: u16) -> Fields {
        self.0.extend(value.to_le_bytes());
        self
    }

    pub fn u32(mut self, value: u32) -> Fields {
        self.0.extend(value.to_le_bytes());
        self
    }

    pub fn u64(mut self, value: u64) -> Fields {
        self.0.extend(value.to_le_bytes());
        self
    }

    /// Appends bytes, preceded by their length.
    pub fn bytes(self, bytes: &[u8]) -> Fields {
        let mut fields = self.u32(length(bytes.len()));
        fields.0.extend(bytes);
        fields
    }

    pub fn text(self, text: &str) -> Fields {
        self.bytes(text.as_bytes())
    }

    pub fn texts(self, map: &BTreeMap<String, String>) -> Fields {
        let pairs = map.iter().fold(Fields::default(), |pairs, (name, text)| pairs.text(name).text(text));
        self.bytes(&pairs.0)
    }

    /// Appends pairs of a channel and a number.
    pub fn by_channel(self, map: &BTreeMap<u16, u64>) -> Fields {
        let pairs = map.iter().fold(Fields::default(), |pairs, (channel, number)| pairs.u16(*channel).u64(*number));
        self.bytes(&pairs.0)
    }

    /// Appends the fields to `out` as one record.
    pub fn record(self, code: u8, out: &mut Vec<u8>) {
        out.push(code);
        out.extend((self.0.len() as u64).to_le_bytes());
        out.extend(self.0);
    }
}

fn length(len: usize) -> u32 {
    u32::try_from(len).expect("a text or map of a record is far below 4 GiB")
}

/// Parser that reads fields consecutively. Its methods return `None` if the bytes are exhausted.
#[derive(Clone, Copy)]
pub(crate) struct Rest<'a>(pub &'a [u8]);

impl<'a> Rest<'a> {
    pub fn take(&mut self, len: usize) -> Option<&'a [u8]> {
        let (head, tail) = self.0.split_at_checked(len)?;
        self.0 = tail;
        Some(head)
    }

    pub fn u8(&mut self) -> Option<u8> {
        self.take(1).map(|bytes| bytes[0])
    }

    pub fn u16(&mut self) -> Option<u16> {
        self.take(2).and_then(|bytes| bytes.try_into().ok()).map(u16::from_le_bytes)
    }

    pub fn u32(&mut self) -> Option<u32> {
        self.take(4).and_then(|bytes| bytes.try_into().ok()).map(u32::from_le_bytes)
    }

    pub fn u64(&mut self) -> Option<u64> {
        self.take(8).and_then(|bytes| bytes.try_into().ok()).map(u64::from_le_bytes)
    }

    pub fn bytes(&mut self) -> Option<&'a [u8]> {
        let len = self.u32()?;
        self.take(usize::try_from(len).ok()?)
    }

    pub fn text(&mut self) -> Option<String> {
        String::from_utf8(self.bytes()?.to_vec()).ok()
    }

    pub fn texts(&mut self) -> Option<BTreeMap<String, String>> {
        let mut pairs = Rest(self.bytes()?);
        let mut map = BTreeMap::new();
        while !pairs.0.is_empty() {
            map.insert(pairs.text()?, pairs.text()?);
        }
        Some(map)
    }

    /// Returns the next record: its opcode and its fields.
    pub fn record(&mut self) -> Option<(u8, Rest<'a>)> {
        let mut rest = *self;
        let code = rest.u8()?;
        let len = usize::try_from(rest.u64()?).ok()?;
        let fields = rest.take(len)?;
        *self = rest;
        Some((code, Rest(fields)))
    }
}
