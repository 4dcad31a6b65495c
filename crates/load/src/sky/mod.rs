//! The clear sky and the sun (Hosek and Wilkie 2012, "An analytic model for full spectral sky-dome radiance"; 2013, "Adding a solar-radiance function to
//! the Hosek-Wilkie skylight model").

mod clock;

pub(crate) use clock::Moment;
use steradian_image::{Encoding, Storage, Texels};
use steradian_math::{FRAC_PI_2, PI, Vec3, acos, exp, powf, safe_sqrt};
use steradian_sampling::warp::square_to_lat_long;
use steradian_spectrum::{CIE_Y, ColorSpace, Dense, Spectrum, SpectrumUse, cie};

/// The published coefficients: see `data/README.md` for what stands where.
static TABLES: &[u8] = include_bytes!("../../data/hosek_wilkie.f32");

const TURBIDITIES: usize = 10;
const POINTS: usize = 6;
const WAVELENGTHS: usize = 11;
/// Nine of the formula and the radiance that it is in units of.
const NUMBERS: usize = 10;
const SEGMENTS: usize = 45;
const POWERS: usize = 4;
const LIMB: usize = 6;
const SUN: usize = TURBIDITIES * 2 * POINTS * WAVELENGTHS * NUMBERS;
const DARKENING: usize = SUN + TURBIDITIES * SEGMENTS * WAVELENGTHS * POWERS;

/// The angle from the middle of the sun to its edge that the radiance of the model is for, in radians.
pub(crate) const SUN_HALF_ANGLE: f32 = 0.5 * 0.5358 * PI / 180.0;

fn table(i: usize) -> f32 {
    TABLES.as_chunks::<4>().0.get(i).map_or(0.0, |b| f32::from_le_bytes(*b))
}

fn wavelength(k: usize) -> f32 {
    320.0 + 40.0 * k as f32
}

/// A clear sky. z is up.
pub(crate) struct Sky {
    sun: Vec3,
    /// Of each wavelength.
    numbers: [[f32; NUMBERS]; WAVELENGTHS],
    turbidity: f32,
}

impl Sky {
    /// The sky over ground that reflects `albedo(wavelength)`, with the sun in the unit direction `sun`. Turbidity is from 1 to 10. `None`
    /// where the sun is below the horizon: the model is of days.
    pub fn new(sun: Vec3, turbidity: f32, albedo: impl Fn(f32) -> f32) -> Option<Sky> {
        if sun.z < 0.0 || !(1.0..=10.0).contains(&turbidity) {
            return None;
        }
        let elevation = FRAC_PI_2 - acos(sun.z.clamp(0.0, 1.0));
        let x = powf(elevation.max(0.0) / FRAC_PI_2, 1.0 / 3.0);
        let bernstein: [f32; POINTS] = std::array::from_fn(|i| {
            let power = |v: f32, n: usize| (0..n).fold(1.0, |p, _| p * v);
            [1.0, 5.0, 10.0, 10.0, 5.0, 1.0][i] * power(x, i) * power(1.0 - x, POINTS - 1 - i)
        });
        let (low, t) = between(turbidity);
        let mut numbers = [[0.0f32; NUMBERS]; WAVELENGTHS];
        for (k, numbers) in numbers.iter_mut().enumerate() {
            let a = albedo(wavelength(k)).clamp(0.0, 1.0);
            for (row, ground, weight) in [
                (low, 0, (1.0 - t) * (1.0 - a)),
                (low, 1, (1.0 - t) * a),
                (low + 1, 0, t * (1.0 - a)),
                (low + 1, 1, t * a),
            ] {
                if weight == 0.0 {
                    continue;
                }
                for (i, b) in bernstein.iter().enumerate() {
                    let at = (((row * 2 + ground) * POINTS + i) * WAVELENGTHS + k) * NUMBERS;
                    for (n, number) in numbers.iter_mut().enumerate() {
                        *number += weight * b * table(at + n);
                    }
                }
            }
        }
        Some(Sky { sun, numbers, turbidity })
    }

    /// Radiance from a unit direction at 320, 360, ..., 720 nm, in W / (m^2 sr nm), without the sun's own. Black below the horizon.
    pub fn radiance(&self, d: Vec3) -> [f32; WAVELENGTHS] {
        if d.z < 0.0 {
            return [0.0; WAVELENGTHS];
        }
        let cos_gamma = d.dot(self.sun).clamp(-1.0, 1.0);
        let gamma = acos(cos_gamma);
        self.numbers.map(|p| {
            let horizon = 1.0 + p[0] * exp(p[1] / (d.z + 0.01));
            let width = 1.0 + p[8] * p[8] - 2.0 * p[8] * cos_gamma;
            let glow = (1.0 + cos_gamma * cos_gamma) / (width * safe_sqrt(width));
            let sky =
                p[2] + p[3] * exp(p[4] * gamma) + p[5] * cos_gamma * cos_gamma + p[6] * glow + p[7] * safe_sqrt(d.z);
            (horizon * sky * p[9]).max(0.0)
        })
    }

