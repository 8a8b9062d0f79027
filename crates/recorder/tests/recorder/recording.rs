// SPDX-License-Identifier: Apache-2.0
//! A recording has every requested value, or states exactly which ones it lacks; only virtual time ever waits for a disk.
use crate::common::{MS, Scratch, svv, system, values, wave};
use interconnect::Memory;
use recorder::{Folder, Options, Recorder, Recording, Sink, Space, Summary};
use runtime::ClockKind;
use serde_json::json;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Condvar, Mutex};
use std::time::Duration;
use supervisor::System;

#[test]
fn every_value_comes_back_with_its_bits_number_and_time() {
    let (system, file) = (system(), Scratch::new("all"));
    svv(&system, "y", json!({"type_text": "double", "history": 5000, "unit": "rad"}));
    svv(&system, "still", json!({"type_text": "int32_t[2]"}));
    let (_, recorder) = Recorder::start(&system, &file.0, &Options::default()).unwrap();
    let id = wave(&system, "y");
    system.advance(5000 * MS).unwrap();
    let summary = recorder.stop();
    assert_eq!((summary.running, summary.lost.len(), summary.failure), (false, 0, None));
    system.halt(id).unwrap();
    let (recording, history) = (file.read(), system.history("y", 5000).unwrap());
    assert!(recording.complete);
    let series = &recording.series["y"];
    let expected: Vec<(u64, i64, Vec<u8>)> = history.into_iter().take(5000).collect();
    let got: Vec<(u64, i64, Vec<u8>)> =
        (0..series.numbers.len()).map(|i| (series.numbers[i], series.times_ns[i], series.bytes[8 * i..8 * i + 8].to_vec())).collect();
    assert_eq!(got[1..], expected[..], "behind the value that was there at the start");
    assert_eq!((series.unit.as_str(), series.kind.as_str(), summary.counts["y"]), ("rad", "svv", 5001));
    assert_eq!(recording.series["still"].bytes, [0; 8], "what nothing writes is there once");
    assert!(recording.log().any(|entry| entry["kind"] == "start" && entry["about"] == "wave#1"));
    assert_eq!(recording.metadata["opengpac"]["system"], "cell");
    assert!(!recording.records["/timing/rtp0.fast"].is_empty());
}

#[test]
fn times_of_a_value_rise_from_its_first_row_on() {
    let (system, file) = (system(), Scratch::new("rising"));
    for name in ["y", "set"] {
        svv(&system, name, json!({"type_text": "double"}));
    }
    let (_, recorder) = Recorder::start(&system, &file.0, &Options::default()).unwrap();
    let write = |value: f64| system.write("set", &model::value::Value::Number(value)).unwrap();
    let id = wave(&system, "y");
    for ms in 0..20 {
        (0..=ms % 4).for_each(|part| write(f64::from(10 * ms + part)));
        system.advance(MS).unwrap();
    }
    (0..3).for_each(|part| write(f64::from(part)));
    recorder.stop();
    system.halt(id).unwrap();
    let recording = file.read();
    for name in ["y", "set"] {
        let times = &recording.series[name].times_ns;
        assert!(times.is_sorted_by(|a, b| a < b), "'{name}' at {times:?}");
    }
    assert!(values(&recording, "y").len() >= 20, "each value that a block stored");
    let set: Vec<f64> = (0..20).map(|ms| f64::from(10 * ms + ms % 4)).chain([2.0]).collect();
    assert_eq!(values(&recording, "set"), set, "the last value of each instant, and that of the end");
}

#[test]
fn what_is_made_later_is_taken_in_and_what_was_not_asked_for_is_not() {
    let (system, file) = (system(), Scratch::new("later"));
    svv(&system, "arm.q", json!({"type_text": "double"}));
    let options = Options { svvs: vec!["arm.*".to_owned()], ..Options::default() };
    let (number, _) = Recorder::start(&system, &file.0, &options).unwrap();
    for name in ["arm.v", "leg.v"] {
        svv(&system, name, json!({"type_text": "double"}));
        wave(&system, name);
    }
    system.advance(3000 * MS).unwrap();
    assert!(system.companion(number).is_some());
    // A system that closes ends its recordings.
    system.close();
    let recording = file.read();
    assert!(recording.complete);
    assert_eq!(recording.series.keys().map(String::as_str).collect::<Vec<_>>(), ["arm.q", "arm.v"]);
    assert!(values(&recording, "arm.v").len() > 3000);
    assert!(recording.ends().any(|end| end["report"]["instance"] == "wave#1"));
}

#[test]
fn what_cannot_be_recorded_is_refused_with_words() {
    let (system, file) = (system(), Scratch::new("refused"));
    let of = |options: Options, path: &std::path::Path| Recorder::start(&system, path, &options).map(|_| ()).expect_err("refused")[0].to_string();
    assert!(of(Options { svvs: vec!["nothing".to_owned()], ..Options::default() }, &file.0).contains("there is no SVV 'nothing'"));
    assert!(!file.0.exists(), "no file is left");
    assert!(of(Options::default(), std::path::Path::new("/nowhere/at/all.mcap")).contains("cannot record into"));
    std::fs::write(&file.0, "mine").unwrap();
    assert!(of(Options::default(), &file.0).contains("cannot record into"));
    assert_eq!(std::fs::read(&file.0).unwrap(), b"mine");
    assert!(Recording::open(&file.0).expect_err("no MCAP")[0].to_string().contains("not an MCAP file"));
}

