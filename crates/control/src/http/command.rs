// SPDX-License-Identifier: Apache-2.0
//! Requests about command: querying it, taking it, requesting it and handing it over.
use crate::http::request::{Answer, BODY_TIME, ServiceState, apart, body};
use crate::http::sessions::to_stop;
use crate::presence::{needed, present};
use api::Role;
use axum::Json;
use axum::body::Body;
use axum::extract::{Extension, State};
use axum::http::HeaderMap;
use daemon::Act;
use daemon::Caller;
use daemon::Failure;
use daemon::clock::now;
use daemon::lanes::{Lane, SMALL};
use daemon::requests::{self, AskForCommand, DeclineRequest, HandOver, TakeCommand, WithdrawRequest};
use daemon::{Presence, Service};
use serde::de::DeserializeOwned;
use serde_json::{Value, json};
use std::sync::Arc;
use std::time::Duration;

/// Returns the holder of command. This is the answer to every request that concerns command.
fn told(service: &Service) -> Json<Value> {
    Json(json!({ "result": service.sessions.command(now()) }))
}

pub(super) async fn holder(State(service): ServiceState) -> Json<Value> {
    told(&service)
}

/// Description of a request that takes, requests or hands over command of the system: its name in the audit file and the log, the lane in
/// which it runs, and the session that its record names.
struct About {
    name: &'static str,
    lane: Lane,
    /// Returns the name of the session that the record names; empty if the record concerns the system.
    of: fn(&Value) -> String,
}

async fn of_command<T: DeserializeOwned + Send + 'static>(
    (service, caller, headers, given): (Arc<Service>, Caller, HeaderMap, Body),
    About { name, lane, of }: About,
    act_on: impl FnOnce(&Service, &Presence, T) -> Result<(), Failure> + Send + 'static,
) -> Answer {
    let presence = needed(present(&service, &headers, &caller)?)?;
    let given = body(given, SMALL, BODY_TIME).await?;
    let asked: T = requests::object(&given)?;
    let here = service.clone();
    apart(&here, lane, &caller.clone(), move || {
        // A lost session does not keep command.
        service.look_after(now());
        let mut act = Act::new(&caller, &presence.name, name, &given);
        act.about = of(&serde_json::from_slice(&given).unwrap_or_default());
        service.recorded(&act, Role::Operate, || {
            service.require_role(&caller, Role::Operate, "command")?;
            act_on(&service, &presence, asked)
        })?;
        Ok(told(&service))
    })
    .await
}

fn of_system(_: &Value) -> String {
    String::new()
}

pub(super) async fn take(State(service): ServiceState, Extension(caller): Extension<Caller>, headers: HeaderMap, given: Body) -> Answer {
    let (lane, role) = (to_stop(&caller), caller.role);
    of_command((service, caller, headers, given), About { name: "take_command", lane, of: of_system }, move |service, presence, asked: TakeCommand| {
        service.sessions.take(&presence.name, role, asked.force)
    })
    .await
}

pub(super) async fn give_back(State(service): ServiceState, Extension(caller): Extension<Caller>, headers: HeaderMap) -> Answer {
    let presence = needed(present(&service, &headers, &caller)?)?;
    if service.sessions.holder().as_ref() == Some(&presence.name) {
        let act = Act::new(&caller, &presence.name, "give_command_back", b"");
        service.recorded(&act, Role::Operate, || {
            service.sessions.give_back(&presence.name);
            Ok(())
        })?;
    }
    Ok(told(&service))
}

pub(super) async fn ask(State(service): ServiceState, Extension(caller): Extension<Caller>, headers: HeaderMap, given: Body) -> Answer {
    let about = About { name: "request_command", lane: Lane::Usual, of: of_system };
    of_command((service, caller, headers, given), about, |service, presence, asked: AskForCommand| {
        let asked = asked.checked()?;
        service.sessions.ask(&presence.name, &asked.reason, Duration::from_millis(asked.wait_ms), now());
        Ok(())
    })
    .await
}

pub(super) async fn withdraw(State(service): ServiceState, Extension(caller): Extension<Caller>, headers: HeaderMap, given: Body) -> Answer {
    let about = About { name: "withdraw_request", lane: Lane::Usual, of: of_system };
    of_command((service, caller, headers, given), about, |service, presence, asked: WithdrawRequest| {
        service.sessions.withdraw(&presence.name, &requests::reason(asked.reason)?)
    })
    .await
}

pub(super) async fn hand_over(State(service): ServiceState, Extension(caller): Extension<Caller>, headers: HeaderMap, given: Body) -> Answer {
    let of = |given: &Value| given["to"].as_str().unwrap_or_default().to_owned();
    let about = About { name: "hand_over_command", lane: Lane::Usual, of };
    of_command((service, caller, headers, given), about, |service, presence, asked: HandOver| service.sessions.hand_over(&presence.name, &asked.to)).await
}

pub(super) async fn decline(State(service): ServiceState, Extension(caller): Extension<Caller>, headers: HeaderMap, given: Body) -> Answer {
    let of = |given: &Value| given["name"].as_str().unwrap_or_default().to_owned();
    let about = About { name: "decline_request", lane: Lane::Usual, of };
    of_command((service, caller, headers, given), about, |service, presence, asked: DeclineRequest| {
        service.sessions.decline(&presence.name, &asked.name, &requests::reason(asked.reason)?)
    })
    .await
}
