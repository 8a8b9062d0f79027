// SPDX-License-Identifier: Apache-2.0
//! Effects of calls on objects that outlive the call. The owners of instances, the journal and its replay depend on the effect of a call
//! rather than on its name.

/// Effect of a call on a verb instance, a logical device or a recording. The owners of instances, the journal and its replay depend on
/// it.
///
/// Unless stated otherwise, the argument `instance` identifies the instance, and the argument `name` identifies the device.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Effect {
    /// No effect that needs tracking.
    None,
    /// Creates an instance, whose number is the answer of the call.
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
    /// Creates an instance, starts it, waits until it has ended, and deletes it.
    PerformsVerb,
    /// Waits until the instance of a performed verb has ended, and deletes it.
    CompletesVerb,
    /// Starts a device's own verb. The answer is the number of the verb's instance, or 0 if there is none.
    EnablesDevice,
    /// Deletes a device.
    DeletesDevice,
    /// Starts a recording, whose number is in the answer of the call.
    BeginsRecording,
    /// Ends the recording specified by the argument `recording`.
    EndsRecording,
    /// Forces a signal. The number of the force is in the answer of the call.
    ForcesSignal,
}

/// Argument that a driver interprets. It may refer to files of the caller, and to code.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DriverArgument {
    /// `options` of the driver named by the argument `kind`.
    Options,
    /// `arguments` of a driver's service. The argument `device` names the device, and the argument `service` names the service.
    OfService,
}

/// Arguments that a daemon controls if it serves others, so that it uses its own files and its own trust settings for code.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RecordArguments {
    /// Argument that contains the name of a recording in the daemon's folder.
    pub path: Option<&'static str>,
    /// Argument that the daemon sets to its folder, overriding any value passed.
    pub folder: Option<&'static str>,
    /// Argument that the daemon sets to the digests of code that may run, overriding any value passed.
    pub trust: Option<&'static str>,
    /// Argument that the daemon sets to the identity of a new recording, overriding any value passed.
    pub identity: Option<&'static str>,
    /// Argument that makes a restarted daemon continue a recording after its existing files; any value passed is ignored.
    pub resumes: Option<&'static str>,
}
