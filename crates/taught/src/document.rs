// SPDX-License-Identifier: Apache-2.0
//! A points file as a document: in format 2, each point is one line; in format 1, one table. Changes preserve the layout of the file;
//! adding a pose sets its format to 2.
use crate::{JOINTS, NamedFrame, TaughtPoint, TaughtPoints, WORLD, refuse};
use model::hints;
use model::refusal::{Class, Refusals};
use std::path::PathBuf;
use supervisor::PointFile;
use toml_edit::{Array, DocumentMut, InlineTable, Item, Table, TableLike, Value, value};

const FORMAT: i64 = 2;
/// Factor with which numbers in a file are rounded (nine decimal places), as in the Python package.
const DIGITS: f64 = 1e9;
/// Exclusive upper limit of the magnitude of numbers in a file.
const NUMBER_MAX: f64 = 1e300;
const NEW: &str = "# Taught points, one per line. You may edit this file: comments and order are kept.\nformat = 2\n";

/// A valid points file.
pub struct PointDocument {
    document: DocumentMut,
    path: PathBuf,
    joints: Vec<String>,
    /// Value, in rad or m, of the unit that the file uses for each joint.
    factors: Vec<f64>,
}

impl PointDocument {
    /// Parses the text of a file, or creates a new document if there is none. Fails if the text cannot be parsed or belongs to another
    /// arm.
    pub fn of(text: Option<String>, file: &PointFile) -> Result<Self, Refusals> {
        let wrong = |why: String| {
            refuse(Class::InvalidState, format!("the points file '{}' cannot be used: {why}", file.path.display()), "fix it; nothing was changed")
        };
        let mut document: DocumentMut = text.as_deref().unwrap_or(NEW).parse().map_err(|why: toml_edit::TomlError| wrong(why.to_string().trim().to_owned()))?;
        if text.is_none() {
            enter_arm(&mut document, file);
        }
        if !matches!(document.get("format").and_then(Item::as_integer), Some(1 | FORMAT)) {
            return Err(wrong(format!("its format must be 1 or {FORMAT}")));
        }
        let arm = document.get("arm").and_then(Item::as_table_like).ok_or_else(|| wrong("it has no table [arm]".to_owned()))?;
        let [joints, units] = ["joints", "units"].map(|key| texts(arm.get(key)));
        let model = arm.get("model").and_then(Item::as_str).unwrap_or_default().to_owned();
        let (Some(joints), Some(units)) = (joints, units) else { return Err(wrong("[arm] lacks joints or units".to_owned())) };
        if document.get("points").and_then(Item::as_table_like).is_none() {
            return Err(wrong("it has no table [points]".to_owned()));
        }
        if joints.is_empty() {
            enter_arm(&mut document, file);
        } else if joints != file.joints {
            let message =
                format!("the points in '{}' are for joints {}, but arm '{}' has {}", file.path.display(), joints.join(", "), file.arm, file.joints.join(", "));
            return Err(refuse(Class::ValueRefused, message, "pass the points file of this arm"));
        } else if model != file.model && !file.any_model {
            let message = format!("the points in '{}' were taught with a different model from that of arm '{}'", file.path.display(), file.arm);
            return Err(refuse(Class::ValueRefused, message, "pass the points file of this arm"));
        }
        let units = if joints.is_empty() { file.units.clone() } else { units };
        let factors: Option<Vec<f64>> = units.iter().map(|unit| factor(unit)).collect();
        let factors = factors.filter(|found| found.len() == file.joints.len());
        let factors = factors.ok_or_else(|| wrong(format!("[arm] has the units {}; write rad, deg, m or mm for each joint", units.join(", "))))?;
        let read = PointDocument { document, path: file.path.clone(), joints: file.joints.clone(), factors };
        read.check().map_err(wrong)?;
        Ok(read)
    }

    pub fn text(&self) -> String {
        self.document.to_string()
    }

    pub fn points(&self) -> TaughtPoints {
        TaughtPoints {
            file: self.path.display().to_string(),
            joints: self.joints.clone(),
            points: self.table("points").map(|table| table.iter().filter_map(|(name, entry)| self.point(name, entry)).collect()).unwrap_or_default(),
            frames: self.frames("frames"),
            tools: self.frames("tools"),
        }
    }

