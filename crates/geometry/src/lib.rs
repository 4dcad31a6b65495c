//! Shapes: bounds, intersection, area and solid-angle sampling.
