// SPDX-License-Identifier: Apache-2.0
//! Shares of limited resources. A quarter of a resource is reserved for callers that hold none of it yet. Of the rest, a caller may have
//! up to half of the free amount, so the next caller always receives a share, even if several callers hold their maximum.
use crate::caller::Caller;
use crate::failure::Failure;
use api::Role;
use model::refusal::Class;
use std::collections::HashMap;
use std::sync::{Arc, Mutex, MutexGuard};
use tokio::sync::{OwnedSemaphorePermit, Semaphore};

/// A limited resource, shared by all callers.
pub struct Shares {
    /// Name of the resource in the plural, for example `waits`.
    what: &'static str,
    all: usize,
    /// Maximum amount per caller.
    each: usize,
    /// Amount reserved for roles that may command and stop.
    kept: usize,
    held: Mutex<HashMap<String, usize>>,
}

/// Share of one caller, held until it is dropped.
pub struct Share {
    of: Arc<Shares>,
    who: String,
    amount: usize,
}

impl Shares {
    pub fn new(what: &'static str, all: usize, each: usize, kept: usize) -> Arc<Shares> {
        Arc::new(Shares { what, all, each, kept, held: Mutex::default() })
    }

    fn locked(&self) -> MutexGuard<'_, HashMap<String, usize>> {
        self.held.lock().expect("nobody panics with this lock")
    }

    /// Takes an amount for a caller. Fails with `LimitExceeded`, which names the limit that was reached.
    pub fn take(self: &Arc<Shares>, caller: &Caller, amount: usize) -> Result<Share, Failure> {
        let mut held = self.locked();
        let own = held.get(&caller.who).copied().unwrap_or(0);
        let kept = if caller.role >= Role::Operate { 0 } else { self.kept };
        let used: usize = held.values().sum();
        let free = (self.all - kept).saturating_sub(used);
        // A quarter is reserved for callers that have none yet.
        let more = free.saturating_sub((self.all - kept) / 4) / 2;
        let full = if own + amount > self.each || (own > 0 && own + amount > more) {
            format!("{} already has {own} {} at a time, its share of {}", caller.who, self.what, self.all - kept)
        } else if amount > free {
            format!("all callers together already have {used} {} at a time", self.what)
        } else {
            *held.entry(caller.who.clone()).or_default() += amount;
            return Ok(Share { of: self.clone(), who: caller.who.clone(), amount });
        };
        Err(Failure::new(Class::LimitExceeded, full, "try again when one has ended").again_in(1))
    }
}

impl Drop for Share {
    fn drop(&mut self) {
        let mut held = self.of.locked();
        if let Some(own) = held.get_mut(&self.who) {
            *own -= self.amount;
            if *own == 0 {
                held.remove(&self.who);
            }
        }
    }
}

/// Number of remembered callers above which those that have no turn are forgotten.
const REMEMBERED: usize = 64;

/// Limit on the number of requests executed concurrently for one caller. Further requests wait for their turn, and thus delay only that
/// caller.
pub struct Turns {
    each: usize,
    of: Mutex<HashMap<String, Arc<Semaphore>>>,
}

impl Turns {
    pub fn new(each: usize) -> Turns {
        Turns { each, of: Mutex::default() }
    }

    /// Waits until it is this caller's turn.
    pub async fn take(&self, who: &str) -> OwnedSemaphorePermit {
        let own = {
            let mut of = self.of.lock().expect("nobody panics with this lock");
            if of.len() >= REMEMBERED {
                of.retain(|_, turns| Arc::strong_count(turns) > 1);
            }
            of.entry(who.to_owned()).or_insert_with(|| Arc::new(Semaphore::new(self.each))).clone()
        };
        own.acquire_owned().await.expect("it is never closed")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn caller(who: &str, role: Role) -> Caller {
        Caller { who: who.to_owned(), role, from: String::new() }
    }

    /// Takes shares one at a time until refused; returns them and the message.
    fn fill(shares: &Arc<Shares>, caller: &Caller) -> (Vec<Share>, String) {
        let mut own = Vec::new();
        loop {
            match shares.take(caller, 1) {
                Ok(share) => own.push(share),
                Err(failure) => return (own, failure.refusals[0].message.clone()),
            }
        }
    }

    #[test]
    fn whoever_comes_finds_some_where_many_hold_what_they_can() {
        let shares = Shares::new("waits", 96, 32, 32);
        let mut held = Vec::new();
        for number in 0..20 {
            let (own, said) = fill(&shares, &caller(&format!("token o{number}"), Role::Observe));
            assert!(!own.is_empty(), "observer {number} got none");
            assert!(said.starts_with(&format!("token o{number} already has {} waits at a time", own.len())), "{said}");
            held.push(own);
        }
        let (own, _) = fill(&shares, &caller("token panel", Role::Operate));
        assert!(own.len() >= 4, "what is kept for who may stop is taken by no observer: {}", own.len());
    }

    #[test]
    fn what_is_given_back_can_be_taken_again() {
        let shares = Shares::new("waits", 2, 2, 0);
        let (own, said) = fill(&shares, &caller("token a", Role::Observe));
        assert_eq!((own.len(), said.as_str()), (1, "token a already has 1 waits at a time, its share of 2"));
        let (other, _) = fill(&shares, &caller("token b", Role::Observe));
        assert_eq!(other.len(), 1);
        let said = shares.take(&caller("token c", Role::Observe), 1).err().expect("there is none left").refusals[0].message.clone();
        assert_eq!(said, "all callers together already have 2 waits at a time");
        drop(own);
        assert!(shares.take(&caller("token c", Role::Observe), 1).is_ok());
    }
}
