// SPDX-License-Identifier: Apache-2.0
//! Effects of a call on objects that outlive it: owners, the journal and its replay depend on the effect rather than on the name of a
//! call.

/// Effect of a call on a verb instance, a logical device or a recording. Owners of instances, the journal and its replay depend on it.
///
/// Unless stated otherwise, the instance is that of the argument `instance`, and the device that of the argument `name`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Effect {
    /// No effect that needs tracking.
    None,
    /// Creates the instance named in its answer.
    CreatesInstance,
    /// Starts an instance.
    StartsInstance,
    /// Sets parameters of a running instance.
    TunesInstance,
    /// Ends an instance, and returns its end report.
    EndsInstance,
    /// Deletes an instance.
    DeletesInstance,
    /// Returns the end report of an instance if it has ended.
    ReportsEnd,
    /// Creates an instance, starts it, waits for its end and deletes it.
    PerformsVerb,
    /// Waits for the end of a performed verb's instance, and deletes it.
    CompletesVerb,
    /// Starts a device's own verb: the instance named in its answer, or 0 for none.
    EnablesDevice,
    /// Deletes a device.
    DeletesDevice,
    /// Starts the recording named in its answer.
    BeginsRecording,
    /// Ends the recording of the argument `recording`.
    EndsRecording,
    /// Forces a signal; the force has the number in its answer.
    ForcesSignal,
}

/// Argument that a driver interprets: it may name files of the caller, and code.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DriverArgument {
    /// `options` of the driver named by the argument `kind`.
    Options,
    /// `arguments` of the service named by the arguments `service` and `device`.
    OfService,
}

/// Arguments controlled by a daemon that serves others: it uses its own files and its own trust in code.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RecordArguments {
    /// Argument with the name of a recording in the daemon's folder.
    pub path: Option<&'static str>,
    /// Argument that the daemon sets to its folder, overriding any value passed.
    pub folder: Option<&'static str>,
    /// Argument that the daemon sets to the digests of code that may run, overriding any value passed.
    pub trust: Option<&'static str>,
    /// Argument that the daemon sets to the identity of a new recording, overriding any value passed.
    pub identity: Option<&'static str>,
    /// Argument by which a restarted daemon continues a recording after its files; any value passed is ignored.
    pub resumes: Option<&'static str>,
}
