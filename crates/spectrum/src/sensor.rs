//! The film's pixels: from lanes to sensor RGB, and from sensor RGB to the colour space of the image.
//!
//! pbrt-v4 section 5.4.2; Langlands and Fascione, "PhysLight: An End-to-End Pipeline for Scene-Referred Lighting" (SIGGRAPH 2020 talks).

use crate::color::{invert, multiply, narrow, white_balance, xy_from_xyz};
use crate::dense::{DENSE_LEN, Dense};
use crate::{ColorMode, ColorSpace, Lanes, Matrix3, SpectrumError, Wavelengths, cie, csv, named, planck};

/// Lists names next to their embedded tables.
macro_rules! embedded {
    ($($name:literal),* $(,)?) => {
        &[$(($name, include_str!(concat!("../data/sensors/", $name, ".csv")))),*]
    };
}

static CAMERAS: &[(&str, &str)] = embedded![
    "canon_eos_100d",
    "canon_eos_1dx_mkii",
    "canon_eos_200d",
    "canon_eos_200d_mkii",
    "canon_eos_5d",
    "canon_eos_5d_mkii",
    "canon_eos_5d_mkiii",
    "canon_eos_5d_mkiv",
    "canon_eos_5ds",
    "canon_eos_m",
    "hasselblad_l1d_20c",
    "nikon_d810",
    "nikon_d850",
    "sony_ilce_6400",
    "sony_ilce_7m3",
    "sony_ilce_7rm3",
    "sony_ilce_9",
];

/// How many patches the colour chart has that cameras are calibrated with.
const PATCHES: usize = 24;

/// How a pixel responds to light.
///
/// Sensor RGB is linear in radiance, so films may sum it and apply [`PixelSensor::output_rgb_from_sensor`] once per pixel. A light with photometric value 1
/// and the colour of the output space's white ends as `1, 1, 1` times the imaging ratio, in either mode.
#[derive(Clone, Debug, PartialEq)]
pub struct PixelSensor {
    /// Responses at whole nanometres from 360 on.
    response: Box<[[f32; 3]; DENSE_LEN]>,
    xyz_from_sensor: Matrix3,
    /// What white balance does to XYZ, for RGB mode.
    balance: Option<Matrix3>,
    space: ColorSpace,
    imaging_ratio: f32,
}

impl Default for PixelSensor {
    /// The CIE 1931 observer for sRGB, neither balanced nor scaled.
    fn default() -> PixelSensor {
        let response = Box::new(std::array::from_fn(|i| [cie::X.0[i], cie::Y.0[i], cie::Z.0[i]]));
        let space = ColorSpace::Srgb;
        PixelSensor { response, xyz_from_sensor: Matrix3::IDENTITY, balance: None, space, imaging_ratio: 1.0 }
    }
}

impl PixelSensor {
    /// The CIE 1931 observer: sensor RGB is XYZ. With `white_balance`, daylight of that colour temperature comes out as the white of `space`.
    ///
    /// `imaging_ratio` scales all output: exposure time times ISO over 100 in pbrt.
    ///
    /// # Errors
    /// When the temperature is not positive and finite.
    pub fn cie1931(
        space: ColorSpace,
        white_balance: Option<f32>,
        imaging_ratio: f32,
    ) -> Result<PixelSensor, SpectrumError> {
        let response = Box::new(std::array::from_fn(|i| [cie::X.0[i], cie::Y.0[i], cie::Z.0[i]]));
        let balance = white_balance.map(|kelvin| balance_for(&planck::daylight(kelvin)?, space)).transpose()?;
        let xyz_from_sensor = balance.unwrap_or(Matrix3::IDENTITY);
        Ok(PixelSensor { response, xyz_from_sensor, balance, space, imaging_ratio })
    }

    /// The sensor called `name`: `cie1931`, or one of the measured cameras of [`PixelSensor::names`], balanced for daylight of 6500 K unless told otherwise.
    ///
    /// # Errors
    /// When there is no such sensor, or the temperature is not positive and finite.
    pub fn from_name(
        name: &str,
        space: ColorSpace,
        white_balance: Option<f32>,
        imaging_ratio: f32,
    ) -> Result<PixelSensor, SpectrumError> {
        if name == "cie1931" {
            return PixelSensor::cie1931(space, white_balance, imaging_ratio);
        }
        let Some((_, text)) = CAMERAS.iter().find(|(known, _)| *known == name) else {
            return Err(SpectrumError::UnknownSensor { name: name.to_owned() });
        };
        let rows = csv::rows::<3>(text);
        let channels = [0, 1, 2].map(|c| {
            let samples: Vec<_> = rows.iter().map(|(lambda, rgb)| (*lambda, rgb[c])).collect();
            tabulate(&samples)
        });
        let [r, g, b] = channels;
        let illuminant = planck::daylight(white_balance.unwrap_or(6500.0))?;
        let xyz_from_sensor = calibrate([&r, &g, &b], &illuminant, space);
        let balance = Some(balance_for(&illuminant, space)?);
        let response = Box::new(std::array::from_fn(|i| [r.0[i], g.0[i], b.0[i]]));
        Ok(PixelSensor { response, xyz_from_sensor, balance, space, imaging_ratio })
    }

