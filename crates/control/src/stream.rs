// SPDX-License-Identifier: Apache-2.0
//! The stream: a WebSocket that carries values, statistics, the log and end reports to its subscribers. A slow reader misses frames and
//! is notified of the number missed; it does not delay other readers.
use crate::frames::{self, StreamRequest, Topic};
use crate::presence::{SessionHold, present, shut_out};
use crate::refused::RefusedRequest;
use crate::scope::{self, CHANNELS_MAX, Scope, Slot};
use daemon::Failure;
use daemon::Service;
use daemon::Share;
use daemon::clock::told_ms;
use daemon::lanes::Lane;
use daemon::{Caller, Pass};

use crate::told::StreamAnswer;
use axum::extract::ws::{CloseFrame, Message, WebSocket, WebSocketUpgrade};
use axum::extract::{Extension, Query, State};
use axum::http::HeaderMap;
use axum::response::{IntoResponse, Response};
use model::refusal::Class;
use serde::Deserialize;
use std::collections::HashMap;
use std::sync::Arc;
use std::time::{Duration, Instant};
use tokio::sync::mpsc::error::TrySendError;
use tokio::sync::mpsc::{Receiver, Sender, channel};
use tokio::task::JoinHandle;

/// Name that a client may offer as a subprotocol; browsers require the answer to select one of those offered.
const PROTOCOL: &str = "opengpac.v1";
/// Maximum number of frames queued for a slow reader.
const FRAMES_MAX: usize = 64;
/// Maximum size of a client's frame, bytes.
const FRAME_MAX: usize = 64 << 10;
/// Maximum number of subscriptions of one stream.
const SUBSCRIPTIONS_MAX: usize = 32;
/// Maximum number of log entries or end reports in one frame.
const ENTRIES_MAX: usize = 256;
/// Period at which a silent reader is pinged, and time limit for sending a frame.
const PING: Duration = Duration::from_secs(5);
const LEAVE_MAX: Duration = Duration::from_secs(10);
/// Heartbeat period of a stream. A client that receives no heartbeat for longer can conclude that the connection is broken.
const BEAT: Duration = Duration::from_millis(250);
/// Maximum number of frames, including pings, that a client may send in one second: more than any program or page sends.
const FRAMES_EACH_SECOND: u32 = 256;
/// Close code for a stream whose client sends too many frames.
const TOO_MANY: u16 = 1008;
/// Close code for a stream whose caller has lost access; `PARTING_MAX` is the time limit for sending it.
const SHUT_OUT: u16 = 4401;
const PARTING_MAX: Duration = Duration::from_millis(500);

/// Query parameters of a stream. With `?hold=true`, its session is lost if the stream breaks; with `?beat=true`, the stream has a
/// heartbeat.
#[derive(Default, Deserialize)]
#[serde(default)]
pub(crate) struct Options {
    hold: bool,
    beat: bool,
}

pub(crate) async fn open(
    State(service): State<Arc<Service>>,
    Extension(caller): Extension<Caller>,
    Extension(pass): Extension<Pass>,
    slot: Option<Extension<Arc<crate::slots::Slot>>>,
    query: Result<Query<Options>, axum::extract::rejection::QueryRejection>,
    headers: HeaderMap,
    upgrade: Result<WebSocketUpgrade, axum::extract::ws::rejection::WebSocketUpgradeRejection>,
) -> Response {
    let opened = || -> Result<Response, Failure> {
        let presence = present(&service, &headers, &caller)?;
        let Query(options) = query.map_err(|why| Failure::new(Class::CallError, why.body_text(), "write ?hold=true, ?beat=true, both or neither"))?;
        let upgrade = upgrade.map_err(|why| Failure::new(Class::CallError, why.body_text(), "open the stream as a WebSocket"))?;
        let held = match (options.hold, presence) {
            (true, Some(presence)) => Some(SessionHold::new(service.clone(), presence.id.clone())),
            (true, None) => {
                return Err(Failure::new(Class::CallError, "there is no session to hold", "open one and send its ID in the header OpenGPAC-Session"));
            }
            (false, _) => None,
        };
        Ok(upgrade.protocols([PROTOCOL]).max_message_size(FRAME_MAX).max_frame_size(FRAME_MAX).on_upgrade(move |socket| async move {
            Stream { service, caller, pass, beats: options.beat }.serve(socket, held).await;
            // The stream keeps the slot of the connection from which it was upgraded.
            drop(slot);
        }))
    };
    opened().unwrap_or_else(|failure| RefusedRequest(failure).into_response())
}

