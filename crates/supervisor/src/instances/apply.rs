// SPDX-License-Identifier: Apache-2.0
//! Applies verbs and creates logical devices, that is, creates instances from definitions.
use crate::alarms::causes::alarm_enabled;
use crate::core::Core;
use crate::definitions::system_definitions::Definitions;
use crate::instances::course::Course;
use crate::instances::instance::Origin;
use crate::precedence::first;
use crate::refuse::{invalid_state, refuse_at, unknown};
use crate::registry::{DeviceState, LogicalRecord};
use crate::svvs::svv_calls::SvvRequest;
use crate::system::{System, WaitResult};
use indexmap::IndexMap;
use model::configuration::{LogicalDevice, Svv};
use model::definition::{Application, Arbitration, Argument, DeviceType, Initial, SvvSpecification, Within};
use model::members::check_parameter;
use model::plan::{CellKind, Plan, PlannedCell};
use model::range::Range;
use model::refusal::{Class, Refusals, SourceLocation};
use model::value::Value;
use std::time::Duration;

/// Request to create a logical device.
#[derive(Clone, Debug, serde::Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct DeviceRequest {
    pub device_type: String,
    /// Parameters whose values differ from those of the type.
    #[serde(default)]
    pub parameters: IndexMap<String, Value>,
    /// Verb that operates the device, if it differs from the type's because the drive is commanded in a different way. Its parameters are
    /// matched to the members by name.
    #[serde(default)]
    pub verb: Option<String>,
    /// Additional arguments of the verb (`drive`).
    #[serde(default)]
    pub arguments: IndexMap<String, Argument>,
    /// `rtp.name` of the source on which the verb runs.
    #[serde(default)]
    pub source: Option<String>,
    /// Intervals of the verb's blocks that differ from those in the command list, ns.
    #[serde(default)]
    pub every: IndexMap<String, u64>,
    /// Unit parts that this device replaces, in order.
    #[serde(default)]
    pub units: Vec<(String, String)>,
    /// Arbitration for a second verb that commands the device, if it differs from the type's.
    #[serde(default)]
    pub arbitration: Option<Arbitration>,
    #[serde(default)]
    pub place: Option<SourceLocation>,
}

impl System {
    /// Plans an application without creating anything; its values are checked as for a start.
    pub fn check(&self, application: &Application) -> Result<Plan, Refusals> {
        let (checked, configuration) = {
            let mut definitions = self.shared.definitions();
            (definitions.checked(&application.verb)?, definitions.configuration.as_it_is())
        };
        let plan = checked.apply(application, &configuration)?;
        let refusals = crate::starting::requirements::unfit(&plan, &application.values, &configuration);
        if refusals.is_empty() { Ok(plan) } else { Err(refusals.into_iter().map(|refusal| refusal.at(&application.place)).collect()) }
    }

    /// Creates a verb instance.
    pub fn create(&self, application: &Application) -> Result<u64, Refusals> {
        let mut definitions = self.shared.definitions();
        self.create_in(&mut definitions, application)
    }

    pub(crate) fn create_in(&self, definitions: &mut Definitions, application: &Application) -> Result<u64, Refusals> {
        self.create_then(definitions, application, |_, _| true)
    }

    /// Creates a verb instance that is to be started immediately: the kernel work for creating it is combined with the start if possible.
    pub fn create_to_start(&self, application: &Application) -> Result<u64, Refusals> {
        let mut definitions = self.shared.definitions();
        self.create_then(&mut definitions, application, |core, id| !core.waits_for_its_start(id))
    }

