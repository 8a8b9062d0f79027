// SPDX-License-Identifier: Apache-2.0
//! Tests that a stop request waits for no reader, using only the router in one process.
use crate::rig::{Folder, class, system};
use api::Role;
use axum::Router;
use axum::body::{Body, to_bytes};
use axum::http::Request;
use control::{Inside, Options};
use daemon::{Peer, tokens};
use serde_json::{Value as Json, json};
use std::collections::HashSet;
use std::sync::Arc;
use supervisor::System;
use tokio::sync::mpsc;
use tower::ServiceExt;

/// A system whose interface is served in this process, and a token for each client.
struct ServedSystem<const N: usize> {
    system: Arc<System>,
    inside: Inside,
    tokens: [String; N],
    folder: Folder,
}

fn served<const N: usize>(clock: &str, names: [(&str, Role); N]) -> ServedSystem<N> {
    let (folder, system) = (Folder::new(), system(clock));
    let file = folder.file("tokens.json");
    let tokens = names.map(|(name, role)| tokens::add(&file, name, role, None).expect("a token"));
    let inside = Inside::new(system.clone(), &Options { tokens: Some(file), ..Options::default() }).unwrap_or_else(|r| panic!("{r:?}"));
    ServedSystem { system, inside, tokens, folder }
}

/// Sends one request with a token, in a session if one is passed.
async fn ask(router: Router, token: &str, session: &str, path: &str, body: Json) -> (u16, Json) {
    let request = Request::post(path)
        .header("host", "localhost")
        .header("authorization", format!("Bearer {token}"))
        .extension(Peer::Tcp { from: "10.0.0.1:1".parse().expect("an address") });
    let request = if session.is_empty() { request } else { request.header("opengpac-session", session) };
    let answer = router.oneshot(request.body(Body::from(body.to_string())).expect("a request")).await.expect("it is answered");
    let status = answer.status().as_u16();
    let text = to_bytes(answer.into_body(), usize::MAX).await.expect("a body");
    (status, serde_json::from_slice(&text).expect("JSON"))
}

/// Opens a session that commands.
async fn commander(router: &Router, token: &str) -> String {
    let (_, opened) = ask(router.clone(), token, "", "/v1/sessions", json!({ "name": "panel" })).await;
    let session = opened["result"]["session"].as_str().unwrap_or_else(|| panic!("{opened}")).to_owned();
    assert_eq!(ask(router.clone(), token, &session, "/v1/command", json!({})).await.0, 200);
    session
}

/// Starts an instance of `wave`.
async fn running(router: &Router, token: &str, session: &str) -> u64 {
    let wave = json!({ "verb": "wave", "arguments": { "y": { "svv": "y" } }, "placement": { "*": "rtp0.fast" } });
    let (_, made) = ask(router.clone(), token, session, "/v1/call/create", wave).await;
    let instance = made["result"].as_u64().unwrap_or_else(|| panic!("{made}"));
    assert_eq!(ask(router.clone(), token, session, "/v1/call/start", json!({ "instance": instance })).await.0, 200);
    instance
}

#[tokio::test]
async fn observers_that_wait_are_in_the_way_of_no_halt() {
    let ServedSystem { inside, tokens: [panel, first, second], folder: _folder, .. } =
        served("monotonic", [("panel", Role::Operate), ("first", Role::Observe), ("second", Role::Observe)]);
    let router = inside.router();
    let session = commander(&router, &panel).await;
    let instance = running(&router, &panel, &session).await;
    let (answers, mut answered) = mpsc::unbounded_channel();
    // A slice of a wait ends after a second, however slow the machine is; the caller then repeats the request, as clients do.
    let wait = |who: &'static str, token: &str| {
        let (router, token, answers) = (router.clone(), token.to_owned(), answers.clone());
        tokio::spawn(async move {
            let (status, answer) = loop {
                let (status, answer) = ask(router.clone(), &token, "", "/v1/call/wait", json!({ "instance": instance })).await;
                if answer["go_on"].is_null() {
                    break (status, answer);
                }
            };
            answers.send((who, status, answer)).expect("the test listens");
        });
    };
    for (who, token) in [("first", &first), ("second", &second)] {
        (0..40).for_each(|_| wait(who, token));
        // A caller may have at most 24 waits: the excess ones are refused.
        let mut refused = 0;
        while refused < 16 {
            let (whose, status, answer) = answered.recv().await.expect("an answer");
            assert_eq!((status, class(&answer)), (429, "LimitExceeded"), "{answer}");
            let said = answer["errors"][0]["message"].as_str().expect("a sentence");
            assert!(said.starts_with(&format!("token {whose} already has ")) && said.ends_with(" waits at a time, its share of 96"), "{said}");
            refused += usize::from(whose == who);
        }
    }
    let (status, halted) = ask(router.clone(), &panel, &session, "/v1/call/halt", json!({ "instance": instance })).await;
    assert_eq!((status, halted["result"]["condition"].as_str()), (200, Some("halted")), "{halted}");
    drop(answers);
    let mut ended = HashSet::new();
    while let Some((who, status, answer)) = answered.recv().await {
        if status == 200 {
            assert_eq!(answer["result"]["condition"].as_str(), Some("halted"), "{answer}");
            ended.insert(who);
        } else {
            assert_eq!((status, class(&answer)), (429, "LimitExceeded"), "{answer}");
        }
    }
    assert_eq!(ended, HashSet::from(["first", "second"]), "waits that were taken hear of the end");
}

