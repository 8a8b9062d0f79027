// SPDX-License-Identifier: Apache-2.0
//! Triangles of a model's meshes, for drawing. They are not among the fields that MuJoCo's library provides by name, but the Python
//! package that contains the library has them: a child process reads them with that package. If there is no package or the child fails, a
//! mesh is drawn as its bounding box.
use super::trial::limits;
use device::Mesh;
use std::path::Path;
use std::process::{Command, Stdio};

const SCRIPT: &str = concat!(include_str!("limits.py"), include_str!("meshes.py"));
/// Maximum number of triangles in a whole model. Keeps the frame rate in a browser high, and limits the size of an answer.
const FACES_MAX: usize = 150_000;
/// Resolution of vertices, per metre.
const PER_M: f64 = 1e6;

/// Reads the meshes with these numbers in the model, and returns as many of them, in order, as fit into [`FACES_MAX`]. `library` is the
/// path of MuJoCo's library. Blocks until the child has exited.
pub(super) fn read(library: &Path, model: &Path, asked: &[i32]) -> Vec<Option<Mesh>> {
    let none = || vec![None; asked.len()];
    let Some(package) = library.parent().filter(|_| !asked.is_empty()) else { return none() };
    let mut command = Command::new(device::interpreter());
    command.args(["-I", "-c", SCRIPT]).args([package, model]).args(limits()).args(asked.iter().map(i32::to_string));
    let output = command.stdin(Stdio::null()).stderr(Stdio::null()).output();
    let Some(output) = output.ok().filter(|output| output.status.success()) else { return none() };
    let (mut rest, mut left) = (output.stdout.as_slice(), FACES_MAX);
    let whole: Option<Vec<Option<Mesh>>> = asked.iter().map(|_| next(&mut rest).map(|mesh| within(&mut left, mesh))).collect();
    whole.unwrap_or_else(none)
}

/// Returns the mesh, if enough faces are left for it.
fn within(left: &mut usize, mesh: Mesh) -> Option<Mesh> {
    *left = left.checked_sub(mesh.faces.len() / 3)?;
    Some(mesh)
}

/// Returns the next mesh written by the child; `None` if it is incomplete.
fn next(rest: &mut &[u8]) -> Option<Mesh> {
    let (vertices, faces) = (count(rest)?, count(rest)?);
    let vertices = words(rest, vertices)?.map(|word| (f64::from(f32::from_le_bytes(word)) * PER_M).round() / PER_M).collect();
    let faces = words(rest, faces)?.map(|word| u32::from_le_bytes(word) as usize).collect();
    Some(Mesh { vertices, faces })
}

fn count(rest: &mut &[u8]) -> Option<usize> {
    let (count, after) = rest.split_first_chunk()?;
    *rest = after;
    usize::try_from(u64::from_le_bytes(*count)).ok()
}

/// Splits three 4-byte words per row off the front of `rest`; `None` if it is too short.
fn words<'a>(rest: &mut &'a [u8], rows: usize) -> Option<impl Iterator<Item = [u8; 4]> + use<'a>> {
    let (words, after) = rest.split_at_checked(rows.checked_mul(12)?)?;
    *rest = after;
    Some(words.as_chunks().0.iter().copied())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn written(vertices: &[f32], faces: &[u32]) -> Vec<u8> {
        let counts = [vertices.len() / 3, faces.len() / 3].into_iter().flat_map(|count| (count as u64).to_le_bytes());
        counts.chain(vertices.iter().flat_map(|v| v.to_le_bytes())).chain(faces.iter().flat_map(|f| f.to_le_bytes())).collect()
    }

    #[test]
    fn what_a_child_has_written_whole_is_a_mesh() {
        let bytes = written(&[0.1, 0.2, 0.3, 1.0, 2.0, 3.0], &[0, 1, 0]);
        let mut rest = bytes.as_slice();
        assert_eq!(next(&mut rest), Some(Mesh { vertices: vec![0.1, 0.2, 0.3, 1.0, 2.0, 3.0], faces: vec![0, 1, 0] }));
        assert_eq!(next(&mut rest), None);
        for cut in 0..bytes.len() {
            assert_eq!(next(&mut &bytes[..cut]), None, "{cut}");
        }
    }

    #[test]
    fn as_many_meshes_as_there_is_room_for_are_given() {
        let mesh = |faces: usize| Mesh { vertices: vec![], faces: vec![0; 3 * faces] };
        let mut left = 10;
        let given: Vec<bool> = [6, 5, 4, 1].map(|faces| within(&mut left, mesh(faces)).is_some()).into();
        assert_eq!(given, [true, false, true, false]);
    }

    #[test]
    fn without_the_package_there_are_none() {
        assert_eq!(read(Path::new("/nowhere/mujoco/libmujoco.so"), Path::new("/nowhere/arm.xml"), &[0, 1]), [None, None]);
    }
}
