// SPDX-License-Identifier: Apache-2.0
//! Numbers with units: `"20 ms"`, `"90 deg"`, `"0.5 rad/s"`, `"10 N.m"`, `"30 %"`.
//!
//! Angle counts as a separate dimension, so that `rad/s` and `Hz` are different units.
use crate::refusal::{Class, Refusal};
use std::f64::consts::PI;

/// Exponents of m, kg, s, A, K, rad, counts, pixels.
type Dimension = [i8; 8];

/// A unit of measurement, equal to `multiply / divide` times the coherent SI unit of its dimension. The two factors are kept separate so
/// that 20 ms is computed as 20 / 1000.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Unit {
    multiply: f64,
    divide: f64,
    dimension: Dimension,
}

const ONE: Unit = Unit { multiply: 1.0, divide: 1.0, dimension: [0; 8] };

/// All unit symbols: symbol, the two factors, dimension, and true if it accepts prefixes.
const SYMBOLS: &[(&str, f64, f64, Dimension, bool)] = &[
    ("m", 1.0, 1.0, [1, 0, 0, 0, 0, 0, 0, 0], true),
    ("g", 1.0, 1000.0, [0, 1, 0, 0, 0, 0, 0, 0], true),
    ("s", 1.0, 1.0, [0, 0, 1, 0, 0, 0, 0, 0], true),
    ("A", 1.0, 1.0, [0, 0, 0, 1, 0, 0, 0, 0], true),
    ("K", 1.0, 1.0, [0, 0, 0, 0, 1, 0, 0, 0], true),
    ("rad", 1.0, 1.0, [0, 0, 0, 0, 0, 1, 0, 0], true),
    ("deg", PI, 180.0, [0, 0, 0, 0, 0, 1, 0, 0], false),
    ("°", PI, 180.0, [0, 0, 0, 0, 0, 1, 0, 0], false),
    ("rev", std::f64::consts::TAU, 1.0, [0, 0, 0, 0, 0, 1, 0, 0], false),
    ("rpm", std::f64::consts::TAU, 60.0, [0, 0, -1, 0, 0, 1, 0, 0], false),
    ("Hz", 1.0, 1.0, [0, 0, -1, 0, 0, 0, 0, 0], true),
    ("N", 1.0, 1.0, [1, 1, -2, 0, 0, 0, 0, 0], true),
    ("J", 1.0, 1.0, [2, 1, -2, 0, 0, 0, 0, 0], true),
    ("W", 1.0, 1.0, [2, 1, -3, 0, 0, 0, 0, 0], true),
    ("Pa", 1.0, 1.0, [-1, 1, -2, 0, 0, 0, 0, 0], true),
    ("bar", 100_000.0, 1.0, [-1, 1, -2, 0, 0, 0, 0, 0], true),
    ("V", 1.0, 1.0, [2, 1, -3, -1, 0, 0, 0, 0], true),
    ("Ohm", 1.0, 1.0, [2, 1, -3, -2, 0, 0, 0, 0], true),
    ("Ω", 1.0, 1.0, [2, 1, -3, -2, 0, 0, 0, 0], true),
    ("min", 60.0, 1.0, [0, 0, 1, 0, 0, 0, 0, 0], false),
    ("h", 3600.0, 1.0, [0, 0, 1, 0, 0, 0, 0, 0], false),
    ("C", 1.0, 1.0, [0, 0, 1, 1, 0, 0, 0, 0], true),
    ("F", 1.0, 1.0, [-2, -1, 4, 2, 0, 0, 0, 0], true),
    ("H", 1.0, 1.0, [2, 1, -2, -2, 0, 0, 0, 0], true),
    ("T", 1.0, 1.0, [0, 1, -2, -1, 0, 0, 0, 0], true),
    ("Wb", 1.0, 1.0, [2, 1, -2, -1, 0, 0, 0, 0], true),
    ("l", 1.0, 1000.0, [3, 0, 0, 0, 0, 0, 0, 0], true),
    ("L", 1.0, 1000.0, [3, 0, 0, 0, 0, 0, 0, 0], true),
    ("counts", 1.0, 1.0, [0, 0, 0, 0, 0, 0, 1, 0], false),
    ("count", 1.0, 1.0, [0, 0, 0, 0, 0, 0, 1, 0], false),
    ("px", 1.0, 1.0, [0, 0, 0, 0, 0, 0, 0, 1], false),
    ("%", 1.0, 100.0, [0; 8], false),
    ("1", 1.0, 1.0, [0; 8], false),
];

