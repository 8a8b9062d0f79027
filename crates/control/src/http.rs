// SPDX-License-Identifier: Apache-2.0
//! Paths and methods of version 1, each a few lines around what it is for.
use crate::audit::Act;
use crate::caller::{Caller, Peer};
use crate::calls;
use crate::code;
use crate::failure::Failure;
use crate::files::{FILE_MAX, check_digest};
use crate::journal::lines::By;
use crate::places::Place;
use crate::role::Role;
use crate::service::{Presence, Service};
use crate::stream;
use crate::wire::{self, OpenSession, TakeCommand};
use axum::body::{Body, Bytes};
use axum::extract::{DefaultBodyLimit, Extension, Path, Query, Request, State};
use axum::http::{HeaderMap, HeaderValue, StatusCode, header};
use axum::middleware::{Next, from_fn_with_state};
use axum::response::{IntoResponse, Response};
use axum::routing::{get, post, put};
use axum::{Json, Router};
use model::refusal::Class;
use serde::Deserialize;
use serde_json::{Value, json};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// The largest body of a call, bytes.
const BODY_MAX: usize = 1 << 20;
/// How long a body may take to arrive.
const BODY_TIME: Duration = Duration::from_secs(10);
/// How long a file may take to arrive.
const FILE_TIME: Duration = Duration::from_secs(120);
/// How often a held connection looks whether its session is still there.
const HOLD_LOOK: Duration = Duration::from_millis(100);

type Shared = State<Arc<Service>>;
type Answer = Result<Json<Value>, Failure>;

/// Every path of the interface.
pub fn router(service: Arc<Service>) -> Router {
    Router::new()
        .route("/v1/version", get(version))
        .route("/v1/schema", get(|| async { Json(crate::schema::all()) }))
        .route("/v1/call/{name}", post(call))
        .route("/v1/sessions", get(sessions).post(open_session).delete(close_session))
        .route("/v1/sessions/{name}/reports", get(reports).delete(collect_reports))
        .route("/v1/heartbeat", post(heartbeat))
        .route("/v1/hold", get(hold))
        .route("/v1/command", get(holder).post(take_command).delete(give_back))
        .route("/v1/modules/{name}", put(module))
        .route("/v1/files/{sha256}", get(file_is_there).put(file))
        .route("/v1/stream", get(stream::open))
        .fallback(|| async { Failure::new(Class::UnknownName, "there is no such path", "see docs/control.md") })
        .method_not_allowed_fallback(|| async {
            Failure::new(Class::CallError, "this path has no such method", "see docs/control.md").status(StatusCode::METHOD_NOT_ALLOWED)
        })
        .layer(DefaultBodyLimit::disable())
        .layer(from_fn_with_state(service.clone(), admit))
        .with_state(service)
}

/// The path of the call for which there is always a place.
const STOP: &str = "/v1/call/emergency_stop";

/// The answer to whom nobody lets in, which ends the connection.
fn parting(failure: Failure) -> Response {
    let mut response = failure.into_response();
    response.headers_mut().insert(header::CONNECTION, HeaderValue::from_static("close"));
    response
}

/// Every request: who calls, and not too often.
async fn admit(State(service): Shared, mut request: Request, next: Next) -> Response {
    let Some(peer) = request.extensions().get::<Peer>().cloned() else {
        return Failure::new(Class::NotAllowed, "nobody is at the other end", "").into_response();
    };
    let place = request.extensions().get::<Arc<Place>>().cloned();
    if let Some(page) = &service.page
        && let Some(file) = page.answer(request.method(), request.uri().path(), request.headers())
    {
        if let Some(place) = &place {
            place.heard();
        }
        let allowed = service.gate.check_site(&peer, request.headers());
        let paced = || service.rates.take(&format!("page {}", peer.address()), Instant::now());
        return allowed.and_then(|()| paced()).map_or_else(IntoResponse::into_response, |()| file);
    }
    match service.gate.admit(&peer, request.headers()) {
        Ok(caller) => {
            let stops = caller.role >= Role::Operate && request.uri().path() == STOP;
            if let Some(Err(failure)) = place.map(|place| place.know(&caller, stops)) {
                return parting(failure);
            }
            if let Err(failure) = service.rates.take(&caller.who, Instant::now()) {
                return failure.into_response();
            }
            request.extensions_mut().insert(caller);
            next.run(request).await
        }
        Err(failure) => {
            let from = peer.address();
            // Guessing fills neither the disk nor the processor: beyond its rate it is not even written down.
            if let Err(too_often) = service.failures.take(&from, Instant::now()) {
                return parting(too_often);
            }
            let nobody = Caller { who: "nobody".to_owned(), role: Role::Observe, from };
            let _said = service.audit.write(&Act::new(&nobody, "", request.uri().path(), b""), &format!("{:?}", failure.class()));
            parting(failure)
        }
    }
}

