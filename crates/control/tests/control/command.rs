// SPDX-License-Identifier: Apache-2.0
//! Requests for command, hand-over and refusal: on the table of sessions with a time set by the test, and once over a socket.
use crate::rig::Rig;
use api::Role;
use daemon::requests::OpenSession;
use daemon::{Caller, Outcome, SETTLED_MAX, Sessions};
use model::refusal::Class;
use serde_json::json;
use std::time::{Duration, Instant};

fn s(seconds: u64) -> Duration {
    Duration::from_secs(seconds)
}

/// Opens sessions with these names that may operate, `looker`, which may not, and `holder`, which commands.
fn three(now: Instant) -> (Sessions, Vec<String>) {
    let sessions = Sessions::default();
    let open = |name: &str, role| {
        let caller = Caller { who: format!("token {name}"), role, from: "here".to_owned() };
        let person = (name == "anna").then(|| "Anna Maier".to_owned());
        let asked = OpenSession { name: name.to_owned(), lost_after_ms: 5_000, take_up: false, person };
        sessions.open(&caller, &asked, now).expect("it opens").session
    };
    let ids = vec![open("holder", Role::Operate), open("anna", Role::Operate), open("bert", Role::Operate), open("looker", Role::Observe)];
    sessions.take("holder", Role::Operate, false).expect("free");
    (sessions, ids)
}

/// Returns the outcome of each request in order: name, outcome, and who settled it.
fn ends(sessions: &Sessions, now: Instant) -> Vec<(String, Outcome, Option<String>)> {
    sessions.command(now).settled.into_iter().map(|settled| (settled.name, settled.outcome, settled.by)).collect()
}

fn end(name: &str, outcome: Outcome, by: Option<&str>) -> (String, Outcome, Option<String>) {
    (name.to_owned(), outcome, by.map(str::to_owned))
}

#[test]
fn the_holder_sees_who_asks_and_hands_over() {
    let now = Instant::now();
    let (sessions, _) = three(now);
    let number = sessions.ask("anna", "the gripper sticks", s(60), now);
    sessions.ask("bert", "", s(60), now);
    let told = sessions.command(now + s(10));
    assert_eq!((told.holder.as_deref(), told.who.as_deref(), told.person), (Some("holder"), Some("token holder"), None));
    let first = &told.requests[0];
    assert_eq!((first.number, first.name.as_str(), first.who.as_str(), first.person.as_deref()), (number, "anna", "token anna", Some("Anna Maier")));
    assert_eq!((first.reason.as_str(), first.left_ms, told.requests.len()), ("the gripper sticks", 50_000, 2));
    assert_eq!(sessions.hand_over("anna", "anna").expect_err("not the holder").class(), Class::NotCommanding);
    sessions.hand_over("holder", "anna").expect("handed over");
    let told = sessions.command(now);
    assert_eq!((told.holder.as_deref(), told.person.as_deref()), (Some("anna"), Some("Anna Maier")));
    assert_eq!(told.requests.iter().map(|asks| asks.name.as_str()).collect::<Vec<_>>(), ["bert"], "who else asks goes on asking");
    assert_eq!(ends(&sessions, now), [end("anna", Outcome::Granted, Some("holder"))]);
    let refused = sessions.require_command(Some("holder")).expect_err("handed over");
    assert!(refused.refusals[0].message.contains("session 'anna' of Anna Maier"), "{refused:?}");
}

#[test]
fn command_is_handed_to_no_one_who_cannot_have_it() {
    let now = Instant::now();
    let (sessions, _) = three(now);
    assert_eq!(sessions.hand_over("holder", "nobody").expect_err("none").class(), Class::UnknownName);
    assert_eq!(sessions.hand_over("holder", "looker").expect_err("observes").class(), Class::NotAllowed);
    sessions.begin(&sessions_id(&sessions, "holder"), &caller("holder"), now + s(60)).expect("a sign of life");
    sessions.lose(now + s(60));
    assert_eq!(sessions.hand_over("holder", "anna").expect_err("lost").class(), Class::UnknownName);
    assert_eq!(sessions.holder().as_deref(), Some("holder"));
}

fn caller(name: &str) -> Caller {
    Caller { who: format!("token {name}"), role: Role::Operate, from: "here".to_owned() }
}

/// Resumes a session to get its ID.
fn sessions_id(sessions: &Sessions, name: &str) -> String {
    let asked = OpenSession { name: name.to_owned(), lost_after_ms: 60_000, take_up: true, person: None };
    sessions.open(&caller(name), &asked, Instant::now()).expect("taken up").session
}

