// SPDX-License-Identifier: Apache-2.0
//! A source that stood still for longer than its bound, unnoticed by any supervisor: its devices are made safe, and the standstill is
//! reported with its length.
#![allow(clippy::undocumented_unsafe_blocks, reason = "a test")]
mod support;
use device::{Channel, DeviceError, Direction, Driver};
use kernel::*;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;
use support::*;

const MS: u64 = 1_000_000;
const BOUND: Duration = Duration::from_millis(200);

/// A brake whose reading can take longer than the bound on request: to its source this looks as if the process had been stopped.
struct Brake {
    channels: Vec<Channel>,
    stands_still: Arc<AtomicU64>,
    safe: Arc<AtomicU64>,
    written: Arc<AtomicU64>,
}

impl Driver for Brake {
    fn channels(&self) -> &[Channel] {
        &self.channels
    }
    fn open(&mut self, _: i64) -> Result<(), DeviceError> {
        Ok(())
    }
    fn read(&mut self, _: i64, _: &mut [u8]) -> Result<(), DeviceError> {
        if self.stands_still.swap(0, Ordering::SeqCst) != 0 {
            std::thread::sleep(2 * BOUND);
        }
        Ok(())
    }
    fn write(&mut self, _: i64, _: &[u8], _: &[bool]) -> Result<(), DeviceError> {
        self.written.fetch_add(1, Ordering::SeqCst);
        Ok(())
    }
    fn safe_state(&mut self) {
        self.safe.fetch_add(1, Ordering::SeqCst);
    }
    fn close(&mut self) {}
}

#[derive(Default)]
struct Counts {
    stands_still: Arc<AtomicU64>,
    safe: Arc<AtomicU64>,
    written: Arc<AtomicU64>,
}

impl Counts {
    fn device(&self, name: &str) -> Arc<Device> {
        let channel = Channel {
            name: "brake.force".into(),
            direction: Direction::Write,
            type_text: "double".into(),
            unit: String::new(),
            doc: String::new(),
            offset: 0,
            len: 8,
            safe: 0f64.to_ne_bytes().into(),
            slew_max: None,
        };
        let (stands_still, safe, written) = (self.stands_still.clone(), self.safe.clone(), self.written.clone());
        Device::open(name, Box::new(Brake { channels: vec![channel], stands_still, safe, written }), 0).unwrap()
    }
}

#[test]
fn what_is_commanded_is_safe_and_lost_and_what_is_not_goes_on() {
    let host = monotonic_host();
    host.allow_standstill(BOUND);
    let source = host.add_source(timer("fast", MS, 80)).unwrap();
    let (claimed, free) = (Counts::default(), Counts::default());
    let devices = vec![claimed.device("claimed"), free.device("free")];
    devices[0].engage(0, true);
    let kept = devices.clone();
    host.submit(source, script(vec![Op::Table(Box::new(Table::new(vec![], vec![], vec![], devices, None)))]));
    claimed.stands_still.store(1, Ordering::SeqCst);
    let (device, message) = await_event(&host, |event| if let Event::DeviceLost { device, message, .. } = event { Some((device, message)) } else { None });
    assert_eq!(device, "claimed");
    assert!(message.starts_with("its source 'fast' was suspended for ") && message.ends_with("they are in their safe states now"), "{message}");
    assert!(kept[0].is_lost() && !kept[1].is_lost());
    assert_eq!([&claimed, &free].map(|counts| counts.safe.load(Ordering::SeqCst)), [1, 0]);
    let (late_ns, is_unattended) =
        await_event(&host, |event| if let Event::StoodStill { late_ns, is_unattended, .. } = event { Some((late_ns, is_unattended)) } else { None });
    assert!(late_ns > 200_000_000 && is_unattended, "{late_ns}");
    let before = free.written.load(Ordering::SeqCst);
    while free.written.load(Ordering::SeqCst) < before + 3 {
        std::thread::yield_now();
    }
    assert_eq!(claimed.safe.load(Ordering::SeqCst), 1);
    host.close();
}
