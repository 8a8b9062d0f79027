// SPDX-License-Identifier: Apache-2.0
//! Checks options against the declaration of a driver, and arguments against the declaration of a service.
use crate::error::DriverError;
use crate::option_word::{Kind, OptionWord};
use crate::options::GivenOptions;
use crate::ranges::{Outside, outside};
use crate::services::ServiceWord;
use serde_json::{Map, Value};

impl<'a> GivenOptions<'a> {
    /// Checks `options`, a table of names and values, against the declaration of the driver `kind`. A null option counts as omitted.
    ///
    /// # Errors
    /// Returns a [`DriverError::Option`] that names the option.
    pub fn check<'w>(kind: &'a str, options: &Value, words: impl Iterator<Item = &'w OptionWord> + Clone) -> Result<GivenOptions<'a>, DriverError> {
        let given = GivenOptions::check_known(kind, options, words.clone())?;
        match words.clone().find(|word| word.default.is_none() && given.value().get(word.name).is_none()) {
            Some(missing) => Err(given.wrong(missing.name, format!("it is missing; give {}: {}", asked_for(missing), missing.doc))),
            None => Ok(given),
        }
    }

    /// Checks like [`check`](Self::check), but allows any option to be omitted, because not all of them are known when searching for
    /// devices.
    pub(crate) fn check_known<'w>(
        kind: &'a str,
        options: &Value,
        words: impl Iterator<Item = &'w OptionWord> + Clone,
    ) -> Result<GivenOptions<'a>, DriverError> {
        let wrong = |option: &str, problem: String| Err(DriverError::Option { kind: kind.into(), option: option.into(), problem });
        let given: Map<String, Value> = match options {
            Value::Null => Map::new(),
            Value::Object(given) => given.iter().filter(|(_, value)| !value.is_null()).map(|(name, value)| (name.clone(), value.clone())).collect(),
            other => return wrong("", format!("options must be a table of names and values, not {other}")),
        };
        for (name, value) in &given {
            let Some(word) = words.clone().find(|word| word.name == name) else {
                let problem = hints::did_you_mean(name, words.clone().map(|word| word.name));
                return wrong(name, format!("the driver has no such option; {problem}").trim_end_matches("; ").to_owned());
            };
            if !is_of(word.kind, value) {
                return wrong(name, format!("it must be {}, not {value}", asked_for(word)));
            }
            if let Some(Outside { path, problem }) = words.clone().filter(|word| word.name == name).find_map(|word| outside("", word, value)) {
                return wrong(&path, problem);
            }
        }
        Ok(GivenOptions::checked(kind, Value::Object(given)))
    }
}

/// Checks the arguments of a service against its declaration.
///
/// # Errors
/// Returns [`DriverError::Service`] if the driver has no such service, or a [`DriverError::Argument`] that names the argument.
pub fn check_service(kind: &str, services: &'static [ServiceWord], name: &str, arguments: &Value) -> Result<Value, DriverError> {
    let Some(word) = services.iter().find(|word| word.name == name) else {
        let problem = match services {
            [] => "it has none".to_owned(),
            _ => hints::did_you_mean(name, services.iter().map(|word| word.name)),
        };
        return Err(DriverError::Service { kind: kind.into(), service: name.into(), problem });
    };
    let given = GivenOptions::check(kind, arguments, word.arguments.iter()).map_err(|why| match why {
        DriverError::Option { kind, option, problem } => {
            let problem = problem.replace("the driver has no such option", "the service has no such argument");
            DriverError::Argument { kind, service: name.to_owned(), argument: option, problem }
        }
        other => other,
    })?;
    Ok(given.value().clone())
}

fn is_of(kind: Kind, value: &Value) -> bool {
    match kind {
        Kind::Text => value.is_string(),
        Kind::Number => value.is_number(),
        Kind::Whole => value.is_i64() || value.is_u64(),
        Kind::Bool => value.is_boolean(),
        Kind::List => value.is_array(),
        Kind::Table => value.is_object(),
    }
}