    /// Creates an instance. `proceeds` starts the work of the kernels.
    fn create_then(&self, definitions: &mut Definitions, application: &Application, proceeds: impl Fn(&Core, u64) -> bool) -> Result<u64, Refusals> {
        let (checked, plan) = definitions.planned(application)?;
        if let Some(name) = &application.name
            && self.shared.locked().instances.values().any(|i| i.name == *name)
        {
            return Err(refuse_at(Class::InUse, format!("there is already a verb instance '{name}'"), "give it another name", application.place.clone()));
        }
        let catalog = &definitions.catalog;
        self.send_code(catalog, &plan, &application.place)?;
        let (id, name) = self.shared.command(|core| {
            let id = core.create(catalog, plan.clone(), application.name.clone(), application.owner.clone())?;
            let instance = core.instances.get_mut(&id).expect("it has just been made");
            instance.origin = Some(Origin { checked, application: application.clone() });
            let name = instance.name.clone();
            if proceeds(core, id) {
                core.course(id).proceed();
            }
            Ok((id, name))
        })?;
        enter_writers(definitions, &plan, &name);
        if let Err(refusals) = self.followers_hold(definitions, id) {
            leave_writers(definitions, &plan, &name);
            self.shared.command(|core| {
                core.remove(id);
                Ok(())
            })?;
            return Err(refusals.into_iter().map(|refusal| refusal.at(&application.place)).collect());
        }
        Ok(id)
    }

    /// Deletes a verb instance that is not running.
    pub fn delete(&self, instance: u64) -> Result<(), Refusals> {
        self.delete_by(instance, |mut course| course.delete())
    }

