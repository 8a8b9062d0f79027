// SPDX-License-Identifier: Apache-2.0
//! A daemon that dies and restarts: the state it has then, what runs, and what it refuses.
use crate::rig::{Folder, MessageKeeper, Rig, class, receive, send, system, wave};
use control::{Options, Server};
use serde_json::{Value as Json, json};
use sha2::{Digest, Sha256};
use std::os::unix::fs::{DirBuilderExt, PermissionsExt};
use std::sync::Arc;

pub fn options(folder: &Folder) -> Options {
    Options { socket: Some(folder.file("s")), journal: Some(folder.file("j")), ..Options::default() }
}

fn kept() -> Rig {
    Rig::with("virtual", |of, folder| *of = options(folder))
}

/// Copies the present contents of the disk: the state left if the daemon is killed at this moment.
pub fn killed(rig: &Rig) -> Folder {
    let left = Folder::new();
    std::fs::copy(rig.folder.file("j"), left.file("j")).expect("a journal");
    std::fs::DirBuilder::new().mode(0o700).create(left.file("j.files")).expect("a folder");
    for entry in std::fs::read_dir(rig.folder.file("j.files")).expect("a folder").flatten() {
        std::fs::copy(entry.path(), left.file("j.files").join(entry.file_name())).expect("a file");
    }
    left
}

/// Starts a daemon on the remaining files.
fn again(left: Folder) -> (Rig, Vec<String>) {
    let (options, mut told) = (options(&left), MessageKeeper::default());
    let rig = Rig::within(left, "virtual", &options, &mut told).unwrap_or_else(|r| panic!("{r:?}"));
    (rig, told.0)
}

/// Returns why no daemon starts on the remaining files, and checks that they are unchanged.
fn refused(left: &Folder, change: impl FnOnce(&mut Options), watcher: &mut MessageKeeper) -> String {
    let mut options = options(left);
    change(&mut options);
    let before = std::fs::read_to_string(options.journal.as_ref().expect("given")).expect("text");
    let refusals = Server::start_watched(system("virtual"), &options, watcher).err().expect("refused");
    assert_eq!(std::fs::read_to_string(options.journal.expect("given")).expect("text"), before, "it was not changed");
    assert!(!options.socket.expect("given").exists(), "nothing listens");
    refusals.iter().map(ToString::to_string).collect()
}

pub fn text(folder: &Folder) -> String {
    std::fs::read_to_string(folder.file("j")).expect("text")
}

pub fn count(folder: &Folder) -> usize {
    text(folder).lines().count()
}

/// Returns a verb that runs until ended and whose level can be set while it runs.
fn level(name: &str, policy: &str) -> Json {
    let mut verb = wave(name, json!(policy));
    verb["blocks"]["wave"]["constants"] = json!({ "shape": 0 });
    verb["input_parameters"] = json!({ "level": { "targets": ["wave.offset"], "default": 1.0, "tunable": true } });
    verb
}

fn made(rig: &Rig, session: &str, verb: &str, svv: &str) -> u64 {
    rig.call(session, "svv", json!({ "name": svv, "type_text": "double" }));
    let id = rig.call(session, "create", json!({ "verb": verb, "arguments": { "y": { "svv": svv } }, "placement": { "*": "rtp0.fast" } }));
    id.as_u64().expect("a number")
}

fn value(rig: &Rig, svv: &str) -> Json {
    rig.call("", "read", json!({ "names": [svv] }))["values"][svv]["value"].clone()
}

fn states(rig: &Rig) -> Vec<String> {
    let statistics = rig.system.statistics();
    statistics.instances.iter().map(|i| format!("{} {}", i.name, json!(i.state)).replace('"', "")).collect()
}