/// The session of a request.
pub(crate) fn present(service: &Arc<Service>, headers: &HeaderMap, caller: &Caller) -> Result<Option<Presence>, Failure> {
    let id = headers.get("opengpac-session").map(|id| id.to_str().unwrap_or(""));
    service.present(id, caller)
}

fn needed(presence: Option<Presence>) -> Result<Presence, Failure> {
    presence.ok_or_else(|| Failure::new(Class::CallError, "there is no session", "open one and send its ID in the header OpenGPAC-Session"))
}

/// A body of this size at the most.
async fn body(body: Body, most: usize, time: Duration) -> Result<Bytes, Failure> {
    let late = |_| {
        Failure::new(Class::LimitExceeded, format!("the body has not arrived within {} s", time.as_secs()), "send it faster")
            .status(StatusCode::REQUEST_TIMEOUT)
    };
    let read = tokio::time::timeout(time, axum::body::to_bytes(body, most)).await.map_err(late)?;
    read.map_err(|_| Failure::new(Class::LimitExceeded, format!("the body has more than {most} bytes, or was broken off"), "send less at once"))
}

/// Runs what may wait on a thread of its own.
async fn apart<T: Send + 'static>(run: impl FnOnce() -> Result<T, Failure> + Send + 'static) -> Result<T, Failure> {
    let failed = |_| {
        Failure::new(Class::InvalidState, "the call failed inside OpenGPAC", "please report it with what was called").status(StatusCode::INTERNAL_SERVER_ERROR)
    };
    tokio::task::spawn_blocking(run).await.map_err(failed)?
}

async fn version(State(service): Shared, Extension(caller): Extension<Caller>) -> Json<Value> {
    Json(code::version(&service, &caller))
}

async fn call(State(service): Shared, Extension(caller): Extension<Caller>, Path(name): Path<String>, headers: HeaderMap, given: Body) -> Answer {
    let presence = present(&service, &headers, &caller)?;
    let Some(call) = calls::find(&name) else {
        return Err(Failure::new(Class::UnknownName, format!("there is no call '{name}'"), "see docs/control.md"));
    };
    let waits = call.lasts().then(|| service.waits.clone().try_acquire_owned());
    let permit = match waits {
        Some(Err(_)) => return Err(Failure::new(Class::LimitExceeded, "too many wait at a time", "come again").again_in(1)),
        Some(Ok(permit)) => Some(permit),
        None => None,
    };
    let given = body(given, BODY_MAX, BODY_TIME).await?;
    let asked = wire::asked(&given, call.lasts())?;
    let answer = apart(move || {
        let _until_done = permit;
        service.call(call, asked, &caller, presence.as_ref())
    });
    answer.await.map(Json)
}

async fn sessions(State(service): Shared) -> Json<Value> {
    Json(json!({ "result": service.sessions.list() }))
}

async fn open_session(State(service): Shared, Extension(caller): Extension<Caller>, given: Body) -> Answer {
    let given = body(given, BODY_MAX, BODY_TIME).await?;
    let asked: OpenSession = wire::object::<OpenSession>(&given)?.checked()?;
    apart(move || {
        service.look_after(Instant::now());
        let act = Act::new(&caller, &asked.name, "open_session", &given);
        let opened = service.recorded(&act, Role::Operate, || service.sessions.open(&caller, &asked, Instant::now()))?;
        let mut result = json!(opened);
        result["instances"] = json!(service.described(&opened.instances));
        Ok(Json(json!({ "result": result })))
    })
    .await
}

async fn close_session(State(service): Shared, Extension(caller): Extension<Caller>, headers: HeaderMap) -> Answer {
    let presence = needed(present(&service, &headers, &caller)?)?;
    let act = Act::new(&caller, &presence.name, "close_session", b"");
    apart(move || {
        service.recorded(&act, Role::Operate, || service.close_session(&presence.id))?;
        Ok(Json(json!({ "result": null })))
    })
    .await
}

async fn heartbeat(State(service): Shared, Extension(caller): Extension<Caller>, headers: HeaderMap) -> Answer {
    needed(present(&service, &headers, &caller)?)?;
    Ok(Json(json!({ "result": null })))
}

/// A connection that a session holds: where it breaks before the session is over, the session is lost.
pub(crate) struct Held {
    service: Arc<Service>,
    id: String,
    pub in_order: bool,
}

impl Held {
    pub fn new(service: Arc<Service>, id: String) -> Held {
        service.sessions.hold(&id);
        Held { service, id, in_order: false }
    }
}

impl Drop for Held {
    fn drop(&mut self) {
        self.service.sessions.let_go(&self.id, !self.in_order);
    }
}

