// SPDX-License-Identifier: Apache-2.0
//! Tests TLS, and refusals before anything listens.
use crate::rig::{Folder, Rig, receive, send, system};
use api::Role;
use control::{Options, Server};
use daemon::tokens;
use rcgen::{CertificateParams, CertifiedKey, KeyPair};
use rustls::pki_types::ServerName;
use rustls::{ClientConfig, ClientConnection, RootCertStore, StreamOwned};
use std::fs::Permissions;
use std::net::TcpStream;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::sync::Arc;

fn refused(change: impl FnOnce(&mut Options, &Folder)) -> String {
    let folder = Folder::new();
    let mut options = Options { socket: Some(folder.file("s")), ..Options::default() };
    change(&mut options, &folder);
    let refusals = Server::start(system("virtual"), &options).err().expect("refused");
    assert!(!folder.file("s").exists(), "nothing listens");
    refusals.iter().map(ToString::to_string).collect()
}

fn token(folder: &Folder) -> String {
    tokens::add(&folder.file("tokens.json"), "panel", Role::Operate, None).expect("a token")
}

/// Writes a certificate for `localhost` and its key to files.
fn certificate(options: &mut Options, folder: &Folder) -> CertifiedKey {
    let made = rcgen::generate_simple_self_signed(["localhost".to_owned(), "127.0.0.1".to_owned()]).expect("a certificate");
    (options.tls_cert, options.tls_key) = (Some(folder.file("cert.pem")), Some(folder.file("key.pem")));
    std::fs::write(folder.file("cert.pem"), made.cert.pem()).expect("ours");
    std::fs::write(folder.file("key.pem"), made.key_pair.serialize_pem()).expect("ours");
    allow(&folder.file("key.pem"), 0o600);
    made
}

/// Sets the mode of a file.
fn allow(file: &Path, mode: u32) {
    std::fs::set_permissions(file, Permissions::from_mode(mode)).expect("ours");
}

#[test]
fn a_key_that_others_may_read_is_refused_as_a_file_of_tokens_is() {
    for mode in [0o644, 0o640, 0o602] {
        let open_key = |o: &mut Options, f: &Folder| {
            o.listen = Some("127.0.0.1:0".to_owned());
            token(f);
            o.tokens = Some(f.file("tokens.json"));
            certificate(o, f);
            allow(&f.file("key.pem"), mode);
        };
        let said = refused(open_key);
        assert!(said.contains("the TLS key: others may read") && said.contains(&format!("(mode {mode:04o}): chmod 600 it")), "{said}");
    }
}

#[test]
fn an_address_that_others_reach_needs_tls_and_callers_that_are_known() {
    let anywhere = |options: &mut Options| options.listen = Some("0.0.0.0:0".to_owned());
    assert!(refused(|o, _| anywhere(o)).contains("has no TLS; give --tls-cert and --tls-key"));
    let with_tls = |o: &mut Options, f: &Folder| {
        anywhere(o);
        certificate(o, f);
    };
    assert!(refused(with_tls).contains("has no authentication; give --tokens"));
    let with_token = |o: &mut Options, f: &Folder| {
        anywhere(o);
        token(f);
        o.tokens = Some(f.file("tokens.json"));
    };
    assert!(refused(with_token).contains("has no TLS"));
    let insecure = |o: &mut Options, _: &Folder| {
        anywhere(o);
        o.insecure_loopback = true;
    };
    assert!(refused(insecure).contains("--insecure-loopback cannot be used with"));
}

#[test]
fn loopback_needs_a_token_unless_it_is_asked_for() {
    let local = |o: &mut Options| o.listen = Some("127.0.0.1:0".to_owned());
    assert!(refused(|o, _| local(o)).contains("--insecure-loopback"));
    let rig = Rig::with("virtual", |o, _| {
        local(o);
        o.insecure_loopback = true;
    });
    let address = rig.server.addresses()[1].strip_prefix("http://").expect("http").to_owned();
    let ask = |path: &str| {
        let mut stream = TcpStream::connect(&address).expect("it listens");
        send(&mut stream, "POST", path, &[], b"{}");
        receive(&mut stream).0
    };
    assert_eq!((ask("/v1/call/now"), ask("/v1/call/emergency_stop")), (200, 403));
}

#[test]
fn what_does_not_go_together_is_said() {
    assert!(refused(|o, f| o.tls_cert = Some(f.file("cert.pem"))).contains("--tls-cert is given but nothing listens on TCP"));
    assert!(refused(|o, f| o.tokens = Some(f.file("none.json"))).contains("opengpac token new"));
    assert!(refused(|o, f| o.audit = Some(f.0.clone())).contains("cannot open the audit file"));
    let broken = |o: &mut Options, f: &Folder| {
        o.listen = Some("127.0.0.1:0".to_owned());
        token(f);
        o.tokens = Some(f.file("tokens.json"));
        certificate(o, f);
        std::fs::write(f.file("key.pem"), "no key").expect("ours");
    };
    assert!(refused(broken).contains("there is no private key"));
}