/// Outgoing frame of a stream.
enum Frame {
    Text(Box<StreamAnswer>),
    /// Scope frame, which holds its slot until it has been sent.
    Binary(Vec<u8>, Slot),
}

impl Frame {
    fn text(told: StreamAnswer) -> Frame {
        Frame::Text(Box::new(told))
    }

    fn message(self) -> (Message, Option<Slot>) {
        match self {
            Frame::Text(told) => (Message::Text(serde_json::to_string(&told).expect("its maps have texts as keys").into()), None),
            Frame::Binary(bytes, slot) => (Message::Binary(bytes.into()), Some(slot)),
        }
    }
}

/// A running subscription of a stream, and its number of channels.
type RunningSubscription = (JoinHandle<()>, usize);
/// Subscriptions of one stream, by the names that its client chose.
type Subscriptions = HashMap<String, RunningSubscription>;

/// Counter of the frames that a client sends in one second.
struct Pace {
    since: Instant,
    frames: u32,
}

impl Pace {
    fn new() -> Pace {
        Pace { since: Instant::now(), frames: 0 }
    }

    /// Counts one more frame. Returns true if the limit is exceeded.
    fn count(&mut self) -> bool {
        if self.since.elapsed() >= Duration::from_secs(1) {
            *self = Pace::new();
        }
        self.frames += 1;
        self.frames > FRAMES_EACH_SECOND
    }
}

/// A stream and its caller.
struct Stream {
    service: Arc<Service>,
    caller: Caller,
    pass: Pass,
    /// True if the stream has a heartbeat.
    beats: bool,
}

impl Stream {
    /// Serves the stream until it ends or its caller loses access.
    async fn serve(&self, mut socket: WebSocket, mut held: Option<SessionHold>) {
        let mut subscriptions: Subscriptions = HashMap::new();
        let close = tokio::select! {
            close = self.carry(&mut socket, &mut held, &mut subscriptions) => close,
            failure = shut_out(&self.service, &self.caller, &self.pass) => {
                failure.refusals.into_iter().next().map(|refusal| CloseFrame { code: SHUT_OUT, reason: refusal.message.into() })
            }
        };
        subscriptions.values().for_each(|(subscription, _)| subscription.abort());
        if let Some(close) = close {
            let close = Message::Close(Some(close));
            // A client that does not read the close frame is disconnected anyway.
            let _told = tokio::time::timeout(PARTING_MAX, socket.send(close)).await;
        }
    }

