// SPDX-License-Identifier: Apache-2.0
//! The studio's page: which files of a folder are served and to whom, and the token of a run.
use crate::rig::{Folder, Rig, class, send, system};
use api::Role;
use axum::body::{Body, to_bytes};
use axum::http::{Request, Response};
use control::{Options, Server};
use daemon::Peer;
use serde_json::{Value as Json, json};
use std::io::Read;
use std::net::{SocketAddr, TcpStream};
use tower::ServiceExt;

/// Creates a page as the build does, and a file next to it that must not be served.
fn page(folder: &Folder) -> std::path::PathBuf {
    let page = folder.file("page");
    std::fs::create_dir_all(page.join("assets")).expect("ours");
    for (name, text) in [("index.html", "<!doctype html><html></html>"), ("assets/a-1f.js", "1"), ("assets/a-1f.css", "b{}"), ("icon.svg", "<svg/>")] {
        std::fs::write(page.join(name), text).expect("ours");
    }
    std::fs::write(folder.file("secret.txt"), "secret").expect("ours");
    std::os::unix::fs::symlink(folder.file("secret.txt"), page.join("link.txt")).expect("ours");
    page
}

fn studio(change: impl FnOnce(&mut Options, &Folder)) -> Rig {
    Rig::with("virtual", |options, folder| {
        (options.listen, options.page) = (Some("127.0.0.1:0".to_owned()), Some(page(folder)));
        options.run_token = Some(Role::Operate);
        change(options, folder);
    })
}

fn peer() -> Peer {
    Peer::Tcp { from: "127.0.0.1:40000".parse::<SocketAddr>().expect("an address") }
}

fn answered(rig: &Rig, method: &str, path: &str, headers: &[(&str, &str)]) -> Response<Body> {
    let runtime = tokio::runtime::Builder::new_multi_thread().worker_threads(1).enable_all().build().expect("a runtime");
    let mut request = Request::builder().method(method).uri(path).header("host", "127.0.0.1:8777");
    for (name, value) in headers {
        request = request.header(*name, *value);
    }
    let mut request = request.body(Body::empty()).expect("a request");
    request.extensions_mut().insert(peer());
    runtime.block_on(rig.server.router().oneshot(request)).expect("it answers")
}

fn text(response: Response<Body>) -> String {
    let runtime = tokio::runtime::Builder::new_current_thread().build().expect("a runtime");
    let body = runtime.block_on(to_bytes(response.into_body(), usize::MAX)).expect("a body");
    String::from_utf8(body.to_vec()).expect("text")
}

fn said<'a>(response: &'a Response<Body>, name: &str) -> &'a str {
    response.headers().get(name).map_or("", |value| value.to_str().expect("text"))
}

#[test]
fn files_of_the_page_need_no_token_and_say_what_they_are() {
    let rig = studio(|_, _| {});
    for (path, kind, cached) in [
        ("/", "text/html; charset=utf-8", "no-cache"),
        ("/index.html", "text/html; charset=utf-8", "no-cache"),
        ("/icon.svg", "image/svg+xml", "no-cache"),
        ("/assets/a-1f.js", "text/javascript; charset=utf-8", "public, max-age=31536000, immutable"),
        ("/assets/a-1f.css", "text/css; charset=utf-8", "public, max-age=31536000, immutable"),
    ] {
        let response = answered(&rig, "GET", path, &[]);
        assert_eq!((response.status().as_u16(), said(&response, "content-type"), said(&response, "cache-control")), (200, kind, cached), "{path}");
        let policy = said(&response, "content-security-policy");
        assert!(policy.starts_with("default-src 'none'; script-src 'self'") && policy.contains("frame-ancestors 'none'"), "{policy}");
        assert!(!policy.contains("unsafe") && !policy.contains("http"), "{policy}");
        assert_eq!((said(&response, "x-content-type-options"), said(&response, "referrer-policy")), ("nosniff", "no-referrer"));
        let tag = said(&response, "etag").to_owned();
        assert_eq!(answered(&rig, "GET", path, &[("if-none-match", &tag)]).status().as_u16(), 304);
    }
}

