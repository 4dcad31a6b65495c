//! RGB colour spaces: primaries, white, and their matrices, all worked out at compile time from the primaries and the white's spectrum.

use crate::color::{Matrix3, apply, invert, multiply, narrow, white_balance_f64};
use crate::dense::Dense;
use crate::uplift::{self, Sigmoid};
use crate::{Lanes, Wavelengths, cie};

/// An RGB colour space with linear components.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum ColorSpace {
    /// Primaries of ITU-R BT.709, white D65. RGB mode renders in it.
    #[default]
    Srgb,
    /// Display P3: primaries of DCI-P3, white D65.
    DciP3,
    /// ITU-R BT.2020, white D65.
    Rec2020,
    /// Academy Color Encoding System, AP0 primaries, white "D60".
    Aces2065,
}

/// What is derived from primaries and white.
struct Derived {
    primaries: [[f64; 2]; 3],
    white: [f64; 3],
    photometric: f32,
    xyz_from_rgb: Matrix3,
    rgb_from_xyz: Matrix3,
    emission_to_srgb: Matrix3,
    reflectance_to_srgb: Matrix3,
    reflectance_from_srgb: Matrix3,
}

/// The sums of the white illuminants against the observer.
const D65: [f64; 3] = cie::white_xyz(&Dense::from_bytes(include_bytes!("../data/illuminant_d65.f32"), 0));
const D60: [f64; 3] = cie::white_xyz(&Dense::from_bytes(include_bytes!("../data/illuminant_aces_d60.f32"), 0));

const SRGB_PRIMARIES: [[f64; 2]; 3] = [[0.64, 0.33], [0.3, 0.6], [0.15, 0.06]];

static SRGB: Derived = derive(SRGB_PRIMARIES, D65);
static DCI_P3: Derived = derive([[0.68, 0.32], [0.265, 0.690], [0.15, 0.06]], D65);
static REC2020: Derived = derive([[0.708, 0.292], [0.170, 0.797], [0.131, 0.046]], D65);
static ACES2065: Derived = derive([[0.7347, 0.2653], [0.0, 1.0], [0.0001, -0.077]], D60);

/// Scaled to Y = 1.
const fn unit(xyz: [f64; 3]) -> [f64; 3] {
    [xyz[0] / xyz[1], 1.0, xyz[2] / xyz[1]]
}

/// The matrix whose columns are the primaries, scaled so that they add up to white.
const fn xyz_from_rgb(primaries: [[f64; 2]; 3], white: [f64; 3]) -> [[f64; 3]; 3] {
    let mut columns = [[0.0; 3]; 3];
    let mut c = 0;
    while c < 3 {
        let [x, y] = primaries[c];
        columns[0][c] = x / y;
        columns[1][c] = 1.0;
        columns[2][c] = (1.0 - x - y) / y;
        c += 1;
    }
    let scale = apply(invert(columns), white);
    multiply(columns, [[scale[0], 0.0, 0.0], [0.0, scale[1], 0.0], [0.0, 0.0, scale[2]]])
}

const fn derive(primaries: [[f64; 2]; 3], illuminant: [f64; 3]) -> Derived {
    let white = unit(illuminant);
    let to_xyz = xyz_from_rgb(primaries, white);
    let srgb_from_xyz = invert(xyz_from_rgb(SRGB_PRIMARIES, unit(D65)));
    // A white surface must stay white under the other space's illuminant; a white lamp keeps its tint.
    let adapted = multiply(white_balance_f64(white, unit(D65)), to_xyz);
    Derived {
        primaries,
        white,
        photometric: illuminant[1] as f32,
        xyz_from_rgb: narrow(to_xyz),
        rgb_from_xyz: narrow(invert(to_xyz)),
        emission_to_srgb: narrow(multiply(srgb_from_xyz, to_xyz)),
        reflectance_to_srgb: narrow(multiply(srgb_from_xyz, adapted)),
        reflectance_from_srgb: narrow(invert(multiply(srgb_from_xyz, adapted))),
    }
}

impl ColorSpace {
    /// All of them.
    pub const ALL: [ColorSpace; 4] = [ColorSpace::Srgb, ColorSpace::DciP3, ColorSpace::Rec2020, ColorSpace::Aces2065];