    /// Carries frames in both directions until the stream ends. Returns the close frame for the client, if any.
    async fn carry(&self, socket: &mut WebSocket, held: &mut Option<SessionHold>, subscriptions: &mut Subscriptions) -> Option<CloseFrame> {
        let (sender, mut frames): (Sender<Frame>, Receiver<Frame>) = channel(FRAMES_MAX);
        let mut ping = tokio::time::interval(PING);
        let mut beat = tokio::time::interval(BEAT);
        beat.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Delay);
        let mut pace = Pace::new();
        loop {
            let leaving = tokio::select! {
                Some(frame) = frames.recv() => Some(frame.message()),
                _ = beat.tick(), if self.beats => Some(Frame::text(StreamAnswer { beat: Some(told_ms()), ..StreamAnswer::default() }).message()),
                _ = ping.tick() => Some((Message::Ping(Vec::new().into()), None)),
                received = socket.recv() => {
                    let Some(Ok(received)) = received else { return None };
                    // Each ping is answered, and the answers accumulate if the client does not read them.
                    if pace.count() {
                        let reason = format!("a client may send at most {FRAMES_EACH_SECOND} frames a second");
                        return Some(CloseFrame { code: TOO_MANY, reason: reason.into() });
                    }
                    match received {
                        Message::Text(text) => self.follow(&sender, subscriptions, &text).err().map(|f| Frame::text(StreamAnswer { errors: Some(f.refusals), ..StreamAnswer::default() }).message()),
                        Message::Close(_) => {
                            held.iter_mut().for_each(|held| held.in_order = true);
                            return None;
                        }
                        _ => None,
                    }
                }
            };
            if let Some((message, _slot)) = leaving
                && !matches!(tokio::time::timeout(LEAVE_MAX, socket.send(message)).await, Ok(Ok(())))
            {
                return None;
            }
        }
    }

    /// Executes the request in a frame from the client.
    fn follow(&self, sender: &Sender<Frame>, subscriptions: &mut Subscriptions, text: &str) -> Result<(), Failure> {
        let subscription = match frames::frame(text)? {
            StreamRequest::Unsubscribe(id) => {
                let Some((subscription, _)) = subscriptions.remove(&id) else {
                    return Err(Failure::new(Class::UnknownName, format!("there is no subscription '{id}'"), "use the id of an open subscription"));
                };
                subscription.abort();
                return Ok(());
            }
            StreamRequest::Subscribe { id, topic, names, every, raw, since } => Subscription { id, topic, names, every, raw, since, dropped: 0 },
        };
        let id = subscription.id.clone();
        subscriptions.retain(|_, (subscription, _)| !subscription.is_finished());
        if subscriptions.contains_key(&id) {
            return Err(Failure::new(Class::InUse, format!("there is already a subscription '{id}'"), "use another id"));
        }
        if subscriptions.len() >= SUBSCRIPTIONS_MAX {
            return Err(Failure::new(Class::LimitExceeded, format!("a stream can have at most {SUBSCRIPTIONS_MAX} subscriptions"), "open another stream"));
        }
        let channels = if subscription.topic == Topic::Scope { subscription.names.len() } else { 0 };
        if channels + subscriptions.values().map(|(_, channels)| channels).sum::<usize>() > CHANNELS_MAX {
            return Err(Failure::new(Class::LimitExceeded, format!("the scopes of a stream can have at most {CHANNELS_MAX} channels"), "open another stream"));
        }
        let (service, sender) = (self.service.clone(), sender.clone());
        let running = match subscription.topic {
            Topic::Scope => {
                let share = service.lanes.scopes.take(&self.caller, 1)?;
                tokio::spawn(subscription.observe(service, sender, share))
            }
            _ => tokio::spawn(subscription.run(service, sender, self.caller.clone())),
        };
        subscriptions.insert(id, (running, channels));
        Ok(())
    }
}

/// A subscription: its topic and its progress.
struct Subscription {
    id: String,
    topic: Topic,
    names: Vec<String>,
    every: Duration,
    raw: bool,
    /// Number of the next entry.
    since: u64,
    /// Number of frames or entries dropped since the last frame because the reader was too slow.
    dropped: u64,
}

