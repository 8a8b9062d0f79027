// SPDX-License-Identifier: Apache-2.0
//! The files of a recording: one, or one after another within bounds; and how full their disk is.
use crate::ABOUT;
use crate::file::Book;
use crate::folder::{Folder, Space};
use crate::left::{FOLLOWS, RESUMES};
use crate::page::Page;
use model::refusal::{Class, Refusal};
use std::collections::{BTreeMap, VecDeque};
use std::io;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Bytes of the smallest file: a chunk is not divided.
pub(crate) const SPLIT_MIN: u64 = 1_000_000;
/// Files that stay, at least: the one that is written, and one that is whole.
const KEEP_MIN: u32 = 2;

/// Bounds of the files of a recording.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Bounds {
    /// Bytes from which on a file is followed by the next one.
    pub split: Option<u64>,
    /// Files that stay; the oldest goes.
    pub keep: Option<u32>,
}

impl Bounds {
    /// Refuses bounds that cannot be kept, and files that follow each other of a recording that is to be run again.
    pub fn check(self, replay: bool) -> Result<(), Refusal> {
        let refused = |message: String, remedy: &str| Err(Refusal::new(Class::ValueRefused, message).remedy(remedy));
        match self {
            Bounds { split: None, keep: Some(_) } => {
                refused("files are to be kept, and the recording has one".to_owned(), "say too at what size the next file begins")
            }
            Bounds { split: Some(split), .. } if split < SPLIT_MIN => {
                refused(format!("a file of a recording cannot end at {split} bytes"), "give 1 MB or more")
            }
            Bounds { keep: Some(keep), .. } if keep < KEEP_MIN => {
                refused(format!("{keep} files cannot be kept"), "give 2 or more: the one that is written, and one that is whole")
            }
            Bounds { split: Some(_), .. } if replay => {
                refused("a recording for a replay is one file, and this one is to be split".to_owned(), "leave out one of the two")
            }
            _ => Ok(()),
        }
    }
}

/// A recording's files. The last one is written.
pub(crate) struct Files {
    folder: Box<dyn Folder>,
    bounds: Bounds,
    pub book: Book,
    path: PathBuf,
    /// Whole ones, with their bytes; the oldest first.
    whole: VecDeque<(PathBuf, u64)>,
    /// Description of the recording, which stands in each file.
    said: BTreeMap<String, String>,
    /// Free space of the disk.
    space: Option<Space>,
    /// Bytes of the file when that was asked last.
    looked_at: u64,
}

/// Result of writing a page, for the files.
#[derive(Default)]
pub(crate) struct Rollover {
    /// True where the next file was begun.
    pub begins: bool,
    /// Reason why an old file could not be deleted.
    pub undeleted: Option<String>,
}

impl Files {
    /// Begins the first file with what is said of the recording. `left`: files of it that a process which died has left, with their bytes, the
    /// oldest first; they count for its bounds. Errors: the file cannot be made, or its disk is full.
    pub fn begin(
        mut folder: Box<dyn Folder>,
        bounds: Bounds,
        mut said: BTreeMap<String, String>,
        left: Vec<(PathBuf, u64)>,
        chunk_max: Duration,
    ) -> io::Result<Files> {
        let mut whole = VecDeque::from(left);
        if let Some((last, _)) = whole.back() {
            said.insert(RESUMES.to_owned(), name_of(last));
        }
        let is_full = |folder: &dyn Folder| folder.space().and_then(too_full).is_some();
        while bounds.keep.is_some_and(|keep| whole.len() >= keep as usize || !whole.is_empty() && is_full(&*folder)) {
            // One that cannot be deleted is left where it is.
            let _gone = whole.pop_front().map(|(oldest, _)| folder.remove(&oldest));
        }
        let (path, sink) = folder.next()?;
        let space = folder.space();
        let begun = match space.and_then(too_full) {
            Some(why) => Err(io::Error::new(io::ErrorKind::StorageFull, why)),
            None => Book::new(sink, (ABOUT, &said), chunk_max, bounds.split.is_some()),
        };
        match begun {
            Ok(book) => Ok(Files { folder, bounds, book, path, whole, said, space, looked_at: 0 }),
            Err(why) => {
                // One that holds nothing; where it cannot be deleted it says so by being empty.
                let _gone = folder.remove(&path);
                Err(why)
            }
        }
    }

