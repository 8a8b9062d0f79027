// SPDX-License-Identifier: Apache-2.0
//! A lock that is given in the order in which it was asked for. Units on one serial line take turns by it: with a plain mutex, one that asks
//! again at once would often come before those that wait.
use std::ops::{Deref, DerefMut};
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};

pub(super) struct Turns<T> {
    /// The next ticket, and the one whose turn it is.
    tickets: Mutex<(u64, u64)>,
    moved: Condvar,
    of: Mutex<T>,
}

/// Turn of one unit.
pub(super) struct Turn<'a, T> {
    turns: &'a Turns<T>,
    /// None only while it is dropped.
    of: Option<MutexGuard<'a, T>>,
}

impl<T> Turns<T> {
    pub(super) fn new(of: T) -> Turns<T> {
        Turns { tickets: Mutex::new((0, 0)), moved: Condvar::new(), of: Mutex::new(of) }
    }

    /// Waits for its turn.
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
                // Asks again at once, as a device does that is dead; it ends because the others come in between.
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
