// SPDX-License-Identifier: Apache-2.0
//! The control interface inside one process: no socket, no thread of its own, the clock of the runtime that it is used in. For
//! simulators and tests, which let that clock stand still.
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

/// Interval at which it looks after the sessions.
const LOOK: Duration = Duration::from_millis(100);

/// A system with its control interface, served to the holder of its [`Inside::router`].
#[doc(hidden)]
pub struct Inside(Door);

impl Inside {
    /// Makes it; of `options` those count that say who is let in. Errors: as of [`crate::Server::start`].
    pub fn new(system: Arc<System>, options: &Options) -> Result<Inside, Refusals> {
        Ok(Inside(door(service(system, options, Audit::none(), None, None, Lanes::new(None))?, options)?))
    }

    /// Returns the router of all paths. A request has a [`daemon::Peer`] among its extensions and a `host`, as one that has come through a socket.
    pub fn router(&self) -> Router {
        crate::http::router(self.0.clone())
    }

    /// Looks after the sessions as long as it is polled.
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