    /// The names that [`PixelSensor::from_name`] knows.
    pub fn names() -> impl Iterator<Item = &'static str> {
        std::iter::once("cie1931").chain(CAMERAS.iter().map(|(name, _)| *name))
    }

    /// The colour space of the output.
    pub fn color_space(&self) -> ColorSpace {
        self.space
    }

    /// What all output is multiplied by.
    pub fn imaging_ratio(&self) -> f32 {
        self.imaging_ratio
    }

    /// The sensor's response to radiance `lanes`: the estimate from four wavelengths, or linear Rec.709 in RGB mode.
    #[inline]
    pub fn to_sensor_rgb(&self, lanes: Lanes, wavelengths: &Wavelengths) -> [f32; 3] {
        if wavelengths.is_rgb() {
            return lanes.rgb().map(|v| v * self.imaging_ratio);
        }
        let weighted = lanes.safe_div(wavelengths.pdf()) * (0.25 * self.imaging_ratio);
        let lambda = wavelengths.lambda();
        let mut rgb = [0.0; 3];
        for lane in 0..Lanes::COUNT {
            let index = ((lambda[lane] + 0.5) as usize).wrapping_sub(360);
            if let Some(response) = self.response.get(index) {
                for c in 0..3 {
                    rgb[c] += response[c] * weighted[lane];
                }
            }
        }
        rgb
    }

    /// The matrix from sensor RGB to the colour space of the output, for paths of the given mode.
    pub fn output_rgb_from_sensor(&self, mode: ColorMode) -> Matrix3 {
        let to_rgb = self.space.rgb_from_xyz();
        match mode {
            ColorMode::Spectral => self.xyz_from_sensor.then(to_rgb),
            // Not even rounded, where there is nothing to convert.
            ColorMode::Rgb if self.space == ColorSpace::Srgb && self.balance.is_none() => Matrix3::IDENTITY,
            ColorMode::Rgb => {
                ColorSpace::Srgb.xyz_from_rgb().then(&self.balance.unwrap_or(Matrix3::IDENTITY)).then(to_rgb)
            }
        }
    }

    /// The matrix from spectral sensor RGB to XYZ.
    pub fn xyz_from_sensor(&self) -> &Matrix3 {
        &self.xyz_from_sensor
    }
}

/// From the illuminant's white to the white of `space`.
fn balance_for(illuminant: &Dense, space: ColorSpace) -> Result<Matrix3, SpectrumError> {
    Ok(white_balance(xy_from_xyz(cie::xyz_of_table(illuminant)), space.white()))
}

/// Samples continued to the ends of the visible range and tabulated.
fn tabulate(samples: &[(f32, f32)]) -> Dense {
    let (mut lambda, mut values): (Vec<f32>, Vec<f32>) = samples.iter().copied().unzip();
    named::extend(&mut lambda, &mut values);
    Dense::from_fn(|l| {
        let next = lambda.partition_point(|&at| at <= l).clamp(1, lambda.len() - 1);
        let t = (l - lambda[next - 1]) / (lambda[next] - lambda[next - 1]);
        (1.0 - t) * values[next - 1] + t * values[next]
    })
}

/// The matrix from camera RGB to XYZ that serves the patches of a colour chart best: what the camera sees of them under its illuminant is mapped to
/// their XYZ under the output's white, in the least squares sense.
fn calibrate(channels: [&Dense; 3], illuminant: &Dense, space: ColorSpace) -> Matrix3 {
    let rows = csv::rows::<PATCHES>(include_str!("../data/macbeth.csv"));
    let observer = [&cie::X, &cie::Y, &cie::Z];
    let exposure = cie::Y.dot(illuminant) / channels[1].dot(illuminant);
    let mut normal = [[0.0; 3]; 3];
    let mut mixed = [[0.0; 3]; 3];
    for patch in 0..PATCHES {
        let samples: Vec<_> = rows.iter().map(|(lambda, values)| (*lambda, values[patch])).collect();
        let reflectance = tabulate(&samples);
        let camera = project(&reflectance, illuminant, channels);
        let xyz = project(&reflectance, space.illuminant(), observer).map(|v| v * exposure);
        for r in 0..3 {
            for c in 0..3 {
                normal[r][c] += camera[r] * camera[c];
                mixed[r][c] += xyz[r] * camera[c];
            }
        }
    }
    narrow(multiply(mixed, invert(normal)))
}

/// The response of three channels to a lit surface, relative to the middle channel's response to the light itself.
fn project(reflectance: &Dense, illuminant: &Dense, channels: [&Dense; 3]) -> [f64; 3] {
    let lit = Dense(std::array::from_fn(|i| reflectance.0[i] * illuminant.0[i]));
    channels.map(|channel| channel.dot(&lit) / channels[1].dot(illuminant))
}
