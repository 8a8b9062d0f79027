// SPDX-License-Identifier: Apache-2.0
//! Compatibility check for code: a shared object must have the right version of the block interface and the right target platform.
use crate::failure::Failure;
use model::refusal::Class;
use serde::Deserialize;

/// Name and origin of the body of `PUT /v1/modules/NAME`.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ModuleOrigin {
    /// Name of the file; its extension determines its kind.
    pub file: String,
    pub sha256: String,
    /// Version of the block interface of a shared object.
    #[serde(default)]
    pub abi: Option<u32>,
    /// Target platform of a shared object.
    #[serde(default)]
    pub target: Option<String>,
}

/// Returns the target platform of this machine, such as `x86_64-linux`.
pub fn target() -> String {
    format!("{}-{}", std::env::consts::ARCH, std::env::consts::OS)
}

/// Refuses a shared object for a different platform or block interface; the refusal names the module.
pub fn check_target(module: &str, named: &ModuleOrigin, bytes: &[u8]) -> Result<(), Failure> {
    let refuse = |message: String, remedy: &str| Err(Failure::new(Class::ModuleError, message, remedy));
    if !bytes.starts_with(b"\x7fELF") {
        return Ok(());
    }
    match (&named.target, named.abi) {
        (Some(for_target), _) if *for_target != target() => {
            refuse(format!("module '{module}' is for {for_target}, but this system runs on {}", target()), "build it for that target, or send its source")
        }
        (_, Some(abi)) if abi != opengpac::abi::ABI => refuse(
            format!("module '{module}' has version {abi} of the block interface, but this system has {}", opengpac::abi::ABI),
            "build it again with this version",
        ),
        (Some(_), Some(_)) => Ok(()),
        _ => refuse(format!("module '{module}' is a shared object that does not name its machine"), "send abi= and target= as given by GET /v1/version"),
    }
}
