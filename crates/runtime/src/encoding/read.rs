// SPDX-License-Identifier: Apache-2.0
//! Reading side: creates the objects that scripts refer to.
use super::{AppendAs, CellAt, CodeName, DueAs, MemberAs, OpAs, Parcel, RemoteObject, ResponseAs, StampedAs, StepAs, TableAs, WatchAs, WayAs};
use crate::renewal::Renewal;
use device::Direction;
use interconnect::{Receiver, RowsReader, Sender};
use kernel::process::CAPTURED_MAX;
use kernel::{
    Activation, Append, Block, Cell, Device, Due, Edge, Extent, Inbound, Op, Outbound, Process, Response, Rows, Script, SourceId, Stage, StampedValue, Step,
    StepKind, Table, Watch, Way, Window,
};
use kernel::{QueueMember, RowsEnd};
use opengpac::abi::Descriptor;
use std::any::Any;
use std::collections::HashMap;
use std::sync::Arc;

/// Environment of a reader: code, devices and connections of the process in which the sources run.
pub trait Ground {
    /// Returns the code of a block, and the owner that keeps it loaded.
    fn code(&self, name: &CodeName) -> Option<(&'static Descriptor, Arc<dyn Any + Send + Sync>)>;
    /// Returns a device that was opened here.
    fn device(&self, name: &str) -> Option<Arc<Device>>;
    /// Returns the writing end of a connection.
    fn sender(&mut self, way: &Way) -> Box<dyn Sender>;
    /// Returns the reading end of a connection.
    fn receiver(&mut self, way: &Way) -> Box<dyn Receiver>;
}

/// Objects to which the scripts for the sources of one processor process have referred so far.
#[derive(Default)]
pub struct Reader {
    objects: HashMap<u64, Object>,
}

enum Object {
    Extent(Arc<Extent>),
    Block(Arc<Block>),
    Activation(Arc<Activation>),
    Process(Arc<Process>),
    Inbound(Arc<Inbound>),
    Outbound(Arc<Outbound>),
    Rows(Arc<RowsEnd>),
    Device(Arc<Device>),
    Edge(Arc<Edge>),
}

/// Maximum size of a connection or ring in bytes; requests for more are invalid.
const BYTES_MAX: u64 = 1 << 30;

type ReadResult<T> = Result<T, String>;

macro_rules! finder {
    ($name:ident, $variant:ident, $of:ty, $word:literal) => {
        fn $name(&self, number: u64) -> ReadResult<&Arc<$of>> {
            match self.objects.get(&number) {
                Some(Object::$variant(found)) => Ok(found),
                _ => Err(format!("there is no {} {number}", $word)),
            }
        }
    };
}

impl Reader {
    finder!(extent, Extent, Extent, "extent");
    finder!(block, Block, Block, "block");
    finder!(activation, Activation, Activation, "activation");
    finder!(process, Process, Process, "process");
    finder!(inbound, Inbound, Inbound, "inbound connection");
    finder!(outbound, Outbound, Outbound, "outbound connection");
    finder!(ring, Rows, RowsEnd, "ring of rows");
    finder!(device, Device, Device, "device");
    finder!(edge, Edge, Edge, "edge");

    /// Creates the objects of a parcel and returns its script, numbered `submission`. Fails with a message if the parcel is inconsistent;
    /// objects created before the failure are kept.
    pub fn open(&mut self, submission: u64, parcel: Parcel, ground: &mut dyn Ground) -> ReadResult<Box<Script>> {
        for made in parcel.made {
            self.make(made, ground)?;
        }
        Ok(Box::new(Script { id: submission, ops: self.ops(parcel.ops)? }))
    }

    /// Returns the process whose identifier in events is `id`.
    pub fn process_of(&self, id: u64) -> Option<&Arc<Process>> {
        self.objects.values().find_map(|object| match object {
            Object::Process(process) if process.id() == id => Some(process),
            _ => None,
        })
    }

    /// Returns the cell with this remote name; `None` if no parcel has referred to it yet, or it has been forgotten.
    pub fn find(&self, at: CellAt) -> Option<Cell> {
        self.cell(at).ok()
    }

