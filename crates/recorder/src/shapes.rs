// SPDX-License-Identifier: Apache-2.0
//! Requests the shapes of devices beside the recording: loading a model again takes longer than values may wait.
use std::collections::BTreeSet;
use std::thread::JoinHandle;
use supervisor::{Geometry, System};

/// A shape, with its device and the time of the request.
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

    /// Returns the shapes that are available by now; if `all` is true, waits for every requested one, however long that takes.
    pub fn take(&mut self, all: bool) -> Vec<Shape> {
        let there = self.under_way.extract_if(.., |thread| all || thread.is_finished());
        there.filter_map(|thread| thread.join().ok()).flatten().collect()
    }
}
