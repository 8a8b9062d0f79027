// SPDX-License-Identifier: Apache-2.0
//! Sessions in isolation, with a time set by the test.
use api::Role;
use daemon::requests::OpenSession;
use daemon::{Caller, REPORTS_MAX, SESSIONS_EACH_MAX, SESSIONS_MAX, Sessions};
use model::refusal::Class;
use std::time::{Duration, Instant};
use supervisor::{End, Report};

fn caller(who: &str, role: Role) -> Caller {
    Caller { who: who.to_owned(), role, from: "here".to_owned() }
}

fn asked(name: &str, take_up: bool) -> OpenSession {
    OpenSession { name: name.to_owned(), lost_after_ms: 5_000, take_up, person: None }
}

fn end(number: u64, instance: u64) -> End {
    let report = Report {
        instance: format!("wave {instance}"),
        verb: "wave".to_owned(),
        start: 1,
        condition: "halted".to_owned(),
        normal: false,
        command_list: "start".to_owned(),
        block: None,
        time_s: 0.0,
        started_s: 0.0,
        value: None,
        message: String::new(),
        outputs: Default::default(),
        others: Vec::new(),
        way: Vec::new(),
    };
    End { number, instance, report }
}

fn s(seconds: u64) -> Duration {
    Duration::from_secs(seconds)
}

#[test]
fn a_session_is_lost_when_it_is_silent_longer_than_its_bound() {
    let (sessions, now, me) = (Sessions::default(), Instant::now(), caller("user 1", Role::Operate));
    let id = sessions.open(&me, &asked("panel", false), now).expect("it opens").session;
    sessions.make("panel", 7);
    sessions.begin(&id, &me, now + s(4)).expect("a sign of life");
    assert!(sessions.lose(now + s(60)).is_empty(), "it waits for an answer");
    sessions.end(&id, now + s(60));
    assert!(sessions.lose(now + s(65)).is_empty());
    assert_eq!(sessions.lose(now + s(66)), [("panel".to_owned(), vec![7])]);
    assert!(sessions.lose(now + s(99)).is_empty(), "once");
    assert_eq!(sessions.begin(&id, &me, now + s(66)).expect_err("lost").class(), Class::SessionLost);
    assert_eq!(sessions.orphans(), [(7, true)]);
    let back = sessions.open(&me, &asked("panel", false), now + s(70)).expect("it comes back");
    assert!(back.returned && back.instances == [7] && back.session != id);
    assert!(sessions.orphans().is_empty());
}

#[test]
fn a_daemon_that_stood_still_itself_loses_nobody_for_that() {
    let (sessions, now, me) = (Sessions::default(), Instant::now(), caller("user 1", Role::Operate));
    let id = sessions.open(&me, &asked("panel", false), now).expect("it opens").session;
    sessions.begin(&id, &me, now + s(2)).expect("a sign of life");
    sessions.end(&id, now + s(2));
    sessions.stood_still(s(20), now + s(24));
    assert!(sessions.lose(now + s(24)).is_empty());
    assert!(sessions.lose(now + s(27)).is_empty());
    assert_eq!(sessions.lose(now + s(28)), [("panel".to_owned(), Vec::new())], "its silence counts from then on");
    let id = sessions.open(&me, &asked("panel", false), now + s(30)).expect("it comes back").session;
    sessions.begin(&id, &me, now + s(49)).expect("it was heard first");
    sessions.end(&id, now + s(49));
    sessions.stood_still(s(20), now + s(50));
    assert_eq!(sessions.lose(now + s(56)), [("panel".to_owned(), Vec::new())], "nobody was heard later than now");
}

#[test]
fn a_connection_that_breaks_loses_its_session_at_once() {
    let (sessions, now, me) = (Sessions::default(), Instant::now(), caller("user 1", Role::Operate));
    let id = sessions.open(&me, &asked("panel", false), now).expect("it opens").session;
    sessions.hold(&id);
    assert!(sessions.list()[0].held);
    sessions.let_go(&id, true);
    assert_eq!(sessions.lose(now), [("panel".to_owned(), Vec::new())]);
}

#[test]
fn only_the_same_caller_takes_a_session_up() {
    let (sessions, now) = (Sessions::default(), Instant::now());
    let (me, other) = (caller("user 1", Role::Operate), caller("token x", Role::Download));
    let first = sessions.open(&me, &asked("panel", false), now).expect("it opens").session;
    assert_eq!(sessions.open(&me, &asked("panel", false), now).expect_err("alive").class(), Class::InUse);
    assert_eq!(sessions.open(&other, &asked("panel", true), now).expect_err("another's").class(), Class::InUse);
    let second = sessions.open(&me, &asked("panel", true), now).expect("taken up");
    assert!(!second.returned);
    assert_eq!(sessions.begin(&first, &me, now).expect_err("superseded").class(), Class::SessionLost);
    assert_eq!(sessions.begin(&second.session, &other, now).expect_err("another's").class(), Class::SessionLost);
    sessions.lose(now + s(99));
    assert_eq!(sessions.open(&other, &asked("panel", true), now).expect_err("kept for its caller").class(), Class::InUse);
}

