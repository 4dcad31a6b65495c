//! A function of wavelength as plain data, with the colour that stands for it in RGB mode.

use crate::dense::Dense;
use crate::uplift::Sigmoid;
use crate::{ColorSpace, Lanes, SpectrumError, Wavelengths, cie, planck};

/// What a spectrum is for, which decides the colour that stands for it in RGB mode.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum SpectrumUse {
    /// A reflectance or transmittance, in `[0,1]`. RGB is its colour under D65; a constant `c` reads `c, c, c`.
    Albedo,
    /// An index of refraction, an extinction, a density: weighted averages as for [`SpectrumUse::Albedo`], limited to the range of the spectrum. A
    /// constant `c` reads `c, c, c`.
    Unbounded,
    /// An emission. RGB is its linear Rec.709 colour, scaled as in [`Spectrum::photometric`]: D65 with photometric value 1 reads `1, 1, 1`.
    Illuminant,
}

/// A spectrum. RGB mode sees its reading, a linear Rec.709 colour that is worked out once, here; components below 0 (colours
/// outside the Rec.709 gamut) read 0, since neither light nor reflectance can be negative.
#[derive(Clone, Debug, PartialEq)]
pub struct Spectrum {
    kind: Kind,
    usage: SpectrumUse,
    rgb: Lanes,
}

#[derive(Clone, Debug, PartialEq)]
enum Kind {
    Constant(f32),
    Dense(Box<Dense>),
    PiecewiseLinear(PiecewiseLinear),
    Sigmoid { scale: f32, sigmoid: Sigmoid },
    RgbIlluminant { scale: f32, sigmoid: Sigmoid, space: ColorSpace },
    Blackbody { scale: f32, kelvin: f32 },
}

/// Samples joined by straight lines; 0 outside.
#[derive(Clone, Debug, PartialEq)]
struct PiecewiseLinear {
    lambda: Box<[f32]>,
    values: Box<[f32]>,
}

impl PiecewiseLinear {
    fn eval_at(&self, lambda: f32) -> f32 {
        let next = self.lambda.partition_point(|&l| l <= lambda);
        let Some(k) = next.checked_sub(1) else { return 0.0 };
        if next == self.lambda.len() {
            return if self.lambda[k] == lambda { self.values[k] } else { 0.0 };
        }
        let t = (lambda - self.lambda[k]) / (self.lambda[next] - self.lambda[k]);
        (1.0 - t) * self.values[k] + t * self.values[next]
    }
}

impl Spectrum {
    /// The same value at all wavelengths.
    pub fn constant(value: f32, usage: SpectrumUse) -> Spectrum {
        Spectrum::with_reading(Kind::Constant(value), usage)
    }

    /// A table with one value per nanometre from 360 to 830; 0 outside.
    pub fn dense(table: Dense, usage: SpectrumUse) -> Spectrum {
        Spectrum::with_reading(Kind::Dense(Box::new(table)), usage)
    }

    /// Samples at increasing wavelengths (nm) joined by straight lines; 0 outside, also inside 360..830 nm if the samples do not reach.
    ///
    /// # Errors
    /// When the lengths differ, nothing is given, a number is not finite, or the wavelengths do not increase.
    pub fn piecewise_linear(lambda: &[f32], values: &[f32], usage: SpectrumUse) -> Result<Spectrum, SpectrumError> {
        if lambda.len() != values.len() {
            return Err(SpectrumError::LengthMismatch { wavelengths: lambda.len(), values: values.len() });
        }
        if lambda.is_empty() {
            return Err(SpectrumError::Empty);
        }
        if let Some(index) = (0..lambda.len()).find(|&i| !lambda[i].is_finite() || !values[i].is_finite()) {
            return Err(SpectrumError::NotFinite { index });
        }
        if let Some(index) = (1..lambda.len()).find(|&i| lambda[i] <= lambda[i - 1]) {
            return Err(SpectrumError::NotIncreasing { index, previous: lambda[index - 1], next: lambda[index] });
        }
        let kind = Kind::PiecewiseLinear(PiecewiseLinear { lambda: lambda.into(), values: values.into() });
        Ok(Spectrum::with_reading(kind, usage))
    }

