// SPDX-License-Identifier: Apache-2.0
use opengpac::{FunctionBlock, Invocation, Outcome, Step};

const COLUMNS_MAX: usize = 8;

/// The points are not in ascending order.
const NOT_RISING: u32 = 1;
/// The number of columns is out of range.
const BAD_COLUMNS: u32 = 2;
/// An input is NaN.
const NOT_A_NUMBER: u32 = 3;

/// Lookup surface: z = bilinear interpolation of z_ij between (x_i, y_j), the edge values held beyond the edges.
///
/// It maps two inputs to a value, as in a friction table, or for gains scheduled by load and speed. The rows of `zs` have 8 numbers, of
/// which only the first `columns` are used: `library.padded(Z)` pads them. Range: 2 to 16 rows, 2 to 8 columns, x and y ascending.
/// Faults: 1 the points xs or ys are not in ascending order; 2 the number of columns is not 2 to 8; 3 an input is NaN.
#[derive(FunctionBlock)]
pub struct LookupSurface {
    /// number of rows
    #[size(2, 16)]
    n: u32,
    /// first input, which selects the row
    #[input]
    x: f64,
    /// second input, which selects the column
    #[input]
    y: f64,
    /// interpolated value
    #[output]
    z: f64,
    /// first input at each row, ascending
    #[param(default = numbers(), sized, range = "[-inf, inf)")]
    xs: [f64; 16],
    /// number of columns, 2 to 8
    #[param(default = 2, range = "[2, 8]")]
    columns: u32,
    /// second input at each column, ascending; only the first `columns` are used
    #[param(default = numbers(), range = "[-inf, inf)")]
    ys: [f64; COLUMNS_MAX],
    /// values: one row for each of xs, of which only the first `columns` are used
    #[param(default = [[0.0; 8]; 16], sized, range = "[-inf, inf)")]
    zs: [[f64; COLUMNS_MAX]; 16],
}

/// 0, 1, 2, ...
fn numbers<const N: usize>() -> [f64; N] {
    std::array::from_fn(|i| i as f64)
}

/// Returns the interval that contains u, and the position of u in it as a fraction, 0 to 1; clamps u to the ends.
fn place(points: &[f64], u: f64) -> (usize, f64) {
    let last = points.len() - 1;
    let i = points[1..last].partition_point(|x| *x <= u);
    (i, ((u - points[i]) / (points[i + 1] - points[i])).clamp(0.0, 1.0))
}

impl Step for LookupSurface {
    fn step(&mut self, _: &Invocation) -> Outcome {
        let (rows, columns) = (self.n as usize, self.columns as usize);
        if !(2..=COLUMNS_MAX).contains(&columns) {
            return Outcome::Fault(BAD_COLUMNS);
        }
        let (xs, ys) = (&self.xs[..rows], &self.ys[..columns]);
        if !(xs.is_sorted_by(|a, b| a < b) && ys.is_sorted_by(|a, b| a < b)) {
            return Outcome::Fault(NOT_RISING);
        }
        if self.x.is_nan() || self.y.is_nan() {
            return Outcome::Fault(NOT_A_NUMBER);
        }
        let ((i, s), (j, t)) = (place(xs, self.x), place(ys, self.y));
        let along = |row: &[f64; COLUMNS_MAX]| row[j] + (row[j + 1] - row[j]) * t;
        let (low, high) = (along(&self.zs[i]), along(&self.zs[i + 1]));
        self.z = low + (high - low) * s;
        Outcome::Done
    }
}