const PREFIXES: &[(&str, f64, f64)] = &[
    ("n", 1.0, 1e9),
    ("u", 1.0, 1e6),
    ("µ", 1.0, 1e6),
    ("μ", 1.0, 1e6),
    ("m", 1.0, 1e3),
    ("c", 1.0, 1e2),
    ("d", 1.0, 1e1),
    ("k", 1e3, 1.0),
    ("M", 1e6, 1.0),
    ("G", 1e9, 1.0),
];

/// Returns true if ports with these units may be bound to each other. An empty unit is unknown and compatible with any unit; two known
/// units must be the same, in any spelling (`N.m`, `N*m`). `rad|m` is compatible with both `rad` and `m`, for a port of a block that
/// supports revolute and prismatic joints.
pub fn units_agree(a: &str, b: &str) -> bool {
    a.is_empty() || b.is_empty() || a.split('|').any(|a| b.split('|').any(|b| is_same_unit(a, b)))
}

/// Returns true if two units measure the same kind of quantity, such as `N.m` and `kN.m`.
pub(crate) fn is_same_kind(a: &str, b: &str) -> bool {
    matches!((unit(a), unit(b)), (Some(a), Some(b)) if a.dimension == b.dimension)
}

fn is_same_unit(a: &str, b: &str) -> bool {
    if a == b {
        return true;
    }
    match (unit(a), unit(b)) {
        (Some(a), Some(b)) => a.dimension == b.dimension && a.multiply * b.divide == b.multiply * a.divide,
        _ => false,
    }
}

/// Refuses an unknown unit, because two spellings of it would never match, and a quantity in that unit could not be parsed. An empty unit
/// means that the unit is not known, and is allowed.
///
/// # Errors
/// `UnitMismatch` with the unit that was probably intended: `N.m` for `Nm`.
pub fn check_unit(text: &str) -> Result<(), Refusal> {
    if text.contains(['[', '(', ')', ']']) {
        let message = format!("the range after the unit in '{}' cannot be read", text.escape_debug());
        return Err(Refusal::new(Class::UnitMismatch, message).remedy("write, for example, 'rad/s (0, 10]', the lower end first"));
    }
    let unknown = text.split('|').filter(|_| !text.is_empty()).flat_map(words).find(|word| word_unit(word).is_none());
    match unknown {
        None => Ok(()),
        Some("") => Err(Refusal::new(Class::UnitMismatch, format!("the unit '{text}' cannot be read")).remedy("write, for example, 'N.m/rad'")),
        Some(word) => Err(Refusal::new(Class::UnitMismatch, format!("there is no unit '{}'", word.escape_debug())).remedy(meant(word))),
    }
}

/// Returns the unit of a product of values in these units: `N.m` for `rad` times `N.m/rad`.
pub fn product<'a>(units: impl IntoIterator<Item = &'a str>) -> String {
    let (mut above, mut below): (Vec<&str>, Vec<&str>) = (Vec::new(), Vec::new());
    for unit in units {
        for (at, part) in unit.split('/').enumerate() {
            for word in part.split(SEPARATORS).filter(|word| !word.is_empty() && *word != "1") {
                let (to, against) = if at == 0 { (&mut above, &mut below) } else { (&mut below, &mut above) };
                match against.iter().position(|other| *other == word) {
                    Some(other) => drop(against.remove(other)),
                    None => to.push(word),
                }
            }
        }
    }
    let below: String = below.iter().map(|word| format!("/{word}")).collect();
    if above.is_empty() { format!("1{below}") } else { format!("{}{below}", above.join(".")) }
}

/// Returns the unit in the text of a quantity; `None` for a plain number.
pub fn unit_of(text: &str) -> Option<&str> {
    split(text).ok().map(|(_, unit)| unit).filter(|unit| !unit.is_empty())
}

/// Returns the most likely meaning of an unknown word in a unit: two known units with the dot omitted, or else the closest spelling.
fn meant(word: &str) -> String {
    let (symbol, _) = exponent(word).unwrap_or((word, 1));
    let cuts = (1..symbol.len()).filter(|at| symbol.is_char_boundary(*at));
    let parts = cuts.map(|at| word.split_at(at)).find(|(a, b)| symbol_unit(a).is_some() && word_unit(b).is_some());
    parts.map_or_else(|| hints::did_you_mean(symbol, SYMBOLS.iter().map(|s| s.0)), |(a, b)| format!("did you mean '{a}.{b}'?"))
}

