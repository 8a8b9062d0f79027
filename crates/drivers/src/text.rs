// SPDX-License-Identifier: Apache-2.0
//! Devices that communicate in lines of text, over TCP or a serial line: scanners, scales, printers. Their texts are declared, so no code
//! is needed.
//!
//! | module | |
//! |---|---|
//! | `frame` | start and end of a text, and its completeness |
//! | `fields` | numbers, words, strings |
//! | `pattern` | `"ST,{weight} kg"`: the positions of fields |
//! | `talker` | the driver |
//! | `any_bytes` | the entry point of a fuzzer |
pub(crate) mod any_bytes;
mod fields;
mod frame;
mod pattern;
mod talker;

use crate::serial::Settings;
use crate::stream::Address;
use device::{Channel, Class, Declaration, DriverError, GivenOptions, Kind, Layout, Life, OpenedDriver, OptionWord, SafeBy, SafeState, Type};
use fields::Field;
use frame::{Checksum, ChecksumForm, FRAME_MAX, Framing, Sum};
use pattern::{Order, Pattern};
use serde::Deserialize;
use serde_json::{Map, Value, json};
use std::collections::BTreeMap;
use std::time::Duration;
use talker::{Count, SERVICES, Talker};

pub(crate) static DRIVER: Declaration = Declaration {
    class: Class::Worker,
    life: Life { waits_ns: 0, lost_within_ns: 2_000_000_000 },
    safe_state: SafeState {
        doc: "texts whose numbers have safe values are sent with them; other texts are not sent",
        by: &[SafeBy::Driver],
        within_ns: 1_000_000_000,
    },
    services: &SERVICES,
    counters: Count::WORDS,
    rights: &["serial line: member of the group that owns it, dialout on Debian"],
    ..Declaration::new("text", "a device that exchanges lines of text, over TCP or a serial line: scanner, scale, printer", &OPTIONS, open)
};