    /// The smooth reflectance that looks like `rgb` (clamped to `[0,1]`) under the white of `space`.
    pub fn rgb_albedo(space: ColorSpace, rgb: [f32; 3]) -> Spectrum {
        let kind = Kind::Sigmoid { scale: 1.0, sigmoid: space.to_coefficients(rgb) };
        Spectrum { kind, usage: SpectrumUse::Albedo, rgb: read_albedo(space, rgb) }
    }

    /// A smooth positive spectrum that looks like `rgb`, without upper limit: for extinction, density, indices of refraction.
    pub fn rgb_unbounded(space: ColorSpace, rgb: [f32; 3]) -> Spectrum {
        let (scale, sigmoid) = scaled_coefficients(space, rgb);
        Spectrum {
            kind: Kind::Sigmoid { scale, sigmoid },
            usage: SpectrumUse::Unbounded,
            rgb: read_unbounded(space, rgb),
        }
    }

    /// The white of `space` tinted to look like `rgb`: its photometric value is that of the white alone, which
    /// [`Spectrum::photometric`] gives, so that a light divided by it shows as `rgb`.
    pub fn rgb_illuminant(space: ColorSpace, rgb: [f32; 3]) -> Spectrum {
        let (scale, sigmoid) = scaled_coefficients(space, rgb);
        let kind = Kind::RgbIlluminant { scale, sigmoid, space };
        Spectrum { kind, usage: SpectrumUse::Illuminant, rgb: read_illuminant(space, rgb) }
    }

    /// A black body of `kelvin`, scaled so that its peak, wherever it is, is 1.
    ///
    /// # Errors
    /// When the temperature is not positive and finite.
    pub fn blackbody(kelvin: f32) -> Result<Spectrum, SpectrumError> {
        if !(kelvin > 0.0 && kelvin.is_finite()) {
            return Err(SpectrumError::Temperature { kelvin });
        }
        let scale = 1.0 / planck::radiance(planck::WIEN_NM_KELVIN / kelvin, kelvin);
        Ok(Spectrum::with_reading(Kind::Blackbody { scale, kelvin }, SpectrumUse::Illuminant))
    }

    /// The spectrum times `factor`.
    pub fn scaled(mut self, factor: f32) -> Spectrum {
        match &mut self.kind {
            Kind::Constant(value) => *value *= factor,
            Kind::Dense(table) => table.0.iter_mut().for_each(|v| *v *= factor),
            Kind::PiecewiseLinear(line) => line.values.iter_mut().for_each(|v| *v *= factor),
            Kind::Sigmoid { scale, .. } | Kind::RgbIlluminant { scale, .. } | Kind::Blackbody { scale, .. } => {
                *scale *= factor
            }
        }
        self.rgb *= factor;
        self
    }

    /// The same spectrum with the reading that another use asks for.
    pub fn with_use(self, usage: SpectrumUse) -> Spectrum {
        if usage == self.usage { self } else { Spectrum::with_reading(self.kind, usage) }
    }

    /// The same values, tabulated at whole nanometres: the fastest kind to evaluate.
    pub fn to_dense(&self) -> Dense {
        Dense::from_fn(|lambda| self.eval_at(lambda))
    }

    /// The same spectrum in its fastest form: samples and black bodies become tables (and so steps of 1 nm), the others stay. The reading stays.
    pub fn tabulated(mut self) -> Spectrum {
        if matches!(self.kind, Kind::PiecewiseLinear(_) | Kind::Blackbody { .. }) {
            self.kind = Kind::Dense(Box::new(self.to_dense()));
        }
        self
    }

    /// What the spectrum is for.
    pub fn usage(&self) -> SpectrumUse {
        self.usage
    }

    /// The lanes: values at the four wavelengths, or the reading in RGB mode.
    #[inline]
    pub fn eval(&self, wavelengths: &Wavelengths) -> Lanes {
        if wavelengths.is_rgb() {
            return self.rgb;
        }
        let lambda = wavelengths.lambda();
        match &self.kind {
            Kind::Constant(value) => Lanes::splat(*value),
            Kind::Dense(table) => table.eval(lambda),
            Kind::PiecewiseLinear(line) => Lanes(lambda.map(|l| line.eval_at(l))),
            Kind::Sigmoid { scale, sigmoid } => sigmoid.eval(lambda) * *scale,
            Kind::RgbIlluminant { scale, sigmoid, space } => {
                sigmoid.eval(lambda) * *scale * space.illuminant().eval(lambda)
            }
            Kind::Blackbody { scale, kelvin } => Lanes(lambda.map(|l| planck::radiance(l, *kelvin) * *scale)),
        }
    }

