// SPDX-License-Identifier: Apache-2.0
//! A recording split over files loses nothing between them, and each file can be read alone; a disk is never filled up.
use crate::common::{MS, svv, system, values, wave};
use recorder::{Archive, Folder, INSTALLED, Options, Recorder, Recording, Sink, Space, Summary};
use serde_json::json;
use std::collections::BTreeSet;
use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};

/// A folder that is deleted on drop, on a disk with this capacity.
#[derive(Clone)]
struct Scratch(Arc<(PathBuf, Mutex<u64>)>);

impl Scratch {
    fn new(name: &str, room: u64) -> Scratch {
        let path = std::env::temp_dir().join(format!("opengpac-files-{}-{name}", std::process::id()));
        let _absent = std::fs::remove_dir_all(&path);
        std::fs::create_dir(&path).expect("a folder");
        Scratch(Arc::new((path, Mutex::new(room))))
    }

    fn file(&self, name: &str) -> PathBuf {
        self.0.0.join(name)
    }

    /// Returns the names and sizes of its files, sorted by name.
    fn files(&self) -> Vec<(String, u64)> {
        let entries = std::fs::read_dir(&self.0.0).unwrap().map(|entry| entry.unwrap());
        let mut found: Vec<_> = entries.map(|entry| (entry.file_name().into_string().unwrap(), entry.metadata().unwrap().len())).collect();
        found.sort();
        found
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        if Arc::strong_count(&self.0) == 1 {
            let _gone = std::fs::remove_dir_all(&self.0.0);
        }
    }
}

impl Folder for Scratch {
    fn next(&mut self) -> io::Result<(PathBuf, Box<dyn Sink>)> {
        let path = recorder::next_beside(&self.file("run.mcap"));
        let file = File::create_new(&path)?;
        Ok((path, Box::new(file)))
    }

    fn remove(&mut self, path: &Path) -> io::Result<()> {
        std::fs::remove_file(path)
    }

    /// Returns the remaining space, of which a recording spares 1 MB.
    fn space(&self) -> Option<Space> {
        let used: u64 = self.files().iter().map(|(_, bytes)| bytes).sum();
        Some(Space { free: self.0.1.lock().unwrap().saturating_sub(used), spared: 1_000_000 })
    }
}

fn split(keep: Option<u32>) -> Options {
    Options { split_bytes: Some(1_000_000), keep, ..Options::default() }
}

/// Records a wave for `seconds`; returns the summary at its end.
fn recorded(folder: &Scratch, options: &Options, seconds: i64) -> Summary {
    let system = system();
    svv(&system, "y", json!({"type_text": "double"}));
    svv(&system, "still", json!({"type_text": "int32_t"}));
    let recorder = Recorder::start_in(&system, Box::new(folder.clone()), &folder.file("run.mcap"), options, 1 << 20).unwrap();
    wave(&system, "y");
    system.advance(seconds * 1000 * MS).unwrap();
    recorder.stop()
}

fn rows(recording: &Recording, name: &str) -> Vec<(u64, i64, f64)> {
    let series = &recording.series[name];
    series.numbers.iter().zip(&series.times_ns).zip(values(recording, name)).map(|((number, time_ns), value)| (*number, *time_ns, value)).collect()
}

fn read(path: &Path) -> Recording {
    Recording::open(path).unwrap_or_else(|why| panic!("{}", why[0]))
}

#[test]
fn files_follow_each_other_without_a_gap() {
    let folder = Scratch::new("split", u64::MAX);
    let summary = recorded(&folder, &split(None), 120);
    assert_eq!((summary.running, summary.failure, summary.lost.len()), (false, None, 0));
    let count = summary.files.len();
    assert!(count >= 4, "{:?}", summary.files);
    let names: Vec<PathBuf> = (1..=count).map(|number| folder.file(&if number == 1 { "run.mcap".to_owned() } else { format!("run-{number}.mcap") })).collect();
    assert_eq!((&summary.files, summary.bytes), (&names, folder.files().iter().map(|(_, bytes)| bytes).sum()));
    let mut all: Vec<(u64, i64, f64)> = Vec::new();
    for path in &summary.files {
        let recording = read(path);
        assert!(recording.complete && recording.lost().is_empty(), "{}", path.display());
        assert!(!recording.records[INSTALLED].is_empty(), "{} says what was installed", path.display());
        assert_eq!(recording.series["still"].bytes, [0; 4], "what nothing writes is there once in each file");
        let of = rows(&recording, "y");
        match all.last() {
            // A file begins with the value held at that time.
            Some(last) => {
                assert_eq!(of[0], *last, "{}", path.display());
                let begins_ns = Archive::open(path).unwrap().about().unwrap().begins_ns;
                assert!(begins_ns >= last.1 && begins_ns <= of[1].1, "{}", path.display());
                all.extend(&of[1..]);
            }
            None => all = of,
        }
    }
    assert_eq!(all.len(), 120_001);
    assert!(all.windows(2).all(|two| two[1].1 - two[0].1 == MS || two[0].0 == 0), "a row for each firing");
    assert_eq!(summary.counts["y"], 120_001);
}

#[test]
fn only_the_newest_files_stay() {
    let folder = Scratch::new("keep", u64::MAX);
    let summary = recorded(&folder, &split(Some(2)), 120);
    let last = rows(&read(summary.files.last().unwrap()), "y");
    assert_eq!((summary.files.len(), folder.files().len()), (2, 2));
    assert_eq!(summary.bytes, folder.files().iter().map(|(_, bytes)| bytes).sum::<u64>());
    assert_eq!(last.last().map(|row| row.1), Some(120_000 * MS), "the newest ones");
    assert_eq!(summary.counts["y"], 120_001, "all were written");
}

