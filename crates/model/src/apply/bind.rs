// SPDX-License-Identifier: Apache-2.0
//! Bindings: the cells of an instance, and the types and units on both sides of each binding.
use super::{Draft, GroupBinding};
use crate::configuration::Svv;
use crate::flatten::{Group, Origin, Port};
use crate::interface::{Kind, Mode};
use crate::kind::{Layout, Shape, is_data};
use crate::plan::{Binding, Bound, CellIndex, CellKind, PlannedBlock, PlannedCell};
use crate::quantity::units_agree;
use crate::refusal::{Class, Refusal, SourceLocation, Where};
use crate::types::Type;
use std::sync::Arc;

impl<'a> Draft<'a> {
    /// Creates blocks and cells, and binds them.
    pub fn bind(&mut self, given: &[GroupBinding<'a>]) {
        self.make_blocks();
        let checked = self.checked;
        for (group, given) in checked.groups.iter().zip(given) {
            match given {
                GroupBinding::Private => self.bind_private(group),
                GroupBinding::Svvs(svvs) => self.bind_svvs(group, svvs),
                GroupBinding::Channel { device, channel, physical } => self.bind_channel(group, device, *channel, &physical.channels[*channel]),
            }
        }
        self.gather();
        for block in &mut self.blocks {
            block.bindings.sort_by_key(|bound| bound.item);
        }
    }

    /// Binds array ports to the cells of their elements.
    fn gather(&mut self) {
        for (port, cells) in std::mem::take(&mut self.gathered) {
            self.put(port, Binding::Cells(cells.values().copied().collect()));
            self.elements.insert(port, cells);
        }
    }

    fn make_blocks(&mut self) {
        let checked = self.checked;
        for (at, flat) in checked.blocks.iter().enumerate() {
            let mut values: Vec<(usize, Vec<u8>)> = Vec::new();
            if let (Some(item), Some(size)) = (flat.kind.size_item, self.sizes[at]) {
                values.push((item, size.to_le_bytes().to_vec()));
            }
            for (item, value) in &flat.constants {
                let declared = flat.kind.item(*item);
                if matches!(declared.kind, Kind::Size | Kind::Input) {
                    continue;
                }
                let Some(layout) = self.layout((at, *item)) else { continue };
                match layout.read.encode(value, self.unit((at, *item))) {
                    Ok(bytes) => values.push((*item, bytes)),
                    Err(refusal) => {
                        let refusal = refusal.for_what(&format!("the constant for {}", self.described((at, *item))));
                        self.refusals.push(refusal.at(&flat.place).about([self.drawn((at, *item))]));
                    }
                }
            }
            let items = flat.kind.interface.items.iter().filter(|item| is_data(item.kind)).count();
            self.blocks.push(PlannedBlock {
                label: flat.label.clone(),
                block: flat.kind.interface.name.clone(),
                source: String::new(),
                size: self.sizes[at],
                values,
                bindings: Vec::with_capacity(items),
                drivers: Vec::new(),
                external_drivers: Vec::new(),
                remote_drivers: Vec::new(),
                activation: 0,
                place: flat.place.clone(),
            });
        }
    }

    /// Returns the port that determines the type of a cell: the first output, or else the first port.
    fn leading(&self, group: &Group) -> Option<Port> {
        let is_output = |port: &&Port| self.kind(**port) == Kind::Output;
        group.ports.iter().find(is_output).or_else(|| group.ports.first()).copied()
    }

    /// Checks the types and units of all ports of a data object. Ports that are bound to channels have no cell.
    pub fn check_object(&mut self, group: &Group) {
        let Some(first) = self.leading(group) else { return };
        for port in group.ports.iter().filter(|port| **port != first) {
            self.check_ports(first, *port, group.origin);
        }
        self.check_units(group);
        let is_device = |port: &&Port| matches!(self.kind(**port), Kind::DeviceRead | Kind::DeviceWrite);
        let devices: Vec<Port> = group.ports.iter().filter(is_device).copied().collect();
        for port in devices.into_iter().filter(|_| group.origin != Origin::Parameter) {
            let message = format!("{} is covered by the cell '{}'", self.described(port), group.name);
            let refusal = Refusal::new(Class::TypeMismatch, message).remedy("a device item takes a channel: make it an instantiation parameter");
            let place = if group.place.is_some() { &group.place } else { &self.application.place };
            self.refusals.push(refusal.at(place).at(&self.checked.place).about([self.drawn(port)]));
        }
    }

    /// Returns the location of a port in the drawing.
    pub fn drawn(&self, port: Port) -> Where {
        Where::Port { block: self.flat(port.0).label.clone(), port: self.flat(port.0).kind.item(port.1).name.clone() }
    }

    fn bind_private(&mut self, group: &'a Group) {
        let Some(first) = self.leading(group) else { return };
        self.check_object(group);
        let Some(layout) = self.layout(first) else { return };
        let initial = self.initial(group, &layout);
        let kind = match group.origin {
            Origin::Constant => CellKind::Constant { name: group.name.clone() },
            _ => CellKind::Private { name: group.name.clone() },
        };
        let unit = group.ports.iter().map(|port| self.unit(*port)).find(|unit| !unit.is_empty()).unwrap_or_default().to_owned();
        let cell = self.cell(kind, &layout, unit, initial);
        self.varies[cell] = group.origin != Origin::Constant;
        for port in &group.ports {
            self.attach(*port, Binding::Cell(cell));
        }
    }

    /// Returns the initial value of a cell: the constant or default of an input if no block writes the cell, otherwise zero.
    fn initial(&mut self, group: &Group, layout: &Layout) -> Vec<u8> {
        if group.origin.varies() {
            return vec![0; layout.size];
        }
        for &(block, item) in &group.ports {
            let flat = self.flat(block);
            let declared = flat.kind.item(item);
            if let Some((_, value)) = flat.constants.iter().find(|(at, _)| *at == item) {
                match layout.read.encode(value, self.unit((block, item))) {
                    Ok(bytes) => return bytes,
                    Err(refusal) => {
                        let refusal = refusal.for_what(&format!("the constant for {}", self.described((block, item))));
                        self.refusals.push(refusal.at(&flat.place).about([self.drawn((block, item))]));
                    }
                }
            } else if declared.has_default && declared.default.len() >= layout.size {
                return declared.default[..layout.size].to_vec();
            }
        }
        vec![0; layout.size]
    }

    fn bind_svvs(&mut self, group: &'a Group, svvs: &[(&'a str, &'a Svv)]) {
        let mut layouts: Vec<Arc<Layout>> = Vec::with_capacity(svvs.len());
        for (name, svv) in svvs {
            match (layouts.last(), svvs[0].1.type_text == svv.type_text && svvs[0].1.types == svv.types) {
                (Some(layout), true) => layouts.push(Arc::clone(layout)),
                _ => match Type::parse(&svv.type_text, &svv.types) {
                    Ok(read) => layouts.push(Layout::new(read)),
                    Err(refusal) => return self.refusals.push(refusal.for_what(&format!("SVV '{name}'")).at(&svv.place)),
                },
            }
        }
        for (at, (name, _)) in svvs.iter().enumerate() {
            let is_output = |port: &Port| self.kind(*port) == Kind::Output;
            if svvs[..at].iter().any(|(other, _)| other == name) && group.ports.iter().any(is_output) {
                self.refuse(
                    Class::SecondWriter,
                    format!("SVV '{name}' appears twice in the list for '{}', which is written to", group.name),
                    "give each SVV once",
                    &group.place,
                );
                self.mark([Where::Cell { cell: group.name.clone() }]);
            }
        }
        if svvs.iter().all(|(_, svv)| svv.unit.is_empty()) {
            self.check_units(group);
        }
        let cells: Vec<CellIndex> = svvs.iter().zip(&layouts).map(|((name, svv), layout)| self.svv_cell(name, svv, layout)).collect();
        for port in &group.ports {
            if let Some(binding) = self.bind_svvs_to(*port, svvs, &layouts, &cells, group) {
                self.attach(*port, binding);
            }
        }
    }

    fn svv_cell(&mut self, name: &str, svv: &Svv, layout: &Arc<Layout>) -> CellIndex {
        if let Some(cell) = self.svv_cells.get(&svv.id) {
            return *cell;
        }
        let kind = CellKind::Svv { id: svv.id, name: name.to_owned() };
        let cell = self.cell(kind, layout, svv.unit.clone(), Vec::new());
        self.svv_cells.insert(svv.id, cell);
        cell
    }

    fn bind_svvs_to(&mut self, port: Port, svvs: &[(&str, &Svv)], layouts: &[Arc<Layout>], cells: &[CellIndex], group: &Group) -> Option<Binding> {
        let place = &group.place;
        let cell = || Where::Cell { cell: group.name.clone() };
        let layout = self.layout(port)?;
        let item = self.flat(port.0).kind.item(port.1);
        let what = match svvs {
            [] => "an empty list of SVVs".to_owned(),
            [(name, svv)] => format!("SVV '{name}' ({}{})", layouts[0].text, comma(&svv.unit)),
            [(name, svv), ..] => format!("{} SVVs '{name}', … ({} each{})", svvs.len(), layouts[0].text, comma(&svv.unit)),
        };
        let is_element = |element: &Type| layouts.iter().all(|layout| layout.read == *element);
        let elements = matches!(&layout.read, Type::Array(element, count) if *count == svvs.len() && is_element(element));
        let whole = layouts.len() == 1 && layouts[0].text == layout.text;
        let svv_place = svvs.first().and_then(|(_, svv)| svv.place.clone());
        if !is_port(item.kind) || !whole && !elements {
            let described = self.described(port);
            let (why, remedy) = match (&layout.read, is_port(item.kind)) {
                (_, false) => ("it takes a channel of a physical device", "give a channel"),
                (Type::Array(_, count), _) if svvs.len() > 1 && *count != svvs.len() => ("the numbers of elements differ", "give one SVV for each element"),
                _ => ("types differ", "declare one of them as the other"),
            };
            let refusal = Refusal::new(Class::TypeMismatch, format!("cannot bind {what} to {described}: {why}")).remedy(remedy);
            let refusal = refusal.end(what, &svv_place).end(described, &self.flat(port.0).place).about([self.drawn(port), cell()]);
            self.refusals.push(refusal.at(&self.application.place).at(place));
            return None;
        }
        if let Some((name, svv)) = svvs.iter().find(|(_, svv)| !units_agree(&svv.unit, self.unit(port))) {
            let what = format!("SVV '{name}' ({}{})", layouts[0].text, comma(&svv.unit));
            self.refuse_units(what, &svv.place.clone(), port, place);
            self.mark([cell()]);
        }
        self.check_history(port, svvs, whole, place);
        Some(if whole { Binding::Cell(cells[0]) } else { Binding::Cells(cells.to_vec()) })
    }

    /// Checks that an input that reads a history is bound to a single SVV that keeps at least as many values.
    fn check_history(&mut self, port: Port, svvs: &[(&str, &Svv)], whole: bool, place: &Option<SourceLocation>) {
        let history = self.flat(port.0).kind.item(port.1).history;
        let Some((name, svv)) = svvs.first().filter(|_| history > 0) else { return };
        let described = self.described(port);
        let (class, why, remedy) = if !whole {
            (Class::TypeMismatch, "its values come from one SVV".to_owned(), format!("bind it to one SVV of type {}", self.type_of(port)))
        } else if svv.history < history {
            let kept = if svv.history == 0 { "keeps none".to_owned() } else { format!("keeps {}", svv.history) };
            (Class::TypeMismatch, format!("the SVV {kept}"), format!("create the SVV with history={history}"))
        } else {
            return;
        };
        let what = format!("SVV '{name}'");
        let refusal = Refusal::new(class, format!("cannot bind {what} to {described}: {why}")).remedy(remedy);
        let refusal = refusal.end(what, &svv.place).end(described, &self.flat(port.0).place).about([self.drawn(port)]);
        self.refusals.push(refusal.at(&self.application.place).at(place));
    }

    fn type_of(&self, port: Port) -> String {
        self.layout(port).map_or_else(String::new, |layout| layout.text.clone())
    }

    fn bind_channel(&mut self, group: &'a Group, device: &'a str, channel: usize, declared: &crate::configuration::Channel) {
        let layout = match Type::parse(&declared.type_text, &Default::default()) {
            Ok(read) => Layout::new(read),
            Err(refusal) => return self.refusals.push(refusal.for_what(&format!("channel '{}' of '{device}'", declared.name))),
        };
        let cell = match self.channel_cells.get(&(device, channel)) {
            Some(cell) => *cell,
            None => {
                let kind = CellKind::Channel { device: device.to_owned(), channel, write: declared.write };
                let cell = self.cell(kind, &layout, declared.unit.clone(), Vec::new());
                self.channel_cells.insert((device, channel), cell);
                cell
            }
        };
        for port in &group.ports {
            let item = self.flat(port.0).kind.item(port.1);
            let what = format!("channel '{device}.{}' ({}{})", declared.name, layout.text, comma(&declared.unit));
            let wrong = match (item.kind, declared.write) {
                (Kind::DeviceRead, false) | (Kind::DeviceWrite, true) => None,
                (Kind::DeviceRead, true) => Some(("the channel is written, but the block reads it", "give a channel that is read")),
                (Kind::DeviceWrite, false) => Some(("the channel is read, but the block writes it", "give a channel that is written")),
                _ => Some(("only a device item can be bound to a channel", "put library.read_channel or library.write_channel between them")),
            };
            let types_differ = self.layout(*port).is_some_and(|l| l.text != layout.text);
            let wrong = wrong.or(types_differ.then_some(("types differ", "declare one of them as the other")));
            if let Some((why, remedy)) = wrong {
                let described = self.described(*port);
                let refusal = Refusal::new(Class::TypeMismatch, format!("cannot bind {what} to {described}: {why}")).remedy(remedy);
                let refusal = refusal.end(described, &self.flat(port.0).place).about([self.drawn(*port)]);
                self.refusals.push(refusal.at(&self.application.place).at(&group.place));
                continue;
            }
            if !units_agree(&declared.unit, self.unit(*port)) {
                self.refuse_units(what, &None, *port, &group.place);
            }
            self.attach(*port, Binding::Cell(cell));
        }
    }

    fn check_ports(&mut self, first: Port, second: Port, origin: Origin) {
        let (place_a, place_b) = (self.flat(first.0).place.clone(), self.flat(second.0).place.clone());
        if self.types_differ(first, second, origin) {
            let (from, to) = (self.described(first), self.described(second));
            let refusal = Refusal::new(Class::TypeMismatch, format!("cannot bind {from} to {to}: types differ"));
            let refusal = refusal.remedy(self.remedy_of_types(first, second)).end(from, &place_a).end(to, &place_b);
            let refusal = refusal.about([self.drawn(second), self.drawn(first)]);
            self.refusals.push(refusal.at(&place_b).at(&self.checked.place));
        }
    }

    /// Returns the remedy for a type mismatch. If one port is an array whose elements have the type of the other, the elements can be
    /// bound one by one.
    fn remedy_of_types(&self, first: Port, second: Port) -> String {
        let is_array = |port: &Port| self.flat(port.0).kind.elements_max(port.1).is_some();
        let array = [first, second].into_iter().find(is_array).filter(|_| is_array(&first) != is_array(&second));
        let array = array.filter(|_| self.element(first) == self.element(second));
        let Some((block, item)) = array else { return "declare one of them as the other".to_owned() };
        let name = format!("{}.{}", self.flat(block).label, self.flat(block).kind.item(item).name);
        format!("bind its elements one by one: '{name}[0]', '{name}[1]'")
    }

    /// Returns true if two ports cannot share a data object. If a size is not known yet, only the element types are compared; an SVV that
    /// is passed later may be bound both to a number and to an array of one element.
    fn types_differ(&self, first: Port, second: Port, origin: Origin) -> bool {
        match (self.layout(first), self.layout(second)) {
            (Some(a), Some(b)) if origin != Origin::Parameter => !Arc::ptr_eq(&a, &b) && a.text != b.text,
            (Some(a), Some(b)) => a.text != b.text && alone(&a) != alone(&b),
            // The size of the array is still open: it may turn out to be 1.
            _ => match (self.element(first), self.element(second)) {
                (Some(a), Some(b)) => a != b && !self.is_one_of(second, &a) && !self.is_one_of(first, &b),
                _ => false,
            },
        }
    }

    /// Returns true if the complete type of a port is the element type of an array whose size is not known yet.
    fn is_one_of(&self, port: Port, element: &str) -> bool {
        matches!(&self.flat(port.0).kind.shapes[port.1], Shape::Fixed(layout) if layout.text == element)
    }

    /// Returns the element type of an array port, or the type of any other port.
    fn element(&self, port: Port) -> Option<String> {
        match &self.flat(port.0).kind.shapes[port.1] {
            Shape::Nothing => None,
            Shape::Sized(element) => Some(element.text.clone()),
            Shape::Fixed(layout) => match &layout.read {
                Type::Array(element, _) => Some(element.normalised()),
                _ => Some(layout.text.clone()),
            },
        }
    }

    /// Checks that all ports of a data object have the same unit: that of the writer or, if the writer has none, that of the first port
    /// that has one.
    fn check_units(&mut self, group: &Group) {
        let known = || group.ports.iter().filter(|port| !self.unit(**port).is_empty());
        let Some(&first) = known().find(|port| self.kind(**port) == Kind::Output).or_else(|| known().next()) else { return };
        let others: Vec<Port> = known().filter(|port| !units_agree(self.unit(first), self.unit(**port))).copied().collect();
        for port in others {
            let place = self.flat(port.0).place.clone();
            self.refuse_units(self.described(first), &self.flat(first.0).place.clone(), port, &place);
            self.mark([self.drawn(first)]);
        }
    }

    fn refuse_units(&mut self, what: String, what_place: &Option<SourceLocation>, port: Port, place: &Option<SourceLocation>) {
        let described = self.described(port);
        let refusal = Refusal::new(Class::UnitMismatch, format!("cannot bind {what} to {described}: units differ"));
        let refusal = refusal.remedy("declare one of them as the other, or convert with a gain that has a unit, for example k='2 N.m/rad'");
        let refusal = refusal.end(what, what_place).end(described, &self.flat(port.0).place).about([self.drawn(port)]);
        self.refusals.push(refusal.at(place).at(&self.checked.place));
    }

    fn cell(&mut self, kind: CellKind, layout: &Layout, unit: String, initial: Vec<u8>) -> CellIndex {
        self.cells.push(PlannedCell {
            kind,
            type_text: layout.text.clone(),
            size: layout.size,
            align: layout.align,
            unit,
            initial,
            writers: Vec::new(),
            readers: Vec::new(),
        });
        self.varies.push(true);
        self.cells.len() - 1
    }

    fn attach(&mut self, port: Port, binding: Binding) {
        let writes = matches!(self.kind(port), Kind::Output | Kind::DeviceWrite);
        let element = self.flat(port.0).kind.element_of(port.1);
        let whole = (port.0, element.map_or(port.1, |(whole, _)| whole));
        for cell in cells_of(&binding) {
            let cell = &mut self.cells[*cell];
            if writes { cell.writers.push(whole) } else { cell.readers.push(whole) }
        }
        match (element, cells_of(&binding)) {
            (Some((_, index)), &[cell, ..]) => drop(self.gathered.entry(whole).or_default().insert(index, cell)),
            _ => self.put(whole, binding),
        }
    }

    fn put(&mut self, port: Port, binding: Binding) {
        let declared = self.flat(port.0).mode(port.1);
        // A constant never has a new value and so cannot make an invocation due.
        let varies = cells_of(&binding).iter().any(|cell| self.varies[*cell]);
        let mode = if self.kind(port) == Kind::Input && !varies { Mode::Asynchronous } else { declared };
        let history = self.flat(port.0).kind.item(port.1).history;
        self.blocks[port.0].bindings.push(Bound { item: port.1, binding, mode, history });
    }

    pub fn kind(&self, port: Port) -> Kind {
        self.flat(port.0).kind.item(port.1).kind
    }
}

/// Returns the element type of a single-element array, or else the type itself.
fn alone(layout: &Layout) -> String {
    match &layout.read {
        Type::Array(element, 1) => element.normalised(),
        _ => layout.text.clone(),
    }
}

/// Returns the cells of a binding.
pub fn cells_of(binding: &Binding) -> &[CellIndex] {
    match binding {
        Binding::Cell(cell) => std::slice::from_ref(cell),
        Binding::Cells(cells) => cells,
    }
}

fn is_port(kind: Kind) -> bool {
    matches!(kind, Kind::Input | Kind::Output)
}

fn comma(unit: &str) -> String {
    if unit.is_empty() { String::new() } else { format!(", {unit}") }
}
