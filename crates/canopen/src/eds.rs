// SPDX-License-Identifier: Apache-2.0
//! Electronic data sheets (CiA 306): the file that a vendor supplies with a device, which describes its object dictionary.
use crate::pdo::Word;
use cia402::Entry;
use std::collections::BTreeMap;

/// Description of a device, read from a file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Eds {
    /// Vendor ID for object 0x1018; `None` if the file does not contain it.
    pub vendor: Option<u32>,
    pub product: Option<u32>,
    pub product_name: String,
    objects: BTreeMap<(u16, u8), Object>,
}

/// An object dictionary entry of the device.
#[derive(Clone, Debug, PartialEq)]
pub struct Object {
    /// Name; for a member of a record or array, both names, such as `Identity object.Vendor-ID`.
    pub name: String,
    pub kind: DataType,
    pub is_mappable: bool,
    /// Default value as written in the file: a number, a string, or an expression with `$NODEID`.
    default: String,
}

/// Data type number of CiA 301.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DataType(pub u16);

type Section<'a> = BTreeMap<String, &'a str>;

/// Object codes, as declared in a section.
const ARRAY: u32 = 8;
const RECORD: u32 = 9;

impl DataType {
    /// Returns the number of bits of a numeric type; `None` for a string, a domain, or a number of unsupported length.
    pub fn bits(self) -> Option<u64> {
        match self.0 {
            1 | 2 | 5 => Some(8),
            3 | 6 => Some(16),
            4 | 7 | 8 => Some(32),
            0x11 | 0x15 | 0x1B => Some(64),
            _ => None,
        }
    }

    pub fn is_signed(self) -> bool {
        matches!(self.0, 2 | 3 | 4 | 0x15)
    }
}

impl Eds {
    /// Parses a file. Text that is not valid UTF-8 is read as Latin-1, in which many files are written.
    ///
    /// # Errors
    /// Fails with a message that names the section if the file is not an EDS or an object cannot be parsed.
    pub fn read(bytes: &[u8]) -> Result<Eds, String> {
        let text = std::str::from_utf8(bytes).map_or_else(|_| bytes.iter().copied().map(char::from).collect(), str::to_owned);
        let sections = sections(&text)?;
        let device = sections.get("deviceinfo").ok_or("it is not an EDS file: it has no section [DeviceInfo]")?;
        let number_of = |key: &str| device.get(key).and_then(|text| number(text));
        let product_name = device.get("productname").unwrap_or(&"").to_string();
        let mut eds = Eds { vendor: number_of("vendornumber"), product: number_of("productnumber"), product_name, objects: BTreeMap::new() };
        for (name, section) in &sections {
            let Some(index) = index_of(name) else { continue };
            eds.take(index, name, section, &sections)?;
        }
        if eds.objects.is_empty() { Err("it contains no objects".to_owned()) } else { Ok(eds) }
    }

    fn take(&mut self, index: u16, name: &str, section: &Section<'_>, sections: &BTreeMap<String, Section<'_>>) -> Result<(), String> {
        let title = parameter_name(name, section)?;
        let object_type = section.get("objecttype").map_or(Some(7), |text| number(text)).ok_or_else(|| format!("[{name}]: its ObjectType is not a number"))?;
        if object_type != ARRAY && object_type != RECORD {
            self.objects.insert((index, 0), object(name, title.to_owned(), section)?);
            return Ok(());
        }
        if let Some(count) = section.get("compactsubobj").and_then(|text| number(text)) {
            self.take_compact(index, name, title, section, (count.min(254) as u8, sections.get(&format!("{name}name"))))?;
        }
        for (sub_name, sub_section) in sections.range(format!("{name}sub")..).take_while(|(of, _)| of.starts_with(&format!("{name}sub"))) {
            let Ok(sub) = u8::from_str_radix(&sub_name[name.len() + 3..], 16) else { continue };
            let own = parameter_name(sub_name, sub_section)?;
            self.objects.insert((index, sub), object(sub_name, format!("{title}.{own}"), sub_section)?);
        }
        Ok(())
    }

