//! Mip pyramid of a texture and its look-ups: point, bilinear, trilinear and elliptically weighted average.
//!
//! Williams 1983, "Pyramidal parametrics"; Heckbert 1989 and Greene and Heckbert 1986 for the elliptical filter. Resampling and level
//! choice follow Pharr, Jakob, Humphreys (4th edition), section 10.4, so that the same scene has the same texture detail.
//!
//! Texture space: (0,0) is the corner of the first texel of row 0, (1,1) the opposite one, whatever the resolution.

use steradian_math::{Point2, Vec2, exp, log2};

use crate::texels::SampleKind;
use crate::{Chromaticities, Encoding, Error, Scratch, Storage, Texels, resample::Floats};

/// What lies outside the unit square.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Wrap {
    /// The image again.
    #[default]
    Repeat,
    /// Zero.
    Black,
    /// The nearest texel of the border.
    Clamp,
    /// The image again, every other one mirrored.
    Mirror,
    /// The square is an equal-area octahedral map of the sphere (Clarberg 2008), whose edges are glued to themselves. Must be
    /// given for both axes.
    Octahedral,
}

impl Wrap {
    /// The name in scene files.
    pub fn from_name(name: &str) -> Option<Wrap> {
        Some(match name {
            "repeat" => Wrap::Repeat,
            "black" => Wrap::Black,
            "clamp" => Wrap::Clamp,
            "octahedralsphere" => Wrap::Octahedral,
            _ => return None,
        })
    }

    /// The texel that stands for column `x`, row `y` of a `w x h` image. `None` is black.
    #[inline]
    pub(crate) fn remap(wrap: [Wrap; 2], x: i64, y: i64, w: usize, h: usize) -> Option<(usize, usize)> {
        if (x as u64) < w as u64 && (y as u64) < h as u64 {
            return Some((x as usize, y as usize));
        }
        if wrap[0] == Wrap::Octahedral || wrap[1] == Wrap::Octahedral {
            return Some(Wrap::fold(x, y, w, h));
        }
        Some((wrap[0].along(x, w)?, wrap[1].along(y, h)?))
    }

    /// The texel of `n` along one axis that stands for number `i`. `None` where there is none: beyond a border that is black, or is
    /// [octahedral](Wrap::Octahedral), which takes both axes to cross.
    #[inline]
    pub fn along(self, i: i64, n: usize) -> Option<usize> {
        match self {
            Wrap::Repeat => Some(i.rem_euclid(n as i64) as usize),
            Wrap::Clamp => Some(i.clamp(0, n as i64 - 1) as usize),
            Wrap::Mirror => {
                let i = i.rem_euclid(2 * n as i64);
                Some(i.min(2 * n as i64 - 1 - i) as usize)
            }
            Wrap::Black | Wrap::Octahedral => (0..n as i64).contains(&i).then_some(i as usize),
        }
    }

    /// Crossing an edge of an octahedral map comes back in across the same edge, mirrored about its middle.
    fn fold(x: i64, y: i64, w: usize, h: usize) -> (usize, usize) {
        let (w, h) = (w as i64, h as i64);
        // Two periods bring any point back onto itself, so far-off coordinates cost no more than near ones.
        let (mut x, mut y) = (x.rem_euclid(2 * w), y.rem_euclid(2 * h));
        if x >= w {
            (x, y) = (2 * w - 1 - x, h - 1 - y);
            y = y.rem_euclid(2 * h);
        }
        if y >= h {
            (x, y) = (w - 1 - x, 2 * h - 1 - y);
        }
        (x as usize, y as usize)
    }
}

/// How a look-up filters.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub enum Lookup {
    /// The nearest texel of the picture as it is, whatever the size of the sample.
    Point,
    /// Four texels of the picture as it is, whatever the size of the sample.
    #[default]
    Bilinear,
    /// Four texels each of the two levels around the one that fits.
    Trilinear,
    /// A Gaussian over the ellipse that the pixel covers, at most this many times longer than wide (8 is usual).
    Ewa {
        /// Largest ratio of the ellipse's axes.
        max_anisotropy: f32,
    },
}

