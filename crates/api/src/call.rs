// SPDX-License-Identifier: Apache-2.0
//! A call as it is declared, and making one.
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

/// Time for which a wait sleeps before it looks at its deadline again.
const SLICE: Duration = Duration::from_millis(50);
/// Argument that is the number of an instance.
const INSTANCE: &str = "instance";

type Run<O> = fn(&System, &str, Duration) -> Result<CallResult<O>, Refusals>;
type SchemaOf = fn(&mut SchemaGenerator) -> Schema;

/// A call on a system: all that is known of it. [`calls!`](crate::calls!) declares one.
#[derive(Clone, Copy)]
pub struct Call {
    pub name: &'static str,
    /// Subject of the call, the heading that it is listed under.
    pub subject: &'static str,
    /// Description of its action and result, for people, line by line.
    pub words: &'static [&'static str],
    /// The least role that may make it.
    pub role: Role,
    /// Argument that names the object which the call commands; empty: the whole system. None: it does not command.
    pub commands: Option<&'static str>,
    /// The log has it too where the program that holds the system gave it.
    pub told: bool,
    /// There it is about the system, not about its argument.
    pub told_of_system: bool,
    pub journal: JournalRule,
    pub effect: Effect,
    /// Argument by which it defines a name; of several definitions of one name the last one counts.
    pub defines: Option<&'static str>,
    /// Argument that a driver reads.
    pub for_driver: Option<DriverArgument>,
    pub records: RecordArguments,
    /// True if it lasts, and goes on in slices.
    pub lasts: bool,
    /// True if it is over in microseconds, or if it lasts so is its beginning: no file, no device, no compiler.
    pub brief: bool,
    /// True if it brings something to a stop: it is not queued behind other calls.
    pub stops: bool,
    /// True if it stops everything: a thread is kept for it, and nobody counts how many there are.
    pub stops_all: bool,
    /// A machine may begin to move by it: one that says when it was given is refused where it comes late.
    pub moves: bool,
    /// True if it may be made without command: the role is enough.
    pub free: bool,
    /// Argument into which the control interface enters the caller, whatever was given.
    pub signed: Option<&'static str>,
    /// True if it takes long to work out, or its answer is long.
    pub costs: bool,
    /// True if it speaks of files of this host: from another one this goes another way.
    pub local: bool,
    /// True if it moves bytes at a rate: the programming system has a way of its own for that.
    pub rated: bool,
    /// The argument that is all that is left of the object, and its schema.
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

/// Properties of a call, as its declaration has them behind the answer.
impl Call {
    /// Makes a call that has none of them.
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

    /// Declares that it commands; what about, this argument says. An empty argument means the whole system.
    pub const fn commands(self, about: &'static str) -> Call {
        Call { commands: Some(about), ..self }
    }

    /// Declares that the log has it too if the program that holds the system gave it.
    pub const fn told(self) -> Call {
        Call { told: true, ..self }
    }

    /// Declares that the log has it too if the program that holds the system gave it, as about the system.
    pub const fn told_of_system(self) -> Call {
        Call { told: true, told_of_system: true, ..self }
    }

    /// Declares that it lasts, and goes on in slices.
    pub const fn lasts(self) -> Call {
        Call { lasts: true, ..self }
    }

    /// Declares that it is over in microseconds, or so is its beginning.
    pub const fn brief(self) -> Call {
        Call { brief: true, ..self }
    }

    /// Declares that it brings something to a stop: it is not queued behind other calls.
    pub const fn stops(self) -> Call {
        Call { stops: true, ..self }
    }

    /// Declares that it stops everything: nothing is ahead of it.
    pub const fn stops_all(self) -> Call {
        Call { stops: true, stops_all: true, ..self }
    }

    /// Declares its effect on an instance, a device or a recording.
    pub const fn effect(self, effect: Effect) -> Call {
        Call { effect, ..self }
    }

    /// Declares that it defines the name in this argument: the last definition of a name counts.
    pub const fn defines(self, name: &'static str) -> Call {
        Call { defines: Some(name), ..self }
    }

    /// Declares that a driver reads this argument.
    pub const fn for_driver(self, argument: DriverArgument) -> Call {
        Call { for_driver: Some(argument), ..self }
    }

