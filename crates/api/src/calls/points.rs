// SPDX-License-Identifier: Apache-2.0
//! Calls for the taught points of arms.
use std::path::PathBuf;
use supervisor::PointFile;
use taught::{TaughtPoint, TaughtPoints};

crate::calls! {
    /// Calls for taught points, which are stored in files set by programs.
    pub(super) const POINTS about "taught points" = [
        /// Sets the file in which the taught points of an arm are stored; it is created when the first point is taught.
        Configure name_points(
            must arm: String,
            must path: PathBuf,
            /// Identifier of the arm's mechanical model, as stored in the file.
            must model: String,
            /// Short names of the joints.
            must joints: Vec<String>,
            /// Unit of each joint, used if the file is created.
            must units: Vec<String>,
            /// True if points taught with other models are accepted as well.
            may any_model: bool,
        ) -> (): commands("arm"), local, unjournalled
            => |system| system.name_points(PointFile { arm, path, model, joints, units, any_model });
        /// Reads the taught points of an arm from its file, with its frames and tools.
        Observe points(must arm: String) -> TaughtPoints: costs
            => |system| taught::read(&system.point_file(&arm)?);
        /// Stores a taught point in the file of an arm, replacing any point with the same name.
        Operate teach_point(must arm: String, must point: TaughtPoint) -> (): commands("arm"), told
            => |system| taught::teach(&system.point_file(&arm)?, &point);
        /// Renames a taught point; its position in the file is kept.
        Operate rename_point(must arm: String, must name: String, must to: String) -> (): commands("arm"), told
            => |system| taught::rename(&system.point_file(&arm)?, &name, &to);
        /// Removes a taught point and returns it.
        Operate delete_point(must arm: String, must name: String) -> TaughtPoint: commands("arm"), told
            => |system| taught::delete(&system.point_file(&arm)?, &name);
    ];
}
