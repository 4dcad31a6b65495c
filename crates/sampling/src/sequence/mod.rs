//! Deterministic point sequences and grids, their randomisation, and permutations.
//!
//! Every function is pure: index in, number out. `u32` results are fractions of 2^32; [`crate::rng::unit_f32`] turns
//! them into `[0, 1)` without leaving the elementary interval.

mod golden;
mod grid;
mod permutation;
mod pixel_nets;
mod radical_inverse;
mod scramble;
mod sobol;

pub use golden::{golden_ratio, r2, rd};
pub use grid::{jittered_1d, jittered_2d, multi_jittered, n_rooks, regular_1d, regular_2d};
pub use permutation::permutation_element;
pub use pixel_nets::{pascal_transposed, pixel_net, pixel_net_bits};
pub use radical_inverse::{
    HALTON_DIMENSIONS, PRIMES, halton, hammersley, inverse_radical_inverse, owen_radical_inverse,
    permuted_radical_inverse, radical_inverse, van_der_corput,
};
pub use scramble::{laine_karras, nested_uniform_scramble, owen_scramble};
pub use sobol::{SOBOL_DIMENSIONS, pascal, sobol_02, sobol_bits, sobol_index_of_pixel};