/// Returns the number that `text` denotes in the unit `target` (`"90 deg"` in `rad`: 1.57…). A number without a unit is returned
/// unchanged. An empty target is unknown and yields the SI value. If the target has alternatives, `rad|m`, the first one with the same
/// dimension is used.
///
/// # Errors
/// `ValueRefused` if the text is not a number or its unit is unknown. `UnitMismatch` if the dimension differs.
pub fn number_in(text: &str, target: &str) -> Result<f64, Refusal> {
    let (number, symbol) = split(text)?;
    if symbol.is_empty() || symbol == target {
        return Ok(number);
    }
    let Some(given) = unit(symbol) else {
        return Err(Refusal::new(Class::ValueRefused, format!("'{text}' has the unit '{symbol}', which is not known"))
            .remedy(words(symbol).find(|word| word_unit(word).is_none()).map_or_else(String::new, meant)));
    };
    let wanted = if target.is_empty() {
        Some(Unit { dimension: given.dimension, ..ONE })
    } else {
        target.split('|').filter_map(unit).find(|unit| unit.dimension == given.dimension)
    };
    match wanted {
        Some(wanted) => Ok(number * given.multiply * wanted.divide / (given.divide * wanted.multiply)),
        _ => Err(Refusal::new(Class::UnitMismatch, format!("cannot convert '{text}' to {target}: the dimensions differ"))
            .remedy(format!("give a number or a quantity in {target}"))),
    }
}

/// Returns a duration in whole nanoseconds: `"20 ms"`, `"1.5 s"`, `"2 min"`, or the period of a frequency, `"1 kHz"`. `what` names the
/// value in messages.
///
/// # Errors
/// Fails with `ValueRefused` if the unit is missing or the text is not a number, with `OutOfRange` beyond 292 years, and with `UnitMismatch` if the quantity is not a time.
pub fn duration_ns(text: &str, what: &str) -> Result<i64, Refusal> {
    let refused = |class, is: &str| Refusal::new(class, format!("{what} '{text}' {is}")).remedy("write, for example, '20 ms'");
    let (_, symbol) = split(text).map_err(|_| refused(Class::ValueRefused, "is not a quantity"))?;
    if symbol.is_empty() {
        return Err(refused(Class::ValueRefused, "has no unit").remedy("write, for example, '20 ms', or a number of seconds"));
    }
    let period = || number_in(text, "Hz").ok().filter(|hz| *hz > 0.0).map(|hz| 1e9 / hz);
    let ns = number_in(text, "ns").ok().or_else(period).ok_or_else(|| refused(Class::UnitMismatch, "is not a time"))?;
    if ns.abs() < i64::MAX as f64 {
        Ok(ns.round() as i64)
    } else {
        Err(refused(Class::OutOfRange, "is out of range").remedy("give a time of less than 292 years"))
    }
}

/// Formats nanoseconds in a human-readable unit: `1.5 ms`.
pub fn duration_text(ns: u64) -> String {
    let (scale, symbol) = match ns {
        0 => (1.0, "s"),
        n if n % 1_000_000 == 0 && n < 1_000_000_000 => (1e6, "ms"),
        n if n >= 1_000_000_000 => (1e9, "s"),
        n if n >= 1_000_000 => (1e6, "ms"),
        n if n >= 1_000 => (1e3, "us"),
        _ => (1.0, "ns"),
    };
    format!("{} {symbol}", ns as f64 / scale)
}

/// Splits a quantity into the number and the text of the unit.
fn split(text: &str) -> Result<(f64, &str), Refusal> {
    let text = text.trim();
    let is_number = |end: &usize| text.is_char_boundary(*end) && text[..*end].trim_end().parse::<f64>().is_ok_and(f64::is_finite);
    let longest = text.char_indices().take_while(|(_, c)| c.is_ascii_digit() || "+-.eE ".contains(*c)).last();
    let end = longest.map_or(0, |(at, c)| at + c.len_utf8());
    match (1..=end).rev().find(is_number) {
        // The leading digits alone would be a different number.
        Some(end) if text[..end].ends_with(|c: char| c.is_ascii_digit()) && text[end..].starts_with(|c: char| c.is_ascii_digit()) => {
            Err(Refusal::new(Class::ValueRefused, format!("the number in '{text}' is beyond the range of a double, 1.8e308")).remedy("give a smaller number"))
        }
        Some(end) => Ok((text[..end].trim_end().parse().expect("it was parsed a line above"), text[end..].trim())),
        None => {
            Err(Refusal::new(Class::ValueRefused, format!("'{text}' is not a number with a unit"))
                .remedy("write a number, or, for example, '20 ms' or '90 deg'"))
        }
    }
}

