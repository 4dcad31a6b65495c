//! Participating media as the user stated them: what absorbs, scatters and emits in the space between surfaces.

use crate::{FloatInput, GridTexture, SparseGrid};
use steradian_bsdf::{MOST_PHASES, TabulatedPhase};
use steradian_math::{Bounds3, Transform};
use steradian_spectrum::{ColorSpace, Spectrum};

/// A medium that absorbs, scatters and emits.
#[derive(Clone, Debug)]
pub struct Medium {
    /// Name, for messages.
    pub name: String,
    /// Into which directions it scatters.
    pub phase: Phase,
    /// Factor of the absorption and the scattering coefficient, not of emission.
    pub scale: f32,
    /// Where the volume lies. Coefficients are per unit of world length whatever it is.
    pub world_from_medium: Transform,
    /// What fills it.
    pub volume: Volume,
}

/// Into which directions a medium scatters.
#[derive(Clone, Debug, PartialEq)]
pub enum Phase {
    /// The function of Henyey and Greenstein (1941).
    HenyeyGreenstein {
        /// Mean cosine; zero scatters evenly.
        g: f32,
    },
    /// Rayleigh's (1871), of molecules.
    Rayleigh,
    /// Values at equal steps of the cosine of the scattering angle, from -1, straight back, to 1, straight on; their scale does not matter.
    Tabulated(Vec<f32>),
    /// `(1 - amount) * a + amount * b`.
    Blend {
        /// At amount 0, and at amount 1.
        parts: Box<[Phase; 2]>,
        /// The blend, looked up by place.
        amount: FloatInput,
    },
}

impl Phase {
    /// The phase functions that it is made of; those of a blend one after the other.
    pub fn leaves(&self) -> Vec<&Phase> {
        match self {
            Self::Blend { parts, .. } => parts.iter().flat_map(Self::leaves).collect(),
            leaf => vec![leaf],
        }
    }

    fn validate(&self) -> Result<(), MediumError> {
        if self.leaves().len() > MOST_PHASES {
            return Err(MediumError::ManyPhases { most: MOST_PHASES });
        }
        self.leaves().into_iter().try_for_each(|leaf| match leaf {
            Self::HenyeyGreenstein { g } if !(*g > -1.0 && *g < 1.0) => Err(MediumError::Anisotropy { g: *g }),
            Self::Tabulated(values) if TabulatedPhase::new(values).is_none() => Err(MediumError::PhaseTable),
            _ => Ok(()),
        })
    }
}

/// Absorption and scattering coefficients per unit length, where the density is one.
#[derive(Clone, Debug)]
pub struct Coefficients {
    /// Absorption.
    pub sigma_a: Spectrum,
    /// Scattering.
    pub sigma_s: Spectrum,
}

/// What fills a medium.
#[derive(Clone, Debug)]
#[expect(clippy::large_enum_variant, reason = "a scene has few media")]
pub enum Volume {
    /// The same everywhere.
    Homogeneous {
        /// Absorption and scattering.
        coefficients: Coefficients,
        /// Emitted radiance per absorption, with its factor.
        emission: Option<(Spectrum, f32)>,
    },
    /// A density on a regular grid; nothing outside its box.
    Grid {
        /// Absorption and scattering at density one.
        coefficients: Coefficients,
        /// The box that the grid fills.
        bounds: Bounds3,
        /// The density.
        density: VoxelGrid<f32>,
        /// What glows.
        glow: Option<Glow<VoxelGrid<f32>>>,
    },
    /// Coefficients of any colour on a regular grid; nothing outside its box.
    RgbGrid(RgbGrid),
    /// Extinction and albedo, each with a grid of its own or the same everywhere; nothing outside the box.
    Fields(Fields),
    /// A cloud made of noise; nothing outside its box.
    Cloud(Cloud),
    /// A density on a sparse grid.
    Sparse {
        /// Absorption and scattering at density one.
        coefficients: Coefficients,
        /// The density.
        density: SparseGrid,
        /// What glows.
        glow: Option<Glow<SparseGrid>>,
    },
}

impl Volume {
    /// Whether it shines.
    pub fn glows(&self) -> bool {
        match self {
            Self::Homogeneous { emission, .. } => emission.is_some(),
            Self::Grid { glow, .. } => glow.is_some(),
            Self::RgbGrid(grid) => grid.emission.is_some(),
            Self::Cloud(_) | Self::Fields(_) => false,
            Self::Sparse { glow, .. } => glow.is_some(),
        }
    }
}

