// SPDX-License-Identifier: Apache-2.0
//! Accepts connections up to the number of slots, and identifies the peer of each.
use crate::heard::HeardStream;
use crate::paced::PacedStream;
use crate::rest::Rest;
use crate::slots::{Doors, Slot, Slots};
use crate::strangers::Origin;
use crate::tls::{Tls, fingerprint};
use axum::Router;
use axum::body::Body;
use axum::http::{Request, header};
use daemon::Peer;
use hyper::body::Incoming;
use hyper::server::conn::http1;
use hyper::service::service_fn;
use hyper_util::rt::{TokioIo, TokioTimer};
use std::io::{self, ErrorKind};
use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;
use tokio::io::{AsyncRead, AsyncWrite};
use tokio::net::{TcpListener, TcpSocket, UnixListener};
use tokio::runtime::Runtime;
use tokio_rustls::TlsAcceptor;
use tower::ServiceExt;

/// Time limit for an authenticated caller to send headers, and maximum idle time of its connection.
const IDLE_MAX: Duration = Duration::from_secs(60);
/// Maximum time for which the peer may accept no bytes of an answer.
const TAKE_MAX: Duration = Duration::from_secs(10);
/// Backlog of pending connections, if the operating system allows that many.
const BACKLOG: u32 = 1024;
/// Maximum size of the headers, bytes.
const HEADERS_BYTES_MAX: usize = 16 << 10;
/// Back-off after a failed `accept` (no descriptors left).
const REST: Duration = Duration::from_millis(100);

/// Socket on which connections are accepted.
pub(crate) enum Listener {
    Unix(UnixListener),
    Tcp(TcpListener, Option<Arc<Tls>>),
}

impl Listener {
    pub fn unix(runtime: &Runtime, listener: std::os::unix::net::UnixListener) -> io::Result<Listener> {
        listener.set_nonblocking(true)?;
        let _inside = runtime.enter();
        Ok(Listener::Unix(UnixListener::from_std(listener)?))
    }
}

/// Listens on TCP. The backlog is large enough for a burst, because a client whose connection attempt is dropped retries only after a
/// second.
pub(crate) fn bound(runtime: &Runtime, address: SocketAddr) -> io::Result<TcpListener> {
    let _inside = runtime.enter();
    let socket = if address.is_ipv4() { TcpSocket::new_v4() } else { TcpSocket::new_v6() }?;
    socket.set_reuseaddr(true)?;
    socket.bind(address)?;
    socket.listen(BACKLOG)
}

/// Accepts connections as long as the runtime exists.
pub(crate) async fn accept(listener: Listener, router: Router, doors: Doors) {
    match listener {
        Listener::Unix(listener) => accept_unix(listener, router, doors.socket).await,
        Listener::Tcp(listener, tls) => accept_tcp(listener, tls, router, doors.network).await,
    }
}

/// Backs off after a failed `accept`, unless the error concerns only that connection.
async fn rest(why: &io::Error) {
    if !matches!(why.kind(), ErrorKind::ConnectionAborted | ErrorKind::ConnectionReset | ErrorKind::Interrupted) {
        tokio::time::sleep(REST).await;
    }
}

/// Accepts connections on the Unix socket, which only its owner can reach. Its slots have the same limits as those of TCP, so that a
/// program of the owner that opens too many connections cannot lock out a stop.
async fn accept_unix(listener: UnixListener, router: Router, slots: Arc<Slots>) {
    loop {
        let accepted = match listener.accept().await {
            Ok((stream, _)) => stream.peer_cred().map(|about| (stream, about.uid())),
            Err(why) => Err(why),
        };
        match accepted {
            Ok((stream, uid)) => {
                let slot = slots.enter(Origin::Socket);
                tokio::spawn(within(slot.clone(), serve(stream, Peer::Unix { uid }, router.clone(), Some(slot))));
            }
            Err(why) => rest(&why).await,
        }
    }
}

/// Accepts connections on TCP without making any of them wait: if there are too many, an unauthenticated connection gives way to the new
/// one.
async fn accept_tcp(listener: TcpListener, tls: Option<Arc<Tls>>, router: Router, slots: Arc<Slots>) {
    loop {
        match listener.accept().await {
            Ok((stream, from)) => {
                // A connection that is already closed ends at its first read.
                let _gone = stream.set_nodelay(true);
                let slot = slots.enter(from.ip());
                let served = greet(stream, from, tls.as_ref().map(|tls| tls.acceptor()), router.clone(), slot.clone());
                tokio::spawn(within(slot, served));
            }
            Err(why) => rest(&why).await,
        }
    }
}

