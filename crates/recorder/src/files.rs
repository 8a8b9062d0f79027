// SPDX-License-Identifier: Apache-2.0
//! The files of a recording (one file, or a bounded series), and the free space on their disk.
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

/// Minimum size of a file, bytes; chunks are not divided.
pub(crate) const SPLIT_MIN: u64 = 1_000_000;
/// Minimum number of files to keep: the current file and a complete one.
const KEEP_MIN: u32 = 2;

/// Limits on the files of a recording.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Bounds {
    /// Size at which the next file is started, bytes.
    pub split: Option<u64>,
    /// Maximum number of files to keep; when it is exceeded, the oldest file is deleted.
    pub keep: Option<u32>,
}

impl Bounds {
    /// Refuses limits that cannot be met, and refuses to split a recording that is to be replayed.
    pub fn check(self, replay: bool) -> Result<(), Refusal> {
        let refused = |message: String, remedy: &str| Err(Refusal::new(Class::ValueRefused, message).remedy(remedy));
        match self {
            Bounds { split: None, keep: Some(_) } => {
                refused("files are to be kept, but the recording has only one".to_owned(), "also give the size at which the next file begins")
            }
            Bounds { split: Some(split), .. } if split < SPLIT_MIN => {
                refused(format!("the file size of a recording cannot be {split} bytes"), "give 1 MB or more")
            }
            Bounds { keep: Some(keep), .. } if keep < KEEP_MIN => {
                refused(format!("{keep} files cannot be kept"), "keep 2 or more: the one being written, and a complete one")
            }
            Bounds { split: Some(_), .. } if replay => {
                refused("a recording for a replay is a single file, but this one is to be split".to_owned(), "leave out one of the two")
            }
            _ => Ok(()),
        }
    }
}

/// Files of a recording. The last one is being written.
pub(crate) struct Files {
    folder: Box<dyn Folder>,
    bounds: Bounds,
    pub book: Book,
    path: PathBuf,
    /// Complete files, with their sizes in bytes, oldest first.
    whole: VecDeque<(PathBuf, u64)>,
    /// Description of the recording, which each file contains.
    said: BTreeMap<String, String>,
    /// Free space on the disk.
    space: Option<Space>,
    /// Size of the file when the free space was last checked, bytes.
    looked_at: u64,
}

/// Effect of writing a page on the files.
#[derive(Default)]
pub(crate) struct Rollover {
    /// True if the next file was started.
    pub begins: bool,
    /// Reason why an old file could not be deleted.
    pub undeleted: Option<String>,
}

impl Files {
    /// Starts the first file with the description of the recording. `left` lists the files of a previous process that died, with their
    /// sizes, oldest first; they count towards the limits. Fails if the file cannot be created, or if its disk is full.
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
            // A file that cannot be deleted stays.
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
                // The file is empty; if it cannot be deleted, its emptiness shows that nothing was recorded.
                let _gone = folder.remove(&path);
                Err(why)
            }
        }
    }

    /// Deletes the file that was started, so that no recording is left behind.
    pub fn give_up(mut self) {
        let _gone = self.folder.remove(&self.path);
    }

    /// Returns the path of the current file.
    pub fn path(&self) -> &PathBuf {
        &self.path
    }

    /// Returns the paths of all files, oldest first.
    pub fn paths(&self) -> Vec<PathBuf> {
        self.whole.iter().map(|(path, _)| path).chain([&self.path]).cloned().collect()
    }

    /// Returns the total size of all files, bytes.
    pub fn bytes(&self) -> u64 {
        self.whole.iter().map(|(_, bytes)| bytes).sum::<u64>() + self.book.bytes
    }

    /// Returns the free space on the disk in bytes, if known.
    pub fn free(&self) -> Option<u64> {
        self.space.map(|space| space.free)
    }

    /// Returns the description of the recording for modification.
    pub fn said(&mut self) -> &mut BTreeMap<String, String> {
        &mut self.said
    }

    /// Writes the description of the recording again.
    pub fn say(&mut self) {
        self.book.say((ABOUT, &self.said));
    }

    /// Writes a page. The next file is started when this one reaches its size limit; the recording ends when the disk has reached the
    /// permitted fill level.
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
                self.book.failure.get_or_insert(format!("the next file cannot be created: {why}"));
                return;
            }
        };
        let before = std::mem::replace(&mut self.path, path);
        if let Some(time_ns) = page.entries.iter().map(|entry| entry.time_ns).max() {
            self.said.insert("begins_ns".to_owned(), time_ns.to_string());
        }
        self.said.remove(RESUMES);
        self.said.insert(FOLLOWS.to_owned(), name_of(&before));
        // A file ends with a summary, so its size is only known afterwards.
        let bytes = self.book.go_on(sink, (ABOUT, &self.said));
        if self.book.failure.is_none() {
            self.whole.push_back((before, bytes));
        } else {
            // The next file is empty.
            let _gone = self.folder.remove(&std::mem::replace(&mut self.path, before));
        }
    }

    /// Deletes the oldest complete file; returns the reason if this fails.
    fn delete_oldest(&mut self) -> Option<String> {
        let (path, _) = self.whole.pop_front()?;
        self.folder.remove(&path).err().map(|why| format!("'{}' cannot be deleted: {why}", path.display()))
    }
}

fn name_of(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// Returns the reason why no more data may be written if the disk is too full.
fn too_full(space: Space) -> Option<String> {
    let mega = |bytes: u64| bytes / 1_000_000;
    let said = || format!("the disk has {} MB free, but a recording leaves {} MB free for other files", mega(space.free), mega(space.spared));
    (space.free < space.spared).then(said)
}
