//! Textures as the user stated them: plain data, evaluated by `World`.

use crate::Handle;
use steradian_image::{Lookup, Texels, Wrap};
use steradian_math::{Transform, Vec3};
use steradian_spectrum::{ColorSpace, Spectrum, SpectrumUse};

/// How a surface point is mapped to the plane of a texture.
#[derive(Clone, Debug, PartialEq)]
pub enum Mapping2 {
    /// The surface's own coordinates, scaled and shifted: `(su u + du, sv v + dv)`.
    Uv {
        /// Factor of u.
        su: f32,
        /// Factor of v.
        sv: f32,
        /// Shift of u.
        du: f32,
        /// Shift of v.
        dv: f32,
    },
    /// An affine map of one of the mesh's sets of coordinates: `(m00 u + m01 v + m02, m10 u + m11 v + m12)`.
    Affine {
        /// Which set; 0 is the surface's own.
        set: u32,
        /// Rows of the matrix.
        rows: [[f32; 3]; 2],
    },
    /// Polar angle and azimuth around the origin of texture space: `(theta / pi, phi / 2 pi)`.
    Spherical {
        /// World to texture space.
        texture_from_world: Transform,
    },
    /// Azimuth and height: `(phi / 2 pi, z)`.
    Cylindrical {
        /// World to texture space.
        texture_from_world: Transform,
    },
    /// Projections on two vectors: `(p . vs + ds, p . vt + dt)`.
    Planar {
        /// World to texture space.
        texture_from_world: Transform,
        /// First axis.
        vs: Vec3,
        /// Second axis.
        vt: Vec3,
        /// Shift along the first axis.
        ds: f32,
        /// Shift along the second axis.
        dt: f32,
    },
}

impl Default for Mapping2 {
    fn default() -> Self {
        Self::Uv { su: 1.0, sv: 1.0, du: 0.0, dv: 0.0 }
    }
}

/// A picture as it was read, and how it is looked up. `World` makes a pyramid of it.
#[derive(Clone, Debug)]
pub struct TextureImage {
    /// Where it came from, for messages.
    pub name: String,
    /// The texels.
    pub texels: Texels,
    /// Filtering.
    pub lookup: Lookup,
    /// What lies outside the unit square, in s and t.
    pub wrap: [Wrap; 2],
    /// The meaning of RGB texels.
    pub color_space: ColorSpace,
}

impl TextureImage {
    /// The mean luminance over all texels.
    pub fn mean_luminance(&self) -> f32 {
        let t = &self.texels;
        let y = self.color_space.xyz_from_rgb().0[1];
        let mut sum = 0.0f64;
        for j in 0..t.height() {
            for i in 0..t.width() {
                sum += f64::from(if t.channels() < 3 {
                    t.texel(i, j, 0)
                } else {
                    (0..3).map(|c| y[c] * t.texel(i, j, c)).sum::<f32>()
                });
            }
        }
        (sum / (t.width() * t.height()).max(1) as f64) as f32
    }
}

/// An image on a surface: `max(0, scale * texel)` or, inverted, `max(0, 1 - scale * texel)`.
#[derive(Clone, Debug)]
pub struct ImageMap {
    /// From surface to image; the image's t axis points up.
    pub mapping: Mapping2,
    /// The picture.
    pub image: Handle<TextureImage>,
    /// Factor.
    pub scale: f32,
    /// Whether to take the complement.
    pub invert: bool,
}

/// Values in the middle of the cells of a box in space, x fastest, interpolated in between.
#[derive(Clone, Debug)]
pub struct GridTexture {
    /// World space to the unit cube that the cells fill.
    pub texture_from_world: Transform,
    /// Number of cells along x, y, z.
    pub size: [u32; 3],
    /// One, or three, which are linear sRGB.
    pub channels: usize,
    /// The values, channels side by side.
    pub values: Vec<f32>,
    /// What lies outside the box.
    pub wrap: Wrap,
    /// Whether each cell has its value all over.
    pub nearest: bool,
}

