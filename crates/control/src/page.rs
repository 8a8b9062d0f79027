// SPDX-License-Identifier: Apache-2.0
//! The studio's page: the files of one folder, read once at startup. Requested paths are looked up only in that list, so no path can
//! reach a file outside the folder, and later changes to a file have no effect.
use axum::body::{Body, Bytes};
use axum::http::{HeaderMap, HeaderName, HeaderValue, Method, StatusCode, header};
use axum::response::Response;
use model::refusal::{Class, Refusal, Refusals};
use sha2::{Digest, Sha256};
use std::collections::HashMap;
use std::fs;
use std::path::{Path, PathBuf};

/// Maximum number of files of a page, and maximum total size of the files in bytes.
const FILES_MAX: usize = 1_024;
const BYTES_MAX: u64 = 64 << 20;

/// Content security policy of the page: the page may load resources only from its own origin, and no other page may frame it. `data:` and
/// `blob:` allow images that the page draws itself.
const POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; font-src 'self'; \
    connect-src 'self'; worker-src 'self'; manifest-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

/// Headers of every answer that contains a file.
const GUARDS: [(HeaderName, &str); 5] = [
    (header::CONTENT_SECURITY_POLICY, POLICY),
    (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
    (header::REFERRER_POLICY, "no-referrer"),
    (HeaderName::from_static("cross-origin-opener-policy"), "same-origin"),
    (HeaderName::from_static("cross-origin-resource-policy"), "same-origin"),
];

/// A file of the page.
struct Asset {
    bytes: Bytes,
    kind: &'static str,
    /// True if the name contains the digest of the content, so the file never changes.
    lasts: bool,
    tag: String,
}

/// Files by path, such as `/assets/index-4f2a.js`; `/` maps to `index.html`.
pub struct Page(HashMap<String, Asset>);

impl Page {
    /// Reads a folder. Fails if it has no `index.html` (the page was not built), or is not the folder of a page.
    pub fn load(folder: &Path) -> Result<Page, Refusals> {
        let missing = || {
            let message = format!("the studio's page is not in '{}'", folder.display());
            refuse(message, "build it with `make page` in the sources, with Node 20.19 or newer, or use the wheel, which contains it")
        };
        let mut files = HashMap::new();
        let mut left = BYTES_MAX;
        let mut folders = vec![(folder.to_owned(), String::new())];
        while let Some((folder, prefix)) = folders.pop() {
            let failed =
                |why: std::io::Error| refuse(format!("cannot read the studio's page in '{}': {why}", folder.display()), "check that this user may read it");
            let listed = match fs::read_dir(&folder) {
                Err(_) if prefix.is_empty() => return Err(missing()),
                listed => listed.map_err(failed)?,
            };
            for entry in listed {
                let entry = entry.map_err(failed)?;
                let (kind, path) = (entry.file_type().map_err(failed)?, entry.path());
                let Some(name) = entry.file_name().to_str().map(|name| format!("{prefix}/{name}")) else { continue };
                // A link may lead out of the folder, so links are skipped.
                if kind.is_dir() {
                    folders.push((path, name));
                } else if kind.is_file() && !name.starts_with("/v1/") {
                    let asset = Asset::read(&path, &name, &mut left).map_err(failed)?;
                    files.insert(name, asset);
                }
                if files.len() + folders.len() > FILES_MAX || left == 0 {
                    return Err(refuse(format!("'{}' has more files than a page", folder.display()), "give the folder that npm run build has written"));
                }
            }
        }
        let index = files.remove("/index.html").ok_or_else(missing)?;
        files.insert("/".to_owned(), index);
        Ok(Page(files))
    }

    /// Answers a request for a file of the page; returns `None` for any other request.
    pub fn answer(&self, method: &Method, path: &str, headers: &HeaderMap) -> Option<Response> {
        let path = if path == "/index.html" { "/" } else { path };
        let asset = self.0.get(path).filter(|_| matches!(*method, Method::GET | Method::HEAD))?;
        let known = headers.get(header::IF_NONE_MATCH).is_some_and(|tag| tag.as_bytes() == asset.tag.as_bytes());
        let mut response = Response::new(if known { Body::empty() } else { Body::from(asset.bytes.clone()) });
        if known {
            *response.status_mut() = StatusCode::NOT_MODIFIED;
        }
        let said = response.headers_mut();
        for (name, value) in GUARDS {
            said.insert(name, HeaderValue::from_static(value));
        }
        said.insert(header::CONTENT_TYPE, HeaderValue::from_static(asset.kind));
        said.insert(header::CACHE_CONTROL, HeaderValue::from_static(if asset.lasts { "public, max-age=31536000, immutable" } else { "no-cache" }));
        said.insert(header::ETAG, HeaderValue::from_str(&asset.tag).expect("digits"));
        Some(response)
    }
}

impl Asset {
    fn read(path: &PathBuf, name: &str, left: &mut u64) -> std::io::Result<Asset> {
        let bytes = fs::read(path)?;
        *left = left.saturating_sub(bytes.len() as u64);
        let tag = format!("\"{}\"", &daemon::requests::hex(&Sha256::digest(&bytes))[..32]);
        Ok(Asset { bytes: bytes.into(), kind: content_type(name), lasts: name.starts_with("/assets/"), tag })
    }
}

/// Returns the content type of a file, derived from its suffix.
fn content_type(name: &str) -> &'static str {
    match name.rsplit_once('.').map_or("", |(_, suffix)| suffix) {
        "html" => "text/html; charset=utf-8",
        "js" | "mjs" => "text/javascript; charset=utf-8",
        "css" => "text/css; charset=utf-8",
        "json" | "map" => "application/json",
        "webmanifest" => "application/manifest+json",
        "svg" => "image/svg+xml",
        "png" => "image/png",
        "ico" => "image/x-icon",
        "webp" => "image/webp",
        "woff2" => "font/woff2",
        "woff" => "font/woff",
        "wasm" => "application/wasm",
        "txt" => "text/plain; charset=utf-8",
        _ => "application/octet-stream",
    }
}

fn refuse(message: String, remedy: &str) -> Refusals {
    vec![Refusal::new(Class::DefinitionError, message).remedy(remedy)]
}
