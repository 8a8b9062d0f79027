// SPDX-License-Identifier: Apache-2.0
//! Session of a request, connections that hold a session, and revocation of a caller's access, both for requests and for streams.
use axum::http::HeaderMap;
use daemon::Failure;
use daemon::{Caller, Pass};
use daemon::{Presence, Service};
use model::refusal::Class;
use std::sync::Arc;
use std::time::Duration;

/// Header that gives the time of a command on the daemon's clock, ms: the time in the last heartbeat of a stream plus the time elapsed
/// since then.
const AS_OF: &str = "opengpac-as-of";

/// Period at which the access of a caller is rechecked during a long request.
pub(crate) const LOOK_AGAIN: Duration = Duration::from_secs(1);

/// Returns the session of a request.
pub(crate) fn present(service: &Arc<Service>, headers: &HeaderMap, caller: &Caller) -> Result<Option<Presence>, Failure> {
    let id = headers.get("opengpac-session").map(|id| id.to_str().unwrap_or(""));
    service.present(id, caller)
}

/// Returns the time at which a request was made, or `None` if the request does not contain it.
pub(crate) fn as_of_ms(headers: &HeaderMap) -> Result<Option<u64>, Failure> {
    let Some(said) = headers.get(AS_OF) else { return Ok(None) };
    let ms = said.to_str().ok().and_then(|text| text.parse().ok());
    let wrong = || Failure::new(Class::CallError, "OpenGPAC-As-Of is not a number of ms", "add the time since the last 'beat' of a stream to its number");
    ms.map(Some).ok_or_else(wrong)
}

pub(crate) fn needed(presence: Option<Presence>) -> Result<Presence, Failure> {
    presence.ok_or_else(|| Failure::new(Class::CallError, "there is no session", "open one and send its ID in the header OpenGPAC-Session"))
}

/// A connection that holds a session. If the connection breaks before the session ends, the session is lost.
pub(crate) struct SessionHold {
    service: Arc<Service>,
    id: String,
    pub in_order: bool,
}

impl SessionHold {
    pub fn new(service: Arc<Service>, id: String) -> SessionHold {
        service.sessions.hold(&id);
        SessionHold { service, id, in_order: false }
    }
}

impl Drop for SessionHold {
    fn drop(&mut self) {
        self.service.sessions.let_go(&self.id, !self.in_order);
    }
}

/// Waits until a caller loses access, and returns the reason.
pub(crate) async fn shut_out(service: &Service, caller: &Caller, pass: &Pass) -> Failure {
    loop {
        tokio::time::sleep(LOOK_AGAIN).await;
        if let Err(failure) = service.gate.look_again(caller, pass) {
            return failure;
        }
    }
}