impl Lookup {
    /// The name in scene files, with the anisotropy for EWA.
    pub fn from_name(name: &str, max_anisotropy: f32) -> Option<Lookup> {
        Some(match name {
            "point" => Lookup::Point,
            "bilinear" => Lookup::Bilinear,
            "trilinear" => Lookup::Trilinear,
            "ewa" | "EWA" => Lookup::Ewa { max_anisotropy: max_anisotropy.max(1.0) },
            _ => return None,
        })
    }
}

/// What is read of a texel, given the index of its first sample.
trait Pick<const N: usize>: Copy {
    /// Of one texel.
    fn one(self, t: &Texels, first: usize) -> [f32; N];

    /// Of four, some of them black.
    #[inline]
    fn four(self, t: &Texels, first: [Option<usize>; 4]) -> [[f32; N]; 4] {
        first.map(|i| i.map_or([0.0; N], |i| self.one(t, i)))
    }
}

impl<const N: usize, F: Fn(&Texels, usize) -> [f32; N] + Copy> Pick<N> for F {
    #[inline]
    fn one(self, t: &Texels, first: usize) -> [f32; N] {
        self(t, first)
    }
}

/// The first three channels, none of them alpha.
#[derive(Clone, Copy)]
struct Colours;

impl Pick<3> for Colours {
    #[inline]
    fn one(self, t: &Texels, first: usize) -> [f32; 3] {
        t.value3(first)
    }

    #[inline]
    fn four(self, t: &Texels, first: [Option<usize>; 4]) -> [[f32; 3]; 4] {
        t.values3(first)
    }
}

/// Entries of the table of the elliptical filter's weights.
const EWA_TABLE: usize = 128;

/// A texture and its halvings down to one texel. Look-ups allocate nothing.
#[derive(Clone, Debug)]
pub struct Pyramid {
    /// Level 0 is the finest. Sides are powers of two.
    levels: Vec<Texels>,
    wrap: [Wrap; 2],
    ewa: Box<[f32; EWA_TABLE]>,
    /// Whether there is only the picture as it is, of any size.
    is_plain: bool,
    /// Primaries, where the file states them.
    pub chromaticities: Option<Chromaticities>,
}

impl Pyramid {
    /// Builds the levels in the precision of the texture. Sides that are no powers of two are enlarged to the next one first, and an
    /// alpha channel that is one everywhere is dropped.
    ///
    /// # Errors
    /// `Error::Shape` if only one axis is octahedral.
    pub fn new(texels: Texels, wrap: [Wrap; 2]) -> Result<Pyramid, Error> {
        if (wrap[0] == Wrap::Octahedral) != (wrap[1] == Wrap::Octahedral) {
            return Err(Error::shape("an octahedral map wraps both axes or none"));
        }
        let chromaticities = texels.chromaticities;
        let opaque = !texels.has_transparency();
        let texels = match texels.channels() {
            n @ (2 | 4) if opaque => texels.truncated(n - 1),
            _ => texels,
        };
        let (w, h, n) = (texels.width(), texels.height(), texels.channels());
        let samples =
            (0..w * h).flat_map(|i| (0..n).map(move |c| (i * n, c))).map(|(i, c)| texels.value(i, c)).collect();
        let mut floats = Floats { width: w, height: h, channels: n, samples };
        let mut levels = Vec::new();
        if w.is_power_of_two() && h.is_power_of_two() {
            levels.push(texels.clone());
        } else {
            floats = floats.enlarged(w.next_power_of_two(), h.next_power_of_two(), wrap);
            levels.push(like(&texels, &floats)?);
        }
        while floats.width > 1 || floats.height > 1 {
            floats = floats.halved();
            levels.push(like(&texels, &floats)?);
        }
        // exp(-2 r^2), moved down to reach zero at r = 1.
        let ewa = std::array::from_fn(|i| exp(-2.0 * i as f32 / (EWA_TABLE - 1) as f32) - exp(-2.0));
        Ok(Pyramid { levels, wrap, ewa: Box::new(ewa), is_plain: false, chromaticities })
    }

