// SPDX-License-Identifier: Apache-2.0
//! Completes a plan: adds everything except the blocks, that is, the input parameters, output values, claims and conditions.
use super::sequence::Order;
use super::{Draft, GroupBinding};
use crate::conformity::within_items;
use crate::definition::Arbitration;
use crate::ending::CheckedSuspend;
use crate::flatten::Port;
use crate::interface::Kind;
use crate::parameters::{CheckedInput, Whose};
use crate::plan::{
    Binding, CellKind, Claim, InputOrigin, Plan, PlannedActivation, PlannedHolding, PlannedInput, PlannedList, PlannedOutput, PlannedSuspend, Target,
};
use crate::quantity::units_agree;
use crate::refusal::{Class, Refusals, Where};
use crate::types::Type;

impl<'a> Draft<'a> {
    /// Returns the completed plan.
    pub fn finish(
        mut self,
        given: Vec<GroupBinding<'a>>,
        activations: Vec<PlannedActivation>,
        order: Order,
        lists: Vec<PlannedList>,
    ) -> Result<Plan, Refusals> {
        drop(given);
        let checked = self.checked;
        let inputs: Vec<PlannedInput> = checked.inputs.iter().filter_map(|input| self.input(input)).collect();
        let outputs = checked.outputs.iter().map(|(name, port)| self.output(name, *port)).collect();
        self.stop()?;
        let requirements = self.requirements();
        let claims = self.claims();
        let arbitration = claims.iter().map(|claim| self.arbitration(claim)).collect();
        let suspend = self.suspend(&lists);
        self.stop()?;
        let mut remarks = checked.remarks.clone();
        remarks.append(&mut self.remarks);
        let conditions = checked.conditions.iter().map(|condition| condition.planned.with_copies(&lists)).collect();
        Ok(Plan {
            verb: checked.name.clone(),
            blocks: self.blocks,
            cells: self.cells,
            activations,
            order,
            lists,
            initial: checked.initial,
            ending: checked.ending.clone(),
            suspend,
            if_cut_off: checked.if_cut_off,
            conditions,
            inputs,
            requirements,
            outputs,
            claims,
            arbitration,
            devices: self.objects.into_iter().flatten().map(str::to_owned).collect(),
            manual: checked.manual,
            remarks,
        })
    }

    /// Returns an input parameter with its type, unit, default and range; adds a refusal for each mistake.
    pub fn input(&mut self, input: &CheckedInput) -> Option<PlannedInput> {
        let before = self.refusals.len();
        let planned = self.planned_input(input);
        for refusal in &mut self.refusals[before..] {
            refusal.about.push(Where::Parameter { parameter: input.name.clone() });
        }
        planned
    }

    fn planned_input(&mut self, input: &CheckedInput) -> Option<PlannedInput> {
        let origin = self.origin(input);
        let &first = input.ports.first()?;
        let layout = self.layout(first)?;
        let units = input.ports.iter().map(|port| self.unit(*port));
        let unit = std::iter::once(input.unit.as_str()).chain(units).find(|unit| !unit.is_empty()).unwrap_or("").to_owned();
        for port in &input.ports {
            let described = self.described(*port);
            if self.layout(*port).is_some_and(|other| other.text != layout.text) {
                let message = format!("the input parameter '{}' goes to {} and to {described}: types differ", input.name, self.described(first));
                self.refuse(Class::TypeMismatch, message, "declare one of them as the other", &input.place);
            } else if !units_agree(&unit, self.unit(*port)) {
                let message = format!("the input parameter '{}' ({unit}) goes to {described}: units differ", input.name);
                self.refuse(Class::UnitMismatch, message, "declare one of them as the other", &input.place);
            }
        }
        if let InputOrigin::DeviceParameter { devices, parameter } = &origin {
            self.check_device_parameter(input, devices, parameter, first, &unit);
        }
        let unit = self.chosen_unit(unit);
        // An input with a range also accepts a share of it, and one number for all devices: these are checked at the start.
        if let Some(Err(refusal)) = input.default.as_ref().filter(|_| input.within.is_none()).map(|value| layout.read.encode(value, &unit)) {
            let refusal = refusal.for_what(&format!("the default of the input parameter '{}'", input.name));
            self.refusals.push(refusal.at(&input.place));
        }
        let mut targets = Vec::with_capacity(input.ports.len());
        for port in &input.ports {
            let target = self.target(*port);
            if !targets.contains(&target) {
                targets.push(target);
            }
        }
        let (name, default, tunable) = (input.name.clone(), input.default.clone(), input.tunable);
        let item_ranges = self.item_ranges(input);
        let planned = PlannedInput { name, origin, type_text: layout.text.clone(), unit, default, tunable, range: self.range(input), item_ranges, targets };
        // If the verb declares a range of its own, the default is checked at the start.
        let default = planned.default.as_ref().filter(|_| planned.range.is_none());
        if let Some(refusal) = default.and_then(|value| within_items(&planned, value).err()) {
            self.refusals.push(refusal.for_what("the default").at(&input.place));
        }
        Some(planned)
    }