#[test]
fn nothing_outside_the_folder_is_served() {
    let rig = studio(|_, _| {});
    for path in [
        "/link.txt",
        "/../secret.txt",
        "/%2e%2e/secret.txt",
        "/..%2fsecret.txt",
        "/assets/../../secret.txt",
        "//etc/passwd",
        "/assets/",
        "/assets",
        "/.",
        "/index.html/",
        "/secret.txt",
        "/assets/%2e%2e/index.html",
        "/INDEX.HTML",
    ] {
        let response = answered(&rig, "GET", path, &[]);
        let status = response.status().as_u16();
        let body = text(response);
        assert!(matches!(status, 401 | 429) && !body.contains("secret"), "{path}: {status} {body}");
    }
    assert_eq!(answered(&rig, "POST", "/", &[]).status().as_u16(), 401, "a file is only read");
}

#[test]
fn pages_of_others_get_neither_the_page_nor_a_call() {
    let rig = studio(|_, _| {});
    let token = token(&rig);
    let bearer = format!("Bearer {token}");
    for (origin, host, allowed) in [
        ("http://127.0.0.1:8777", "127.0.0.1:8777", true),
        ("http://localhost:8777", "localhost:8777", true),
        ("http://[::1]:8777", "[::1]:8777", true),
        ("http://localhost:8777", "127.0.0.1:8777", false),
        ("http://127.0.0.1:8778", "127.0.0.1:8777", false),
        ("https://127.0.0.1:8777", "127.0.0.1:8777", false),
        ("http://evil.example", "127.0.0.1:8777", false),
        ("http://evil.example:8777", "evil.example:8777", false),
        ("null", "127.0.0.1:8777", false),
        ("", "127.0.0.1:8777", false),
    ] {
        for path in ["/", "/v1/version"] {
            let runtime = tokio::runtime::Builder::new_multi_thread().worker_threads(1).enable_all().build().expect("a runtime");
            let request = Request::builder().uri(path).header("host", host).header("origin", origin).header("authorization", &bearer);
            let mut request = request.body(Body::empty()).expect("a request");
            request.extensions_mut().insert(peer());
            let status = runtime.block_on(rig.server.router().oneshot(request)).expect("it answers").status().as_u16();
            assert!(if allowed { status == 200 } else { matches!(status, 403 | 429) }, "{path} from {origin} at {host}: {status}");
        }
    }
}

/// Returns the token in the address.
fn token(rig: &Rig) -> String {
    rig.server.studio().expect("an address").split_once("/#token=").expect("a token").1.to_owned()
}

#[test]
fn the_token_of_a_run_has_its_role_and_says_so() {
    for role in Role::ALL {
        let rig = studio(|options, _| options.run_token = Some(role));
        let response = answered(&rig, "GET", "/v1/version", &[("authorization", &format!("Bearer {}", token(&rig)))]);
        let version: Json = serde_json::from_str(&text(response)).expect("JSON");
        assert_eq!(version["role"], role.word());
        let other = studio(|_, _| {});
        let refused = answered(&other, "GET", "/v1/version", &[("authorization", &format!("Bearer {}", token(&rig)))]);
        assert_eq!(refused.status().as_u16(), 401, "it is of another run");
    }
}

#[test]
fn a_websocket_brings_its_token_as_a_subprotocol_and_nothing_else_does() {
    let rig = studio(|_, _| {});
    let token = token(&rig);
    let port = rig.server.studio().and_then(|url| url.split(['/', ':', '#']).find_map(|part| part.parse::<u16>().ok())).expect("a port");
    let open = |protocols: &str| {
        let mut stream = TcpStream::connect(("127.0.0.1", port)).expect("it listens");
        let host = format!("127.0.0.1:{port}");
        let origin = format!("http://{host}");
        let mut headers = vec![("host", host.as_str()), ("origin", &origin), ("upgrade", "websocket"), ("connection", "upgrade")];
        headers.extend([("sec-websocket-version", "13"), ("sec-websocket-key", "dGhlIHNhbXBsZSBub25jZQ=="), ("sec-websocket-protocol", protocols)]);
        send_upgrade(&mut stream, &headers);
        let mut head = [0; 400];
        let size = stream.read(&mut head).expect("it answers");
        String::from_utf8_lossy(&head[..size]).to_lowercase()
    };
    let accepted = open(&format!("opengpac.v1, bearer.{token}"));
    assert!(accepted.starts_with("http/1.1 101") && accepted.contains("sec-websocket-protocol: opengpac.v1\r\n"), "{accepted}");
    for wrong in [format!("opengpac.v1, bearer.{token}x"), "opengpac.v1".to_owned(), "opengpac.v1, bearer.".to_owned(), format!("bearer.{token}, bearer.x")] {
        assert!(open(&wrong).starts_with("http/1.1 401"), "{wrong}");
    }
    let response = answered(&rig, "GET", "/v1/version", &[("sec-websocket-protocol", &format!("bearer.{token}"))]);
    assert_eq!(response.status().as_u16(), 401, "it opens no WebSocket");
}