    /// Deletes an instance. `delete` removes it from the core.
    pub(crate) fn delete_by(&self, instance: u64, delete: impl FnOnce(Course<'_>) -> Result<(), Refusals>) -> Result<(), Refusals> {
        let mut definitions = self.shared.definitions();
        self.shared.command(|core| delete_from(core, &mut definitions, instance, delete))
    }

    /// Creates a logical device with its SVVs, parameters and verb instance. If any part fails, nothing is created.
    pub fn device(&self, name: &str, request: DeviceRequest) -> Result<(), Refusals> {
        let mut definitions = self.shared.definitions();
        let place = request.place.clone();
        let Some(of) = definitions.configuration.device_types.get(&request.device_type).cloned() else {
            return Err(unknown("device type", &request.device_type, definitions.configuration.device_types.keys().map(String::as_str)));
        };
        if definitions.configuration.logical_devices.contains_key(name) {
            return Err(refuse_at(
                Class::InUse,
                format!("there is already a logical device '{name}'"),
                "give it another name, or delete that one first",
                place,
            ));
        }
        let mut logical = LogicalDevice {
            device_type: of.name.clone(),
            svvs: IndexMap::new(),
            parameters: IndexMap::new(),
            arguments: request.arguments.clone(),
            source: request.source.clone(),
            enabled: false,
            units: request.units.clone(),
            arbitration: request.arbitration,
            place: place.clone(),
        };
        logical.parameters = device_parameters(&of, name, &request.parameters, &logical)?;
        let (mut svvs, mut copies) = (IndexMap::new(), Vec::new());
        let made = of.svvs.iter().try_for_each(|(member, specification)| {
            if let Some(shared) = &specification.shared {
                svvs.insert(member.clone(), shared.clone());
                if definitions.configuration.svvs.contains_key(shared) {
                    return Ok(());
                }
                let asked = SvvRequest { specification: specification.clone(), types: IndexMap::new() };
                self.make_svv(&mut definitions, shared, &asked, None, place.clone())?;
                definitions.configuration.svvs[shared].shared = true;
                return Ok(());
            }
            let full = format!("{name}.{member}");
            if let Some(Initial::CopyOf(from)) = &specification.initial {
                if !of.svvs.contains_key(from) {
                    return Err(unknown(&format!("SVV of '{}' named", of.name), from, of.svvs.keys().map(String::as_str)));
                }
                copies.push((full.clone(), format!("{name}.{from}")));
            }
            let unit = logical.unit(&specification.unit);
            let within = specification.within.as_ref().map(|within| Within::Range(within.resolve(&logical.parameters).0));
            let asked = SvvRequest { specification: SvvSpecification { unit, within, ..specification.clone() }, types: IndexMap::new() };
            self.make_svv(&mut definitions, &full, &asked, Some(name), place.clone())?;
            svvs.insert(member.clone(), full);
            Ok(())
        });
        logical.svvs = svvs;
        definitions.configuration.logical_devices.insert(name.to_owned(), logical);
        let instance = made.and_then(|()| self.own_verb(&mut definitions, name, &of, &request));
        match instance {
            Ok(instance) => self.shared.command(|core| {
                core.registry.logical.insert(name.to_owned(), LogicalRecord { instance, state: DeviceState::Disabled, copies, gap_max_s: None });
                Ok(())
            }),
            Err(refusals) => {
                self.forget_device(&mut definitions, name);
                Err(refusals)
            }
        }
    }

    /// Returns the instance of a new device's own verb.
    fn own_verb(&self, definitions: &mut Definitions, name: &str, of: &DeviceType, request: &DeviceRequest) -> Result<Option<u64>, Refusals> {
        let Some(verb) = request.verb.as_ref().or(of.verb.as_ref()) else { return Ok(None) };
        let placement = request.source.iter().map(|source| ("*".to_owned(), source.clone())).collect();
        let application = Application {
            verb: verb.clone(),
            name: Some(format!("{name}.{verb}")),
            arguments: request.arguments.clone(),
            placement,
            every: request.every.clone(),
            values: IndexMap::new(),
            owner: Some(name.to_owned()),
            place: request.place.clone(),
        };
        self.create_in(definitions, &application).map(Some)
    }

    /// Removes a device and its SVVs.
    fn forget_device(&self, definitions: &mut Definitions, name: &str) {
        let configuration = &mut definitions.configuration;
        configuration.logical_devices.shift_remove(name);
        let mut core = self.shared.locked();
        let is_used = |svv: &String| configuration.logical_devices.values().any(|device| device.svvs.values().any(|used| used == svv));
        let is_bound = |svv: &String| {
            let binds = |cell: &PlannedCell| matches!(&cell.kind, CellKind::Svv { name, .. } if name == svv);
            core.instances.values().any(|instance| instance.plan.cells.iter().any(binds))
        };
        let goes = |of: &String, svv: &Svv| svv.device.as_deref() == Some(name) || svv.shared && !is_used(of) && !is_bound(of);
        let svvs: Vec<String> = configuration.svvs.iter().filter(|(of, svv)| goes(of, svv)).map(|(of, _)| of.clone()).collect();
        for svv in &svvs {
            configuration.svvs.shift_remove(svv);
            core.registry.svvs.shift_remove(svv);
        }
        core.registry.logical.shift_remove(name);
    }

    /// Deletes a logical device that is disabled and to which no instance is bound.
    pub fn delete_device(&self, name: &str) -> Result<(), Refusals> {
        let mut definitions = self.shared.definitions();
        let gone = self.shared.command(|core| {
            let record = core.registry.logical(name)?;
            if !matches!(record.state, DeviceState::Disabled | DeviceState::Fault) {
                return Err(invalid_state(&format!("device '{name}'"), "enabled", "delete", "disable it first"));
            }
            let own = record.instance;
            if let Some(user) = core.instances.values().find(|i| Some(i.id) != own && i.plan.devices.iter().any(|d| d == name)) {
                return Err(invalid_state(&format!("device '{name}'"), &format!("used by '{}'", user.name), "delete", "delete that instance first"));
            }
            let gone = own.and_then(|id| core.instances.get(&id)).map(|i| (i.name.clone(), i.plan.clone()));
            alarm_enabled(core, name);
            if let Some(id) = own {
                core.remove(id);
            }
            Ok(gone)
        })?;
        if let Some((instance, plan)) = gone {
            leave_writers(&mut definitions, &plan, &instance);
        }
        self.forget_device(&mut definitions, name);
        Ok(())
    }

    /// Starts a device's own verb. See [`System::wait_enabled`].
    pub fn enable(&self, device: &str) -> Result<u64, Refusals> {
        let definitions = self.shared.definitions();
        self.shared.command(|core| core.enable(device, &definitions.configuration))
    }

    /// Waits until a device that is being enabled is ready; returns false if its verb ends first.
    pub fn wait_enabled(&self, device: &str, until_ns: Option<i64>, slice: Duration) -> Result<WaitResult<bool>, Refusals> {
        self.shared.wait_for(until_ns, slice, |core| {
            Ok(match core.registry.logical(device)?.state {
                DeviceState::Enabled => Some(true),
                DeviceState::Enabling => None,
                _ => Some(false),
            })
        })
    }

    /// Ends the verbs that use a device, then the device's own verb.
    pub fn disable(&self, device: &str, slice: Duration) -> Result<WaitResult<()>, Refusals> {
        if first(|| self.shared.command(|core| core.disable(device)))? {
            return Ok(WaitResult::Done(()));
        }
        self.shared.wait_for(None, slice, |core| Ok(core.disable(device)?.then_some(())))
    }

    pub fn device_state(&self, device: &str) -> Result<&'static str, Refusals> {
        let core = self.shared.locked();
        core.instances.device_state(&core.registry, device)
    }

