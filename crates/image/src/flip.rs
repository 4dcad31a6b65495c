//! FLIP: how different two images look when a person switches between them.
//!
//! Andersson, Nilsson, Akenine-Möller, Oskarsson, Åström, Fairchild 2020, "FLIP: A difference evaluator for alternating images"; for unbounded
//! light Andersson, Nilsson, Shirley, Akenine-Möller 2021, "Visualizing errors in rendered high dynamic range images".

use steradian_math::{PI, exp, exp2, log2, powf};

use crate::{
    Error, Image,
    metrics::same_colours,
    tonemap::{limited, luminance},
};

/// How the images are seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FlipSettings {
    /// Pixels per degree of the field of view. The default, 67, is a 0.7 m wide screen of 3840 pixels at 0.7 m.
    pub pixels_per_degree: f32,
}

impl Default for FlipSettings {
    fn default() -> FlipSettings {
        FlipSettings { pixels_per_degree: 0.7 * 3840.0 / 0.7 * PI / 180.0 }
    }
}

/// The exposures at which high dynamic range images are looked at, in stops.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HdrExposures {
    /// Shortest: the brightest pixel is just below white.
    pub start: f32,
    /// Longest: the median pixel is just below white.
    pub stop: f32,
    /// How many, at least one.
    pub count: usize,
}

/// FLIP of two low dynamic range images, whose linear values are clipped to `[0,1]`: one number in `[0,1]` per pixel.
///
/// # Errors
/// `Error::Shape` if the sizes differ or there is no colour.
pub fn flip_ldr(reference: &Image, test: &Image, settings: &FlipSettings) -> Result<Vec<f32>, Error> {
    let (r, t) = same_colours(reference, test)?;
    let flat = |p: [&[f32]; 3]| p.map(|p| p.iter().map(|v| limited(*v, 1.0)).collect::<Vec<f32>>());
    Ok(Viewer::new(reference.width(), reference.height(), settings)?.compare(&flat(r), &flat(t)))
}

/// FLIP of two high dynamic range images: the largest low dynamic range FLIP over a range of exposures of the reference.
///
/// # Errors
/// `Error::Shape` if the sizes differ or there is no colour.
pub fn flip_hdr(reference: &Image, test: &Image, settings: &FlipSettings) -> Result<Vec<f32>, Error> {
    flip_hdr_exposures(reference, test, settings, hdr_exposures(reference)?)
}

/// The same at exposures of the caller's.
///
/// # Errors
/// `Error::Shape` if the sizes differ, there is no colour or no exposure.
pub fn flip_hdr_exposures(
    reference: &Image,
    test: &Image,
    settings: &FlipSettings,
    exposures: HdrExposures,
) -> Result<Vec<f32>, Error> {
    let (r, t) = same_colours(reference, test)?;
    if exposures.count == 0 || exposures.count > 256 || !exposures.start.is_finite() || !exposures.stop.is_finite() {
        return Err(Error::shape("HDR-FLIP needs 1 to 256 finite exposures"));
    }
    let viewer = Viewer::new(reference.width(), reference.height(), settings)?;
    let step = (exposures.stop - exposures.start) / (exposures.count - 1).max(1) as f32;
    let mut out = vec![0.0_f32; r[0].len()];
    for i in 0..exposures.count {
        let scale = exp2(exposures.start + i as f32 * step);
        let develop = |p: [&[f32]; 3]| p.map(|p| p.iter().map(|&v| aces(v * scale)).collect::<Vec<f32>>());
        for (o, v) in out.iter_mut().zip(viewer.compare(&develop(r), &develop(t))) {
            *o = o.max(v);
        }
    }
    Ok(out)
}

/// Narkowicz's fit to ACES with its 0.6 of exposure. NaN becomes 0.
fn aces(v: f32) -> f32 {
    let x = limited(v, 1e9) * 0.6;
    (x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14)).clamp(0.0, 1.0)
}