/// Records a wave for 60 s into the folder, resuming the recording of an identity; returns the names of its files at the end.
fn resumed(folder: &Scratch, identity: &str, keep: u32) -> Vec<String> {
    let system = system();
    svv(&system, "y", json!({"type_text": "double"}));
    let options = Options { resumes: true, identity: Some(identity.to_owned()), ..split(Some(keep)) };
    let (_, recorder) = Recorder::start(&system, &folder.file("run.mcap"), &options).unwrap_or_else(|why| panic!("{}", why[0]));
    assert!(recorder.summary().files.len() <= keep as usize, "{:?}", recorder.summary().files);
    wave(&system, "y");
    system.advance(60_000 * MS).unwrap();
    recorder.stop().files.iter().map(|path| path.file_name().unwrap().to_str().unwrap().to_owned()).collect()
}

#[test]
fn files_that_a_process_has_left_count_among_those_that_stay() {
    let folder = Scratch::new("left", u64::MAX);
    let mut files = resumed(&folder, "a", 3);
    assert_eq!(files.len(), 3, "as many as may stay: {files:?}");
    for _ in 0..3 {
        let last = files.pop().expect("a file");
        // The state that a killed process leaves: a file without its end.
        let path = folder.file(&last);
        let bytes = std::fs::read(&path).unwrap();
        std::fs::write(&path, &bytes[..bytes.len() * 2 / 3]).unwrap();
        files = resumed(&folder, "a", 3);
        let there: BTreeSet<String> = folder.files().into_iter().map(|(name, _)| name).collect();
        assert_eq!((files.len(), files.iter().cloned().collect()), (3, there), "no other is left");
    }
}

#[test]
fn files_of_other_recordings_do_not_count_among_those_that_stay() {
    let folder = Scratch::new("others", u64::MAX);
    let there = || folder.files().into_iter().map(|(name, _)| name).collect::<BTreeSet<String>>();
    let system = system();
    // A recording without an identity.
    let first = Recorder::start(&system, &folder.file("run.mcap"), &Options::default()).unwrap_or_else(|why| panic!("{}", why[0])).1;
    first.stop();
    let other = resumed(&folder, "a", 2);
    let own = resumed(&folder, "b", 2);
    let again = resumed(&folder, "b", 2);
    assert_eq!(there(), [&["run.mcap".to_owned()], &other[..], &again].concat().into_iter().collect(), "{own:?} went");
}

#[test]
fn old_files_make_room_where_the_disk_becomes_full() {
    let folder = Scratch::new("room", 5_000_000);
    let summary = recorded(&folder, &split(Some(50)), 240);
    assert_eq!((summary.failure, summary.lost.len()), (None, 0));
    let bytes: u64 = folder.files().iter().map(|(_, bytes)| bytes).sum();
    assert!((2_000_000..5_000_000).contains(&bytes), "{bytes}");
    assert!(summary.free_bytes.is_some_and(|free| free >= 1_000_000), "{:?}", summary.free_bytes);
}

#[test]
fn a_recording_ends_in_order_before_the_disk_is_full() {
    for options in [Options::default(), split(None)] {
        let folder = Scratch::new("ends", 5_000_000);
        // Twice as much as there is room for: a slow machine writes fewer, larger chunks, which take less of it.
        let summary = recorded(&folder, &options, 480);
        assert!(summary.failure.as_deref().is_some_and(|why| why.contains("the disk has") && why.contains("a recording leaves 1 MB")), "{summary:?}");
        let parts: Vec<Recording> = summary.files.iter().map(|path| read(path)).collect();
        assert!(parts.iter().all(|recording| recording.complete));
        let written: usize = parts.iter().map(|recording| recording.series["y"].numbers.len()).sum();
        // Each file but the first repeats the last value of the file before it.
        assert_eq!((written + 1 - parts.len()) as u64, summary.counts["y"]);
        assert!(summary.lost["y"] > 0);
    }
}

#[test]
fn a_disk_that_is_full_already_is_refused() {
    let folder = Scratch::new("full", 500_000);
    let system = system();
    let begun = Recorder::start_in(&system, Box::new(folder.clone()), &folder.file("run.mcap"), &Options::default(), 1 << 20);
    let why = begun.map(|_| ()).expect_err("refused")[0].to_string();
    assert!(why.contains("the disk has 0 MB free, but a recording leaves 1 MB") && why.contains("free up space"), "{why}");
    assert!(folder.files().is_empty(), "no file is left");
}

#[test]
fn bounds_that_cannot_be_kept_are_refused() {
    let (folder, system) = (Scratch::new("bounds", u64::MAX), system());
    let why = |options: Options| Recorder::start(&system, &folder.file("run.mcap"), &options).map(|_| ()).expect_err("refused")[0].to_string();
    let is_said = |options: Options, words: &str| assert!(why(options).contains(words), "{words}");
    is_said(Options { keep: Some(3), ..Options::default() }, "the size at which the next file begins");
    is_said(Options { split_bytes: Some(999_999), ..Options::default() }, "give 1 MB or more");
    is_said(Options { split_bytes: Some(1_000_000), keep: Some(1), ..Options::default() }, "keep 2 or more");
    is_said(Options { split_bytes: Some(1_000_000), replay: true, ..Options::default() }, "a recording for a replay is a single file");
    assert!(folder.files().is_empty(), "no file is left");
}