    /// A map of latitude and longitude, z up, in linear sRGB of which 1 is the luminance of an even spectrum of 1, times `scale`.
    pub fn map(&self, width: usize, height: usize, scale: f32) -> Texels {
        let weights = weights();
        let mut values = vec![0.0f32; width * height * 3];
        for (i, texel) in values.chunks_exact_mut(3).enumerate().take(width * height.div_ceil(2)) {
            let at = |i: usize, n: usize| (i as f32 + 0.5) / n as f32;
            let d: Vec3 = square_to_lat_long([at(i % width, width), at(i / width, height)]);
            for (radiance, weight) in self.radiance(d).into_iter().zip(&weights) {
                texel.iter_mut().zip(weight).for_each(|(t, w)| *t += radiance * w * scale);
            }
        }
        Texels::new(width, height, 3, Storage::F32(values), Encoding::Linear).expect("three numbers for each texel")
    }

    /// The sun's radiance as the profile of [`steradian_scene::Light::Sun`], for a disc of the half angle `half_angle` that gives as much light as the
    /// sun's own. `darkened` is lighter in its middle than at its edge; otherwise it is even.
    pub fn sun_profile(&self, half_angle: f32, darkened: bool) -> Vec<Spectrum> {
        let elevation = FRAC_PI_2 - acos(self.sun.z.clamp(0.0, 1.0));
        let segment = ((powf(elevation.max(0.0) / FRAC_PI_2, 1.0 / 3.0) * SEGMENTS as f32) as usize).min(SEGMENTS - 1);
        let start = segment as f32 / SEGMENTS as f32;
        let x = elevation - FRAC_PI_2 * start * start * start;
        let (low, t) = between(self.turbidity);
        let radiance: [f32; WAVELENGTHS] = std::array::from_fn(|k| {
            let of = |row: usize| {
                let at = SUN + ((row * SEGMENTS + segment) * WAVELENGTHS + k) * POWERS;
                (0..POWERS).rev().fold(0.0, |sum, n| sum * x + table(at + n))
            };
            (1.0 - t) * of(low) + if t > 0.0 { t * of(low + 1) } else { 0.0 }
        });
        let area = |a: f32| {
            let half = steradian_math::sin(0.5 * a);
            half * half
        };
        let ratio = area(SUN_HALF_ANGLE) / area(half_angle);
        let limb = |k: usize, n: usize| table(DARKENING + k * LIMB + n);
        let spectrum = |f: &dyn Fn(usize) -> f32| {
            let values: [f32; WAVELENGTHS] = std::array::from_fn(|k| radiance[k].max(0.0) * f(k) * ratio);
            let dense = Dense::from_fn(|l| joined(&values, l));
            let rgb = ColorSpace::Srgb.rgb_from_xyz().apply(cie::xyz_of_table(&dense));
            // Coefficients may be negative, and so may their colours.
            Spectrum::dense(dense, SpectrumUse::Illuminant).with_rgb(rgb)
        };
        if darkened {
            (0..LIMB).map(|n| spectrum(&|k| limb(k, n))).collect()
        } else {
            // The mean of a power of the height over a disc is 2 / (power + 2).
            vec![spectrum(&|k| (0..LIMB).map(|n| limb(k, n) * 2.0 / (n as f32 + 2.0)).sum())]
        }
    }
}

/// The turbidity in the table below this one, and how far on to the next.
fn between(turbidity: f32) -> (usize, f32) {
    let low = ((turbidity - 1.0) as usize).min(TURBIDITIES - 1);
    let t = turbidity - 1.0 - low as f32;
    if low == TURBIDITIES - 1 { (low - 1, 1.0) } else { (low, t) }
}

/// Values at the model's wavelengths joined by lines; 0 outside.
fn joined(values: &[f32; WAVELENGTHS], lambda: f32) -> f32 {
    let x = (lambda - wavelength(0)) / 40.0;
    if !(0.0..=(WAVELENGTHS - 1) as f32).contains(&x) {
        return 0.0;
    }
    let k = (x as usize).min(WAVELENGTHS - 2);
    let t = x - k as f32;
    (1.0 - t) * values[k] + t * values[k + 1]
}

