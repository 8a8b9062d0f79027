// SPDX-License-Identifier: Apache-2.0
//! Checks of functions off the cycle: services, counters, the search for devices.
use super::check::{Check, CheckResult, PassedCheck, holds};
use super::rig::Rig;
use super::subject::{Subject, of_another_kind};
use device::{DriverError, check_service};
use serde_json::{Value, json};

pub(super) const CHECKS: &[Check] = &[
    Check { name: "services", sentence: "it carries out services if and only if it declares some", run: there },
    Check { name: "service-unknown", sentence: "a service that it does not declare is refused", run: unknown },
    Check { name: "service-wrong", sentence: "wrong, missing and unknown arguments of each service are refused by name", run: wrong },
    Check { name: "service-closed", sentence: "a service call after it was closed is refused or harmless", run: closed },
    Check { name: "counters", sentence: "it counts what it declares, and nothing else", run: counters },
    Check { name: "counters-grow", sentence: "a counter without a unit never decreases", run: counters_grow },
    Check { name: "scan", sentence: "a search for devices succeeds, and gives options that the driver accepts", run: scan },
];

const NONE: PassedCheck = PassedCheck::NotApplicable("it has no services");

fn there(subject: &Subject) -> CheckResult {
    let (declared, has) = (!subject.of.services.is_empty(), subject.rig()?.driver.services().is_some());
    holds(declared == has, || format!("it declares {} but carries out {}", subject.of.services.len(), if has { "some" } else { "none" }))
}

fn unknown(subject: &Subject) -> CheckResult {
    let rig = subject.open()?;
    let Some(services) = rig.driver.services() else { return Ok(NONE) };
    holds(services.call("no_such_service", &json!({})).is_err(), || "'no_such_service' is carried out".to_owned())
}

fn wrong(subject: &Subject) -> CheckResult {
    let refused = |service: &str, arguments: &Value, name: &str| match check_service(subject.of.kind, subject.of.services, service, arguments) {
        Err(DriverError::Argument { argument, .. }) if argument == name => Ok(()),
        other => Err(format!("'{name}' of '{service}': {other:?}")),
    };
    for service in subject.of.services {
        refused(service.name, &json!({ "no_such_argument": 1 }), "no_such_argument")?;
        for argument in service.arguments {
            refused(service.name, &json!({ argument.name: of_another_kind(argument.kind) }), argument.name)?;
        }
        if let Some(needed) = service.arguments.iter().find(|argument| argument.default.is_none()) {
            refused(service.name, &json!({}), needed.name)?;
        }
    }
    Ok(if subject.of.services.is_empty() { NONE } else { PassedCheck::Yes })
}

fn closed(subject: &Subject) -> CheckResult {
    let mut rig = subject.open()?;
    let Some(services) = rig.driver.services() else { return Ok(NONE) };
    rig.driver.close();
    drop(rig);
    let _ = services.call("no_such_service", &json!({}));
    Ok(PassedCheck::Yes)
}

fn counters(subject: &Subject) -> CheckResult {
    let names = |words: &[device::CounterWord]| words.iter().map(|word| word.name).collect::<Vec<_>>();
    let counted = subject.rig()?.driver.counters().map(|counters| names(counters.words())).unwrap_or_default();
    holds(counted == names(subject.of.counters), || format!("it declares {:?} but counts {counted:?}", names(subject.of.counters)))
}

fn counters_grow(subject: &Subject) -> CheckResult {
    let mut rig: Rig = subject.open()?;
    let Some(counters) = rig.driver.counters() else { return Ok(PassedCheck::NotApplicable("it counts nothing")) };
    let mut before: Vec<u64> = counters.all().map(|(_, value)| value).collect();
    for _ in 0..200 {
        rig.cycle()?;
        for ((word, after), before) in counters.all().zip(&mut before) {
            holds(!word.unit.is_empty() || after >= *before, || format!("'{}' goes from {before} to {after}", word.name))?;
            *before = after;
        }
    }
    Ok(PassedCheck::Yes)
}

fn scan(subject: &Subject) -> CheckResult {
    if subject.of.scan.is_none() {
        return Ok(PassedCheck::NotApplicable("it cannot search"));
    }
    // A search has a timeout of its own, for each device that is not present.
    let times = subject.of.options.iter().filter(|option| option.unit == "ns");
    let asked = times.fold(subject.options.clone(), |mut options, time| {
        options.as_object_mut().map(|options| options.remove(time.name));
        options
    });
    let found = match device::scan(&subject.kind, &asked) {
        Err(DriverError::Option { option, .. }) if !option.is_empty() => return Ok(PassedCheck::NotApplicable("it needs to know where to search")),
        found => found.map_err(|why| why.to_string())?,
    };
    for found in found {
        // The found options give the address of the device; its other options are given already.
        let found_options = found.options.as_object().cloned().unwrap_or_default();
        let options = found_options.into_iter().fold(subject.options.clone(), |mut options, (name, value)| {
            options[name] = value;
            options
        });
        subject.with(&options).map_err(|why| format!("'{}': {why}", found.what))?;
    }
    Ok(PassedCheck::Yes)
}