    /// Sets a parameter of a device: for the next start, and immediately in running instances if it is declared tunable.
    pub fn set_device_parameter(&self, device: &str, parameter: &str, value: Value) -> Result<(), Refusals> {
        let mut definitions = self.shared.definitions();
        let Some(record) = definitions.configuration.logical_devices.get(device) else {
            return Err(unknown("logical device", device, definitions.configuration.logical_devices.keys().map(String::as_str)));
        };
        let of = &definitions.configuration.device_types[&record.device_type];
        let Some(declared) = of.parameters.get(parameter) else {
            return Err(unknown(&format!("parameter of '{device}' named"), parameter, of.parameters.keys().map(String::as_str)));
        };
        let value = in_kind_of(&declared.default, &record.unit(&declared.unit), &value).map_err(|r| vec![crate::starting::psi::named(r, parameter)])?;
        let tunable = declared.tunable;
        let mut parameters = record.parameters.clone();
        parameters.insert(parameter.to_owned(), value.clone());
        check_parameter(of, device, parameter, &record.unit(&declared.unit), &parameters).map_err(|r| vec![r])?;
        let ranges = svv_ranges(of, record, &parameters);
        self.shared.command(|core| {
            for (svv, range) in ranges {
                if let Some(svv) = core.registry.svvs.get_mut(&svv) {
                    svv.within = Some(range);
                }
            }
            Ok(())
        })?;
        let before = definitions.configuration.logical_devices.get_mut(device).and_then(|record| record.parameters.insert(parameter.to_owned(), value));
        let tuned = if tunable { self.shared.command(|core| core.tune(device, parameter, &definitions.configuration)) } else { Ok(()) };
        if tuned.is_err()
            && let (Some(record), Some(before)) = (definitions.configuration.logical_devices.get_mut(device), before)
        {
            record.parameters.insert(parameter.to_owned(), before);
        }
        tuned?;
        self.shared.command(|core| {
            core.release_force_beyond(device, &definitions.configuration);
            Ok(())
        })
    }

    pub fn device_parameter(&self, device: &str, parameter: &str) -> Result<Value, Refusals> {
        let definitions = self.shared.definitions();
        let Some(record) = definitions.configuration.logical_devices.get(device) else {
            return Err(unknown("logical device", device, definitions.configuration.logical_devices.keys().map(String::as_str)));
        };
        record
            .parameters
            .get(parameter)
            .cloned()
            .ok_or_else(|| unknown(&format!("parameter of '{device}' named"), parameter, record.parameters.keys().map(String::as_str)))
    }
}

