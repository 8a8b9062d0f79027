// SPDX-License-Identifier: Apache-2.0
//! Tests that panels can connect while hundreds of addresses flood the listener. Time is simulated, so the order of events is the same in
//! every run.
use super::*;
use api::Role;
use axum::Extension;
use daemon::{Caller, Pass};
use rustls::pki_types::{PrivateKeyDer, ServerName};
use std::net::IpAddr;
use tokio::io::{AsyncReadExt, AsyncWriteExt, DuplexStream, ReadHalf, WriteHalf};
use tokio::time::{Instant, sleep, sleep_until};
use tokio_rustls::TlsConnector;

/// Number of addresses that flood the listener.
const ADDRESSES: u16 = 500;
/// Number of connections that each of these addresses holds open at a time.
const OPEN_EACH: u16 = 3;
/// Delay before a flooding client reconnects.
const AGAIN: Duration = Duration::from_millis(100);
/// Time limit for the admission of a panel.
const PANEL_MAX: Duration = Duration::from_secs(1);
/// Header of a TLS record that declares a ClientHello of 512 bytes.
const BEGINS: [u8; 5] = [22, 3, 1, 2, 0];

/// A listener with TLS but without a socket.
#[derive(Clone)]
struct Door {
    slots: Arc<Slots>,
    router: Router,
    acceptor: TlsAcceptor,
    connector: TlsConnector,
}

impl Door {
    fn new() -> Door {
        let provider = Arc::new(rustls::crypto::ring::default_provider());
        let key = rcgen::generate_simple_self_signed(["localhost".to_owned()]).expect("a certificate");
        let private = PrivateKeyDer::try_from(key.key_pair.serialize_der()).expect("a key");
        let server = rustls::ServerConfig::builder_with_provider(provider.clone()).with_safe_default_protocol_versions().expect("versions");
        let server = server.with_no_client_auth().with_single_cert(vec![key.cert.der().clone()], private).expect("a certificate");
        let mut roots = rustls::RootCertStore::empty();
        roots.add(key.cert.der().clone()).expect("a certificate");
        let client = rustls::ClientConfig::builder_with_provider(provider).with_safe_default_protocol_versions().expect("versions");
        let client = client.with_root_certificates(roots).with_no_client_auth();
        let enter = |Extension(slot): Extension<Arc<Slot>>| async move {
            let panel = Caller { who: "token panel".to_owned(), role: Role::Operate, from: String::new() };
            slot.know(&panel, &Pass::Lasting, false).map_or("refused", |()| "in")
        };
        Door {
            slots: Arc::default(),
            router: Router::new().route("/", axum::routing::get(enter)),
            acceptor: TlsAcceptor::from(Arc::new(server)),
            connector: TlsConnector::from(Arc::new(client)),
        }
    }

    /// Accepts a new connection and returns the client's end.
    fn accept(&self, from: IpAddr) -> DuplexStream {
        let (client, server) = tokio::io::duplex(16 << 10);
        let slot = self.slots.enter(from);
        let served = greet(server, SocketAddr::new(from, 1), Some(self.acceptor.clone()), self.router.clone(), slot.clone());
        tokio::spawn(within(slot, served));
        client
    }

    /// Floods the listener from one address endlessly: each connection stays open until it gives way or `stays` has elapsed, and is then
    /// replaced.
    async fn knock(self, from: IpAddr, speaks: bool, stays: Duration) {
        loop {
            let mut stream = self.accept(from);
            if speaks {
                let _gone = stream.write_all(&BEGINS).await;
            }
            let _over = tokio::time::timeout(stays, stream.read(&mut [0; 64])).await;
            sleep(AGAIN).await;
        }
    }

    /// Connects as a panel with a one-way delay of `away`. Returns the answer (empty if the panel is not admitted) and the stream.
    async fn come(&self, from: IpAddr, away: Duration) -> (String, Option<tokio_rustls::client::TlsStream<DuplexStream>>) {
        let (near, far) = tokio::io::duplex(16 << 10);
        // The link behaves like a proxy that accepts at once: the greeting arrives later than the connection.
        join(far, self.accept(from), away);
        sleep(away).await;
        let name = ServerName::try_from("localhost").expect("a name");
        let connect = tokio::time::timeout(PANEL_MAX, self.connector.connect(name, near));
        let Ok(Ok(mut stream)) = connect.await else { return Default::default() };
        (ask(&mut stream).await, Some(stream))
    }
}

