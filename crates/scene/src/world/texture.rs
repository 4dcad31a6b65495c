//! Evaluation of textures at a point of a surface.

use super::World;
use super::noise::{fbm, noise2, turbulence};
use crate::{CheckerMapping, FloatTexture, Handle, ImageMap, Mapping2, Noise, SpectrumTexture, Texture};
use steradian_math::{
    INV_2PI, INV_PI, Normal3, PI, Point2, Point3, Transform, Vec2, Vec3, atan2, lerp, safe_acos, sin, sqr,
};
use steradian_spectrum::{ColorSpace, Lanes, SpectrumUse, Wavelengths};

/// What textures may depend on: the place, its coordinates, and the footprint of the sample.
#[derive(Clone, Copy, Debug, Default)]
pub struct TextureContext {
    /// World position.
    pub p: Point3,
    /// Change of position to the next sample in x.
    pub dpdx: Vec3,
    /// Change of position to the next sample in y.
    pub dpdy: Vec3,
    /// Shading normal.
    pub n: Normal3,
    /// Surface coordinates.
    pub uv: Point2,
    /// Change of (u, v) to the next sample in x.
    pub duv_dx: Vec2,
    /// Change of (u, v) to the next sample in y.
    pub duv_dy: Vec2,
    /// Where on a mesh, for what its vertices carry.
    pub on_mesh: Option<MeshPoint>,
}

/// A point of a triangle mesh.
#[derive(Clone, Copy, Debug)]
pub struct MeshPoint {
    /// Index of the mesh.
    pub mesh: u32,
    /// The face.
    pub face: u32,
    /// Barycentric coordinates.
    pub b: [f32; 2],
}

struct Coordinates2 {
    st: Point2,
    dx: Vec2,
    dy: Vec2,
}

struct Coordinates3 {
    p: Point3,
    dx: Vec3,
    dy: Vec3,
}

fn azimuth(p: Point3) -> f32 {
    let phi = atan2(p.y, p.x);
    if phi < 0.0 { phi + 2.0 * PI } else { phi }
}

fn map2(mapping: &Mapping2, c: &TextureContext, uv: impl Fn(u32) -> Point2) -> Coordinates2 {
    // (s, t) differentials from gradients with respect to the point in texture space.
    let along = |t: &Transform, ds: Vec3, dt: Vec3| {
        let (dx, dy) = (t.vector(c.dpdx), t.vector(c.dpdy));
        (Vec2::new(ds.dot(dx), dt.dot(dx)), Vec2::new(ds.dot(dy), dt.dot(dy)))
    };
    match mapping {
        &Mapping2::Uv { su, sv, du, dv } => Coordinates2 {
            st: Point2::new(su * c.uv.x + du, sv * c.uv.y + dv),
            dx: Vec2::new(su * c.duv_dx.x, sv * c.duv_dx.y),
            dy: Vec2::new(su * c.duv_dy.x, sv * c.duv_dy.y),
        },
        Mapping2::Affine { set, rows } => {
            let at = uv(*set);
            let apply = |r: &[f32; 3], v: Vec2| r[0] * v.x + r[1] * v.y;
            let both = |v: Vec2| Vec2::new(apply(&rows[0], v), apply(&rows[1], v));
            let st = both(Vec2::new(at.x, at.y));
            let (dx, dy) = if *set == 0 { (both(c.duv_dx), both(c.duv_dy)) } else { Default::default() };
            Coordinates2 { st: Point2::new(st.x + rows[0][2], st.y + rows[1][2]), dx, dy }
        }
        Mapping2::Spherical { texture_from_world } => {
            let p = texture_from_world.point(c.p);
            let r2 = sqr(p.x) + sqr(p.y);
            let r = r2.sqrt();
            // The gradients belong to s = theta / pi and t = phi / 2 pi.
            let ds = Vec3::new(p.x * p.z / r, p.y * p.z / r, -r) / (PI * (r2 + sqr(p.z)));
            let dt = Vec3::new(-p.y, p.x, 0.0) / (2.0 * PI * r2);
            let (dx, dy) = along(texture_from_world, ds, dt);
            let cos_theta = p.z / p.to_vec().length();
            Coordinates2 { st: Point2::new(safe_acos(cos_theta) * INV_PI, azimuth(p) * INV_2PI), dx, dy }
        }
        Mapping2::Cylindrical { texture_from_world } => {
            let p = texture_from_world.point(c.p);
            let ds = Vec3::new(-p.y, p.x, 0.0) / (2.0 * PI * (sqr(p.x) + sqr(p.y)));
            let (dx, dy) = along(texture_from_world, ds, Vec3::new(0.0, 0.0, 1.0));
            Coordinates2 { st: Point2::new((PI + atan2(p.y, p.x)) * INV_2PI, p.z), dx, dy }
        }
        Mapping2::Planar { texture_from_world, vs, vt, ds, dt } => {
            let p = texture_from_world.point(c.p).to_vec();
            let (dx, dy) = along(texture_from_world, *vs, *vt);
            Coordinates2 { st: Point2::new(ds + p.dot(*vs), dt + p.dot(*vt)), dx, dy }
        }
    }
}

