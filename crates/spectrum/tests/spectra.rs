//! Lanes, the kinds of spectra, and the measured ones.

use steradian_spectrum::{Dense, Lanes, Spectrum, SpectrumError, SpectrumUse, Wavelengths, named};

#[test]
fn lanes_compute_lane_by_lane() {
    let a = Lanes([1.0, 2.0, 3.0, 4.0]);
    let b = Lanes([2.0, 4.0, 0.0, -8.0]);
    assert_eq!(a + b, Lanes([3.0, 6.0, 3.0, -4.0]));
    assert_eq!(a - 1.0, Lanes([0.0, 1.0, 2.0, 3.0]));
    assert_eq!(1.0 - a, Lanes([0.0, -1.0, -2.0, -3.0]));
    assert_eq!(2.0 * a * b, Lanes([4.0, 16.0, 0.0, -64.0]));
    assert_eq!(a.safe_div(b), Lanes([0.5, 0.5, 0.0, -0.5]));
    assert_eq!(b.clamp_zero(), Lanes([2.0, 4.0, 0.0, 0.0]));
    assert_eq!((b.max_component(), b.min_component(), b.sum(), b.average()), (4.0, -8.0, -2.0, -0.5));
    assert_eq!(a.lerp(b, 0.5), Lanes([1.5, 3.0, 1.5, -2.0]));
    let mut c = a;
    c += b;
    c *= 2.0;
    c -= a;
    c /= Lanes::splat(0.5);
    assert_eq!(c, Lanes([10.0, 20.0, 6.0, -24.0]));
    assert_eq!(-a, a * -1.0);
    assert!(Lanes::ZERO.is_black() && !a.is_black() && a.is_finite());
    assert!(!(a / 0.0).is_finite() && !Lanes([0.0, 0.0, 0.0, f32::NAN]).is_finite());
    assert!(((-a).exp()[1] - 0.135_335_28).abs() < 1e-6);
    assert_eq!(Lanes([4.0, 9.0, 16.0, 0.0]).sqrt(), Lanes([2.0, 3.0, 4.0, 0.0]));
    assert_eq!([a, b, a].into_iter().sum::<Lanes>(), a + b + a);
    assert_eq!((size_of::<Lanes>(), align_of::<Lanes>()), (16, 16));
    assert_eq!(Lanes::from_rgb([1.0, 2.0, 3.0]).rgb(), [1.0, 2.0, 3.0]);
}

#[test]
fn piecewise_linear_spectra_interpolate_and_end() {
    let spectrum =
        Spectrum::piecewise_linear(&[400.0, 500.0, 700.0], &[1.0, 3.0, 1.0], SpectrumUse::Unbounded).unwrap();
    for (lambda, value) in
        [(399.9, 0.0), (400.0, 1.0), (450.0, 2.0), (500.0, 3.0), (600.0, 2.0), (700.0, 1.0), (700.1, 0.0)]
    {
        assert!((spectrum.eval_at(lambda) - value).abs() < 1e-6, "{lambda} nm: {}", spectrum.eval_at(lambda));
    }
    assert_eq!(spectrum.max_value(), 3.0);
    let one = Spectrum::piecewise_linear(&[500.0], &[2.0], SpectrumUse::Unbounded).unwrap();
    assert_eq!([499.0, 500.0, 501.0].map(|l| one.eval_at(l)), [0.0, 2.0, 0.0]);
}

#[test]
fn bad_samples_are_errors() {
    let make =
        |lambda: &[f32], values: &[f32]| Spectrum::piecewise_linear(lambda, values, SpectrumUse::Albedo).unwrap_err();
    assert_eq!(make(&[400.0], &[]), SpectrumError::LengthMismatch { wavelengths: 1, values: 0 });
    assert_eq!(make(&[], &[]), SpectrumError::Empty);
    assert_eq!(
        make(&[400.0, 400.0], &[1.0, 1.0]),
        SpectrumError::NotIncreasing { index: 1, previous: 400.0, next: 400.0 }
    );
    assert_eq!(make(&[400.0, f32::NAN], &[1.0, 1.0]), SpectrumError::NotFinite { index: 1 });
    assert_eq!(make(&[400.0, 500.0], &[f32::INFINITY, 1.0]), SpectrumError::NotFinite { index: 0 });
}

