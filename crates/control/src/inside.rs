// SPDX-License-Identifier: Apache-2.0
//! The control interface within one process. It needs neither a socket nor a thread, and uses the clock of the runtime in which it runs;
//! simulators and tests can stop that clock.
use crate::door::Door;
use crate::serve::{Options, door, service};
use axum::Router;
use daemon::Audit;
use daemon::clock::{Looks, now};
use daemon::lanes::Lanes;
use model::refusal::Refusals;
use std::sync::Arc;
use std::time::Duration;
use supervisor::System;

/// Interval between session checks.
const LOOK: Duration = Duration::from_millis(100);

/// A system with its control interface, served to the owner of [`Inside::router`].
#[doc(hidden)]
pub struct Inside(Door);

impl Inside {
    /// Serves a system. Only the `options` that concern admission have an effect. Fails as [`crate::Server::start`] does.
    pub fn new(system: Arc<System>, options: &Options) -> Result<Inside, Refusals> {
        Ok(Inside(door(service(system, options, Audit::none(), None, None, Lanes::new(None))?, options)?))
    }

    /// Returns the router of all paths. Every request must carry a [`daemon::Peer`] extension, and a `Host` header like one that arrives
    /// over a socket.
    pub fn router(&self) -> Router {
        crate::http::router(self.0.clone())
    }

    /// Checks the sessions at regular intervals, as long as the returned future is polled.
    pub async fn look_after(&self) {
        let mut tick = tokio::time::interval(LOOK);
        let mut regular = Looks::new(LOOK);
        loop {
            tick.tick().await;
            if let Some(late) = regular.look() {
                self.0.service.stood_still(late, now());
            }
            self.0.service.look_after(now());
        }
    }
}
