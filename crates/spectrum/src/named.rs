//! Measured spectra by name: metals, glasses, illuminants. The names are pbrt-v4's; the sources stand in `data/README.md`.

use crate::{LAMBDA_MAX, LAMBDA_MIN, Spectrum, SpectrumUse, cie, csv};

/// Lists names next to their embedded tables.
macro_rules! embedded {
    ($($name:literal),* $(,)?) => {
        &[$(($name, include_str!(concat!("../data/named/", $name, ".csv")))),*]
    };
}

static TABLES: &[(&str, &str)] = embedded![
    "glass-BAF10",
    "glass-BK7",
    "glass-F10",
    "glass-F11",
    "glass-F5",
    "glass-FK51A",
    "glass-LASF9",
    "illum-acesD60",
    "metal-Ag-eta",
    "metal-Ag-k",
    "metal-Al-eta",
    "metal-Al-k",
    "metal-Au-eta",
    "metal-Au-k",
    "metal-Cu-eta",
    "metal-Cu-k",
    "metal-CuZn-eta",
    "metal-CuZn-k",
    "metal-MgO-eta",
    "metal-MgO-k",
    "metal-TiO2-eta",
    "metal-TiO2-k",
    "stdillum-A",
    "stdillum-D50",
    "stdillum-D65",
    "stdillum-F1",
    "stdillum-F2",
    "stdillum-F3",
    "stdillum-F4",
    "stdillum-F5",
    "stdillum-F6",
    "stdillum-F7",
    "stdillum-F8",
    "stdillum-F9",
    "stdillum-F10",
    "stdillum-F11",
    "stdillum-F12",
];

/// Other names of the same data: pbrt calls the SF glasses F.
const ALIASES: [(&str, &str); 3] =
    [("glass-SF5", "glass-F5"), ("glass-SF10", "glass-F10"), ("glass-SF11", "glass-F11")];

/// All names that [`spectrum`] knows, for lists and for "did you mean".
pub fn list() -> impl Iterator<Item = &'static str> {
    TABLES.iter().map(|(name, _)| *name).chain(ALIASES.iter().map(|(alias, _)| *alias))
}

/// The samples of a named spectrum: wavelengths (nm) and values as measured, neither extended nor scaled.
pub fn samples(name: &str) -> Option<(Vec<f32>, Vec<f32>)> {
    let name = ALIASES.iter().find(|(alias, _)| *alias == name).map_or(name, |(_, target)| target);
    let (_, text) = TABLES.iter().find(|(known, _)| *known == name)?;
    Some(csv::rows::<1>(text).into_iter().map(|(lambda, [value])| (lambda, value)).unzip())
}

/// A named spectrum. The samples are continued to the ends of the visible range; illuminants are scaled so that
/// their photometric value is that of a constant 1, as in pbrt.
pub fn spectrum(name: &str) -> Option<Spectrum> {
    let (mut lambda, mut values) = samples(name)?;
    extend(&mut lambda, &mut values);
    let emits = name.starts_with("stdillum-") || name.starts_with("illum-");
    let usage = if emits { SpectrumUse::Illuminant } else { SpectrumUse::Unbounded };
    let spectrum = Spectrum::piecewise_linear(&lambda, &values, usage).ok()?;
    if emits {
        let factor = cie::Y_INTEGRAL / spectrum.photometric();
        return Some(spectrum.scaled(factor));
    }
    Some(spectrum)
}

/// Continues samples that do not reach the ends of the visible range by their first and last value.
pub(crate) fn extend(lambda: &mut Vec<f32>, values: &mut Vec<f32>) {
    let (Some(&first), Some(&last)) = (lambda.first(), lambda.last()) else { return };
    if first > LAMBDA_MIN {
        lambda.insert(0, LAMBDA_MIN - 1.0);
        values.insert(0, values[0]);
    }
    if last < LAMBDA_MAX {
        lambda.push(LAMBDA_MAX + 1.0);
        values.push(values[values.len() - 1]);
    }
}