/// Exposures from the one that puts the brightest pixel to 0.85 after the tone curve, to the one that does so for the median.
///
/// # Errors
/// `Error::Shape` if there is no colour.
fn hdr_exposures(reference: &Image) -> Result<HdrExposures, Error> {
    let (planes, _) = same_colours(reference, reference)?;
    let mut y: Vec<f32> =
        (0..planes[0].len()).map(|i| luminance(planes.map(|p| p[i]))).filter(|y| y.is_finite()).collect();
    y.sort_unstable_by(f32::total_cmp);
    let (Some(&brightest), n) = (y.last(), y.len()) else {
        return Ok(HdrExposures { start: 0.0, stop: 0.0, count: 2 });
    };
    let median = 0.5 * (y[(n - 1) / 2] + y[n / 2]);
    // aces(x) = 0.85 is a quadratic equation in x.
    let (white, e) = (0.85_f32, 0.6_f32);
    let (a, b, c) = (e * e * (2.51 - white * 2.43), e * (0.03 - white * 0.59), -white * 0.14);
    let half = -0.5 * b / a;
    let x = half + (half * half - c / a).sqrt();
    // A black picture, or one that is black for the most part, has no such exposure; 2^16 of range is more than a file's worth.
    let start = log2(x / brightest.max(1e-8));
    let stop = log2(x / median.max(brightest * 1.5e-5).max(1e-8)).max(start);
    Ok(HdrExposures { start, stop, count: ((stop - start).ceil() as usize).max(2) })
}

/// Exponent of the colour difference.
const COLOUR_POWER: f32 = 0.7;
/// Share of the largest colour difference that is spread over most of the scale, and how much of the scale that is.
const KNEE: (f32, f32) = (0.4, 0.95);
/// Width of the feature detector's Gaussian in degrees, and exponent of the feature difference.
const FEATURE_WIDTH: f32 = 0.082;
const FEATURE_POWER: f32 = 0.5;

/// One-dimensional filters of an eye at some distance from a screen, and the size of the images.
struct Viewer {
    width: usize,
    height: usize,
    /// Contrast sensitivity in lightness, red-green and blue-yellow; the last is the sum of two Gaussians.
    lightness: Vec<f32>,
    red_green: Vec<f32>,
    blue_yellow: [Vec<f32>; 2],
    /// Weights of the two Gaussians in blue-yellow.
    shares: [f32; 2],
    /// Gaussian, its first derivative (edges) and second derivative (points).
    blur: Vec<f32>,
    edge: Vec<f32>,
    point: Vec<f32>,
    /// The largest colour difference there is, between green and blue.
    largest: f32,
}

impl Viewer {
    fn new(width: usize, height: usize, settings: &FlipSettings) -> Result<Viewer, Error> {
        let ppd = settings.pixels_per_degree;
        if !(ppd.is_finite() && (1.0..=1000.0).contains(&ppd)) {
            return Err(Error::shape(format!("{ppd} pixels per degree is not a way to look at an image")));
        }
        // Table 1 of the paper: a sqrt(pi / b) exp(-pi^2 x^2 / b), x in degrees. The widest decides the radius of all.
        let radius = (3.0 * (0.04 / (2.0 * PI * PI)).sqrt() * ppd).ceil() as i32;
        let taps = |b: f32| -> Vec<f32> {
            (-radius..=radius).map(|i| exp(-PI * PI * (i * i) as f32 / (ppd * ppd * b))).collect()
        };
        let raw = [(34.1, 0.04), (13.5, 0.025)].map(|(a, b)| (a * (PI / b).sqrt(), taps(b)));
        // Sums in the plane are squares of sums along a line.
        let mass = raw.each_ref().map(|(a, t)| a * t.iter().sum::<f32>() * t.iter().sum::<f32>());
        let total = mass[0] + mass[1];

        let sd = 0.5 * FEATURE_WIDTH * ppd;
        let reach = (3.0 * sd).ceil() as i32;
        let feature = |f: fn(f32, f32) -> f32| -> Vec<f32> {
            (-reach..=reach).map(|i| f(i as f32, sd) * exp(-((i * i) as f32) / (2.0 * sd * sd))).collect()
        };
        let [_, g, b] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(hunt_lab);
        Ok(Viewer {
            width,
            height,
            lightness: normalised(taps(0.0047)),
            red_green: normalised(taps(0.0053)),
            shares: [mass[0] / total, mass[1] / total],
            blue_yellow: raw.map(|(_, t)| normalised(t)),
            blur: normalised(feature(|_, _| 1.0)),
            edge: balanced(feature(|x, _| -x)),
            point: balanced(feature(|x, sd| x * x / (sd * sd) - 1.0)),
            largest: powf(hyab(g, b), COLOUR_POWER),
        })
    }

