// SPDX-License-Identifier: Apache-2.0
//! Accepting connections: as many as there are places for, each with who is at its other end.
use crate::caller::Peer;
use crate::places::{Place, Places};
use crate::tls::fingerprint;
use axum::Router;
use axum::body::Body;
use axum::http::Request;
use hyper::body::Incoming;
use hyper::server::conn::http1;
use hyper::service::service_fn;
use hyper_util::rt::{TokioIo, TokioTimer};
use std::io::{self, ErrorKind};
use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;
use tokio::io::{AsyncRead, AsyncWrite};
use tokio::net::{TcpListener, TcpStream, UnixListener};
use tokio::runtime::Runtime;
use tokio::sync::Semaphore;
use tokio_rustls::TlsAcceptor;
use tower::ServiceExt;

/// Connections of the Unix socket, which only its owner reaches; those of TCP have their [`Places`].
const CONNECTIONS_MAX: usize = 64;
/// How long headers may take to arrive, and how long a connection may be idle, of who is known.
const IDLE_MAX: Duration = Duration::from_secs(60);
/// The largest headers, bytes.
const HEADERS_BYTES_MAX: usize = 16 << 10;
/// How long accepting rests after it failed (no descriptors left).
const REST: Duration = Duration::from_millis(100);

/// What listens.
pub(crate) enum Listener {
    Unix(UnixListener),
    Tcp(TcpListener, Option<TlsAcceptor>),
}

impl Listener {
    pub fn unix(runtime: &Runtime, listener: std::os::unix::net::UnixListener) -> io::Result<Listener> {
        listener.set_nonblocking(true)?;
        let _inside = runtime.enter();
        Ok(Listener::Unix(UnixListener::from_std(listener)?))
    }

    pub fn tcp(runtime: &Runtime, listener: std::net::TcpListener, acceptor: Option<TlsAcceptor>) -> io::Result<Listener> {
        listener.set_nonblocking(true)?;
        let _inside = runtime.enter();
        Ok(Listener::Tcp(TcpListener::from_std(listener)?, acceptor))
    }
}

/// Accepts connections as long as the runtime lives.
pub(crate) async fn accept(listener: Listener, router: Router) {
    match listener {
        Listener::Unix(listener) => accept_unix(listener, router).await,
        Listener::Tcp(listener, acceptor) => accept_tcp(listener, acceptor, router).await,
    }
}

/// Takes a rest after accepting failed, unless it failed with that one connection.
async fn rest(why: &io::Error) {
    if !matches!(why.kind(), ErrorKind::ConnectionAborted | ErrorKind::ConnectionReset | ErrorKind::Interrupted) {
        tokio::time::sleep(REST).await;
    }
}

async fn accept_unix(listener: UnixListener, router: Router) {
    let places = Arc::new(Semaphore::new(CONNECTIONS_MAX));
    loop {
        let Ok(place) = places.clone().acquire_owned().await else { return };
        let accepted = match listener.accept().await {
            Ok((stream, _)) => stream.peer_cred().map(|about| (stream, about.uid())),
            Err(why) => Err(why),
        };
        match accepted {
            Ok((stream, uid)) => {
                let served = serve(stream, Peer::Unix { uid }, router.clone(), None);
                tokio::spawn(async move {
                    served.await;
                    drop(place);
                });
            }
            Err(why) => rest(&why).await,
        }
    }
}

/// Nobody waits to be accepted: a stranger gives way to who comes next.
async fn accept_tcp(listener: TcpListener, acceptor: Option<TlsAcceptor>, router: Router) {
    let places = Arc::new(Places::default());
    loop {
        match listener.accept().await {
            Ok((stream, from)) => {
                let place = places.enter(from.ip());
                let served = greet(stream, from, acceptor.clone(), router.clone(), place.clone());
                tokio::spawn(within(place, served));
            }
            Err(why) => rest(&why).await,
        }
    }
}

/// Serves a connection as long as it has its place.
async fn within(place: Arc<Place>, served: impl Future<Output = ()>) {
    tokio::select! {
        () = served => {}
        () = place.over() => {}
    }
}

/// Serves one connection of TCP, after its handshake where there is TLS.
async fn greet(stream: TcpStream, from: SocketAddr, acceptor: Option<TlsAcceptor>, router: Router, place: Arc<Place>) {
    // One that is gone already ends as soon as it is read.
    let _gone = stream.set_nodelay(true);
    let Some(acceptor) = acceptor else { return serve(stream, Peer::Tcp { from }, router, Some(place)).await };
    // Who does not speak TLS, or has a certificate of nobody, hears so from TLS itself.
    let Ok(stream) = acceptor.accept(stream).await else { return };
    let certificate = stream.get_ref().1.peer_certificates().and_then(|chain| chain.first()).map(fingerprint);
    serve(stream, Peer::Tls { from, certificate }, router, Some(place)).await;
}

/// Serves one connection to its end.
async fn serve<S: AsyncRead + AsyncWrite + Unpin + Send + 'static>(stream: S, peer: Peer, router: Router, place: Option<Arc<Place>>) {
    let service = service_fn(move |mut request: Request<Incoming>| {
        request.extensions_mut().insert(peer.clone());
        if let Some(place) = &place {
            request.extensions_mut().insert(place.clone());
        }
        router.clone().oneshot(request.map(Body::new))
    });
    let connection = http1::Builder::new()
        .timer(TokioTimer::new())
        .header_read_timeout(IDLE_MAX)
        .max_buf_size(HEADERS_BYTES_MAX)
        .serve_connection(TokioIo::new(stream), service)
        .with_upgrades();
    // A connection that breaks is over; what hung on it sees that by itself.
    let _over = connection.await;
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::places::STRANGER_MAX;
    use std::net::IpAddr;
    use tokio::io::{AsyncReadExt, AsyncWriteExt};

    #[tokio::test(start_paused = true)]
    async fn whoever_sends_its_head_slowly_has_the_time_of_a_stranger_and_no_more() {
        let (mut client, server) = tokio::io::duplex(1024);
        let from = SocketAddr::new(IpAddr::from([10, 0, 0, 1]), 1);
        let place = Arc::new(Places::default()).enter(from.ip());
        tokio::spawn(within(place.clone(), serve(server, Peer::Tcp { from }, Router::new(), Some(place))));
        let begun = tokio::time::Instant::now();
        let mut answer = Vec::new();
        for byte in b"GET / HTTP/1.1\r\nhost: localhost\r\nslow: ".iter().cycle() {
            if client.write_all(&[*byte]).await.is_err() {
                break;
            }
            tokio::time::sleep(Duration::from_millis(500)).await;
        }
        client.read_to_end(&mut answer).await.expect("it is over");
        assert!(answer.is_empty() && begun.elapsed() <= STRANGER_MAX + Duration::from_secs(1), "{:?}", begun.elapsed());
    }
}
