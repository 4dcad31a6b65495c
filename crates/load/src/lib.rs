//! Scene files to Scene, with diagnostics.