    /// One number per pixel from two images in linear `[0,1]`.
    fn compare(&self, reference: &[Vec<f32>; 3], test: &[Vec<f32>; 3]) -> Vec<f32> {
        let (r, t) = (self.perceive(reference), self.perceive(test));
        (0..self.width * self.height)
            .map(|i| {
                let colour = self.spread(powf(hyab(r.colour[i], t.colour[i]), COLOUR_POWER));
                let d = (r.edges[i] - t.edges[i]).abs().max((r.points[i] - t.points[i]).abs());
                let feature = powf(d * std::f32::consts::FRAC_1_SQRT_2, FEATURE_POWER).clamp(0.0, 1.0);
                powf(colour, 1.0 - feature)
            })
            .collect()
    }

    /// Large colour differences are squeezed into the top of `[0,1]`.
    fn spread(&self, e: f32) -> f32 {
        let knee = KNEE.0 * self.largest;
        if e < knee { KNEE.1 / knee * e } else { KNEE.1 + (e - knee) / (self.largest - knee) * (1.0 - KNEE.1) }
    }

    fn perceive(&self, linear: &[Vec<f32>; 3]) -> Percept {
        let n = self.width * self.height;
        let opponent: Vec<[f32; 3]> = (0..n).map(|i| opponent([linear[0][i], linear[1][i], linear[2][i]])).collect();
        let [y, cx, cz]: [Vec<f32>; 3] = std::array::from_fn(|c| opponent.iter().map(|o| o[c]).collect());
        let blurred_y = self.convolve(&y, &self.lightness, &self.lightness);
        let blurred_cx = self.convolve(&cx, &self.red_green, &self.red_green);
        let [wide, narrow] = self.blue_yellow.each_ref().map(|t| self.convolve(&cz, t, t));
        let colour = (0..n)
            .map(|i| {
                let cz = self.shares[0] * wide[i] + self.shares[1] * narrow[i];
                hunt_lab(from_opponent([blurred_y[i], blurred_cx[i], cz]).map(|v| v.clamp(0.0, 1.0)))
            })
            .collect();
        let grey: Vec<f32> = y.iter().map(|y| (y + 16.0) / 116.0).collect();
        let magnitude = |taps: &[f32]| -> Vec<f32> {
            let (x, y) = (self.convolve(&grey, taps, &self.blur), self.convolve(&grey, &self.blur, taps));
            x.iter().zip(y).map(|(x, y)| (x * x + y * y).sqrt()).collect()
        };
        Percept { colour, edges: magnitude(&self.edge), points: magnitude(&self.point) }
    }