    /// Adds the entries that one line represents, all with the type of their array; another section may define their names.
    fn take_compact(&mut self, index: u16, name: &str, title: &str, section: &Section<'_>, (count, names): (u8, Option<&Section<'_>>)) -> Result<(), String> {
        let entries = Object { name: format!("{title}.NrOfObjects"), kind: DataType(5), is_mappable: false, default: count.to_string() };
        self.objects.insert((index, 0), entries);
        for sub in 1..=count {
            let own = names.and_then(|names| names.get(&sub.to_string()).copied()).map_or_else(|| format!("{title}{sub}"), str::to_owned);
            self.objects.insert((index, sub), object(name, format!("{title}.{own}"), section)?);
        }
        Ok(())
    }

    /// Returns the object dictionary entry at an index and subindex.
    pub fn object(&self, of: Entry) -> Option<&Object> {
        self.objects.get(&(of.index, of.sub))
    }

    /// Returns all object dictionary entries in order.
    pub fn objects(&self) -> impl Iterator<Item = (Entry, &Object)> {
        self.objects.iter().map(|((index, sub), object)| (Entry { index: *index, sub: *sub }, object))
    }

    /// Returns the object with this name, ignoring case.
    ///
    /// # Errors
    /// Fails with a message if the name is unknown or ambiguous.
    pub fn named(&self, name: &str) -> Result<(Entry, &Object), String> {
        let found: Vec<(Entry, &Object)> = self.objects().filter(|(_, object)| object.name.eq_ignore_ascii_case(name)).collect();
        match found[..] {
            [one] => Ok(one),
            [] => {
                let words: Vec<String> = name.to_lowercase().split_whitespace().map(str::to_owned).collect();
                let is_near = |object: &Object| words.iter().any(|word| word.len() > 3 && object.name.to_lowercase().contains(word));
                let near: Vec<&str> = self.objects().filter(|(_, object)| is_near(object)).map(|(_, object)| object.name.as_str()).take(5).collect();
                let near = if near.is_empty() { String::new() } else { format!("; there are '{}'", near.join("', '")) };
                Err(format!("its EDS file contains no object '{name}'{near}"))
            }
            _ => Err(format!("its EDS file has {} objects '{name}'; give the index", found.len())),
        }
    }

    /// Returns the default value of an object as a number, for the node with this number.
    pub fn default_of(&self, of: Entry, node: u8) -> Option<i64> {
        let text = self.object(of)?.default.replace(' ', "").to_lowercase();
        if !text.contains("$nodeid") {
            return signed(&text);
        }
        let rest = text.replace("$nodeid", "");
        let rest = rest.trim_matches('+');
        i64::from(node).checked_add(if rest.is_empty() { 0 } else { signed(rest)? })
    }

    /// Returns the default mapping of a PDO: `mapping` is 0x1600 to 0x1603 or 0x1A00 to 0x1A03.
    pub fn mapping(&self, mapping: u16, node: u8) -> Vec<Word> {
        let value = |sub| self.default_of(Entry { index: mapping, sub }, node);
        let count = value(0).unwrap_or(0).clamp(0, 64) as u8;
        (1..=count).filter_map(value).filter(|word| *word != 0).map(|word| word as Word).collect()
    }
}

/// Returns the sections of a file by lower-case name, each with its values by lower-case key.
fn sections(text: &str) -> Result<BTreeMap<String, Section<'_>>, String> {
    let mut sections = BTreeMap::<String, Section<'_>>::new();
    let mut current = None;
    for (number, line) in (1..).zip(text.lines()) {
        let line = line.trim().trim_start_matches('\u{feff}');
        if line.is_empty() || line.starts_with([';', '#']) {
            continue;
        }
        if let Some(rest) = line.strip_prefix('[') {
            let name = rest.split(']').next().unwrap_or_default().trim().to_lowercase();
            current = Some(sections.entry(name).or_default());
            continue;
        }
        let (Some(section), Some((key, value))) = (&mut current, line.split_once('=')) else {
            return Err(format!("line {number} is neither a section nor a value: '{line}'"));
        };
        section.insert(key.trim().to_lowercase(), value.trim());
    }
    Ok(sections)
}

/// Parses the name of a section that describes an object: an index of four digits.
fn index_of(name: &str) -> Option<u16> {
    (name.len() == 4).then(|| u16::from_str_radix(name, 16).ok()).flatten()
}