#[tokio::test]
async fn a_halt_has_acted_when_it_answers_that_the_end_is_still_to_come() {
    let ServedSystem { system, inside, tokens: [panel], folder: _folder } = served("virtual", [("panel", Role::Operate)]);
    let router = inside.router();
    let session = commander(&router, &panel).await;
    let instance = running(&router, &panel, &session).await;
    let waits: Vec<_> = (0..40).map(|_| ask(router.clone(), &panel, &session, "/v1/call/wait", json!({ "instance": instance, "slice_ms": 1 }))).collect();
    let halted = ask(router.clone(), &panel, &session, "/v1/call/halt", json!({ "instance": instance, "slice_ms": 1 })).await;
    assert_eq!(halted.0, 200, "{}", halted.1);
    for wait in waits {
        assert_eq!(wait.await.0, 200);
    }
    assert_eq!(system.state(instance), "ended");
}

#[tokio::test(start_paused = true)]
async fn a_wait_ends_with_the_token_of_its_caller() {
    let ServedSystem { inside, tokens: [panel, watcher], folder, .. } = served("monotonic", [("panel", Role::Operate), ("watcher", Role::Observe)]);
    let router = inside.router();
    let (_, opened) = ask(router.clone(), &panel, "", "/v1/sessions", json!({ "name": "panel" })).await;
    let session = opened["result"]["session"].as_str().expect("an ID").to_owned();
    let hold = |token: String, session: String| {
        let router = router.clone();
        async move {
            let request = Request::get("/v1/hold").header("host", "localhost").header("authorization", format!("Bearer {token}"));
            let request = request.header("opengpac-session", session).extension(Peer::Unix { uid: u32::MAX });
            let answer = router.oneshot(request.body(Body::empty()).expect("a request")).await.expect("it is answered");
            let (status, closes) = (answer.status().as_u16(), answer.headers().get("connection").is_some_and(|said| said == "close"));
            let text = to_bytes(answer.into_body(), usize::MAX).await.expect("a body");
            (status, closes, String::from_utf8_lossy(&text).into_owned())
        }
    };
    let held = tokio::spawn(hold(panel.clone(), session));
    tokio::time::sleep(std::time::Duration::from_secs(10)).await;
    assert!(!held.is_finished(), "it lasts as long as the session");
    tokens::revoke(&folder.file("tokens.json"), "panel").expect("it is there");
    let begun = tokio::time::Instant::now();
    let (status, closes, said) = held.await.expect("it ends");
    assert!(begun.elapsed() <= std::time::Duration::from_secs(2), "{:?}", begun.elapsed());
    assert_eq!((status, closes), (401, true));
    assert!(said.contains("the token was revoked"), "{said}");
    assert_eq!(ask(router.clone(), &watcher, "", "/v1/call/now", json!({})).await.0, 200, "nobody else is concerned");
}

#[tokio::test]
async fn a_definition_that_is_too_large_is_refused_before_it_is_checked() {
    let ServedSystem { inside, tokens: [panel], folder: _folder, .. } = served("virtual", [("panel", Role::Observe)]);
    let block = json!({ "block": { "subroutine": "library.gain" } });
    let check = |drawing: Json| ask(inside.router(), &panel, "", "/v1/call/check_definition", drawing);
    let of_blocks = |count: usize| {
        let blocks: serde_json::Map<String, Json> = (0..count).map(|number| (format!("b{number}"), block.clone())).collect();
        json!({ "graph": { "name": "g", "blocks": blocks } })
    };
    assert_eq!(check(of_blocks(100)).await.0, 200);
    let (status, answer) = check(of_blocks(4_097)).await;
    assert_eq!((status, class(&answer)), (413, "LimitExceeded"), "{answer}");
    assert_eq!(answer["errors"][0]["message"], "the definition has 4097 blocks, but at most 4096 are checked for a caller");
    let nested =
        (0..17).fold(json!({ "name": "g", "blocks": { "b": block } }), |inner, _| json!({ "name": "g", "blocks": { "b": { "block": { "graph": inner } } } }));
    let (status, answer) = check(json!({ "graph": nested })).await;
    assert_eq!(
        (status, answer["errors"][0]["message"].as_str()),
        (413, Some("the definition has graphs nested 18 deep, but at most 16 are checked for a caller"))
    );
}