#[test]
fn the_socket_is_its_owners_alone_and_a_second_daemon_is_refused() {
    let rig = Rig::new();
    let mode = std::fs::metadata(rig.folder.file("s")).expect("it listens").permissions().mode();
    assert_eq!(mode & 0o777, 0o600);
    let options = Options { socket: Some(rig.folder.file("s")), audit: Some(rig.folder.file("other")), ..Options::default() };
    let refusals = Server::start(system("virtual"), &options).err().expect("it is taken");
    assert!(refusals[0].message.contains("served on"), "{refusals:?}");
    assert_eq!(rig.ask("GET", "/v1/version", &[], "").0, 200, "the first one is not disturbed");
}

#[test]
fn a_socket_that_nobody_serves_any_more_is_replaced_and_a_file_is_not() {
    let folder = Folder::new();
    drop(std::os::unix::net::UnixListener::bind(folder.file("s")).expect("a socket"));
    let options = Options { socket: Some(folder.file("s")), ..Options::default() };
    let mut server = Server::start(system("virtual"), &options).unwrap_or_else(|r| panic!("{r:?}"));
    server.stop();
    server.stop();
    assert!(!folder.file("s").exists(), "it is removed at the end");
    std::fs::write(folder.file("s"), "mine").expect("ours");
    assert!(Server::start(system("virtual"), &options).is_err());
    assert_eq!(std::fs::read(folder.file("s")).expect("it is there"), b"mine");
}

/// Returns a TLS client that trusts one certificate and may present its own.
fn tls(address: &str, trusts: &CertifiedKey, own: Option<(&rcgen::Certificate, &KeyPair)>) -> StreamOwned<ClientConnection, TcpStream> {
    let mut roots = RootCertStore::empty();
    roots.add(trusts.cert.der().clone()).expect("a certificate");
    let provider = Arc::new(rustls::crypto::ring::default_provider());
    let builder = ClientConfig::builder_with_provider(provider).with_safe_default_protocol_versions().expect("versions").with_root_certificates(roots);
    let config = match own {
        None => builder.with_no_client_auth(),
        Some((certificate, key)) => {
            let key = rustls::pki_types::PrivateKeyDer::try_from(key.serialize_der()).expect("a key");
            builder.with_client_auth_cert(vec![certificate.der().clone()], key).expect("they belong together")
        }
    };
    let name = ServerName::try_from("localhost").expect("a name");
    let connection = ClientConnection::new(Arc::new(config), name).expect("a client");
    StreamOwned::new(connection, TcpStream::connect(address).expect("it listens"))
}

#[test]
fn tls_carries_tokens_and_client_certificates() {
    let mut made = None;
    let mut given = String::new();
    let authority_key = KeyPair::generate().expect("a key");
    let mut params = CertificateParams::new(Vec::new()).expect("parameters");
    params.is_ca = rcgen::IsCa::Ca(rcgen::BasicConstraints::Unconstrained);
    let authority = params.self_signed(&authority_key).expect("an authority");
    let client_key = KeyPair::generate().expect("a key");
    let client = CertificateParams::new(vec!["panel".to_owned()]).expect("parameters").signed_by(&client_key, &authority, &authority_key).expect("a client");
    let rig = Rig::with("virtual", |options, folder| {
        options.listen = Some("127.0.0.1:0".to_owned());
        made = Some(certificate(options, folder));
        given = token(folder);
        options.tokens = Some(folder.file("tokens.json"));
        std::fs::write(folder.file("ca.pem"), authority.pem()).expect("ours");
        options.client_ca = Some(folder.file("ca.pem"));
        tokens::add_certificate(&folder.file("tokens.json"), "press", Role::Configure, None, control::fingerprint(client.der())).expect("an entry");
    });
    let server = made.expect("made");
    let address = rig.server.addresses()[1].strip_prefix("https://").expect("https").to_owned();
    let ask = |own, headers: &[(&str, &str)]| {
        let mut stream = tls(&address, &server, own);
        send(&mut stream, "POST", "/v1/sessions", headers, br#"{"name": "x", "take_up": true}"#);
        let (status, answer) = receive(&mut stream);
        (status, answer["result"]["role"].as_str().unwrap_or("none").to_owned())
    };
    assert_eq!(ask(None, &[]), (401, "none".to_owned()));
    let (status, role) = ask(Some((&client, &client_key)), &[]);
    assert_eq!((status, role.as_str()), (200, "configure"));
    let mut plain = TcpStream::connect(&address).expect("it listens");
    send(&mut plain, "GET", "/v1/version", &[("authorization", &format!("Bearer {given}"))], b"");
    let mut said = Vec::new();
    // Non-TLS input gets a TLS alert or nothing; never an answer.
    let _broken = std::io::Read::read_to_end(&mut plain, &mut said);
    assert!(!said.starts_with(b"HTTP"), "{said:?}");
}