/// Makes a request over a persistent connection.
async fn ask(stream: &mut tokio_rustls::client::TlsStream<DuplexStream>) -> String {
    let mut answer = [0; 1024];
    let asked = stream.write_all(b"GET / HTTP/1.1\r\nhost: localhost\r\n\r\n").await;
    let length = if asked.is_ok() { stream.read(&mut answer).await.unwrap_or(0) } else { 0 };
    String::from_utf8_lossy(&answer[..length]).into_owned()
}

/// Connects two streams by a line that delays every byte by `takes`.
fn join(one: DuplexStream, other: DuplexStream, takes: Duration) {
    let ((one_read, one_write), (other_read, other_write)) = (tokio::io::split(one), tokio::io::split(other));
    tokio::spawn(carry(one_read, other_write, takes));
    tokio::spawn(carry(other_read, one_write, takes));
}

async fn carry(mut from: ReadHalf<DuplexStream>, mut to: WriteHalf<DuplexStream>, takes: Duration) {
    let (sent, mut arrives) = tokio::sync::mpsc::unbounded_channel();
    tokio::spawn(async move {
        while let Some((at, bytes)) = arrives.recv().await {
            sleep_until(at).await;
            let bytes: Vec<u8> = bytes;
            if bytes.is_empty() || to.write_all(&bytes).await.is_err() {
                let _over = to.shutdown().await;
                return;
            }
        }
    });
    loop {
        let mut bytes = vec![0; 4096];
        let length = from.read(&mut bytes).await.unwrap_or(0);
        bytes.truncate(length);
        if sent.send((Instant::now() + takes, bytes)).is_err() || length == 0 {
            return;
        }
    }
}

fn address(number: u16) -> IpAddr {
    IpAddr::from([10, 1, (number >> 8) as u8, number as u8])
}

/// Connects panels with one-way delays of 5 to 50 ms, each from a separate address, during a flood from all other addresses. Checks that
/// each is admitted, and that connections authenticated earlier are kept.
async fn panels_get_in(speaks: bool, stays: Duration) {
    let door = Door::new();
    let (before, known) = door.come(IpAddr::from([10, 9, 9, 9]), Duration::from_millis(20)).await;
    let mut known = known.expect("nobody knocks yet");
    assert!(before.ends_with("in"), "{before}");
    let knocking: Vec<_> = (0..ADDRESSES * OPEN_EACH).map(|number| tokio::spawn(door.clone().knock(address(number % ADDRESSES), speaks, stays))).collect();
    sleep(Duration::from_millis(300)).await;
    let panels: Vec<_> = (0..24_u8)
        .map(|number| {
            let (door, away) = (door.clone(), Duration::from_millis(5 + 45 * u64::from(number) / 23));
            tokio::spawn(async move {
                sleep(Duration::from_millis(u64::from(number) * 7)).await;
                door.come(IpAddr::from([10, 2, 0, number]), away).await.0
            })
        })
        .collect();
    for (number, panel) in panels.into_iter().enumerate() {
        let answer = panel.await.expect("it ends");
        assert!(answer.starts_with("HTTP/1.1 200") && answer.ends_with("in"), "panel {number}, {speaks}: '{answer}'");
    }
    assert!(ask(&mut known).await.ends_with("in"), "who was there before keeps its place");
    drop(known);
    let (again, _) = door.come(IpAddr::from([10, 9, 9, 9]), Duration::from_millis(50)).await;
    assert!(again.ends_with("in"), "who was there before comes back");
    knocking.iter().for_each(tokio::task::JoinHandle::abort);
}

#[tokio::test(start_paused = true)]
async fn panels_get_in_while_hundreds_of_addresses_knock_in_silence() {
    panels_get_in(false, Duration::from_millis(200)).await;
}

#[tokio::test(start_paused = true)]
async fn panels_get_in_while_hundreds_of_addresses_begin_handshakes() {
    panels_get_in(true, Duration::from_millis(1900)).await;
}
