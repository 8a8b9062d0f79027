// SPDX-License-Identifier: Apache-2.0
//! Answers that are being sent. Their bytes count against their caller's share until they have been sent, so that clients that do not
//! read cannot exhaust the memory.
use api::Role;
use axum::body::{Body, Bytes};
use axum::http::{HeaderValue, header};
use axum::response::Response;
use daemon::Caller;
use daemon::Failure;
use daemon::Service;
use daemon::Share;
use daemon::lanes::SMALL;
use hyper::body::{Body as HttpBody, Frame, SizeHint};
use std::convert::Infallible;
use std::pin::Pin;
use std::task::{Context, Poll};

/// Number of bytes passed to the connection at a time.
const PIECE: usize = 32 << 10;

/// Unsent remainder of an answer.
struct AnswerRest {
    rest: Bytes,
    _share: Option<Share>,
}

impl HttpBody for AnswerRest {
    type Data = Bytes;
    type Error = Infallible;

    fn poll_frame(mut self: Pin<&mut Self>, _: &mut Context<'_>) -> Poll<Option<Result<Frame<Bytes>, Infallible>>> {
        let size = self.rest.len().min(PIECE);
        Poll::Ready((size > 0).then(|| Ok(Frame::data(self.rest.split_to(size)))))
    }

    fn is_end_stream(&self) -> bool {
        self.rest.is_empty()
    }

    fn size_hint(&self) -> SizeHint {
        SizeHint::with_exact(self.rest.len() as u64)
    }
}

/// Builds the answer with this JSON text to a call that requires this role. If too many bytes are pending for the caller, the answer is
/// refused if the call only observes; the answer to a call that acted is always sent.
pub(crate) fn leaving(service: &Service, caller: &Caller, text: Vec<u8>, role: Role) -> Result<Response, Failure> {
    let share = if text.len() > SMALL && role == Role::Observe { Some(service.lanes.answers.take(caller, text.len())?) } else { None };
    let mut response = Response::new(Body::new(AnswerRest { rest: text.into(), _share: share }));
    response.headers_mut().insert(header::CONTENT_TYPE, HeaderValue::from_static("application/json"));
    Ok(response)
}