async fn hold(State(service): Shared, Extension(caller): Extension<Caller>, headers: HeaderMap) -> Answer {
    // The request itself must not count as under way: silence is silence.
    let id = needed(present(&service, &headers, &caller)?)?.id.clone();
    let mut held = Held::new(service.clone(), id.clone());
    let mut look = tokio::time::interval(HOLD_LOOK);
    while service.sessions.is_alive(&id) {
        look.tick().await;
    }
    held.in_order = true;
    Ok(Json(json!({ "result": null })))
}

async fn holder(State(service): Shared) -> Json<Value> {
    Json(json!({ "result": { "holder": service.sessions.holder() } }))
}

async fn take_command(State(service): Shared, Extension(caller): Extension<Caller>, headers: HeaderMap, given: Body) -> Answer {
    let presence = needed(present(&service, &headers, &caller)?)?;
    let given = body(given, BODY_MAX, BODY_TIME).await?;
    let asked: TakeCommand = wire::object(&given)?;
    apart(move || {
        // Who is lost commands no longer.
        service.look_after(Instant::now());
        let act = Act::new(&caller, &presence.name, "take_command", &given);
        service.recorded(&act, Role::Operate, || {
            service.require_role(&caller, Role::Operate, "command")?;
            service.sessions.take(&presence.name, caller.role, asked.force)
        })?;
        Ok(Json(json!({ "result": { "holder": presence.name } })))
    })
    .await
}

async fn give_back(State(service): Shared, Extension(caller): Extension<Caller>, headers: HeaderMap) -> Answer {
    let presence = needed(present(&service, &headers, &caller)?)?;
    service.sessions.give_back(&presence.name);
    Ok(Json(json!({ "result": { "holder": service.sessions.holder() } })))
}

async fn reports(State(service): Shared, Extension(caller): Extension<Caller>, Path(name): Path<String>) -> Answer {
    apart(move || {
        service.drain();
        let (reports, lost) = service.sessions.reports(&name, &caller)?;
        Ok(Json(json!({ "result": { "reports": reports, "lost": lost } })))
    })
    .await
}

#[derive(Deserialize)]
struct Through {
    through: u64,
}

async fn collect_reports(
    State(service): Shared,
    Extension(caller): Extension<Caller>,
    Path(name): Path<String>,
    query: Result<Query<Through>, axum::extract::rejection::QueryRejection>,
) -> Answer {
    let Query(Through { through }) = query.map_err(|why| Failure::new(Class::CallError, why.body_text(), "write ?through=NUMBER"))?;
    service.sessions.collect(&name, &caller, through)?;
    Ok(Json(json!({ "result": null })))
}

async fn module(
    State(service): Shared,
    Extension(caller): Extension<Caller>,
    Path(name): Path<String>,
    query: Result<Query<code::Named>, axum::extract::rejection::QueryRejection>,
    headers: HeaderMap,
    given: Body,
) -> Answer {
    let presence = present(&service, &headers, &caller)?;
    service.recorded(&Act::new(&caller, "", "module", b""), Role::Observe, || service.require_role(&caller, Role::Download, "modules"))?;
    let Query(named) = query.map_err(|why| Failure::new(Class::CallError, why.body_text(), "write ?file=NAME&sha256=HEX"))?;
    let given = body(given, FILE_MAX, FILE_TIME).await?;
    apart(move || {
        let act = Act::new(&caller, presence.as_ref().map_or("", |p| &p.name), "module", &given);
        service.recorded(&act, Role::Download, || {
            service.sessions.require_command(presence.as_ref().map(|p| p.name.as_str()))?;
            check_digest(&named.sha256, &given, "the module")?;
            code::check_target(&name, &named, &given)?;
            let by = By::of(&caller, presence.as_ref().map_or("", |p| &p.name));
            Ok(Json(json!({ "result": service.download_kept(&name, &named, &given, by)? })))
        })
    })
    .await
}

async fn file_is_there(State(service): Shared, Path(sha256): Path<String>) -> Answer {
    match service.files.size(&sha256) {
        Some(bytes) => Ok(Json(json!({ "result": { "bytes": bytes } }))),
        None => Err(Failure::new(Class::UnknownName, format!("there is no file with SHA-256 '{sha256}'"), "put it")),
    }
}

async fn file(State(service): Shared, Extension(caller): Extension<Caller>, Path(sha256): Path<String>, headers: HeaderMap, given: Body) -> Answer {
    let presence = present(&service, &headers, &caller)?;
    service.recorded(&Act::new(&caller, "", "file", b""), Role::Observe, || service.require_role(&caller, Role::Download, "files"))?;
    let given = body(given, FILE_MAX, FILE_TIME).await?;
    apart(move || {
        let act = Act::new(&caller, presence.as_ref().map_or("", |p| &p.name), "file", sha256.as_bytes());
        service.recorded(&act, Role::Download, || {
            service.sessions.require_command(presence.as_ref().map(|p| p.name.as_str()))?;
            service.files.put(&sha256, &given)?;
            Ok(Json(json!({ "result": { "bytes": given.len() } })))
        })
    })
    .await
}
