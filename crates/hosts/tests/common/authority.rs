// SPDX-License-Identifier: Apache-2.0
//! Certificates for hosts, created on demand.
use std::path::PathBuf;

/// An authority and the certificates it has signed, as PEM files in their own folder.
pub struct Authority {
    issuer: rcgen::Issuer<'static, rcgen::KeyPair>,
    folder: PathBuf,
    /// Certificate of the authority.
    pub authority: PathBuf,
}

impl Authority {
    /// Creates an authority with its files in its own folder, which is deleted with it.
    pub fn at(folder: PathBuf) -> Self {
        std::fs::create_dir_all(&folder).expect("the folder can be made");
        let key = rcgen::KeyPair::generate().expect("a key can be made");
        let mut params = rcgen::CertificateParams::new(Vec::new()).expect("no names");
        params.is_ca = rcgen::IsCa::Ca(rcgen::BasicConstraints::Unconstrained);
        let certificate = params.self_signed(&key).expect("it signs itself");
        let authority = folder.join("authority.pem");
        std::fs::write(&authority, certificate.pem()).expect("the folder is ours");
        Authority { issuer: rcgen::Issuer::new(params, key), folder, authority }
    }

    /// Returns a certificate for a host with these addresses, and its key.
    pub fn sign(&self, host: &str, addresses: &[&str]) -> (PathBuf, PathBuf) {
        use std::os::unix::fs::PermissionsExt;
        let key = rcgen::KeyPair::generate().expect("a key can be made");
        let names: Vec<String> = addresses.iter().map(|address| (*address).to_owned()).collect();
        let params = rcgen::CertificateParams::new(names).expect("addresses can be names");
        let certificate = params.signed_by(&key, &self.issuer).expect("the authority signs");
        let (at, key_at) = (self.folder.join(format!("{host}.pem")), self.folder.join(format!("{host}.key")));
        std::fs::write(&at, certificate.pem()).expect("the folder is ours");
        std::fs::write(&key_at, key.serialize_pem()).expect("the folder is ours");
        std::fs::set_permissions(&key_at, std::fs::Permissions::from_mode(0o600)).expect("the file is ours");
        (at, key_at)
    }
}

impl Drop for Authority {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.folder);
    }
}