fn asked_for(word: &OptionWord) -> String {
    let what = match word.kind {
        Kind::Text => "a string",
        Kind::Number => "a number",
        Kind::Whole => "a whole number",
        Kind::Bool => "true or false",
        Kind::List => "a list",
        Kind::Table => "a table of names and values",
    };
    if word.unit.is_empty() { what.to_owned() } else { format!("{what} in {}", word.unit) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    const WORDS: [OptionWord; 2] = [
        OptionWord::needed("path", Kind::Text, "the file of the model"),
        OptionWord::with_default("timestep", Kind::Number, "the model's own", "its step").unit("s"),
    ];

    #[derive(Debug, Default, serde::Deserialize)]
    #[serde(default)]
    struct Whole {
        servos: std::collections::BTreeMap<String, Servo>,
        axes: Vec<Axis>,
    }

    #[derive(Debug, serde::Deserialize)]
    #[serde(deny_unknown_fields)]
    struct Servo {
        #[allow(dead_code)]
        id: u8,
        #[allow(dead_code)]
        min: Option<f64>,
    }

    #[derive(Debug, serde::Deserialize)]
    struct CommonOptions {
        #[allow(dead_code)]
        name: String,
        #[allow(dead_code)]
        counts: f64,
    }

    #[derive(Debug, serde::Deserialize)]
    struct Axis {
        #[serde(flatten)]
        #[allow(dead_code)]
        shared: CommonOptions,
        #[allow(dead_code)]
        node: u8,
    }

    #[test]
    fn an_error_within_a_nested_option_has_its_path() {
        let option = |options: Value| match GivenOptions::checked("arm", options).read::<Whole>() {
            Err(DriverError::Option { option, .. }) => option,
            other => panic!("refused: {other:?}"),
        };
        let shoulder = json!({ "id": 1 });
        for (elbow, path) in [
            (json!({ "id": "x" }), "servos.elbow.id"),
            (json!({ "id": 300 }), "servos.elbow.id"),
            (json!({ "id": -1, "min": 0.5 }), "servos.elbow.id"),
            (json!({ "id": 2, "min": "low" }), "servos.elbow.min"),
            (json!({ "id": 2, "mn": 1 }), "servos.elbow.mn"),
            (json!({ "min": 1 }), "servos.elbow.id"),
            (json!(2), "servos.elbow"),
        ] {
            assert_eq!(option(json!({ "servos": { "shoulder": shoulder, "elbow": elbow } })), path, "{elbow}");
        }
        let good = json!({ "name": "x", "node": 1, "counts": 1.0 });
        for (lift, path) in [
            (json!({ "name": "lift", "node": 2, "counts": "many" }), "axes.lift.counts"),
            (json!({ "name": "lift", "node": 2000, "counts": 1 }), "axes.lift.node"),
            (json!({ "name": "lift", "node": 2 }), "axes.lift.counts"),
            (json!({ "name": "lift", "counts": 2 }), "axes.lift.node"),
            (json!({ "node": 2, "counts": 2 }), "axes[1].name"),
        ] {
            assert_eq!(option(json!({ "axes": [good, lift] })), path, "{lift}");
        }
    }

    fn refused(options: Value) -> String {
        GivenOptions::check("arm", &options, WORDS.iter()).err().expect("refused").to_string()
    }

    #[test]
    fn an_option_is_known_of_its_kind_and_there() {
        assert!(GivenOptions::check("arm", &json!({ "path": "a", "timestep": 1, "gone": null }), WORDS.iter()).is_ok());
        assert_eq!(refused(json!({ "pth": "a" })), "driver 'arm': option 'pth': the driver has no such option; did you mean 'path'?");
        assert_eq!(refused(json!({})), "driver 'arm': option 'path': it is missing; give a string: the file of the model");
        assert_eq!(refused(json!({ "path": "a", "timestep": "1" })), "driver 'arm': option 'timestep': it must be a number in s, not \"1\"");
        assert!(refused(json!([1])).contains("a table of names and values, not [1]"));
    }
}