#[test]
fn command_has_one_holder() {
    let (sessions, now, me) = (Sessions::default(), Instant::now(), caller("user 1", Role::Operate));
    let ids: Vec<String> = ["a", "b"].iter().map(|name| sessions.open(&me, &asked(name, false), now).expect("it opens").session).collect();
    assert_eq!(sessions.require_command(Some("a")).expect_err("nobody").class(), Class::NotCommanding);
    sessions.take("a", Role::Operate, false).expect("free");
    sessions.take("a", Role::Operate, false).expect("twice is once");
    let refused = sessions.take("b", Role::Operate, true).expect_err("held");
    assert!(refused.class() == Class::NotCommanding && refused.refusals[0].message.contains("'a'"));
    assert!(sessions.require_command(None).is_err() && sessions.require_command(Some("b")).is_err());
    sessions.give_back("b");
    sessions.require_command(Some("a")).expect("only the holder gives it back");
    sessions.take("b", Role::Configure, true).expect("by force");
    assert!(sessions.require_command(Some("a")).is_err());
    sessions.close(&ids[1]).expect("it closes");
    assert_eq!(sessions.holder(), None);
    sessions.take("a", Role::Operate, false).expect("free again");
    sessions.lose(now + s(99));
    assert_eq!(sessions.holder(), None, "who is lost commands no longer");
}

#[test]
fn reports_wait_until_the_session_shows_that_it_has_them() {
    let (sessions, now, me) = (Sessions::default(), Instant::now(), caller("user 1", Role::Operate));
    let id = sessions.open(&me, &asked("panel", false), now).expect("it opens").session;
    sessions.make("panel", 7);
    sessions.keep(vec![end(0, 7), end(1, 8), end(2, 7)]);
    sessions.keep(vec![end(2, 7)]);
    let numbers = || sessions.reports("panel", &me).expect("mine").0.iter().map(|kept| kept.number).collect::<Vec<_>>();
    assert_eq!((numbers(), sessions.next_end()), (vec![0, 2], 3), "each once, and only its own");
    sessions.told("panel", 7);
    assert_eq!(numbers(), [0, 2], "the answer may have been lost on its way");
    sessions.begin(&id, &me, now).expect("a sign of life");
    assert!(numbers().is_empty());
    let other = caller("token x", Role::Operate);
    assert_eq!(sessions.reports("panel", &other).expect_err("another's").class(), Class::NotAllowed);
    sessions.reports("panel", &caller("token y", Role::Configure)).expect("who configures may");
    assert_eq!(sessions.reports("nobody", &me).expect_err("none").class(), Class::UnknownName);
}

#[test]
fn what_is_kept_is_bounded_and_what_is_lost_is_counted() {
    let (sessions, now, me) = (Sessions::default(), Instant::now(), caller("user 1", Role::Operate));
    sessions.open(&me, &asked("panel", false), now).expect("it opens");
    sessions.make("panel", 7);
    sessions.keep((0..REPORTS_MAX as u64 + 3).map(|number| end(number, 7)).collect());
    let (kept, lost) = sessions.reports("panel", &me).expect("mine");
    assert_eq!((kept.len(), kept[0].number, lost), (REPORTS_MAX, 3, 3));
    sessions.collect("panel", &me, 5).expect("mine");
    let (kept, lost) = sessions.reports("panel", &me).expect("mine");
    assert_eq!((kept[0].number, lost), (6, 0));
}

#[test]
fn there_is_room_as_long_as_one_is_lost() {
    let (sessions, now) = (Sessions::default(), Instant::now());
    let of = |index: usize| caller(&format!("token {}", index / SESSIONS_EACH_MAX), Role::Operate);
    for index in 0..SESSIONS_MAX {
        sessions.open(&of(index), &asked(&format!("s{index}"), false), now + s(index as u64)).expect("room");
    }
    let (late, other) = (now + s(SESSIONS_MAX as u64), caller("token new", Role::Operate));
    assert_eq!(sessions.open(&other, &asked("more", false), late).expect_err("full").class(), Class::LimitExceeded);
    sessions.make("s0", 7);
    assert!(!sessions.lose(late).is_empty());
    sessions.open(&other, &asked("more", false), late).expect("a lost one makes room");
    let names: Vec<String> = sessions.list().into_iter().map(|listed| listed.name).collect();
    assert_eq!(names.len(), SESSIONS_MAX);
    assert!(names.contains(&"s0".to_owned()) && !names.contains(&"s1".to_owned()), "first those for which nothing is kept");
}