    /// Appends a point, or replaces the point of the same name in place.
    pub fn put(&mut self, point: &TaughtPoint) -> Result<(), Refusals> {
        self.fits(point)?;
        let in_lines = self.is_in_lines();
        if point.position.is_some() {
            self.document["format"] = value(FORMAT);
        }
        let listed: Vec<f64> = point.joints.iter().zip(&self.factors).map(|(joint, factor)| rounded(joint / factor)).collect();
        let names = self.joints.clone();
        let points = self.points_mut();
        if !points.contains_key(&point.name) {
            points.insert(&point.name, if in_lines { Item::Value(Value::InlineTable(InlineTable::new())) } else { Item::Table(Table::new()) });
        }
        let entry = points.get_mut(&point.name).and_then(Item::as_table_like_mut).expect("each point was checked to be a table");
        let by_name = !in_lines || entry.get("joints").is_some_and(Item::is_table_like);
        let joints = if by_name { by_names(&names, &listed) } else { Value::Array(numbers(&listed)) };
        let is_place = point.position.is_some();
        keep(entry, "frame", (is_place || !in_lines).then(|| point.frame.as_str().into()));
        keep(entry, "tool", point.tool.as_deref().filter(|_| is_place).map(Value::from));
        keep(entry, "position", point.position.map(|place| Value::Array(numbers(&place))));
        keep(entry, "rpy_deg", point.rpy_deg.filter(|_| is_place).map(|turn| Value::Array(numbers(&turn))));
        keep(entry, "configuration", point.configuration.as_deref().filter(|_| is_place).map(Value::from));
        let turns = point.turns.iter().any(|turn| *turn != 0) && is_place && point.configuration.is_some();
        keep(entry, "turns", turns.then(|| Value::Array(point.turns.iter().copied().collect())));
        keep(entry, "joints", Some(joints));
        keep(entry, "note", (!point.note.is_empty()).then(|| point.note.as_str().into()));
        keep(entry, "taught", point.taught.as_deref().and_then(|time| time.parse::<toml_edit::Datetime>().ok()).map(Value::from));
        Ok(())
    }

    /// Renames a point, which keeps its place in the file.
    pub fn rename(&mut self, name: &str, to: &str) -> Result<(), Refusals> {
        named(to)?;
        self.known(name)?;
        if self.table("points").is_some_and(|table| table.contains_key(to)) {
            return Err(refuse(Class::ValueRefused, format!("cannot rename point '{name}': there is already a point '{to}'"), "delete that one first"));
        }
        let points = self.points_mut();
        let names: Vec<String> = points.iter().map(|(key, _)| key.to_owned()).collect();
        // A key cannot be renamed in place: it and all later ones are inserted again, with the decor before and after them.
        for key in names.iter().skip_while(|key| *key != name) {
            let decor = points.key(key).map(|key| (key.leaf_decor().clone(), key.dotted_decor().clone()));
            let entry = points.remove(key).expect("it is one of the keys");
            let called = if key == name { to } else { key };
            points.insert(called, entry);
            if let (Some((leaf, dotted)), Some(mut key)) = (decor, points.key_mut(called)) {
                *key.leaf_decor_mut() = leaf;
                *key.dotted_decor_mut() = dotted;
            }
        }
        Ok(())
    }

    /// Removes and returns a point.
    pub fn remove(&mut self, name: &str) -> Result<TaughtPoint, Refusals> {
        let point = self.known(name)?;
        self.points_mut().remove(name);
        Ok(point)
    }

    fn known(&self, name: &str) -> Result<TaughtPoint, Refusals> {
        let there: Vec<&str> = self.table("points").map(|table| table.iter().map(|(key, _)| key).collect()).unwrap_or_default();
        let entry = self.table("points").and_then(|table| table.get(name)).and_then(|entry| self.point(name, entry));
        entry.ok_or_else(|| {
            let meant =
                hints::nearest(name, there.iter().copied()).map_or_else(|| "check the list of points".to_owned(), |meant| format!("did you mean '{meant}'?"));
            refuse(Class::UnknownName, format!("there is no point '{name}' in '{}'", self.path.display()), meant)
        })
    }