const OPTIONS: [OptionWord; 11] = [
    OptionWord::needed("address", Kind::Text, "tcp/192.0.2.8:4001, or serial//dev/ttyUSB0?baud=9600&parity=none"),
    OptionWord::with_default("reads", Kind::List, "none", "texts that it sends, such as \"ST,{weight} kg\"; the first match counts, {} is anything"),
    OptionWord::with_default("writes", Kind::List, "none", "texts that are sent to it, such as \"SP {setpoint}\", when a value in them changes"),
    OptionWord::with_default("asks", Kind::Text, "it sends without being asked", "question sent in each period, whose answer is awaited"),
    OptionWord::with_default(
        "fields",
        Kind::Table,
        "numbers",
        "for each name in the texts: unit, scale, offset, base, decimals, safe; text (its length) or when (the word that is true)",
    )
    .entries(&[&fields::FIELD]),
    OptionWord::with_default("start", Kind::Text, "none", "prefix of each text"),
    OptionWord::with_default("end", Kind::Text, "a line feed, with or without a carriage return before it", "suffix of each text"),
    OptionWord::with_default("length", Kind::Whole, "up to the end", "length of each text in bytes, its checksum included").within(1.0, (FRAME_MAX / 2) as f64),
    OptionWord::with_default("checksum", Kind::Table, "none", "sum (xor or sum), written (hex or byte), mark: after each text"),
    OptionWord::with_default("answer_ns", Kind::Whole, "0.5 s", "time limit for an answer").unit("ns").within(1e6, 6e10),
    OptionWord::with_default("silent_ns", Kind::Whole, "no limit", "time without a text before it is lost").unit("ns").within(1e3, 8.64e13),
];

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Options {
    address: String,
    #[serde(default)]
    reads: Vec<String>,
    #[serde(default)]
    writes: Vec<String>,
    asks: Option<String>,
    #[serde(default)]
    fields: Map<String, Value>,
    #[serde(default)]
    start: String,
    end: Option<String>,
    length: Option<usize>,
    checksum: Option<ChecksumOptions>,
    #[serde(default = "half_a_second")]
    answer_ns: u64,
    silent_ns: Option<i64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ChecksumOptions {
    sum: Sum,
    #[serde(default)]
    written: ChecksumForm,
    #[serde(default)]
    mark: String,
}

fn half_a_second() -> u64 {
    500_000_000
}

/// Channel that counts texts, so that a verb can detect a text that equals the previous one.
const COUNT: &str = "count";

fn open(given: &GivenOptions<'_>) -> Result<OpenedDriver, DriverError> {
    let options: Options = given.read()?;
    let settings = Settings { baud: 9_600, ..Settings::default() };
    let address = Address::parse(&options.address, "serial", settings, None).map_err(|why| given.wrong("address", why))?;
    let framing = framing(&options).map_err(|(option, why)| given.wrong(option, why))?;
    if options.reads.is_empty() && options.writes.is_empty() {
        return Err(given.wrong("reads", "give the texts that it sends, [\"ST,{weight} kg\"], or in \"writes\" those that are sent to it"));
    }
    let mut made = ChannelsMade::default();
    let count = made.layout.add(Channel::read(COUNT, Type::DOUBLE).doc("number of texts received so far"));
    let reads = made.patterns(&options.reads, &options.fields, false).map_err(|why| given.wrong("reads", why))?;
    let writes = made.patterns(&options.writes, &options.fields, true).map_err(|why| given.wrong("writes", why))?;
    if let Some(name) = options.fields.keys().find(|name| !made.fields.contains_key(*name)) {
        let meant = hints::did_you_mean(name, made.fields.keys().map(String::as_str));
        return Err(given.wrong("fields", format!("'{name}' is in none of the texts; {meant}").trim_end_matches("; ").to_owned()));
    }
    let asks = options.asks.map(|asks| framing.framed(asks.as_bytes()));
    let talker =
        Talker::new(made.layout, count, address, framing, reads, writes).asking(asks, Duration::from_nanos(options.answer_ns)).silent(options.silent_ns);
    Ok((Box::new(talker), json!({ "parts": [] })))
}

fn framing(options: &Options) -> Result<Framing, (&'static str, String)> {
    let end = match (&options.end, options.length) {
        (Some(end), _) => end.as_bytes().to_vec(),
        (None, Some(_)) => Vec::new(),
        (None, None) => b"\n".to_vec(),
    };
    if end.is_empty() && options.length.is_none() {
        return Err(("end", "a text without an end must have a \"length\"".to_owned()));
    }
    if options.start.len() + end.len() > 32 {
        return Err(("start", "prefix, suffix and checksum of a text can have at most 32 bytes".to_owned()));
    }
    let checksum = options.checksum.as_ref().map(|asked| Checksum { sum: asked.sum, written: asked.written, mark: asked.mark.as_bytes().to_vec() });
    Ok(Framing { start: options.start.as_bytes().to_vec(), length: options.length, end, checksum })
}

/// Channels and fields created so far.
#[derive(Default)]
struct ChannelsMade {
    layout: Layout,
    fields: BTreeMap<String, (Field, bool)>,
    /// Number of write channels.
    written: usize,
    indices: BTreeMap<String, usize>,
}

impl ChannelsMade {
    fn patterns(&mut self, texts: &[String], declared: &Map<String, Value>, is_written: bool) -> Result<Vec<Order>, String> {
        texts.iter().map(|text| self.pattern(text, declared, is_written)).collect()
    }

    fn pattern(&mut self, text: &str, declared: &Map<String, Value>, is_written: bool) -> Result<Order, String> {
        for name in pattern::names(text)? {
            self.field(&name, declared, is_written)?;
        }
        let fields = &self.fields;
        let pattern = Pattern::parse(text, |name| fields.get(name).map(|(field, _)| field.clone()).ok_or_else(|| format!("there is no field '{name}'")))?;
        let indices = pattern::names(text)?.iter().filter_map(|name| self.indices.get(name).copied()).collect();
        Ok(Order { pattern, indices })
    }

    fn field(&mut self, name: &str, declared: &Map<String, Value>, is_written: bool) -> Result<(), String> {
        match self.fields.get(name) {
            Some((_, known)) if *known == is_written => return Ok(()),
            Some(_) => return Err(format!("'{name}' is already read; give what is written another name")),
            None if name == COUNT || name == "age" => return Err(format!("'{name}' is the name of a channel that every such device has")),
            None => {}
        }
        let (channel, field) = fields::declared(name, declared.get(name), is_written).map_err(|why| format!("'{name}': {why}"))?;
        let slot = self.layout.add(channel);
        self.fields.insert(name.to_owned(), (Field { slot, ..field }, is_written));
        if is_written {
            self.indices.insert(name.to_owned(), self.written);
            self.written += 1;
        }
        Ok(())
    }
}
