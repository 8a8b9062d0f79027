// SPDX-License-Identifier: Apache-2.0
//! Tests the sum of arbitrary lines.
use api::Role;
use daemon::journal::ledger::Ledger;
use daemon::journal::lines::{By, FORMAT, Head, Line, State, Subject, VERSION, read, text, withhold};
use proptest::prelude::*;
use serde_json::{Map, Value as Json, json};

fn line(call: &str, of: Option<Subject>, arguments: Json) -> Line {
    let Json::Object(arguments) = arguments else { panic!("arguments are an object") };
    let by = By { who: "user 0".to_owned(), role: Role::Download, session: "panel".to_owned(), time: 0.5 };
    Line::Call { call: call.to_owned(), of, arguments, withheld: Vec::new(), by }
}

fn subjects() -> impl Strategy<Value = Subject> {
    prop_oneof![(1..4_u64).prop_map(Subject::Instance), "[ab]".prop_map(Subject::Device)]
}

/// Generates lines of all kinds about a few names, so that they interact.
fn lines() -> impl Strategy<Value = Line> {
    let states = prop_oneof![Just(State::Running), Just(State::Suspended), Just(State::Ended), Just(State::Deleted)];
    let values = (subjects(), "[xy]", 0..3).prop_map(|(of, name, value)| line("set", Some(of), json!({ "values": { name: value } })));
    let device = |call: &'static str| "[ab]".prop_map(move |name| line(call, None, json!({ "name": name })));
    prop_oneof![
        (1..4_u64).prop_map(|n| line("create", Some(Subject::Instance(n)), json!({ "verb": "hold" }))),
        (1..4_u64).prop_map(|n| line("start", Some(Subject::Instance(n)), json!({}))),
        "[ab]".prop_map(|name| line("enable", Some(Subject::Device(name.clone())), json!({ "name": name }))),
        values,
        (subjects(), states).prop_map(|(of, state)| Line::Became { of, state }),
        device("device"),
        device("delete_device"),
        ("[ab]", 0..2).prop_map(|(name, value)| line("set_device_parameter", None, json!({ "name": name, "parameter": "kp", "value": value }))),
        ("[ab]", 0..2).prop_map(|(name, kind)| line("svv", None, json!({ "name": name, "type_text": format!("double[{}]", kind + 1) }))),
        Just(Line::Stopped { reason: "door".to_owned() }),
        Just(Line::Reset {}),
        Just(Line::Closed { session: "panel".to_owned() }),
    ]
}

/// Returns the lines that are consistent with the ones before them.
fn fitting(lines: Vec<Line>) -> (Ledger, Vec<Line>) {
    let mut ledger = Ledger::default();
    let fit = lines.into_iter().filter(|line| ledger.take(0, line.clone()).is_ok()).collect();
    (ledger, fit)
}

fn short(ledger: &Ledger) -> Vec<Line> {
    ledger.lines().map(|kept| kept.line.clone()).collect()
}

proptest! {
    #[test]
    fn what_lines_come_to_comes_to_the_same_again(given in proptest::collection::vec(lines(), 0..40)) {
        let (ledger, _) = fitting(given);
        let again = Ledger::of(short(&ledger).into_iter().map(|line| (0, line)));
        prop_assert_eq!(again.map(|again| short(&again)), Ok(short(&ledger)));
    }

    #[test]
    fn what_runs_is_what_was_started_last_and_has_not_ended(given in proptest::collection::vec(lines(), 0..40)) {
        let (ledger, fit) = fitting(given);
        for of in ["a", "b"].map(|name| Subject::Device(name.to_owned())).into_iter().chain((1..4).map(Subject::Instance)) {
            let Subject::Instance(_) = of else { continue };
            let told = fit.iter().rev().find_map(|line| match line {
                Line::Call { call, of: Some(about), .. } if *about == of && call == "start" => Some(true),
                Line::Became { of: about, state: State::Ended | State::Deleted } if *about == of => Some(false),
                Line::Stopped { .. } => Some(false),
                _ => None,
            });
            prop_assert_eq!(ledger.runs(&of), told.unwrap_or(false));
        }
    }

    #[test]
    fn lines_are_read_as_they_were_written(given in proptest::collection::vec(lines(), 0..10), cut in 0..30_usize) {
        let head = Head { format: FORMAT.to_owned(), version: VERSION, system: "cell".to_owned() };
        let mut bytes = text(&head);
        let first = bytes.len();
        given.iter().for_each(|line| bytes.extend(text(line)));
        let was = read(&bytes).expect("it was written");
        prop_assert_eq!(was.lines.iter().map(|(_, line)| line.clone()).collect::<Vec<_>>(), given.clone());
        prop_assert_eq!(was.cut, None);
        let len = bytes.len().saturating_sub(cut).max(first);
        let after = read(&bytes[..len]).expect("only its last line is cut short");
        prop_assert!(after.lines.len() <= given.len() && after.lines == was.lines[..after.lines.len()]);
        prop_assert_eq!(after.cut.is_some(), bytes[len - 1] != b'\n');
    }
}