    fn fits(&self, point: &TaughtPoint) -> Result<(), Refusals> {
        let name = &point.name;
        named(name)?;
        let finite = |numbers: &[f64]| numbers.iter().all(|number| number.abs() < NUMBER_MAX);
        if point.joints.len() != self.joints.len() || !finite(&point.joints) {
            return Err(refuse(
                Class::ValueRefused,
                format!("point '{name}' cannot be {:?}", point.joints),
                format!("give {} finite numbers: {}", self.joints.len(), self.joints.join(", ")),
            ));
        }
        if (point.frame == JOINTS) != point.position.is_none() || !point.position.iter().chain(&point.rpy_deg).all(|place| finite(place)) {
            return Err(refuse(
                Class::ValueRefused,
                format!("point '{name}' has no valid position in its frame '{}'", point.frame),
                "give finite numbers, or use frame 'joints' without a position",
            ));
        }
        let no = |what: &str, name: &str| {
            refuse(
                Class::UnknownName,
                format!("point '{}' uses the {what} '{name}', which '{}' does not contain", point.name, self.path.display()),
                "choose one that the file contains",
            )
        };
        if point.frame != JOINTS && point.frame != WORLD && !self.has("frames", &point.frame) {
            return Err(no("frame", &point.frame));
        }
        match &point.tool {
            Some(tool) if !self.has("tools", tool) => Err(no("tool", tool)),
            _ => Ok(()),
        }
    }

    /// Checks all entries; fails at the first fault.
    fn check(&self) -> Result<(), String> {
        for section in ["frames", "tools"] {
            for (name, entry) in self.table(section).into_iter().flat_map(TableLike::iter) {
                frame(name, entry).ok_or_else(|| format!("'{name}' of [{section}] has no position of three finite numbers"))?;
            }
        }
        for (name, entry) in self.table("points").into_iter().flat_map(TableLike::iter) {
            let point = self.point(name, entry).ok_or_else(|| format!("point '{name}' does not have a position of each joint: {}", self.joints.join(", ")))?;
            self.fits(&point).map_err(|refusals| refusals[0].message.clone())?;
        }
        Ok(())
    }

    /// Reads an entry; returns `None` if it lacks a number for a joint, or if an item has the wrong type.
    fn point(&self, name: &str, entry: &Item) -> Option<TaughtPoint> {
        let entry = entry.as_table_like()?;
        let of = entry.get("joints")?;
        let listed = match of.as_table_like() {
            Some(by_name) => self.joints.iter().map(|joint| number(by_name.get(joint)?.as_value()?)).collect(),
            None => of.as_array().and_then(|array| array.iter().map(number).collect::<Option<Vec<_>>>()).filter(|listed| listed.len() == self.joints.len()),
        }?;
        let text = |key: &str| entry.get(key).map(|item| item.as_str().map(str::to_owned));
        let three = |key: &str| entry.get(key).map(numbers_of);
        let position = three("position").map_or(Some(None), |found| found.map(Some))?;
        let turned = three("rpy_deg").map_or(Some(None), |found| found.map(Some))?;
        let turns = entry.get("turns").map_or(Some(Vec::new()), |item| item.as_array()?.iter().map(Value::as_integer).collect())?;
        Some(TaughtPoint {
            name: name.to_owned(),
            joints: listed.iter().zip(&self.factors).map(|(joint, factor)| joint * factor).collect(),
            frame: text("frame").map_or(Some(JOINTS.to_owned()), |found| found)?,
            tool: text("tool").map_or(Some(None), |found| found.map(Some))?,
            position,
            rpy_deg: position.map(|_| turned.unwrap_or_default()),
            configuration: text("configuration").map_or(Some(None), |found| found.map(Some))?,
            turns,
            note: text("note").map_or(Some(String::new()), |found| found)?,
            taught: entry.get("taught").and_then(Item::as_datetime).map(ToString::to_string),
        })
    }