    /// Returns the inbound connections, with their numbers.
    pub fn inbounds(&self) -> impl Iterator<Item = (u64, &Arc<Inbound>)> {
        self.objects.iter().filter_map(|(number, object)| if let Object::Inbound(inbound) = object { Some((*number, inbound)) } else { None })
    }

    /// Returns the blocks.
    pub fn blocks(&self) -> impl Iterator<Item = &Arc<Block>> {
        self.objects.values().filter_map(|object| if let Object::Block(block) = object { Some(block) } else { None })
    }

    /// Returns a reader of each ring of rows, with the ring's number.
    pub fn rings(&self) -> impl Iterator<Item = (u64, RowsReader)> {
        self.objects.iter().filter_map(|(number, object)| if let Object::Rows(rows) = object { Some((*number, rows.reader())) } else { None })
    }

    /// Returns the sources raised by channels of devices.
    pub fn raised(&self) -> impl Iterator<Item = SourceId> {
        self.objects.values().filter_map(|object| if let Object::Edge(edge) = object { Some(edge.raises) } else { None })
    }

    /// Returns the number of objects.
    pub fn len(&self) -> usize {
        self.objects.len()
    }

    /// Returns true if there are no objects.
    pub fn is_empty(&self) -> bool {
        self.objects.is_empty()
    }

    fn keep(&mut self, number: u64, object: Object) -> ReadResult<()> {
        match self.objects.insert(number, object) {
            None => Ok(()),
            Some(_) => Err(format!("number {number} was given twice")),
        }
    }

    fn make(&mut self, made: RemoteObject, ground: &mut dyn Ground) -> ReadResult<()> {
        match made {
            RemoteObject::Extent { number, bytes } => {
                let extent = Extent::new(bytes.len());
                extent.cell(0, bytes.len()).store(&bytes);
                self.keep(number, Object::Extent(extent))
            }
            RemoteObject::Block { number, id, name, code, memory, initial, bound } => {
                let Some((descriptor, module)) = ground.code(&code) else {
                    return Err(format!("the code of block '{name}' ({} of module {}) is missing here", code.block, code.module));
                };
                let bound = bound.into_iter().map(|cell| cell.map(|cell| self.cell(cell)).transpose()).collect::<ReadResult<Vec<_>>>()?;
                let block = Block::like((id, &name), descriptor, module, self.cell(memory)?, &initial, &bound)?;
                self.keep(number, Object::Block(Arc::new(block)))
            }
            RemoteObject::Activation { number, due, stamp, budget_ns } => {
                let (due, stamp) = (self.due(due)?, stamp.map(|stamp| self.cell(stamp)).transpose()?);
                if stamp.as_ref().is_some_and(|stamp| stamp.len() < kernel::STAMP_LEN) {
                    return Err(format!("the stamp of activation {number} is too short"));
                }
                self.keep(number, Object::Activation(Activation::with_budget(due, stamp, budget_ns)))
            }
            RemoteObject::Process { number, id, created } => self.keep(number, Object::Process(Process::new(id, created))),
            RemoteObject::Stages { process, stages } => self.set_stages(process, stages),
            RemoteObject::Inbound { number, way, group, queue } => {
                let (way, group, queue) = self.connection(&way, group, queue)?;
                self.keep(number, Object::Inbound(Inbound::new(ground.receiver(&way), group, queue)))
            }
            RemoteObject::Outbound { number, way, group, queue, wake } => {
                let (way, group, queue) = self.connection(&way, group, queue)?;
                self.keep(number, Object::Outbound(Outbound::new(ground.sender(&way), group, queue, wake)))
            }
            RemoteObject::Rows { number, row_len, depth } => {
                if depth < 2 || row_len.checked_mul(depth).is_none_or(|bytes| bytes > BYTES_MAX) {
                    return Err(format!("a ring of {depth} rows of {row_len} bytes cannot be created"));
                }
                let (writer, _) = interconnect::rows(row_len as usize, depth as usize);
                self.keep(number, Object::Rows(RowsEnd::new(writer)))
            }
            RemoteObject::Device { number, name, readings, commands } => {
                let device = ground.device(&name).ok_or_else(|| format!("device '{name}' was not opened here"))?;
                let (read, written) = device.images();
                let (read, written) = (read.place().0.clone(), written.place().0.clone());
                self.keep(readings, Object::Extent(read))?;
                self.keep(commands, Object::Extent(written))?;
                self.keep(number, Object::Device(device))
            }
            RemoteObject::Edge { number, device, channel, kind, raises } => {
                let device = self.device(device)?;
                let found = device.channels().get(channel as usize).filter(|found| found.direction == Direction::Read && found.len <= size_of::<u64>());
                if found.is_none() {
                    return Err(format!("channel {channel} of device '{}' cannot raise a source", device.name()));
                }
                let edge = Edge::new(device, channel as usize, kind, raises);
                self.keep(number, Object::Edge(edge))
            }
            RemoteObject::Forget { numbers } => {
                for number in numbers {
                    self.objects.remove(&number);
                }
                Ok(())
            }
        }
    }