    /// Declares that this argument is the path of a recording: over the control interface a name in the daemon's folder.
    pub const fn record_path(self, argument: &'static str) -> Call {
        Call { records: RecordArguments { path: Some(argument), ..self.records }, ..self }
    }

    /// Declares the arguments by which a recording that begins is known to one that goes on behind it.
    pub const fn record_resumes(self, identity: &'static str, resumes: &'static str) -> Call {
        Call { records: RecordArguments { identity: Some(identity), resumes: Some(resumes), ..self.records }, ..self }
    }

    /// Has the control interface enter the daemon's folder of recordings into this argument.
    pub const fn record_folder(self, argument: &'static str) -> Call {
        Call { records: RecordArguments { folder: Some(argument), ..self.records }, ..self }
    }

    /// Has the control interface enter the digests of code that the daemon trusts into this argument.
    pub const fn trusts(self, argument: &'static str) -> Call {
        Call { records: RecordArguments { trust: Some(argument), ..self.records }, ..self }
    }

    /// Declares that a machine may begin to move by it.
    pub const fn moves(self) -> Call {
        Call { moves: true, ..self }
    }

    /// Declares that it may be made without command.
    pub const fn free(self) -> Call {
        Call { free: true, ..self }
    }

    /// Has the control interface enter the caller into this argument, whatever was given.
    pub const fn signed(self, by: &'static str) -> Call {
        Call { signed: Some(by), ..self }
    }

    /// Declares that it takes long to work out, or its answer is long.
    pub const fn costs(self) -> Call {
        Call { costs: true, ..self }
    }

    /// Declares that it speaks of files of this host.
    pub const fn local(self) -> Call {
        Call { local: true, ..self }
    }

    /// Declares that it moves bytes at a rate.
    pub const fn rated(self) -> Call {
        Call { rated: true, ..self }
    }

    /// Declares that a journal records it, though it does not configure.
    pub const fn journalled(self) -> Call {
        Call { journal: JournalRule { recorded: JournalEntry::Call, ..self.journal }, ..self }
    }

    /// Declares that a journal records what becomes of that which runs.
    pub const fn outcome_journalled(self) -> Call {
        Call { journal: JournalRule { recorded: JournalEntry::Outcome, ..self.journal }, ..self }
    }

    /// Declares that a journal does not record it, though it configures.
    pub const fn unjournalled(self) -> Call {
        Call { journal: JournalRule { recorded: JournalEntry::Nothing, ..self.journal }, ..self }
    }

    /// Declares that in a journal only the last one with the same values of these arguments counts.
    pub const fn replaces(self, of: &'static [&'static str]) -> Call {
        Call { journal: JournalRule { replaces: Some(of), ..self.journal }, ..self }
    }

    /// Declares that in a journal it goes when this call deletes what this argument names.
    pub const fn goes_with(self, deletes: &'static str, by: &'static str) -> Call {
        Call { journal: JournalRule { goes_with: Some((deletes, by)), ..self.journal }, ..self }
    }

    /// Declares that nothing is started if its replay fails.
    pub const fn watches(self) -> Call {
        Call { journal: JournalRule { watches: true, ..self.journal }, ..self }
    }

    /// Declares that these arguments are in no file.
    pub const fn secret(self, arguments: &'static [&'static str]) -> Call {
        Call { journal: JournalRule { secret: arguments, ..self.journal }, ..self }
    }
}

impl Call {
    /// Returns the role that it needs: what advances the virtual clock is no mere looking.
    pub fn role_under(&self, is_virtual: bool) -> Role {
        if is_virtual && self.lasts { self.role.max(Role::Operate) } else { self.role }
    }

    /// Returns the description of its action and result, for people, on one line.
    pub fn words(&self) -> String {
        self.words.iter().map(|line| line.trim()).collect::<Vec<_>>().join(" ")
    }

    /// Returns the schema of its named arguments, an object.
    pub fn named_schema(&self, generator: &mut SchemaGenerator) -> Schema {
        (self.named)(generator)
    }

