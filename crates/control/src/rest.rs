// SPDX-License-Identifier: Apache-2.0
//! The unread remainder of a body. It is read before the answer is sent, so that a client that is still sending receives the refusal
//! instead of a closed connection.
use axum::body::{Bytes, HttpBody};
use daemon::calls::BODY_MAX;
use hyper::body::{Frame, Incoming, SizeHint};
use std::future::poll_fn;
use std::pin::Pin;
use std::sync::{Arc, Mutex, PoisonError};
use std::task::{Context, Poll};
use std::time::Duration;

/// Time limit for receiving the remainder.
const REST_TIME: Duration = Duration::from_secs(2);

/// Body that its handler abandoned before the end, if any.
#[derive(Clone, Default)]
pub(crate) struct Rest(Arc<Mutex<Option<Incoming>>>);

/// A body that a handler reads.
pub(crate) struct HandlerBody {
    /// Body; moved to `rest` when this is dropped.
    body: Option<Incoming>,
    rest: Rest,
}

impl Rest {
    /// Wraps the body for a handler.
    pub fn of(&self, body: Incoming) -> HandlerBody {
        HandlerBody { body: Some(body), rest: self.clone() }
    }

    /// Reads and discards the abandoned remainder, up to the maximum length of a body.
    pub async fn take(&self) {
        let Some(mut body) = self.0.lock().unwrap_or_else(PoisonError::into_inner).take() else { return };
        let read = async {
            let mut size = 0;
            while let Some(Ok(frame)) = poll_fn(|context| Pin::new(&mut body).poll_frame(context)).await {
                size += frame.data_ref().map_or(0, Bytes::len);
                if size > BODY_MAX {
                    break;
                }
            }
        };
        // Slower clients get no more time.
        let _late = tokio::time::timeout(REST_TIME, read).await;
    }
}

impl HttpBody for HandlerBody {
    type Data = Bytes;
    type Error = hyper::Error;

    fn poll_frame(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<Option<Result<Frame<Bytes>, hyper::Error>>> {
        self.body.as_mut().map_or(Poll::Ready(None), |body| Pin::new(body).poll_frame(context))
    }

    fn is_end_stream(&self) -> bool {
        self.body.as_ref().is_none_or(HttpBody::is_end_stream)
    }

    fn size_hint(&self) -> SizeHint {
        self.body.as_ref().map_or_else(SizeHint::default, HttpBody::size_hint)
    }
}

impl Drop for HandlerBody {
    fn drop(&mut self) {
        if let Some(body) = self.body.take().filter(|body| !body.is_end_stream()) {
            *self.rest.0.lock().unwrap_or_else(PoisonError::into_inner) = Some(body);
        }
    }
}
