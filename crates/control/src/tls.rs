// SPDX-License-Identifier: Apache-2.0
//! TLS: the server certificate, and the client certificates that are accepted.
use daemon::secret;
use model::refusal::{Class, Refusal, Refusals};
use rustls::pki_types::{CertificateDer, PrivateKeyDer};
use rustls::server::WebPkiClientVerifier;
use rustls::{RootCertStore, ServerConfig};
use sha2::{Digest, Sha256};
use std::fs::File;
use std::io::{BufReader, ErrorKind};
use std::path::{Path, PathBuf};
use std::sync::{Arc, PoisonError, RwLock};
use tokio_rustls::TlsAcceptor;

fn wrong(message: String, remedy: &str) -> Refusals {
    vec![Refusal::new(Class::DefinitionError, message).remedy(remedy)]
}

/// Returns the certificates of a PEM file.
pub fn certificates(path: &Path) -> Result<Vec<CertificateDer<'static>>, Refusals> {
    let failed = |why: std::io::Error| wrong(format!("cannot read certificates from '{}': {why}", path.display()), "give a PEM file");
    let file = File::open(path).map_err(failed)?;
    let found: Vec<_> = rustls_pemfile::certs(&mut BufReader::new(file)).collect::<Result<_, _>>().map_err(failed)?;
    if found.is_empty() {
        return Err(wrong(format!("there is no certificate in '{}'", path.display()), "give a PEM file"));
    }
    Ok(found)
}

/// Returns the SHA-256 fingerprint that identifies a client certificate.
pub fn fingerprint(certificate: &CertificateDer<'_>) -> [u8; 32] {
    Sha256::digest(certificate).into()
}

fn private_key(path: &Path) -> Result<PrivateKeyDer<'static>, Refusals> {
    let failed = |why: std::io::Error| wrong(format!("cannot read the key '{}': {why}", path.display()), "give a PEM file");
    let closed = |why: std::io::Error| match why.kind() {
        ErrorKind::PermissionDenied => wrong(format!("the TLS key: {why}"), "make it readable only by its owner"),
        _ => failed(why),
    };
    let file = secret::open(path).map_err(closed)?;
    let key = rustls_pemfile::private_key(&mut BufReader::new(file)).map_err(failed)?;
    key.ok_or_else(|| wrong(format!("there is no private key in '{}'", path.display()), "give a PEM file"))
}

/// TLS files, and the acceptor last created from them.
pub struct Tls {
    certificate: PathBuf,
    key: PathBuf,
    client_ca: Option<PathBuf>,
    only_certificates: bool,
    acceptor: RwLock<TlsAcceptor>,
}

impl Tls {
    /// Reads the files. `client_ca` is the authority that signs client certificates; `only_certificates` makes client certificates
    /// mandatory.
    pub fn open(certificate: &Path, key: &Path, client_ca: Option<&Path>, only_certificates: bool) -> Result<Tls, Refusals> {
        let acceptor = RwLock::new(acceptor(certificate, key, client_ca, only_certificates)?);
        Ok(Tls { certificate: certificate.to_owned(), key: key.to_owned(), client_ca: client_ca.map(Path::to_owned), only_certificates, acceptor })
    }

    /// Reloads the files for future connections. If they are invalid, fails, and the previous ones remain in use.
    pub fn reread(&self) -> Result<(), Refusals> {
        let new = acceptor(&self.certificate, &self.key, self.client_ca.as_deref(), self.only_certificates)?;
        *self.acceptor.write().unwrap_or_else(PoisonError::into_inner) = new;
        Ok(())
    }

    /// Returns the acceptor for a new connection.
    pub fn acceptor(&self) -> TlsAcceptor {
        self.acceptor.read().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

/// Creates a TLS acceptor from these files.
fn acceptor(certificate: &Path, key: &Path, client_ca: Option<&Path>, only_certificates: bool) -> Result<TlsAcceptor, Refusals> {
    let provider = Arc::new(rustls::crypto::ring::default_provider());
    let failed = |why: &dyn std::fmt::Display| {
        wrong(format!("cannot use '{}' and '{}' for TLS: {why}", certificate.display(), key.display()), "check that they belong together")
    };
    let builder = ServerConfig::builder_with_provider(provider.clone()).with_safe_default_protocol_versions().map_err(|why| failed(&why))?;
    let builder = match client_ca {
        None => builder.with_no_client_auth(),
        Some(path) => {
            let mut roots = RootCertStore::empty();
            for root in certificates(path)? {
                roots.add(root).map_err(|why| {
                    wrong(format!("'{}' has a certificate that cannot be used: {why}", path.display()), "give the certificate of the authority")
                })?;
            }
            let verifier = WebPkiClientVerifier::builder_with_provider(Arc::new(roots), provider);
            let verifier = if only_certificates { verifier } else { verifier.allow_unauthenticated() };
            builder.with_client_cert_verifier(verifier.build().map_err(|why| failed(&why))?)
        }
    };
    let mut config = builder.with_single_cert(certificates(certificate)?, private_key(key)?).map_err(|why| failed(&why))?;
    config.alpn_protocols = vec![b"http/1.1".to_vec()];
    Ok(TlsAcceptor::from(Arc::new(config)))
}