    /// Deletes the file that was begun: nothing is recorded.
    pub fn give_up(mut self) {
        let _gone = self.folder.remove(&self.path);
    }

    /// Returns the file that is written.
    pub fn path(&self) -> &PathBuf {
        &self.path
    }

    /// Returns the files that are there, the oldest first.
    pub fn paths(&self) -> Vec<PathBuf> {
        self.whole.iter().map(|(path, _)| path).chain([&self.path]).cloned().collect()
    }

    /// Bytes of the files that are there.
    pub fn bytes(&self) -> u64 {
        self.whole.iter().map(|(_, bytes)| bytes).sum::<u64>() + self.book.bytes
    }

    /// Bytes that are free on their disk, where that is known.
    pub fn free(&self) -> Option<u64> {
        self.space.map(|space| space.free)
    }

    /// Returns the description of the recording, to be changed.
    pub fn said(&mut self) -> &mut BTreeMap<String, String> {
        &mut self.said
    }

    /// Says again what the recording is.
    pub fn say(&mut self) {
        self.book.say((ABOUT, &self.said));
    }

    /// Writes a page. The next file begins where this one has its size; the recording ends where the disk is as full as it may be.
    pub fn write(&mut self, page: &Page) -> Rollover {
        self.book.write(page);
        let mut rollover = Rollover::default();
        if self.book.failure.is_some() || self.book.bytes == self.looked_at {
            return rollover;
        }
        if self.bounds.split.is_some_and(|split| self.book.bytes >= split) {
            self.turn(page);
            rollover.begins = true;
            while self.bounds.keep.is_some_and(|keep| self.whole.len() >= keep as usize) {
                rollover.undeleted = self.delete_oldest().or(rollover.undeleted);
            }
        }
        self.looked_at = self.book.bytes;
        self.space = self.folder.space();
        while let Some(why) = self.space.and_then(too_full) {
            if self.bounds.keep.is_none() || self.whole.is_empty() {
                self.book.finish();
                self.book.failure.get_or_insert(why);
                break;
            }
            rollover.undeleted = self.delete_oldest().or(rollover.undeleted);
            self.space = self.folder.space();
        }
        rollover
    }

    fn turn(&mut self, page: &Page) {
        let (path, sink) = match self.folder.next() {
            Ok(next) => next,
            Err(why) => {
                self.book.finish();
                self.book.failure.get_or_insert(format!("the next file cannot be made: {why}"));
                return;
            }
        };
        let before = std::mem::replace(&mut self.path, path);
        if let Some(time_ns) = page.entries.iter().map(|entry| entry.time_ns).max() {
            self.said.insert("begins_ns".to_owned(), time_ns.to_string());
        }
        self.said.remove(RESUMES);
        self.said.insert(FOLLOWS.to_owned(), name_of(&before));
        // The end of a file is a summary: its size is known behind it.
        let bytes = self.book.go_on(sink, (ABOUT, &self.said));
        if self.book.failure.is_none() {
            self.whole.push_back((before, bytes));
        } else {
            // The next file holds nothing.
            let _gone = self.folder.remove(&std::mem::replace(&mut self.path, before));
        }
    }

    /// Deletes the oldest whole file; why it is still there.
    fn delete_oldest(&mut self) -> Option<String> {
        let (path, _) = self.whole.pop_front()?;
        self.folder.remove(&path).err().map(|why| format!("'{}' cannot be deleted: {why}", path.display()))
    }
}

fn name_of(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// Returns the reason why nothing more may be written if the disk is too full.
fn too_full(space: Space) -> Option<String> {
    let mega = |bytes: u64| bytes / 1_000_000;
    let said = || format!("the disk has {} MB free, and a recording leaves {} MB for what else is written there", mega(space.free), mega(space.spared));
    (space.free < space.spared).then(said)
}
