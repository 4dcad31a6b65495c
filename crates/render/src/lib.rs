//! Film, tiles, threads, progress, stop rules.
