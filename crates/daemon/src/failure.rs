// SPDX-License-Identifier: Apache-2.0
//! Refusals of requests, with reasons and remedies.
use model::refusal::{Class, Refusal, Refusals};

/// Refusal of a request, with its reasons. The list is never empty.
#[derive(Clone, Debug)]
pub struct Failure {
    /// Refusals of all mistakes.
    pub refusals: Refusals,
    pub ground: Ground,
}

/// Cause of a failure, for cases that cannot be distinguished by the class of its first refusal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ground {
    /// The class is sufficiently specific.
    OfClass,
    /// The caller could not be authenticated: its token, certificate or user is missing or wrong.
    UnknownCaller,
    /// There were too many requests, or they were too frequent. The caller may retry after this time, s.
    TooMany { again_in_s: u64 },
    /// The request did not arrive in time.
    TooSlow,
    /// An internal error of the daemon.
    Internal,
}

impl Failure {
    /// Creates a failure with one refusal.
    pub fn new(class: Class, message: impl Into<String>, remedy: impl Into<String>) -> Failure {
        Failure::from(vec![Refusal::new(class, message).remedy(remedy)])
    }

    /// Sets the cause.
    pub fn ground(self, ground: Ground) -> Failure {
        Failure { ground, ..self }
    }

    /// Sets the time after which the caller may retry, s, because its requests were too many or too frequent.
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