    /// Separable convolution; beyond the border its pixels are repeated.
    fn convolve(&self, plane: &[f32], along_x: &[f32], along_y: &[f32]) -> Vec<f32> {
        let (w, h) = (self.width, self.height);
        let mut wide = vec![0.0; w * h];
        let rx = along_x.len() / 2;
        for (row, out) in plane.chunks_exact(w).zip(wide.chunks_exact_mut(w)) {
            for (x, o) in out.iter_mut().enumerate() {
                let at = |k: usize| row[(x + k).saturating_sub(rx).min(w - 1)];
                *o = along_x.iter().enumerate().map(|(k, t)| t * at(k)).sum();
            }
        }
        let mut out = vec![0.0; w * h];
        let ry = along_y.len() / 2;
        for (y, row) in out.chunks_exact_mut(w).enumerate() {
            for (k, t) in along_y.iter().enumerate() {
                let source = (y + k).saturating_sub(ry).min(h - 1) * w;
                for (o, v) in row.iter_mut().zip(&wide[source..source + w]) {
                    *o += t * v;
                }
            }
        }
        out
    }
}

/// What the eye makes of an image.
struct Percept {
    /// Hunt-adjusted L*a*b* after the contrast sensitivity filters.
    colour: Vec<[f32; 3]>,
    edges: Vec<f32>,
    points: Vec<f32>,
}

fn normalised(mut taps: Vec<f32>) -> Vec<f32> {
    let sum: f32 = taps.iter().sum();
    taps.iter_mut().for_each(|t| *t /= sum);
    taps
}

/// Positive taps sum to 1 and negative ones to -1.
fn balanced(mut taps: Vec<f32>) -> Vec<f32> {
    let positive: f32 = taps.iter().filter(|t| **t > 0.0).sum();
    let negative: f32 = taps.iter().filter(|t| **t < 0.0).sum();
    taps.iter_mut().for_each(|t| *t /= if *t > 0.0 { positive } else { -negative });
    taps
}

/// sRGB primaries to XYZ relative to their own white, so that (1,1,1) is (1,1,1).
fn white_relative_xyz(c: [f32; 3]) -> [f32; 3] {
    const M: [[f32; 3]; 3] = [
        [0.412_386_56, 0.357_591_49, 0.180_450_49],
        [0.212_636_82, 0.715_182_98, 0.072_180_2],
        [0.019_330_62, 0.119_197_16, 0.950_372_59],
    ];
    M.map(|row| (row[0] * c[0] + row[1] * c[1] + row[2] * c[2]) / (row[0] + row[1] + row[2]))
}

/// YCxCz, a linearised L*a*b*.
fn opponent(c: [f32; 3]) -> [f32; 3] {
    let [x, y, z] = white_relative_xyz(c);
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

fn from_opponent([l, cx, cz]: [f32; 3]) -> [f32; 3] {
    const WHITE: [f32; 3] = [0.950_428_54, 1.0, 1.088_900_4];
    const M: [[f32; 3]; 3] = [
        [3.241_003_3, -1.537_398_9, -0.498_615_88],
        [-0.969_224_25, 1.875_93, 0.041_554_226],
        [0.055_639_42, -0.204_011_2, 1.057_148_9],
    ];
    let y = (l + 16.0) / 116.0;
    let xyz = [(cx / 500.0 + y) * WHITE[0], y, (y - cz / 200.0) * WHITE[2]];
    M.map(|row| row[0] * xyz[0] + row[1] * xyz[1] + row[2] * xyz[2])
}

/// CIE L*a*b* whose chroma fades with lightness (Hunt effect).
fn hunt_lab(c: [f32; 3]) -> [f32; 3] {
    const DELTA: f32 = 6.0 / 29.0;
    let f = |t: f32| {
        if t > DELTA * DELTA * DELTA { powf(t, 1.0 / 3.0) } else { t / (3.0 * DELTA * DELTA) + 4.0 / 29.0 }
    };
    let [x, y, z] = white_relative_xyz(c).map(f);
    let l = 116.0 * y - 16.0;
    [l, 0.01 * l * 500.0 * (x - y), 0.01 * l * 200.0 * (y - z)]
}

/// The HyAB distance: city block in lightness, Euclidean in chroma.
fn hyab(a: [f32; 3], b: [f32; 3]) -> f32 {
    let d = [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
    d[0].abs() + (d[1] * d[1] + d[2] * d[2]).sqrt()
}
