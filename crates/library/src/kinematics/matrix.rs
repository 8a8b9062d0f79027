// SPDX-License-Identifier: Apache-2.0
//! Symmetric matrices of six rows: solution and eigenvalues.

/// A matrix of six rows and six columns.
pub type Square = [[f64; 6]; 6];

/// Solves a x = b for a symmetric positive definite a (Cholesky); returns `None` if a is not positive definite.
pub fn solve(a: &Square, b: &[f64; 6]) -> Option<[f64; 6]> {
    let mut l = [[0.0; 6]; 6];
    for i in 0..6 {
        for j in 0..=i {
            let known: f64 = (0..j).map(|k| l[i][k] * l[j][k]).sum();
            let rest = a[i][j] - known;
            if i != j {
                l[i][j] = rest / l[j][j];
            } else if rest > 0.0 {
                l[i][i] = rest.sqrt();
            } else {
                return None;
            }
        }
    }
    let mut x = *b;
    for i in 0..6 {
        let known: f64 = (0..i).map(|k| l[i][k] * x[k]).sum();
        x[i] = (x[i] - known) / l[i][i];
    }
    for i in (0..6).rev() {
        let known: f64 = (i + 1..6).map(|k| l[k][i] * x[k]).sum();
        x[i] = (x[i] - known) / l[i][i];
    }
    Some(x)
}

/// Computes the eigenvalues of a symmetric matrix, largest first (cyclic Jacobi rotations).
pub fn eigenvalues(a: &Square) -> [f64; 6] {
    const SWEEPS: usize = 12;
    let mut a = *a;
    for _ in 0..SWEEPS {
        for p in 0..5 {
            for q in p + 1..6 {
                rotate(&mut a, p, q);
            }
        }
    }
    let mut values: [f64; 6] = std::array::from_fn(|i| a[i][i]);
    values.sort_unstable_by(|x, y| y.total_cmp(x));
    values
}

/// Applies one rotation that makes a[p][q] zero.
fn rotate(a: &mut Square, p: usize, q: usize) {
    if a[p][q] == 0.0 {
        return;
    }
    let theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
    let t = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
    let c = 1.0 / (t * t + 1.0).sqrt();
    let s = t * c;
    for row in a.iter_mut() {
        (row[p], row[q]) = (c * row[p] - s * row[q], s * row[p] + c * row[q]);
    }
    let (first, second) = (a[p], a[q]);
    a[p] = std::array::from_fn(|k| c * first[k] - s * second[k]);
    a[q] = std::array::from_fn(|k| s * first[k] + c * second[k]);
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns B Bᵀ + 0.1 for some B.
    fn positive() -> Square {
        let b: Square = std::array::from_fn(|i| std::array::from_fn(|j| ((i * 7 + j * 3) as f64).sin()));
        std::array::from_fn(|i| std::array::from_fn(|j| (0..6).map(|k| b[i][k] * b[j][k]).sum::<f64>() + if i == j { 0.1 } else { 0.0 }))
    }

    #[test]
    fn a_solution_solves() {
        let (a, b) = (positive(), [1.0, -2.0, 3.0, 0.5, 0.0, 1.5]);
        let x = solve(&a, &b).expect("positive definite");
        for i in 0..6 {
            let sum: f64 = (0..6).map(|j| a[i][j] * x[j]).sum();
            assert!((sum - b[i]).abs() < 1e-12);
        }
        assert!(solve(&[[0.0; 6]; 6], &b).is_none());
    }

    #[test]
    fn eigenvalues_have_the_trace_and_the_square_sum_and_are_sorted() {
        let a = positive();
        let values = eigenvalues(&a);
        let trace: f64 = (0..6).map(|i| a[i][i]).sum();
        let squares: f64 = a.iter().flatten().map(|x| x * x).sum();
        assert!((values.iter().sum::<f64>() - trace).abs() < 1e-12);
        assert!((values.iter().map(|v| v * v).sum::<f64>() - squares).abs() < 1e-9);
        assert!(values.windows(2).all(|w| w[0] >= w[1]) && values[5] >= 0.1 - 1e-12);
    }
}