#[test]
fn definitions_that_are_given_again_are_kept_once_and_changed_ones_in_order() {
    let svv = |kind: &str| line("svv", None, json!({ "name": "x", "type_text": kind }));
    let (ledger, _) = fitting(vec![svv("int"), svv("int"), svv("double"), svv("int"), svv("int")]);
    assert_eq!(short(&ledger), [svv("int"), svv("double"), svv("int")]);
}

#[test]
fn parameters_that_are_set_one_after_the_other_are_one_line() {
    let of = || Some(Subject::Instance(1));
    let set = |values: Json| line("set", of(), json!({ "instance": 1, "values": values }));
    let (ledger, _) =
        fitting(vec![line("create", of(), json!({})), line("start", of(), json!({})), set(json!({ "a": 1, "b": 1 })), set(json!({ "b": 2, "c": 2 }))]);
    assert_eq!(short(&ledger).last(), Some(&set(json!({ "a": 1, "b": 2, "c": 2 }))));
}

#[test]
fn a_line_about_what_no_line_made_is_refused() {
    let mut ledger = Ledger::default();
    let refused = |ledger: &mut Ledger, line: Line| ledger.take(2, line).expect_err("refused");
    assert_eq!(refused(&mut ledger, line("start", Some(Subject::Instance(3)), json!({}))), "it starts instance 3, which no earlier line creates");
    assert!(refused(&mut ledger, line("set", Some(Subject::Device("a".to_owned())), json!({}))).contains("no earlier line starts"));
    assert!(refused(&mut ledger, line("create", None, json!({}))).contains("does not name its instance or device"));
    assert!(refused(&mut ledger, line("svv", Some(Subject::Instance(1)), json!({}))).contains("does not act on an instance"));
}

#[test]
fn a_secret_is_taken_out() {
    let Json::Object(mut arguments) = json!({ "endpoint": "tls/0.0.0.0:7447", "name": "a", "token": "long enough, and secret" }) else { unreachable!() };
    assert_eq!(withhold("listen", &mut arguments), ["token"]);
    assert_eq!(Json::Object(arguments), json!({ "endpoint": "tls/0.0.0.0:7447", "name": "a" }));
    assert!(withhold("svv", &mut Map::new()).is_empty());
}

fn module(name: &str, sha256: &str) -> Line {
    let by = By { who: "user 0".to_owned(), role: Role::Download, session: String::new(), time: 0.5 };
    Line::Module { module: name.to_owned(), file: format!("{name}.c"), sha256: sha256.to_owned(), by }
}

/// Returns a verb with a block of this module.
fn verb(name: &str, block: &str, doc: &str) -> Line {
    line("define_verb", None, json!({ "name": name, "doc": doc, "blocks": { "b": { "block": { "subroutine": block } } } }))
}

#[test]
fn of_many_definitions_of_a_name_the_last_one_is_left() {
    let mut ledger = Ledger::default();
    for version in 0..60 {
        ledger.take(0, module("amp", &version.to_string())).expect("it fits");
        ledger.take(0, verb("hold", "amp.gain", &version.to_string())).expect("it fits");
    }
    assert_eq!(ledger.leave_old_definitions(), 118);
    assert_eq!(short(&ledger), [module("amp", "59"), verb("hold", "amp.gain", "59")]);
    assert_eq!(ledger.leave_old_definitions(), 0);
}

#[test]
fn a_definition_that_something_was_made_of_stays_with_all_that_it_names() {
    let of = || Some(Subject::Instance(1));
    let mut ledger = Ledger::default();
    let made = line("create", of(), json!({ "verb": "hold" }));
    let lines = [
        module("amp", "0"),
        verb("hold", "amp.gain", "0"),
        module("amp", "1"),
        verb("hold", "amp.gain", "1"),
        made.clone(),
        module("amp", "2"),
        verb("hold", "amp.gain", "2"),
    ];
    lines.iter().for_each(|line| ledger.take(0, line.clone()).expect("it fits"));
    assert_eq!(ledger.leave_old_definitions(), 2);
    assert_eq!(short(&ledger), lines[2..], "the instance is of the second one");
    ledger.take(0, Line::Became { of: Subject::Instance(1), state: State::Deleted }).expect("it fits");
    assert_eq!(ledger.leave_old_definitions(), 2);
    assert_eq!(short(&ledger), lines[5..]);
}

#[test]
fn a_module_stays_that_a_verb_names_which_was_not_defined_again() {
    let mut ledger = Ledger::default();
    let lines = [module("amp", "0"), verb("hold", "amp.gain", "0"), module("amp", "1"), verb("move", "amp.gain", "0")];
    lines.iter().for_each(|line| ledger.take(0, line.clone()).expect("it fits"));
    assert_eq!(ledger.leave_old_definitions(), 0);
}