#[test]
fn what_was_configured_is_there_again_and_what_was_deleted_or_refused_is_not() {
    let rig = kept();
    let session = rig.commander("panel");
    rig.call(&session, "processor", json!({ "name": "rtp1" }));
    rig.call(&session, "svv", json!({ "name": "x", "type_text": "double" }));
    rig.call(&session, "svv", json!({ "name": "gone", "type_text": "double" }));
    rig.call(&session, "delete_svv", json!({ "name": "gone" }));
    rig.call(&session, "define_verb", level("hold", "continue"));
    rig.call(&session, "set_mode", json!({ "mode": "manual" }));
    let (status, _) = rig.ask("POST", "/v1/call/svv", &[("opengpac-session", &session)], r#"{"name": "bad", "type_text": "no"}"#);
    assert_eq!(status, 400);
    assert!(!text(&rig.folder).contains("\"bad\""), "what was refused is not in it");
    assert_eq!(std::fs::metadata(rig.folder.file("j")).expect("it is there").permissions().mode() & 0o777, 0o600);
    let left = killed(&rig);
    assert_eq!(text(&left).lines().next(), Some(r#"{"format":"opengpac journal","version":1,"system":"cell"}"#));
    let (rig, told) = again(left);
    assert_eq!(told.last().map(String::as_str), Some("played 4 of 4 calls, 0 of them failed"));
    assert_eq!(count(&rig.folder), 5, "what cancelled itself out is gone: {}", text(&rig.folder));
    let names = rig.system.names();
    assert_eq!((names.processors, names.svvs), (vec!["rtp0".to_owned(), "rtp1".to_owned()], vec!["y".to_owned(), "x".to_owned()]));
    assert!(names.verbs.contains(&"hold".to_owned()));
    assert_eq!(rig.call("", "mode", json!({})), "manual");
    let last = rig.audit().pop().expect("a line");
    assert_eq!((&last["call"], &last["from"], &last["session"], &last["outcome"]), (&json!("set_mode"), &json!("journal"), &json!("panel"), &json!("ok")));
}

#[test]
fn what_goes_on_without_its_program_runs_again_with_its_last_parameters_and_nothing_else_does() {
    let rig = kept();
    let session = rig.commander("panel");
    for (name, policy) in [("hold", "continue"), ("act", "halt")] {
        rig.call(&session, "define_verb", level(name, policy));
    }
    let first = made(&rig, &session, "hold", "a");
    rig.call(&session, "delete", json!({ "instance": first }));
    let kept = made(&rig, &session, "hold", "b");
    rig.call(&session, "start", json!({ "instance": kept, "values": { "level": 2.0 } }));
    rig.call(&session, "set", json!({ "instance": kept, "values": { "level": 2.5 } }));
    rig.call(&session, "set", json!({ "instance": kept, "values": { "level": 3.5 } }));
    let ended = made(&rig, &session, "hold", "c");
    rig.call(&session, "start", json!({ "instance": ended }));
    rig.call(&session, "halt", json!({ "instance": ended }));
    let suspended = made(&rig, &session, "hold", "d");
    rig.call(&session, "start", json!({ "instance": suspended }));
    rig.call(&session, "suspend", json!({ "instance": suspended }));
    let action = made(&rig, &session, "act", "e");
    rig.call(&session, "start", json!({ "instance": action }));
    let (rig, told) = again(killed(&rig));
    assert_eq!(states(&rig), ["hold#2 running"], "{told:?}");
    rig.system.advance(5_000_000).expect("time");
    assert_eq!(value(&rig, "b"), 3.5);
    assert!(told[0].ends_with("3 instances of sessions that ended with the daemon are not created again"), "{told:?}");
}

#[test]
fn a_call_of_a_verb_in_one_request_is_recorded_before_it_starts_and_gone_with_its_end() {
    let rig = kept();
    let session = rig.commander("panel");
    rig.call(&session, "define_verb", level("hold", "continue"));
    rig.call(&session, "svv", json!({ "name": "a", "type_text": "double" }));
    let application = |level: Json| {
        let values = json!({ "level": level });
        json!({ "verb": "hold", "arguments": { "y": { "svv": "a" } }, "placement": { "*": "rtp0.fast" }, "values": values, "slice_ms": 1 })
    };
    let perform = |level: Json| rig.ask("POST", "/v1/call/perform", &[("opengpac-session", &session)], &application(level).to_string());
    let (status, answer) = perform(json!("loud"));
    assert_eq!((status, class(&answer)), (400, "ValueRefused"), "{answer}");
    assert!(states(&rig).is_empty());
    let (status, answer) = perform(json!(2.0));
    assert_eq!((status, &answer["waiting"], &answer["go_on"]["call"]), (200, &json!(true), &json!("performed")), "{answer}");
    let instance = answer["go_on"]["arguments"]["instance"].clone();
    let (twin, told) = again(killed(&rig));
    assert_eq!(states(&twin).len(), 1, "{told:?}");
    twin.system.advance(5_000_000).expect("time");
    assert_eq!(value(&twin, "a"), 2.0);
    rig.call(&session, "halt", json!({ "instance": instance }));
    assert_eq!(rig.call(&session, "performed", json!({ "instance": instance }))["condition"], "halted");
    assert!(states(&rig).is_empty());
    let (twin, told) = again(killed(&rig));
    assert!(states(&twin).is_empty(), "{told:?}");
}

/// Returns a system whose only source fires on request, so that nothing happens by itself.
fn kept_without_a_timer() -> Rig {
    let system = Arc::new(api::open("cell", "virtual", "{}").unwrap_or_else(|r| panic!("{r:?}")));
    let say = |name: &str, arguments: Json| api::call(&system, name, &arguments.to_string()).unwrap_or_else(|r| panic!("{name}: {r:?}"));
    say("processor", json!({ "name": "rtp0" }));
    say("source", json!({ "processor": "rtp0", "name": "soft", "kind": "software", "priority": 50 }));
    say("svv", json!({ "name": "y", "type_text": "double" }));
    let folder = Folder::new();
    let server = Server::start_watched(system.clone(), &options(&folder), &mut MessageKeeper::default()).unwrap_or_else(|r| panic!("{r:?}"));
    Rig { server, system, folder }
}

#[test]
fn a_call_whose_wait_alone_is_refused_goes_on_as_its_callers() {
    let rig = kept_without_a_timer();
    let session = rig.commander("panel");
    let mut verb = wave("hold", json!("continue"));
    verb["command_lists"]["start"]["commands"] = json!([{ "command": "activate", "block": "wave" }]);
    rig.call(&session, "define_verb", verb);
    let asked = json!({ "verb": "hold", "arguments": { "y": { "svv": "y" } }, "placement": { "*": "rtp0.soft" }, "slice_ms": 1000 });
    let (_, answer) = rig.ask("POST", "/v1/call/perform", &[("opengpac-session", &session)], &asked.to_string());
    assert!(class(&answer) == "InvalidState" && answer.to_string().contains("the wait would never end"), "{answer}");
    assert_eq!(states(&rig), ["hold#1 running"]);
    assert!(!text(&rig.folder).contains("deleted"), "the journal has it: {}", text(&rig.folder));
    rig.system.halt(rig.system.statistics().instances[0].id).unwrap_or_else(|r| panic!("{r:?}"));
    let (_, kept) = rig.ask("GET", "/v1/sessions/panel/reports", &[("opengpac-session", &session)], "");
    assert_eq!(kept["result"]["reports"][0]["report"]["condition"], "halted", "its end is told to its session: {kept}");
}

#[test]
fn its_caller_comes_back_to_what_runs_and_of_a_closed_session_all_is_there() {
    let rig = kept();
    let builder = rig.commander("builder");
    rig.call(&builder, "define_verb", level("hold", "continue"));
    let idle = made(&rig, &builder, "hold", "a");
    assert_eq!(rig.ask("DELETE", "/v1/sessions", &[("opengpac-session", &builder)], "").0, 200);
    let panel = rig.commander("panel");
    let id = made(&rig, &panel, "hold", "b");
    rig.call(&panel, "start", json!({ "instance": id }));
    let (rig, _) = again(killed(&rig));
    assert_eq!(states(&rig), ["hold#1 created", "hold#2 running"], "{idle}");
    let (_, answer) = rig.ask("POST", "/v1/sessions", &[], r#"{"name": "panel"}"#);
    let opened = &answer["result"];
    assert_eq!((&opened["returned"], &opened["instances"][0]["name"], &opened["instances"][0]["state"]), (&json!(true), &json!("hold#2"), &json!("running")));
    let session = rig.open("other");
    assert_eq!(rig.ask("GET", "/v1/sessions", &[("opengpac-session", &session)], "").1["result"].as_array().map(Vec::len), Some(2));
}

#[test]
fn an_end_that_nobody_called_for_is_known_too() {
    let rig = kept();
    let session = rig.commander("panel");
    let mut verb = level("hold", "continue");
    verb["blocks"]["clock"] = json!({ "block": { "subroutine": "library.time_limit" }, "constants": { "limit": 0.003 } });
    verb["command_lists"]["start"]["commands"].as_array_mut().expect("a list").push(json!({ "command": "activate", "block": "clock", "every_ns": 1_000_000 }));
    verb["conditions"] = json!({ "over": { "on": ["clock.expired"] } });
    rig.call(&session, "define_verb", verb);
    let id = made(&rig, &session, "hold", "a");
    rig.call(&session, "start", json!({ "instance": id }));
    assert!(text(&rig.folder).contains(r#""call":"start""#));
    rig.system.advance(10_000_000).expect("time");
    rig.until(|rig| text(&rig.folder).contains(r#"{"line":"became","of":{"instance":1},"state":"ended"}"#));
    let (rig, _) = again(killed(&rig));
    assert!(states(&rig).is_empty());
}

#[test]
fn a_latched_emergency_stop_stays_latched_until_somebody_resets_it() {
    let rig = kept();
    let session = rig.commander("panel");
    rig.call(&session, "define_verb", level("hold", "continue"));
    let id = made(&rig, &session, "hold", "a");
    rig.call(&session, "start", json!({ "instance": id }));
    rig.call("", "emergency_stop", json!({ "reason": "door" }));
    let (rig, _) = again(killed(&rig));
    assert_eq!(rig.system.latched().as_deref(), Some("door"));
    assert!(states(&rig).is_empty());
    let session = rig.commander("panel");
    rig.call(&session, "reset", json!({}));
    let (rig, _) = again(killed(&rig));
    assert_eq!(rig.system.latched(), None);
}

#[test]
fn a_daemon_that_ended_in_order_starts_nothing_again() {
    let mut rig = kept();
    let session = rig.commander("panel");
    rig.call(&session, "define_verb", level("hold", "continue"));
    let id = made(&rig, &session, "hold", "a");
    rig.call(&session, "start", json!({ "instance": id }));
    rig.server.stop();
    let (rig, _) = again(killed(&rig));
    assert!(states(&rig).is_empty());
    assert!(rig.system.names().verbs.contains(&"hold".to_owned()));
}

#[test]
fn a_code_module_is_downloaded_again_and_content_that_nobody_needs_goes() {
    let rig = kept();
    let session = rig.commander("panel");
    let source = "#include <opengpac.h>\nFUNCTION_BLOCK(gain, \"Gain: y = 2 u.\", in(double, u, \"input\"), out(double, y, \"output\"))\n{\n    self->y = 2 * self->u;\n    return OK;\n}\n";
    let digest: String = Sha256::digest(source.as_bytes()).iter().map(|byte| format!("{byte:02x}")).collect();
    let mut stream = rig.connect();
    send(&mut stream, "PUT", &format!("/v1/modules/amp?file=gain.c&sha256={digest}"), &[("opengpac-session", &session)], source.as_bytes());
    let (status, answer) = receive(&mut stream);
    assert_eq!(status, 200, "{answer}");
    let left = killed(&rig);
    std::fs::write(left.file("j.files").join("0".repeat(64)), "of a device that was deleted").expect("ours");
    let (rig, told) = again(left);
    assert_eq!(told, ["played 1 of 1 calls, 0 of them failed"]);
    assert!(rig.system.names().blocks.contains(&"amp.gain".to_owned()));
    let there: Vec<_> = std::fs::read_dir(rig.folder.file("j.files")).expect("a folder").flatten().map(|entry| entry.file_name()).collect();
    assert_eq!(there, [std::ffi::OsString::from(&digest)]);
    let left = killed(&rig);
    std::fs::write(left.file("j.files").join(&digest), "changed").expect("ours");
    let (_, told) = again(left);
    assert!(told.iter().any(|text| text.contains("line 2: module 'amp' failed")), "{told:?}");
}

#[test]
fn a_call_that_fails_is_named_and_with_strict_it_ends_the_start() {
    let rig = kept();
    let session = rig.commander("panel");
    rig.call(&session, "svv", json!({ "name": "x", "type_text": "double" }));
    let changed = |of: &str, to: &str| {
        let left = killed(&rig);
        std::fs::write(left.file("j"), text(&left).replace(of, to)).expect("ours");
        left
    };
    let expected = "line 2: call 'svv' failed: ";
    let (after, told) = again(changed(r#""double""#, r#""nothing""#));
    assert!(told[0].contains(expected) && told[1] == "played 1 of 1 calls, 1 of them failed", "{told:?}");
    assert!(after.system.log_since(0).iter().any(|entry| entry.kind == "journal" && entry.text.contains(expected)));
    assert!(text(&after.folder).contains("nothing"), "it is kept for a daemon that can make it");
    let strict = changed(r#""double""#, r#""nothing""#);
    assert!(refused(&strict, |options| options.journal_strict = true, &mut MessageKeeper::default()).contains(expected));
    let (_, told) = again(changed(r#""role":"download""#, r#""role":"operate""#));
    assert!(told[0].contains("'svv' needs the role configure"), "{told:?}");
    let (_, told) = again(changed(r#""arguments""#, r#""withheld":["token"],"arguments""#));
    assert!(told[0].contains("its argument 'token' is a secret, which a journal does not contain; call 'svv' again"), "{told:?}");
}

#[test]
fn nothing_is_started_where_what_watches_over_it_is_missing() {
    let rig = kept();
    let session = rig.commander("panel");
    rig.call(&session, "define_verb", level("hold", "continue"));
    let id = made(&rig, &session, "hold", "a");
    rig.call(&session, "start", json!({ "instance": id }));
    let left = killed(&rig);
    let by = r#"{"who":"user 0","role":"download","session":"","time":0.0}"#;
    let line = format!(r#"{{"line":"call","call":"emergency_stop_input","arguments":{{"device":"door","channel":"open"}},"by":{by}}}"#);
    std::fs::write(left.file("j"), text(&left) + &line + "\n").expect("ours");
    let (rig, told) = again(left);
    assert!(told.iter().any(|text| text.contains("nothing was started: the monitoring of the machine could not be set up again")), "{told:?}");
    assert!(!states(&rig).iter().any(|state| state.contains("running")));
}

#[test]
fn a_file_that_is_not_of_this_daemon_is_refused_and_left_alone() {
    let rig = kept();
    let session = rig.commander("panel");
    rig.call(&session, "svv", json!({ "name": "x", "type_text": "double" }));
    let refusal = |changed: &dyn Fn(String) -> String| {
        let left = killed(&rig);
        std::fs::write(left.file("j"), changed(text(&left))).expect("ours");
        refused(&left, |_| {}, &mut MessageKeeper::default())
    };
    assert!(refusal(&|text| text.replace("\"line\":\"call\"", "\"line\":\"cal\"")).contains("line 2: unknown variant"));
    assert!(refusal(&|text| text.replace("\"version\":1", "\"version\":2")).contains("line 1: it has version 2"));
    assert!(
        refusal(&|text| text.replace("\"cell\"", "\"press\"")).contains("belongs to system 'press', but this is 'cell'; start the daemon under that --name")
    );
    assert!(refusal(&|_| "something else".to_owned()).contains("line 1: EOF"));
    assert!(refusal(&|text| text + "\n").contains("line 3: EOF"));
}

#[test]
fn a_last_line_that_was_cut_short_is_left_out_and_told() {
    let rig = kept();
    let session = rig.commander("panel");
    rig.call(&session, "svv", json!({ "name": "a", "type_text": "double" }));
    rig.call(&session, "svv", json!({ "name": "b", "type_text": "double" }));
    let left = killed(&rig);
    let whole = text(&left);
    std::fs::write(left.file("j"), &whole[..whole.len() - 9]).expect("ours");
    let (rig, told) = again(left);
    assert!(told[0].contains("line 3: the last line was cut short"), "{told:?}");
    assert_eq!(rig.system.names().svvs, ["y", "a"]);
    assert_eq!(count(&rig.folder), 2);
}

#[test]
fn a_journal_is_one_daemons() {
    let rig = kept();
    let elsewhere = |options: &mut Options| options.socket = Some(rig.folder.file("t"));
    assert!(refused(&rig.folder, elsewhere, &mut MessageKeeper::default()).contains("another daemon keeps the journal"));
}

#[test]
fn playing_can_be_ended_and_leaves_the_journal_as_it_was() {
    let rig = kept();
    let session = rig.commander("panel");
    rig.call(&session, "define_verb", level("hold", "continue"));
    let id = made(&rig, &session, "hold", "a");
    rig.call(&session, "start", json!({ "instance": id }));
    let left = killed(&rig);
    let ended = refused(&left, |_| {}, &mut MessageKeeper(Vec::new(), 4));
    assert!(ended.contains("stopped when 1 of 4 calls of its journal had been played"), "{ended:?}");
}

#[test]
fn a_file_that_has_grown_is_written_anew_while_it_is_served() {
    let rig = kept();
    let session = rig.commander("panel");
    for letter in ["a", "b", "c", "d", "e", "f"] {
        rig.call(&session, "define_alarm", json!({ "code": "hot", "text": letter.repeat(900_000) }));
    }
    assert!(text(&rig.folder).len() < 2_000_000);
    let (rig, _) = again(killed(&rig));
    assert_eq!(count(&rig.folder), 2);
}

#[test]
fn what_only_operates_is_not_recorded() {
    let rig = kept();
    let session = rig.commander("panel");
    let before = count(&rig.folder);
    rig.call(&session, "write", json!({ "name": "y", "value": 1.0 }));
    rig.call(&session, "advance", json!({ "duration_ns": 1_000_000 }));
    rig.call(&session, "now", json!({}));
    assert_eq!(count(&rig.folder), before);
    let (status, answer) = rig.ask("POST", "/v1/call/write", &[("opengpac-session", &session)], r#"{"name": "no", "value": 1.0}"#);
    assert_eq!((status, class(&answer)), (404, "UnknownName"));
}

#[test]
fn workspaces_are_there_again_and_keeping_one_needs_no_command() {
    let rig = kept();
    let session = rig.commander("panel");
    let of = |name: &str, panel: &str| json!({ "name": name, "layout": { "panel": panel } });
    rig.call(&session, "ship_workspace", of("shipped", "alarms"));
    rig.call(&session, "ship_workspace", of("gone", "alarms"));
    rig.call(&session, "withdraw_workspace", json!({ "name": "gone" }));
    // A workspace moves nothing: any session that may operate can keep one, with or without command. The things it names need not exist.
    let other = rig.open("other");
    let mut mine = of("mine", "verb");
    mine["layout"]["verb"] = json!("no_such");
    rig.call(&other, "keep_workspace", of("mine", "alarms"));
    rig.call(&other, "keep_workspace", mine.clone());
    rig.call(&other, "keep_workspace", of("forgotten", "alarms"));
    rig.call(&other, "forget_workspace", json!({ "name": "forgotten" }));
    let missing = rig.call("", "check_workspace", mine.clone());
    assert!(missing[0]["message"].as_str().is_some_and(|m| m.contains("no verb 'no_such'")), "{missing}");
    let headers = [("opengpac-session", other.as_str())];
    let (status, answer) = rig.ask("POST", "/v1/call/ship_workspace", &headers, &of("x", "alarms").to_string());
    assert_eq!((status, class(&answer)), (403, "NotCommanding"));
    let (rig, _) = again(killed(&rig));
    let names: Vec<Json> = rig.call("", "workspaces", json!({})).as_array().expect("a list").iter().map(|one| json!([one["name"], one["shipped"]])).collect();
    assert_eq!(names, [json!(["shipped", true]), json!(["mine", false])]);
    assert_eq!(rig.call("", "workspace", json!({ "name": "mine" })), mine);
}

#[test]
fn a_daemon_that_is_killed_right_after_an_emergency_stop_starts_strictly() {
    let rig = kept();
    let session = rig.commander("panel");
    rig.call(&session, "define_verb", level("hold", "continue"));
    let kept = made(&rig, &session, "hold", "a");
    rig.call(&session, "start", json!({ "instance": kept }));
    let running = text(&rig.folder);
    rig.call(&session, "emergency_stop", json!({ "reason": "door" }));
    // States of the file if the ends were not written, and if a start was written after the stop.
    let start = running.lines().last().expect("the start").to_owned() + "\n";
    let stopped = "{\"line\":\"stopped\",\"reason\":\"door\"}\n";
    for on_the_disk in [text(&rig.folder), format!("{running}{stopped}"), running.replace(&start, &format!("{stopped}{start}"))] {
        let left = killed(&rig);
        std::fs::write(left.file("j"), on_the_disk).expect("ours");
        let strict = Options { journal_strict: true, ..options(&left) };
        let after = Rig::within(left, "virtual", &strict, &mut MessageKeeper::default()).unwrap_or_else(|r| panic!("{r:?}"));
        assert_eq!(after.system.latched().as_deref(), Some("door"));
        assert!(!states(&after).iter().any(|state| state.ends_with("running")), "{:?}", states(&after));
    }
}

#[test]
fn an_end_is_written_before_anybody_is_told_of_it() {
    let rig = kept();
    let session = rig.commander("panel");
    let mut verb = level("hold", "continue");
    verb["blocks"]["clock"] = json!({ "block": { "subroutine": "library.time_limit" }, "constants": { "limit": 0.005 } });
    verb["conditions"] = json!({ "over": { "on": ["clock.expired"], "returns": [] } });
    verb["command_lists"]["start"]["commands"] =
        json!([{ "command": "activate", "block": "wave", "every_ns": 1_000_000 }, { "command": "activate", "block": "clock", "every_ns": 1_000_000 }]);
    rig.call(&session, "define_verb", verb);
    let kept = made(&rig, &session, "hold", "a");
    rig.call(&session, "start", json!({ "instance": kept }));
    let report = rig.call(&session, "wait", json!({ "instance": kept }));
    assert_eq!(report["condition"], "over", "{report}");
    let (after, told) = again(killed(&rig));
    assert!(!states(&after).iter().any(|state| state.ends_with("running")), "{told:?}");
}

#[test]
fn what_others_can_write_is_no_journal() {
    let rig = kept();
    for (name, mode) in [("j", 0o602), ("j", 0o620), ("j.files", 0o777)] {
        let left = killed(&rig);
        std::fs::set_permissions(left.file(name), std::fs::Permissions::from_mode(mode)).expect("ours");
        let refused = refused(&left, |_| {}, &mut MessageKeeper::default());
        assert!(refused.contains("others may write") && refused.contains("chmod go-w"), "{refused}");
    }
}