    /// The value at `lambda` nanometres.
    pub fn eval_at(&self, lambda: f32) -> f32 {
        match &self.kind {
            Kind::Constant(value) => *value,
            Kind::Dense(table) => table.eval_at(lambda),
            Kind::PiecewiseLinear(line) => line.eval_at(lambda),
            Kind::Sigmoid { scale, sigmoid } => sigmoid.eval_at(lambda) * *scale,
            Kind::RgbIlluminant { scale, sigmoid, space } => {
                sigmoid.eval_at(lambda) * *scale * space.illuminant().eval_at(lambda)
            }
            Kind::Blackbody { scale, kelvin } => planck::radiance(lambda, *kelvin) * *scale,
        }
    }

    /// A bound on the values over 360..830 nm and on the components of the reading, tight but for coloured illuminants.
    pub fn max_value(&self) -> f32 {
        let spectral = match &self.kind {
            Kind::Constant(value) => *value,
            Kind::Dense(table) => table.max_value(),
            Kind::PiecewiseLinear(line) => line.values.iter().copied().fold(0.0, f32::max),
            Kind::Sigmoid { scale, sigmoid } => sigmoid.max_value() * scale,
            Kind::RgbIlluminant { scale, sigmoid, space } => {
                sigmoid.max_value() * scale * space.illuminant().max_value()
            }
            Kind::Blackbody { scale, kelvin } => {
                let peak = (planck::WIEN_NM_KELVIN / kelvin).clamp(crate::LAMBDA_MIN, crate::LAMBDA_MAX);
                planck::radiance(peak, *kelvin) * scale
            }
        };
        spectral.max(self.rgb.max_component())
    }

    /// Whether it stands for a colour of three numbers.
    pub fn is_rgb(&self) -> bool {
        matches!(self.kind, Kind::Sigmoid { .. } | Kind::RgbIlluminant { .. })
    }

    /// Whether the value is the same at all wavelengths, so that for instance a refraction does not disperse.
    pub fn is_constant(&self) -> bool {
        match &self.kind {
            Kind::Constant(_) => true,
            Kind::Sigmoid { sigmoid: Sigmoid([c0, c1, _]), .. } => *c0 == 0.0 && *c1 == 0.0,
            _ => false,
        }
    }

    /// Whether the spectrum is 0 at all wavelengths.
    pub fn is_black(&self) -> bool {
        match &self.kind {
            Kind::Constant(value) => *value == 0.0,
            Kind::Dense(table) => table.0.iter().all(|&v| v == 0.0),
            Kind::PiecewiseLinear(line) => line.values.iter().all(|&v| v == 0.0),
            Kind::Sigmoid { scale, sigmoid } | Kind::RgbIlluminant { scale, sigmoid, .. } => {
                *scale == 0.0 || sigmoid.max_value() == 0.0
            }
            Kind::Blackbody { scale, .. } => *scale == 0.0,
        }
    }

    /// The same spectrum with another colour standing for it in RGB mode.
    pub fn with_rgb(mut self, rgb: [f32; 3]) -> Spectrum {
        self.rgb = Lanes::from_rgb(rgb);
        self
    }

    /// The linear Rec.709 colour that stands for the spectrum in RGB mode.
    pub fn rgb(&self) -> [f32; 3] {
        self.rgb.rgb()
    }

    /// The sum of the spectrum times y-bar over whole nanometres of 360..=830. For an RGB illuminant only the white counts, not the tint,
    /// as in pbrt: a light of colour `rgb` divided by this shows as `rgb`.
    pub fn photometric(&self) -> f32 {
        match &self.kind {
            Kind::RgbIlluminant { space, .. } => space.photometric(),
            _ => self.luminance(),
        }
    }

    /// The sum of the spectrum times y-bar over whole nanometres of 360..=830, tint and strength and all: how bright it looks.
    pub fn luminance(&self) -> f32 {
        cie::Y.integrate(|lambda| self.eval_at(lambda)) as f32
    }