/// Serves a connection as long as it holds its slot.
async fn within(slot: Arc<Slot>, served: impl Future<Output = ()>) {
    tokio::select! {
        () = served => {}
        () = slot.over() => {}
    }
}

/// Serves one network connection, after its handshake if TLS is used.
async fn greet<S: AsyncRead + AsyncWrite + Unpin + Send + 'static>(
    stream: S,
    from: SocketAddr,
    acceptor: Option<TlsAcceptor>,
    router: Router,
    slot: Arc<Slot>,
) {
    let stream = HeardStream { stream, slot: Some(slot.clone()) };
    let Some(acceptor) = acceptor else { return serve(stream, Peer::Tcp { from }, router, Some(slot)).await };
    // TLS itself notifies a client that does not speak it, or whose certificate is unknown.
    let Ok(stream) = acceptor.accept(stream).await else { return };
    let certificate = stream.get_ref().1.peer_certificates().and_then(|chain| chain.first()).map(fingerprint);
    serve(stream, Peer::Tls { from, certificate }, router, Some(slot)).await;
}

/// Serves one connection until it ends.
async fn serve<S: AsyncRead + AsyncWrite + Unpin + Send + 'static>(stream: S, peer: Peer, router: Router, slot: Option<Arc<Slot>>) {
    let service = service_fn(move |mut request: Request<Incoming>| {
        request.extensions_mut().insert(peer.clone());
        if let Some(slot) = &slot {
            request.extensions_mut().insert(slot.clone());
        }
        let router = router.clone();
        async move {
            // A client that sends `Expect` has not sent its body yet.
            let asks_first = request.headers().contains_key(header::EXPECT);
            let rest = Rest::default();
            let answer = router.oneshot(request.map(|body| Body::new(rest.of(body)))).await;
            if !asks_first {
                rest.take().await;
            }
            answer
        }
    });
    let connection = http1::Builder::new()
        .timer(TokioTimer::new())
        .header_read_timeout(IDLE_MAX)
        .max_buf_size(HEADERS_BYTES_MAX)
        .serve_connection(TokioIo::new(PacedStream::new(stream, TAKE_MAX)), service)
        .with_upgrades();
    // A broken connection has ended; its holders notice that by themselves.
    let _over = connection.await;
}