#[test]
fn tables_take_the_nearest_nanometre() {
    let table = Dense::from_fn(|lambda| lambda);
    for (lambda, value) in [(359.4, 0.0), (359.6, 360.0), (400.4, 400.0), (400.6, 401.0), (830.4, 830.0), (830.6, 0.0)]
    {
        assert_eq!(table.eval_at(lambda), value, "{lambda} nm");
    }
    assert_eq!([-5.0, 1e30, f32::NAN].map(|l| table.eval_at(l)), [0.0; 3]);
}

#[test]
fn tabulating_keeps_values_at_whole_nanometres_and_the_reading() {
    let gold = named::spectrum("metal-Au-k").unwrap();
    let table = gold.clone().tabulated();
    assert_eq!(table.rgb(), gold.rgb());
    assert_eq!([360.0, 555.0, 830.0].map(|l| table.eval_at(l)), [360.0, 555.0, 830.0].map(|l| gold.eval_at(l)));
    assert_eq!(table.eval_at(555.3), gold.eval_at(555.0));
    assert_eq!(table.eval(&Wavelengths::rgb()), gold.eval(&Wavelengths::rgb()));
}

#[test]
fn scaling_scales_every_kind_and_its_reading() {
    let at = Wavelengths::sample_visible(0.6);
    let space = steradian_spectrum::ColorSpace::Srgb;
    for spectrum in [
        Spectrum::constant(0.5, SpectrumUse::Illuminant),
        Spectrum::dense(Dense::from_fn(|l| l * 1e-3), SpectrumUse::Albedo),
        Spectrum::piecewise_linear(&[300.0, 900.0], &[0.2, 0.6], SpectrumUse::Unbounded).unwrap(),
        Spectrum::rgb_unbounded(space, [1.0, 2.0, 3.0]),
        Spectrum::rgb_illuminant(space, [1.0, 2.0, 3.0]),
        Spectrum::blackbody(3000.0).unwrap(),
    ] {
        let twice = spectrum.clone().scaled(2.0);
        for wavelengths in [at, Wavelengths::rgb()] {
            let (a, b) = (twice.eval(&wavelengths), spectrum.eval(&wavelengths) * 2.0);
            assert!((0..4).all(|l| (a[l] - b[l]).abs() <= 1e-6 * b[l].abs()), "{spectrum:?}: {a:?} {b:?}");
        }
        // Lanes are the values at their wavelengths.
        let lanes = spectrum.eval(&at);
        assert_eq!(lanes.0, at.lambda().map(|l| spectrum.eval_at(l)));
        assert!(!spectrum.is_black() && spectrum.clone().scaled(0.0).is_black());
    }
}

#[test]
fn flat_reflectances_read_flat() {
    assert_eq!(Spectrum::constant(0.18, SpectrumUse::Albedo).rgb(), [0.18; 3]);
    assert_eq!(Spectrum::constant(1.5, SpectrumUse::Unbounded).rgb(), [1.5; 3]);
    for usage in [SpectrumUse::Albedo, SpectrumUse::Unbounded] {
        let rgb = Spectrum::dense(Dense::from_fn(|_| 0.18), usage).rgb();
        assert!(rgb.iter().all(|v| (v - 0.18).abs() < 1e-6), "{usage:?}: {rgb:?}");
    }
    assert!(Spectrum::constant(1.5, SpectrumUse::Unbounded).is_constant());
    assert!(!named::spectrum("glass-BK7").unwrap().is_constant());
}