fn map3(t: &Transform, c: &TextureContext) -> Coordinates3 {
    Coordinates3 { p: t.point(c.p), dx: t.vector(c.dpdx), dy: t.vector(c.dpdy) }
}

/// One axis of a checkerboard (+1, -1, ...) under a triangle filter of radius `r`: the second difference of its twice
/// integrated square wave.
fn filtered_square_wave(x: f32, r: f32) -> f32 {
    if (x - r).floor() == (x + r).floor() {
        return if (x.floor() as i64) & 1 == 0 { 1.0 } else { -1.0 };
    }
    let integral = |x: f32| {
        let y = x / 2.0 - (x / 2.0).floor() - 0.5;
        x / 2.0 + y * (1.0 - 2.0 * y.abs())
    };
    (integral(x + r) - 2.0 * integral(x) + integral(x - r)) / sqr(r)
}

/// The weight of the odd cells.
fn checkerboard(mapping: &CheckerMapping, c: &TextureContext, uv: impl Fn(u32) -> Point2) -> f32 {
    let radius = |a: f32, b: f32| 1.5 * a.abs().max(b.abs());
    match mapping {
        CheckerMapping::Plane(mapping) => {
            let c = map2(mapping, c, uv);
            let s = filtered_square_wave(c.st.x, radius(c.dx.x, c.dy.x));
            let t = filtered_square_wave(c.st.y, radius(c.dx.y, c.dy.y));
            0.5 - 0.5 * s * t
        }
        CheckerMapping::Space(t) => {
            let c = map3(t, c);
            let wave = |i: usize| filtered_square_wave(c.p[i], radius(c.dx[i], c.dy[i]));
            0.5 - 0.5 * wave(0) * wave(1) * wave(2)
        }
    }
}

/// Whether `st` lies in a dot: cells of unit size hold a disc where noise is positive, shifted by noise.
fn in_dot(st: Point2) -> bool {
    const RADIUS: f32 = 0.35;
    let (s, t) = ((st.x + 0.5).floor(), (st.y + 0.5).floor());
    if noise2(s + 0.5, t + 0.5) <= 0.0 {
        return false;
    }
    let shift = 0.5 - RADIUS;
    let centre = Point2::new(s + shift * noise2(s + 1.5, t + 2.8), t + shift * noise2(s + 4.5, t + 9.8));
    (st - centre).length_squared() < sqr(RADIUS)
}

/// Colours along the spline of marble, in linear sRGB before a factor of 1.5.
const MARBLE: [[f32; 3]; 9] = [
    [0.58, 0.58, 0.6],
    [0.58, 0.58, 0.6],
    [0.58, 0.58, 0.6],
    [0.5, 0.5, 0.5],
    [0.6, 0.59, 0.58],
    [0.58, 0.58, 0.6],
    [0.58, 0.58, 0.6],
    [0.2, 0.2, 0.33],
    [0.58, 0.58, 0.6],
];

fn marble(c: &Coordinates3, octaves: u32, omega: f32, scale: f32, variation: f32) -> [f32; 3] {
    let p = c.p * scale;
    let wave = p.y + variation * fbm(p, c.dx * scale, c.dy * scale, omega, octaves);
    let t = 0.5 + 0.5 * sin(wave);
    const SEGMENTS: usize = MARBLE.len() - 3;
    let first = ((t * SEGMENTS as f32).floor() as usize).min(SEGMENTS - 1);
    let t = t * SEGMENTS as f32 - first as f32;
    std::array::from_fn(|i| {
        let mut b: [f32; 4] = std::array::from_fn(|k| MARBLE[first + k][i]);
        for n in (1..4).rev() {
            for k in 0..n {
                b[k] = lerp(t, b[k], b[k + 1]);
            }
        }
        1.5 * b[0]
    })
}

