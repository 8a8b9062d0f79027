// SPDX-License-Identifier: Apache-2.0
//! The stream: a WebSocket that carries values, statistics, the log and end reports to who subscribes. A slow reader loses frames, never holds
//! anybody up, and is told how many.
use crate::caller::Caller;
use crate::failure::Failure;
use crate::http::{Held, present};
use crate::places::Place;
use crate::scope::{self, CHANNELS_MAX, Scope, Slot};
use crate::service::Service;
use crate::wire::{self, Topic, Wanted};
use axum::extract::ws::{Message, WebSocket, WebSocketUpgrade};
use axum::extract::{Extension, Query, State};
use axum::http::HeaderMap;
use axum::response::{IntoResponse, Response};
use model::refusal::Class;
use serde::Deserialize;
use serde_json::{Value, json};
use std::collections::HashMap;
use std::sync::Arc;
use std::time::Duration;
use tokio::sync::mpsc::error::TrySendError;
use tokio::sync::mpsc::{Receiver, Sender, channel};
use tokio::task::JoinHandle;

/// What a client may name as its subprotocol; a browser needs one answered that it has named.
const PROTOCOL: &str = "opengpac.v1";
/// Frames that wait for a slow reader.
const FRAMES_MAX: usize = 64;
/// The largest frame of a client, bytes.
const FRAME_MAX: usize = 64 << 10;
/// Subscriptions of one stream.
const SUBSCRIPTIONS_MAX: usize = 16;
/// Entries of the log, or ends, in one frame.
const ENTRIES_MAX: usize = 256;
/// How often a silent reader is asked whether it is there, and how long a frame may take to leave.
const PING: Duration = Duration::from_secs(5);
const LEAVE_MAX: Duration = Duration::from_secs(10);

/// `?hold=true`: where the stream breaks, its session is lost.
#[derive(Default, Deserialize)]
#[serde(default)]
pub(crate) struct Options {
    hold: bool,
}

pub(crate) async fn open(
    State(service): State<Arc<Service>>,
    Extension(caller): Extension<Caller>,
    place: Option<Extension<Arc<Place>>>,
    query: Result<Query<Options>, axum::extract::rejection::QueryRejection>,
    headers: HeaderMap,
    upgrade: Result<WebSocketUpgrade, axum::extract::ws::rejection::WebSocketUpgradeRejection>,
) -> Response {
    let opened = || -> Result<Response, Failure> {
        let presence = present(&service, &headers, &caller)?;
        let Query(options) = query.map_err(|why| Failure::new(Class::CallError, why.body_text(), "write ?hold=true or nothing"))?;
        let upgrade = upgrade.map_err(|why| Failure::new(Class::CallError, why.body_text(), "the stream is a WebSocket"))?;
        let held = match (options.hold, presence) {
            (true, Some(presence)) => Some(Held::new(service.clone(), presence.id.clone())),
            (true, None) => {
                return Err(Failure::new(Class::CallError, "there is no session to hold", "open one and send its ID in the header OpenGPAC-Session"));
            }
            (false, _) => None,
        };
        Ok(upgrade.protocols([PROTOCOL]).max_message_size(FRAME_MAX).max_frame_size(FRAME_MAX).on_upgrade(move |socket| async move {
            serve(service, socket, held).await;
            // It has the place of the connection that it was before.
            drop(place);
        }))
    };
    opened().unwrap_or_else(IntoResponse::into_response)
}

/// What leaves on a stream.
enum Frame {
    Text(Value),
    /// Of a scope, with its slot until it has left.
    Binary(Vec<u8>, Slot),
}

impl Frame {
    fn message(self) -> (Message, Option<Slot>) {
        match self {
            Frame::Text(text) => (Message::Text(text.to_string().into()), None),
            Frame::Binary(bytes, slot) => (Message::Binary(bytes.into()), Some(slot)),
        }
    }
}

/// A subscription of a stream that runs, and how many channels it has.
type Running = (JoinHandle<()>, usize);

/// Serves one stream to its end.
async fn serve(service: Arc<Service>, mut socket: WebSocket, mut held: Option<Held>) {
    let (sender, mut frames): (Sender<Frame>, Receiver<Frame>) = channel(FRAMES_MAX);
    let mut subscriptions: HashMap<String, Running> = HashMap::new();
    let mut ping = tokio::time::interval(PING);
    loop {
        let leaving = tokio::select! {
            Some(frame) = frames.recv() => Some(frame.message()),
            _ = ping.tick() => Some((Message::Ping(Vec::new().into()), None)),
            received = socket.recv() => match received {
                Some(Ok(Message::Text(text))) => follow(&service, &sender, &mut subscriptions, &text).err().map(|f| Frame::Text(json!({ "errors": f.refusals })).message()),
                Some(Ok(Message::Close(_))) => {
                    held.iter_mut().for_each(|held| held.in_order = true);
                    break;
                }
                Some(Ok(_)) => None,
                Some(Err(_)) | None => break,
            },
        };
        if let Some((message, _slot)) = leaving
            && !matches!(tokio::time::timeout(LEAVE_MAX, socket.send(message)).await, Ok(Ok(())))
        {
            break;
        }
    }
    subscriptions.values().for_each(|(subscription, _)| subscription.abort());
}

