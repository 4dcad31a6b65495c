//! Scattering lobes and phase functions in a local frame; no textures, no positions.
