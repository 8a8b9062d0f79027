// SPDX-License-Identifier: Apache-2.0
//! Taught points of arms.
use std::path::PathBuf;
use supervisor::PointFile;
use taught::{TaughtPoint, TaughtPoints};

crate::calls! {
    /// Taught points, in the files that programs named.
    pub(super) const POINTS about "taught points" = [
        /// Says in which file the taught points of an arm are kept; the first point makes it.
        Configure name_points(
            must arm: String,
            must path: PathBuf,
            /// Identifier of the mechanics of the arm, which the file says.
            must model: String,
            /// Joints by their short names.
            must joints: Vec<String>,
            /// Unit of each of them in a file that is made.
            must units: Vec<String>,
            /// true: the points of another model count too.
            may any_model: bool,
        ) -> (): commands("arm"), local, unjournalled
            => |system| system.name_points(PointFile { arm, path, model, joints, units, any_model });
        /// Returns the taught points of an arm as its file has them now, with its frames and tools.
        Observe points(must arm: String) -> TaughtPoints: costs
            => |system| taught::read(&system.point_file(&arm)?);
        /// Enters a taught point into the file of an arm, in the place of the one of that name.
        Operate teach_point(must arm: String, must point: TaughtPoint) -> (): commands("arm"), told
            => |system| taught::teach(&system.point_file(&arm)?, &point);
        /// Gives a taught point another name; it keeps its place.
        Operate rename_point(must arm: String, must name: String, must to: String) -> (): commands("arm"), told
            => |system| taught::rename(&system.point_file(&arm)?, &name, &to);
        /// Removes a taught point, and returns it.
        Operate delete_point(must arm: String, must name: String) -> TaughtPoint: commands("arm"), told
            => |system| taught::delete(&system.point_file(&arm)?, &name);
    ];
}