/// Does what a frame of the client says.
fn follow(service: &Arc<Service>, sender: &Sender<Frame>, subscriptions: &mut HashMap<String, Running>, text: &str) -> Result<(), Failure> {
    let subscription = match wire::frame(text)? {
        Wanted::Unsubscribe(id) => {
            let Some((subscription, _)) = subscriptions.remove(&id) else {
                return Err(Failure::new(Class::UnknownName, format!("there is no subscription '{id}'"), "it was never made, or is over"));
            };
            subscription.abort();
            return Ok(());
        }
        Wanted::Subscribe { id, topic, names, every, raw, since } => Subscription { id, topic, names, every, raw, since, dropped: 0 },
    };
    let id = subscription.id.clone();
    subscriptions.retain(|_, (subscription, _)| !subscription.is_finished());
    if subscriptions.contains_key(&id) {
        return Err(Failure::new(Class::InUse, format!("there is a subscription '{id}' already"), "take another id"));
    }
    if subscriptions.len() >= SUBSCRIPTIONS_MAX {
        return Err(Failure::new(Class::LimitExceeded, format!("a stream has {SUBSCRIPTIONS_MAX} subscriptions at the most"), "open another stream"));
    }
    let channels = if subscription.topic == Topic::Scope { subscription.names.len() } else { 0 };
    if channels + subscriptions.values().map(|(_, channels)| channels).sum::<usize>() > CHANNELS_MAX {
        return Err(Failure::new(Class::LimitExceeded, format!("the scopes of a stream have {CHANNELS_MAX} channels at the most"), "open another stream"));
    }
    let (service, sender) = (service.clone(), sender.clone());
    let running = match subscription.topic {
        Topic::Scope => tokio::spawn(subscription.observe(service, sender)),
        _ => tokio::spawn(subscription.run(service, sender)),
    };
    subscriptions.insert(id, (running, channels));
    Ok(())
}

/// One subscription: what it looks at, and how far it has come.
struct Subscription {
    id: String,
    topic: Topic,
    names: Vec<String>,
    every: Duration,
    raw: bool,
    /// The next entry.
    since: u64,
    /// Frames, or entries, that the reader was too slow for, since the last frame.
    dropped: u64,
}

impl Subscription {
    /// The scope: what its channels are, then every value of them.
    async fn observe(self, service: Arc<Service>, sender: Sender<Frame>) {
        let (id, every) = (self.id.clone(), self.every.min(scope::EVERY_MAX));
        let opened = tokio::task::spawn_blocking(move || Scope::open(&service.system, &self.id, &self.names)).await;
        let mut scope = match opened {
            Ok(Ok(scope)) => scope,
            Ok(Err(refusals)) => {
                // Who does not take it learns it by the silence.
                let _told = sender.send(Frame::Text(json!({ "id": id, "errors": refusals }))).await;
                return;
            }
            Err(_) => return,
        };
        if sender.send(Frame::Text(scope.head())).await.is_err() {
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

    async fn run(mut self, service: Arc<Service>, sender: Sender<Frame>) {
        let mut tick = tokio::time::interval(self.every);
        tick.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Delay);
        loop {
            tick.tick().await;
            let service = service.clone();
            let looked = tokio::task::spawn_blocking(move || {
                let frame = self.look(&service);
                (self, frame)
            });
            let Ok((this, looked)) = looked.await else { return };
            self = this;
            let (frame, next) = match looked {
                Ok(None) => continue,
                Ok(Some(found)) => found,
                Err(failure) => {
                    // A subscription that fails is over; who reads too slowly learns it by its silence.
                    let _told = sender.try_send(Frame::Text(json!({ "id": self.id, "errors": failure.refusals })));
                    return;
                }
            };
            match sender.try_send(Frame::Text(frame)) {
                Ok(()) => (self.since, self.dropped) = (next, 0),
                // Values are gone; entries are looked at again, as long as they are kept.
                Err(TrySendError::Full(_)) if matches!(self.topic, Topic::Svvs | Topic::Statistics) => self.dropped += 1,
                Err(TrySendError::Full(_)) => {}
                Err(TrySendError::Closed(_)) => return,
            }
        }
    }

    /// The next frame and what comes after it; nothing where nothing is new.
    fn look(&self, service: &Service) -> Result<Option<(Value, u64)>, Failure> {
        let (name, content, first, next) = match self.topic {
            Topic::Svvs => {
                let values = session::read(&service.system, &self.names, self.raw)?;
                return Ok(Some((json!({ "id": self.id, "svvs": values, "dropped": self.dropped }), 0)));
            }
            Topic::Statistics => {
                let statistics = service.system.statistics_json();
                return Ok(Some((json!({ "id": self.id, "statistics": statistics, "dropped": self.dropped }), 0)));
            }
            Topic::Installed => {
                let version = service.system.installed_version().max(1);
                if version == self.since {
                    return Ok(None);
                }
                return Ok(Some((json!({ "id": self.id, "installed": service.system.installed_json(), "dropped": 0 }), version)));
            }
            // It has its own way: `observe`.
            Topic::Scope => return Ok(None),
            Topic::Log => {
                let mut entries = service.system.log_since(self.since);
                entries.truncate(ENTRIES_MAX);
                let (Some(first), Some(last)) = (entries.first(), entries.last()) else { return Ok(None) };
                ("log", json!(entries), first.sequence, last.sequence + 1)
            }
            Topic::Ends => {
                let mut ends = service.system.ends_since(self.since);
                ends.truncate(ENTRIES_MAX);
                let (Some(first), Some(last)) = (ends.first(), ends.last()) else { return Ok(None) };
                ("ends", json!(ends), first.number, last.number + 1)
            }
        };
        let mut frame = json!({ "id": self.id, "dropped": first.saturating_sub(self.since) });
        frame[name] = content;
        Ok(Some((frame, next)))
    }
}