/// Returns the parameters of a device: those of the type, overridden by the device's own.
fn device_parameters(of: &DeviceType, called: &str, given: &IndexMap<String, Value>, device: &LogicalDevice) -> Result<IndexMap<String, Value>, Refusals> {
    let mut refusals = Vec::new();
    let mut parameters: IndexMap<String, Value> = IndexMap::new();
    for (name, declared) in &of.parameters {
        match in_kind_of(&declared.default, &device.unit(&declared.unit), given.get(name).unwrap_or(&declared.default)) {
            Ok(value) => {
                parameters.insert(name.clone(), value);
            }
            Err(refusal) => refusals.push(crate::starting::psi::named(refusal, name)),
        }
    }
    for name in given.keys().filter(|n| !of.parameters.contains_key(*n)) {
        refusals.extend(unknown(&format!("parameter of '{}' named", of.name), name, of.parameters.keys().map(String::as_str)));
    }
    let out_of_range = of.parameters.iter().map(|(name, declared)| check_parameter(of, called, name, &device.unit(&declared.unit), &parameters));
    refusals.extend(out_of_range.filter_map(Result::err));
    if refusals.is_empty() { Ok(parameters) } else { Err(refusals) }
}

/// Returns the ranges of a device's SVVs whose bounds are parameters of the device.
fn svv_ranges(of: &DeviceType, device: &LogicalDevice, parameters: &IndexMap<String, Value>) -> Vec<(String, Range)> {
    let own = of.svvs.iter().filter(|(_, svv)| svv.shared.is_none());
    own.filter_map(|(member, svv)| match &svv.within {
        Some(within @ Within::Between(..)) => Some((device.svvs.get(member)?.clone(), within.resolve(parameters).0)),
        _ => None,
    })
    .collect()
}

/// Converts a value to the kind of a parameter's default: if the default is a number, a quantity is converted to its unit, and a number
/// is left unchanged.
fn in_kind_of(default: &Value, unit: &str, value: &Value) -> Result<Value, model::refusal::Refusal> {
    match (default, value) {
        (Value::Number(_) | Value::Integer(_) | Value::Unsigned(_) | Value::Text(_), Value::Text(text)) => {
            model::quantity::number_in(text, unit).map(Value::Number)
        }
        (Value::Number(_), Value::Integer(i)) => Ok(Value::Number(*i as f64)),
        (Value::Number(_), Value::Unsigned(i)) => Ok(Value::Number(*i as f64)),
        (Value::Integer(_) | Value::Unsigned(_), Value::Integer(_) | Value::Unsigned(_) | Value::Number(_)) => Ok(value.clone()),
        (Value::Number(_), Value::Number(_)) | (Value::Bool(_), Value::Bool(_)) | (Value::List(_), Value::List(_)) => Ok(value.clone()),
        (Value::Text(_), Value::Number(_) | Value::Integer(_)) => Ok(value.clone()),
        (Value::Record(_), Value::Record(_)) => Ok(value.clone()),
        _ => Err(model::refusal::Refusal::new(
            Class::ValueRefused,
            format!("it must be of the same type as its default ({}), but it is {}", default.described(), value.described()),
        )),
    }
}

/// Registers the writers of an instance, for the checks of later instances.
fn enter_writers(definitions: &mut Definitions, plan: &Plan, instance: &str) {
    for (svv, writer) in plan.writers(instance, &definitions.configuration) {
        definitions.configuration.aside().writers.entry(svv).or_default().push(writer);
    }
}

/// Removes an instance from the core, using `delete`, and from the writers of its SVVs.
pub(crate) fn delete_from(
    core: &mut Core,
    definitions: &mut Definitions,
    instance: u64,
    delete: impl FnOnce(Course<'_>) -> Result<(), Refusals>,
) -> Result<(), Refusals> {
    let found = core.instances.known(instance)?;
    let (name, plan) = (found.name.clone(), found.plan.clone());
    delete(core.course(instance))?;
    leave_writers(definitions, &plan, &name);
    Ok(())
}

pub(crate) fn leave_writers(definitions: &mut Definitions, plan: &Plan, instance: &str) {
    for cell in plan.cells.iter().filter(|c| !c.writers.is_empty()) {
        if let CellKind::Svv { name, .. } = &cell.kind
            && let Some(writers) = definitions.configuration.aside().writers.get_mut(name)
        {
            writers.retain(|w| w.instance != instance);
        }
    }
}
