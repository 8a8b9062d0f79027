// SPDX-License-Identifier: Apache-2.0
//! The TCP listeners: a client without a token does not keep out clients with one.
use crate::rig::{Rig, class, receive, send};
use api::Role;
use daemon::tokens;
use std::io::{Read, Write};
use std::net::TcpStream;
use std::os::unix::net::UnixStream;
use tungstenite::Message;
use tungstenite::client::IntoClientRequest;

/// Serves a system on a port; returns its address and a token for each name.
fn on_a_port<const N: usize>(names: [&str; N]) -> (Rig, String, [String; N]) {
    let mut made = [const { String::new() }; N];
    let rig = Rig::with("virtual", |options, folder| {
        let file = folder.file("tokens.json");
        made = names.map(|name| tokens::add(&file, name, Role::Operate, None).expect("a token"));
        (options.listen, options.tokens) = (Some("127.0.0.1:0".to_owned()), Some(file));
    });
    let address = rig.server.addresses()[1].strip_prefix("http://").expect("http").to_owned();
    (rig, address, made)
}

/// Sends a request that keeps its connection open.
fn ask_and_stay(stream: &mut (impl Read + Write), token: &str) -> String {
    stream
        .write_all(format!("POST /v1/call/now HTTP/1.1\r\nhost: localhost\r\nauthorization: Bearer {token}\r\ncontent-length: 0\r\n\r\n").as_bytes())
        .expect("it takes it");
    let mut answer = [0; 1024];
    let length = stream.read(&mut answer).expect("it answers");
    String::from_utf8_lossy(&answer[..length]).into_owned()
}

