//! Renders of small scenes: exact values, and the same bits whatever the threads.

mod continuing;
mod counters;
mod coverage;
mod determinism;
mod furnace;
mod layers;
mod media;
mod scenes;
mod translucent;