    fn with_reading(kind: Kind, usage: SpectrumUse) -> Spectrum {
        let mut spectrum = Spectrum { kind, usage, rgb: Lanes::ZERO };
        let rgb_from_xyz = ColorSpace::Srgb.rgb_from_xyz();
        let rgb = match (usage, &spectrum.kind) {
            // Exactly, and the most frequent case.
            (SpectrumUse::Albedo | SpectrumUse::Unbounded, Kind::Constant(value)) => [*value; 3],
            (SpectrumUse::Albedo, _) => rgb_from_xyz.apply(cie::xyz_of_reflectance(|l| spectrum.eval_at(l))),
            (SpectrumUse::Unbounded, _) => {
                // The matching functions have negative parts, which a steep spectrum must not turn into a negative index.
                let table = spectrum.to_dense();
                let low = table.0.iter().copied().fold(f32::INFINITY, f32::min);
                rgb_from_xyz
                    .apply(cie::xyz_of_reflectance(|l| table.eval_at(l)))
                    .map(|v| v.clamp(low, table.max_value()))
            }
            (SpectrumUse::Illuminant, _) => rgb_from_xyz.apply(cie::xyz_of_table(&spectrum.to_dense())),
        };
        spectrum.rgb = match usage {
            SpectrumUse::Unbounded => Lanes::from_rgb(rgb),
            SpectrumUse::Albedo | SpectrumUse::Illuminant => Lanes::from_rgb(rgb.map(not_negative)),
        };
        spectrum
    }
}

/// Twice the largest component, and the spectrum of the colour divided by that: so no component asks for a sigmoid near 1.
fn scaled_coefficients(space: ColorSpace, rgb: [f32; 3]) -> (f32, Sigmoid) {
    let scale = 2.0 * rgb[0].max(rgb[1]).max(rgb[2]);
    if scale <= 0.0 {
        return (0.0, Sigmoid::flat(0.0));
    }
    (scale, space.to_coefficients(rgb.map(|v| v / scale)))
}

/// Negative numbers become 0; unlike with `f32::max`, NaN stays to be found.
fn not_negative(v: f32) -> f32 {
    if v < 0.0 { 0.0 } else { v }
}

fn read_albedo(space: ColorSpace, rgb: [f32; 3]) -> Lanes {
    let clamped = rgb.map(|v| v.clamp(0.0, 1.0));
    Lanes::from_rgb(space.reflectance_to_srgb(clamped).map(|v| v.clamp(0.0, 1.0)))
}

fn read_unbounded(space: ColorSpace, rgb: [f32; 3]) -> Lanes {
    Lanes::from_rgb(space.reflectance_to_srgb(rgb.map(not_negative)).map(not_negative))
}

fn read_illuminant(space: ColorSpace, rgb: [f32; 3]) -> Lanes {
    let photometric = space.photometric();
    Lanes::from_rgb(space.emission_to_srgb(rgb.map(not_negative)).map(|v| not_negative(v) * photometric))
}

/// RGB values of image textures and the like, evaluated on the fly.
impl ColorSpace {
    /// The lanes of [`Spectrum::rgb_albedo`], without making one.
    #[inline]
    pub fn albedo_lanes(self, rgb: [f32; 3], wavelengths: &Wavelengths) -> Lanes {
        if wavelengths.is_rgb() { read_albedo(self, rgb) } else { self.to_coefficients(rgb).eval(wavelengths.lambda()) }
    }

    /// The lanes of [`Spectrum::rgb_unbounded`], without making one.
    #[inline]
    pub fn unbounded_lanes(self, rgb: [f32; 3], wavelengths: &Wavelengths) -> Lanes {
        if wavelengths.is_rgb() {
            return read_unbounded(self, rgb);
        }
        let (scale, sigmoid) = scaled_coefficients(self, rgb);
        sigmoid.eval(wavelengths.lambda()) * scale
    }

    /// The lanes of [`Spectrum::rgb_illuminant`], without making one.
    #[inline]
    pub fn illuminant_lanes(self, rgb: [f32; 3], wavelengths: &Wavelengths) -> Lanes {
        if wavelengths.is_rgb() {
            return read_illuminant(self, rgb);
        }
        let (scale, sigmoid) = scaled_coefficients(self, rgb);
        sigmoid.eval(wavelengths.lambda()) * scale * self.illuminant().eval(wavelengths.lambda())
    }
}
