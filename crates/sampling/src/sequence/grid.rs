//! Grids of the unit interval and square: regular, jittered (stratified), N-rooks (Latin hypercube) and correlated
//! multi-jittered (Kensler 2013). All are functions of the sample index, so a point can be had without the others.

use super::permutation::permutation_element;
use crate::rng::{hash_u64, unit_f32};
use steradian_math::ONE_MINUS_EPSILON;

/// Centre of stratum `index` of `count`.
#[inline]
pub fn regular_1d(index: u32, count: u32) -> f32 {
    place(index, count, 0.5)
}

/// Random point of stratum `index` of `count`.
#[inline]
pub fn jittered_1d(index: u32, count: u32, seed: u64) -> f32 {
    place(index, count, noise(index, seed)[0])
}

/// Centre of cell `index` of a grid of `nx` times `ny` cells, `x` fastest.
#[inline]
pub fn regular_2d(index: u32, nx: u32, ny: u32) -> [f32; 2] {
    let nx = nx.max(1);
    [place(index % nx, nx, 0.5), place(index / nx, ny, 0.5)]
}

/// Random point of cell `index` of a grid of `nx` times `ny` cells, `x` fastest.
#[inline]
pub fn jittered_2d(index: u32, nx: u32, ny: u32, seed: u64) -> [f32; 2] {
    let nx = nx.max(1);
    let [u, v] = noise(index, seed);
    [place(index % nx, nx, u), place(index / nx, ny, v)]
}

/// Point `index` of `count` of which every row and every column of a `count` by `count` grid holds one.
#[inline]
pub fn n_rooks(index: u32, count: u32, seed: u64) -> [f32; 2] {
    let [u, v] = noise(index, seed);
    [place(index, count, u), place(permutation_element(index, count, seed as u32), count, v)]
}

/// Point `index` of `nx * ny` which are stratified over the `nx` by `ny` grid and, at once, over rows and columns of the fine grid.
#[inline]
pub fn multi_jittered(index: u32, nx: u32, ny: u32, seed: u64) -> [f32; 2] {
    let (nx, ny) = (nx.max(1), ny.max(1));
    let (x, y) = (index % nx, index / nx % ny);
    let sub_x = permutation_element(y, ny, (seed >> 32) as u32);
    let sub_y = permutation_element(x, nx, seed as u32);
    let [u, v] = noise(index, seed);
    [place(x * ny + sub_x, nx * ny, u), place(y * nx + sub_y, nx * ny, v)]
}

#[inline(always)]
fn place(stratum: u32, count: u32, u: f32) -> f32 {
    // In double precision the point stays in its stratum even with millions of strata.
    (((f64::from(stratum) + f64::from(u)) / f64::from(count.max(1))) as f32).min(ONE_MINUS_EPSILON)
}

#[inline(always)]
fn noise(index: u32, seed: u64) -> [f32; 2] {
    let bits = hash_u64(&[u64::from(index), seed]);
    [unit_f32(bits as u32), unit_f32((bits >> 32) as u32)]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn one_per_cell(points: &[[f32; 2]], nx: usize, ny: usize) {
        let mut seen = vec![false; nx * ny];
        for p in points {
            let cell = (p[1] * ny as f32) as usize * nx + (p[0] * nx as f32) as usize;
            assert!(!seen[cell], "cell {cell} of {nx} x {ny} holds two points");
            seen[cell] = true;
        }
    }

    #[test]
    fn grids_keep_their_promise() {
        let points: Vec<_> = (0..12).map(|i| jittered_2d(i, 4, 3, 5)).collect();
        one_per_cell(&points, 4, 3);
        let points: Vec<_> = (0..12).map(|i| regular_2d(i, 4, 3)).collect();
        one_per_cell(&points, 4, 3);
        let points: Vec<_> = (0..12).map(|i| multi_jittered(i, 4, 3, 5)).collect();
        one_per_cell(&points, 4, 3);
        one_per_cell(&points, 12, 1);
        one_per_cell(&points, 1, 12);
        let points: Vec<_> = (0..12).map(|i| n_rooks(i, 12, 5)).collect();
        one_per_cell(&points, 12, 1);
        one_per_cell(&points, 1, 12);
        let points: Vec<_> = (0..12).map(|i| [jittered_1d(i, 12, 1), regular_1d(i, 12)]).collect();
        one_per_cell(&points, 12, 1);
        one_per_cell(&points, 1, 12);
    }
}
