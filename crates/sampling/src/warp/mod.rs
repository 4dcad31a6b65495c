//! Warps: maps from the unit square (or interval) to shapes and densities, in triples.
//!
//! `square_to_x(u)` maps uniform numbers to the target, `square_to_x_pdf(x)` is its density with respect to length,
//! area or solid angle, and `x_to_square(x)` is the inverse map. Targets with parameters that take work to prepare
//! (spherical triangle and rectangle) are structs with `sample`, `pdf` and `invert`.

mod disk;
mod interval;
mod octahedral;
mod sphere;
mod spherical_rectangle;
mod spherical_triangle;
mod triangle;

pub use disk::{
    square_to_uniform_disk_concentric, square_to_uniform_disk_pdf, square_to_uniform_disk_polar,
    uniform_disk_concentric_to_square, uniform_disk_polar_to_square,
};
pub use interval::{
    bilinear_to_square, equiangular_to_unit, exponential_to_unit, linear_to_unit, normal_to_unit, smooth_step_to_unit,
    square_to_bilinear, square_to_bilinear_pdf, square_to_normal_2d, square_to_normal_2d_pdf, tent_to_unit,
    unit_to_equiangular, unit_to_equiangular_pdf, unit_to_exponential, unit_to_exponential_pdf, unit_to_linear,
    unit_to_linear_pdf, unit_to_normal, unit_to_normal_pdf, unit_to_smooth_step, unit_to_smooth_step_pdf, unit_to_tent,
    unit_to_tent_pdf,
};
pub use octahedral::{
    lat_long_to_square, octahedral_to_square, square_to_lat_long, square_to_lat_long_pdf, square_to_octahedral,
    square_to_octahedral_pdf, wrap_octahedral,
};
pub use sphere::{
    cosine_hemisphere_to_square, square_to_cosine_hemisphere, square_to_cosine_hemisphere_pdf, square_to_uniform_cone,
    square_to_uniform_cone_pdf, square_to_uniform_hemisphere, square_to_uniform_hemisphere_pdf,
    square_to_uniform_sphere, square_to_uniform_sphere_pdf, uniform_cone_to_square, uniform_hemisphere_to_square,
    uniform_sphere_to_square,
};
pub use spherical_rectangle::SphericalRectangle;
pub use spherical_triangle::{SphericalTriangle, spherical_triangle_area};
pub use triangle::{square_to_uniform_triangle, square_to_uniform_triangle_pdf, uniform_triangle_to_square};

#[cfg(test)]
mod tests;