fn scalar_noise(noise: &Noise, c: &Coordinates3) -> f32 {
    match *noise {
        Noise::Fbm { octaves, omega } => fbm(c.p, c.dx, c.dy, omega, octaves),
        Noise::Wrinkled { octaves, omega } => turbulence(c.p, c.dx, c.dy, omega, octaves),
        Noise::Windy => {
            let wind = fbm(c.p * 0.1, c.dx * 0.1, c.dy * 0.1, 0.5, 3);
            wind.abs() * fbm(c.p, c.dx, c.dy, 0.5, 6)
        }
        // As a scalar, marble is the mean of its colour.
        Noise::Marble { octaves, omega, scale, variation } => {
            marble(c, octaves, omega, scale, variation).iter().sum::<f32>() / 3.0
        }
    }
}

impl World {
    /// The coordinates of a set.
    #[inline]
    fn uv_of_set(&self, set: u32, c: &TextureContext) -> Point2 {
        match c.on_mesh {
            Some(MeshPoint { mesh, face, b }) if set > 0 => self.scene.triangle_meshes
                [Handle::from_index(mesh as usize)]
            .uv_of_set(set as usize, face as usize, b[0], b[1]),
            _ => c.uv,
        }
    }

    fn vertex_color(&self, c: &TextureContext) -> [f32; 4] {
        c.on_mesh.map_or([1.0; 4], |m| {
            self.scene.triangle_meshes[Handle::from_index(m.mesh as usize)].color(m.face as usize, m.b[0], m.b[1])
        })
    }

    fn attribute(&self, name: &str, c: &TextureContext) -> [f32; 3] {
        let of = |m: MeshPoint| {
            let mesh = &self.scene.triangle_meshes[Handle::from_index(m.mesh as usize)];
            mesh.attribute(name, m.face as usize, m.b[0], m.b[1])
        };
        c.on_mesh.and_then(of).unwrap_or_default()
    }

    #[inline]
    fn map2(&self, mapping: &Mapping2, c: &TextureContext) -> Coordinates2 {
        map2(mapping, c, |set| self.uv_of_set(set, c))
    }

    /// Where a mapping leads in a picture: its first row on top.
    pub(super) fn coordinates(&self, mapping: &Mapping2, c: &TextureContext) -> Point2 {
        let st = self.map2(mapping, c).st;
        Point2::new(st.x, 1.0 - st.y)
    }

    /// The colour of a picture at a point: NaN where the picture is not finite, so that no sample hides it.
    pub(super) fn texel(&self, map: &ImageMap, c: &TextureContext) -> [f32; 3] {
        let c = self.map2(&map.mapping, c);
        // Images have their first row on top; t points up.
        let st = Point2::new(c.st.x, 1.0 - c.st.y);
        let (dx, dy) = (Vec2::new(c.dx.x, -c.dx.y), Vec2::new(c.dy.x, -c.dy.y));
        let Some(pyramid) = &self.pyramids[map.image.index()] else { return [0.0; 3] };
        let lookup = self.scene.images[map.image].lookup;
        let rgb = if pyramid.channels() < 3 {
            [pyramid.lookup1(st, dx, dy, lookup); 3]
        } else {
            pyramid.lookup3(st, dx, dy, lookup)
        };
        rgb.map(|v| if map.invert { 1.0 - map.scale * v } else { map.scale * v })
            .map(|v| if v.is_finite() { v.max(0.0) } else { f32::NAN })
    }