/// The colour of each of the model's wavelengths: linear sRGB of which 1 is the luminance of an even spectrum of 1.
fn weights() -> [[f32; 3]; WAVELENGTHS] {
    std::array::from_fn(|k| {
        let mut one = [0.0; WAVELENGTHS];
        one[k] = 1.0;
        ColorSpace::Srgb.rgb_from_xyz().apply(cie::xyz_integral(|l| joined(&one, l)).map(|v| v / CIE_Y))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The irradiance of a horizontal plane at each wavelength, by a sum over directions.
    fn irradiance(sky: &Sky) -> [f32; WAVELENGTHS] {
        let mut sum = [0.0; WAVELENGTHS];
        let (rings, columns) = (60, 120);
        for i in 0..rings * columns {
            // Even in solid angle times cosine.
            let (r2, phi) = ((i / columns) as f32 + 0.5, (i % columns) as f32 + 0.5);
            let sine = safe_sqrt(r2 / rings as f32);
            let (s, c) = steradian_math::sin_cos(2.0 * PI * phi / columns as f32);
            let l = sky.radiance(Vec3::new(sine * c, sine * s, safe_sqrt(1.0 - sine * sine)));
            sum.iter_mut().zip(l).for_each(|(s, l)| *s += l * PI / (rings * columns) as f32);
        }
        sum
    }

    #[test]
    fn a_clear_noon_is_as_bright_as_measured_ones() {
        let height = |degrees: f32| {
            let (s, c) = steradian_math::sin_cos(degrees.to_radians());
            Vec3::new(0.0, -c, s)
        };
        let sky = Sky::new(height(50.0), 3.0, |_| 0.2).unwrap();
        let e = irradiance(&sky);
        // Diffuse horizontal irradiance at 560 nm of a clear day is some 0.2 W / (m^2 nm), and skies are blue.
        assert!((0.1..0.4).contains(&e[6]) && e[3] > 1.5 * e[9], "{e:?}");
        let lux = cie::xyz_integral(|l| joined(&e, l))[1] * cie::LUMENS_PER_WATT;
        assert!((8_000.0..25_000.0).contains(&lux), "{lux} lx of the sky");
        let sun = &sky.sun_profile(SUN_HALF_ANGLE, false)[0];
        let half = steradian_math::sin(0.5 * SUN_HALF_ANGLE);
        let lux = sun.luminance() * 4.0 * PI * half * half * cie::LUMENS_PER_WATT;
        assert!((60_000.0..110_000.0).contains(&lux), "{lux} lx of the sun");
        // A hazy sky is brighter, its sun weaker.
        let hazy = Sky::new(height(50.0), 8.0, |_| 0.2).unwrap();
        assert!(irradiance(&hazy)[6] > e[6]);
        assert!(hazy.sun_profile(SUN_HALF_ANGLE, false)[0].luminance() < sun.luminance());
        // A low sun is red.
        let low = Sky::new(height(4.0), 3.0, |_| 0.2).unwrap().sun_profile(SUN_HALF_ANGLE, false);
        assert!(low[0].eval_at(640.0) > 3.0 * low[0].eval_at(440.0));
        assert!(Sky::new(height(-1.0), 3.0, |_| 0.2).is_none() && Sky::new(height(9.0), 10.5, |_| 0.2).is_none());
        assert!(Sky::new(height(9.0), 10.0, |_| 1.0).is_some());
    }

    #[test]
    fn a_larger_or_darkened_sun_gives_the_same_light() {
        let sky = Sky::new(Vec3::new(0.6, 0.0, 0.8), 2.4, |_| 0.3).unwrap();
        let light = |half_angle: f32, darkened: bool| {
            let half = steradian_math::sin(0.5 * half_angle);
            let profile = sky.sun_profile(half_angle, darkened);
            (2u8..).zip(&profile).map(|(k, s)| s.luminance() * 2.0 / f32::from(k)).sum::<f32>() * half * half
        };
        let plain = light(SUN_HALF_ANGLE, false);
        for other in [light(0.1, false), light(SUN_HALF_ANGLE, true), light(0.02, true)] {
            assert!((other / plain - 1.0).abs() < 1e-3, "{other} is not {plain}");
        }
    }

    #[test]
    fn the_map_is_the_sky() {
        let sky = Sky::new(Vec3::new(0.6, 0.0, 0.8), 2.4, |_| 0.3).unwrap();
        let map = sky.map(64, 32, 2.0);
        let d: Vec3 = square_to_lat_long([10.5 / 64.0, 7.5 / 32.0]);
        let l = sky.radiance(d);
        let y = cie::xyz_integral(|x| joined(&l, x))[1] / CIE_Y;
        let [r, g, b] = map.texel3(10, 7);
        assert!((0.2126 * r + 0.7152 * g + 0.0722 * b - 2.0 * y).abs() < 1e-3 * y);
        assert_eq!(map.texel3(3, 16), [0.0; 3]);
    }
}
