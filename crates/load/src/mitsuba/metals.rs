//! Complex indices of refraction by the names that Mitsuba has for them.

use super::Mitsuba;
use super::spectra::as_seen;
use steradian_spectrum::{LAMBDA_MAX, LAMBDA_MIN, Spectrum, SpectrumUse, named};
use steradian_syntax::Span;

/// Lines of `name,eta or k,wavelength:value wavelength:value ...`.
const TABLE: &str = include_str!("../../data/metals.csv");

/// A column of the table, as it is beyond its ends.
fn tabulated(name: &str, part: &str) -> Option<Spectrum> {
    let line = TABLE.lines().find(|l| l.split(',').take(2).eq([name, part]))?;
    let pairs = line.rsplit(',').next()?.split_ascii_whitespace().filter_map(|p| p.split_once(':'));
    let mut samples: Vec<(f32, f32)> = pairs.filter_map(|(l, v)| Some((l.parse().ok()?, v.parse().ok()?))).collect();
    let (first, last) = (*samples.first()?, *samples.last()?);
    if first.0 > LAMBDA_MIN {
        samples.insert(0, (LAMBDA_MIN - 1.0, first.1));
    }
    if last.0 < LAMBDA_MAX {
        samples.push((LAMBDA_MAX + 1.0, last.1));
    }
    let (lambda, values): (Vec<f32>, Vec<f32>) = samples.into_iter().unzip();
    Spectrum::piecewise_linear(&lambda, &values, SpectrumUse::Unbounded).ok()
}

impl Mitsuba<'_> {
    /// Index and absorption of a metal by its name.
    pub(super) fn metal(&mut self, name: &str, span: Span) -> Option<[Spectrum; 2]> {
        let of = |part: &str| named::spectrum(&format!("metal-{name}-{part}")).or_else(|| tabulated(name, part));
        if let (Some(eta), Some(k)) = (of("eta"), of("k")) {
            return Some([as_seen(eta), as_seen(k)]);
        }
        let known = TABLE.lines().filter(|l| l.contains(",eta,")).filter_map(|l| l.split(',').next());
        let known: Vec<&str> = known.collect();
        self.error(format!("the metal `{name}` is not known; CuZn, {} are", known.join(", ")), span);
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_line_of_the_table_is_a_spectrum_of_an_index() {
        let mut count = 0;
        for line in TABLE.lines() {
            let mut words = line.split(',');
            let (name, part) = (words.next().unwrap(), words.next().unwrap());
            let s = tabulated(name, part).unwrap();
            let most = if part == "eta" { 8.0 } else { 15.0 };
            for nm in (360..=830).step_by(5) {
                let v = s.eval_at(nm as f32);
                assert!((0.0..most).contains(&v), "{name} {part} at {nm}: {v}");
            }
            assert!(part == "k" || tabulated(name, "k").is_some(), "{name} has no k");
            count += 1;
        }
        assert_eq!(count, 142);
        assert!(tabulated("none", "eta").is_none() && tabulated("A", "eta").is_none());
        // Of the source.
        assert!((tabulated("a-C", "eta").unwrap().eval_at(590.0) - 2.4).abs() < 0.2);
    }
}