/// Separators between factors.
const SEPARATORS: [char; 4] = ['.', '*', '·', ' '];

/// Returns the factors of a unit.
fn words(text: &str) -> impl Iterator<Item = &str> {
    text.split('/').flat_map(|part| part.split(SEPARATORS))
}

fn word_unit(word: &str) -> Option<Unit> {
    let (symbol, _) = exponent(word)?;
    symbol_unit(symbol)
}

/// Parses a unit such as `kg.m^2/s`, `N*m`, `m/s2`, `1/s`. All factors after a slash are in the denominator.
fn unit(text: &str) -> Option<Unit> {
    let mut total = ONE;
    for (at, part) in text.split('/').enumerate() {
        for word in part.split(SEPARATORS).filter(|word| !word.is_empty()) {
            let (symbol, exponent) = exponent(word)?;
            let unit = symbol_unit(symbol)?;
            let exponent = if at == 0 { exponent } else { -exponent };
            for _ in 0..exponent.unsigned_abs() {
                let (multiply, divide) = if exponent > 0 { (unit.multiply, unit.divide) } else { (unit.divide, unit.multiply) };
                total.multiply *= multiply;
                total.divide *= divide;
            }
            for (sum, one) in total.dimension.iter_mut().zip(unit.dimension) {
                *sum = sum.checked_add(one.checked_mul(exponent)?)?;
            }
        }
    }
    Some(total)
}

fn exponent(word: &str) -> Option<(&str, i8)> {
    if word == "1" {
        return Some((word, 1));
    }
    let word = word.strip_suffix('²').map_or((word, None), |w| (w, Some(2)));
    if let (symbol, Some(exponent)) = word {
        return Some((symbol, exponent));
    }
    let digits = word.0.trim_end_matches(|c: char| c.is_ascii_digit() || c == '-').len();
    let (symbol, exponent) = word.0.split_at(digits);
    let symbol = symbol.trim_end_matches('^');
    let exponent = if exponent.is_empty() { 1 } else { exponent.parse().ok()? };
    (-9..=9).contains(&exponent).then_some((symbol, exponent))
}

