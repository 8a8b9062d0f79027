// SPDX-License-Identifier: Apache-2.0
//! Requests that upload code and files.
use crate::http::request::{Answer, ServiceState, apart, body};
use crate::presence::present;
use api::Role;
use axum::Json;
use axum::body::Body;
use axum::extract::{Extension, Path, Query, State};
use axum::http::HeaderMap;
use daemon::Act;
use daemon::Caller;
use daemon::Failure;
use daemon::code;
use daemon::files::{FILE_MAX, StoredFile, check_digest};
use daemon::journal::lines::By;
use daemon::lanes::Lane;
use model::refusal::Class;
use serde_json::json;
use std::time::Duration;

/// Time limit for receiving a file.
const FILE_TIME: Duration = Duration::from_secs(120);

pub(super) async fn module(
    State(service): ServiceState,
    Extension(caller): Extension<Caller>,
    Path(name): Path<String>,
    query: Result<Query<code::ModuleOrigin>, axum::extract::rejection::QueryRejection>,
    headers: HeaderMap,
    given: Body,
) -> Answer {
    let presence = present(&service, &headers, &caller)?;
    service.recorded(&Act::new(&caller, "", "module", b""), Role::Observe, || service.require_role(&caller, Role::Download, "modules"))?;
    let Query(named) = query.map_err(|why| Failure::new(Class::CallError, why.body_text(), "write ?file=NAME&sha256=HEX"))?;
    let given = body(given, FILE_MAX, FILE_TIME).await?;
    let here = service.clone();
    apart(&here, Lane::Usual, &caller.clone(), move || {
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

pub(super) async fn file_is_there(State(service): ServiceState, Path(sha256): Path<String>) -> Answer {
    match service.files.size(&sha256) {
        Some(bytes) => Ok(Json(json!({ "result": StoredFile { bytes } }))),
        None => Err(Failure::new(Class::UnknownName, format!("there is no file with SHA-256 '{sha256}'"), "upload it").into()),
    }
}

pub(super) async fn file(
    State(service): ServiceState,
    Extension(caller): Extension<Caller>,
    Path(sha256): Path<String>,
    headers: HeaderMap,
    given: Body,
) -> Answer {
    let presence = present(&service, &headers, &caller)?;
    service.recorded(&Act::new(&caller, "", "file", b""), Role::Observe, || service.require_role(&caller, Role::Download, "files"))?;
    let given = body(given, FILE_MAX, FILE_TIME).await?;
    let here = service.clone();
    apart(&here, Lane::Usual, &caller.clone(), move || {
        let act = Act::new(&caller, presence.as_ref().map_or("", |p| &p.name), "file", sha256.as_bytes());
        service.recorded(&act, Role::Download, || {
            service.sessions.require_command(presence.as_ref().map(|p| p.name.as_str()))?;
            service.files.put(&sha256, &given)?;
            Ok(Json(json!({ "result": StoredFile { bytes: given.len() as u64 } })))
        })
    })
    .await
}
