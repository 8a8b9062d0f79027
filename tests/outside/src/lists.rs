// SPDX-License-Identifier: Apache-2.0
//! A kind of file with blocks: a list of names, each of a block of this crate.
use modules::{Backend, Description, LoadError, LoadOptions, LoadedModule};
use opengpac::read::BlockFace;
use opengpac::{FunctionBlock, Invocation, Outcome, Step};
use std::path::Path;

/// Triple: y = 3 u.
#[derive(FunctionBlock)]
pub struct Triple {
    /// input
    #[input(asynchronous, default = 1.0)]
    u: f64,
    /// three times the input
    #[output]
    y: f64,
}

impl Step for Triple {
    fn step(&mut self, _: &Invocation) -> Outcome {
        self.y = 3.0 * self.u;
        Outcome::Done
    }
}

/// Backend for lists of blocks.
pub struct Lists;

/// First line of each file of this kind.
const HEAD: &str = "#blocks\n";

impl Backend for Lists {
    fn describe(&self) -> Description {
        Description { kind: "a list of blocks", endings: &["blocks"] }
    }

    fn probe(&self, bytes: &[u8]) -> bool {
        bytes.starts_with(HEAD.as_bytes())
    }

    fn load_bytes(&self, path: &Path, bytes: Vec<u8>, _: &LoadOptions) -> Result<LoadedModule, LoadError> {
        let text = String::from_utf8_lossy(&bytes);
        let names = text.strip_prefix(HEAD).ok_or_else(|| LoadError::Failed(format!("'{}' does not begin with '#blocks'", path.display())))?;
        let block = |name: &str| match name {
            "triple" => BlockFace::read(Triple::descriptor(), &[]).map_err(|why| LoadError::Failed(why.to_string())),
            other => Err(LoadError::Failed(format!("'{}' lists '{other}'; there is only 'triple'", path.display()))),
        };
        Ok(LoadedModule {
            name: path.file_stem().unwrap_or_default().to_string_lossy().into_owned(),
            path: path.to_path_buf(),
            blocks: names.lines().map(block).collect::<Result<_, _>>()?,
            types: Vec::new(),
            target: String::new(),
            compiler: String::new(),
            changed_floats: false,
            bytes: bytes.into(),
        })
    }
}
