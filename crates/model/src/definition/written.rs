// SPDX-License-Identifier: Apache-2.0
//! Short forms in which people write definitions. Each is parsed into the long form of [`crate::definition`]; none is ever serialised.
//!
//! Fields of definitions refer to these functions in `deserialize_with`, and to these types for their schema.
use crate::definition::{BlockSource, BlockUse, Command, CommandList, InputParameter, Object, Requirement, Termination};
use crate::quantity;
use crate::refusal::Class;
use indexmap::IndexMap;
use serde::Deserialize;
use serde::de::value::{MapAccessDeserializer, SeqAccessDeserializer};
use serde::de::{DeserializeOwned, Deserializer, Error, MapAccess, SeqAccess, Visitor};
use std::marker::PhantomData;

/// One or several names, as JSON allows.
#[derive(Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "schema", schemars(rename = "NameList"))]
#[serde(untagged)]
pub(crate) enum Names {
    One(String),
    Several(Vec<String>),
}

impl From<Names> for Vec<String> {
    fn from(names: Names) -> Vec<String> {
        match names {
            Names::One(name) => vec![name],
            Names::Several(names) => names,
        }
    }
}

pub(crate) fn one_or_several<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<String>, D::Error> {
    Ok(Option::<Names>::deserialize(deserializer)?.map_or_else(Vec::new, Vec::from))
}

pub(crate) fn perhaps_several<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<Vec<String>>, D::Error> {
    Ok(Option::<Names>::deserialize(deserializer)?.map(Vec::from))
}

/// Sets of names, by the name of the set: ρ, χ.
pub(crate) type Sets = IndexMap<String, Names>;

pub(crate) fn sets<'de, D: Deserializer<'de>>(deserializer: D) -> Result<IndexMap<String, Vec<String>>, D::Error> {
    Ok(Sets::deserialize(deserializer)?.into_iter().map(|(name, names)| (name, names.into())).collect())
}

/// A type whose short form consists of one or several strings.
pub(crate) trait Short: DeserializeOwned {
    /// True if the short form may consist of several strings.
    const SEVERAL: bool;
    fn of(names: Vec<String>) -> Result<Self, String>;
}

/// A value in its long or short form.
pub(crate) struct ShortForm<T>(T);

/// Values by name, each in long or short form.
pub(crate) type WrittenMap<T> = IndexMap<String, ShortForm<T>>;

pub(crate) fn map<'de, D: Deserializer<'de>, T: Short>(deserializer: D) -> Result<IndexMap<String, T>, D::Error> {
    Ok(WrittenMap::<T>::deserialize(deserializer)?.into_iter().map(|(name, ShortForm(of))| (name, of)).collect())
}

pub(crate) fn one<'de, D: Deserializer<'de>, T: Short>(deserializer: D) -> Result<T, D::Error> {
    ShortForm::<T>::deserialize(deserializer).map(|ShortForm(of)| of)
}

impl<'de, T: Short> Deserialize<'de> for ShortForm<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(Reader(PhantomData)).map(ShortForm)
    }
}

struct Reader<T>(PhantomData<T>);

impl<'de, T: Short> Visitor<'de> for Reader<T> {
    type Value = T;

    fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(if T::SEVERAL { "a name, several names or an object" } else { "a name or an object" })
    }

    fn visit_str<E: Error>(self, text: &str) -> Result<T, E> {
        T::of(vec![text.to_owned()]).map_err(E::custom)
    }

    fn visit_seq<A: SeqAccess<'de>>(self, texts: A) -> Result<T, A::Error> {
        if !T::SEVERAL {
            return Err(A::Error::invalid_type(serde::de::Unexpected::Seq, &self));
        }
        T::of(Vec::deserialize(SeqAccessDeserializer::new(texts))?).map_err(A::Error::custom)
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<T, A::Error> {
        T::deserialize(MapAccessDeserializer::new(map))
    }
}

fn single(mut names: Vec<String>) -> String {
    names.pop().unwrap_or_default()
}

impl Short for BlockSource {
    const SEVERAL: bool = false;
    fn of(names: Vec<String>) -> Result<Self, String> {
        Ok(BlockSource::Subroutine(single(names)))
    }
}

