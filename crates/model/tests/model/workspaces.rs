// SPDX-License-Identifier: Apache-2.0
//! The form of workspaces: refusals, each with its remedy.
use model::refusal::Class;
use model::workspace::{Workspace, check_workspace};
use serde_json::{Value as Json, json};

fn of(layout: Json) -> Workspace {
    serde_json::from_value(json!({ "name": "cell", "layout": layout })).expect("of the right form")
}

/// Returns the errors of a layout: the message and remedy of each.
fn wrong(layout: Json) -> Vec<String> {
    let found = check_workspace(&of(layout));
    assert!(found.iter().all(|refusal| refusal.class == Class::DefinitionError && !refusal.remedy.is_empty()), "{found:?}");
    found.into_iter().map(|refusal| refusal.message).collect()
}

#[test]
fn a_layout_with_every_panel_is_right_and_is_written_as_it_was_read() {
    let layout = json!({ "row": [
        { "share": 2.0, "column": [{ "panel": "plot", "title": "Joint", "names": ["a", "b"], "seconds": 5.0 }, { "panel": "scene", "device": "arm" }] },
        { "column": [
            { "panel": "values", "values": [{ "name": "level", "label": "Level", "minimum": 0.0, "maximum": 2.0 }] },
            { "panel": "verb", "verb": "fill" },
            { "tabs": [{ "panel": "alarms" }, { "panel": "plot", "names": ["c"] }] },
            { "panel": "buttons", "buttons": [{ "label": "Fill", "instance": "fill#1", "values": { "to": 2.0 } }] },
        ] },
    ] });
    assert_eq!(wrong(layout.clone()), Vec::<String>::new());
    let written = serde_json::to_value(of(layout.clone())).expect("it can be written");
    assert_eq!(written, json!({ "name": "cell", "layout": layout }));
}

#[test]
fn each_fault_names_its_panel() {
    let cases = [
        (json!({}), "a region: it has neither a panel nor regions"),
        (json!({ "panel": "alarms", "row": [{ "panel": "alarms" }] }), "panel 'alarms': it is more than one of row, column, tabs and panel"),
        (json!({ "panel": "alarms", "names": ["a"] }), "panel 'alarms': it has 'names', which only a 'plot' panel has"),
        (json!({ "panel": "plot", "title": "Joint" }), "panel 'Joint': it cannot have 0 'names'"),
        (json!({ "panel": "plot", "names": ["a"], "seconds": 0.0 }), "panel 'plot': its time span cannot be 0 s"),
        (json!({ "panel": "alarms", "share": 0.0 }), "panel 'alarms': its share cannot be 0"),
        (json!({ "panel": "values", "values": [{ "name": "a", "minimum": 2.0, "maximum": 1.0 }] }), "panel 'values': the limits of 'a' cannot be 2 and 1"),
        (json!({ "tabs": [{ "row": [{ "panel": "alarms" }] }] }), "a region: it is a tab, but not a panel"),
        (json!({ "panel": "scene" }), "panel 'scene': it names no 'device'"),
        (json!({ "panel": "verb" }), "panel 'verb': it names no 'verb'"),
        (json!({ "panel": "buttons" }), "panel 'buttons': it cannot have 0 buttons"),
        (json!({ "panel": "buttons", "buttons": [{ "label": "Go" }] }), "panel 'buttons': button 'Go' starts nothing"),
        (
            json!({ "panel": "buttons", "buttons": [{ "label": "Go", "instance": "a" }, { "label": "Go", "instance": "b" }] }),
            "panel 'buttons': there are two buttons 'Go'",
        ),
    ];
    for (layout, message) in cases {
        assert_eq!(wrong(layout), [format!("workspace 'cell', {message}")]);
    }
}

#[test]
fn it_is_bounded() {
    let nested = (0..8).fold(json!({ "panel": "alarms" }), |inner, _| json!({ "row": [inner] }));
    assert_eq!(wrong(nested), ["workspace 'cell', panel 'alarms': it is nested 9 rows and columns deep"]);
    let many = json!({ "row": (0..65).map(|_| json!({ "panel": "alarms" })).collect::<Vec<_>>() });
    assert_eq!(wrong(many), ["workspace 'cell' cannot have 65 panels"]);
    let unknown = serde_json::from_value::<Workspace>(json!({ "name": "cell", "layout": { "panel": "clock" } })).expect_err("no such panel");
    assert!(unknown.to_string().contains("expected one of `plot`, `scene`"), "{unknown}");
}
