// SPDX-License-Identifier: Apache-2.0
//! Every call × role × state of the token × transport: a single table decides what is permitted.
use crate::rig::{Rig, class};
use api::Role;
use axum::body::{Body, to_bytes};
use axum::http::Request;
use daemon::calls::all;
use daemon::{Peer, tokens};
use serde_json::Value as Json;
use std::net::SocketAddr;
use tower::ServiceExt;

#[derive(Clone, Copy, Debug, PartialEq)]
enum Token {
    None,
    Wrong,
    Expired,
    Revoked,
    Right,
}

/// Creates the tokens of each role: (expired, revoked, valid).
fn made(path: &std::path::Path) -> Vec<[String; 3]> {
    let of = |role: Role| {
        let name = |state: &str| format!("{state} {}", role.word());
        let expired = tokens::add(path, &name("expired"), role, Some(1)).expect("a token");
        let revoked = tokens::add(path, &name("revoked"), role, None).expect("a token");
        assert!(tokens::revoke(path, &name("revoked")).expect("it is there"));
        let right = tokens::add(path, &name("right"), role, Some(u64::MAX)).expect("a token");
        [expired, revoked, right]
    };
    Role::ALL.into_iter().map(of).collect()
}

/// Returns the requests of the interface: the calls, and the other paths with their minimum role. The last item is true if the request
/// needs command too.
fn asked() -> Vec<(&'static str, String, Role, bool)> {
    let calls = all().map(|call| {
        let role = call.role_under(true);
        ("POST", format!("/v1/call/{}", call.name), role, role > Role::Observe && !call.free)
    });
    let mut asked: Vec<_> = calls.collect();
    let other = |method, path: &str, role, commands| (method, path.to_owned(), role, commands);
    asked.extend([
        other("GET", "/v1/version", Role::Observe, false),
        other("GET", "/v1/schema", Role::Observe, false),
        other("GET", "/v1/openapi.json", Role::Observe, false),
        other("GET", "/v1/sessions", Role::Observe, false),
        other("GET", "/v1/command", Role::Observe, false),
        other("PUT", "/v1/modules/m?file=m.c&sha256=0", Role::Download, true),
        other("PUT", "/v1/files/0", Role::Download, true),
    ]);
    asked
}

async fn answer(router: &axum::Router, peer: &Peer, token: Option<&str>, method: &str, path: &str) -> (u16, Json) {
    // Without its reason the emergency stop stops nothing; the other requests run nothing without command.
    let mut request = Request::builder().method(method).uri(path).header("host", "localhost");
    if let Some(token) = token {
        request = request.header("authorization", format!("Bearer {token}"));
    }
    let mut request = request.body(Body::from("{\"nonsense\": 1}")).expect("a request");
    request.extensions_mut().insert(peer.clone());
    let response = router.clone().oneshot(request).await.expect("it answers");
    let status = response.status().as_u16();
    let body = to_bytes(response.into_body(), usize::MAX).await.expect("a body");
    (status, serde_json::from_slice(&body).unwrap_or(Json::Null))
}

#[test]
fn every_command_by_role_token_and_transport() {
    let from: SocketAddr = "127.0.0.1:40000".parse().expect("an address");
    let uid = control_uid();
    for peer in [Peer::Unix { uid }, Peer::Tcp { from }, Peer::Tls { from, certificate: None }] {
        let mut kept = Vec::new();
        let rig = Rig::with("virtual", |options, folder| {
            kept = made(&folder.file("tokens.json"));
            options.tokens = Some(folder.file("tokens.json"));
            options.records = Some(folder.0.clone());
        });
        let router = rig.server.router();
        let runtime = tokio::runtime::Builder::new_multi_thread().worker_threads(1).enable_all().build().expect("a runtime");
        for (method, path, least, commands) in asked() {
            for (role, [expired, revoked, right]) in Role::ALL.into_iter().zip(&kept) {
                for state in [Token::None, Token::Wrong, Token::Expired, Token::Revoked, Token::Right] {
                    let token = match state {
                        Token::None => None,
                        Token::Wrong => Some("gpac_wrong"),
                        Token::Expired => Some(expired.as_str()),
                        Token::Revoked => Some(revoked.as_str()),
                        Token::Right => Some(right.as_str()),
                    };
                    let (status, answer) = runtime.block_on(answer(&router, &peer, token, method, &path));
                    let case = format!("{method} {path} as {} with {state:?} from {peer:?}: {status} {answer}", role.word());
                    // Anyone who can open the socket has every right, unless a token restricts it.
                    let has = match (state, &peer) {
                        (Token::Right, _) => Some(role),
                        (Token::None, Peer::Unix { .. }) => Some(Role::Download),
                        _ => None,
                    };
                    match has {
                        // Above the rate of failures the refusal comes before any other check.
                        None => assert!(matches!((status, class(&answer)), (401, "NotAllowed") | (429, "LimitExceeded")), "{case}"),
                        Some(has) if has < least => assert_eq!((status, class(&answer)), (403, "NotAllowed"), "{case}"),
                        Some(_) if commands => assert_eq!((status, class(&answer)), (403, "NotCommanding"), "{case}"),
                        Some(_) => assert!(!matches!(class(&answer), "NotAllowed" | "NotCommanding") && status < 500, "{case}"),
                    }
                }
            }
        }
    }
}

