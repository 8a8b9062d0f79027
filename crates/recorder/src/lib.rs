// SPDX-License-Identifier: Apache-2.0
//! The recorder: ordinary threads write the activity of a running system to an MCAP file. Such a file can be read as a whole
//! ([`Recording`]), or in place, at a time or over a span ([`Archive`]).
//!
//! One thread drains the sources every 20 ms into pages: every value of the chosen SVVs (a tap), the log, end reports, statistics of the
//! interrupt sources, and on request all data needed to replay the run (the crate `replay`). Another thread writes the pages. The buffer
//! between them is bounded: messages that do not fit, because the disk is slow or full, are counted as lost, by channel, and never slow
//! down the machine. If the clock is virtual, time waits for the recorder instead.
//!
//! Messages are JSON with a JSON schema: Foxglove and PlotJuggler open them without plug-ins, people can read them, and numbers are
//! restored bit for bit. A million values of `double` take about 60 MB before compression, and recording 64 channels of 1 kHz takes less
//! than a tenth of a core, so neither batches nor another encoding are needed. Chunks are compressed with LZ4, and are complete when they
//! reach the file: if the process is killed, everything can be read except its last chunk, which covers at most one second.
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

/// Name of the metadata record that describes the recorded system: name, version, clock, configuration.
pub const ABOUT: &str = "opengpac";
/// Name of the metadata record that contains the number of lost messages by channel; it is written at the end of a file.
pub const LOST: &str = "lost";
/// Topic of log entries, in the format that `log` returns.
pub const LOG: &str = "/log";
/// Topic of end reports, in the format that `ends` returns.
pub const ENDS: &str = "/ends";
/// Topic of definitions and instances, in the format that `installed` returns, written whenever they change; the log contains the lists
/// and states of instances.
pub const INSTALLED: &str = "/installed";
/// Topic of statistics, written once a second and whenever the log has new entries.
pub const STATISTICS: &str = "/statistics";
/// Topic of alarms, in the format that `alarms` returns, written whenever they change.
pub const ALARMS: &str = "/alarms";
/// Topic prefix of the shape of a physical device, in the format that `geometry` returns; the device's name follows.
pub const GEOMETRY: &str = "/geometry/";
/// Topic of losses, each at the time of the loss: `{"channel", "count"}`.
pub const LOSSES: &str = "/lost";
