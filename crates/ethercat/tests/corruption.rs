// SPDX-License-Identifier: Apache-2.0
//! Frames corrupted in transit: a million of them, none of which is accepted as an answer.
mod common;
use common::{COUNTS, Rig};
use ethercat::coe::Entry;
use ethercat::frames::datagrams;
use ethercat::main_device::{Bus, Clocks, Cycle, FrameAnswer, Pdos, SubdeviceSettings, Sync0, bring_up, open_link, take};
use serde_json::json;

const FRAMES: usize = 1_000_000;
const OUTPUTS: usize = 2 * 13;

/// Pseudo-random numbers from a fixed seed.
struct Random(u64);

impl Random {
    fn below(&mut self, end: usize) -> usize {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as usize % end
    }
}

#[test]
fn of_a_million_changed_frames_none_is_taken() {
    let rig = Rig::of(json!([{ "name": "x", "counts": COUNTS }]));
    let mut bus = Bus::open(&rig.interface).unwrap();
    let settings: [(Entry, Vec<u8>, bool); 0] = [];
    let wanted = [0, 1].map(|position| SubdeviceSettings { position, pdos: &Pdos::Device, settings: &settings, is_synced: true });
    let found = take(&mut bus).unwrap();
    let line = bring_up(&mut bus, &found, &wanted, 1_000_000_000, Some(&Clocks { sync0: Sync0 { cycle_ns: 1_000_000, shift_ns: 0 }, now_ns: &|| 0 })).unwrap();
    assert_eq!(line.outputs, OUTPUTS);
    let mut cycle = Cycle::new(open_link(&rig.interface).unwrap(), &line).unwrap();
    cycle.outputs().copy_from_slice(&std::array::from_fn::<u8, OUTPUTS, _>(|of| of as u8));
    cycle.send(Some(0)).unwrap();
    let mut answer = cycle.sent().to_vec();
    assert!(rig.server.lock().pass(&mut answer, 5_000_000_000));
    assert_eq!(cycle.check(&answer), Ok(FrameAnswer::Whole));

    let places = places(&answer);
    let mut random = Random(1);
    let mut taken = 0;
    for _ in 0..FRAMES {
        let mut changed = answer.clone();
        for _ in 0..=random.below(4) {
            changed[places[random.below(places.len())]] ^= 1 << random.below(8);
        }
        if random.below(8) == 0 {
            changed.truncate(random.below(answer.len()));
        }
        // Flipping the same bit twice changes nothing.
        taken += usize::from(changed != answer && cycle.check(&changed) == Ok(FrameAnswer::Whole));
    }
    assert_eq!(taken, 0);
}

/// Returns the bytes that the adapter does not check: type and length, the datagram headers without their interrupts, outputs, working
/// counters.
fn places(frame: &[u8]) -> Vec<usize> {
    let mut places: Vec<usize> = (12..16).collect();
    for (number, datagram) in datagrams(frame).unwrap().map(Result::unwrap).enumerate() {
        let outputs = if number == 0 { OUTPUTS } else { 0 };
        let counter = datagram.data_at() + datagram.len;
        places.extend((datagram.at..datagram.at + 8).chain(datagram.data_at()..datagram.data_at() + outputs).chain(counter..counter + 2));
    }
    places
}

#[test]
fn a_segment_survives_any_frame() {
    let rig = Rig::of(json!([{ "name": "x", "counts": COUNTS }]));
    let mut random = Random(2);
    for _ in 0..100_000 {
        let mut frame: Vec<u8> = (0..random.below(200)).map(|_| random.below(256) as u8).collect();
        if frame.len() > 16 {
            let len = (frame.len() - 16) as u16;
            frame[12..14].copy_from_slice(&[0x88, 0xA4]);
            frame[14..16].copy_from_slice(&(0x1000 | len).to_le_bytes());
            frame[16] %= 15;
            frame.extend([0; 4]);
        }
        rig.server.lock().pass(&mut frame, 6_000_000_000);
    }
}