impl Short for BlockUse {
    const SEVERAL: bool = false;
    fn of(names: Vec<String>) -> Result<Self, String> {
        Ok(BlockUse { block: BlockSource::Subroutine(single(names)), constants: IndexMap::new(), place: None })
    }
}

impl Short for Object {
    const SEVERAL: bool = false;
    fn of(names: Vec<String>) -> Result<Self, String> {
        Ok(Object { device_type: single(names), each: false })
    }
}

impl Short for Requirement {
    const SEVERAL: bool = false;
    fn of(names: Vec<String>) -> Result<Self, String> {
        let name = single(names);
        let raises: Class = serde_json::from_value(name.clone().into()).map_err(|_| format!("'{name}' is not an error class"))?;
        Ok(Requirement { when: None, raises, remedy: String::new(), place: None })
    }
}

impl Short for InputParameter {
    const SEVERAL: bool = true;
    fn of(targets: Vec<String>) -> Result<Self, String> {
        Ok(InputParameter { targets, ..InputParameter::default() })
    }
}

impl Short for Termination {
    const SEVERAL: bool = true;
    fn of(on: Vec<String>) -> Result<Self, String> {
        Ok(Termination { on, ..Termination::default() })
    }
}

/// `raises` mark of a condition: a Boolean, or the name of the exception class, which only the programming system resolves.
#[derive(Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(untagged)]
pub(crate) enum RaiseMark {
    Is(bool),
    /// Name of the exception class.
    Named(String),
}

pub(crate) fn raised<'de, D: Deserializer<'de>>(deserializer: D) -> Result<bool, D::Error> {
    Ok(match RaiseMark::deserialize(deserializer)? {
        RaiseMark::Is(raises) => raises,
        RaiseMark::Named(name) => !name.is_empty(),
    })
}

/// A time with its unit: `"20 ms"`.
#[derive(Clone, Copy)]
pub struct Span(pub i64);

impl<'de> Deserialize<'de> for Span {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let text = String::deserialize(deserializer)?;
        quantity::duration_ns(&text, "the duration").map(Span).map_err(|refusal| D::Error::custom(refusal.message))
    }
}

/// A command in short form: the name of the command is the key of its argument.
#[derive(Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(untagged)]
pub(crate) enum ShortCommand {
    Install {
        install: Names,
    },
    Execute {
        execute: String,
    },
    Activate {
        activate: String,
        every: Option<Span>,
        #[serde(default)]
        tunable: bool,
        budget: Option<Span>,
    },
    Deactivate {
        deactivate: String,
    },
    /// Waits for one or several conditions, for a time, or (`true`) until no instance is active.
    Wait {
        wait: Until,
    },
    Ready {
        #[allow(dead_code, reason = "its key says it all")]
        ready: bool,
    },
}

/// End of a wait.
#[derive(Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(untagged)]
pub(crate) enum Until {
    Idle(#[allow(dead_code, reason = "true and false are one")] bool),
    Named(Names),
}

/// A command in long or short form.
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "schema", schemars(untagged))]
pub(crate) enum WrittenCommand {
    Long(Command),
    Short(ShortCommand),
}

const COMMANDS: [&str; 6] = ["install", "execute", "activate", "deactivate", "wait", "ready"];

impl<'de> Deserialize<'de> for WrittenCommand {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let given = serde_json::Map::deserialize(deserializer)?;
        if given.contains_key("command") {
            return serde_json::from_value(given.into()).map(WrittenCommand::Long).map_err(D::Error::custom);
        }
        if !COMMANDS.iter().any(|name| given.contains_key(*name)) {
            return Err(D::Error::custom(format!("a command has none of {}", COMMANDS.join(", "))));
        }
        let wrong = |_| D::Error::custom(format!("'{}' is not a command", serde_json::Value::from(given.clone())));
        serde_json::from_value(given.clone().into()).map(WrittenCommand::Short).map_err(wrong)
    }
}

impl TryFrom<WrittenCommand> for Command {
    type Error = String;

