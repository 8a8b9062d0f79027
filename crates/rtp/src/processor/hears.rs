// SPDX-License-Identifier: Apache-2.0
//! Reception of messages from a remote processor until the processor is lost.
use super::{LOOK, Processor, Wire};
use crate::protocol::{Beat, News, opened};
use crate::script_context::unconnected;
use crate::shared::locked;
use interconnect::Link;
use kernel::{BlockId, Event, SourceId};
use process_kit::Silence;
use runtime::Host;
use runtime::encoding::EventAs;
use std::sync::atomic::Ordering;
use std::sync::{Arc, Weak};
use std::time::Duration;

impl Processor {
    /// Receives messages until the processor disconnects.
    pub(super) fn hear(&self, host: &Weak<Host>, link: &Arc<dyn Link>) {
        let (silence_max, mut silence) = (Duration::from_millis(self.silence_ms.load(Ordering::Relaxed)), Silence::begins());
        let why = loop {
            let received = link.receive(LOOK);
            silence.looked(matches!(received, Ok(Some(_))));
            self.tell_lost(host);
            match received {
                Ok(Some(bytes)) => {
                    let Some(host) = host.upgrade() else { return };
                    match opened::<News>(&bytes).and_then(|news| self.take_in(&host, news)) {
                        Ok(()) => {}
                        Err(why) => break format!("its message cannot be understood: {why}"),
                    }
                }
                Ok(None) if silence.lasted() > silence_max => break format!("nothing has been received from it for {} s", silence_max.as_secs_f64()),
                Ok(None) => {}
                Err(_) => break self.reason(),
            }
        };
        link.close();
        self.lose(host, &why);
    }

    /// Reports connections to the processor that were lost because their memory was overwritten.
    fn tell_lost(&self, host: &Weak<Host>) {
        let lost = locked(&self.near).as_mut().map(|near| near.lost()).unwrap_or_default();
        if let Some(host) = host.upgrade().filter(|_| !lost.is_empty()) {
            lost.into_iter().for_each(|lost| host.tell(unconnected(lost)));
        }
    }

    fn reason(&self) -> String {
        let running = locked(&self.running).clone();
        let Some(running) = running else { return "the link to it broke".to_owned() };
        let stuck = running.stuck().and_then(|place| locked(&self.sources).iter().filter(|(.., here)| *here).nth(place).map(|(_, spec, _)| spec.name.clone()));
        let stuck = stuck.map(|name| format!(": timer '{name}' no longer fired")).unwrap_or_default();
        format!("its process {}{stuck}", running.cause())
    }

    fn lose(&self, host: &Weak<Host>, why: &str) {
        *locked(&self.wire) = Wire::default();
        self.is_leaving.store(true, Ordering::Release);
        if !self.closing.load(Ordering::Acquire)
            && let Some(host) = host.upgrade()
        {
            self.tell_loss(&host, why);
        }
        *locked(&self.lost) = Some(why.to_owned());
        // Last, so that a thread that sees it down finds that its loss has been reported.
        self.is_up.store(false, Ordering::Release);
        self.is_leaving.store(false, Ordering::Release);
        self.answered.notify_all();
    }

    fn tell_loss(&self, host: &Host, why: &str) {
        let sources: Vec<SourceId> = locked(&self.sources).iter().filter(|(.., here)| *here).map(|(source, ..)| *source).collect();
        let blocks: Vec<Option<BlockId>> = sources.iter().enumerate().map(|(place, source)| self.ran(place, *source)).collect();
        // A source that was not running a block was lost together with one that was.
        let culprit = blocks.iter().copied().flatten().next();
        for (source, block) in sources.into_iter().zip(blocks) {
            host.tell(Event::Gone { source, block: block.or(culprit), message: why.to_owned(), time_ns: host.now_ns() });
        }
    }

    /// Returns the block that the processor's source with index `place` was running, if known.
    fn ran(&self, place: usize, source: SourceId) -> Option<BlockId> {
        let step = locked(&self.running).as_ref()?.step(place)?;
        locked(&self.tables).get(&source)?.get(step as usize).copied().flatten()
    }

    fn take_in(&self, host: &Host, news: News) -> Result<(), String> {
        match news {
            News::Welcome { .. } => return Err("a second welcome".to_owned()),
            News::Broken { message } => return Err(message),
            News::Answer { ticket, answer } => {
                if let Some(waiting) = locked(&self.answers).get_mut(&ticket) {
                    *waiting = Some(answer);
                }
                self.answered.notify_all();
            }
            News::Events { events, devices } => {
                self.take_devices(&devices);
                for event in events {
                    if let EventAs::Told(Event::Stopped { source, .. }) = &event {
                        locked(&self.statistics).entry(*source).or_default().stopped = true;
                    }
                    let event = event.event(|submission| locked(&self.wire).scripts.remove(&submission));
                    event.into_iter().for_each(|event| host.tell(event));
                }
            }
            News::Raised { source } => host.request(source),
            News::Beat(beat) => self.take_beat(beat),
        }
        Ok(())
    }

    fn take_devices(&self, states: &[(String, runtime::DeviceState)]) {
        let devices = locked(&self.devices);
        for (name, state) in states {
            if let Some(device) = devices.get(name).and_then(Weak::upgrade) {
                state.report(&device);
            }
        }
    }

    fn take_beat(&self, beat: Beat) {
        locked(&self.statistics).extend(beat.sources);
        locked(&self.block_times).extend(beat.blocks);
        self.take_devices(&beat.devices);
        locked(&self.counted).extend(beat.counted);
        let wire = locked(&self.wire);
        for (number, brought, late) in beat.inbounds {
            if let Some(inbound) = wire.writer.inbound_of(number) {
                inbound.report(brought, late);
            }
        }
        for (number, rows) in beat.rows {
            if let Some(ring) = wire.writer.rows_of(number) {
                rows.iter().for_each(|(lost, number, time_ns, bytes)| ring.repeat(*lost, *number, *time_ns, bytes));
            }
        }
    }
}
