// SPDX-License-Identifier: Apache-2.0
//! Accepting connections: as many as there are places for, each with who is at its other end.
use crate::caller::Peer;
use crate::tls::fingerprint;
use axum::Router;
use axum::body::Body;
use axum::http::Request;
use hyper::body::Incoming;
use hyper::server::conn::http1;
use hyper::service::service_fn;
use hyper_util::rt::{TokioIo, TokioTimer};
use std::io;
use std::sync::Arc;
use std::time::Duration;
use tokio::io::{AsyncRead, AsyncWrite};
use tokio::net::{TcpListener, UnixListener};
use tokio::runtime::Runtime;
use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use tokio_rustls::TlsAcceptor;
use tower::ServiceExt;

/// Connections of one listener. Those of a Unix socket and of TCP are counted apart: strangers cannot keep the owner out.
const CONNECTIONS_MAX: usize = 64;
/// How long headers may take to arrive, and how long a connection may be idle.
const IDLE_MAX: Duration = Duration::from_secs(60);
/// How long a TLS handshake may take.
const HANDSHAKE_MAX: Duration = Duration::from_secs(10);
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
    let places = Arc::new(Semaphore::new(CONNECTIONS_MAX));
    loop {
        let Ok(place) = places.clone().acquire_owned().await else { return };
        if accept_one(&listener, &router, place).await.is_err() {
            tokio::time::sleep(REST).await;
        }
    }
}

async fn accept_one(listener: &Listener, router: &Router, place: OwnedSemaphorePermit) -> io::Result<()> {
    let router = router.clone();
    match listener {
        Listener::Unix(listener) => {
            let (stream, _) = listener.accept().await?;
            let peer = Peer::Unix { uid: stream.peer_cred()?.uid() };
            tokio::spawn(serve(stream, peer, router, place));
        }
        Listener::Tcp(listener, None) => {
            let (stream, from) = listener.accept().await?;
            stream.set_nodelay(true)?;
            tokio::spawn(serve(stream, Peer::Tcp { from }, router, place));
        }
        Listener::Tcp(listener, Some(acceptor)) => {
            let (stream, from) = listener.accept().await?;
            stream.set_nodelay(true)?;
            let shaken = acceptor.accept(stream);
            tokio::spawn(async move {
                // Who does not speak TLS, or has a certificate of nobody, hears so from TLS itself.
                let Ok(Ok(stream)) = tokio::time::timeout(HANDSHAKE_MAX, shaken).await else { return };
                let certificate = stream.get_ref().1.peer_certificates().and_then(|chain| chain.first()).map(fingerprint);
                serve(stream, Peer::Tls { from, certificate }, router, place).await;
            });
        }
    }
    Ok(())
}

/// Serves one connection to its end.
async fn serve<S: AsyncRead + AsyncWrite + Unpin + Send + 'static>(stream: S, peer: Peer, router: Router, place: OwnedSemaphorePermit) {
    let service = service_fn(move |mut request: Request<Incoming>| {
        request.extensions_mut().insert(peer.clone());
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
    drop(place);
}
