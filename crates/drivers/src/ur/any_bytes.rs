// SPDX-License-Identifier: Apache-2.0
//! Arbitrary bytes in place of a controller's messages, for fuzzers: parsing never panics, and the numbers of a sample are finite.
use super::rtde::{Message, decode};
use super::sample::Sample;

/// Parses a stream of messages, as sent by a controller.
pub fn rtde(mut bytes: &[u8]) {
    while let Ok(Some((message, len))) = decode(bytes) {
        assert!((3..=bytes.len()).contains(&len), "it goes on, and takes no more than there is");
        assert_eq!(decode(&bytes[..len]), Ok(Some((message, len))), "what follows changes nothing");
        assert_eq!(decode(&bytes[..len - 1]), Ok(None), "without its last byte it is not whole");
        if let Message::Data { values, .. } = message {
            sampled(values);
        }
        bytes = &bytes[len..];
    }
    sampled(bytes);
}

fn sampled(values: &[u8]) {
    let Some(sample) = Sample::decode(values) else { return };
    let numbers = sample.position.iter().chain(&sample.velocity).chain(&sample.force).chain(&sample.analog);
    assert!(numbers.chain([&sample.timestamp, &sample.speed_scaling]).all(|number| number.is_finite()), "{sample:?}");
}
