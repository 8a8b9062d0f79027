// SPDX-License-Identifier: Apache-2.0
//! A remote processor as seen by its host: remote sources, and the words of their processes.
use super::*;

impl RemoteWord for Processor {
    fn take(&self, process: u64, generation: u32, insist: bool) -> Option<TakeResult> {
        match self.ask(TAKE, |ticket| Order::Take { ticket, process, generation, insist }) {
            // A process that it has not received yet has entered no stage.
            Ok(Answer::Taken(taken)) => Some(taken.unwrap_or(TakeResult::Before)),
            _ => None,
        }
    }
}

impl Remote for Processor {
    fn submit(&self, source: SourceId, script: Box<Script>) {
        let mut wire = locked(&self.wire);
        wire.last += 1;
        let submission = wire.last;
        if let Some(Op::Table(table)) = script.ops.iter().find(|op| matches!(op, Op::Table(_))) {
            locked(&self.tables).insert(source, table.blocks());
        }
        match wire.writer.parcel(&script, &module::name_of) {
            Ok(parcel) => {
                wire.scripts.insert(submission, script);
                wire.send(&Order::Work { source, submission, parcel });
            }
            Err(why) => {
                drop(wire);
                if let Some(host) = locked(&self.host).upgrade() {
                    host.tell(Event::Gone { source, block: None, message: why, time_ns: host.now_ns() });
                }
            }
        }
    }

    fn request(&self, source: SourceId) {
        self.send(&Order::Request { source });
    }

    fn restart(&self, source: SourceId) {
        locked(&self.statistics).entry(source).or_default().stopped = false;
        self.send(&Order::Restart { source });
    }

    fn statistics(&self, source: SourceId) -> Statistics {
        locked(&self.statistics).get(&source).cloned().unwrap_or_default()
    }

    fn probe(&self, source: SourceId, for_ns: u64) {
        self.send(&Order::Probe { source, for_ns });
    }

    fn block_times(&self, block: BlockId) -> BlockTimes {
        locked(&self.block_times).get(&block).copied().unwrap_or_default()
    }

    fn enter(&self, process: u64, stage: u16, generation: u32) {
        self.send(&Order::Enter { process, stage, generation });
    }

    fn stop(&self, set: bool) {
        self.send(&Order::Stop { set });
    }

    fn host(&self) -> Option<&str> {
        self.host_name.as_deref()
    }

    fn sender(&self, number: u64, spec: &ConnectionSpec) -> Result<Box<dyn Sender>, EndError> {
        locked(&self.near).as_mut().ok_or_else(unreached)?.sender(number, spec)
    }

    fn receiver(&self, number: u64, spec: &ConnectionSpec, raise: Box<dyn Fn() + Send + Sync>) -> Result<Box<dyn Receiver>, EndError> {
        locked(&self.near).as_mut().ok_or_else(unreached)?.receiver(number, spec, raise)
    }

    fn close(&self) {
        self.closing.store(true, Ordering::Release);
        // Processes that were not taken over continue without this side, as before.
        let running = locked(&self.running).take().filter(|_| !self.is_adopted());
        if let Some(running) = &running {
            running.ending();
        }
        self.send(&Order::Close);
        if let Some(running) = running {
            running.end();
        }
        // Scripts submitted after a loss wait without end, and hold processes that hold this.
        (*locked(&self.wire), *locked(&self.near)) = (Wire::default(), None);
    }
}
