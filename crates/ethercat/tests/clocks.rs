// SPDX-License-Identifier: Apache-2.0
//! Distributed clocks on an emulated segment, in simulated time: cables of known lengths, oscillators that drift, late frames.
mod common;
use common::{COUNTS, LONG, OPERATION_ENABLED, Rig, drive};
use ethercat::emulator::{DriveOptions, Segment, serve_at};
use ethercat::main_device::{Bus, Clocks, Cycle, FrameAnswer, Pdos, SubdeviceSettings, Sync0, bring_up, open_link, take};
use ethercat::registers::AL_CONTROL;
use ethercat::states::State;
use serde_json::json;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

const PERIOD_NS: u64 = 1_000_000;
const SHIFT_NS: u32 = 500_000;
/// Offset of the host's clock, which also runs 20 ppm fast.
const AHEAD_NS: u64 = 777_000_000;
const TOO_FAST: u64 = 50_000;
/// Maximum lateness of a frame, ns.
const LATE_NS: u64 = 100_000;

fn host_ns(true_ns: u64) -> u64 {
    true_ns + true_ns / TOO_FAST + AHEAD_NS
}

/// Returns the true time at which the host's clock shows `host_ns`.
fn true_ns(host_ns: u64) -> u64 {
    ((host_ns - AHEAD_NS) as f64 / (1.0 + 1.0 / TOO_FAST as f64)).round() as u64
}

#[test]
fn clocks_keep_to_the_host_and_outputs_are_there_before_sync0() {
    let cables = [0, 420, 1_300, 90];
    let drives =
        [0, 1, 2, 3].map(|of| DriveOptions { cable_ns: Some(cables[of]), clock_ppm: [40.0, -35.0, 80.0, 0.0][of], watchdog: Some(false), ..drive("d", 0) });
    let time_ns = Arc::new(AtomicU64::new(2_000_000_000));
    let (segment_time, host_time) = (time_ns.clone(), time_ns.clone());
    let interface = format!("local:clocks-{}", std::process::id());
    let server = serve_at(&interface, Segment::new(&drives), move || segment_time.fetch_add(10_000, Ordering::Relaxed)).unwrap();
    let mut bus = Bus::open(&interface).unwrap();
    let wanted = [0, 1, 2, 3].map(|position| SubdeviceSettings { position, pdos: &Pdos::Device, settings: &[], is_synced: true });
    let clocks = Clocks { sync0: Sync0 { cycle_ns: PERIOD_NS as u32, shift_ns: SHIFT_NS }, now_ns: &|| host_ns(host_time.load(Ordering::Relaxed)) };
    let found = take(&mut bus).unwrap();
    let line = bring_up(&mut bus, &found, &wanted, 1_000_000_000, Some(&clocks)).unwrap();
    for (position, delay_ns) in [0, 420, 1_720, 1_810].into_iter().enumerate() {
        assert!(server.lock().synced(position).delay_ns.abs_diff(delay_ns) <= 1, "{:?}", server.lock().synced(position));
    }
    for station in &line.stations {
        bus.write(station.subdevice.station, AL_CONTROL, &(State::Op as u16).to_le_bytes()).unwrap();
    }

    let mut cycle = Cycle::new(open_link(&interface).unwrap(), &line).unwrap();
    let first = host_ns(time_ns.load(Ordering::Relaxed)) / PERIOD_NS + 1;
    let mut random = 1u64;
    for number in 0..12_000 {
        if number == 4_000 {
            server.lock().forget_synced();
        }
        random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let late_ns = (random >> 33) % LATE_NS;
        // The frame reaches the first subdevice 2 to 4 us after its timestamp was read.
        let there_ns = true_ns((first + number) * PERIOD_NS) + late_ns;
        time_ns.store(there_ns, Ordering::Relaxed);
        cycle.send(Some(host_ns(there_ns - 2_000 - late_ns % 2_000))).unwrap();
        assert_eq!(cycle.wait(LONG).unwrap(), FrameAnswer::Whole);
    }

    let (segment, now_ns) = (server.lock(), time_ns.load(Ordering::Relaxed));
    let reference = segment.system_ns(0, now_ns);
    assert!(reference.abs_diff(host_ns(now_ns)) < 6_000, "the reference keeps to the host: {reference} at {}", host_ns(now_ns));
    for position in 0..4 {
        let synced = segment.synced(position);
        let apart_ns = segment.system_ns(position, now_ns).abs_diff(reference);
        assert!(apart_ns < 200, "{position} is {apart_ns} ns from the reference: {synced:?}");
        assert!((7_900..8_100).contains(&synced.sync0) && synced.missed == 0, "{synced:?}");
        let margins = u64::from(SHIFT_NS) - LATE_NS - 10_000..=u64::from(SHIFT_NS) + 10_000;
        assert!(margins.contains(&synced.margin_ns_min) && margins.contains(&synced.margin_ns_max), "{synced:?}");
    }
    let timing = cycle.timing().unwrap();
    assert!(timing.difference_ns < 200 && timing.reference_ns.unsigned_abs() < 10_000, "{timing:?}");
}

#[test]
fn axes_with_sync0_go_to_op_and_follow() {
    let axes = json!([{ "name": "x", "counts": COUNTS, "speed_max": 10 }, { "name": "y", "counts": COUNTS, "speed_max": 10 }]);
    let mut rig = Rig::with(&[drive("first", 1000), drive("second", 2000)], json!({ "axes": axes, "sync0_ns": 1_000_000 }));
    rig.until(&[Some(1.5)], "there", |rig| rig.double("x.position") == 1.5);
    assert_eq!(rig.status("x"), OPERATION_ENABLED);
    let synced = rig.server.lock().synced(0);
    assert!(synced.sync0 > 0, "{synced:?}");
}

#[test]
fn sync0_is_refused_where_it_cannot_be() {
    let _ = device::register(&ethercat::DRIVER);
    let refused = |name: &str, value: i64, sync0: Option<i64>| {
        let mut options = json!({ "interface": "local:x", "axes": [{ "name": "x", "counts": 1 }], name: value });
        sync0.into_iter().for_each(|ns| options["sync0_ns"] = ns.into());
        device::open("ethercat", &options).err().expect("refused").to_string()
    };
    assert!(refused("sync0_ns", 10, None).contains("its range is 50 us to"));
    assert!(refused("sync0_shift_ns", 10, None).contains("sync0_ns is missing"));
    assert!(refused("sync0_shift_ns", 1_000_000, Some(1_000_000)).contains("less than sync0_ns"));
}
