//! Development only: chi-square, t and z tests, deterministic random numbers for tests; takes closures.
