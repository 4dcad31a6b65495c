//! Round trips of all warps and chi-square of the maps against their densities.
