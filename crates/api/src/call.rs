// SPDX-License-Identifier: Apache-2.0
//! Declaration and execution of calls.
use crate::answered::CallResult;
use crate::arguments::peek;
use crate::calls::find;
use crate::effect::{DriverArgument, Effect, RecordArguments};
use crate::journal::{JournalEntry, JournalRule};
use crate::role::Role;
use model::refusal::{Class, Refusal, Refusals};
use schemars::{Schema, SchemaGenerator};
use serde_json::{Map, Value as Json};
use std::time::Duration;
use supervisor::{CommandSubject, ProgramCommand, System};

/// Time for which a wait sleeps before it checks its deadline again.
const SLICE: Duration = Duration::from_millis(50);
/// Argument that contains the number of an instance.
const INSTANCE: &str = "instance";
/// Argument that contains the number of a recording.
const RECORDING: &str = "recording";

type Run<O> = fn(&System, &str, Duration) -> Result<CallResult<O>, Refusals>;
type SchemaOf = fn(&mut SchemaGenerator) -> Schema;

/// A call on a system, with all its properties. [`calls!`](crate::calls!) declares one.
#[derive(Clone, Copy)]
pub struct Call {
    pub name: &'static str,
    /// Subject of the call, that is, the heading under which it is listed.
    pub subject: &'static str,
    /// Human-readable description of the call's action and result, line by line.
    pub words: &'static [&'static str],
    /// Minimum role required.
    pub role: Role,
    /// Argument that names the object to command; empty for the whole system. `None` if the call is not a command.
    pub commands: Option<&'static str>,
    /// True if the call is logged even if it is made by the program that owns the system.
    pub told: bool,
    /// True if the log entry of the call refers to the system, not to the argument of the call.
    pub told_of_system: bool,
    pub journal: JournalRule,
    pub effect: Effect,
    /// Argument that contains the name that the call defines; the last definition of a name counts.
    pub defines: Option<&'static str>,
    /// Argument that a driver interprets.
    pub for_driver: Option<DriverArgument>,
    pub records: RecordArguments,
    /// True if the call may take a long time and continues in slices.
    pub lasts: bool,
    /// True if the call, or the first slice of a lasting call, completes within microseconds: it uses no file, device or compiler.
    pub brief: bool,
    /// True if the call stops something, in which case it is not queued behind other calls.
    pub stops: bool,
    /// True if the call stops everything, in which case a thread is reserved for it, and the number of such calls is not limited.
    pub stops_all: bool,
    /// True if the call may start a machine moving. If such a call has a time stamp, it is refused if it arrives late.
    pub moves: bool,
    /// True if the call does not require command of the system; the role is sufficient.
    pub free: bool,
    /// Argument that the control interface sets to the caller, overriding any value passed.
    pub signed: Option<&'static str>,
    /// True if the call takes a long time to compute, or if its answer is long.
    pub costs: bool,
    /// True if the call refers to files on this host; from another host, a different call is used.
    pub local: bool,
    /// True if the call transfers bytes at a high rate, for which the programming system has a separate path.
    pub rated: bool,
    /// Argument that consists of all remaining members of the object, and its schema.
    pub whole: Option<(&'static str, SchemaOf)>,
    named: SchemaOf,
    answer: SchemaOf,
    run: Run<Json>,
    tell: Run<String>,
}

impl std::fmt::Debug for Call {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        write!(f, "Call({})", self.name)
    }
}

