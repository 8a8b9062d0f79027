// SPDX-License-Identifier: Apache-2.0
//! Buffer between the draining and the writing thread: an ordered queue of pages with bounded size.
use crate::page::Page;
use std::collections::VecDeque;
use std::sync::{Condvar, Mutex, MutexGuard};

/// Maximum total size of the pages waiting for the disk, bytes.
pub(crate) const ROOM: usize = 64 << 20;

#[derive(Default)]
struct WaitingPages {
    pages: VecDeque<Page>,
    /// Written pages, whose memory is reused.
    empty: Vec<Page>,
    bytes: usize,
    closed: bool,
}

pub(crate) struct Room {
    waiting: Mutex<WaitingPages>,
    turned: Condvar,
    size: usize,
}

impl Room {
    pub fn new(size: usize) -> Room {
        Room { waiting: Mutex::default(), turned: Condvar::new(), size }
    }

    fn locked(&self) -> MutexGuard<'_, WaitingPages> {
        self.waiting.lock().expect("nobody panics with the lock held")
    }

    /// Passes a page to the writer. If the buffer is full, waits if `may_wait` is true; otherwise the page's messages are counted as
    /// lost. Returns an empty page.
    pub fn put(&self, mut page: Page, may_wait: bool) -> Page {
        let mut waiting = self.locked();
        if may_wait {
            waiting = self.turned.wait_while(waiting, |waiting| waiting.bytes >= self.size && !waiting.closed).expect("nobody panics with the lock held");
        }
        if waiting.bytes > 0 && waiting.bytes + page.len() > self.size && !may_wait {
            page.give_up();
        }
        waiting.bytes += page.len();
        waiting.pages.push_back(page);
        self.turned.notify_all();
        waiting.empty.pop().unwrap_or_default()
    }

    /// Returns the next page, or `None` when the buffer is closed and empty.
    pub fn take(&self) -> Option<Page> {
        let waiting = self.locked();
        let mut waiting = self.turned.wait_while(waiting, |waiting| waiting.pages.is_empty() && !waiting.closed).expect("nobody panics with the lock held");
        waiting.pages.pop_front()
    }

    /// Records that a page was written.
    pub fn written(&self, page: Page) {
        let mut waiting = self.locked();
        waiting.bytes -= page.len();
        if waiting.empty.len() < EMPTY_MAX {
            waiting.empty.push(page);
        }
        self.turned.notify_all();
    }

    /// Waits until all pages passed to the writer have been written.
    pub fn wait_written(&self) {
        let waiting = self.locked();
        let _all = self.turned.wait_while(waiting, |waiting| waiting.bytes > 0 || !waiting.pages.is_empty()).expect("nobody panics with the lock held");
    }

    /// Frees the memory kept for future pages.
    pub fn release(&self) {
        self.locked().empty = Vec::new();
    }

    /// Closes the buffer: no more pages will follow.
    pub fn close(&self) {
        self.locked().closed = true;
        self.turned.notify_all();
    }
}

/// Maximum number of empty pages kept so that their memory can be reused.
const EMPTY_MAX: usize = 4;