fn send_upgrade(stream: &mut TcpStream, headers: &[(&str, &str)]) {
    use std::io::Write;
    let mut text = "GET /v1/stream HTTP/1.1\r\n".to_owned();
    headers.iter().for_each(|(name, value)| text.push_str(&format!("{name}: {value}\r\n")));
    stream.write_all(format!("{text}\r\n").as_bytes()).expect("it takes it");
}

#[test]
fn a_system_inside_a_program_is_served_without_a_socket_or_an_audit_file() {
    let folder = Folder::new();
    let options =
        Options { no_socket: true, listen: Some("127.0.0.1:0".to_owned()), page: Some(page(&folder)), run_token: Some(Role::Operate), ..Options::default() };
    let system = system("virtual");
    let mut server = Server::start(system.clone(), &options).unwrap_or_else(|r| panic!("{r:?}"));
    assert_eq!(server.addresses().len(), 1);
    let token = server.studio().and_then(|url| url.split_once('=')).expect("a token").1.to_owned();
    let port: u16 = server.addresses()[0].rsplit_once(':').and_then(|(_, port)| port.parse().ok()).expect("a port");
    let ask = |method: &str, path: &str, session: &str, body: Json| {
        let mut stream = TcpStream::connect(("127.0.0.1", port)).expect("it listens");
        let bearer = format!("Bearer {token}");
        let mut headers = vec![("authorization", bearer.as_str())];
        headers.extend((!session.is_empty()).then_some(("opengpac-session", session)));
        send(&mut stream, method, path, &headers, body.to_string().as_bytes());
        crate::rig::receive(&mut stream)
    };
    let (_, opened) = ask("POST", "/v1/sessions", "", json!({ "name": "studio-1" }));
    let session = opened["result"]["session"].as_str().expect("an ID").to_owned();
    assert_eq!(ask("POST", "/v1/command", &session, json!({})).0, 200);
    assert_eq!(ask("POST", "/v1/call/write", &session, json!({ "name": "y", "value": 2.0 })).0, 200);
    let (status, refused) = ask("POST", "/v1/call/delete_svv", &session, json!({ "name": "y" }));
    assert_eq!((status, class(&refused)), (403, "NotAllowed"), "its role is operate");
    let log = system.log_since(0);
    let commands: Vec<_> = log.iter().filter(|entry| entry.kind == "command").map(|entry| (entry.who.as_str(), entry.about.as_str(), &entry.text)).collect();
    let told = |about: &str, text: &str| commands.iter().any(|(who, of, said)| *who == "studio-1 (studio)" && *of == about && said.starts_with(text));
    assert!(told("y", "write") && told("y", "delete_svv was refused: "), "{commands:?}");
    server.stop();
    assert!(TcpStream::connect(("127.0.0.1", port)).is_err(), "nobody listens any more");
    assert!(std::fs::read_dir(&folder.0).expect("ours").all(|entry| !entry.expect("ours").path().to_string_lossy().contains("audit")));
}

#[test]
fn a_page_that_was_not_built_and_a_studio_without_an_address_are_refused() {
    let folder = Folder::new();
    let refused = |change: &dyn Fn(&mut Options)| {
        let mut options = Options { socket: Some(folder.file("s")), ..Options::default() };
        change(&mut options);
        let refusals = Server::start(system("virtual"), &options).err().expect("refused");
        assert!(!folder.file("s").exists(), "nothing listens");
        refusals.iter().map(ToString::to_string).collect::<String>()
    };
    std::fs::create_dir_all(folder.file("empty")).expect("ours");
    for missing in [folder.file("empty"), folder.file("nothing")] {
        let text = refused(&|o: &mut Options| (o.listen, o.page, o.run_token) = (Some("127.0.0.1:0".to_owned()), Some(missing.clone()), Some(Role::Observe)));
        assert!(text.contains("make page") && text.contains(missing.to_str().expect("text")), "{text}");
    }
    let page = page(&folder);
    assert!(refused(&|o: &mut Options| o.page = Some(page.clone())).contains("needs a TCP address"));
    assert!(refused(&|o: &mut Options| o.run_token = Some(Role::Observe)).contains("needs a TCP address"));
    let taken = std::net::TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = taken.local_addr().expect("an address").to_string();
    assert!(refused(&|o: &mut Options| (o.listen, o.run_token) = (Some(address.clone()), Some(Role::Observe))).contains("choose another port"));
}