    /// A picture that is looked up as it is, by [`Lookup::Point`] and [`Lookup::Bilinear`].
    pub fn plain(texels: Texels, wrap: [Wrap; 2]) -> Pyramid {
        let chromaticities = texels.chromaticities;
        Pyramid { levels: vec![texels], wrap, ewa: Box::new([0.0; EWA_TABLE]), is_plain: true, chromaticities }
    }

    /// Number of levels, at least one.
    pub fn levels(&self) -> usize {
        self.levels.len()
    }

    /// One level; 0 is the finest.
    pub fn level(&self, i: usize) -> &Texels {
        &self.levels[i]
    }

    /// Channels, 1 to 4.
    pub fn channels(&self) -> usize {
        self.levels[0].channels()
    }

    /// Bytes of samples of all levels, wherever they are.
    pub fn bytes(&self) -> usize {
        self.levels.iter().map(Texels::bytes).sum()
    }

    /// Bytes of memory that they take; none in a scratch file.
    pub fn memory(&self) -> usize {
        self.levels.iter().map(Texels::memory).sum()
    }

    /// The same with its large levels in a scratch file.
    ///
    /// # Errors
    /// Those of the file.
    pub fn into_scratch(self, scratch: &Scratch) -> std::io::Result<Pyramid> {
        let levels = self.levels.into_iter().map(|l| l.into_scratch(scratch)).collect::<Result<_, _>>()?;
        Ok(Pyramid { levels, ..self })
    }

    /// One number at `st`: the only channel, the mean of R, G, B, or alpha where there is alpha. `dst0` and `dst1` are the
    /// footprint: how far `st` moves for one pixel in x and in y.
    pub fn lookup1(&self, st: Point2, dst0: Vec2, dst1: Vec2, filter: Lookup) -> f32 {
        let n = self.channels();
        let [v] = self.filter(st, dst0, dst1, filter, |t: &Texels, i| {
            [match n {
                1 => t.value(i, 0),
                2 => t.value(i, 1),
                3 => (t.value(i, 0) + t.value(i, 1) + t.value(i, 2)) * (1.0 / 3.0),
                _ => t.value(i, 3),
            }]
        });
        v
    }

    /// The colour at `st`; grey images give three equal numbers.
    pub fn lookup3(&self, st: Point2, dst0: Vec2, dst1: Vec2, filter: Lookup) -> [f32; 3] {
        if self.channels() < 3 {
            let [v] = self.filter(st, dst0, dst1, filter, |t: &Texels, i| [t.value(i, 0)]);
            [v; 3]
        } else {
            self.filter(st, dst0, dst1, filter, Colours)
        }
    }

    /// Colour and alpha at `st`; alpha is 1 where there is none.
    pub fn lookup4(&self, st: Point2, dst0: Vec2, dst1: Vec2, filter: Lookup) -> [f32; 4] {
        match self.channels() {
            1 | 3 => {
                let [r, g, b] = self.lookup3(st, dst0, dst1, filter);
                [r, g, b, 1.0]
            }
            2 => {
                let [y, a] = self.filter(st, dst0, dst1, filter, |t: &Texels, i| [t.value(i, 0), t.value(i, 1)]);
                [y, y, y, a]
            }
            _ => self.filter(st, dst0, dst1, filter, |t: &Texels, i| std::array::from_fn(|c| t.value(i, c))),
        }
    }