fn parameter_name<'a>(section: &str, of: &Section<'a>) -> Result<&'a str, String> {
    of.get("parametername").copied().ok_or_else(|| format!("[{section}] has no ParameterName"))
}

fn object(section: &str, name: String, of: &Section<'_>) -> Result<Object, String> {
    let kind = of.get("datatype").map_or(Some(0), |text| number(text)).and_then(|kind| u16::try_from(kind).ok());
    let kind = kind.ok_or_else(|| format!("[{section}]: its DataType is not a number"))?;
    let is_mappable = of.get("pdomapping").and_then(|text| number(text)) == Some(1);
    Ok(Object { name, kind: DataType(kind), is_mappable, default: of.get("defaultvalue").unwrap_or(&"").to_string() })
}

fn number(text: &str) -> Option<u32> {
    signed(text).and_then(|value| u32::try_from(value).ok())
}

fn signed(text: &str) -> Option<i64> {
    let text = text.trim().to_lowercase();
    match text.strip_prefix("0x") {
        Some(digits) => i64::from_str_radix(digits, 16).ok(),
        None => text.parse().ok(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FILE: &str = "[DeviceInfo]\nVendorNumber=0x6A1C\nProductName=lift\n\n[6064]\nParameterName=Position actual value\nObjectType=0x7\nDataType=0x0004\n\
        AccessType=ro\nPDOMapping=1\n; a record\n[1A00]\nParameterName=TPDO mapping\nObjectType=0x9\nSubNumber=3\n[1A00sub0]\nParameterName=Count\n\
        DataType=0x0005\nDefaultValue=2\n[1A00sub1]\nParameterName=First\nDataType=0x0007\nDefaultValue=0x60410010\n[1A00sub2]\nParameterName=Second\n\
        DataType=0x0007\nDefaultValue=0x60640020\n[1800]\nParameterName=TPDO\nObjectType=9\n[1800sub1]\nParameterName=COB-ID\nDataType=7\n\
        DefaultValue=$NODEID + 0x180\n[1003]\nParameterName=Errors\nObjectType=8\nDataType=7\nCompactSubObj=2\n[1003Name]\nNrOfEntries=1\n2=Oldest\n";

    #[test]
    fn objects_have_names_types_and_defaults() {
        let eds = Eds::read(FILE.as_bytes()).unwrap();
        let (of, object) = eds.named("position ACTUAL value").unwrap();
        assert_eq!((of, object.kind.bits(), object.kind.is_signed(), object.is_mappable), (Entry { index: 0x6064, sub: 0 }, Some(32), true, true));
        assert_eq!((eds.vendor, eds.product, eds.product_name.as_str()), (Some(0x6A1C), None, "lift"));
        assert_eq!(eds.named("TPDO.COB-ID").map(|(of, _)| eds.default_of(of, 5)), Ok(Some(0x185)));
        assert_eq!(eds.mapping(0x1A00, 5), [0x6041_0010, 0x6064_0020]);
        assert_eq!(eds.named("Errors.Oldest").unwrap().0, Entry { index: 0x1003, sub: 2 });
        assert_eq!(eds.named("Errors.Errors1").unwrap().0, Entry { index: 0x1003, sub: 1 });
        assert_eq!(eds.named("Actual position").unwrap_err(), "its EDS file contains no object 'Actual position'; there are 'Position actual value'");
    }

    #[test]
    fn what_is_no_data_sheet_is_refused_with_its_place() {
        let refused = |text: &str| Eds::read(text.as_bytes()).unwrap_err();
        assert_eq!(refused("[1000]\nParameterName=x\n"), "it is not an EDS file: it has no section [DeviceInfo]");
        assert_eq!(refused("[DeviceInfo]\n"), "it contains no objects");
        assert_eq!(refused("hello\n"), "line 1 is neither a section nor a value: 'hello'");
        assert_eq!(refused("[DeviceInfo]\n[1000]\nDataType=7\n"), "[1000] has no ParameterName");
        assert_eq!(refused("[DeviceInfo]\n[1000]\nParameterName=x\nDataType=long\n"), "[1000]: its DataType is not a number");
        assert!(Eds::read(b"[DeviceInfo]\n[1000]\nParameterName=Gr\xF6\xDFe\n").is_ok(), "Latin-1");
    }
}