/// Methods that declare properties of a call. In a declaration, they follow the call's answer.
impl Call {
    /// Creates a call without any of these properties.
    #[doc(hidden)]
    pub const fn of(
        (name, subject, words): (&'static str, &'static str, &'static [&'static str]),
        role: Role,
        named: SchemaOf,
        answer: SchemaOf,
        run: Run<Json>,
        tell: Run<String>,
    ) -> Call {
        let recorded = if matches!(role, Role::Configure | Role::Download) { JournalEntry::Call } else { JournalEntry::Nothing };
        let journal = JournalRule { recorded, replaces: None, goes_with: None, watches: false, secret: &[] };
        let records = RecordArguments { path: None, folder: None, trust: None, identity: None, resumes: None };
        let (commands, whole) = (None, None);
        Call {
            name,
            subject,
            words,
            role,
            commands,
            told: false,
            told_of_system: false,
            journal,
            effect: Effect::None,
            defines: None,
            for_driver: None,
            records,
            lasts: false,
            brief: false,
            stops: false,
            stops_all: false,
            moves: false,
            free: false,
            signed: None,
            costs: false,
            local: false,
            rated: false,
            whole,
            named,
            answer,
            run,
            tell,
        }
    }

    #[doc(hidden)]
    pub const fn whole(self, name: &'static str, of: SchemaOf) -> Call {
        Call { whole: Some((name, of)), ..self }
    }

    /// Declares that the call commands the object named by this argument. An empty argument stands for the whole system.
    pub const fn commands(self, about: &'static str) -> Call {
        Call { commands: Some(about), ..self }
    }

    /// Declares that the call is logged even if it is made by the program that owns the system.
    pub const fn told(self) -> Call {
        Call { told: true, ..self }
    }

    /// Declares that the call is logged, with the system as its subject, even if it is made by the program that owns the system.
    pub const fn told_of_system(self) -> Call {
        Call { told: true, told_of_system: true, ..self }
    }

    /// Declares that the call may take a long time and continues in slices.
    pub const fn lasts(self) -> Call {
        Call { lasts: true, ..self }
    }

    /// Declares that the call, or its first slice, completes within microseconds.
    pub const fn brief(self) -> Call {
        Call { brief: true, ..self }
    }

    /// Declares that the call stops something, so that it is not queued behind other calls.
    pub const fn stops(self) -> Call {
        Call { stops: true, ..self }
    }

    /// Declares that the call stops everything, so that no other call takes precedence over it.
    pub const fn stops_all(self) -> Call {
        Call { stops: true, stops_all: true, ..self }
    }

    /// Declares the call's effect on an instance, a device or a recording.
    pub const fn effect(self, effect: Effect) -> Call {
        Call { effect, ..self }
    }

    /// Declares that the call defines the name in this argument; the last definition of a name counts.
    pub const fn defines(self, name: &'static str) -> Call {
        Call { defines: Some(name), ..self }
    }

    /// Declares that a driver interprets this argument.
    pub const fn for_driver(self, argument: DriverArgument) -> Call {
        Call { for_driver: Some(argument), ..self }
    }

    /// Declares that this argument is the path of a recording; over the control interface, it is a name in the daemon's folder.
    pub const fn record_path(self, argument: &'static str) -> Call {
        Call { records: RecordArguments { path: Some(argument), ..self.records }, ..self }
    }

    /// Declares the arguments that identify a new recording and the recording that it continues.
    pub const fn record_resumes(self, identity: &'static str, resumes: &'static str) -> Call {
        Call { records: RecordArguments { identity: Some(identity), resumes: Some(resumes), ..self.records }, ..self }
    }

    /// Makes the control interface set this argument to the daemon's folder of recordings.
    pub const fn record_folder(self, argument: &'static str) -> Call {
        Call { records: RecordArguments { folder: Some(argument), ..self.records }, ..self }
    }

    /// Makes the control interface set this argument to the digests of the code that the daemon trusts.
    pub const fn trusts(self, argument: &'static str) -> Call {
        Call { records: RecordArguments { trust: Some(argument), ..self.records }, ..self }
    }

    /// Declares that the call may start a machine moving.
    pub const fn moves(self) -> Call {
        Call { moves: true, ..self }
    }

    /// Declares that the call does not require command of the system.
    pub const fn free(self) -> Call {
        Call { free: true, ..self }
    }

    /// Makes the control interface set this argument to the caller, overriding any value passed.
    pub const fn signed(self, by: &'static str) -> Call {
        Call { signed: Some(by), ..self }
    }

    /// Declares that the call takes a long time to compute or that its answer is long.
    pub const fn costs(self) -> Call {
        Call { costs: true, ..self }
    }

    /// Declares that the call refers to files on this host.
    pub const fn local(self) -> Call {
        Call { local: true, ..self }
    }

    /// Declares that the call transfers bytes at a high rate.
    pub const fn rated(self) -> Call {
        Call { rated: true, ..self }
    }

    /// Declares that a journal records the call although it does not configure the system.
    pub const fn journalled(self) -> Call {
        Call { journal: JournalRule { recorded: JournalEntry::Call, ..self.journal }, ..self }
    }

    /// Declares that a journal records the effect of the call on running instances.
    pub const fn outcome_journalled(self) -> Call {
        Call { journal: JournalRule { recorded: JournalEntry::Outcome, ..self.journal }, ..self }
    }

    /// Declares that a journal does not record the call although it configures the system.
    pub const fn unjournalled(self) -> Call {
        Call { journal: JournalRule { recorded: JournalEntry::Nothing, ..self.journal }, ..self }
    }

    /// Declares that only the last call with the same values of these arguments counts in a journal.
    pub const fn replaces(self, of: &'static [&'static str]) -> Call {
        Call { journal: JournalRule { replaces: Some(of), ..self.journal }, ..self }
    }

    /// Declares that a journal drops the call when the call `deletes` deletes the item named by this argument.
    pub const fn goes_with(self, deletes: &'static str, by: &'static str) -> Call {
        Call { journal: JournalRule { goes_with: Some((deletes, by)), ..self.journal }, ..self }
    }

    /// Declares that the daemon does not start any verb instances if replaying this call from the journal fails, because a safeguard may
    /// be missing.
    pub const fn watches(self) -> Call {
        Call { journal: JournalRule { watches: true, ..self.journal }, ..self }
    }

    /// Declares that these arguments are never written to a file.
    pub const fn secret(self, arguments: &'static [&'static str]) -> Call {
        Call { journal: JournalRule { secret: arguments, ..self.journal }, ..self }
    }
}

