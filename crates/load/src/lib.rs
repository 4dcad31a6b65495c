//! Scene files to `Scene`, with diagnostics.
//!
//! [`load_pbrt`] reads pbrt-v4 text. All problems of a scene are reported in one run, each with its place; nothing is printed.
//! Files are opened only through [`FileAccess`].

mod files;
pub mod nanovdb;
mod pbrt;
pub mod ply;
mod tensor;

pub use files::{Disk, FileAccess, Memory};
pub use pbrt::{Input, LoadOptions, LoadOutcome, load_pbrt};
