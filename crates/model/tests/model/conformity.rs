// SPDX-License-Identifier: Apache-2.0
//! Ranges of input parameters and requirements of verbs: names are checked at definition, values before a start.
use crate::common::*;
use indexmap::IndexMap;
use model::configuration::Configuration;
use model::conformity::{asked, settle, unmet};
use model::plan::Plan;
use model::refusal::{Class, Refusals};
use model::value::Value;
use serde_json::json;

/// Returns the cell with ranges and a home in its joints; the second is slower and prismatic.
fn jointed() -> Configuration {
    let mut cell = cell();
    let more = json!({"position_min": {"default": -3.0, "unit": "rad"}, "position_max": {"default": 3.0, "unit": "rad"}, "absolute": {"default": true}});
    let parameters: IndexMap<String, model::definition::DeviceParameter> = serde_json::from_value(more).expect("parameters");
    cell.device_types.get_mut("Joint").expect("it is there").parameters.extend(parameters);
    for (joint, most, speed) in [("j1", 3.0, 3.0), ("j2", 0.5, 1.0)] {
        let device = cell.logical_devices.get_mut(joint).expect("it is there");
        let values = [("position_min", -most), ("position_max", most), ("max_speed", speed)];
        device.parameters.extend(values.map(|(name, value)| (name.to_owned(), Value::Number(value))));
        device.parameters.insert("absolute".to_owned(), Value::Bool(joint == "j1"));
    }
    cell.logical_devices.get_mut("j2").expect("it is there").units = vec![("rad".to_owned(), "m".to_owned())];
    cell
}

fn plan(changes: serde_json::Value) -> Result<Plan, Refusals> {
    let mut verb = movement();
    merge(
        &mut verb,
        json!({"input_parameters": {"goal": {"within": ["arm.position_min", "arm.position_max"]},
        "speed": {"within": [0.0, "arm.max_speed"], "default": "50 %"}}}),
    );
    merge(&mut verb, changes);
    apply_in(jointed(), verb, json!({"arguments": {"arm": {"devices": ["j1", "j2"]}}}))
}

/// Returns the stored form of an input parameter's value.
fn settled(plan: &Plan, input: &str, value: serde_json::Value, present: serde_json::Value) -> Result<Value, String> {
    let input = plan.inputs.iter().find(|i| i.name == input).expect("an input parameter");
    let (value, present) = (serde_json::from_value(value).expect("a value"), serde_json::from_value(present).expect("values"));
    settle(input, &value, &jointed(), &present).expect("it has a range").map_err(|refusals| texts(&refusals))
}

fn numbers(values: [f64; 2]) -> Result<Value, String> {
    Ok(Value::List(values.map(Value::Number).to_vec()))
}

#[test]
fn one_number_shares_and_quantities_become_numbers_of_each_device() {
    let plan = plan(json!({})).expect("it is correct");
    assert_eq!(settled(&plan, "goal", json!(0.25), json!({})), numbers([0.25, 0.25]));
    assert_eq!(settled(&plan, "goal", json!([1, "300 mm"]), json!({})), numbers([1.0, 0.3]));
    assert_eq!(settled(&plan, "goal", json!("25 %"), json!({})), numbers([0.75, 0.125]));
    assert_eq!(settled(&plan, "speed", json!("50 %"), json!({})), Ok(Value::Number(0.5)), "of what all devices allow");
    assert_eq!(asked(&plan), Vec::<String>::new());
}

#[test]
fn a_value_outside_its_range_is_refused_with_device_range_and_what_was_meant() {
    let plan = plan(json!({})).expect("it is correct");
    let refused = |value| settled(&plan, "goal", value, json!({})).expect_err("it is outside");
    assert_eq!(
        refused(json!([90, 0.7])),
        "OutOfRange: 'goal' for 'j1' is 90 rad, but its range is -3 to 3 rad (position_min to position_max); did you mean '90 deg'?\n\
         OutOfRange: 'goal' for 'j2' is 0.7 m, but its range is -0.5 to 0.5 m (position_min to position_max); give a value within the range"
    );
    assert!(refused(json!([500, 0])).contains("give a value within the range"), "500 degrees are outside too");
    assert!(refused(json!([4, 0])).ends_with("give a value within the range"), "4 rad are a little too far, and hardly 4 degrees");
    assert!(refused(json!([0, "10 deg"])).starts_with("UnitMismatch: 'goal' for 'j2': cannot convert '10 deg' to m"));
    assert!(refused(json!([0, true])).starts_with("ValueRefused"));
    assert!(settled(&plan, "speed", json!(2.0), json!({})).expect_err("j2 is slower").contains("'speed' for 'j2' is 2 m/s, but its range is 0 to 1 m/s"));
}

#[test]
fn a_relative_value_is_counted_from_the_present() {
    let plan = plan(json!({"input_parameters": {"goal": {"counted_from": "arm.commanded"}}})).expect("it is correct");
    assert_eq!(asked(&plan), ["j1.commanded", "j2.commanded"]);
    let present = json!({"j1.commanded": 2.5, "j2.commanded": 0.0});
    assert_eq!(settled(&plan, "goal", json!([-5, 0.5]), present.clone()), numbers([-5.0, 0.5]));
    let refused = settled(&plan, "goal", json!([1, 0]), present).expect_err("3.5 is outside");
    assert!(refused.contains("'goal' for 'j1' is 1 rad from 2.5, that is 3.5 rad, but its range is -3 to 3 rad"), "{refused}");
}

#[test]
fn a_requirement_holds_for_the_devices_that_it_is_meant_for() {
    let needs = json!({"requires": {"arm.absolute": {"raises": "NotHomed", "remedy": "home it first"}}});
    let one = plan(needs).expect("it is correct");
    assert_eq!(texts(&unmet(&one, &jointed(), &IndexMap::new())), "NotHomed: cannot start 'move': 'j2.absolute' is not true; home it first");
    let some = plan(json!({"requires": {"arm.absolute": {"raises": "NotHomed", "when": "arm.absolute"}}})).expect("it is correct");
    assert!(unmet(&some, &jointed(), &IndexMap::new()).is_empty());
}

#[test]
fn members_that_are_not_there_are_found_at_definition() {
    let refused = |changes| {
        let refusals = plan(changes).expect_err("a name is wrong");
        assert!(refusals.iter().all(|r| r.class == Class::UnknownName), "{}", texts(&refusals));
        texts(&refusals)
    };
    let text = refused(json!({"input_parameters": {"goal": {"within": ["-arm.max_sped", 1.0]}}}));
    assert!(text.contains("the range of the input parameter 'goal' names 'arm.max_sped'") && text.contains("did you mean 'max_speed'?"), "{text}");
    assert!(refused(json!({"input_parameters": {"goal": {"within": ["leg.x", 1.0]}}})).contains("not a member of an object"));
    assert!(refused(json!({"input_parameters": {"goal": {"counted_from": "arm.max_speed"}}})).contains("has no SVV 'max_speed'"));
    assert!(refused(json!({"requires": {"arm.home": {"raises": "NotHomed"}}})).contains("has no SVV or parameter 'home'"));
}