/// Emission that varies in space: radiance per absorption.
#[derive(Clone, Debug)]
pub enum Glow<F> {
    /// A spectrum times a field.
    Spectrum {
        /// The spectrum.
        radiance: Spectrum,
        /// Factor of it all.
        scale: f32,
        /// Factor at each place, if it varies.
        field: Option<F>,
    },
    /// A black body whose peak is `scale * field`, of temperature `(temperature - offset) * temperature_scale`.
    Blackbody {
        /// Temperature, in kelvin before offset and scale.
        temperature: F,
        /// Subtracted from the temperature.
        offset: f32,
        /// Factor of what is left.
        temperature_scale: f32,
        /// Factor of the emission.
        scale: f32,
        /// Factor of the emission at each place, if it varies.
        field: Option<F>,
    },
}

/// Values at the centres of the cells of a box, x fastest, interpolated in between, zero outside.
#[derive(Clone, Debug, PartialEq)]
pub struct VoxelGrid<T> {
    /// Number of cells along x, y, z.
    pub size: [u32; 3],
    /// The values.
    pub values: Vec<T>,
}

/// RGB coefficients on a regular grid.
#[derive(Clone, Debug)]
pub struct RgbGrid {
    /// The box that the grid fills.
    pub bounds: Bounds3,
    /// What the RGB values mean.
    pub color_space: ColorSpace,
    /// Absorption; one if not given.
    pub sigma_a: Option<VoxelGrid<[f32; 3]>>,
    /// Scattering; one if not given.
    pub sigma_s: Option<VoxelGrid<[f32; 3]>>,
    /// Emitted radiance per absorption, with its factor.
    pub emission: Option<(VoxelGrid<[f32; 3]>, f32)>,
}

/// Extinction and albedo that vary independently: Mitsuba's heterogeneous media.
#[derive(Clone, Debug)]
pub struct Fields {
    /// The box that is filled, in the medium's space.
    pub bounds: Bounds3,
    /// Extinction per unit length.
    pub sigma_t: Field,
    /// The share of the extinction that is scattering.
    pub albedo: Field,
}

/// A quantity in space.
#[derive(Clone, Debug)]
pub enum Field {
    /// The same everywhere.
    Even(Spectrum),
    /// On a grid, whose `texture_from_world` takes the medium's space.
    Grid(GridTexture),
}

impl Field {
    fn validate(&self, name: &'static str) -> Result<(), MediumError> {
        let g = match self {
            Self::Even(s) => return spectrum(name, s),
            Self::Grid(g) => g,
        };
        let cells = g.size.iter().try_fold(1u64, |n, &s| n.checked_mul(u64::from(s))).unwrap_or(u64::MAX);
        let (expected, found) = (cells.saturating_mul(g.channels as u64), g.values.len());
        if expected != found as u64 || expected == 0 {
            return Err(MediumError::GridSize { grid: name, size: g.size, expected, found });
        }
        match g.values.iter().position(|v| !is_amount(*v)) {
            Some(index) => Err(MediumError::GridValue { grid: name, index, value: g.values[index] }),
            None => Ok(()),
        }
    }
}

/// A cloud whose density is noise that thins out with height (PBRT 4th ed., 11.4.5).
#[derive(Clone, Debug)]
pub struct Cloud {
    /// Absorption and scattering at density one.
    pub coefficients: Coefficients,
    /// The box that it fills.
    pub bounds: Bounds3,
    /// Thickness.
    pub density: f32,
    /// Amount of swirls.
    pub wispiness: f32,
    /// Number of features per unit length.
    pub frequency: f32,
}

/// What is wrong with a medium.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MediumError {
    /// The number of values does not match the size of the grid.
    #[error("`{grid}` has {found} values, but the grid of {} x {} x {} cells needs {expected}", size[0], size[1], size[2])]
    GridSize {
        /// Which grid.
        grid: &'static str,
        /// Cells along x, y, z.
        size: [u32; 3],
        /// How many values that takes.
        expected: u64,
        /// How many there are.
        found: usize,
    },
    /// A value that nothing physical can have.
    #[error("value {index} of `{grid}` is {value}; it must be a finite number that is not negative")]
    GridValue {
        /// Which grid.
        grid: &'static str,
        /// Which value.
        index: usize,
        /// The value.
        value: f32,
    },
    /// A number that nothing physical can have.
    #[error("`{name}` is {value}; it must be a finite number that is not negative")]
    Number {
        /// Its name.
        name: &'static str,
        /// The number.
        value: f32,
    },
    /// The phase function would be a Dirac, or worse.
    #[error("`g` must be between -1 and 1, not {g}")]
    Anisotropy {
        /// The mean cosine.
        g: f32,
    },
    /// A table that is no phase function.
    #[error("a tabulated phase function needs two values or more, finite, not negative and not all zero")]
    PhaseTable,
    /// A blend of blends of blends.
    #[error("a blend of more than {most} phase functions")]
    ManyPhases {
        /// How many are possible.
        most: usize,
    },
    /// A box without volume.
    #[error("the box of the medium is empty")]
    Bounds,
}

