// SPDX-License-Identifier: Apache-2.0
//! Declaration of a driver in C, read once. Its strings stay valid, because its library stays loaded.
use super::abi::{self, Driver, Item, by, class, kind, what};
use device::{Class, CounterWord, Kind, Life, OptionWord, SafeBy, SafeState, ServiceWord};
use hints::Interval;
use serde_json::{Map, Value};

/// Declaration of a driver in C.
pub(super) struct Words {
    pub(super) name: &'static str,
    pub(super) doc: &'static str,
    pub(super) class: Class,
    pub(super) options: &'static [OptionWord],
    /// Defaults of the options.
    pub(super) defaults: Map<String, Value>,
    pub(super) life: Life,
    pub(super) safe_state: SafeState,
    pub(super) services: &'static [ServiceWord],
    /// Defaults of the arguments of each service.
    pub(super) service_defaults: Vec<Map<String, Value>>,
    pub(super) counters: &'static [CounterWord],
    pub(super) rights: &'static [&'static str],
}

/// Options, or the arguments of one service, during parsing.
#[derive(Default)]
struct Options {
    words: Vec<OptionWord>,
    defaults: Map<String, Value>,
}

/// Reads the items of a driver; the error is a message.
pub(super) fn read(driver: &Driver) -> Result<Words, String> {
    let items = items(driver)?;
    let (mut class, mut life, mut safe_state) = (Class::Inline, Life::IN_PLACE, SafeState::BY_DRIVER);
    let (mut options, mut services, mut counters, mut rights) = (Options::default(), Vec::<(ServiceWord, Options)>::new(), Vec::new(), Vec::new());
    for item in items {
        let (name, doc) = (stays(item.name), stays(item.doc));
        match item.what {
            what::OPTION => services.last_mut().map_or(&mut options, |(_, arguments)| arguments).add(&item)?,
            what::CLASS => class = if item.kind == class::WORKER { Class::Worker } else { Class::Inline },
            what::WAITS => life.waits_ns = item.whole,
            what::LOST_WITHIN => life.lost_within_ns = item.whole,
            what::SAFE => safe_state = SafeState { doc, by: brought_about(item.by), within_ns: item.whole },
            what::COUNTER => counters.push(CounterWord { name, unit: stays(item.unit), doc }),
            what::RIGHT => rights.push(doc),
            what::SERVICE => services.push((ServiceWord { name, doc, arguments: &[], answer: kind_of(item.kind), moves: item.whole != 0 }, Options::default())),
            other => return Err(format!("item {other} of its declaration is of a later version: build it with this system's opengpac_driver.h")),
        }
    }
    let mut service_defaults = Vec::new();
    let mut service_words = Vec::new();
    for (word, arguments) in services {
        service_words.push(ServiceWord { arguments: arguments.words.leak(), ..word });
        service_defaults.push(arguments.defaults);
    }
    Ok(Words {
        name: stays(driver.name),
        doc: stays(driver.doc),
        class,
        options: options.words.leak(),
        defaults: options.defaults,
        life,
        safe_state,
        services: service_words.leak(),
        service_defaults,
        counters: counters.leak(),
        rights: rights.leak(),
    })
}

fn items(driver: &Driver) -> Result<Vec<Item>, String> {
    if (driver.item_size as usize) < size_of::<Item>() {
        return Err("the size of its items does not match its version: build it again with this system's opengpac_driver.h".to_owned());
    }
    // SAFETY: that number of items of that size exists, and stays valid.
    let item = |index: u32| unsafe { driver.items.byte_add(index as usize * driver.item_size as usize).read_unaligned() };
    Ok((0..driver.item_count).map(item).collect())
}

impl Options {
    fn add(&mut self, item: &Item) -> Result<(), String> {
        let name = stays(item.name);
        let Some(kind) = kind_of(item.kind) else { return Err(format!("option '{name}' has no kind")) };
        let default = if item.needed == 0 { Some(default(item, kind, name)?) } else { None };
        let words = default.as_ref().map(|value| &*Box::leak(value.to_string().into_boxed_str()));
        let (unit, range) = Interval::split(stays(item.unit));
        self.words.push(OptionWord { unit, range, default: words, ..OptionWord::needed(name, kind, stays(item.doc)) });
        if let Some(value) = default {
            self.defaults.insert(name.to_owned(), value);
        }
        Ok(())
    }
}

fn default(item: &Item, kind: Kind, name: &str) -> Result<Value, String> {
    let text = stays(item.text);
    let value = match kind {
        Kind::Text => text.into(),
        Kind::Number => item.number.into(),
        Kind::Whole => item.whole.into(),
        Kind::Bool => (item.whole != 0).into(),
        Kind::List | Kind::Table => serde_json::from_str::<Value>(text).unwrap_or_default(),
    };
    match (kind, &value) {
        (Kind::List, Value::Array(_)) | (Kind::Table, Value::Object(_)) => Ok(value),
        (Kind::List, _) => Err(format!("the default of option '{name}', '{text}', is not a list: write it as JSON, \"[1, 2]\"")),
        (Kind::Table, _) => Err(format!("the default of option '{name}', '{text}', is not a table: write it as JSON, \"{{}}\"")),
        (Kind::Number, Value::Null) => Err(format!("the default of option '{name}' is infinite or not a number")),
        _ => Ok(value),
    }
}

fn kind_of(of: u32) -> Option<Kind> {
    [
        (kind::NUMBER, Kind::Number),
        (kind::WHOLE, Kind::Whole),
        (kind::BOOL, Kind::Bool),
        (kind::TEXT, Kind::Text),
        (kind::LIST, Kind::List),
        (kind::TABLE, Kind::Table),
    ]
    .into_iter()
    .find_map(|(number, kind)| (number == of).then_some(kind))
}

fn brought_about(of: u32) -> &'static [SafeBy] {
    let all = [(by::DRIVER, SafeBy::Driver), (by::GUARD, SafeBy::Guard), (by::DEVICE, SafeBy::Device), (by::END, SafeBy::End)];
    all.into_iter().filter_map(|(bit, by)| (of & bit != 0).then_some(by)).collect::<Vec<_>>().leak()
}

/// Copies a string of the library into a static one.
fn stays(at: *const std::ffi::c_char) -> &'static str {
    // SAFETY: strings of a declaration are null or NUL-terminated.
    Box::leak(unsafe { abi::text(at) }.into_boxed_str())
}