    /// The value of a scalar texture.
    pub fn float_texture(&self, texture: Handle<FloatTexture>, c: &TextureContext) -> f32 {
        match &self.scene.float_textures[texture].0 {
            Texture::Constant(v) => *v,
            Texture::Scale { tex, scale } => {
                let s = self.float_texture(*scale, c);
                if s == 0.0 { 0.0 } else { s * self.float_texture(*tex, c) }
            }
            Texture::Product { a, b } => {
                let a = self.float_texture(*a, c);
                if a == 0.0 { 0.0 } else { a * self.float_texture(*b, c) }
            }
            Texture::Threshold { tex, at } => {
                if self.float_texture(*tex, c) >= *at {
                    1.0
                } else {
                    0.0
                }
            }
            Texture::Vertex => self.vertex_color(c)[3],
            Texture::Attribute(name) => self.attribute(name, c)[0],
            Texture::Mix { a, b, amount } => {
                let w = self.float_texture(*amount, c);
                blend(w, || self.float_texture(*a, c), || self.float_texture(*b, c), |a, b| (1.0 - w) * a + w * b)
            }
            Texture::DirectionMix { a, b, dir } => {
                let w = c.n.abs_dot(*dir);
                w * self.float_texture(*a, c) + (1.0 - w) * self.float_texture(*b, c)
            }
            Texture::Bilerp { mapping, corners } => {
                let [w00, w01, w10, w11] = bilinear_weights(self.map2(mapping, c).st);
                w00 * corners[0] + w01 * corners[1] + w10 * corners[2] + w11 * corners[3]
            }
            Texture::Checkerboard { mapping, a, b } => {
                let w = checkerboard(mapping, c, |set| self.uv_of_set(set, c));
                blend(w, || self.float_texture(*a, c), || self.float_texture(*b, c), |a, b| (1.0 - w) * a + w * b)
            }
            Texture::Dots { mapping, inside, outside } => {
                self.float_texture(if in_dot(self.map2(mapping, c).st) { *inside } else { *outside }, c)
            }
            Texture::Image(map) => {
                let [r, g, b] = self.texel(map, c);
                if r == g && g == b { r } else { (r + g + b) / 3.0 }
            }
            Texture::Grid(grid) => {
                let [r, g, b] = self.scene.grids[*grid].look_up(c.p);
                if r == g && g == b { r } else { (r + g + b) / 3.0 }
            }
            Texture::Noise { texture_from_world, noise } => scalar_noise(noise, &map3(texture_from_world, c)),
        }
    }

    /// The value of a spectral texture at the given wavelengths.
    #[inline]
    pub fn spectrum_texture(&self, texture: Handle<SpectrumTexture>, c: &TextureContext, w: &Wavelengths) -> Lanes {
        match &self.scene.spectrum_textures[texture].kind {
            Texture::Constant(s) => s.eval(w),
            _ => self.varying_spectrum(texture, c, w),
        }
    }

    fn varying_spectrum(&self, texture: Handle<SpectrumTexture>, c: &TextureContext, w: &Wavelengths) -> Lanes {
        let texture = &self.scene.spectrum_textures[texture];
        match &texture.kind {
            Texture::Constant(s) => s.eval(w),
            Texture::Scale { tex, scale } => {
                let s = self.float_texture(*scale, c);
                if s == 0.0 { Lanes::ZERO } else { self.spectrum_texture(*tex, c, w) * s }
            }
            Texture::Product { a, b } => self.spectrum_texture(*a, c, w) * self.spectrum_texture(*b, c, w),
            Texture::Threshold { tex, at } => {
                self.spectrum_texture(*tex, c, w).map(|v| if v >= *at { 1.0 } else { 0.0 })
            }
            Texture::Vertex => {
                let [r, g, b, _] = self.vertex_color(c).map(|v| v.max(0.0));
                rgb_lanes([r, g, b], ColorSpace::Srgb, texture.usage, w)
            }
            Texture::Attribute(name) => {
                let v = self.attribute(name, c).map(|v| v.max(0.0));
                if name.contains("color") {
                    rgb_lanes(v, ColorSpace::Srgb, texture.usage, w)
                } else {
                    Lanes::from_rgb(v)
                }
            }
            Texture::Mix { a, b, amount } => {
                let t = self.float_texture(*amount, c);
                self.spectral_blend(t, *a, *b, c, w)
            }
            Texture::DirectionMix { a, b, dir } => {
                let t = c.n.abs_dot(*dir);
                self.spectrum_texture(*a, c, w) * t + self.spectrum_texture(*b, c, w) * (1.0 - t)
            }
            Texture::Bilerp { mapping, corners } => {
                let weights = bilinear_weights(self.map2(mapping, c).st);
                corners.iter().zip(weights).fold(Lanes::ZERO, |sum, (s, weight)| sum + s.eval(w) * weight)
            }
            Texture::Checkerboard { mapping, a, b } => {
                let odd = checkerboard(mapping, c, |set| self.uv_of_set(set, c));
                self.spectral_blend(odd, *a, *b, c, w)
            }
            Texture::Dots { mapping, inside, outside } => {
                self.spectrum_texture(if in_dot(self.map2(mapping, c).st) { *inside } else { *outside }, c, w)
            }
            Texture::Image(map) => {
                let rgb = self.texel(map, c);
                let image = &self.scene.images[map.image];
                if image.texels.channels() < 3 {
                    // One channel is a constant over wavelength, whatever it stands for.
                    let v = if texture.usage == SpectrumUse::Albedo { at_most_one(rgb[0]) } else { rgb[0] };
                    return Lanes::splat(v);
                }
                rgb_lanes(rgb, image.color_space, texture.usage, w)
            }
            Texture::Grid(grid) => {
                let grid = &self.scene.grids[*grid];
                let rgb = grid.look_up(c.p).map(|v| if v < 0.0 { 0.0 } else { v });
                if grid.channels == 1 {
                    return Lanes::splat(if texture.usage == SpectrumUse::Albedo {
                        at_most_one(rgb[0])
                    } else {
                        rgb[0]
                    });
                }
                rgb_lanes(rgb, ColorSpace::Srgb, texture.usage, w)
            }
            Texture::Noise { texture_from_world, noise } => {
                let c = map3(texture_from_world, c);
                match *noise {
                    Noise::Marble { octaves, omega, scale, variation } => {
                        rgb_lanes(marble(&c, octaves, omega, scale, variation), ColorSpace::Srgb, texture.usage, w)
                    }
                    _ => Lanes::splat(scalar_noise(noise, &c)),
                }
            }
        }
    }

