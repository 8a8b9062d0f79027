// SPDX-License-Identifier: Apache-2.0
//! Finds frames of text in received bytes, and checks that they are complete and undamaged.
//!
//! No function here allocates or panics, whatever the bytes are.
use serde::Deserialize;

/// Maximum length of a frame, including its marks and checksum.
pub(super) const FRAME_MAX: usize = 1024;

/// Kind of checksum, computed over the text alone.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Sum {
    /// Exclusive or of all bytes.
    Xor,
    /// Sum of all bytes, modulo 256.
    Sum,
}

/// Encoding of the checksum.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum ChecksumForm {
    /// Two hexadecimal digits.
    #[default]
    Hex,
    Byte,
}

/// A checksum after the text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Checksum {
    pub sum: Sum,
    pub written: ChecksumForm,
    /// Mark between the text and the checksum, such as the `*` of NMEA.
    pub mark: Vec<u8>,
}

impl Checksum {
    /// Returns the number of bytes after the text.
    fn len(&self) -> usize {
        self.mark.len() + if self.written == ChecksumForm::Hex { 2 } else { 1 }
    }

    fn of(&self, text: &[u8]) -> u8 {
        text.iter().fold(0, |sum, byte| match self.sum {
            Sum::Xor => sum ^ byte,
            Sum::Sum => sum.wrapping_add(*byte),
        })
    }

    /// Returns the text before the checksum; `None` if the checksum does not match.
    fn checked<'a>(&self, body: &'a [u8]) -> Option<&'a [u8]> {
        let (text, tail) = body.split_at_checked(body.len().checked_sub(self.len())?)?;
        let sum = match tail.strip_prefix(&self.mark[..])? {
            [byte] => *byte,
            [high, low] => (hex(*high)? << 4) | hex(*low)?,
            _ => return None,
        };
        (sum == self.of(text)).then_some(text)
    }

    fn put(&self, text: &[u8], to: &mut Vec<u8>) {
        let sum = self.of(text);
        to.extend_from_slice(&self.mark);
        match self.written {
            ChecksumForm::Byte => to.push(sum),
            ChecksumForm::Hex => to.extend_from_slice(format!("{sum:02X}").as_bytes()),
        }
    }
}

fn hex(digit: u8) -> Option<u8> {
    char::from(digit).to_digit(16).map(|value| value as u8)
}

/// Framing of a text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Framing {
    pub start: Vec<u8>,
    /// Length in bytes of the text with its checksum; `None` if the text ends at the end mark.
    pub length: Option<usize>,
    pub end: Vec<u8>,
    pub checksum: Option<Checksum>,
}

/// Result of scanning the start of the bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ScannedFrame<'a> {
    /// The frame is incomplete.
    Wait,
    /// Noise between frames: number of bytes that do not belong to a frame.
    Noise(usize),
    /// Damaged frame, with its number of bytes.
    Damaged(usize),
    /// Start of a frame that is too long, with its number of bytes; the rest, up to the end mark, must be skipped.
    TooLong(usize),
    /// A text, and the length of its frame.
    Frame(&'a [u8], usize),
}