#[test]
fn a_request_is_declined_withdrawn_or_runs_out_each_with_its_reason() {
    let now = Instant::now();
    let (sessions, ids) = three(now);
    sessions.ask("anna", "", s(60), now);
    assert_eq!(sessions.decline("holder", "bert", "").expect_err("does not ask").class(), Class::UnknownName);
    assert_eq!(sessions.decline("bert", "anna", "").expect_err("not the holder").class(), Class::NotCommanding);
    sessions.decline("holder", "anna", "the tool is being changed").expect("declined");
    sessions.ask("anna", "", s(60), now);
    sessions.withdraw("anna", "not needed any more").expect("withdrawn");
    assert_eq!(sessions.withdraw("anna", "").expect_err("twice").class(), Class::InvalidState);
    sessions.ask("anna", "", s(3), now);
    assert_eq!(sessions.command(now + s(2)).requests.len(), 1);
    assert_eq!(sessions.command(now + s(3)).requests.len(), 0);
    sessions.ask("bert", "", s(60), now);
    sessions.close(&ids[2]).expect("it closes");
    let expected = [
        end("anna", Outcome::Declined, Some("holder")),
        end("anna", Outcome::Withdrawn, Some("anna")),
        end("anna", Outcome::TimedOut, None),
        end("bert", Outcome::Withdrawn, None),
    ];
    assert_eq!(ends(&sessions, now), expected);
    let lines: Vec<String> = sessions.settle(now).iter().map(daemon::SettledRequest::line).collect();
    assert_eq!(lines[0], "the request of session 'anna' for command was declined by session 'holder': the tool is being changed");
    assert!(lines[2].ends_with("has timed out: session 'holder' did not answer in time"), "{lines:?}");
    assert!(sessions.settle(now).is_empty(), "once");
}

#[test]
fn command_that_is_given_back_or_lost_goes_to_who_asked_first() {
    let now = Instant::now();
    let (sessions, ids) = three(now);
    sessions.ask("anna", "", s(60), now);
    sessions.ask("bert", "", s(60), now);
    sessions.give_back("holder");
    assert_eq!(sessions.holder().as_deref(), Some("anna"));
    sessions.ask("holder", "", s(60), now);
    sessions.close(&ids[1]).expect("it closes");
    assert_eq!(sessions.holder().as_deref(), Some("bert"), "who asked first, not who asked last");
    // All of them are silent: command is not given to a lost session.
    sessions.lose(now + s(99));
    assert_eq!(sessions.holder(), None);
    let outcomes: Vec<Outcome> = sessions.command(now + s(99)).settled.into_iter().map(|settled| settled.outcome).collect();
    assert!(!outcomes[2..].contains(&Outcome::Granted), "{outcomes:?}");
}

#[test]
fn a_request_where_nobody_commands_is_granted_and_force_still_takes() {
    let now = Instant::now();
    let (sessions, _) = three(now);
    sessions.give_back("holder");
    sessions.ask("anna", "", s(60), now);
    assert_eq!(sessions.holder().as_deref(), Some("anna"));
    sessions.ask("bert", "", s(60), now);
    sessions.take("bert", Role::Configure, true).expect("by force");
    assert_eq!(sessions.holder().as_deref(), Some("bert"));
    assert_eq!(ends(&sessions, now).last(), Some(&end("bert", Outcome::Granted, Some("bert"))));
}

#[test]
fn what_is_told_of_the_past_is_bounded() {
    let now = Instant::now();
    let (sessions, _) = three(now);
    for _ in 0..SETTLED_MAX + 3 {
        sessions.ask("anna", "", s(60), now);
        sessions.decline("holder", "anna", "").expect("declined");
    }
    let told = sessions.command(now).settled;
    assert_eq!((told.len(), told[0].number), (SETTLED_MAX, 4));
}

#[test]
fn it_is_asked_for_over_a_socket_and_the_log_has_it() {
    let rig = Rig::new();
    let first = rig.commander("first");
    let (status, answer) = rig.ask("POST", "/v1/sessions", &[], &json!({ "name": "second", "person": "Bert" }).to_string());
    assert_eq!(status, 200, "{answer}");
    let second = answer["result"]["session"].as_str().expect("an ID").to_owned();
    let ask = |session: &str, method: &str, path: &str, body: serde_json::Value| rig.ask(method, path, &[("opengpac-session", session)], &body.to_string());
    for wrong in [json!({ "wait_ms": 5 }), json!({ "reason": "a\nb" }), json!({ "why": "" })] {
        assert_eq!(ask(&second, "POST", "/v1/command/request", wrong).0, 400);
    }
    let (status, answer) = ask(&second, "POST", "/v1/command/request", json!({ "reason": "shift change" }));
    assert_eq!((status, &answer["result"]["requests"][0]["person"]), (200, &json!("Bert")), "{answer}");
    assert_eq!(ask(&second, "POST", "/v1/command/hand_over", json!({ "to": "second" })).0, 403);
    let (status, answer) = ask(&first, "POST", "/v1/command/decline", json!({ "name": "second", "reason": "in a minute" }));
    assert_eq!((status, &answer["result"]["settled"][0]["outcome"]), (200, &json!("declined")), "{answer}");
    ask(&second, "POST", "/v1/command/request", json!({}));
    // A session that requests command can still stop.
    let instance = rig.running(&first, "wave");
    assert_eq!(rig.call(&second, "halt", json!({ "instance": instance }))["condition"], "halted");
    let (status, answer) = ask(&first, "POST", "/v1/command/hand_over", json!({ "to": "second" }));
    assert_eq!((status, &answer["result"]["holder"]), (200, &json!("second")), "{answer}");
    let log = rig.call("", "log", json!({}));
    let said: Vec<String> = log.as_array().expect("a list").iter().map(|entry| format!("{} {} {}", entry["who"], entry["text"], entry["about"])).collect();
    for wanted in [r#"(Bert, user"#, "request_command", "decline_request", r#""hand_over_command" "second""#] {
        assert!(said.iter().any(|line| line.contains(wanted)), "{wanted}: {said:#?}");
    }
}
