//! Film, tiles, threads, progress, stop rules.

mod film;
mod renderer;
mod sample;
mod sums;

pub use film::{Film, TILE_SIZE, Tile};
pub use renderer::{BadSample, Fault, Observer, Outcome, Plan, Progress, Quiet, Rendered, render, render_counted};
pub use sample::{PixelSampler, Sampled};
pub use sums::{PixelStack, PixelSum};