    /// `pick` reads one texel of a level, given the index of its first sample.
    #[inline]
    fn filter<const N: usize>(
        &self,
        st: Point2,
        dst0: Vec2,
        dst1: Vec2,
        filter: Lookup,
        pick: impl Pick<N>,
    ) -> [f32; N] {
        // A camera at a singularity can send anything here; far-off or undefined coordinates read as the corner.
        let st = if st.x.abs() < 1e6 && st.y.abs() < 1e6 { st } else { Point2::new(0.0, 0.0) };
        match filter {
            Lookup::Point => return self.nearest(0, st, pick),
            Lookup::Bilinear => return self.bilinear(0, st, pick),
            _ if self.is_plain => return self.bilinear(0, st, pick),
            _ => {}
        }
        if let Lookup::Ewa { max_anisotropy } = filter {
            return self.ewa(st, dst0, dst1, max_anisotropy, pick);
        }
        let top = self.levels.len() - 1;
        let width = 2.0 * dst0.x.abs().max(dst0.y.abs()).max(dst1.x.abs()).max(dst1.y.abs());
        let level = top as f32 + log2(width.max(1e-8));
        if level >= top as f32 {
            return pick.one(&self.levels[top], 0);
        }
        // A cast from float to integer takes negative numbers and NaN to level 0.
        let i = level as usize;
        match filter {
            // Between levels 0 and 1 only level 0 is read, as in pbrt, whose images this is to match: sharper, at the price of a step.
            Lookup::Trilinear if i > 0 => {
                let (a, b) = (self.bilinear(i, st, pick), self.bilinear(i + 1, st, pick));
                mix(a, b, level - i as f32)
            }
            _ => self.bilinear(i, st, pick),
        }
    }

    #[inline]
    fn texel<const N: usize>(&self, t: &Texels, x: i64, y: i64, pick: impl Pick<N>) -> [f32; N] {
        match Wrap::remap(self.wrap, x, y, t.width(), t.height()) {
            Some((x, y)) => pick.one(t, (y * t.width() + x) * t.channels()),
            None => [0.0; N],
        }
    }

    #[inline]
    fn nearest<const N: usize>(&self, level: usize, st: Point2, pick: impl Pick<N>) -> [f32; N] {
        let t = &self.levels[level];
        let x = (st.x * t.width() as f32).floor() as i64;
        let y = (st.y * t.height() as f32).floor() as i64;
        self.texel(t, x, y, pick)
    }

    #[inline]
    fn bilinear<const N: usize>(&self, level: usize, st: Point2, pick: impl Pick<N>) -> [f32; N] {
        let t = &self.levels[level];
        let (x, y) = (st.x * t.width() as f32 - 0.5, st.y * t.height() as f32 - 0.5);
        let (fx, fy) = (x.floor(), y.floor());
        let (x0, y0) = (fx as i64, fy as i64);
        let at = |x: i64, y: i64| {
            let (x, y) = Wrap::remap(self.wrap, x, y, t.width(), t.height())?;
            Some((y * t.width() + x) * t.channels())
        };
        let corners = [at(x0, y0), at(x0 + 1, y0), at(x0, y0 + 1), at(x0 + 1, y0 + 1)];
        let [a, b, c, d] = pick.four(t, corners);
        mix(mix(a, b, x - fx), mix(c, d, x - fx), y - fy)
    }

    #[inline]
    fn ewa<const N: usize>(
        &self,
        st: Point2,
        dst0: Vec2,
        dst1: Vec2,
        max_anisotropy: f32,
        pick: impl Pick<N>,
    ) -> [f32; N] {
        let (mut long, mut short) = (dst0, dst1);
        if long.length_squared() < short.length_squared() {
            (long, short) = (short, long);
        }
        // The cost grows with the square of the ratio, which a scene file may set to anything.
        let max_anisotropy = max_anisotropy.clamp(1.0, 64.0);
        let (long_length, mut short_length) = (long.length(), short.length());
        if short_length.partial_cmp(&0.0) != Some(std::cmp::Ordering::Greater) || !long_length.is_finite() {
            return self.bilinear(0, st, pick);
        }
        if short_length * max_anisotropy < long_length {
            // A thin ellipse is made fatter: blurred, but of bounded cost.
            let scale = long_length / (short_length * max_anisotropy);
            if !scale.is_finite() {
                return self.bilinear(0, st, pick);
            }
            short *= scale;
            short_length *= scale;
        }
        let top = self.levels.len() - 1;
        let lod = (top as f32 + log2(short_length)).max(0.0);
        if lod >= top as f32 {
            return pick.one(&self.levels[top], 0);
        }
        let i = lod as usize;
        mix(self.ewa_level(i, st, long, short, pick), self.ewa_level(i + 1, st, long, short, pick), lod - i as f32)
    }