impl Medium {
    /// Whether everything is there and nothing is negative, infinite or undefined.
    ///
    /// # Errors
    /// The first thing that is wrong.
    pub fn validate(&self) -> Result<(), MediumError> {
        self.phase.validate()?;
        number("scale", self.scale)?;
        match &self.volume {
            Volume::Homogeneous { coefficients, emission } => {
                coefficients.validate()?;
                emission.iter().try_for_each(|(le, scale)| {
                    number("Lescale", *scale)?;
                    spectrum("Le", le)
                })
            }
            Volume::Grid { coefficients, bounds, density, glow } => {
                coefficients.validate()?;
                solid(bounds)?;
                density.validate("density", |v| [*v])?;
                glow.iter().try_for_each(|g| g.validate(|name, f| f.validate(name, |v| [*v])))
            }
            Volume::RgbGrid(grid) => {
                solid(&grid.bounds)?;
                grid.sigma_a.iter().try_for_each(|v| v.validate("sigma_a", |v| *v))?;
                grid.sigma_s.iter().try_for_each(|v| v.validate("sigma_s", |v| *v))?;
                grid.emission.iter().try_for_each(|(v, scale)| {
                    number("Lescale", *scale)?;
                    v.validate("Le", |v| *v)
                })
            }
            Volume::Fields(fields) => {
                solid(&fields.bounds)?;
                fields.sigma_t.validate("sigma_t")?;
                fields.albedo.validate("albedo")
            }
            Volume::Cloud(cloud) => {
                cloud.coefficients.validate()?;
                solid(&cloud.bounds)?;
                number("density", cloud.density)?;
                number("wispiness", cloud.wispiness)?;
                number("frequency", cloud.frequency)
            }
            Volume::Sparse { coefficients, density, glow } => {
                coefficients.validate()?;
                let field = |name, f: &SparseGrid| match f.first_bad_value() {
                    Some((index, value)) => Err(MediumError::GridValue { grid: name, index, value }),
                    None => solid(&f.bounds()),
                };
                field("density", density)?;
                glow.iter().try_for_each(|g| g.validate(field))
            }
        }
    }
}

impl Coefficients {
    fn validate(&self) -> Result<(), MediumError> {
        spectrum("sigma_a", &self.sigma_a)?;
        spectrum("sigma_s", &self.sigma_s)
    }
}

impl<F> Glow<F> {
    fn validate(&self, check: impl Fn(&'static str, &F) -> Result<(), MediumError>) -> Result<(), MediumError> {
        match self {
            Self::Spectrum { radiance, scale, field } => {
                number("Lescale", *scale)?;
                spectrum("Le", radiance)?;
                field.iter().try_for_each(|f| check("Lescale", f))
            }
            Self::Blackbody { temperature, scale, field, offset, temperature_scale } => {
                number("Lescale", *scale)?;
                // An offset may well be negative.
                number("temperatureoffset", offset.abs())?;
                number("temperaturescale", *temperature_scale)?;
                check("temperature", temperature)?;
                field.iter().try_for_each(|f| check("Lescale", f))
            }
        }
    }
}

impl<T> VoxelGrid<T> {
    fn validate<const N: usize>(&self, grid: &'static str, parts: impl Fn(&T) -> [f32; N]) -> Result<(), MediumError> {
        let expected = self.size.iter().try_fold(1u64, |n, &s| n.checked_mul(u64::from(s))).unwrap_or(u64::MAX);
        let found = self.values.len();
        if expected != found as u64 || expected == 0 {
            return Err(MediumError::GridSize { grid, size: self.size, expected, found });
        }
        for (index, v) in self.values.iter().enumerate() {
            if let Some(&value) = parts(v).iter().find(|v| !is_amount(**v)) {
                return Err(MediumError::GridValue { grid, index, value });
            }
        }
        Ok(())
    }
}

fn is_amount(v: f32) -> bool {
    (0.0..f32::INFINITY).contains(&v)
}

fn number(name: &'static str, value: f32) -> Result<(), MediumError> {
    if is_amount(value) { Ok(()) } else { Err(MediumError::Number { name, value }) }
}

fn spectrum(name: &'static str, s: &Spectrum) -> Result<(), MediumError> {
    (360..=830).try_for_each(|nm| number(name, s.eval_at(nm as f32)))
}

fn solid(b: &Bounds3) -> Result<(), MediumError> {
    let d = b.diagonal();
    let fine = [d.x, d.y, d.z].iter().all(|&v| v > 0.0 && v < f32::INFINITY);
    if fine { Ok(()) } else { Err(MediumError::Bounds) }
}
