//! Development only: chi-square, t and z tests, and deterministic random numbers for tests.
//!
//! Everything takes closures and plain numbers; no type of the product appears here, and none of its code is used: the
//! judge must not depend on the judged. Every test states its significance, the chance of a false alarm.

mod chi_square;
mod hypothesis;
mod integrate;
mod random;
mod special;

pub use chi_square::{ChiSquareResult, ChiSquareTest};
pub use hypothesis::{bonferroni, sidak, t_test, z_test};
pub use integrate::integrate_rectangle;
pub use random::TestRng;
pub use special::{
    beta_regularized, chi_square_survival, erfc, gamma_upper_regularized, ln_gamma, student_t_two_sided,
};
