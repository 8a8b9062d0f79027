// SPDX-License-Identifier: Apache-2.0
//! Paths and methods of version 1 of the interface, each handled in a few lines.
mod code;
mod command;
mod request;
mod sessions;

use crate::door::Door;
use crate::leaving::leaving;
use crate::presence::{as_of_ms, present, shut_out};
use crate::refused::RefusedRequest;
use crate::slots::Slot;
use crate::stream;
use crate::version::{Version, version};
use api::Role;
use axum::body::Body;
use axum::extract::{DefaultBodyLimit, Extension, Path, Request, State};
use axum::http::{HeaderMap, HeaderValue, Method, StatusCode, header};
use axum::middleware::{Next, from_fn_with_state};
use axum::response::{IntoResponse, Response};
use axum::routing::{get, post, put};
use axum::{Json, Router};
use daemon::Act;
use daemon::Failure;
use daemon::calls::{self, Call};
use daemon::clock::now;
use daemon::lanes::{BRIEF, Lane, LaneTicket};
use daemon::requests::{self, CallRequest};
use daemon::{Caller, Peer};
use daemon::{Presence, Service};
use model::refusal::Class;
use request::{ServiceState, roomy};
use serde_json::Value;
use std::sync::Arc;
use std::time::Duration;

/// Returns the router of all paths of the interface.
pub(crate) fn router(door: Door) -> Router {
    Router::new()
        .route("/v1/version", get(about))
        .route("/v1/schema", get(|| async { Json(crate::schema::all()) }))
        .route("/v1/openapi.json", get(|| async { Json(crate::openapi::document()) }))
        .route("/v1/call/{name}", post(call))
        .route("/v1/sessions", get(sessions::list).post(sessions::open).delete(sessions::close))
        .route("/v1/sessions/{name}/reports", get(sessions::reports).delete(sessions::collect))
        .route("/v1/heartbeat", post(sessions::heartbeat))
        .route("/v1/hold", get(sessions::hold))
        .route("/v1/command", get(command::holder).post(command::take).delete(command::give_back))
        .route("/v1/command/request", post(command::ask).delete(command::withdraw))
        .route("/v1/command/hand_over", post(command::hand_over))
        .route("/v1/command/decline", post(command::decline))
        .route("/v1/modules/{name}", put(code::module))
        .route("/v1/files/{sha256}", get(code::file_is_there).put(code::file))
        .route("/v1/stream", get(stream::open))
        .fallback(|| async { RefusedRequest(Failure::new(Class::UnknownName, "there is no such path", "see docs/control.md")) })
        .method_not_allowed_fallback(|| async {
            let refused = RefusedRequest(Failure::new(Class::CallError, "this path does not support this method", "see docs/control.md"));
            (StatusCode::METHOD_NOT_ALLOWED, refused)
        })
        .layer(DefaultBodyLimit::disable())
        .layer(from_fn_with_state(door.clone(), admit))
        .with_state(door)
}

/// Returns true if a request stops something or prepares a stop. Opening a session and taking command count, because a client must do
/// both before it can halt anything.
fn leads_to_a_stop(request: &Request) -> bool {
    let path = request.uri().path();
    let called = path.strip_prefix("/v1/call/").and_then(calls::find);
    *request.method() == Method::POST && (called.is_some_and(|call| call.stops) || matches!(path, "/v1/sessions" | "/v1/command"))
}

/// Returns the answer to a caller that is not admitted, and closes the connection.
fn parting(failure: Failure) -> Response {
    let mut response = RefusedRequest(failure).into_response();
    response.headers_mut().insert(header::CONNECTION, HeaderValue::from_static("close"));
    response
}

/// Admits a request if its caller is authenticated and within its rate limit.
async fn admit(State(door): State<Door>, mut request: Request, next: Next) -> Response {
    let Some(peer) = request.extensions().get::<Peer>().cloned() else {
        return RefusedRequest(Failure::new(Class::NotAllowed, "the other end is gone", "")).into_response();
    };
    let (service, slot) = (&door.service, request.extensions().get::<Arc<Slot>>().cloned());
    if let Some(page) = &door.page
        && let Some(file) = page.answer(request.method(), request.uri().path(), request.headers())
    {
        if let Some(slot) = &slot {
            slot.heard();
        }
        let allowed = door.site.check(&peer, request.headers());
        let paced = || service.rates.take(&format!("page {}", peer.address()), now());
        return allowed.and_then(|()| paced()).map_or_else(|failure| RefusedRequest(failure).into_response(), |()| file);
    }
    match door.site.let_in(&service.gate, &peer, request.headers()) {
        Ok((caller, pass)) => {
            let stops = caller.role >= Role::Operate && leads_to_a_stop(&request);
            if let Some(Err(failure)) = slot.map(|slot| slot.know(&caller, &pass, stops)) {
                return parting(failure);
            }
            let is_in_time = stops && service.lanes.stop_rates.take(&caller.who, now()).is_ok();
            if !is_in_time && let Err(failure) = service.rates.take(&caller.who, now()) {
                return RefusedRequest(failure).into_response();
            }
            request.extensions_mut().insert(caller.clone());
            request.extensions_mut().insert(pass.clone());
            // A request that lasts is ended if its caller loses access.
            tokio::select! {
                biased;
                response = next.run(request) => response,
                failure = shut_out(service, &caller, &pass) => parting(failure),
            }
        }
        Err(failure) => {
            let from = peer.address();
            // Guessing must not fill the disk or load the processor: attempts beyond the rate are not even audited.
            if let Err(too_often) = door.failures.take(&from, now()) {
                return parting(too_often);
            }
            let nobody = Caller { who: "nobody".to_owned(), role: Role::Observe, from };
            let _said = service.audit.write(&Act::new(&nobody, "", request.uri().path(), b""), &format!("{:?}", failure.class()));
            parting(failure)
        }
    }
}