    /// Returns the schema of the argument that is all that is left of the object.
    pub fn whole_schema(&self, generator: &mut SchemaGenerator) -> Option<Schema> {
        self.whole.map(|(_, of)| of(generator))
    }

    /// Returns the schema of its answer.
    pub fn answer_schema(&self, generator: &mut SchemaGenerator) -> Schema {
        (self.answer)(generator)
    }

    /// Its named arguments.
    pub fn arguments(&self) -> Vec<Argument> {
        let schema = Json::from((self.named)(&mut SchemaGenerator::default()));
        let required = |name: &str| schema["required"].as_array().is_some_and(|names| names.iter().any(|required| required == name));
        let properties = schema["properties"].as_object().cloned().unwrap_or_default();
        let of = |(name, schema): (String, Json)| Argument { required: required(&name), words: words(&schema), name, schema };
        properties.into_iter().map(of).collect()
    }

    /// Returns the object of a call that commands: an instance, a device, an SVV, or `system`. Nothing where the call only looks, or waits.
    pub fn about(&self, system: &System, arguments: &Map<String, Json>) -> Option<String> {
        let argument = self.commands?;
        Some(match arguments.get(argument) {
            Some(Json::String(text)) => text.clone(),
            Some(number) if argument == INSTANCE => number.as_u64().map_or_else(|| "system".to_owned(), |id| system.instance_name(id)),
            _ => "system".to_owned(),
        })
    }

    /// Begins it: it answers after `slice` of real time at the latest.
    pub fn begin(&self, system: &System, arguments: &str, slice: Duration) -> Result<CallResult, Refusals> {
        (self.run)(system, arguments, slice)
    }

    /// Begins it as the program that holds the system: the log has what commands. Its answer is text.
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

    /// Makes the entry that the log has of this call, about a subject, where the program gives it.
    pub(crate) fn command<'a>(&self, subject: CommandSubject<'a>) -> ProgramCommand<'a> {
        ProgramCommand { call: self.name, subject, stops: self.stops }
    }

    /// Goes on with it, which the log has already.
    pub fn go_on(&self, system: &System, arguments: &str, slice: Duration) -> Result<CallResult<String>, Refusals> {
        (self.tell)(system, arguments, slice)
    }
}

/// An argument of a call.
#[derive(Clone, Debug, PartialEq)]
pub struct Argument {
    pub name: String,
    pub required: bool,
    /// Description of the argument, for people.
    pub words: String,
    /// The JSON Schema of its type.
    pub schema: Json,
}

fn words(schema: &Json) -> String {
    schema["description"].as_str().unwrap_or("").replace('\n', " ")
}

/// Makes one call. `arguments`: the JSON text of an object, empty for none; the result is JSON.
///
/// The header `opengpac_ps.h` lists the calls and their arguments. Calls that wait return when what they wait for has come, or their
/// `timeout_ns` has passed, on the system's clock; under the virtual clock they advance time. Errors: the refusals of the
/// supervisor, `CallError` for a call or an argument that there is not.
pub fn call(system: &System, name: &str, arguments: &str) -> Result<Json, Refusals> {
    let mut answered = begin(system, name, arguments, SLICE)?;
    loop {
        match answered {
            CallResult::Done(result) => return Ok(result),
            CallResult::Waiting { call, arguments } => answered = begin(system, call, &arguments.to_string(), SLICE)?,
        }
    }
}

/// Begins a call: as [`call`], but one that lasts answers after `slice` of real time at the latest, with the call by which it goes on.
pub fn begin(system: &System, name: &str, arguments: &str, slice: Duration) -> Result<CallResult, Refusals> {
    known(name)?.begin(system, arguments, slice)
}

/// Returns the call of that name. Errors: there is none.
pub fn known(name: &str) -> Result<&'static Call, Refusals> {
    let none = || vec![Refusal::new(Class::CallError, format!("there is no call '{name}'")).remedy("see the list in opengpac_ps.h")];
    find(name).ok_or_else(none)
}

/// Returns the object of a call that commands: an instance, a device, an SVV, or `system`. Nothing where the call only looks, or waits.
pub fn commanded(system: &System, call: &str, arguments: &Map<String, Json>) -> Option<String> {
    find(call)?.about(system, arguments)
}