    /// The colour space with pbrt's name `name`, in any mixture of cases.
    pub fn from_name(name: &str) -> Option<ColorSpace> {
        ColorSpace::ALL.into_iter().find(|space| space.name().eq_ignore_ascii_case(name))
    }

    /// The name that pbrt scenes use.
    pub fn name(self) -> &'static str {
        match self {
            ColorSpace::Srgb => "srgb",
            ColorSpace::DciP3 => "dci-p3",
            ColorSpace::Rec2020 => "rec2020",
            ColorSpace::Aces2065 => "aces2065-1",
        }
    }

    /// The space whose primaries and white (CIE x, y) these are, within one part in a thousand, as image files record them.
    pub fn from_chromaticities(primaries: [[f32; 2]; 3], white: [f32; 2]) -> Option<ColorSpace> {
        let close = |a: [f32; 2], b: [f32; 2]| (0..2).all(|i| (a[i] - b[i]).abs() <= 1e-3 * b[i].abs() + 1e-6);
        ColorSpace::ALL
            .into_iter()
            .find(|space| (0..3).all(|c| close(primaries[c], space.primaries()[c])) && close(white, space.white()))
    }

    #[inline]
    fn derived(self) -> &'static Derived {
        match self {
            ColorSpace::Srgb => &SRGB,
            ColorSpace::DciP3 => &DCI_P3,
            ColorSpace::Rec2020 => &REC2020,
            ColorSpace::Aces2065 => &ACES2065,
        }
    }

    /// CIE x, y of red, green and blue.
    pub fn primaries(self) -> [[f32; 2]; 3] {
        self.derived().primaries.map(|p| p.map(|v| v as f32))
    }

    /// CIE x, y of white.
    pub fn white(self) -> [f32; 2] {
        crate::color::xy_from_xyz(self.derived().white.map(|v| v as f32))
    }

    /// From linear RGB to XYZ, where white has Y = 1.
    pub fn xyz_from_rgb(self) -> &'static Matrix3 {
        &self.derived().xyz_from_rgb
    }

    /// From XYZ, where white has Y = 1, to linear RGB.
    pub fn rgb_from_xyz(self) -> &'static Matrix3 {
        &self.derived().rgb_from_xyz
    }

    /// From this space to linear sRGB, the same stimulus: whites are not adapted. The identity for sRGB itself.
    pub fn emission_to_srgb(self, rgb: [f32; 3]) -> [f32; 3] {
        if self == ColorSpace::Srgb { rgb } else { self.derived().emission_to_srgb.apply(rgb) }
    }

    /// From this space to linear sRGB, the same surface: white maps to white. The identity for sRGB itself.
    pub fn reflectance_to_srgb(self, rgb: [f32; 3]) -> [f32; 3] {
        if self == ColorSpace::Srgb { rgb } else { self.derived().reflectance_to_srgb.apply(rgb) }
    }

    /// The spectrum of white, normalised as [`cie::D65`] is.
    #[inline]
    pub fn illuminant(self) -> &'static Dense {
        match self {
            ColorSpace::Srgb | ColorSpace::DciP3 | ColorSpace::Rec2020 => &cie::D65,
            ColorSpace::Aces2065 => &cie::ACES_D60,
        }
    }

    /// The sum of [`ColorSpace::illuminant`] times y-bar.
    #[inline]
    pub fn photometric(self) -> f32 {
        self.derived().photometric
    }

    /// The colour, in this space, of a surface with reflectance `lanes` under this space's white: for albedo images. In spectral mode an estimate.
    pub fn reflectance_rgb(self, lanes: Lanes, wavelengths: &Wavelengths) -> [f32; 3] {
        if wavelengths.is_rgb() {
            let rgb = lanes.rgb();
            return if self == ColorSpace::Srgb { rgb } else { self.derived().reflectance_from_srgb.apply(rgb) };
        }
        let lit = lanes * self.illuminant().eval(wavelengths.lambda()) * (1.0 / self.photometric());
        self.rgb_from_xyz().apply(cie::xyz_of_lanes(lit, wavelengths))
    }

    /// The smooth reflectance that looks like `rgb` under this space's white: see Jakob and Hanika 2019.
    ///
    /// Components are clamped to `[0,1]`; NaN stays NaN.
    #[inline]
    pub fn to_coefficients(self, rgb: [f32; 3]) -> Sigmoid {
        uplift::coefficients(self, rgb)
    }
}
