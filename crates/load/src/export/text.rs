//! Numbers, names, matrices and spectra in the spelling of pbrt-v4.

use steradian_math::{Point3, Transform, Vec3};
use steradian_spectrum::{Spectrum, SpectrumUse};

/// A number that every reader takes: the format has no infinities.
pub(super) fn number(v: f32) -> String {
    if v.is_finite() { v.to_string() } else { f32::MAX.copysign(v).to_string() }
}

pub(super) fn list(values: &[f32]) -> String {
    let words: Vec<String> = values.iter().map(|&v| number(v)).collect();
    format!("[ {} ]", words.join(" "))
}

pub(super) fn integers(values: impl IntoIterator<Item = u32>) -> String {
    let words: Vec<String> = values.into_iter().map(|v| v.to_string()).collect();
    format!("[ {} ]", words.join(" "))
}

pub(super) fn quoted(text: &str) -> String {
    text.replace('\\', "\\\\").replace('"', "\\\"")
}

pub(super) fn triples(points: impl Iterator<Item = [f32; 3]>) -> String {
    list(&points.flatten().collect::<Vec<f32>>())
}

/// A matrix in the order of the format, which is by columns.
pub(super) fn transform(t: &Transform) -> String {
    let axes = [Vec3::new(1.0, 0.0, 0.0), Vec3::new(0.0, 1.0, 0.0), Vec3::new(0.0, 0.0, 1.0)];
    let mut columns: Vec<f32> = axes.iter().map(|&a| t.vector(a)).flat_map(|v| [v.x, v.y, v.z, 0.0]).collect();
    let o = t.point(Point3::default());
    columns.extend([o.x, o.y, o.z, 1.0]);
    format!("Transform {}", list(&columns))
}

/// A parameter that is a spectrum.
pub(super) fn spectrum(name: &str, s: &Spectrum) -> String {
    if s.is_rgb() {
        // Of an illuminant, what it shows as once its white has luminance one.
        let factor = if s.usage() == SpectrumUse::Illuminant { 1.0 / s.photometric() } else { 1.0 };
        return format!("\"rgb {name}\" {}", list(&s.rgb().map(|v| v * factor)));
    }
    format!("\"spectrum {name}\" {}", list(&samples(s)))
}

/// Wavelengths and values at whole nanometres, without those that lie on the line between their neighbours.
fn samples(s: &Spectrum) -> Vec<f32> {
    let values: Vec<f32> = (360..=830).map(|l| s.eval_at(l as f32)).collect();
    let tolerance = 1e-6 * values.iter().fold(0.0f32, |m, v| m.max(v.abs()));
    let last = values.len() - 1;
    let mut out = vec![360.0, values[0]];
    let mut from = 0;
    while from < last {
        // The furthest point that a line reaches with all between on it.
        let on_line = |to: usize| {
            (from + 1..to).all(|i| {
                let x = (i - from) as f32 / (to - from) as f32;
                (values[from] + (values[to] - values[from]) * x - values[i]).abs() <= tolerance
            })
        };
        let mut to = from + 1;
        while to < last && on_line(to + 1) {
            to += 1;
        }
        out.extend([360.0 + to as f32, values[to]]);
        from = to;
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spectra_are_written_by_their_corners() {
        let s = Spectrum::constant(0.25, SpectrumUse::Albedo);
        assert_eq!(spectrum("L", &s), "\"spectrum L\" [ 360 0.25 830 0.25 ]");
        let s = Spectrum::piecewise_linear(&[360.0, 400.0, 830.0], &[0.0, 1.0, 0.0], SpectrumUse::Albedo).unwrap();
        let written = samples(&s);
        assert!(written.len() <= 12, "{written:?}");
        let (l, v): (Vec<f32>, Vec<f32>) = written.chunks(2).map(|p| (p[0], p[1])).unzip();
        let again = Spectrum::piecewise_linear(&l, &v, SpectrumUse::Albedo).unwrap();
        for l in 360..=830 {
            let (a, b) = (s.eval_at(l as f32), again.eval_at(l as f32));
            assert!((a - b).abs() < 1e-5, "{l}: {a} {b}");
        }
        assert_eq!(number(f32::INFINITY), f32::MAX.to_string());
    }
}