    fn spectral_blend(
        &self,
        t: f32,
        a: Handle<SpectrumTexture>,
        b: Handle<SpectrumTexture>,
        c: &TextureContext,
        w: &Wavelengths,
    ) -> Lanes {
        blend(t, || self.spectrum_texture(a, c, w), || self.spectrum_texture(b, c, w), |a, b| a * (1.0 - t) + b * t)
    }
}

/// Evaluates only what has weight.
fn blend<T>(w: f32, a: impl FnOnce() -> T, b: impl FnOnce() -> T, mix: impl FnOnce(T, T) -> T) -> T {
    if w == 0.0 {
        a()
    } else if w == 1.0 {
        b()
    } else {
        mix(a(), b())
    }
}

fn bilinear_weights(st: Point2) -> [f32; 4] {
    let (s, t) = (st.x, st.y);
    [(1.0 - s) * (1.0 - t), (1.0 - s) * t, s * (1.0 - t), s * t]
}

/// NaN stays NaN.
fn at_most_one(v: f32) -> f32 {
    if v > 1.0 { 1.0 } else { v }
}

/// An RGB triple of a texture as light in the four lanes.
pub(crate) fn rgb_lanes(rgb: [f32; 3], space: ColorSpace, usage: SpectrumUse, w: &Wavelengths) -> Lanes {
    match usage {
        SpectrumUse::Albedo => space.albedo_lanes(rgb.map(at_most_one), w),
        SpectrumUse::Unbounded => space.unbounded_lanes(rgb, w),
        SpectrumUse::Illuminant => space.illuminant_lanes(rgb, w),
    }
}

/// An RGB triple as the light of an even lamp behind a slide: per wavelength what a slide lets through, one bright as
/// [`ColorSpace::photometric`] where all passes; the colour as it is in RGB.
pub(crate) fn slide_lanes(rgb: [f32; 3], space: ColorSpace, w: &Wavelengths) -> Lanes {
    if w.is_rgb() {
        return space.illuminant_lanes(rgb, w);
    }
    space.unbounded_lanes(rgb, w) * (space.photometric() / steradian_spectrum::CIE_Y)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_filtered_checkerboard_tends_to_grey_and_keeps_its_mean() {
        assert!(filtered_square_wave(0.3, 40.0).abs() < 0.03);
        assert_eq!(filtered_square_wave(0.5, 0.1), 1.0);
        assert_eq!(filtered_square_wave(1.5, 0.1), -1.0);
        assert_eq!(filtered_square_wave(-0.5, 0.0), -1.0);
        let n = 2000;
        let mean: f32 =
            (0..n).map(|i| filtered_square_wave(2.0 * (i as f32 + 0.5) / n as f32, 0.3)).sum::<f32>() / n as f32;
        assert!(mean.abs() < 1e-3, "{mean}");
    }

    #[test]
    fn spherical_differentials_agree_with_finite_differences() {
        let mapping = Mapping2::Spherical { texture_from_world: Transform::IDENTITY };
        let p = Point3::new(0.4, 0.5, 0.3);
        let step = Vec3::new(1e-3, -2e-3, 1.5e-3);
        let c = TextureContext { p, dpdx: step, ..TextureContext::default() };
        let a = map2(&mapping, &c, |_| c.uv);
        let b = map2(&mapping, &TextureContext { p: p + step, ..c }, |_| c.uv);
        assert!((b.st - a.st - a.dx).length() < 3e-6);
    }
}