#[test]
fn every_named_table_parses_completely() {
    let mut files: Vec<_> = std::fs::read_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/data/named"))
        .unwrap()
        .map(|f| f.unwrap().path())
        .collect();
    files.sort();
    for path in &files {
        let name = path.file_stem().unwrap().to_str().unwrap();
        let text = std::fs::read_to_string(path).unwrap();
        let lines = text.lines().filter(|line| !line.starts_with('#')).count();
        let (lambda, values) = named::samples(name).unwrap_or_else(|| panic!("{name} is not listed"));
        assert_eq!((lambda.len(), values.len()), (lines, lines), "{name}");
        assert!(lambda.windows(2).all(|w| w[0] < w[1]), "{name}");
        // Nothing named is 0 at an end of the visible range for lack of data.
        let spectrum = named::spectrum(name).unwrap();
        assert_eq!(spectrum.usage() == SpectrumUse::Illuminant, name.contains("illum"), "{name}");
        assert!(spectrum.rgb().iter().all(|v| v.is_finite() && *v >= 0.0), "{name}: {:?}", spectrum.rgb());
    }
    assert_eq!(files.len(), 37);
    assert_eq!(named::list().count(), 40);
    assert_eq!(named::spectrum("glass-SF11"), named::spectrum("glass-F11"));
    assert_eq!(named::spectrum("metal-Unobtainium-eta"), None);
}

#[test]
fn glasses_have_their_catalogue_index() {
    // n_d, at 587.56 nm: Schott's data sheets.
    for (name, nd) in [
        ("glass-BK7", 1.5168),
        ("glass-BAF10", 1.6700),
        ("glass-FK51A", 1.4866),
        ("glass-LASF9", 1.8503),
        ("glass-SF5", 1.6727),
        ("glass-SF10", 1.7283),
        ("glass-SF11", 1.7847),
    ] {
        let glass = named::spectrum(name).unwrap();
        let n = glass.eval_at(587.56);
        assert!((n - nd).abs() < 1e-3, "{name}: {n}, catalogue {nd}");
        assert!(glass.eval_at(450.0) > n && n > glass.eval_at(650.0), "{name} disperses normally");
        let [r, g, b] = glass.rgb();
        assert!(r < g && g < b, "{name} reads {r}, {g}, {b}");
    }
}

#[test]
fn metals_have_their_known_colors() {
    let reflect = |n: f32, k: f32| ((n - 1.0) * (n - 1.0) + k * k) / ((n + 1.0) * (n + 1.0) + k * k);
    // Linear sRGB at normal incidence: Lagarde, "Feeding a physically based shading model" (2011); Hoffman (SIGGRAPH 2012 course).
    for (metal, known) in [
        ("Au", [1.0, 0.782, 0.344]),
        ("Cu", [0.955, 0.638, 0.538]),
        ("Ag", [0.972, 0.960, 0.915]),
        ("Al", [0.913, 0.922, 0.924]),
    ] {
        let eta = named::spectrum(&format!("metal-{metal}-eta")).unwrap();
        let k = named::spectrum(&format!("metal-{metal}-k")).unwrap();
        let table = Dense::from_fn(|l| reflect(eta.eval_at(l), k.eval_at(l)));
        let rgb = Spectrum::dense(table, SpectrumUse::Albedo).rgb();
        // The red of gold lies just outside of the gamut, and lists clamp it.
        assert!((0..3).all(|c| (rgb[c].min(1.0) - known[c]).abs() < 0.01), "{metal}: {rgb:?}, known {known:?}");
        // RGB mode reflects by three indices instead; close, as such things go.
        let read = [0, 1, 2].map(|c| reflect(eta.rgb()[c], k.rgb()[c]));
        assert!((0..3).all(|c| (read[c] - known[c]).abs() < 0.06), "{metal} in RGB mode: {read:?}, known {known:?}");
    }
}