impl Call {
    /// Returns the required role. It is at least `operate` for a lasting call under the virtual clock, because such a call may advance
    /// the clock.
    pub fn role_under(&self, is_virtual: bool) -> Role {
        if is_virtual && self.lasts { self.role.max(Role::Operate) } else { self.role }
    }

    /// Returns the human-readable description of the call's action and result, on one line.
    pub fn words(&self) -> String {
        self.words.iter().map(|line| line.trim()).collect::<Vec<_>>().join(" ")
    }

    /// Returns the schema of the call's named arguments, which form an object.
    pub fn named_schema(&self, generator: &mut SchemaGenerator) -> Schema {
        (self.named)(generator)
    }

    /// Returns the schema of the argument that consists of all remaining members of the object.
    pub fn whole_schema(&self, generator: &mut SchemaGenerator) -> Option<Schema> {
        self.whole.map(|(_, of)| of(generator))
    }

    /// Returns the schema of the call's answer.
    pub fn answer_schema(&self, generator: &mut SchemaGenerator) -> Schema {
        (self.answer)(generator)
    }

    /// Returns the named arguments.
    pub fn arguments(&self) -> Vec<Argument> {
        let schema = Json::from((self.named)(&mut SchemaGenerator::default()));
        let required = |name: &str| schema["required"].as_array().is_some_and(|names| names.iter().any(|required| required == name));
        let properties = schema["properties"].as_object().cloned().unwrap_or_default();
        let of = |(name, schema): (String, Json)| Argument { required: required(&name), words: words(&schema), name, schema };
        properties.into_iter().map(of).collect()
    }

