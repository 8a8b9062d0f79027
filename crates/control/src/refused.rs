// SPDX-License-Identifier: Apache-2.0
//! Answers that carry a refusal: a status and `{"errors": […]}`.
use axum::http::{HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use daemon::{Failure, Ground};
use model::refusal::Class;
use serde_json::json;

/// Answer to a refused request.
#[derive(Debug)]
pub(crate) struct RefusedRequest(pub Failure);

impl From<Failure> for RefusedRequest {
    fn from(failure: Failure) -> RefusedRequest {
        RefusedRequest(failure)
    }
}

/// Returns the HTTP status of a refusal.
fn status(failure: &Failure) -> StatusCode {
    match failure.ground {
        Ground::OfClass => status_of(failure.class()),
        Ground::UnknownCaller => StatusCode::UNAUTHORIZED,
        Ground::TooMany { .. } => StatusCode::TOO_MANY_REQUESTS,
        Ground::TooSlow => StatusCode::REQUEST_TIMEOUT,
        Ground::Internal => StatusCode::INTERNAL_SERVER_ERROR,
    }
}

/// Returns the HTTP status of a class of refusals.
fn status_of(class: Class) -> StatusCode {
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

impl IntoResponse for RefusedRequest {
    fn into_response(self) -> Response {
        let RefusedRequest(failure) = self;
        let status = status(&failure);
        let mut response = (status, axum::Json(json!({ "errors": failure.refusals }))).into_response();
        if let Ground::TooMany { again_in_s } = failure.ground {
            response.headers_mut().insert(header::RETRY_AFTER, HeaderValue::from(again_in_s));
        }
        if status == StatusCode::UNAUTHORIZED {
            response.headers_mut().insert(header::WWW_AUTHENTICATE, HeaderValue::from_static("Bearer"));
        }
        response
    }
}