    fn cell(&self, CellAt(extent, offset, len): CellAt) -> ReadResult<Cell> {
        let found = self.extent(extent)?.find(offset as usize, len as usize);
        found.ok_or_else(|| format!("a cell of {len} bytes at {offset} does not lie in extent {extent}"))
    }

    fn cells(&self, cells: Vec<CellAt>) -> ReadResult<Vec<Cell>> {
        cells.into_iter().map(|cell| self.cell(cell)).collect()
    }

    fn pair(&self, (from, to): (CellAt, CellAt)) -> ReadResult<(Cell, Cell)> {
        let (from, to) = (self.cell(from)?, self.cell(to)?);
        if from.len() == to.len() { Ok((from, to)) } else { Err("a copy needs two cells of the same length".to_owned()) }
    }

    fn window(&self, value: CellAt, window: CellAt) -> ReadResult<(Cell, Window)> {
        let (value, window) = (self.cell(value)?, self.cell(window)?);
        if value.is_empty() || window.is_empty() || !window.len().is_multiple_of(value.len()) {
            return Err(format!("a window of {} bytes does not hold values of {}", window.len(), value.len()));
        }
        let len = value.len();
        Ok((value, Window::new(window, len)))
    }

    fn due(&self, due: DueAs) -> ReadResult<Due> {
        let drivers = |by: Vec<(u64, u32)>| by.into_iter().map(|(driver, n)| Ok((self.activation(driver)?.clone(), n))).collect::<ReadResult<_>>();
        Ok(match due {
            DueAs::Interval => Due::Interval,
            DueAs::Driven(by) => Due::Driven { by: drivers(by)? },
            DueAs::Queued(members, by) => {
                let member = |(number, member): (u64, u32)| {
                    let inbound = self.inbound(number)?;
                    let exists = (member as usize) < inbound.members.len();
                    if exists { Ok((inbound.clone(), member as usize)) } else { Err(format!("inbound connection {number} has no member {member}")) }
                };
                Due::Queued { members: members.into_iter().map(member).collect::<ReadResult<_>>()?, by: drivers(by)? }
            }
        })
    }

    fn connection(&self, way: &WayAs, group: Vec<CellAt>, queue: Vec<MemberAs>) -> ReadResult<(Way, Vec<Cell>, Vec<QueueMember>)> {
        let group = self.cells(group)?;
        let prefix = kernel::row_prefix(queue.len()) as u64;
        let mut members = Vec::with_capacity(queue.len());
        for member in queue {
            let cell = self.cell(member.cell)?;
            let end = member.offset.checked_add(cell.len() as u64);
            if member.offset < prefix || end.is_none_or(|end| end > way.queue_row_len) {
                return Err(format!("a member of connection {} does not lie in its row", way.number));
            }
            let activation = member.activation.map(|activation| self.activation(activation).cloned()).transpose()?;
            members.push(QueueMember { cell, offset: member.offset as usize, activation, ratio: member.ratio });
        }
        let group_len: usize = group.iter().map(Cell::len).sum();
        let queue_fits = way.queue_row_len.checked_mul(way.queue_depth.max(1)).is_some_and(|bytes| bytes <= BYTES_MAX);
        if group_len as u64 != way.asynchronous_len || !queue_fits || (!members.is_empty() && way.queue_depth == 0) {
            return Err(format!("the length of connection {} does not match its members", way.number));
        }
        Ok((way.way(), group, members))
    }

