// SPDX-License-Identifier: Apache-2.0
//! State of the HTTP front end: the daemon that it serves, and its HTTP-specific state.
use crate::page::Page;
use crate::site::Site;
use crate::slots::Doors;
use axum::extract::FromRef;
use daemon::{Rates, Service};
use std::sync::Arc;

/// A daemon that is served over HTTP.
#[derive(Clone)]
pub(crate) struct Door {
    pub service: Arc<Service>,
    pub site: Arc<Site>,
    /// Page of the studio, if it is served.
    pub page: Option<Arc<Page>>,
    /// Rates of rejected requests, by address.
    pub failures: Arc<Rates>,
    pub slots: Doors,
}

impl Door {
    /// Logs the origins of the unauthenticated connections that gave way to others.
    pub fn tell_who_gave_way(&self) {
        let gave = self.slots.gave_way();
        let (Some((most, count)), all) = (gave.first(), gave.iter().map(|(_, count)| count).sum::<u64>()) else { return };
        let text = format!("{all} connections that did not authenticate were closed to make room for others, {count} of them from {most}");
        self.service.system.log_control(&text);
    }
}

impl FromRef<Door> for Arc<Service> {
    fn from_ref(door: &Door) -> Arc<Service> {
        door.service.clone()
    }
}
