// SPDX-License-Identifier: Apache-2.0
//! Format of a definition file: graphs, verbs, device types and compositions by name, and items that exist only in files.
//!
//! A definition in a file may omit its name, because the key is its name. A block name without a dot refers to a graph in the same file.
use crate::compose::Step;
use crate::definition::written::Span;
use crate::definition::{DeviceType, Graph, Verb};
use crate::value::Value;
use indexmap::IndexMap;
use serde::Deserialize;

/// Value of the field `format`.
pub const FORMAT: &str = "opengpac-definitions";

/// Version of the format.
pub const VERSION: u32 = 1;

/// A file of definitions.
#[derive(Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct File {
    /// Format of the file: `opengpac-definitions`.
    pub format: String,
    pub version: u32,
    /// Human-readable description.
    #[serde(default)]
    pub description: String,
    /// Code modules that contain the blocks: name → file, relative to the definition file.
    #[serde(default)]
    pub modules: IndexMap<String, String>,
    #[serde(default)]
    pub graphs: IndexMap<String, DrawnDefinition<Graph>>,
    #[serde(default)]
    pub verbs: IndexMap<String, DrawnVerb>,
    #[serde(default)]
    pub device_types: IndexMap<String, DrawnDefinition<DeviceType>>,
    #[serde(default)]
    pub compositions: IndexMap<String, WrittenComposition>,
}

/// Positions of boxes in an editor, preserved unchanged.
pub type Layout = IndexMap<String, Value>;

/// A definition with its layout.
#[derive(Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct DrawnDefinition<T> {
    #[serde(flatten)]
    pub definition: T,
    #[serde(default)]
    pub layout: Layout,
}

/// A verb with its layout.
#[derive(Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct DrawnVerb {
    #[serde(flatten)]
    pub definition: Verb,
    /// Time limit with a unit, with the same meaning as `ending_limit_ns`.
    #[serde(default)]
    pub ending_limit: Option<Span>,
    #[serde(default)]
    pub layout: Layout,
}

/// A verb composed of verbs in the same file.
#[derive(Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct WrittenComposition {
    #[serde(default)]
    pub name: String,
    #[serde(default)]
    pub doc: String,
    /// Label → name of a verb or composition.
    pub parts: IndexMap<String, String>,
    #[serde(default)]
    pub transitions: Vec<Step>,
    #[serde(default)]
    pub initial: Option<String>,
    /// `part.name` → name in the composed verb.
    #[serde(default)]
    pub rename: IndexMap<String, String>,
    /// `part.input` → fixed value of the input.
    #[serde(default)]
    pub preset: IndexMap<String, Value>,
    /// Labels of shared blocks: all parts use the same instance.
    #[serde(default)]
    pub share: Vec<String>,
    /// True if the initial lists of all parts are merged into one.
    #[serde(default)]
    pub together: bool,
    #[serde(default)]
    pub until: crate::compose::Until,
    #[serde(default)]
    pub layout: Layout,
}

/// Returns the JSON Schema of a file. The key of a definition is its name; unknown properties are refused.
#[cfg(feature = "schema")]
pub fn schema() -> serde_json::Value {
    use serde_json::json;
    let generator = schemars::generate::SchemaSettings::draft2020_12().into_generator();
    let mut file = generator.into_root_schema_for::<File>().to_value();
    file["properties"]["format"] = json!({ "const": FORMAT });
    file["properties"]["version"] = json!({ "const": VERSION });
    file["additionalProperties"] = json!(false);
    // Nested graphs are drawn too.
    let layout = file["$defs"]["DrawnDefinition"]["properties"]["layout"].clone();
    file["$defs"]["Graph"]["properties"]["layout"] = layout;
    for (name, schema) in file["$defs"].as_object_mut().into_iter().flatten() {
        if let Some(required) = schema.get_mut("required").and_then(serde_json::Value::as_array_mut).filter(|_| name.starts_with("Drawn")) {
            required.retain(|property| property != "name");
        }
        close(schema);
    }
    file
}

/// Forbids additional properties of objects that declare their properties.
#[cfg(feature = "schema")]
fn close(schema: &mut serde_json::Value) {
    let Some(of) = schema.as_object_mut() else { return };
    if of.get("properties").is_some_and(serde_json::Value::is_object) && !of.contains_key("additionalProperties") {
        of.insert("additionalProperties".to_owned(), false.into());
    }
    for word in ["anyOf", "oneOf"] {
        of.get_mut(word).and_then(serde_json::Value::as_array_mut).into_iter().flatten().for_each(close);
    }
}
