// SPDX-License-Identifier: Apache-2.0
//! Definitions and applications as sent by a programming system, checked against a small cell.
use model::configuration::Configuration;
use model::definition::{Application, Graph, Verb};
use model::{CheckedVerb, Composition, apply, check_graph, compose};
use serde::Deserialize;
use std::sync::OnceLock;

#[derive(Deserialize)]
struct SentDefinitions {
    verb: Option<Verb>,
    application: Option<Application>,
    graph: Option<Graph>,
    composition: Option<Composition>,
}

/// Fuzzes JSON with a verb and its application, a graph, or a composition. Checks that a refusal has a reason, and that a verb that was
/// converted to JSON and back is unchanged and is accepted or refused as before.
pub(crate) fn definitions(bytes: &[u8]) {
    let Ok(sent) = serde_json::from_slice::<SentDefinitions>(bytes) else { return };
    if let Some(graph) = &sent.graph {
        drop(check_graph(graph, cell()));
    }
    let composed = sent.composition.as_ref().and_then(|composition| compose(composition, cell()).ok());
    for verb in sent.verb.iter().chain(&composed) {
        judge(verb, sent.application.as_ref());
    }
}

fn judge(verb: &Verb, application: Option<&Application>) {
    let checked = CheckedVerb::new(verb, cell());
    let text = serde_json::to_string(verb).expect("a definition has a JSON form");
    let again: Verb = serde_json::from_str(&text).expect("what was written can be read");
    assert_eq!(again, *verb, "{text}");
    match (&checked, CheckedVerb::new(&again, cell())) {
        (Ok(_), again) => assert!(again.is_ok(), "accepted, and refused after it went through JSON: {text}"),
        (Err(refusals), Err(again)) => {
            assert!(!refusals.is_empty(), "refused without a reason: {text}");
            assert_eq!(format!("{refusals:?}"), format!("{again:?}"), "refused for another reason after it went through JSON: {text}");
        }
        (Err(refusals), Ok(_)) => panic!("refused, and accepted after it went through JSON: {refusals:?} {text}"),
    }
    if let (Ok(_), Some(application)) = (checked, application) {
        let mut cell = cell().clone();
        cell.verbs.insert(verb.name.clone(), verb.clone());
        if let Err(refusals) = apply(&Application { verb: verb.name.clone(), ..application.clone() }, &cell) {
            assert!(!refusals.is_empty(), "refused without a reason: {text}");
        }
    }
}

fn cell() -> &'static Configuration {
    static CELL: OnceLock<Configuration> = OnceLock::new();
    CELL.get_or_init(|| serde_json::from_str(include_str!("../configuration.json")).expect("the cell is well formed"))
}
