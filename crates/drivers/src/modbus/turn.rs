// SPDX-License-Identifier: Apache-2.0
//! A lock that is granted in the order of requests. Units on one serial line use it to take turns: with a plain mutex, a unit that
//! immediately locks it again would often overtake those that are waiting.
use std::ops::{Deref, DerefMut};
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};

pub(super) struct Turns<T> {
    /// Next ticket to issue, and the ticket whose turn it is.
    tickets: Mutex<(u64, u64)>,
    moved: Condvar,
    of: Mutex<T>,
}

/// Turn of one unit.
pub(super) struct Turn<'a, T> {
    turns: &'a Turns<T>,
    /// `None` only during drop.
    of: Option<MutexGuard<'a, T>>,
}

impl<T> Turns<T> {
    pub(super) fn new(of: T) -> Turns<T> {
        Turns { tickets: Mutex::new((0, 0)), moved: Condvar::new(), of: Mutex::new(of) }
    }

    /// Waits for a turn.
    pub(super) fn take(&self) -> Turn<'_, T> {
        let mut tickets = self.tickets.lock().unwrap_or_else(PoisonError::into_inner);
        let mine = tickets.0;
        tickets.0 += 1;
        while tickets.1 != mine {
            tickets = self.moved.wait(tickets).unwrap_or_else(PoisonError::into_inner);
        }
        drop(tickets);
        Turn { turns: self, of: Some(self.of.lock().unwrap_or_else(PoisonError::into_inner)) }
    }
}

impl<T> Drop for Turn<'_, T> {
    fn drop(&mut self) {
        self.of = None;
        self.turns.tickets.lock().unwrap_or_else(PoisonError::into_inner).1 += 1;
        self.turns.moved.notify_all();
    }
}

impl<T> Deref for Turn<'_, T> {
    type Target = T;
    fn deref(&self) -> &T {
        self.of.as_ref().expect("it is dropped last")
    }
}

impl<T> DerefMut for Turn<'_, T> {
    fn deref_mut(&mut self) -> &mut T {
        self.of.as_mut().expect("it is dropped last")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicU64, Ordering};

    #[test]
    fn everybody_has_their_turn() {
        let turns = Turns::new(0_u64);
        let others = AtomicU64::new(0);
        std::thread::scope(|scope| {
            let greedy = scope.spawn(|| {
                // Retries at once, like the driver of a dead device; it ends because the others get their turns.
                while others.load(Ordering::Relaxed) < 300 {
                    *turns.take() += 1;
                }
            });
            for _ in 0..3 {
                scope.spawn(|| {
                    for _ in 0..100 {
                        *turns.take() += 1;
                        others.fetch_add(1, Ordering::Relaxed);
                    }
                });
            }
            greedy.join().expect("it ends");
        });
        assert!(*turns.take() >= 300);
    }
}