    fn frames(&self, section: &str) -> Vec<NamedFrame> {
        self.table(section).map(|table| table.iter().filter_map(|(name, entry)| frame(name, entry)).collect()).unwrap_or_default()
    }

    fn table(&self, section: &str) -> Option<&dyn TableLike> {
        self.document.get(section).and_then(Item::as_table_like)
    }

    fn has(&self, section: &str, name: &str) -> bool {
        self.table(section).is_some_and(|table| table.contains_key(name))
    }

    fn points_mut(&mut self) -> &mut dyn TableLike {
        self.document.get_mut("points").and_then(Item::as_table_like_mut).expect("it was checked to be a table")
    }

    /// Returns true if points are written as lines instead of tables.
    fn is_in_lines(&self) -> bool {
        let format = self.document.get("format").and_then(Item::as_integer);
        let points = self.table("points").into_iter().flat_map(TableLike::iter).map(|(_, entry)| entry.is_inline_table()).collect::<Vec<_>>();
        if points.is_empty() { format == Some(FORMAT) } else { points.iter().all(|is_line| *is_line) }
    }
}

/// Writes the arm's data to a document.
fn enter_arm(document: &mut DocumentMut, file: &PointFile) {
    let mut arm = Table::new();
    arm.insert("name", value(&file.arm));
    arm.insert("model", value(&file.model));
    arm.insert("joints", value(file.joints.iter().collect::<Array>()));
    arm.insert("units", value(file.units.iter().collect::<Array>()));
    document.insert("arm", Item::Table(arm));
    if !document.contains_key("points") {
        document.insert("points", Item::Table(Table::new()));
    }
}

/// Returns the value of a unit in rad or m; `None` if it is neither an angle nor a length. The value of an empty unit is 1.
fn factor(unit: &str) -> Option<f64> {
    if unit.is_empty() {
        return Some(1.0);
    }
    ["rad", "m"].iter().find_map(|si| model::quantity::number_in(&format!("1 {unit}"), si).ok())
}

fn named(name: &str) -> Result<(), Refusals> {
    if name.trim().is_empty() {
        return Err(refuse(Class::CallError, "a point must have a name", "give one, for example pick"));
    }
    Ok(())
}

fn frame(name: &str, entry: &Item) -> Option<NamedFrame> {
    let entry = entry.as_table_like()?;
    let rpy_deg = entry.get("rpy_deg").map_or(Some([0.0; 3]), numbers_of)?;
    Some(NamedFrame { name: name.to_owned(), position: numbers_of(entry.get("position")?)?, rpy_deg })
}

fn texts(item: Option<&Item>) -> Option<Vec<String>> {
    item?.as_array()?.iter().map(|one| one.as_str().map(str::to_owned)).collect()
}

fn number(of: &Value) -> Option<f64> {
    let found = of.as_float().or_else(|| of.as_integer().map(|whole| whole as f64))?;
    (found.abs() < NUMBER_MAX).then_some(found)
}

fn numbers_of(item: &Item) -> Option<[f64; 3]> {
    let found: Option<Vec<f64>> = item.as_array()?.iter().map(number).collect();
    found?.try_into().ok()
}

fn rounded(number: f64) -> f64 {
    (number * DIGITS).round() / DIGITS + 0.0
}

fn numbers(of: &[f64]) -> Array {
    of.iter().map(|one| rounded(*one)).collect()
}

fn by_names(names: &[String], values: &[f64]) -> Value {
    let mut table = InlineTable::new();
    for (name, one) in names.iter().zip(values) {
        table.insert(name, (*one).into());
    }
    Value::InlineTable(table)
}

/// Sets an item of an entry if it differs; removes it if `to` is `None`.
fn keep(entry: &mut dyn TableLike, key: &str, to: Option<Value>) {
    let Some(to) = to else {
        entry.remove(key);
        return;
    };
    let is_so = entry.get(key).and_then(Item::as_value).is_some_and(|now| now.to_string().trim() == to.to_string().trim());
    if !is_so {
        entry.insert(key, Item::Value(to));
    }
}