    fn try_from(written: WrittenCommand) -> Result<Command, String> {
        let positive = |span: Option<Span>| span.map(|Span(ns)| u64::try_from(ns).map_err(|_| format!("a time of {ns} ns is negative"))).transpose();
        Ok(match written {
            WrittenCommand::Long(command) => command,
            WrittenCommand::Short(ShortCommand::Install { install }) => Command::Install { blocks: install.into() },
            WrittenCommand::Short(ShortCommand::Execute { execute }) => Command::Execute { block: execute },
            WrittenCommand::Short(ShortCommand::Activate { activate, every, tunable, budget }) => {
                Command::Activate { block: activate, every_ns: positive(every)?, tunable, budget_ns: positive(budget)? }
            }
            WrittenCommand::Short(ShortCommand::Deactivate { deactivate }) => Command::Deactivate { block: deactivate },
            WrittenCommand::Short(ShortCommand::Wait { wait }) => until(wait),
            WrittenCommand::Short(ShortCommand::Ready { .. }) => Command::Ready,
        })
    }
}

fn until(wait: Until) -> Command {
    match wait {
        Until::Idle(_) => Command::Wait { conditions: Vec::new(), time_ns: None },
        Until::Named(Names::One(text)) => match quantity::duration_ns(&text, "the duration") {
            Ok(ns) => Command::Wait { conditions: Vec::new(), time_ns: Some(ns) },
            Err(_) => Command::Wait { conditions: vec![text], time_ns: None },
        },
        Until::Named(names) => Command::Wait { conditions: names.into(), time_ns: None },
    }
}

pub(crate) fn commands<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<Command>, D::Error> {
    let written = Vec::<WrittenCommand>::deserialize(deserializer)?;
    written.into_iter().map(|command| Command::try_from(command).map_err(D::Error::custom)).collect()
}

/// A command list, or only its commands.
#[derive(Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(transparent)]
pub(crate) struct Commands(
    #[serde(deserialize_with = "commands")]
    #[cfg_attr(feature = "schema", schemars(with = "Vec<WrittenCommand>"))]
    Vec<Command>,
);

pub(crate) fn lists<'de, D: Deserializer<'de>>(deserializer: D) -> Result<IndexMap<String, CommandList>, D::Error> {
    Ok(IndexMap::<String, WrittenList>::deserialize(deserializer)?.into_iter().map(|(name, WrittenList(list))| (name, list)).collect())
}

/// A command list in long or short form.
pub(crate) struct WrittenList(CommandList);

impl<'de> Deserialize<'de> for WrittenList {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct ListReader;
        impl<'de> Visitor<'de> for ListReader {
            type Value = CommandList;
            fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str("commands, or an object with commands")
            }
            fn visit_seq<A: SeqAccess<'de>>(self, commands: A) -> Result<CommandList, A::Error> {
                let Commands(commands) = Commands::deserialize(SeqAccessDeserializer::new(commands))?;
                Ok(CommandList { commands, place: None })
            }
            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<CommandList, A::Error> {
                CommandList::deserialize(MapAccessDeserializer::new(map))
            }
        }
        deserializer.deserialize_any(ListReader).map(WrittenList)
    }
}

#[cfg(feature = "schema")]
mod schema {
    use super::{Commands, Names, Short, ShortForm, Span, WrittenList};
    use crate::definition::CommandList;
    use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
    use std::borrow::Cow;

    impl<T: Short + JsonSchema> JsonSchema for ShortForm<T> {
        fn schema_name() -> Cow<'static, str> {
            format!("Written{}", T::schema_name()).into()
        }
        fn json_schema(generator: &mut SchemaGenerator) -> Schema {
            let short = if T::SEVERAL { generator.subschema_for::<Names>() } else { generator.subschema_for::<String>() };
            json_schema!({ "anyOf": [short, generator.subschema_for::<T>()] })
        }
    }

    impl JsonSchema for WrittenList {
        fn schema_name() -> Cow<'static, str> {
            "WrittenCommandList".into()
        }
        fn json_schema(generator: &mut SchemaGenerator) -> Schema {
            json_schema!({ "anyOf": [generator.subschema_for::<Commands>(), generator.subschema_for::<CommandList>()] })
        }
    }

    impl JsonSchema for Span {
        fn schema_name() -> Cow<'static, str> {
            "Time".into()
        }
        fn json_schema(_: &mut SchemaGenerator) -> Schema {
            json_schema!({ "type": "string", "format": "time-with-unit", "description": "A time with its unit: `20 ms`." })
        }
    }
}