#[test]
fn strangers_who_say_nothing_keep_nobody_out() {
    let (rig, address, [line, panel]) = on_a_port(["line", "panel"]);
    let mut known = TcpStream::connect(&address).expect("it listens");
    assert!(ask_and_stay(&mut known, &line).starts_with("HTTP/1.1 200"));
    let mut strangers: Vec<TcpStream> = Vec::new();
    for number in 0..300 {
        let mut stranger = TcpStream::connect(&address).expect("it listens");
        if number % 2 == 0 {
            let _gone = stranger.write_all(b"POST /v1/call/emergency_stop HTTP/1.1\r\nhost: localhost\r\nslow: ");
        }
        strangers.push(stranger);
    }
    let mut stop = TcpStream::connect(&address).expect("it listens");
    send(&mut stop, "POST", "/v1/call/emergency_stop", &[("authorization", &format!("Bearer {panel}"))], br#"{"reason": "a second panel"}"#);
    assert_eq!(receive(&mut stop).0, 200, "a second panel gets in");
    assert!(ask_and_stay(&mut known, &line).starts_with("HTTP/1.1 200"), "who was there before keeps its place");
    let mut over = strangers.swap_remove(0);
    assert!(matches!(over.read(&mut [0; 64]), Ok(0) | Err(_)), "the first stranger gave way");
    drop(rig);
}

/// Half of the connections for which this process has descriptors (both ends are its own), but at most `most`.
fn affordable(most: usize) -> usize {
    let limits = std::fs::read_to_string("/proc/self/limits").expect("limits");
    let files = limits.lines().find_map(|line| line.strip_prefix("Max open files")?.split_whitespace().next()?.parse::<usize>().ok());
    files.map_or(most, |files| most.min(files / 4))
}

/// Serves a system with TLS at this address; returns what its clients need to trust it.
fn with_tls(listen: &str, token: &mut String) -> (Rig, std::net::SocketAddr, tokio_rustls::TlsConnector) {
    let key = rcgen::generate_simple_self_signed(["localhost".to_owned()]).expect("a certificate");
    let rig = Rig::with("virtual", |options, folder| {
        let (tokens, certificate, secret) = (folder.file("tokens.json"), folder.file("cert.pem"), folder.file("key.pem"));
        *token = tokens::add(&tokens, "panel", Role::Operate, None).expect("a token");
        std::fs::write(&certificate, key.cert.pem()).expect("room");
        std::fs::write(&secret, key.key_pair.serialize_pem()).expect("room");
        std::fs::set_permissions(&secret, std::os::unix::fs::PermissionsExt::from_mode(0o600)).expect("it is ours");
        (options.listen, options.tokens) = (Some(listen.to_owned()), Some(tokens));
        (options.tls_cert, options.tls_key) = (Some(certificate), Some(secret));
    });
    let address = rig.server.addresses()[1].strip_prefix("https://").expect("https").parse().expect("an address");
    let mut roots = rustls::RootCertStore::empty();
    roots.add(key.cert.der().clone()).expect("a certificate");
    let provider = std::sync::Arc::new(rustls::crypto::ring::default_provider());
    let client = rustls::ClientConfig::builder_with_provider(provider).with_safe_default_protocol_versions().expect("versions");
    (rig, address, std::sync::Arc::new(client.with_root_certificates(roots).with_no_client_auth()).into())
}

/// Connects from this local address.
async fn connect_from(from: std::net::IpAddr, to: std::net::SocketAddr) -> std::io::Result<tokio::net::TcpStream> {
    let socket = if from.is_ipv4() { tokio::net::TcpSocket::new_v4() } else { tokio::net::TcpSocket::new_v6() }?;
    socket.bind((from, 0).into())?;
    socket.connect(to).await
}

/// Requests the time as a panel with TLS does.
async fn time_asked(stream: tokio::net::TcpStream, connector: tokio_rustls::TlsConnector, token: &str) -> String {
    use tokio::io::{AsyncReadExt, AsyncWriteExt};
    let name = rustls::pki_types::ServerName::try_from("localhost").expect("a name");
    let Ok(mut stream) = connector.connect(name, stream).await else { return "no handshake".to_owned() };
    let head = format!("POST /v1/call/now HTTP/1.1\r\nhost: localhost\r\nauthorization: Bearer {token}\r\ncontent-length: 0\r\n\r\n");
    let mut answer = [0; 1024];
    let asked = stream.write_all(head.as_bytes()).await;
    let length = if asked.is_ok() { stream.read(&mut answer).await.unwrap_or(0) } else { 0 };
    String::from_utf8_lossy(&answer[..length]).into_owned()
}

#[test]
fn panels_with_tls_get_in_while_strangers_of_hundreds_of_addresses_have_begun_handshakes() {
    use tokio::io::AsyncWriteExt;
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().expect("a runtime");
    for listen in ["127.0.0.1:0", "[::1]:0"] {
        let mut token = String::new();
        let (rig, address, connector) = with_tls(listen, &mut token);
        let stranger = |number: usize| match address.ip() {
            std::net::IpAddr::V4(_) => std::net::IpAddr::from([127, 1, (number >> 8) as u8, number as u8]),
            loopback => loopback,
        };
        runtime.block_on(async {
            let mut strangers = Vec::new();
            for number in 0..affordable(500) {
                let mut stream = connect_from(stranger(number), address).await.expect("it listens");
                // Half of them begin a handshake. The ones that were evicted are closed.
                if number % 2 == 0 {
                    let _gone = stream.write_all(&[22, 3, 1, 2, 0]).await;
                }
                strangers.push(stream);
                if number % 25 == 24 {
                    let panel = connect_from(stranger(10_000 + number), address).await.expect("it listens");
                    let answer = time_asked(panel, connector.clone(), &token).await;
                    assert!(answer.starts_with("HTTP/1.1 200"), "{listen}, {number} strangers: '{answer}'");
                }
            }
        });
        drop(rig);
    }
}

#[test]
fn a_caller_has_so_many_connections_and_an_emergency_stop_one_more() {
    let (_rig, address, [line, panel]) = on_a_port(["line", "panel"]);
    let mut own: Vec<TcpStream> = Vec::new();
    for _ in 0..64 {
        let mut stream = TcpStream::connect(&address).expect("it listens");
        assert!(ask_and_stay(&mut stream, &line).starts_with("HTTP/1.1 200"));
        own.push(stream);
    }
    let ask = |token: &str, call: &str| {
        let mut stream = TcpStream::connect(&address).expect("it listens");
        send(&mut stream, "POST", &format!("/v1/call/{call}"), &[("authorization", &format!("Bearer {token}"))], br#"{"reason": ""}"#);
        receive(&mut stream)
    };
    let (status, answer) = ask(&line, "mode");
    assert_eq!((status, class(&answer)), (429, "LimitExceeded"), "{answer}");
    assert!(answer["errors"][0]["message"].as_str().is_some_and(|said| said == "token line already has 64 connections"), "{answer}");
    assert_eq!((ask(&panel, "emergency_stop").0, ask(&line, "emergency_stop").0), (200, 200));
}

#[test]
fn who_is_not_let_in_is_shown_out() {
    let (_rig, address, _) = on_a_port(["line"]);
    let mut stream = TcpStream::connect(&address).expect("it listens");
    let said = ask_and_stay(&mut stream, "wrong");
    assert!(said.starts_with("HTTP/1.1 401") && said.contains("connection: close"), "{said}");
}

#[test]
fn a_program_of_the_owner_that_takes_all_places_of_the_socket_keeps_no_stop_out() {
    let rig = Rig::new();
    let connect = || UnixStream::connect(rig.folder.file("s")).expect("it listens");
    let silent: Vec<UnixStream> = (0..300).map(|_| connect()).collect();
    let ask = |call: &str| {
        let mut stream = connect();
        send(&mut stream, "POST", &format!("/v1/call/{call}"), &[], br#"{"reason": ""}"#);
        receive(&mut stream)
    };
    assert_eq!(ask("emergency_stop").0, 200);
    let mut own: Vec<UnixStream> = Vec::new();
    for _ in 0..64 {
        let mut stream = connect();
        stream.write_all(b"POST /v1/call/now HTTP/1.1\r\nhost: localhost\r\ncontent-length: 0\r\n\r\n").expect("it takes it");
        assert!(stream.read(&mut [0; 1024]).is_ok_and(|length| length > 0), "it answers");
        own.push(stream);
    }
    let (status, answer) = ask("mode");
    assert_eq!((status, class(&answer)), (429, "LimitExceeded"), "{answer}");
    assert_eq!(ask("emergency_stop").0, 200);
    drop((silent, own));
}

#[test]
fn a_revoked_token_is_out_of_what_it_had_open() {
    let (rig, address, [line, panel]) = on_a_port(["line", "panel"]);
    let open = |token: &str| {
        let mut request = "ws://localhost/v1/stream".into_client_request().expect("a request");
        request.headers_mut().insert("authorization", format!("Bearer {token}").parse().expect("a value"));
        tungstenite::client(request, TcpStream::connect(&address).expect("it listens")).unwrap_or_else(|why| panic!("{why}")).0
    };
    let (mut revoked, mut other) = (open(&line), open(&panel));
    let mut kept = TcpStream::connect(&address).expect("it listens");
    assert!(ask_and_stay(&mut kept, &line).starts_with("HTTP/1.1 200"));
    let mut unread = open(&line);
    unread.send(Message::text(r#"{"subscribe": "statistics", "id": "a", "every_ms": 100}"#)).expect("it takes it");
    tokens::revoke(&rig.folder.file("tokens.json"), "line").expect("it is there");
    let closed = loop {
        match revoked.read().expect("it is closed with a word") {
            Message::Close(with) => break with.expect("a reason"),
            _ => continue,
        }
    };
    assert_eq!((u16::from(closed.code), closed.reason.as_str()), (4401, "the token was revoked"));
    assert!(matches!(kept.read(&mut [0; 64]), Ok(0) | Err(_)), "what is kept is closed, asked or not");
    while unread.read().is_ok() {}
    other.send(Message::text(r#"{"subscribe": "statistics", "id": "a", "every_ms": 100}"#)).expect("it takes it");
    assert!(other.read().is_ok(), "who has its token goes on");
}