    /// The weighted mean of the texels inside the ellipse with the half axes `long` and `short`, widened by one texel.
    fn ewa_level<const N: usize>(
        &self,
        level: usize,
        st: Point2,
        long: Vec2,
        short: Vec2,
        pick: impl Pick<N>,
    ) -> [f32; N] {
        let t = &self.levels[level];
        let (w, h) = (t.width() as f32, t.height() as f32);
        let (s, v) = (st.x * w - 0.5, st.y * h - 0.5);
        let (l, k) = (Vec2::new(long.x * w, long.y * h), Vec2::new(short.x * w, short.y * h));
        // The implicit ellipse A x^2 + B x y + C y^2 = 1 (Heckbert 1989, section 3.5.9).
        let (a, b, c) = (l.y * l.y + k.y * k.y + 1.0, -2.0 * (l.x * l.y + k.x * k.y), l.x * l.x + k.x * k.x + 1.0);
        let inv_f = 1.0 / (a * c - b * b * 0.25);
        let (a, b, c) = (a * inv_f, b * inv_f, c * inv_f);
        let inv_det = 1.0 / (4.0 * a * c - b * b);
        let (du, dv) = (2.0 * (c * inv_det).max(0.0).sqrt(), 2.0 * (a * inv_det).max(0.0).sqrt());
        let (x0, x1) = ((s - du).ceil() as i64, (s + du).floor() as i64);
        let (y0, y1) = ((v - dv).ceil() as i64, (v + dv).floor() as i64);

        let (mut sum, mut weights) = ([0.0; N], 0.0);
        for y in y0..=y1 {
            let dy = y as f32 - v;
            for x in x0..=x1 {
                let dx = x as f32 - s;
                let r2 = a * dx * dx + b * dx * dy + c * dy * dy;
                if r2 < 1.0 {
                    let weight = self.ewa[((r2 * EWA_TABLE as f32) as usize).min(EWA_TABLE - 1)];
                    let value = self.texel(t, x, y, pick);
                    for n in 0..N {
                        sum[n] += weight * value[n];
                    }
                    weights += weight;
                }
            }
        }
        if weights > 0.0 { sum.map(|v| v / weights) } else { self.bilinear(level, st, pick) }
    }
}

/// Texels of the precision and meaning of `original` with other values.
fn like(original: &Texels, floats: &Floats) -> Result<Texels, Error> {
    let storage = match original.kind() {
        SampleKind::U8 => {
            let encoding: Encoding = original.encoding();
            let alpha = original.alpha_channel().unwrap_or(usize::MAX);
            let codes = floats.samples.iter().enumerate().map(|(i, &v)| {
                if i % floats.channels == alpha { Encoding::Linear.quantize8(v) } else { encoding.quantize8(v) }
            });
            Storage::U8(codes.collect())
        }
        SampleKind::F16 => Storage::F16(floats.samples.iter().map(|&v| half::f16::from_f32(v)).collect()),
        SampleKind::F32 => Storage::F32(floats.samples.clone()),
    };
    Texels::new(floats.width, floats.height, floats.channels, storage, original.encoding())
}

#[inline]
fn mix<const N: usize>(a: [f32; N], b: [f32; N], t: f32) -> [f32; N] {
    std::array::from_fn(|i| (1.0 - t) * a[i] + t * b[i])
}
