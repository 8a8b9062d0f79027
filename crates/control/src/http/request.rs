// SPDX-License-Identifier: Apache-2.0
//! Common part of all requests: reads bodies within size and time limits, and runs each request on a thread of its lane.
use crate::refused::RefusedRequest;
use axum::Json;
use axum::body::{Body, Bytes, HttpBody};
use axum::extract::State;
use daemon::Caller;
use daemon::Service;
use daemon::Share;
use daemon::calls::BODY_MAX;
use daemon::lanes::{Lane, SMALL};
use daemon::{Failure, Ground};
use model::refusal::Class;
use serde_json::Value;
use std::pin::Pin;
use std::sync::Arc;
use std::time::Duration;

pub(crate) type ServiceState = State<Arc<Service>>;
pub(super) type Answer = Result<Json<Value>, RefusedRequest>;

/// Time limit for receiving a body.
pub(super) const BODY_TIME: Duration = Duration::from_secs(10);

/// Reads a body of at most `most` bytes.
pub(super) async fn body(body: Body, most: usize, time: Duration) -> Result<Bytes, Failure> {
    let late = |_| Failure::new(Class::LimitExceeded, format!("the body did not arrive within {} s", time.as_secs()), "send it faster").ground(Ground::TooSlow);
    tokio::time::timeout(time, collect(body, most)).await.map_err(late)?
}

/// Collects a body. The remainder of an oversized body is also read, up to a limit, so that the sender receives the refusal.
async fn collect(mut body: Body, most: usize) -> Result<Bytes, Failure> {
    let refused = || Failure::new(Class::LimitExceeded, format!("the body has more than {most} bytes, or was interrupted"), "send less at once");
    let (mut text, mut size) = (Vec::new(), 0);
    while let Some(frame) = std::future::poll_fn(|context| Pin::new(&mut body).poll_frame(context)).await {
        let Ok(data) = frame.map_err(|_| refused())?.into_data() else { continue };
        size += data.len();
        if size <= most {
            text.extend_from_slice(&data);
        } else if size > most.max(BODY_MAX) + SMALL {
            break;
        }
    }
    if size > most { Err(refused()) } else { Ok(text.into()) }
}

/// Reads the body of a call, and claims its share of the memory reserved for the bodies of all callers.
pub(super) async fn roomy(service: &Service, caller: &Caller, given: Body, most: usize) -> Result<(Bytes, Option<Share>), Failure> {
    let size = given.size_hint().upper().and_then(|size| usize::try_from(size).ok()).unwrap_or(most).min(most);
    let share = if size > SMALL { Some(service.lanes.bodies.take(caller, size)?) } else { None };
    Ok((body(given, most, BODY_TIME).await?, share))
}

/// Runs a request that is not a call on a thread of its lane.
pub(super) async fn apart<T: Send + 'static>(
    service: &Service,
    lane: Lane,
    caller: &Caller,
    run: impl FnOnce() -> Result<T, Failure> + Send + 'static,
) -> Result<T, RefusedRequest> {
    Ok(service.lanes.enter(lane, caller)?.run(run).await?)
}
