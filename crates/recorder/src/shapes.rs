// SPDX-License-Identifier: Apache-2.0
//! Requests the shapes of devices on a separate thread, because reloading a model takes longer than values may wait.
use std::collections::BTreeSet;
use std::thread::JoinHandle;
use supervisor::{Geometry, System};

/// Device, time of the request, and shape.
pub(crate) type Shape = (String, i64, Geometry);

/// Shapes of devices, each requested once.
#[derive(Default)]
pub(crate) struct Shapes {
    asked: BTreeSet<String>,
    under_way: Vec<JoinHandle<Vec<Shape>>>,
}

impl Shapes {
    /// Requests the shapes of new devices.
    pub fn ask<'a>(&mut self, system: &System, devices: impl Iterator<Item = &'a String>, now_ns: i64) {
        let new: Vec<String> = devices.filter(|device| self.asked.insert((*device).clone())).cloned().collect();
        if new.is_empty() {
            return;
        }
        let system = system.observer();
        let shape = move |device: String| system.geometry(&device).ok().map(|geometry| (device, now_ns, geometry));
        // Without a thread there is no shape; the recording continues.
        let begun = std::thread::Builder::new().name("recorder-shapes".to_owned()).spawn(move || new.into_iter().filter_map(shape).collect());
        self.under_way.extend(begun);
    }

    /// Returns the shapes that have become available; if `all` is true, waits for every requested shape, however long that takes.
    pub fn take(&mut self, all: bool) -> Vec<Shape> {
        let there = self.under_way.extract_if(.., |thread| all || thread.is_finished());
        there.filter_map(|thread| thread.join().ok()).flatten().collect()
    }
}
