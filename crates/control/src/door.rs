// SPDX-License-Identifier: Apache-2.0
//! State of the door: a daemon, and what is of HTTP between it and its callers.
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
    /// The studio's page, where it is served.
    pub page: Option<Arc<Page>>,
    /// Requests that were not admitted, by address.
    pub failures: Arc<Rates>,
    pub slots: Doors,
}

impl Door {
    /// Enters into the log which connections gave way to others, since they did not say whose they are.
    pub fn tell_who_gave_way(&self) {
        let gave = self.slots.gave_way();
        let (Some((most, count)), all) = (gave.first(), gave.iter().map(|(_, count)| count).sum::<u64>()) else { return };
        let text = format!("{all} connections that did not say whose they are gave way to others, {count} of them from {most}");
        self.service.system.log_control(&text);
    }
}

impl FromRef<Door> for Arc<Service> {
    fn from_ref(door: &Door) -> Arc<Service> {
        door.service.clone()
    }
}
