// SPDX-License-Identifier: Apache-2.0
//! Recordings of a daemon that dies and restarts.
use crate::journal::{count, killed, options, text};
use crate::rig::{Folder, MessageKeeper, Rig};
use control::Options;
use serde_json::json;
use std::collections::BTreeSet;

fn recording(records: &Folder, left: &Folder) -> Options {
    Options { records: Some(records.0.clone()), ..options(left) }
}

/// Starts a daemon with a folder for recordings, and a session that has command.
fn recorder() -> (Folder, Rig, String) {
    let records = Folder::new();
    let rig = Rig::with("virtual", |of, folder| *of = recording(&records, folder));
    let session = rig.commander("panel");
    (records, rig, session)
}

/// Starts a daemon on the remaining files.
fn go_on(records: &Folder, left: Folder) -> Rig {
    let with = recording(records, &left);
    Rig::within(left, "virtual", &with, &mut MessageKeeper::default()).unwrap_or_else(|r| panic!("{r:?}"))
}

fn names(records: &Folder) -> BTreeSet<String> {
    std::fs::read_dir(&records.0).expect("ours").flatten().map(|entry| entry.file_name().into_string().expect("text")).collect()
}

fn set<const N: usize>(names: [&str; N]) -> BTreeSet<String> {
    names.map(str::to_owned).into()
}

#[test]
fn a_recording_goes_on_beside_its_file_until_it_is_stopped() {
    let (records, rig, session) = recorder();
    let number = rig.call(&session, "record", json!({ "path": "run.mcap" }))["recording"].clone();
    rig.call(&session, "record", json!({ "path": "other.mcap" }));
    rig.call(&session, "stop_recording", json!({ "recording": number }));
    let second = go_on(&records, killed(&rig));
    assert_eq!(names(&records), set(["other-2.mcap", "other.mcap", "run.mcap"]));
    let third = go_on(&records, killed(&second));
    assert_eq!(names(&records), set(["other-2.mcap", "other-3.mcap", "other.mcap", "run.mcap"]));
    let session = third.commander("panel");
    third.call(&session, "stop_recording", json!({ "recording": 1 }));
    assert_eq!(count(&third.folder), 3, "{}", text(&third.folder));
    drop(go_on(&records, killed(&third)));
    assert_eq!(names(&records).len(), 4, "what was stopped does not go on");
}

#[test]
fn a_recording_keeps_as_many_files_however_often_its_daemon_dies() {
    let (records, rig, session) = recorder();
    rig.call(&session, "record", json!({ "path": "run.mcap", "split_bytes": 1_000_000, "keep": 2 }));
    let mut left = killed(&rig);
    for last in 2..6 {
        let next = go_on(&records, left);
        let before = if last == 2 { "run.mcap".to_owned() } else { format!("run-{}.mcap", last - 1) };
        assert_eq!(names(&records), set([before.as_str(), format!("run-{last}.mcap").as_str()]));
        left = killed(&next);
    }
}

#[test]
fn the_log_names_who_records_and_who_stops_it() {
    let (_records, rig, session) = recorder();
    let number = rig.call(&session, "record", json!({ "path": "run.mcap" }))["recording"].clone();
    rig.call(&session, "stop_recording", json!({ "recording": number }));
    let log = rig.call(&session, "log", json!({}));
    let told: Vec<String> = log.as_array().expect("entries").iter().filter(|entry| entry["kind"] == "command").map(|entry| entry.to_string()).collect();
    let is_told = |call: &str, about: &str| told.iter().any(|entry| entry.contains(call) && entry.contains(about) && entry.contains("panel"));
    assert!(is_told("record", "run.mcap") && is_told("stop_recording", &format!("recording {number}")), "{told:#?}");
}
