// SPDX-License-Identifier: Apache-2.0
//! Requests that concern sessions: listing, opening, holding and closing them, and collecting pending end reports.
use crate::http::request::{Answer, BODY_TIME, ServiceState, apart, body};
use crate::presence::{SessionHold, needed, present};
use api::Role;
use axum::Json;
use axum::body::Body;
use axum::extract::{Extension, Path, Query, State};
use axum::http::HeaderMap;
use daemon::Act;
use daemon::Caller;
use daemon::Failure;
use daemon::clock::now;
use daemon::lanes::{Lane, SMALL};
use daemon::requests::{self, OpenSession};
use daemon::{Reports, SessionAnswer};
use model::refusal::Class;
use serde::Deserialize;
use serde_json::{Value, json};
use std::time::Duration;

/// Period at which a connection that holds a session checks that the session still exists.
const HOLD_LOOK: Duration = Duration::from_millis(100);

/// Returns the lane for requests that lead to a stop.
pub(super) fn to_stop(caller: &Caller) -> Lane {
    if caller.role >= Role::Operate { Lane::Stop } else { Lane::Usual }
}

pub(super) async fn list(State(service): ServiceState) -> Json<Value> {
    Json(json!({ "result": service.sessions.list() }))
}

pub(super) async fn open(State(service): ServiceState, Extension(caller): Extension<Caller>, given: Body) -> Answer {
    let given = body(given, SMALL, BODY_TIME).await?;
    let asked: OpenSession = requests::object::<OpenSession>(&given)?.checked()?;
    let here = service.clone();
    apart(&here, to_stop(&caller), &caller.clone(), move || {
        service.look_after(now());
        let act = Act::new(&caller, &asked.name, "open_session", &given);
        let opened = service.recorded(&act, Role::Operate, || service.sessions.open(&caller, &asked, now()))?;
        let instances = service.described(&opened.instances);
        Ok(Json(json!({ "result": SessionAnswer { opened, instances } })))
    })
    .await
}

pub(super) async fn close(State(service): ServiceState, Extension(caller): Extension<Caller>, headers: HeaderMap) -> Answer {
    let presence = needed(present(&service, &headers, &caller)?)?;
    let act = Act::new(&caller, &presence.name, "close_session", b"");
    let here = service.clone();
    apart(&here, Lane::Usual, &caller, move || {
        service.recorded(&act, Role::Operate, || service.close_session(&presence.id))?;
        Ok(Json(json!({ "result": null })))
    })
    .await
}

pub(super) async fn heartbeat(State(service): ServiceState, Extension(caller): Extension<Caller>, headers: HeaderMap) -> Answer {
    needed(present(&service, &headers, &caller)?)?;
    Ok(Json(json!({ "result": null })))
}

pub(super) async fn hold(State(service): ServiceState, Extension(caller): Extension<Caller>, headers: HeaderMap) -> Answer {
    // This request must not itself count as under way: a silent session stays silent.
    let id = needed(present(&service, &headers, &caller)?)?.id.clone();
    let mut held = SessionHold::new(service.clone(), id.clone());
    let mut look = tokio::time::interval(HOLD_LOOK);
    while service.sessions.is_alive(&id) {
        look.tick().await;
    }
    held.in_order = true;
    Ok(Json(json!({ "result": null })))
}

pub(super) async fn reports(State(service): ServiceState, Extension(caller): Extension<Caller>, Path(name): Path<String>) -> Answer {
    let here = service.clone();
    apart(&here, Lane::Usual, &caller.clone(), move || {
        service.drain();
        let (reports, lost) = service.sessions.reports(&name, &caller)?;
        Ok(Json(json!({ "result": Reports { reports, lost } })))
    })
    .await
}

#[derive(Deserialize)]
pub(super) struct Through {
    through: u64,
}

pub(super) async fn collect(
    State(service): ServiceState,
    Extension(caller): Extension<Caller>,
    Path(name): Path<String>,
    query: Result<Query<Through>, axum::extract::rejection::QueryRejection>,
) -> Answer {
    let Query(Through { through }) = query.map_err(|why| Failure::new(Class::CallError, why.body_text(), "write ?through=NUMBER"))?;
    service.sessions.collect(&name, &caller, through)?;
    Ok(Json(json!({ "result": null })))
}
