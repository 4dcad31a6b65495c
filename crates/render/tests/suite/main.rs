//! Renders of small scenes: exact values, and the same bits whatever the threads.

mod continuing;
mod determinism;
mod furnace;
mod scenes;