impl Framing {
    /// Scans received bytes.
    pub(super) fn scan<'a>(&self, bytes: &'a [u8]) -> ScannedFrame<'a> {
        let Some(begins) = bytes.strip_prefix(&self.start[..]) else {
            // A possible start mark is kept: its rest may not have arrived yet.
            return match (0..bytes.len()).find(|at| self.start.starts_with(&bytes[*at..]) || bytes[*at..].starts_with(&self.start)) {
                Some(0) | None if bytes.is_empty() || self.start.starts_with(bytes) => ScannedFrame::Wait,
                Some(at) => ScannedFrame::Noise(at),
                None => ScannedFrame::Noise(bytes.len()),
            };
        };
        match self.body(begins) {
            Some(Ok(body)) => {
                let len = self.start.len() + body.len() + self.end.len();
                self.text(body).map_or(ScannedFrame::Damaged(len), |text| ScannedFrame::Frame(text, len))
            }
            // A false start mark: the next one is searched for after its first byte.
            Some(Err(())) => ScannedFrame::Damaged(1),
            None if bytes.len() >= FRAME_MAX => ScannedFrame::TooLong(bytes.len()),
            None => ScannedFrame::Wait,
        }
    }

    /// Returns the text in a body, without its checksum; `None` if the checksum does not match. If a line feed ends a frame, carriage
    /// returns before it belong neither to the text nor to the checksum.
    fn text<'a>(&self, body: &'a [u8]) -> Option<&'a [u8]> {
        let (is_line, returns) = (self.end == b"\n", body.iter().rev().take_while(|byte| **byte == b'\r').count());
        match &self.checksum {
            None => Some(if is_line { &body[..body.len() - returns] } else { body }),
            // A checksum of one byte may itself be a carriage return.
            Some(checksum) => checksum.checked(body).or_else(|| checksum.checked(body.strip_suffix(b"\r").filter(|_| is_line)?)),
        }
    }

    /// Returns the number of bytes that belong to the rest of a frame that is too long, and true if its end is among them. A possible
    /// beginning of the end mark is left for the next call.
    pub(super) fn skip(&self, bytes: &[u8]) -> (usize, bool) {
        let marks = self.end.len().max(1);
        match bytes.windows(marks).position(|window| window == &self.end[..]) {
            Some(at) => (at + marks, true),
            None => {
                let kept = (1..marks).rev().find(|kept| bytes.ends_with(&self.end[..*kept])).unwrap_or(0);
                (bytes.len() - kept, false)
            }
        }
    }

    /// Returns the text and checksum; `None` if they are incomplete, an error if the end mark is not in the right place.
    fn body<'a>(&self, begins: &'a [u8]) -> Option<Result<&'a [u8], ()>> {
        match self.length {
            Some(length) => {
                let (body, rest) = begins.split_at_checked(length)?;
                match rest.len() >= self.end.len() {
                    true => Some(if rest.starts_with(&self.end) { Ok(body) } else { Err(()) }),
                    false if self.end.starts_with(rest) => None,
                    false => Some(Err(())),
                }
            }
            None => begins.windows(self.end.len()).position(|window| window == &self.end[..]).map(|at| Ok(&begins[..at])),
        }
    }

    /// Encloses a text in a complete frame.
    pub(super) fn framed(&self, text: &[u8]) -> Vec<u8> {
        let mut frame = self.start.clone();
        frame.extend_from_slice(text);
        if let Some(checksum) = &self.checksum {
            checksum.put(text, &mut frame);
        }
        frame.extend_from_slice(&self.end);
        frame
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn nmea() -> Framing {
        let checksum = Checksum { sum: Sum::Xor, written: ChecksumForm::Hex, mark: b"*".to_vec() };
        Framing { start: b"$".to_vec(), length: None, end: b"\r\n".to_vec(), checksum: Some(checksum) }
    }

    fn plain(start: &[u8], length: Option<usize>, end: &[u8]) -> Framing {
        Framing { start: start.to_vec(), length, end: end.to_vec(), checksum: None }
    }

    #[test]
    fn a_text_is_what_is_between_its_marks() {
        assert_eq!(plain(b"", None, b"\r").scan(b"12.5\r9"), ScannedFrame::Frame(b"12.5", 5));
        assert_eq!(plain(b"\x02", None, b"\x03").scan(b"noise\x02A\x03"), ScannedFrame::Noise(5));
        assert_eq!(plain(b"\x02", None, b"\x03").scan(b"\x02A"), ScannedFrame::Wait);
        assert_eq!(plain(b"<<", None, b">>").scan(b"a<"), ScannedFrame::Noise(1));
        assert_eq!(plain(b"<<", None, b">>").scan(b"<"), ScannedFrame::Wait);
        assert_eq!(plain(b"W", Some(3), b"\n").scan(b"W123\n"), ScannedFrame::Frame(b"123", 5));
        assert_eq!(plain(b"W", Some(3), b"\n").scan(b"W1234"), ScannedFrame::Damaged(1));
        assert_eq!(plain(b"", Some(2), b"").scan(b"abc"), ScannedFrame::Frame(b"ab", 2));
        // The example in the standard.
        let gps = b"$GPGLL,4916.45,N,12311.12,W,225444,A*31\r\n";
        assert_eq!(nmea().scan(gps), ScannedFrame::Frame(&gps[1..gps.len() - 5], gps.len()));
        let mut damaged = *gps;
        damaged[8] ^= 1;
        assert_eq!(nmea().scan(&damaged), ScannedFrame::Damaged(gps.len()));
    }

    #[test]
    fn a_carriage_return_before_a_line_feed_is_no_part_of_text_or_checksum() {
        let lines = Framing { end: b"\n".to_vec(), ..nmea() };
        for end in [&b"\r\n"[..], b"\n"] {
            let gga = [&b"$GPGGA,123519,4807.038,N,01131.000,E,1,08,0.9,545.4,M,46.9,M,,*47"[..], end].concat();
            assert!(matches!(lines.scan(&gga), ScannedFrame::Frame(text, _) if text.starts_with(b"GPGGA") && text.ends_with(b"M,,")), "{end:?}");
            assert_eq!(plain(b"", None, b"\n").scan(&[b"W,3.5", end].concat()), ScannedFrame::Frame(b"W,3.5", 5 + end.len()));
        }
        // A checksum of one byte that is itself a carriage return, with one before the line feed and without.
        let sum = Checksum { sum: Sum::Sum, written: ChecksumForm::Byte, mark: Vec::new() };
        let summed = Framing { start: Vec::new(), length: None, end: b"\n".to_vec(), checksum: Some(sum) };
        let text = [b'C', 255, 203];
        assert_eq!(text.iter().fold(0u8, |sum, byte| sum.wrapping_add(*byte)), 13);
        assert_eq!(summed.scan(&[&text[..], b"\r\n"].concat()), ScannedFrame::Frame(&text, 5));
        assert_eq!(summed.scan(&[&text[..], b"\r\r\n"].concat()), ScannedFrame::Frame(&text, 6));
    }

    #[test]
    fn the_rest_of_a_line_that_is_too_long_ends_at_its_end_mark_however_it_is_cut() {
        let framing = plain(b"", None, b"\r\n");
        assert_eq!(framing.scan(&[b'A'; FRAME_MAX]), ScannedFrame::TooLong(FRAME_MAX));
        assert_eq!((framing.skip(b"12345\r\nnext"), framing.skip(b"12345\r"), framing.skip(b"12345")), ((7, true), (5, false), (5, false)));
    }

    #[test]
    fn no_frame_with_one_wrong_byte_is_taken() {
        let frame = nmea().framed(b"SCALE,12.50");
        for at in 0..frame.len() {
            for wrong in 0..=255 {
                let mut damaged = frame.clone();
                damaged[at] = wrong;
                let is_same = damaged == frame || damaged.eq_ignore_ascii_case(&frame) && at >= frame.len() - 4;
                assert_eq!(matches!(nmea().scan(&damaged), ScannedFrame::Frame(b"SCALE,12.50", _)), is_same, "{at} {wrong}");
                assert!(is_same || !matches!(nmea().scan(&damaged), ScannedFrame::Frame(..)), "{at} {wrong}");
            }
        }
    }

    proptest! {
        #[test]
        fn no_bytes_panic_and_each_step_goes_on(bytes in proptest::collection::vec(any::<u8>(), 0..1300), which in 0..5_usize) {
            let framing = [nmea(), plain(b"", None, b"\n"), plain(b"\x02", Some(4), b""), plain(b"ab", Some(0), b"ba"), plain(b"", Some(3), b"")][which].clone();
            let mut rest = &bytes[..];
            while !rest.is_empty() {
                match framing.scan(rest) {
                    ScannedFrame::Wait => break,
                    ScannedFrame::Noise(len) | ScannedFrame::Damaged(len) | ScannedFrame::TooLong(len) | ScannedFrame::Frame(_, len) => {
                        prop_assert!(len > 0 && len <= rest.len());
                        rest = &rest[len..];
                    }
                }
            }
            prop_assert!(rest.len() < FRAME_MAX);
        }

        #[test]
        fn what_is_framed_is_found_again(text in "[ -~]{0,40}", noise in "[a-z]{0,9}") {
            let text = text.replace(['$', '*'], "x");
            let framing = nmea();
            let stream = [noise.as_bytes(), &framing.framed(text.as_bytes())].concat();
            let skipped = match framing.scan(&stream) { ScannedFrame::Noise(len) => len, _ => 0 };
            prop_assert_eq!(skipped, noise.len());
            prop_assert!(matches!(framing.scan(&stream[skipped..]), ScannedFrame::Frame(found, _) if found == text.as_bytes()));
            for cut in skipped..stream.len() {
                prop_assert_eq!(framing.scan(&stream[skipped..cut]), ScannedFrame::Wait);
            }
        }
    }
}