#[test]
fn every_command_with_the_token_of_a_run() {
    let from: SocketAddr = "127.0.0.1:40000".parse().expect("an address");
    for role in Role::ALL {
        let rig = Rig::with("virtual", |options, folder| {
            std::fs::write(folder.file("index.html"), "<html>").expect("ours");
            (options.listen, options.page, options.run_token) = (Some("127.0.0.1:0".to_owned()), Some(folder.0.clone()), Some(role));
            options.records = Some(folder.0.clone());
        });
        let token = rig.server.studio().and_then(|url| url.split_once('=')).expect("a token").1.to_owned();
        let router = rig.server.router();
        let runtime = tokio::runtime::Builder::new_multi_thread().worker_threads(1).enable_all().build().expect("a runtime");
        for (method, path, least, commands) in asked() {
            let (status, answer) = runtime.block_on(answer(&router, &Peer::Tcp { from }, Some(&token), method, &path));
            let case = format!("{method} {path} as {}: {status} {answer}", role.word());
            match role {
                has if has < least => assert_eq!((status, class(&answer)), (403, "NotAllowed"), "{case}"),
                _ if commands => assert_eq!((status, class(&answer)), (403, "NotCommanding"), "{case}"),
                _ => assert!(!matches!(class(&answer), "NotAllowed" | "NotCommanding") && status < 500, "{case}"),
            }
        }
    }
}

fn control_uid() -> u32 {
    use std::os::unix::fs::MetadataExt;
    std::fs::metadata("/proc/self").expect("a process").uid()
}

#[test]
fn another_user_of_the_machine_needs_a_token() {
    let rig = Rig::new();
    let runtime = tokio::runtime::Builder::new_multi_thread().worker_threads(1).enable_all().build().expect("a runtime");
    let other = Peer::Unix { uid: control_uid() + 4_711 };
    let (status, answer) = runtime.block_on(answer(&rig.server.router(), &other, None, "GET", "/v1/version"));
    assert_eq!((status, class(&answer)), (403, "NotAllowed"));
}

#[test]
fn the_table_has_the_calls_of_the_session() {
    // The header of the C package is the list; `download` uses a different path.
    let header = include_str!("../../../c-package/include/opengpac_ps.h");
    let system = crate::rig::system("virtual");
    for call in all() {
        assert!(header.contains(call.name), "the header lists '{}'", call.name);
        if !matches!(call.name, "place" | "step" | "advance") {
            let refused = api::begin(&system, call.name, r#"{"nonsense": 1}"#, std::time::Duration::ZERO);
            let text = refused.expect_err("nonsense").iter().map(ToString::to_string).collect::<String>();
            assert!(!text.contains("there is no call"), "'{}' is a call", call.name);
        }
    }
    for call in api::calls() {
        assert!(call.local || daemon::calls::find(call.name).is_some(), "'{}' is a call here too", call.name);
    }
}

#[test]
fn what_a_call_needs_is_what_the_table_says() {
    let system = crate::rig::system("virtual");
    for call in all().filter(|call| call.whole.is_none()) {
        if let Some(first) = call.arguments().iter().find(|a| a.required) {
            let refused = api::begin(&system, call.name, "{}", std::time::Duration::ZERO).expect_err("it needs arguments");
            assert!(refused[0].message.contains(&format!("'{}'", first.name)), "{}: {}", call.name, refused[0].message);
        }
    }
}
