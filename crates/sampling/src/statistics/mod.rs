//! Statistics in double precision: distribution functions and quantiles, confidence intervals, tests of a mean,
//! regression, and discrepancy of point sets.
//!
//! These judge images, they do not make them: `f64` functions of the platform are used, which may differ in the last bit.

mod discrepancy;
mod distributions;
mod inference;
mod special;

pub use discrepancy::{l2_star_discrepancy, star_discrepancy};
pub use distributions::{
    chi_square_cdf, chi_square_quantile, normal_cdf, normal_pdf, normal_quantile, student_t_cdf, student_t_quantile,
};
pub use inference::{
    Interval, Regression, linear_regression, log_log_slope, mean_interval, mean_p_value, variance_interval,
};
pub use special::{beta_regularized, erfc, gamma_lower_regularized, ln_gamma};
