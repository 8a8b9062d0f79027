// SPDX-License-Identifier: Apache-2.0
//! Writing side: assigns numbers to objects.
use super::{AppendAs, CellAt, CodeName, DueAs, MemberAs, OpAs, Parcel, RemoteObject, ResponseAs, StampedAs, StepAs, TableAs, WatchAs, WayAs};
use kernel::QueueMember;
use kernel::copies::Aside;
use kernel::{Activation, Block, Cell, Device, Due, Edge, Extent, Inbound, Op, Outbound, Process, Response, RowsEnd, Script, Table};
use std::collections::{HashMap, HashSet};
use std::mem;
use std::sync::{Arc, Weak};

/// Record of the objects of one host that exist on the other side.
#[derive(Default)]
pub struct Writer {
    known: HashMap<usize, KnownObject>,
    /// Processes whose stages have been sent.
    staged: HashSet<u64>,
    inbounds: HashMap<u64, Weak<Inbound>>,
    rings: HashMap<u64, Weak<RowsEnd>>,
    last: u64,
    /// Number of objects at the last sweep.
    swept: usize,
    made: Vec<RemoteObject>,
    /// Devices that were referred to for the first time.
    devices: Vec<(String, Vec<device::Channel>)>,
}

/// An object that exists on the other side.
struct KnownObject {
    number: u64,
    is_held: Box<dyn Fn() -> bool + Send>,
    /// Further numbers of the same object, for the extents of a device.
    with: Vec<u64>,
}

/// Number of objects below which the writer does not search for unreferenced objects.
const SWEEP_MIN: usize = 256;

/// Lookup of the name by which the writer refers to a block's code.
pub type Names<'a> = &'a dyn Fn(&Block) -> Option<CodeName>;

impl Writer {
    /// Encodes a script as a parcel, with every object to which it refers for the first time. Fails with a message if `names` does not
    /// find the code of a block.
    pub fn parcel(&mut self, script: &Script, names: Names) -> Result<Parcel, String> {
        self.sweep();
        let ops = self.ops(&script.ops, names);
        let made = mem::take(&mut self.made);
        Ok(Parcel { made, ops: ops? })
    }

    /// Returns the devices to which scripts have referred for the first time since the last call, with their channels.
    pub fn take_devices(&mut self) -> Vec<(String, Vec<device::Channel>)> {
        mem::take(&mut self.devices)
    }

    /// Returns the remote name of a cell: its position in an extent. A new extent is sent with the next parcel.
    pub fn place(&mut self, cell: &Cell) -> CellAt {
        self.cell(cell)
    }

    /// Returns the inbound connection with this remote number.
    pub fn inbound_of(&self, number: u64) -> Option<Arc<Inbound>> {
        self.inbounds.get(&number)?.upgrade()
    }

    /// Returns the ring of rows with this remote number.
    pub fn rows_of(&self, number: u64) -> Option<Arc<RowsEnd>> {
        self.rings.get(&number)?.upgrade()
    }

    /// Returns the number of objects on the other side.
    pub fn len(&self) -> usize {
        self.known.len()
    }

    /// Returns true if the other side has no objects.
    pub fn is_empty(&self) -> bool {
        self.known.is_empty()
    }

    /// Makes the other side drop objects that are no longer referenced here. Does nothing until the number of objects has at least
    /// doubled since the last sweep.
    fn sweep(&mut self) {
        if self.known.len() < SWEEP_MIN.max(2 * self.swept) {
            return;
        }
        let mut numbers = Vec::new();
        self.known.retain(|_, known| {
            let is_held = (known.is_held)();
            if !is_held {
                numbers.push(known.number);
                numbers.append(&mut known.with);
            }
            is_held
        });
        for number in &numbers {
            self.staged.remove(number);
            self.inbounds.remove(number);
            self.rings.remove(number);
        }
        self.swept = self.known.len();
        self.made.push(RemoteObject::Forget { numbers });
    }