#[cfg(test)]
mod knocking;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::strangers::STRANGER_MAX;
    use std::net::IpAddr;
    use tokio::io::{AsyncReadExt, AsyncWriteExt};

    /// Returns the client's end of a connection that is served like a TCP connection.
    fn connected(router: Router, room: usize) -> tokio::io::DuplexStream {
        let (client, server) = tokio::io::duplex(room);
        let from = SocketAddr::new(IpAddr::from([10, 0, 0, 1]), 1);
        let slot = Arc::new(Slots::default()).enter(from.ip());
        tokio::spawn(within(slot.clone(), serve(server, Peer::Tcp { from }, router, Some(slot))));
        client
    }

    /// Sends `begin`, then `again` repeatedly with a pause before each, until the peer stops accepting data. Returns the elapsed time and
    /// the bytes received.
    async fn drip(mut client: tokio::io::DuplexStream, begin: &[u8], again: &[u8], pause: Duration) -> (Duration, Vec<u8>) {
        let begun = tokio::time::Instant::now();
        let mut answer = Vec::new();
        let mut taken = client.write_all(begin).await.is_ok();
        while taken && begun.elapsed() < Duration::from_secs(300) {
            tokio::time::sleep(pause).await;
            taken = client.write_all(again).await.is_ok();
        }
        client.read_to_end(&mut answer).await.expect("it is over");
        (begun.elapsed(), answer)
    }

    #[tokio::test(start_paused = true)]
    async fn whoever_sends_its_head_slowly_has_the_time_of_a_stranger_and_no_more() {
        let client = connected(Router::new(), 1024);
        let (lasted, answer) = drip(client, b"GET / HTTP/1.1\r\nhost: localhost\r\nslow: ", b"a", Duration::from_millis(500)).await;
        assert!(answer.is_empty() && lasted <= STRANGER_MAX + Duration::from_secs(1), "{lasted:?}");
    }

    #[tokio::test(start_paused = true)]
    async fn a_flood_of_headers_is_refused_at_once() {
        let client = connected(Router::new(), 1024);
        let (lasted, answer) = drip(client, b"GET / HTTP/1.1\r\nhost: localhost\r\n", &b"flood: abcdefgh\r\n".repeat(64), Duration::ZERO).await;
        assert!(lasted < Duration::from_secs(1), "{lasted:?}");
        assert!(answer.starts_with(b"HTTP/1.1 431"), "{}", String::from_utf8_lossy(&answer));
    }

    #[tokio::test(start_paused = true)]
    async fn a_client_that_is_refused_before_it_has_sent_everything_hears_why() {
        let mut client = connected(Router::new(), 256);
        client.write_all(b"POST /nowhere HTTP/1.1\r\nhost: localhost\r\nconnection: close\r\ncontent-length: 65536\r\n\r\n").await.expect("it takes the head");
        // All answers that do not need the body have been sent.
        tokio::time::sleep(Duration::from_millis(1)).await;
        client.write_all(&[b' '; 65536]).await.expect("it takes the body");
        let mut answer = Vec::new();
        client.read_to_end(&mut answer).await.expect("it answers");
        assert!(answer.starts_with(b"HTTP/1.1 404"), "{}", String::from_utf8_lossy(&answer));
    }

    #[tokio::test(start_paused = true)]
    async fn whoever_never_sends_the_rest_of_a_refused_body_is_not_waited_for() {
        let mut client = connected(Router::new(), 1024);
        let begun = tokio::time::Instant::now();
        client.write_all(b"POST /nowhere HTTP/1.1\r\nhost: localhost\r\nconnection: close\r\ncontent-length: 65536\r\n\r\n").await.expect("it takes the head");
        let mut answer = Vec::new();
        client.read_to_end(&mut answer).await.expect("it answers");
        assert!(answer.starts_with(b"HTTP/1.1 404") && begun.elapsed() < Duration::from_secs(3), "{:?}", begun.elapsed());
    }

    #[tokio::test(start_paused = true)]
    async fn whoever_does_not_speak_tls_fast_enough_has_the_time_of_a_stranger() {
        let (mut client, server) = tokio::io::duplex(1024);
        let slot = Arc::new(Slots::default()).enter(IpAddr::from([10, 0, 0, 1]));
        let key = rcgen::generate_simple_self_signed(["localhost".to_owned()]).expect("a certificate");
        let private = rustls::pki_types::PrivateKeyDer::try_from(key.key_pair.serialize_der()).expect("a key");
        let config = rustls::ServerConfig::builder_with_provider(Arc::new(rustls::crypto::ring::default_provider()))
            .with_safe_default_protocol_versions()
            .expect("versions")
            .with_no_client_auth()
            .with_single_cert(vec![key.cert.der().clone()], private)
            .expect("a certificate");
        let handshake = TlsAcceptor::from(Arc::new(config)).accept(server);
        let served = tokio::spawn(within(slot, async move { drop(handshake.await) }));
        let begun = tokio::time::Instant::now();
        // This is the head of a record that announces a greeting of 512 bytes; one byte per second follows.
        client.write_all(&[22, 3, 1, 2, 0]).await.expect("it takes it");
        while !served.is_finished() {
            let _over = client.write_all(&[1]).await;
            tokio::time::sleep(Duration::from_secs(1)).await;
        }
        assert!(begun.elapsed() <= STRANGER_MAX + Duration::from_secs(1), "{:?}", begun.elapsed());
    }

    #[tokio::test(start_paused = true)]
    async fn whoever_takes_nothing_of_an_answer_is_cut_off() {
        let large = Router::new().route("/", axum::routing::get(|| async { "x".repeat(1 << 20) }));
        let (mut client, server) = tokio::io::duplex(1024);
        let served = tokio::spawn(serve(server, Peer::Unix { uid: 0 }, large, None));
        client.write_all(b"GET / HTTP/1.1\r\nhost: localhost\r\n\r\n").await.expect("it takes it");
        let begun = tokio::time::Instant::now();
        served.await.expect("it ends");
        assert!(begun.elapsed() <= TAKE_MAX + Duration::from_secs(1), "{:?}", begun.elapsed());
    }
}