impl Subscription {
    /// Sends the frames of a scope: a description of the channels, then every value.
    async fn observe(self, service: Arc<Service>, sender: Sender<Frame>, _share: Share) {
        let (id, every) = (self.id.clone(), self.every.min(scope::EVERY_MAX));
        let opened = tokio::task::spawn_blocking(move || Scope::open(&service.system, &self.id, &self.names)).await;
        let mut scope = match opened {
            Ok(Ok(scope)) => scope,
            Ok(Err(refusals)) => {
                // A client that does not accept this frame notices the silence.
                let _told = sender.send(Frame::text(StreamAnswer { errors: Some(refusals), ..StreamAnswer::of(&id) })).await;
                return;
            }
            Err(_) => return,
        };
        if sender.send(Frame::text(scope.head())).await.is_err() {
            return;
        }
        let mut tick = tokio::time::interval(if scope.is_virtual() { Duration::from_millis(1) } else { every });
        tick.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Delay);
        loop {
            tick.tick().await;
            let looked = tokio::task::spawn_blocking(move || {
                scope.wait(every);
                let frame = scope.next();
                (scope, frame)
            });
            let Ok((looked, frame)) = looked.await else { return };
            scope = looked;
            let Some((frame, slot)) = frame else {
                if sender.is_closed() {
                    return;
                }
                continue;
            };
            match sender.try_send(Frame::Binary(frame, slot)) {
                Ok(()) => scope.sent(),
                Err(TrySendError::Full(_)) => scope.pass_over(),
                Err(TrySendError::Closed(_)) => return,
            }
        }
    }

    async fn run(mut self, service: Arc<Service>, sender: Sender<Frame>, caller: Caller) {
        let mut tick = tokio::time::interval(self.every);
        tick.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Delay);
        loop {
            tick.tick().await;
            // The subscription waits for its turn like every other observation of its caller.
            let Ok(entered) = service.lanes.enter(Lane::Usual, &caller) else { return };
            let here = service.clone();
            let looked = entered.run(move || {
                let frame = self.look(&here);
                Ok((self, frame))
            });
            let Ok((this, looked)) = looked.await else { return };
            self = this;
            let (frame, next) = match looked {
                Ok(None) => continue,
                Ok(Some(found)) => found,
                Err(failure) => {
                    // A subscription that fails has ended; a client that reads too slowly notices the silence.
                    let _told = sender.try_send(Frame::text(StreamAnswer { errors: Some(failure.refusals), ..StreamAnswer::of(&self.id) }));
                    return;
                }
            };
            match sender.try_send(Frame::text(frame)) {
                Ok(()) => (self.since, self.dropped) = (next, 0),
                // Missed values are lost; missed entries are read again for as long as they are kept.
                Err(TrySendError::Full(_)) if matches!(self.topic, Topic::Svvs | Topic::Statistics) => self.dropped += 1,
                Err(TrySendError::Full(_)) => {}
                Err(TrySendError::Closed(_)) => return,
            }
        }
    }

    /// Returns the next frame and the number of the entry after it, or `None` if there is nothing new.
    fn look(&self, service: &Service) -> Result<Option<(StreamAnswer, u64)>, Failure> {
        let system = &service.system;
        let told = StreamAnswer { dropped: Some(self.dropped), ..StreamAnswer::of(&self.id) };
        Ok(match self.topic {
            Topic::Svvs => Some((StreamAnswer { svvs: Some(api::snapshot(system, &self.names, self.raw)?), ..told }, 0)),
            Topic::Statistics => Some((StreamAnswer { statistics: Some(system.statistics()), ..told }, 0)),
            Topic::Installed => {
                let version = system.installed_version().max(1);
                (version != self.since).then(|| (StreamAnswer { installed: Some(system.installed()), dropped: Some(0), ..told }, version))
            }
            // The scope has its own path: `observe`.
            Topic::Scope => None,
            Topic::Log => {
                let mut entries = system.log_since(self.since);
                entries.truncate(ENTRIES_MAX);
                let (Some(first), Some(last)) = (entries.first(), entries.last()) else { return Ok(None) };
                let (dropped, next) = (first.sequence.saturating_sub(self.since), last.sequence + 1);
                Some((StreamAnswer { log: Some(entries), dropped: Some(dropped), ..told }, next))
            }
            Topic::Ends => {
                let mut ends = system.ends_since(self.since);
                ends.truncate(ENTRIES_MAX);
                let (Some(first), Some(last)) = (ends.first(), ends.last()) else { return Ok(None) };
                service.note_ends();
                let (dropped, next) = (first.number.saturating_sub(self.since), last.number + 1);
                Some((StreamAnswer { ends: Some(ends), dropped: Some(dropped), ..told }, next))
            }
        })
    }
}