    fn set_stages(&mut self, process: u64, stages: Vec<Vec<WatchAs>>) -> ReadResult<()> {
        let process = self.process(process)?.clone();
        let mut made = Vec::with_capacity(stages.len());
        for watches in stages {
            let watch = |of: WatchAs| {
                let response = match of.response {
                    ResponseAs::Tell => Response::Tell,
                    ResponseAs::Remember if of.condition < 64 => Response::Remember,
                    ResponseAs::Remember => return Err(format!("condition {} cannot be latched", of.condition)),
                    ResponseAs::React { ops, next } => {
                        let script = Script { id: 0, ops: self.ops(ops)? };
                        if script.ops.iter().any(Op::swaps) || script.captured_len() > CAPTURED_MAX {
                            return Err("a reaction swaps a table or captures too much".to_owned());
                        }
                        Response::React { script: Arc::new(script), next }
                    }
                };
                Ok(Watch { block: of.block, item: of.item, condition: of.condition, priority: of.priority, response })
            };
            made.push(Stage { watches: watches.into_iter().map(watch).collect::<ReadResult<_>>()? });
        }
        if process.stages.get().is_some() {
            return Err(format!("the stages of process {} were already set", process.id()));
        }
        process.set_stages(made);
        Ok(())
    }

    fn append(&self, AppendAs { block, ratio, value, window }: AppendAs) -> ReadResult<Append> {
        let (value, window) = self.window(value, window)?;
        Ok(Append { block: self.block(block)?.clone(), ratio, value, window })
    }

    fn stamped(&self, StampedAs { block, ratio, stamp, history }: StampedAs) -> ReadResult<StampedValue> {
        let stamp = self.cell(stamp)?;
        if stamp.len() < kernel::STAMP_LEN {
            return Err(format!("the stamp of a value of block {block} is too short"));
        }
        let history = history.map(|(value, number)| {
            let (value, rows) = (self.cell(value)?, self.ring(number)?.clone());
            if value.len() > rows.shape().0 {
                return Err(format!("ring of rows {number} is too short for its value"));
            }
            Ok((value, rows))
        });
        Ok(StampedValue { block: self.block(block)?.clone(), ratio, stamp, history: history.transpose()? })
    }

    fn table(&self, table: TableAs) -> ReadResult<Table> {
        let mut steps = Vec::with_capacity(table.steps.len());
        for (index, (what, activation, process, drivers)) in table.steps.into_iter().enumerate() {
            let kind = match what {
                StepAs::Block(block) => StepKind::Block(self.block(block)?.clone()),
                StepAs::Copy(pairs) => StepKind::Copy(pairs.into_iter().map(|pair| self.pair(pair)).collect::<ReadResult<_>>()?),
                StepAs::Append(appends) => StepKind::Append(appends.into_iter().map(|append| self.append(append)).collect::<ReadResult<_>>()?),
            };
            if drivers.iter().any(|driver| *driver as usize >= index) {
                return Err(format!("step {index} is driven by a later one"));
            }
            steps.push(Step { kind, activation: self.activation(activation)?.clone(), process: self.process(process)?.clone(), drivers });
        }
        let mut rows = Vec::with_capacity(table.rows.len());
        for (cells, number) in table.rows {
            let (cells, writer) = (self.cells(cells)?, self.ring(number)?.clone());
            if cells.iter().map(Cell::len).sum::<usize>() > writer.shape().0 {
                return Err(format!("ring of rows {number} is too short for its cells"));
            }
            rows.push(Rows { cells, writer });
        }
        let inbound = table.inbound.into_iter().map(|number| self.inbound(number).cloned()).collect::<ReadResult<_>>()?;
        let outbound = table.outbound.into_iter().map(|number| self.outbound(number).cloned()).collect::<ReadResult<_>>()?;
        let devices = table.devices.into_iter().map(|number| self.device(number).cloned()).collect::<ReadResult<_>>()?;
        let edges = table.edges.into_iter().map(|number| self.edge(number).cloned()).collect::<ReadResult<_>>()?;
        let stamped = table.stamped.into_iter().map(|stamped| self.stamped(stamped)).collect::<ReadResult<_>>()?;
        Ok(Table::new(steps, inbound, outbound, devices, None).with_rows(rows).with_edges(edges).with_stamped(stamped))
    }

