// SPDX-License-Identifier: Apache-2.0
//! Workspaces: panels arranged side by side and one above the other, supplied by a program or composed by a person in the studio. This
//! module defines their structure and checks it; the system checks that the items to which they refer exist.
mod check;

use crate::definition::Application;
use crate::value::Value;
use indexmap::IndexMap;
use serde::{Deserialize, Serialize};

pub use check::{BUTTONS_MAX, DEPTH_MAX, NAMES_MAX, PANELS_MAX, PLOTS_MAX, SECONDS_MAX, check_workspace};

/// A layout of panels.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Workspace {
    /// Name, unique among the workspaces of the system.
    pub name: String,
    /// Human-readable title; the name if empty.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub title: String,
    /// Purpose of the workspace.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub doc: String,
    /// True if the workspace is for operators: it has large buttons and values, and no part of it can be edited.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub operator: bool,
    pub layout: Region,
}

/// A part of a layout: a row or a column of regions, tabs, or one panel.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Region {
    /// Share of the row or column, relative to its neighbours; 1 if omitted.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub share: Option<f64>,
    /// Regions side by side.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub row: Vec<Region>,
    /// Regions arranged one above the other.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub column: Vec<Region>,
    /// Regions in the same place, of which only one is visible at a time.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub tabs: Vec<Region>,
    /// Content of the panel.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub panel: Option<PanelKind>,
    /// Heading of the panel; if empty, it is derived from the panel's content.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub title: String,
    /// SVVs and private cells of a plot, each at its full rate.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub names: Vec<String>,
    /// Time span of a plot, s, 0.1 to 600; 10 by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub seconds: Option<f64>,
    /// Rows of a table of values.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub values: Vec<ShownValue>,
    /// Physical device that a scene draws.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub device: Option<String>,
    /// Verb of a state diagram.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub verb: Option<String>,
    /// Buttons, each of which starts one action.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub buttons: Vec<Button>,
}

/// Content of a panel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum PanelKind {
    /// Values over time.
    Plot,
    /// A machine in 3-D.
    Scene,
    /// Current values, with units and limits.
    Values,
    /// State diagram of a verb and its instances.
    Verb,
    /// List of alarms.
    Alarms,
    /// Buttons that start and halt verbs.
    Buttons,
}

impl PanelKind {
    /// All kinds of panels.
    pub const ALL: [PanelKind; 6] = [PanelKind::Plot, PanelKind::Scene, PanelKind::Values, PanelKind::Verb, PanelKind::Alarms, PanelKind::Buttons];

    /// Returns the name of the panel kind as written in a file.
    pub fn word(self) -> &'static str {
        match self {
            PanelKind::Plot => "plot",
            PanelKind::Scene => "scene",
            PanelKind::Values => "values",
            PanelKind::Verb => "verb",
            PanelKind::Alarms => "alarms",
            PanelKind::Buttons => "buttons",
        }
    }
}

/// A value of a table: an SVV, a private cell or a channel.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct ShownValue {
    pub name: String,
    /// Human-readable label; the name if empty.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub label: String,
    /// Lower limit, in the unit of the value; values below it are highlighted.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub minimum: Option<f64>,
    /// Upper limit; values above it are highlighted.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub maximum: Option<f64>,
}

/// A button that starts a verb, and halts it while it runs.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Button {
    pub label: String,
    /// Verb to apply: an instance is created and started with these values. If it has no name, it is called `WORKSPACE.LABEL`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub start: Option<Application>,
    /// Instance to start instead, created by a program.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub instance: Option<String>,
    /// Start values of that instance: input parameter → value.
    #[serde(default, skip_serializing_if = "IndexMap::is_empty")]
    pub values: IndexMap<String, Value>,
}

impl Region {
    /// Returns the nested regions.
    pub fn inner(&self) -> impl Iterator<Item = &Region> {
        self.row.iter().chain(&self.column).chain(&self.tabs)
    }

    /// Visits all panels in order.
    pub fn panels<'a>(&'a self, visit: &mut impl FnMut(&'a Region, PanelKind)) {
        if let Some(kind) = self.panel {
            visit(self, kind);
        }
        self.inner().for_each(|region| region.panels(visit));
    }

    /// Returns the panel's name for messages: its heading, or else its content.
    pub fn called(&self) -> String {
        match (self.title.as_str(), self.panel) {
            ("", Some(kind)) => format!("panel '{}'", kind.word()),
            ("", None) => "a region".to_owned(),
            (title, _) => format!("panel '{title}'"),
        }
    }
}
