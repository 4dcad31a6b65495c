//! Film, tiles, threads, progress, stop rules, checkpoints, shares of a distributed render.

mod bands;
mod chains;
pub mod contrast;
mod error;
mod error_goal;
mod fault;
mod features;
mod film;
mod layers;
mod photons;
mod renderer;
mod sample;
mod schedule;
mod seen;
mod share;
mod snapshot;
mod splats;
mod sums;
mod task;

pub use bands::read_spectrum;
pub use chains::Chains;
pub use error::Error;
pub use error_goal::{Assessment, DARKEST, ErrorGoal, ErrorMeasure, assess, pixel_errors};
pub use fault::{BadSample, Fault};
pub use features::{Features, MOST_FEATURE_SAMPLES, features};
pub use film::{Estimate, FINE_TILE_SIZE, Film, TILE_SIZE, Tile};
pub use layers::{CLAMPED, Layer, Layers, MOST_LAYERS, OUTLIERS, layer_width, light_groups, read_layers};
pub use renderer::{Rendered, render, render_counted, run, run_counted};
pub use sample::{PixelSampler, Sampled};
pub use schedule::{Schedule, looks};
pub use seen::Seen;
pub use share::{Part, Share, join, join_what_is_there};
pub use snapshot::{Identity, Label, Snapshot, differences};
pub use splats::{BRIGHTEST, Fixed, Landed, Splats};
pub use sums::{Node, PixelStack, PixelSum, nodes_of};
pub use task::{Adaptive, ENDLESS_SPP, Goals, Observer, Outcome, Plan, Progress, Quiet, Task};
