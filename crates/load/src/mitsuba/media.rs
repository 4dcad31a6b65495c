//! Media of Mitsuba scenes, and the volumes that they read.

use super::Mitsuba;
use super::tree::{Object, Value};
use crate::files::read_all;
use steradian_math::{Bounds3, Point3, Transform};
use steradian_scene::{Coefficients, Handle, Medium, MediumInterface, RgbGrid, Volume, VoxelGrid};
use steradian_spectrum::{ColorSpace, Dense, Spectrum, SpectrumUse};
use steradian_syntax::Span;

/// A grid as a file has it: some channels at the centres of cells, x fastest.
struct Grid {
    size: [u32; 3],
    channels: usize,
    values: Vec<f32>,
    bounds: Bounds3,
}

/// What fills a medium's coefficient.
enum Filling {
    Even(Spectrum),
    /// Values, and where the grid's box lies.
    Grid(Grid, Transform),
}

impl Mitsuba<'_> {
    /// The media on the two sides of a shape.
    pub(super) fn media_of(&mut self, o: &Object) -> Option<MediumInterface> {
        let (interior, exterior) = (self.named(o, "interior"), self.named(o, "exterior"));
        if interior.is_none() && exterior.is_none() {
            return None;
        }
        let inside = interior.and_then(|i| self.medium(i));
        let outside = exterior.and_then(|i| self.medium(i));
        Some(MediumInterface { inside, outside })
    }

    pub(super) fn medium(&mut self, index: usize) -> Option<Handle<Medium>> {
        if let Some(h) = self.media.get(&index) {
            return Some(*h);
        }
        let o = self.object(index);
        if !matches!(o.kind.as_str(), "homogeneous" | "heterogeneous") {
            self.not_built(&o);
            return None;
        }
        let (albedo, sigma_t) = (self.filling(&o, "albedo", 0.75)?, self.filling(&o, "sigma_t", 1.0)?);
        let scale = self.float(&o, "scale", 1.0);
        let g = self.mean_cosine(&o);
        for name in ["sample_emitters", "has_spectral_extinction"] {
            o.get(name);
        }
        self.finish(&o);
        let (volume, world_from_medium) = self.volume(albedo, sigma_t, o.span)?;
        let medium = Medium { name: String::new(), g, scale, world_from_medium, volume };
        if let Err(e) = medium.validate() {
            self.error(e.to_string(), o.span);
            return None;
        }
        let handle = self.scene.media.push(medium);
        self.media.insert(index, handle);
        Some(handle)
    }

    /// The mean cosine of a medium's phase function.
    fn mean_cosine(&mut self, o: &Object) -> f32 {
        let Some(phase) = self.child(o, "phase").map(|i| self.object(i)) else { return 0.0 };
        match phase.kind.as_str() {
            "isotropic" => 0.0,
            "hg" => {
                let g = self.float(&phase, "g", 0.8);
                self.finish(&phase);
                g
            }
            _ => {
                self.not_built(&phase);
                0.0
            }
        }
    }

    fn filling(&mut self, o: &Object, name: &str, absent: f32) -> Option<Filling> {
        let usage = SpectrumUse::Unbounded;
        if let Some(v) = self.named(o, name).map(|i| self.object(i)) {
            let filling = match v.kind.as_str() {
                "constvolume" => {
                    let p = v.get("value").cloned();
                    let value = p.map_or(Value::Float(1.0), |p| p.value);
                    Filling::Even(self.spectrum_of(&value, usage, v.span)?)
                }
                "gridvolume" => self.grid(&v)?,
                _ => {
                    self.not_built(&v);
                    return None;
                }
            };
            self.finish(&v);
            return Some(filling);
        }
        let p = o.get(name).cloned();
        let s = p.and_then(|p| self.spectrum_of(&p.value, usage, p.span));
        Some(Filling::Even(s.unwrap_or_else(|| Spectrum::constant(absent, usage))))
    }

    fn grid(&mut self, v: &Object) -> Option<Filling> {
        let Some(name) = self.text(v, "filename") else {
            self.error("a grid needs a `filename`", v.span);
            return None;
        };
        for ignored in ["raw", "accel"] {
            v.get(ignored);
        }
        if self.text(v, "filter_type").is_some_and(|f| f != "trilinear") {
            self.note_once("grids are interpolated between their points, whatever `filter_type` says", v.span);
        }
        if self.text(v, "wrap_mode").is_some_and(|w| w != "clamp") {
            self.error("grids that repeat are not built", v.span);
        }
        let read = self.reader.resolve(&name).and_then(|p| read_all(self.files, &p));
        let grid = read.and_then(|bytes| parse(&bytes).map_err(|m| format!("{name}: {m}")));
        let mut grid = grid.map_err(|m| self.error(m, v.span)).ok()?;
        if !self.flag(v, "use_grid_bbox", false) {
            grid.bounds = Bounds3 { min: Point3::default(), max: Point3::new(1.0, 1.0, 1.0) };
        }
        let world = self.transform(v, "to_world");
        Some(Filling::Grid(grid.padded(), world))
    }

    /// What albedo and extinction together fill space with, and where it lies.
    fn volume(&mut self, albedo: Filling, sigma_t: Filling, span: Span) -> Option<(Volume, Transform)> {
        Some(match (albedo, sigma_t) {
            (Filling::Even(a), Filling::Even(t)) => {
                let sigma_s = product(&a, &t, |a, t| a * t);
                let sigma_a = product(&a, &t, |a, t| (1.0 - a) * t);
                let coefficients = Coefficients { sigma_a, sigma_s };
                (Volume::Homogeneous { coefficients, emission: None }, Transform::IDENTITY)
            }
            (Filling::Even(a), Filling::Grid(t, world)) if t.channels == 1 => {
                let one = Spectrum::constant(1.0, SpectrumUse::Unbounded);
                let sigma_s = product(&a, &one, |a, _| a);
                let sigma_a = product(&a, &one, |a, _| 1.0 - a);
                let density = VoxelGrid { size: t.size, values: t.values };
                let coefficients = Coefficients { sigma_a, sigma_s };
                (Volume::Grid { coefficients, bounds: t.bounds, density, glow: None }, world)
            }
            (albedo, sigma_t) => {
                let (Some(size), bounds, world) = (match (&albedo, &sigma_t) {
                    (Filling::Grid(a, _), Filling::Grid(t, world)) => {
                        ((a.size == t.size).then_some(t.size), t.bounds, *world)
                    }
                    (Filling::Grid(g, world), _) | (_, Filling::Grid(g, world)) => (Some(g.size), g.bounds, *world),
                    _ => (None, Bounds3::default(), Transform::IDENTITY),
                }) else {
                    self.error("grids of albedo and extinction must be of one size", span);
                    return None;
                };
                let at = |f: &Filling, i: usize| match f {
                    Filling::Even(s) => s.rgb(),
                    Filling::Grid(g, _) => std::array::from_fn(|k| g.values[i * g.channels + k % g.channels]),
                };
                let count = size.iter().map(|&n| n as usize).product();
                let grid = |f: &dyn Fn(f32, f32) -> f32| {
                    let value = |i| {
                        let (a, t) = (at(&albedo, i), at(&sigma_t, i));
                        std::array::from_fn(|k| f(a[k], t[k]).max(0.0))
                    };
                    Some(VoxelGrid { size, values: (0..count).map(value).collect() })
                };
                let (sigma_a, sigma_s) = (grid(&|a, t| (1.0 - a) * t), grid(&|a, t| a * t));
                let rgb = RgbGrid { bounds, color_space: ColorSpace::Srgb, sigma_a, sigma_s, emission: None };
                (Volume::RgbGrid(rgb), world)
            }
        })
    }
}