/// A disk of this capacity, which can stall.
#[derive(Clone)]
struct Disk(Arc<(Mutex<WrittenBytes>, Condvar)>);

/// Written bytes, the capacity, and whether the disk stalls.
type WrittenBytes = (Vec<u8>, usize, bool);

impl Disk {
    fn new(room: usize) -> Disk {
        Disk(Arc::new((Mutex::new((Vec::new(), room, false)), Condvar::new())))
    }

    fn stands(&self, stands: bool) {
        self.0.0.lock().unwrap().2 = stands;
        self.0.1.notify_all();
    }
}

impl Write for Disk {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let mut disk = self.0.1.wait_while(self.0.0.lock().unwrap(), |disk| disk.2).unwrap();
        let len = bytes.len().min(disk.1 - disk.0.len());
        if len == 0 {
            return Err(io::Error::new(io::ErrorKind::StorageFull, "no space left on device"));
        }
        disk.0.extend(&bytes[..len]);
        Ok(len)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Sink for Disk {
    fn cut(&mut self, len: u64) -> io::Result<()> {
        self.0.0.lock().unwrap().0.truncate(len as usize);
        Ok(())
    }
}

/// A folder with one file, on this disk.
impl Folder for Disk {
    fn next(&mut self) -> io::Result<(PathBuf, Box<dyn Sink>)> {
        Ok((PathBuf::from("run.mcap"), Box::new(self.clone())))
    }

    fn remove(&mut self, _: &Path) -> io::Result<()> {
        Ok(())
    }

    fn space(&self) -> Option<Space> {
        None
    }
}

fn total(summary: &Summary, name: &str) -> u64 {
    summary.counts[name] + summary.lost.get(name).copied().unwrap_or(0)
}

#[test]
fn a_full_disk_ends_the_recording_with_its_last_chunk_and_says_so() {
    let (system, file) = (system(), Scratch::new("full"));
    svv(&system, "y", json!({"type_text": "double"}));
    // Space for the first chunk, but not for all.
    let disk = Disk::new(1_200_000);
    let recorder = Recorder::start_in(&system, Box::new(disk.clone()), &file.0, &Options::default(), 1 << 20).unwrap();
    wave(&system, "y");
    system.advance(60_000 * MS).unwrap();
    // The recording ended by itself.
    let ended = recorder.summary();
    assert!(!ended.running, "{ended:?}");
    assert!(ended.failure.as_deref().is_some_and(|why| why.contains("no space left")), "{ended:?}");
    assert!(system.log_since(0).iter().any(|entry| entry.kind == "recorder"));
    assert_eq!(system.alarms().current[0].code, "recording_failed");
    let summary = recorder.stop();
    assert!(summary.lost["y"] > 0 && total(&summary, "y") <= 60_001, "{summary:?}");
    std::fs::write(&file.0, &disk.0.0.lock().unwrap().0).unwrap();
    let recording = file.read();
    assert!(!recording.complete);
    assert_eq!(recording.series["y"].numbers.len() as u64, summary.counts["y"]);
    assert!(summary.counts["y"] > 1000 && summary.bytes <= 1_200_000, "{summary:?}");
}

#[test]
fn a_file_that_was_cut_off_can_be_read_up_to_its_last_chunk() {
    let (system, file) = (system(), Scratch::new("cut"));
    svv(&system, "y", json!({"type_text": "double"}));
    let (_, recorder) = Recorder::start(&system, &file.0, &Options::default()).unwrap();
    wave(&system, "y");
    system.advance(60_000 * MS).unwrap();
    recorder.stop();
    let (whole, bytes) = (file.read(), std::fs::read(&file.0).unwrap());
    let mut before = 0;
    for cut in (100..bytes.len()).step_by(bytes.len() / 8) {
        std::fs::write(&file.0, &bytes[..cut]).unwrap();
        let Ok(part) = Recording::open(&file.0) else { continue };
        let count = part.series.get("y").map_or(0, |series| series.numbers.len());
        assert!(count >= before && values(&whole, "y").starts_with(&part.series.get("y").map_or(Vec::new(), |_| values(&part, "y"))));
        before = count;
    }
    assert!(before > 0);
}

#[test]
fn real_time_does_not_wait_for_a_disk_and_what_found_no_room_is_counted() {
    let system = System::new("cell", ClockKind::Monotonic, Box::new(Memory)).expect("a system");
    system.processor("rtp0", None, true).unwrap();
    let file = Scratch::new("slow");
    svv(&system, "y", json!({"type_text": "double"}));
    let disk = Disk::new(usize::MAX);
    let recorder = Recorder::start_in(&system, Box::new(disk.clone()), &file.0, &Options::default(), 4096).unwrap();
    disk.stands(true);
    let stores: u64 = 5000;
    for number in 0..stores {
        system.write("y", &model::value::Value::Number(number as f64)).unwrap();
        if number % 100 == 0 {
            std::thread::yield_now();
        }
    }
    while recorder.stop_within(Duration::from_millis(50)).running {
        disk.stands(false);
    }
    let summary = recorder.summary();
    assert_eq!(total(&summary, "y"), stores + 1, "{summary:?}");
    std::fs::write(&file.0, &disk.0.0.lock().unwrap().0).unwrap();
    let recording = file.read();
    assert_eq!(recording.lost().get("y"), summary.lost.get("y"));
    assert_eq!(recording.series["y"].numbers.len() as u64, summary.counts["y"]);
}