    /// Returns the number of an object, and true if the object is new.
    fn number<T: Send + Sync + 'static>(&mut self, of: &Arc<T>) -> (u64, bool) {
        if let Some(known) = self.known.get(&address(of)) {
            return (known.number, false);
        }
        self.last += 1;
        let held: Weak<T> = Arc::downgrade(of);
        let known = KnownObject { number: self.last, is_held: Box::new(move || held.strong_count() > 0), with: Vec::new() };
        self.known.insert(address(of), known);
        (self.last, true)
    }

    fn cell(&mut self, cell: &Cell) -> CellAt {
        let (extent, offset) = cell.place();
        CellAt(self.extent(extent), offset as u64, cell.len() as u64)
    }

    fn extent(&mut self, extent: &Arc<Extent>) -> u64 {
        let (number, is_new) = self.number(extent);
        if is_new {
            self.made.push(RemoteObject::Extent { number, bytes: extent.cell(0, extent.len()).load() });
        }
        number
    }

    fn cells<'a>(&mut self, cells: impl IntoIterator<Item = &'a Cell>) -> Vec<CellAt> {
        cells.into_iter().map(|cell| self.cell(cell)).collect()
    }

    fn pairs(&mut self, pairs: &[(Cell, Cell)]) -> Vec<(CellAt, CellAt)> {
        pairs.iter().map(|(from, to)| (self.cell(from), self.cell(to))).collect()
    }

    fn block(&mut self, block: &Arc<Block>, names: Names) -> Result<u64, String> {
        let (number, is_new) = self.number(block);
        if is_new {
            let Some(code) = names(block) else {
                self.known.remove(&address(block));
                return Err(format!("the code of block '{}' is in no module that can be sent", block.name()));
            };
            let (memory, initial, bound) = block.parts();
            let (memory, bound) = (self.cell(memory), bound.iter().map(|cell| cell.as_ref().map(|cell| self.cell(cell))).collect());
            self.made.push(RemoteObject::Block { number, id: block.id(), name: block.name().to_owned(), code, memory, initial: initial.to_vec(), bound });
        }
        Ok(number)
    }

    fn blocks(&mut self, blocks: &[Arc<Block>], names: Names) -> Result<Vec<u64>, String> {
        blocks.iter().map(|block| self.block(block, names)).collect()
    }

    fn activation(&mut self, activation: &Arc<Activation>) -> u64 {
        let (number, is_new) = self.number(activation);
        if is_new {
            let due = self.due(&activation.planned());
            let stamp = activation.stamp_cell().map(|stamp| self.cell(stamp));
            self.made.push(RemoteObject::Activation { number, due, stamp, budget_ns: activation.budget_ns() });
        }
        number
    }

    fn due(&mut self, due: &Due) -> DueAs {
        let mut drivers = |by: &[(Arc<Activation>, u32)]| by.iter().map(|(driver, n)| (self.activation(driver), *n)).collect();
        match due {
            Due::Interval => DueAs::Interval,
            Due::Driven { by } => DueAs::Driven(drivers(by)),
            Due::Queued { members, by } => {
                let by = drivers(by);
                DueAs::Queued(members.iter().map(|(inbound, member)| (self.inbound(inbound), *member as u32)).collect(), by)
            }
        }
    }

    /// Returns the number of a process, and sends its stages once they are set; a spread process has no stages on the other side.
    fn process(&mut self, process: &Arc<Process>, names: Names) -> Result<u64, String> {
        let (number, is_new) = self.number(process);
        if is_new {
            self.made.push(RemoteObject::Process { number, id: process.id(), created: process.created() });
        }
        if let (Some(stages), false, false) = (process.stages.get(), process.is_spread(), self.staged.contains(&number)) {
            self.staged.insert(number);
            let mut written = Vec::with_capacity(stages.len());
            for stage in stages {
                written.push(stage.watches.iter().map(|watch| self.watch(watch, names)).collect::<Result<_, _>>()?);
            }
            self.made.push(RemoteObject::Stages { process: number, stages: written });
        }
        Ok(number)
    }

    fn watch(&mut self, watch: &kernel::Watch, names: Names) -> Result<WatchAs, String> {
        let response = match &watch.response {
            Response::React { script, next } => ResponseAs::React { ops: self.ops(&Script::of(&**script).ops, names)?, next: *next },
            Response::Tell => ResponseAs::Tell,
            Response::Remember => ResponseAs::Remember,
        };
        Ok(WatchAs { block: watch.block, item: watch.item, condition: watch.condition, priority: watch.priority, response })
    }

    fn inbound(&mut self, inbound: &Arc<Inbound>) -> u64 {
        let (number, is_new) = self.number(inbound);
        if is_new && let Some(way) = &inbound.way {
            let (group, queue) = (self.cells(&inbound.group), self.members(&inbound.members));
            self.inbounds.insert(number, Arc::downgrade(inbound));
            self.made.push(RemoteObject::Inbound { number, way: WayAs::of(way), group, queue });
        }
        number
    }

    fn outbound(&mut self, outbound: &Arc<Outbound>) -> u64 {
        let (number, is_new) = self.number(outbound);
        if is_new && let Some(way) = &outbound.way {
            let (group, queue) = (self.cells(&outbound.group), self.members(&outbound.queue));
            self.made.push(RemoteObject::Outbound { number, way: WayAs::of(way), group, queue, wake: outbound.wake });
        }
        number
    }

    fn members(&mut self, members: &[QueueMember]) -> Vec<MemberAs> {
        let member = |member: &QueueMember| MemberAs {
            cell: self.cell(&member.cell),
            offset: member.offset as u64,
            activation: member.activation.as_ref().map(|activation| self.activation(activation)),
            ratio: member.ratio,
        };
        members.iter().map(member).collect()
    }

    fn device(&mut self, device: &Arc<Device>) -> u64 {
        let (number, is_new) = self.number(device);
        if is_new {
            let (readings, commands) = device.images();
            let (readings, commands) = (self.number(readings.place().0).0, self.number(commands.place().0).0);
            self.devices.push((device.name().to_owned(), device.channels().to_vec()));
            self.made.push(RemoteObject::Device { number, name: device.name().to_owned(), readings, commands });
        }
        number
    }

    fn edge(&mut self, edge: &Arc<Edge>) -> u64 {
        let (number, is_new) = self.number(edge);
        if is_new {
            let device = self.device(&edge.device);
            self.made.push(RemoteObject::Edge { number, device, channel: edge.index as u32, kind: edge.number, raises: edge.raises });
        }
        number
    }

    fn ring(&mut self, rows: &Arc<RowsEnd>) -> u64 {
        let (number, is_new) = self.number(rows);
        if is_new {
            self.rings.insert(number, Arc::downgrade(rows));
            let (row_len, depth) = rows.shape();
            self.made.push(RemoteObject::Rows { number, row_len: row_len as u64, depth: depth as u64 });
        }
        number
    }

    fn table(&mut self, table: &Table, names: Names) -> Result<TableAs, String> {
        // Before the blocks, because a device owns its cells.
        let devices = table.devices.iter().map(|device| self.device(device)).collect();
        let edges = table.edges.iter().map(|edge| self.edge(edge)).collect();
        let mut steps = Vec::with_capacity(table.steps.len());
        for step in &table.steps {
            let what = match (&step.block, step.aside) {
                (Some(block), _) => StepAs::Block(self.block(block, names)?),
                (None, Aside::Append(index)) => {
                    let appends = &table.appends[index as usize].1;
                    let written = |append: &kernel::Append| {
                        Ok(AppendAs {
                            block: self.block(&append.block, names)?,
                            ratio: append.ratio,
                            value: self.cell(&append.value),
                            window: self.cell(append.window.cell()),
                        })
                    };
                    StepAs::Append(appends.iter().map(written).collect::<Result<_, String>>()?)
                }
                (None, Aside::Copy(index)) => StepAs::Copy(self.pairs(&table.copies[index as usize].1)),
                (None, Aside::None) => StepAs::Copy(Vec::new()),
            };
            let activation = self.activation(&table.activations[step.slot as usize]);
            let process = self.process(&table.processes[step.process as usize], names)?;
            steps.push((what, activation, process, step.drivers.clone()));
        }
        let inbound = table.inbound.iter().map(|inbound| self.inbound(inbound)).collect();
        let outbound = table.outbound.iter().map(|outbound| self.outbound(outbound)).collect();
        let rows = table.rows.iter().map(|(_, rows)| (self.cells(&rows.cells), self.ring(&rows.writer))).collect();
        let mut stamped = Vec::with_capacity(table.marks.all.len());
        for of in table.marks.all.iter().map(|mark| &mark.of) {
            let history = of.history.as_ref().map(|(value, rows)| (self.cell(value), self.ring(rows)));
            stamped.push(StampedAs { block: self.block(&of.block, names)?, ratio: of.ratio, stamp: self.cell(&of.stamp), history });
        }
        Ok(TableAs { steps, inbound, outbound, devices, edges, rows, stamped })
    }

    fn ops(&mut self, ops: &[Op], names: Names) -> Result<Vec<OpAs>, String> {
        let mut written = Vec::with_capacity(ops.len());
        for op in ops {
            written.extend(self.op(op, names)?);
        }
        Ok(written)
    }

    fn op(&mut self, op: &Op, names: Names) -> Result<Option<OpAs>, String> {
        Ok(Some(match op {
            Op::Table(table) => OpAs::Table(self.table(table, names)?),
            Op::Store(cell, bytes) => OpAs::Store(self.cell(cell), bytes.to_vec()),
            Op::Append { value, window } => OpAs::Append { value: self.cell(value), window: self.cell(window.cell()) },
            Op::Fill { value, window } => OpAs::Fill { value: self.cell(value), window: self.cell(window.cell()) },
            Op::Copy(from, to) => OpAs::Copy(self.cell(from), self.cell(to)),
            Op::Reset(block) => OpAs::Reset(self.block(block, names)?),
            Op::Keep(to, from) => OpAs::Keep(self.block(to, names)?, self.block(from, names)?),
            Op::On(activation, every) => OpAs::On(self.activation(activation), *every),
            Op::Follow { activation, due, .. } => OpAs::Follow(self.activation(activation), self.due(due)),
            Op::Tune(activation, every) => OpAs::Tune(self.activation(activation), *every),
            Op::Off(activation) => OpAs::Off(self.activation(activation)),
            Op::Execute(blocks) => OpAs::Execute(self.blocks(blocks, names)?),
            Op::Stage { process, stage, generation } => OpAs::Stage { process: self.process(process, names)?, stage: *stage, generation: *generation },
            Op::Advance { process, generation, from, to } => {
                OpAs::Advance { process: self.process(process, names)?, generation: *generation, from: *from, to: *to }
            }
            Op::Forget => OpAs::Forget,
            // The word of a spread process is not on the other side; the supervisor waits for the acknowledgement instead.
            Op::While { process, .. } if process.is_spread() => return Ok(None),
            Op::While { process, generation } => OpAs::While { process: self.process(process, names)?, generation: *generation },
            Op::StartClock(process) => OpAs::StartClock(self.process(process, names)?),
            Op::StopClock(process) => OpAs::StopClock(self.process(process, names)?),
            Op::ResumeClock(process) => OpAs::ResumeClock(self.process(process, names)?),
            Op::KeepClock(to, from) => OpAs::KeepClock(self.process(to, names)?, self.process(from, names)?),
            Op::Capture(cells) => OpAs::Capture(self.cells(cells)),
            Op::Engage { device, channels } => OpAs::Engage { device: self.device(device), channels: channels.clone() },
            Op::Inherit(_) => return Err("what is taken over is where it is taken over".to_owned()),
            Op::Look(device) => OpAs::Look { device: self.device(device) },
            Op::Renew(renewal) => OpAs::Renew { device: self.device(renewal.device()), is_open: renewal.is_open() },
            Op::Safe { device, channels } => OpAs::Safe { device: self.device(device), channels: channels.clone() },
        }))
    }
}

fn address<T>(of: &Arc<T>) -> usize {
    Arc::as_ptr(of) as usize
}