    fn ops(&self, ops: Vec<OpAs>) -> ReadResult<Vec<Op>> {
        ops.into_iter().map(|op| self.op(op)).collect()
    }

    fn op(&self, op: OpAs) -> ReadResult<Op> {
        Ok(match op {
            OpAs::Table(table) => Op::Table(Box::new(self.table(table)?)),
            OpAs::Store(cell, bytes) => {
                let cell = self.cell(cell)?;
                if cell.len() != bytes.len() {
                    return Err(format!("a cell of {} bytes cannot hold {}", cell.len(), bytes.len()));
                }
                Op::Store(cell, bytes.into())
            }
            OpAs::Append { value, window } => self.window(value, window).map(|(value, window)| Op::Append { value, window })?,
            OpAs::Fill { value, window } => self.window(value, window).map(|(value, window)| Op::Fill { value, window })?,
            OpAs::Copy(from, to) => Op::Copy(self.cell(from)?, self.cell(to)?),
            OpAs::Reset(block) => Op::Reset(self.block(block)?.clone()),
            OpAs::Keep(to, from) => Op::Keep(self.block(to)?.clone(), self.block(from)?.clone()),
            OpAs::On(activation, every) => Op::On(self.activation(activation)?.clone(), every),
            OpAs::Follow(activation, due) => self.activation(activation)?.follow(self.due(due)?),
            OpAs::Tune(activation, every) => Op::Tune(self.activation(activation)?.clone(), every),
            OpAs::Off(activation) => Op::Off(self.activation(activation)?.clone()),
            OpAs::Execute(blocks) => Op::Execute(blocks.into_iter().map(|block| self.block(block).cloned()).collect::<ReadResult<_>>()?),
            OpAs::Stage { process, stage, generation } => Op::Stage { process: self.process(process)?.clone(), stage, generation },
            OpAs::Advance { process, generation, from, to } => Op::Advance { process: self.process(process)?.clone(), generation, from, to },
            OpAs::Forget => Op::Forget,
            OpAs::While { process, generation } => Op::While { process: self.process(process)?.clone(), generation },
            OpAs::StartClock(process) => Op::StartClock(self.process(process)?.clone()),
            OpAs::StopClock(process) => Op::StopClock(self.process(process)?.clone()),
            OpAs::ResumeClock(process) => Op::ResumeClock(self.process(process)?.clone()),
            OpAs::KeepClock(to, from) => Op::KeepClock(self.process(to)?.clone(), self.process(from)?.clone()),
            OpAs::Capture(cells) => Op::Capture(self.cells(cells)?),
            OpAs::Engage { device, channels } => Op::Engage { device: self.channels(device, &channels)?, channels },
            OpAs::Safe { device, channels } => Op::Safe { device: self.channels(device, &channels)?, channels },
            OpAs::Look { device } => Op::Look(self.device(device)?.clone()),
            OpAs::Renew { device, is_open } => Op::Renew(Box::new(Renewal::recorded(self.device(device)?.clone(), is_open))),
        })
    }

    /// Returns the device, if it has these channels.
    fn channels(&self, device: u64, channels: &[u16]) -> ReadResult<Arc<Device>> {
        let device = self.device(device)?;
        let known = device.channels().len();
        let exist = channels.iter().all(|channel| usize::from(*channel) < known);
        if exist { Ok(device.clone()) } else { Err(format!("device '{}' has only {known} channels", device.name())) }
    }
}