async fn call(
    State(service): ServiceState,
    Extension(caller): Extension<Caller>,
    Path(name): Path<String>,
    headers: HeaderMap,
    given: Body,
) -> Result<Response, RefusedRequest> {
    let presence = present(&service, &headers, &caller)?.map(Arc::new);
    let Some(call) = calls::find(&name) else {
        return Err(Failure::new(Class::UnknownName, format!("there is no call '{name}'"), "see docs/control.md").into());
    };
    let as_of_ms = as_of_ms(&headers)?;
    let entered = service.lanes.enter(Lane::of(call), &caller)?;
    let (given, room) = roomy(&service, &caller, given, calls::body_max(call)).await?;
    if call.stops {
        let begun = entered.run({
            let (service, caller, presence) = (service.clone(), caller.clone(), presence.clone());
            // The call itself does not wait. Naming its target and logging it take precedence too.
            move || supervisor::first(|| begin(&service, call, (&given, None), &caller, presence.as_deref(), Duration::ZERO))
        });
        let begun = begun.await?;
        // If the lane has no room for the wait, the caller continues it.
        let waits = if begun.goes_on() { service.lanes.enter(Lane::Wait, &caller).ok() } else { None };
        return Ok(ended(&service, &caller, presence, begun, waits, Role::Operate).await?);
    }
    if call.lasts && call.brief {
        let begun = entered.begin(|| begin(&service, call, (&given, as_of_ms), &caller, presence.as_deref(), BRIEF))?;
        drop((given, room));
        return Ok(ended(&service, &caller, presence, begun, Some(entered), call.role).await?);
    }
    let (here, by) = (service.clone(), caller.clone());
    let answer = entered.run(move || {
        let asked = CallRequest { as_of_ms, ..requests::asked(&given, call.lasts)? };
        drop((given, room));
        text(&here.call(call, asked, &by, presence.as_deref())?)
    });
    Ok(leaving(&service, &caller, answer.await?, call.role)?)
}

/// A call that has run for part of its slice: its answer, which may contain a continuation, and the remaining slice.
struct SliceOfCall {
    answer: Value,
    left: Duration,
}

impl SliceOfCall {
    fn goes_on(&self) -> bool {
        self.answer.get("go_on").is_some() && !self.left.is_zero()
    }
}

/// Starts a call on this thread and waits at most `within` for it to end. `given` contains the body of the call and the time of the
/// command.
fn begin(
    service: &Arc<Service>,
    call: &Call,
    (given, as_of_ms): (&[u8], Option<u64>),
    caller: &Caller,
    presence: Option<&Presence>,
    within: Duration,
) -> Result<SliceOfCall, Failure> {
    let mut asked = CallRequest { as_of_ms, ..requests::asked(given, call.lasts)? };
    let left = asked.slice.saturating_sub(within);
    asked.slice -= left;
    Ok(SliceOfCall { answer: service.call(call, asked, caller, presence)?, left })
}

/// Answers a started call when the call ends or its slice expires. This wait is subject to the same limits as any other.
async fn ended(
    service: &Arc<Service>,
    caller: &Caller,
    presence: Option<Arc<Presence>>,
    begun: SliceOfCall,
    waits: Option<LaneTicket>,
    role: Role,
) -> Result<Response, Failure> {
    let Some(waits) = waits.filter(|_| begun.goes_on()) else { return leaving(service, caller, text(&begun.answer)?, role) };
    let here = service.clone();
    let answer = waits.run(move || text(&here.go_on(&begun.answer["go_on"], begun.left, presence.as_deref())?));
    leaving(service, caller, answer.await?, role)
}

/// Encodes an answer as text. Long answers are encoded on a thread that no other request waits for.
fn text(answer: &Value) -> Result<Vec<u8>, Failure> {
    serde_json::to_vec(answer).map_err(|why| Failure::new(Class::InvalidState, format!("the answer cannot be encoded: {why}"), "please report it"))
}

async fn about(State(service): ServiceState, Extension(caller): Extension<Caller>) -> Json<Version> {
    Json(version(&service, &caller))
}
