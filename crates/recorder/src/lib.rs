// SPDX-License-Identifier: Apache-2.0
//! The recorder: what a running system does, into an MCAP file, by ordinary threads; and reading such a file: all of it
//! ([`Recording`]), or in place what was at a time or over a span ([`Archive`]).
//!
//! One thread drains the sources each 20 ms into pages: every value of the chosen SVVs (a tap), the log, end reports, how the
//! interrupt sources do, and where it is asked for all that the run needs to be run again (the crate `replay`). Another one writes the
//! pages. Between them lies a bounded room: what finds no place there, because the disk is slow or full, is counted as lost, by channel,
//! and never held against the machine. Under the virtual clock time waits for the recorder instead.
//!
//! A message is JSON with a JSON schema: Foxglove and PlotJuggler open both without anything else, people read them, and a number comes
//! back with the same bits. A million values of `double` are about 60 MB before compression, which costs less than a tenth of a core at
//! 64 channels of 1 kHz, so neither batches nor another encoding are needed. Chunks are compressed with LZ4, and whole when they reach
//! the file: of a process that was killed everything up to its last chunk, a second at most, can be read.
mod about;
mod archive;
mod digest;
mod file;
mod files;
mod folder;
mod json;
mod left;
mod numbers;
mod page;
mod reader;
mod recorder;
mod rerun;
mod room;
mod shapes;
mod shelf;
mod sources;
mod span;
mod state;
mod values;

pub use about::{RecordedChannel, RecordedEnd, RecordingContents};
pub use archive::{Archive, RecordedMessage};
pub use digest::{Samples, Sums};
pub use folder::{Folder, Sink, Space, next_beside};
pub use reader::{DamagedPart, Recording, Series};
pub use recorder::{Options, Recorder, Summary};
pub use replay::Replaying;
pub use rerun::Again;
pub use shelf::{RecordingFile, opened, recordings};
pub use span::{Span, Trace};

/// Name of the metadata record with what was recorded: system, version, clock, configuration.
pub const ABOUT: &str = "opengpac";
/// Name of the metadata record at the end of a file: what was lost, by channel.
pub const LOST: &str = "lost";
/// Entries of the log, as `log` gives them.
pub const LOG: &str = "/log";
/// End reports, as `ends` gives them.
pub const ENDS: &str = "/ends";
/// Definitions and instances, as `installed` gives them, whenever they became others; lists and states of instances come from the log.
pub const INSTALLED: &str = "/installed";
/// Statistics, once a second and where the log had something new.
pub const STATISTICS: &str = "/statistics";
/// Alarms, as `alarms` gives them, whenever they became others.
pub const ALARMS: &str = "/alarms";
/// The shape of a physical device, as `geometry` gives it: followed by its name.
pub const GEOMETRY: &str = "/geometry/";
/// Losses, at their times: `{"channel", "count"}`.
pub const LOSSES: &str = "/lost";