#[test]
fn nobody_fills_the_table_for_all() {
    let (sessions, now) = (Sessions::default(), Instant::now());
    let (me, other) = (caller("token a", Role::Observe), caller("token b", Role::Operate));
    sessions.open(&other, &asked("mine", false), now).expect("room");
    sessions.lose(now + s(99));
    for index in 0..SESSIONS_EACH_MAX {
        sessions.open(&me, &asked(&format!("s{index}"), false), now + s(99)).expect("room");
    }
    assert_eq!(sessions.open(&me, &asked("more", false), now + s(99)).expect_err("enough").class(), Class::LimitExceeded);
    sessions.lose(now + s(999));
    for index in 0..SESSIONS_MAX {
        sessions.open(&me, &asked(&format!("t{index}"), false), now + s(999 + 10 * index as u64)).expect("his own make room");
        sessions.lose(now + s(999 + 10 * index as u64 + 6));
    }
    assert!(sessions.list().iter().any(|listed| listed.name == "mine"), "what is kept for others stays");
}

#[test]
fn a_lost_session_takes_along_what_it_made_and_not_what_it_started() {
    let (sessions, now, me) = (Sessions::default(), Instant::now(), caller("user 1", Role::Operate));
    let id = sessions.open(&me, &asked("maker", false), now).expect("it opens").session;
    sessions.make("maker", 7);
    sessions.open(&me, &asked("panel", false), now).expect("it opens");
    // Instance 8 belongs to the program.
    sessions.own("panel", 7);
    sessions.own("panel", 8);
    sessions.begin(&id, &me, now + s(9)).expect("a sign of life");
    assert_eq!(sessions.lose(now + s(10)), [("panel".to_owned(), vec![7, 8])], "both are halted");
    assert_eq!(sessions.orphans(), [(7, false), (8, false)], "7 is its maker's, which is alive");
    sessions.end(&id, now + s(10));
    sessions.lose(now + s(99));
    assert_eq!(sessions.orphans(), [(7, true), (8, false)]);
    sessions.disown(7);
    assert_eq!(sessions.orphans(), [(8, false)]);
}

#[test]
fn what_another_session_has_started_since_stays_as_long_as_that() {
    let (sessions, now, me) = (Sessions::default(), Instant::now(), caller("user 1", Role::Operate));
    sessions.open(&me, &asked("maker", false), now).expect("it opens");
    sessions.make("maker", 7);
    let id = sessions.open(&me, &asked("panel", false), now).expect("it opens").session;
    sessions.own("panel", 7);
    sessions.begin(&id, &me, now).expect("a sign of life");
    assert_eq!(sessions.lose(now + s(99)), [("maker".to_owned(), vec![])]);
    assert_eq!(sessions.orphans(), [(7, false)]);
    sessions.close(&id).expect("it closes");
    assert_eq!(sessions.orphans(), [(7, true)]);
}

#[test]
fn a_start_that_was_refused_changes_no_owner() {
    let (sessions, now, me) = (Sessions::default(), Instant::now(), caller("user 1", Role::Operate));
    for name in ["a", "b"] {
        sessions.open(&me, &asked(name, false), now).expect("it opens");
    }
    sessions.make("a", 7);
    for instance in [7, 8] {
        let before = sessions.own("b", instance);
        sessions.give_back_to(before.as_deref(), instance);
    }
    assert_eq!(sessions.lose(now + s(99)), [("a".to_owned(), vec![7]), ("b".to_owned(), vec![])]);
}

#[test]
fn an_instance_belongs_to_who_started_it_last() {
    let (sessions, now, me) = (Sessions::default(), Instant::now(), caller("user 1", Role::Operate));
    for name in ["a", "b"] {
        sessions.open(&me, &asked(name, false), now).expect("it opens");
        sessions.own(name, 7);
    }
    sessions.disown(8);
    assert_eq!(sessions.lose(now + s(99)), [("a".to_owned(), vec![]), ("b".to_owned(), vec![7])]);
    sessions.disown(7);
    assert!(sessions.orphans().is_empty());
}

#[test]
fn a_force_belongs_to_the_session_that_set_it_until_that_ends() {
    let (sessions, now, me) = (Sessions::default(), Instant::now(), caller("user 1", Role::Configure));
    for name in ["a", "b"] {
        sessions.open(&me, &asked(name, false), now).expect("it opens");
    }
    assert!(sessions.add_force("a", 1) && sessions.add_force("b", 2) && sessions.add_force("a", 3));
    assert!(sessions.take_forces("nobody").is_empty());
    sessions.lose(now + s(99));
    let mut forces = sessions.take_forces("a");
    forces.sort_unstable();
    assert_eq!(forces, [1, 3]);
    assert!(sessions.take_forces("a").is_empty(), "once");
    assert!(!sessions.add_force("b", 4), "it was lost meanwhile");
    assert_eq!(sessions.take_forces("b"), [2]);
}
