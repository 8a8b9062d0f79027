// SPDX-License-Identifier: Apache-2.0
//! Remote side of a host: sources run by other hosts, connections to them, and their events.
use super::*;
use crate::locked::locked;
use crate::remote::Remote;
use crate::remote_sources::is_same;
use crate::trace::TapedReceiver;
use interconnect::{ConnectionSpec, EndError, Memory, Receiver, Sender};
use kernel::connection::End;
use kernel::{Nowhere, Process, Reach, Way, clock};
use std::any::Any;

impl Host {
    /// Adds a source run by `remote`; it is numbered like a local one.
    pub fn add_remote_source(&self, spec: SourceSpec, remote: Arc<dyn Remote>) -> SourceId {
        let id = self.reserve(spec);
        self.remote_sources.enter(id, remote);
        id
    }

    /// Reserves the number of a source that cannot be reached from this host.
    pub fn skip_source(&self, spec: SourceSpec) -> SourceId {
        self.reserve(spec)
    }

    /// Returns the host of a remote source; `None` for local sources.
    pub(crate) fn remote(&self, source: SourceId) -> Option<Arc<dyn Remote>> {
        self.remote_sources.of(source)
    }

    /// Returns the epoch of the host's clock, ns of CLOCK_MONOTONIC.
    pub fn epoch_ns(&self) -> i64 {
        self.epoch_ns
    }

    /// Creates a process with steps in `sources`. See [`Process::new`]. If all sources run in one remote processor process, the word is
    /// kept there.
    pub fn process(&self, id: u64, created: u64, sources: &[SourceId]) -> Arc<Process> {
        self.remote_sources.new_process(id, created, sources)
    }

    /// Creates a connection between two sources, over the appropriate carrier.
    pub fn connect(&self, spec: &ConnectionSpec) -> (End<dyn Sender>, End<dyn Receiver>) {
        let (writer, reader) = (SourceId(spec.writer), SourceId(spec.reader));
        let (from, to) = (self.remote(writer), self.remote(reader));
        if from.is_none() && to.is_none() {
            // Within a source, no carrier is needed.
            let (sender, receiver) = if writer == reader { Memory.connect(spec) } else { locked(&self.carrier).connect(spec) };
            let Some((trace, tape)) = self.trace().and_then(|trace| Some((trace, self.tape(reader)?))) else {
                return (sender.into(), receiver.into());
            };
            let way = Some(Way { number: trace.way(), spec: *spec, reach: Reach::Process });
            return (End { end: sender, way }, End { end: Box::new(TapedReceiver::recording(receiver, tape)), way });
        }
        let reach = self.reach(writer, reader);
        let way = Way { number: self.remote_sources.next_way(), spec: *spec, reach };
        if let (Some(from), Some(to)) = (&from, &to)
            && from.host().is_some() != to.host().is_some()
        {
            return self.relayed(way, &**from, &**to);
        }
        let sender: Box<dyn Sender> = match (&from, &to) {
            (None, Some(to)) => to.sender(way.number, spec).unwrap_or_else(|why| Box::new(self.unconnected(&way, &why))),
            _ => Box::new(Nowhere::default()),
        };
        let receiver: Box<dyn Receiver> = match (&from, &to) {
            (Some(from), None) => from.receiver(way.number, spec, self.raiser_of(reader)).unwrap_or_else(|why| Box::new(self.unconnected(&way, &why))),
            _ => Box::new(Nowhere::default()),
        };
        (End { end: sender, way: Some(way) }, End { end: receiver, way: Some(way) })
    }

    /// Creates a connection between a process of this host and another host, relayed by this process: each side has a connection to this
    /// process.
    fn relayed(&self, way: Way, from: &dyn Remote, to: &dyn Remote) -> (End<dyn Sender>, End<dyn Receiver>) {
        let to_here = |remote: &dyn Remote| Some(Way { reach: if remote.host().is_some() { Reach::Network } else { Reach::Host }, ..way });
        let wanted = self
            .remote_sources
            .relays
            .relay(&way, from, to, self.epoch_ns, |thread| self.keep_thread(thread))
            .inspect_err(|why| drop(self.unconnected(&way, why)))
            .ok();
        let kept = || wanted.clone().map(|wanted| wanted as Arc<dyn Any + Send + Sync>);
        let sender = Box::new(Nowhere::keeping(kept()));
        (End { end: sender, way: to_here(from) }, End { end: Box::new(Nowhere::keeping(kept())), way: to_here(to) })
    }

    /// Returns the distance between two sources.
    pub fn reach(&self, writer: SourceId, reader: SourceId) -> Reach {
        let (from, to) = (self.remote(writer), self.remote(reader));
        match (&from, &to) {
            _ if is_same(&from, &to) => Reach::Process,
            (from, to) if from.as_ref().and_then(|remote| remote.host()) == to.as_ref().and_then(|remote| remote.host()) => Reach::Host,
            _ => Reach::Network,
        }
    }

    /// Returns the placeholder for an end that could not be created, and reports that nothing will arrive through it.
    fn unconnected(&self, way: &Way, why: &EndError) -> Nowhere {
        let (writer, reader) = (SourceId(way.spec.writer), SourceId(way.spec.reader));
        self.tell(Event::Unconnected { writer, reader, message: why.message.clone() });
        Nowhere::of(&way.spec)
    }

    /// Returns the function that raises a source when a row has arrived from a remote source. Off the real-time path.
    pub fn raiser_of(&self, reader: SourceId) -> Box<dyn Fn() + Send + Sync> {
        let (source, epoch_ns) = (self.sources().get(reader.0 as usize).cloned(), self.epoch_ns);
        // If the commander names a source that does not exist, none is raised.
        let Some(source) = source else { return Box::new(|| ()) };
        Box::new(move || {
            if source.period_ns().is_none() {
                source.request(clock::monotonic_ns() - epoch_ns);
                source.bell().wake();
            }
        })
    }

    /// Forwards requests that a local channel raises for a remote source. A dedicated thread waits for them until the host is closed.
    ///
    /// # Errors
    /// Fails if the thread cannot be created.
    pub fn pass_on(&self, source: SourceId, request: Box<dyn Fn() + Send>) -> std::io::Result<()> {
        let raised = self.source(source);
        let body = move || {
            while !raised.closing.load(Ordering::Acquire) {
                let seen = raised.bell().rings();
                let requests = raised.requests.pending.swap(0, Ordering::SeqCst);
                (0..requests).for_each(|_| request());
                if requests == 0 {
                    raised.bell().sleep(seen, None);
                }
            }
        };
        let thread = std::thread::Builder::new().name("passes-on".into()).spawn(body)?;
        self.keep_thread(thread);
        Ok(())
    }

    /// Adds an event of a remote source to the events of the host, in order.
    pub fn tell(&self, event: Event) {
        let serial = self.shared.serials.fetch_add(1, Ordering::AcqRel);
        self.remote_sources.told(serial, event);
        self.shared.supervisor.ring();
    }

    /// Sets or clears the emergency-stop flag in all remote processors.
    pub fn stop_remote(&self, set: bool) {
        self.remote_sources.stop(set);
    }
}