fn symbol_unit(symbol: &str) -> Option<Unit> {
    let known = |name: &str| SYMBOLS.iter().find(|s| s.0 == name);
    if let Some((_, multiply, divide, dimension, _)) = known(symbol) {
        return Some(Unit { multiply: *multiply, divide: *divide, dimension: *dimension });
    }
    PREFIXES.iter().find_map(|(prefix, up, down)| {
        let (_, multiply, divide, dimension, _) = known(symbol.strip_prefix(prefix)?).filter(|s| s.4)?;
        Some(Unit { multiply: multiply * up, divide: divide * down, dimension: *dimension })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantities_become_si_numbers() {
        assert_eq!(number_in("20 ms", "s").unwrap(), 0.02);
        assert_eq!(number_in("90 deg", "rad").unwrap(), std::f64::consts::FRAC_PI_2);
        assert_eq!(number_in("0.5 rad/s", "rad/s").unwrap(), 0.5);
        assert_eq!(number_in("10 N.m", "N*m").unwrap(), 10.0);
        assert_eq!(number_in("30 %", "").unwrap(), 0.3);
        assert_eq!(number_in("180deg/s^2", "rad/s2").unwrap(), std::f64::consts::PI);
        assert!((number_in("60 rpm", "rad/s").unwrap() - std::f64::consts::TAU).abs() < 1e-14);
        assert_eq!(number_in("1e-3 km", "m").unwrap(), 1.0);
        assert_eq!(number_in("1.5", "rad").unwrap(), 1.5);
        assert_eq!(number_in("7 counts", "counts").unwrap(), 7.0);
    }

    #[test]
    fn other_dimensions_are_refused() {
        assert_eq!(number_in("20 ms", "rad").unwrap_err().class, Class::UnitMismatch);
        assert_eq!(number_in("5 Hz", "rad/s").unwrap_err().class, Class::UnitMismatch);
        assert_eq!(number_in("5 parsec", "m").unwrap_err().class, Class::ValueRefused);
        assert_eq!(number_in("fast", "m").unwrap_err().class, Class::ValueRefused);
        assert_eq!(number_in("", "m").unwrap_err().class, Class::ValueRefused);
    }

    #[test]
    fn durations_are_whole_nanoseconds() {
        assert_eq!(duration_ns("20 ms", "it").unwrap(), 20_000_000);
        assert_eq!(duration_ns("0.1 s", "it").unwrap(), 100_000_000);
        assert_eq!(duration_ns("2 min", "it").unwrap(), 120_000_000_000);
        assert_eq!(duration_ns("250 us", "it").unwrap(), 250_000);
        assert_eq!(duration_ns("1 kHz", "it").unwrap(), 1_000_000);
        assert_eq!(duration_ns("-1 kHz", "it").unwrap_err().class, Class::UnitMismatch);
        assert_eq!(duration_ns("5", "it").unwrap_err().class, Class::ValueRefused);
        assert_eq!(duration_ns("5 m", "it").unwrap_err().class, Class::UnitMismatch);
        assert_eq!(duration_ns("1e20 s", "it").unwrap_err().class, Class::OutOfRange);
        assert_eq!(duration_text(1_500_000), "1.5 ms");
        assert_eq!(duration_text(20_000_000), "20 ms");
    }

    #[test]
    fn an_unknown_unit_is_refused_with_what_was_meant() {
        let refusal = |unit: &str| check_unit(unit).map_or_else(|refusal| refusal.to_string(), |()| String::new());
        for known in ["", "N.m", "N*m/rad", "rad|m", "1/s", "1", "m/s2", "kg.m^2", "%", "counts/rad", "l/min", "N.m/rad/s|N/m/s", "µm"] {
            assert_eq!(refusal(known), "", "{known}");
        }
        assert_eq!(refusal("Nm"), "there is no unit 'Nm'; did you mean 'N.m'?");
        assert_eq!(refusal("Nm/rad"), "there is no unit 'Nm'; did you mean 'N.m'?");
        assert_eq!(refusal("kgm2"), "there is no unit 'kgm2'; did you mean 'kg.m2'?");
        assert_eq!(refusal("rad|Rad"), "there is no unit 'Rad'; did you mean 'rad'?");
        assert!(refusal("furlong").starts_with("there is no unit 'furlong'"));
        assert!(refusal("N..m").starts_with("the unit 'N..m' cannot be read") && refusal("m/").starts_with("the unit 'm/' cannot be read"));
        assert_eq!(number_in("5 Nm", "N.m").unwrap_err().to_string(), "'5 Nm' has the unit 'Nm', which is not known; did you mean 'N.m'?");
    }

    #[test]
    fn a_number_beyond_all_numbers_is_not_read_by_its_first_digits() {
        for text in ["1e400 deg", "1e400", "-1e309 m", &format!("{} m", "9".repeat(400))] {
            let said = number_in(text, "").unwrap_err().to_string();
            assert!(said.starts_with(&format!("the number in '{text}' is beyond the range of a double, 1.8e308")), "{said}");
        }
        assert_eq!(number_in("1e-400 m", "m").expect("it is 0"), 0.0);
    }

    #[test]
    fn products_of_units() {
        assert_eq!(product(["rad", "N.m/rad"]), "N.m");
        assert_eq!(product(["rad/s", "N.m/rad"]), "N.m/s");
        assert_eq!(product(["m", "1"]), "m");
        assert_eq!(product(["s", "1/s"]), "1");
        assert_eq!(product(["1/s", "1"]), "1/s");
        assert!(units_agree(&product(["rad/s", "N.m.s/rad"]), "N*m"));
        assert_eq!((unit_of("2 N.m/rad"), unit_of("3"), unit_of("much")), (Some("N.m/rad"), None, None));
    }

    #[test]
    fn units_agree_however_they_are_written() {
        assert!(units_agree("N.m", "N*m") && units_agree("", "rad") && units_agree("m/s^2", "m/s2"));
        assert!(units_agree("rad|m", "m") && units_agree("rad", "rad|m") && units_agree("rad/s|m/s", "m/s|rad/s") && !units_agree("rad|m", "N"));
        assert_eq!(number_in("5 mm", "rad|m").unwrap(), 0.005);
        assert_eq!(number_in("5 N", "rad|m").unwrap_err().class, Class::UnitMismatch);
        assert!(!units_agree("deg", "rad") && !units_agree("rad/s", "Hz") && !units_agree("counts", "rad"));
    }
}
