// SPDX-License-Identifier: Apache-2.0
//! Effect of a call on objects that outlive it: owners, the journal and its replay ask for it instead of the name of a call.

/// Effect of a call on a verb instance, a logical device or a recording: owners of instances, the journal and its replay follow it.
///
/// An instance is that of the argument `instance` unless something else is said, a device that of the argument `name`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Effect {
    /// Leaves nothing that is followed.
    None,
    /// Creates the instance that its answer names.
    CreatesInstance,
    /// Starts an instance.
    StartsInstance,
    /// Sets parameters of an instance that runs.
    TunesInstance,
    /// Ends an instance, and answers with its end report.
    EndsInstance,
    /// Deletes an instance.
    DeletesInstance,
    /// Answers with the end report of an instance, if it has ended.
    ReportsEnd,
    /// Creates an instance, starts it, waits for its end and deletes it.
    PerformsVerb,
    /// Waits for the end of an instance of a verb that is performed, and deletes it.
    CompletesVerb,
    /// Starts the verb of a device: the instance that its answer names, 0 for none.
    EnablesDevice,
    /// Deletes a device.
    DeletesDevice,
    /// Begins the recording that its answer names.
    BeginsRecording,
    /// Ends the recording of the argument `recording`.
    EndsRecording,
}

/// Argument of a call that a driver reads: it may name files of the caller, and code.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DriverArgument {
    /// `options` of the driver that the argument `kind` names.
    Options,
    /// `arguments` of the service of a device that the arguments `service` and `device` name.
    OfService,
}

/// Arguments of a call for which a daemon that serves others answers: its files are its own, and so is its trust in code.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RecordArguments {
    /// Argument that names a recording in the daemon's folder.
    pub path: Option<&'static str>,
    /// Argument into which the daemon enters its folder, whatever was given.
    pub folder: Option<&'static str>,
    /// Argument into which the daemon enters the digests of code that may run, whatever was given.
    pub trust: Option<&'static str>,
    /// Argument into which the daemon enters the identity of a recording that begins, whatever was given.
    pub identity: Option<&'static str>,
    /// Argument by which a daemon that was started again lets a recording go on behind its files; what was given is passed over.
    pub resumes: Option<&'static str>,
}
