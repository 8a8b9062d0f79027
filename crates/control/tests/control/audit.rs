// SPDX-License-Identifier: Apache-2.0
//! The audit file: its contents, and the behaviour when it is full.
use crate::rig::{Rig, class};
use serde_json::json;
use std::os::unix::fs::PermissionsExt;

#[test]
fn commands_and_refusals_of_rights_are_recorded_and_looking_is_not() {
    let rig = Rig::new();
    let session = rig.commander("panel");
    rig.call(&session, "now", json!({}));
    rig.call(&session, "svv", json!({ "name": "x", "type_text": "double" }));
    rig.call(&session, "write", json!({ "name": "x", "value": 1.5 }));
    let (status, _) = rig.ask("POST", "/v1/call/write", &[("opengpac-session", &session)], r#"{"name": "no", "value": 1}"#);
    assert_eq!(status, 404);
    rig.ask("GET", "/v1/version", &[("authorization", "Bearer wrong")], "");
    let lines = rig.audit();
    let short = |line: &serde_json::Value| format!("{} {} {} {}", line["session"], line["call"], line["outcome"], line["role"]).replace('"', "");
    let short: Vec<String> = lines.iter().map(short).collect();
    let expected = [
        "panel open_session ok download",
        "panel take_command ok download",
        "panel svv begun download",
        "panel svv ok download",
        "panel write ok download",
        "panel write UnknownName download",
        " /v1/version NotAllowed observe",
    ];
    assert_eq!(short, expected);
    assert!(lines.iter().all(|line| line["arguments_sha256"].as_str().is_some_and(|digest| digest.len() == 64)));
    let mode = std::fs::metadata(rig.folder.file("s.audit.jsonl")).expect("it is there").permissions().mode();
    assert_eq!(mode & 0o777, 0o600);
}

#[test]
fn a_full_disk_refuses_to_configure_and_goes_on_operating() {
    let rig = Rig::with("virtual", |options, _| options.audit = Some("/dev/full".into()));
    let session = rig.commander("panel");
    let id = rig.running(&session, "wave");
    assert_eq!(rig.call(&session, "state", json!({ "instance": id })), "running");
    let (status, answer) = rig.ask("POST", "/v1/call/svv", &[("opengpac-session", &session)], r#"{"name": "x", "type_text": "double"}"#);
    assert_eq!((status, class(&answer)), (503, "AuditFailed"));
    let (status, answer) = rig.ask("POST", "/v1/call/svv_about", &[], r#"{"name": "x"}"#);
    assert_eq!((status, class(&answer)), (404, "UnknownName"), "it was not made");
}
