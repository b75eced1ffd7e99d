//! The normal equations of a similarity: (step of luminance, shift in x and y, stretch, turn).

use crate::row::warp::{SUMS, UNKNOWNS};

/// Least mean squared gradient, of what the unknowns before do not explain, (luminance / px)^2.
const STRUCTURE: f64 = 1e-8;

/// Solves the equations that [`crate::row::warp::normal`] sums up. None where the picture has no structure for a shift;
/// where it has none for stretch or turn, these stay zero.
#[allow(clippy::needless_range_loop, reason = "rows and columns of a matrix read best as such")]
pub(crate) fn solve(sums: &[f64; SUMS]) -> Option<[f64; UNKNOWNS]> {
    let (mut upper, right) = (sums[..SUMS - UNKNOWNS].iter(), &sums[SUMS - UNKNOWNS..]);
    let mut matrix = [[0.0; UNKNOWNS]; UNKNOWNS];
    for i in 0..UNKNOWNS {
        for j in i..UNKNOWNS {
            matrix[j][i] = *upper.next()?;
        }
    }
    let weights = matrix[0][0];
    if weights <= 0.0 {
        return None;
    }
    // L D L^T, with L D in the lower triangle and 1 / D, or 0 for what is left out, aside.
    let mut inverse = [0.0; UNKNOWNS];
    let mut solution = [0.0; UNKNOWNS];
    for k in 0..UNKNOWNS {
        for i in k..UNKNOWNS {
            matrix[i][k] -= (0..k).map(|j| matrix[i][j] * matrix[k][j] * inverse[j]).sum::<f64>();
        }
        if k == 0 || matrix[k][k] / weights >= STRUCTURE {
            inverse[k] = 1.0 / matrix[k][k];
        } else if k < 3 {
            return None;
        }
        solution[k] = right[k] - (0..k).map(|j| matrix[k][j] * inverse[j] * solution[j]).sum::<f64>();
    }
    for k in (0..UNKNOWNS).rev() {
        let later = (k + 1..UNKNOWNS).map(|i| matrix[i][k] * solution[i]).sum::<f64>();
        solution[k] = inverse[k] * (solution[k] - later);
    }
    Some(solution)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The sums of a positive matrix times a known solution.
    fn sums(rows: &[[f64; UNKNOWNS]], truth: [f64; UNKNOWNS]) -> [f64; SUMS] {
        let mut sums = [0.0; SUMS];
        for row in rows {
            let r: f64 = row.iter().zip(truth).map(|(a, b)| a * b).sum();
            let products = (0..UNKNOWNS).flat_map(|i| (i..UNKNOWNS).map(move |j| row[i] * row[j]));
            let all = products.chain(row.iter().map(|a| a * r));
            sums.iter_mut().zip(all).for_each(|(sum, term)| *sum += term);
        }
        sums
    }

    #[test]
    fn gives_back_the_solution() {
        let truth = [0.02, -1.5, 2.0, 0.3, -0.7];
        let rows: Vec<[f64; UNKNOWNS]> = (0..40)
            .map(|i| {
                let t = f64::from(i);
                [-1.0, (0.7 * t).sin(), (1.1 * t).cos(), (1.9 * t).sin(), (2.3 * t + 1.0).cos()]
            })
            .collect();
        let found = solve(&sums(&rows, truth)).unwrap();
        assert!(found.iter().zip(truth).all(|(a, b)| (a - b).abs() < 1e-9), "{found:?}");
        // Nothing to tell a turn by: it stays zero, and the others are right.
        let flat: Vec<_> = rows.iter().map(|[a, b, c, d, _]| [*a, *b, *c, *d, 0.0]).collect();
        let found = solve(&sums(&flat, truth)).unwrap();
        assert!(found[..4].iter().zip(truth).all(|(a, b)| (a - b).abs() < 1e-9) && found[4] == 0.0, "{found:?}");
        // Stripes.
        let stripes: Vec<_> = rows.iter().map(|[a, b, _, d, e]| [*a, *b, 0.5 * b, *d, *e]).collect();
        assert_eq!(solve(&sums(&stripes, truth)), None);
        assert_eq!(solve(&[0.0; SUMS]), None);
    }
}
