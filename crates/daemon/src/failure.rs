// SPDX-License-Identifier: Apache-2.0
//! Refusals of requests: the reasons, and what a caller can do about them.
use model::refusal::{Class, Refusal, Refusals};

/// Refusal of a request, with its reasons. The list is never empty.
#[derive(Clone, Debug)]
pub struct Failure {
    /// Refusals of all that is wrong.
    pub refusals: Refusals,
    pub ground: Ground,
}

/// Ground of a refusal, where the class of the first reason does not say all.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ground {
    /// The class says it.
    OfClass,
    /// The caller is not known: its token, certificate or user is missing or wrong.
    UnknownCaller,
    /// There were too many requests, or too often: the caller may come again after this time, s.
    TooMany { again_in_s: u64 },
    /// The request did not arrive in time.
    TooSlow,
    /// Fault of the daemon itself.
    Internal,
}

impl Failure {
    /// Makes a failure of one refusal.
    pub fn new(class: Class, message: impl Into<String>, remedy: impl Into<String>) -> Failure {
        Failure::from(vec![Refusal::new(class, message).remedy(remedy)])
    }

    /// Sets the ground.
    pub fn ground(self, ground: Ground) -> Failure {
        Failure { ground, ..self }
    }

    /// Sets when to come again, s: there were too many, or too often.
    pub fn again_in(self, seconds: u64) -> Failure {
        self.ground(Ground::TooMany { again_in_s: seconds })
    }

    /// Returns the class of the first refusal.
    pub fn class(&self) -> Class {
        self.refusals.first().map_or(Class::CallError, |refusal| refusal.class)
    }
}

impl From<Refusals> for Failure {
    fn from(refusals: Refusals) -> Failure {
        Failure { refusals, ground: Ground::OfClass }
    }
}