/// The mapping of a checkerboard decides its dimension.
#[derive(Clone, Debug)]
pub enum CheckerMapping {
    /// Squares in the plane.
    Plane(Mapping2),
    /// Cubes in texture space.
    Space(Transform),
}

/// Textures of either kind share their structure; `T` is the handle of the same kind, `C` a constant.
#[derive(Clone, Debug)]
pub enum Texture<T, C> {
    /// The same everywhere.
    Constant(C),
    /// `tex * scale`.
    Scale {
        /// The factor texture.
        tex: T,
        /// The factor.
        scale: Handle<FloatTexture>,
    },
    /// `a * b`.
    Product {
        /// One factor.
        a: T,
        /// The other.
        b: T,
    },
    /// One where the factor texture is at least `at`, else zero.
    Threshold {
        /// What is compared.
        tex: T,
        /// The threshold.
        at: f32,
    },
    /// The colour at the vertices of a mesh; as a scalar, its opacity.
    Vertex,
    /// A named quantity of a mesh; zero where the surface has none of that name. Three numbers whose name contains `color` are a
    /// colour.
    Attribute(String),
    /// `(1 - amount) * a + amount * b`.
    Mix {
        /// At amount 0.
        a: T,
        /// At amount 1.
        b: T,
        /// The blend.
        amount: Handle<FloatTexture>,
    },
    /// `w * a + (1 - w) * b` with `w = |n . dir|`.
    DirectionMix {
        /// Where the normal is along `dir`.
        a: T,
        /// Where it is perpendicular.
        b: T,
        /// Unit direction in world space.
        dir: Vec3,
    },
    /// Bilinear interpolation of four corners in the order 00, 01, 10, 11 (second digit: t).
    Bilerp {
        /// Surface to the unit square.
        mapping: Mapping2,
        /// The corners.
        corners: [C; 4],
    },
    /// Alternating squares or cubes of unit size.
    Checkerboard {
        /// Dimension and mapping.
        mapping: CheckerMapping,
        /// Where the sum of the cell's coordinates is even.
        a: T,
        /// Where it is odd.
        b: T,
    },
    /// Discs placed by noise, at most one to a unit cell.
    Dots {
        /// Surface to the plane.
        mapping: Mapping2,
        /// In a disc.
        inside: T,
        /// Elsewhere.
        outside: T,
    },
    /// A picture.
    Image(ImageMap),
    /// A grid of values in space.
    Grid(Handle<GridTexture>),
    /// Noise of one kind or another.
    Noise {
        /// World to texture space.
        texture_from_world: Transform,
        /// Which function.
        noise: Noise,
    },
}

/// Noise functions of texture space (Perlin 1985, 2002; Musgrave in Ebert et al. 2003).
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Noise {
    /// Fractional Brownian motion (float).
    Fbm {
        /// Number of octaves.
        octaves: u32,
        /// The ratio of amplitudes between octaves.
        omega: f32,
    },
    /// Turbulence: the sum of absolute values (float).
    Wrinkled {
        /// Number of octaves.
        octaves: u32,
        /// The ratio of amplitudes between octaves.
        omega: f32,
    },
    /// Waves under changing wind (float).
    Windy,
    /// A colour spline disturbed by fractional Brownian motion (spectrum).
    Marble {
        /// Number of octaves.
        octaves: u32,
        /// The ratio of amplitudes between octaves.
        omega: f32,
        /// Frequency of the pattern.
        scale: f32,
        /// Strength of the disturbance.
        variation: f32,
    },
}

/// A scalar that varies over surfaces.
#[derive(Clone, Debug)]
pub struct FloatTexture(pub Texture<Handle<FloatTexture>, f32>);

/// A spectrum that varies over surfaces. `usage` says what RGB texels stand for.
#[derive(Clone, Debug)]
pub struct SpectrumTexture {
    /// Reflectance, unbounded quantity or illuminant.
    pub usage: SpectrumUse,
    /// The texture.
    pub kind: Texture<Handle<SpectrumTexture>, Spectrum>,
}
