// SPDX-License-Identifier: Apache-2.0
//! Refusals as answers: a status and `{"errors": […]}`.
use axum::http::{HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use model::refusal::{Class, Refusal, Refusals};
use serde_json::json;

/// Refusal of a request, with its reasons. The list is never empty.
#[derive(Clone, Debug)]
pub struct Failure {
    /// The status of the answer.
    pub status: StatusCode,
    /// Refusals of all that is wrong.
    pub refusals: Refusals,
    /// When to come again, s.
    pub retry_after_s: Option<u64>,
}

impl Failure {
    /// Makes a failure of one refusal; its class says the status.
    pub fn new(class: Class, message: impl Into<String>, remedy: impl Into<String>) -> Failure {
        Failure::from(vec![Refusal::new(class, message).remedy(remedy)])
    }

    /// Sets another status than that of its class.
    pub fn status(mut self, status: StatusCode) -> Failure {
        self.status = status;
        self
    }

    /// Sets when to come again, s: there were too many, or too often.
    pub fn again_in(mut self, seconds: u64) -> Failure {
        self.retry_after_s = Some(seconds);
        self.status(StatusCode::TOO_MANY_REQUESTS)
    }

    /// Returns the class of the first refusal.
    pub fn class(&self) -> Class {
        self.refusals.first().map_or(Class::CallError, |refusal| refusal.class)
    }
}

impl From<Refusals> for Failure {
    fn from(refusals: Refusals) -> Failure {
        let class = refusals.first().map_or(Class::CallError, |refusal| refusal.class);
        Failure { status: status_of(class), refusals, retry_after_s: None }
    }
}

/// Returns the status that a class has.
pub fn status_of(class: Class) -> StatusCode {
    match class {
        Class::NotAllowed | Class::NotCommanding => StatusCode::FORBIDDEN,
        Class::UnknownName => StatusCode::NOT_FOUND,
        Class::InvalidState | Class::InUse | Class::SecondWriter | Class::NotEnabled | Class::EmergencyStopped => StatusCode::CONFLICT,
        Class::SessionLost => StatusCode::GONE,
        Class::LimitExceeded => StatusCode::PAYLOAD_TOO_LARGE,
        Class::AuditFailed => StatusCode::SERVICE_UNAVAILABLE,
        _ => StatusCode::BAD_REQUEST,
    }
}

impl IntoResponse for Failure {
    fn into_response(self) -> Response {
        let mut response = (self.status, axum::Json(json!({ "errors": self.refusals }))).into_response();
        if let Some(seconds) = self.retry_after_s {
            response.headers_mut().insert(header::RETRY_AFTER, HeaderValue::from(seconds));
        }
        if self.status == StatusCode::UNAUTHORIZED {
            response.headers_mut().insert(header::WWW_AUTHENTICATE, HeaderValue::from_static("Bearer"));
        }
        response
    }
}