/// A function of two spectra: wavelength by wavelength, and of their colours.
fn product(a: &Spectrum, b: &Spectrum, f: impl Fn(f32, f32) -> f32) -> Spectrum {
    let (x, y) = (a.rgb(), b.rgb());
    let rgb = std::array::from_fn(|i| f(x[i], y[i]).max(0.0));
    if a.is_constant() && b.is_constant() {
        return Spectrum::constant(f(a.eval_at(550.0), b.eval_at(550.0)).max(0.0), SpectrumUse::Unbounded);
    }
    let table = Dense::from_fn(|l| f(a.eval_at(l), b.eval_at(l)).max(0.0));
    Spectrum::dense(table, SpectrumUse::Unbounded).with_rgb(rgb)
}

/// The largest grid that is read, in numbers.
const MOST_VALUES: u64 = 1 << 31;

/// Mitsuba's grids: a header of 48 bytes, then floats.
fn parse(bytes: &[u8]) -> Result<Grid, String> {
    let word = |at: usize| -> Result<[u8; 4], String> {
        bytes.get(at..at + 4).and_then(|b| b.try_into().ok()).ok_or_else(|| "truncated header".to_string())
    };
    let whole = |at: usize| word(at).map(i32::from_le_bytes);
    let float = |at: usize| word(at).map(f32::from_le_bytes);
    if !bytes.starts_with(b"VOL") || bytes.get(3) != Some(&3) {
        return Err("not a grid of Mitsuba's version 3".into());
    }
    if whole(4)? != 1 {
        return Err("a grid of another type than 32-bit floats".into());
    }
    let mut size = [0u32; 3];
    for (k, n) in size.iter_mut().enumerate() {
        *n = u32::try_from(whole(8 + 4 * k)?).ok().filter(|&n| n > 0).ok_or("a grid without cells")?;
    }
    let channels = whole(20)?;
    if !matches!(channels, 1 | 3) {
        return Err(format!("a grid of {channels} channels; 1 and 3 can be read"));
    }
    let channels = channels as usize;
    let mut corner = [0.0; 6];
    for (k, c) in corner.iter_mut().enumerate() {
        *c = float(24 + 4 * k)?;
    }
    let count = size.iter().try_fold(channels as u64, |c, &n| c.checked_mul(u64::from(n))).unwrap_or(u64::MAX);
    let data = &bytes[48..];
    if count > MOST_VALUES || data.len() as u64 / 4 < count {
        return Err(format!("the header promises {count} numbers, the file has {}", data.len() / 4));
    }
    let values = data.as_chunks::<4>().0.iter().take(count as usize).map(|b| f32::from_le_bytes(*b)).collect();
    let bounds = Bounds3 {
        min: Point3::new(corner[0], corner[1], corner[2]),
        max: Point3::new(corner[3], corner[4], corner[5]),
    };
    Ok(Grid { size, channels, values, bounds })
}