    /// Returns the object that a call commands: an instance, a device, an SVV, a recording, or `system`. `None` if the call only observes
    /// or waits.
    pub fn about(&self, system: &System, arguments: &Map<String, Json>) -> Option<String> {
        let argument = self.commands?;
        Some(match arguments.get(argument) {
            Some(Json::String(text)) => text.clone(),
            Some(number) if argument == RECORDING => format!("recording {number}"),
            Some(number) if argument == INSTANCE => number.as_u64().map_or_else(|| "system".to_owned(), |id| system.instance_name(id)),
            _ => "system".to_owned(),
        })
    }

    /// Begins the call, which answers within `slice` of real time.
    pub fn begin(&self, system: &System, arguments: &str, slice: Duration) -> Result<CallResult, Refusals> {
        (self.run)(system, arguments, slice)
    }

    /// Begins the call on behalf of the program that owns the system; commands are logged. The answer is text.
    pub fn begin_as_program(&self, system: &System, arguments: &str, slice: Duration) -> Result<CallResult<String>, Refusals> {
        let run = || (self.tell)(system, arguments, slice);
        let Some(about) = self.commands.filter(|_| self.told) else { return run() };
        let named;
        let subject = match about {
            _ if self.told_of_system => CommandSubject::Named("system"),
            INSTANCE => CommandSubject::Instance(peek(arguments, INSTANCE).and_then(|number| number.parse().ok()).unwrap_or(0)),
            about => {
                named = peek(arguments, about);
                CommandSubject::Named(named.as_deref().unwrap_or("system"))
            }
        };
        system.as_program(&self.command(subject), run)
    }

    /// Creates the log entry for this call, with a subject, if the program makes the call.
    pub(crate) fn command<'a>(&self, subject: CommandSubject<'a>) -> ProgramCommand<'a> {
        ProgramCommand { call: self.name, subject, stops: self.stops }
    }

    /// Continues the call, which has already been logged.
    pub fn go_on(&self, system: &System, arguments: &str, slice: Duration) -> Result<CallResult<String>, Refusals> {
        (self.tell)(system, arguments, slice)
    }
}

/// An argument of a call.
#[derive(Clone, Debug, PartialEq)]
pub struct Argument {
    pub name: String,
    pub required: bool,
    /// Human-readable description of the argument.
    pub words: String,
    /// JSON Schema of the argument's type.
    pub schema: Json,
}

fn words(schema: &Json) -> String {
    schema["description"].as_str().unwrap_or("").replace('\n', " ")
}

/// Executes a call. `arguments` is the JSON text of an object, or empty for none; the result is JSON.
///
/// The header `opengpac_ps.h` lists the calls and their arguments. Calls that wait return when the awaited event has occurred, or when
/// their `timeout_ns` has elapsed on the system's clock; under the virtual clock they advance time. Errors are the refusals of the
/// supervisor, and `CallError` for an unknown call or argument.
pub fn call(system: &System, name: &str, arguments: &str) -> Result<Json, Refusals> {
    let mut answered = begin(system, name, arguments, SLICE)?;
    loop {
        match answered {
            CallResult::Done(result) => return Ok(result),
            CallResult::Waiting { call, arguments } => answered = begin(system, call, &arguments.to_string(), SLICE)?,
        }
    }
}

/// Begins a call as [`call`] does; a lasting call answers within `slice` of real time, with the call that continues it.
pub fn begin(system: &System, name: &str, arguments: &str, slice: Duration) -> Result<CallResult, Refusals> {
    known(name)?.begin(system, arguments, slice)
}

/// Returns the call with this name. Fails if it does not exist.
pub fn known(name: &str) -> Result<&'static Call, Refusals> {
    let none = || vec![Refusal::new(Class::CallError, format!("there is no call '{name}'")).remedy("check the list in opengpac_ps.h")];
    find(name).ok_or_else(none)
}

/// Returns the object that a call commands: an instance, a device, an SVV, or `system`. `None` if the call only observes or waits.
pub fn commanded(system: &System, call: &str, arguments: &Map<String, Json>) -> Option<String> {
    find(call)?.about(system, arguments)
}