    fn origin(&self, input: &CheckedInput) -> InputOrigin {
        match &input.whose {
            _ if input.preset => InputOrigin::Preset,
            Whose::Object { object, member } => {
                let at = self.checked.objects.get_index_of(object);
                let devices = at.map(|at| self.objects[at].iter().map(|d| (*d).to_owned()).collect()).unwrap_or_default();
                InputOrigin::DeviceParameter { devices, parameter: member.clone() }
            }
            _ => {
                let owner = self.application.owner.as_ref();
                let device = owner.and_then(|owner| self.configuration.logical_devices.get(owner));
                let owns = device.is_some_and(|device| {
                    let device_type = self.configuration.device_types.get(&device.device_type);
                    device.parameters.contains_key(&input.name) || device_type.is_some_and(|t| t.parameters.contains_key(&input.name))
                });
                match owner.filter(|_| owns) {
                    Some(owner) => InputOrigin::DeviceParameter { devices: vec![owner.clone()], parameter: input.name.clone() },
                    None => InputOrigin::Given,
                }
            }
        }
    }

    fn check_device_parameter(&mut self, input: &CheckedInput, devices: &[String], parameter: &str, port: Port, unit: &str) {
        let configuration = self.configuration;
        let of_device = devices.first().and_then(|device| configuration.logical_devices.get(device)).map(|device| &device.device_type);
        let of_object = match &input.whose {
            Whose::Object { object, .. } => self.checked.objects.get(object).map(|object| &object.device_type),
            _ => None,
        };
        let declared = of_device.or(of_object).and_then(|of| configuration.device_types.get(of)?.parameters.get(parameter));
        let described = self.described(port);
        if let Some(declared) = declared.filter(|declared| !units_agree(&declared.unit, unit)) {
            let message = format!("cannot bind the device parameter '{parameter}' ({}) to {described}: units differ", declared.unit);
            self.refuse(Class::UnitMismatch, message, "declare one of them as the other", &input.place);
        }
        let count = match self.layout(port).map(|layout| layout.read.clone()) {
            Some(Type::Array(_, count)) => count,
            _ => 1,
        };
        if devices.len() > 1 && count != devices.len() {
            let message = format!("cannot bind '{}' of {} devices to {described}: the numbers of elements differ", input.name, devices.len());
            self.refuse(Class::TypeMismatch, message, "give the port one element for each device", &input.place);
        }
    }

    fn output(&self, name: &str, port: Port) -> PlannedOutput {
        let type_text = self.layout(port).map_or_else(String::new, |layout| layout.text.clone());
        let target = match self.kind(port) {
            Kind::Condition => Target::Report { block: port.0, item: port.1 },
            _ => self.target(port),
        };
        PlannedOutput { name: name.to_owned(), type_text, target }
    }

    /// Plans the suspension of the verb. Every value that it sets must belong to the instance alone, and must not be overwritten by an
    /// active block.
    fn suspend(&mut self, lists: &[PlannedList]) -> PlannedSuspend {
        match &self.checked.suspend {
            CheckedSuspend::Idle => PlannedSuspend::Idle,
            CheckedSuspend::Hold => PlannedSuspend::Hold,
            CheckedSuspend::HoldLast => PlannedSuspend::HoldLast,
            CheckedSuspend::Safe => PlannedSuspend::Safe,
            CheckedSuspend::Holding(ways) => PlannedSuspend::Holding(ways.iter().map(|way| self.holding(*way, lists)).collect()),
        }
    }

    fn holding(&mut self, (set, until): (Port, Port), lists: &[PlannedList]) -> PlannedHolding {
        let target = self.target(set);
        let is_active = |block: usize| {
            let mut stages = lists.iter().flat_map(|list| &list.stages);
            stages.any(|stage| stage.active.iter().any(|(activation, _)| *activation == self.blocks[block].activation))
        };
        let is_own = match &target {
            Target::Cell(cell) if matches!(self.cells[*cell].kind, CellKind::Svv { .. }) => false,
            Target::Cell(cell) => !self.cells[*cell].writers.iter().any(|(writer, _)| is_active(*writer)),
            target => matches!(target, Target::Item { .. }),
        };
        if !is_own {
            let message = format!("{} is set while the verb is suspended, but others write the value to which it is bound", self.described(set));
            self.refuse(Class::CoverError, message, "leave it unbound", &None);
        }
        PlannedHolding { set: target, until }
    }

    fn target(&self, port: Port) -> Target {
        if let Some((whole, index)) = self.flat(port.0).kind.element_of(port.1)
            && let Some(cell) = self.elements.get(&(port.0, whole)).and_then(|elements| elements.get(&index))
        {
            return Target::Cell(*cell);
        }
        let bound = self.blocks[port.0].bindings.binary_search_by_key(&port.1, |bound| bound.item);
        match bound.map(|at| &self.blocks[port.0].bindings[at].binding) {
            Ok(Binding::Cell(cell)) => Target::Cell(*cell),
            Ok(Binding::Cells(cells)) => Target::Cells(cells.clone()),
            Err(_) => Target::Item { block: port.0, item: port.1 },
        }
    }

    fn arbitration(&self, claim: &Claim) -> Arbitration {
        let Claim::Svv { name, .. } = claim else { return Arbitration::Refuse };
        let configuration = self.configuration;
        let device = configuration.svvs.get(name).and_then(|svv| configuration.logical_devices.get(svv.device.as_ref()?));
        let of_type = device.and_then(|device| configuration.device_types.get(&device.device_type)).map(|of| of.arbitration);
        device.and_then(|device| device.arbitration).or(of_type).unwrap_or_default()
    }

    fn claims(&self) -> Vec<Claim> {
        let written = self.cells.iter().filter(|cell| !cell.writers.is_empty());
        written
            .filter_map(|cell| match &cell.kind {
                CellKind::Svv { id, name } => Some(Claim::Svv { id: *id, name: name.clone() }),
                CellKind::Channel { device, channel, write: true } => Some(Claim::Channel { device: device.clone(), channel: *channel }),
                _ => None,
            })
            .collect()
    }
}
