// SPDX-License-Identifier: Apache-2.0
//! Taught points of arms.
use std::path::PathBuf;
use supervisor::PointFile;
use taught::{TaughtPoint, TaughtPoints};

crate::calls! {
    /// Taught points, in files named by programs.
    pub(super) const POINTS about "taught points" = [
        /// Sets the file in which the taught points of an arm are kept; the first point creates it.
        Configure name_points(
            must arm: String,
            must path: PathBuf,
            /// Identifier of the mechanics of the arm, as stored in the file.
            must model: String,
            /// Short names of the joints.
            must joints: Vec<String>,
            /// Unit of each joint, for a file that is created.
            must units: Vec<String>,
            /// true: points of other models are accepted too.
            may any_model: bool,
        ) -> (): commands("arm"), local, unjournalled
            => |system| system.name_points(PointFile { arm, path, model, joints, units, any_model });
        /// Reads the taught points of an arm from its file, with its frames and tools.
        Observe points(must arm: String) -> TaughtPoints: costs
            => |system| taught::read(&system.point_file(&arm)?);
        /// Stores a taught point in the file of an arm, replacing the one of that name.
        Operate teach_point(must arm: String, must point: TaughtPoint) -> (): commands("arm"), told
            => |system| taught::teach(&system.point_file(&arm)?, &point);
        /// Renames a taught point; its place in the file is kept.
        Operate rename_point(must arm: String, must name: String, must to: String) -> (): commands("arm"), told
            => |system| taught::rename(&system.point_file(&arm)?, &name, &to);
        /// Removes a taught point and returns it.
        Operate delete_point(must arm: String, must name: String) -> TaughtPoint: commands("arm"), told
            => |system| taught::delete(&system.point_file(&arm)?, &name);
    ];
}