impl Grid {
    /// With a further layer of cells all around, the same as those at the edge: nothing thins out towards the faces of the box.
    fn padded(&self) -> Grid {
        let [x, y, z] = self.size.map(|n| n as usize);
        let size = self.size.map(|n| n + 2);
        let mut values = Vec::with_capacity((x + 2) * (y + 2) * (z + 2) * self.channels);
        let inner = |i: usize, n: usize| i.clamp(1, n) - 1;
        for k in 0..z + 2 {
            for j in 0..y + 2 {
                for i in 0..x + 2 {
                    let at = (inner(k, z) * y + inner(j, y)) * x + inner(i, x);
                    values.extend_from_slice(&self.values[at * self.channels..(at + 1) * self.channels]);
                }
            }
        }
        let cell = |axis: usize| (self.bounds.max[axis] - self.bounds.min[axis]) / self.size[axis] as f32;
        let grown =
            |p: Point3, sign: f32| Point3::new(p.x + sign * cell(0), p.y + sign * cell(1), p.z + sign * cell(2));
        let bounds = Bounds3 { min: grown(self.bounds.min, -1.0), max: grown(self.bounds.max, 1.0) };
        Grid { size, channels: self.channels, values, bounds }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(size: [i32; 3], values: &[f32]) -> Vec<u8> {
        let mut out = b"VOL\x03".to_vec();
        out.extend([1, size[0], size[1], size[2], 1].iter().flat_map(|v: &i32| v.to_le_bytes()));
        out.extend([0.0f32, 0.0, 0.0, 2.0, 1.0, 1.0].iter().flat_map(|v| v.to_le_bytes()));
        out.extend(values.iter().flat_map(|v| v.to_le_bytes()));
        out
    }

    #[test]
    fn a_grid_is_read_and_padded() {
        let g = parse(&file([2, 1, 1], &[3.0, 5.0])).unwrap().padded();
        assert_eq!((g.size, g.values.len()), ([4, 3, 3], 36));
        assert_eq!(g.values[..4], [3.0, 3.0, 5.0, 5.0]);
        assert_eq!((g.bounds.min.x, g.bounds.max.y), (-1.0, 2.0));
    }

    #[test]
    fn a_header_that_lies_is_an_error() {
        assert!(parse(&file([2, 1, 1], &[3.0])).is_err_and(|m| m.contains("promises 2")));
        assert!(parse(&file([i32::MAX, i32::MAX, i32::MAX], &[3.0])).is_err());
        assert!(parse(&file([-1, 1, 1], &[3.0])).is_err());
        assert!(parse(b"VOL\x03").is_err() && parse(b"").is_err());
    }
}
