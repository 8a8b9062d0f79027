// SPDX-License-Identifier: Apache-2.0
//! Rate limits of callers: a token bucket for each.
use crate::failure::Failure;
use model::refusal::Class;
use std::collections::HashMap;
use std::sync::Mutex;
use std::time::Instant;

/// Maximum number of callers to remember.
const CALLERS_MAX: usize = 1024;

/// Buckets of one kind.
pub struct Rates {
    per_s: f64,
    burst: f64,
    buckets: Mutex<HashMap<String, (f64, Instant)>>,
}

impl Rates {
    /// Creates rate limits of `per_s` requests a second, with bursts of `burst`.
    pub fn new(per_s: f64, burst: f64) -> Rates {
        Rates { per_s, burst, buckets: Mutex::default() }
    }

    /// Counts a request. Fails with `LimitExceeded` and the time to wait.
    pub fn take(&self, caller: &str, now: Instant) -> Result<(), Failure> {
        let mut buckets = self.buckets.lock().expect("nobody panics with this lock");
        let filled = |(left, at): (f64, Instant)| (left + now.duration_since(at).as_secs_f64() * self.per_s).min(self.burst);
        if !buckets.contains_key(caller) && buckets.len() >= CALLERS_MAX {
            // A caller with a full bucket has not called for a while, and loses nothing by being forgotten.
            buckets.retain(|_, bucket| filled(*bucket) < self.burst);
            if buckets.len() >= CALLERS_MAX {
                return Err(self.refusal(caller, 1.0));
            }
        }
        let bucket = buckets.entry(caller.to_owned()).or_insert((self.burst, now));
        let left = filled(*bucket);
        if left < 1.0 {
            *bucket = (left, now);
            return Err(self.refusal(caller, (1.0 - left) / self.per_s));
        }
        *bucket = (left - 1.0, now);
        Ok(())
    }

    fn refusal(&self, caller: &str, wait_s: f64) -> Failure {
        let message = format!("{caller} makes more than {} calls per second", self.per_s);
        Failure::new(Class::LimitExceeded, message, "wait for the time in Retry-After").again_in((wait_s.ceil() as u64).max(1))
    }
}
