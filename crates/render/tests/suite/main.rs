//! Renders of small scenes: exact values, and the same bits whatever the threads.

mod bidirectional;
mod continuing;
mod counters;
mod coverage;
mod determinism;
mod furnace;
mod layers;
mod media;
mod moving_lights;
mod progressive;
mod scenes;
mod side_by_side;
mod systems;
mod techniques;
mod translucent;
