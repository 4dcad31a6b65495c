//! The embedded tables against the files that people read, and the observer, illuminants and black bodies against published numbers.

use steradian_spectrum::color::{correlated_temperature, xy_from_xyz, xyz_from_xyy};
use steradian_spectrum::{
    ColorMode, ColorSpace, Spectrum, SpectrumError, SpectrumUse, Wavelengths, cie, named, planck, white_balance,
};

fn assert_xy(what: &str, actual: [f32; 2], expected: [f32; 2], tolerance: f32) {
    assert!(
        (actual[0] - expected[0]).abs() <= tolerance && (actual[1] - expected[1]).abs() <= tolerance,
        "{what}: {actual:?}, published {expected:?}"
    );
}

fn emission_xy(spectrum: &Spectrum) -> [f32; 2] {
    xy_from_xyz(cie::xyz_integral(|lambda| spectrum.eval_at(lambda)))
}

#[test]
fn binary_observer_equals_its_csv() {
    let mut rows = 0;
    for line in include_str!("../data/cie1931.csv").lines().filter(|line| !line.starts_with('#')) {
        let cells: Vec<f32> = line.split(',').map(|cell| cell.parse().unwrap()).collect();
        let [lambda, x, y, z] = cells[..] else { panic!("{line}") };
        assert_eq!([cie::X.eval_at(lambda), cie::Y.eval_at(lambda), cie::Z.eval_at(lambda)], [x, y, z], "{lambda} nm");
        rows += 1;
    }
    assert_eq!(rows, 471);
}

#[test]
fn binary_whites_equal_their_csv() {
    for (name, table) in [("stdillum-D65", &cie::D65), ("illum-acesD60", &cie::ACES_D60)] {
        let from_csv = named::spectrum(name).unwrap();
        for lambda in 360..=830 {
            let (a, b) = (table.eval_at(lambda as f32), from_csv.eval_at(lambda as f32));
            assert!((a - b).abs() <= 2e-6 * b, "{name} at {lambda} nm: {a} in the table, {b} in the file");
        }
    }
}

#[test]
fn observer_has_equal_areas_and_its_peak_at_555_nm() {
    let sum = |table: &steradian_spectrum::Dense| table.integrate(|_| 1.0);
    let (x, y, z) = (sum(&cie::X), sum(&cie::Y), sum(&cie::Z));
    assert!((y - 106.856895).abs() < 1e-3, "y-bar integrates to {y}");
    assert!((x / y - 1.0).abs() < 2e-4 && (z / y - 1.0).abs() < 5e-4, "areas {x}, {y}, {z}");
    assert_eq!(cie::Y.eval_at(555.0), 1.0);
    assert!((f64::from(cie::Y_INTEGRAL) - y).abs() < 1e-4);
}

#[test]
fn illuminants_have_their_published_chromaticities() {
    // CIE 15:2004, tables T.3 and T.8.
    for (name, xy) in [
        ("stdillum-A", [0.44757, 0.40745]),
        ("stdillum-D65", [0.31272, 0.32903]),
        ("stdillum-F1", [0.3131, 0.3371]),
        ("stdillum-F2", [0.3721, 0.3751]),
        ("stdillum-F3", [0.4091, 0.3941]),
        ("stdillum-F4", [0.4402, 0.4031]),
        ("stdillum-F5", [0.3138, 0.3452]),
        ("stdillum-F6", [0.3779, 0.3882]),
        ("stdillum-F7", [0.3129, 0.3292]),
        ("stdillum-F8", [0.3458, 0.3586]),
        ("stdillum-F9", [0.3741, 0.3727]),
        ("stdillum-F10", [0.3458, 0.3588]),
        ("stdillum-F11", [0.3805, 0.3769]),
        ("stdillum-F12", [0.4370, 0.4042]),
    ] {
        assert_xy(name, emission_xy(&named::spectrum(name).unwrap()), xy, 6e-4);
    }
    // Not CIE's, but what scenes that name it were made with.
    assert_xy("stdillum-D50", emission_xy(&named::spectrum("stdillum-D50").unwrap()), [0.3368, 0.3580], 5e-5);
    assert_xy("illum-acesD60", emission_xy(&named::spectrum("illum-acesD60").unwrap()), [0.32168, 0.33767], 5e-5);
}

#[test]
fn black_bodies_lie_on_the_published_locus() {
    // Planckian locus in CIE 1931 x, y: Wyszecki and Stiles, Color Science, table 1(3.11).
    for (kelvin, xy) in [
        (1000.0, [0.6528, 0.3444]),
        (1500.0, [0.5857, 0.3931]),
        (2000.0, [0.5267, 0.4133]),
        (2856.0, [0.4476, 0.4074]),
        (4000.0, [0.3805, 0.3767]),
        (6500.0, [0.3135, 0.3237]),
        (10000.0, [0.2807, 0.2884]),
    ] {
        assert_xy(&format!("{kelvin} K"), emission_xy(&Spectrum::blackbody(kelvin).unwrap()), xy, 2e-4);
    }
}

#[test]
fn planck_is_right_in_absolute_units() {
    // 2 h c^2 / (lambda^5 (exp(h c / (lambda k T)) - 1)) in double precision, with the SI's exact constants.
    for (lambda, kelvin) in [(360.0f32, 1500.0f32), (500.0, 5772.0), (555.0, 2856.0), (830.0, 1e6), (560.0, 300.0)] {
        let (h, c, k) = (6.62607015e-34f64, 299_792_458.0f64, 1.380649e-23f64);
        let l = f64::from(lambda) * 1e-9;
        let expected = 2.0 * h * c * c / (l.powi(5) * (h * c / (l * k * f64::from(kelvin))).exp_m1());
        let actual = f64::from(planck::radiance(lambda, kelvin));
        assert!((actual / expected - 1.0).abs() < 3e-5, "{lambda} nm, {kelvin} K: {actual}, expected {expected}");
    }
    assert_eq!(planck::radiance(500.0, 0.0), 0.0);
    assert_eq!(planck::radiance(500.0, -1.0), 0.0);
}

#[test]
fn black_body_peaks_at_one_where_wien_says() {
    let body = Spectrum::blackbody(5000.0).unwrap();
    let peak = planck::WIEN_NM_KELVIN / 5000.0;
    assert!((body.eval_at(peak) - 1.0).abs() < 1e-5);
    assert!(body.eval_at(peak - 20.0) < 1.0 && body.eval_at(peak + 20.0) < 1.0);
    assert!(body.max_value() >= body.eval_at(peak) && body.rgb().iter().all(|&v| v <= body.max_value()));
    for kelvin in [0.0, -3.0, f32::NAN, f32::INFINITY] {
        assert!(matches!(Spectrum::blackbody(kelvin), Err(SpectrumError::Temperature { .. })), "{kelvin}");
        assert!(planck::daylight(kelvin).is_err(), "{kelvin}");
    }
}

#[test]
fn black_bodies_on_the_fly_equal_those_made_beforehand() {
    let spectral = Wavelengths::sample_visible(0.37);
    for kelvin in [401.0, 800.0, 1234.5, 2000.0, 5600.0, 6543.0, 20000.0, 99999.0] {
        let body = Spectrum::blackbody(kelvin).unwrap();
        for wavelengths in [spectral, Wavelengths::rgb()] {
            let (a, b) = (planck::blackbody_lanes(kelvin, &wavelengths), body.eval(&wavelengths));
            for lane in 0..4 {
                // Straight lines between rows of the logarithm of XYZ: within 0.1 % of the largest component.
                assert!(
                    (a[lane] - b[lane]).abs() <= 1.5e-3 * b.max_component(),
                    "{kelvin} K, {:?}: {a:?} {b:?}",
                    wavelengths.mode()
                );
            }
        }
    }
    assert!(planck::blackbody_lanes(300.0, &spectral).is_black());
}

#[test]
fn daylight_of_6500_kelvin_is_d65() {
    let daylight = planck::daylight(6500.0).unwrap();
    for lambda in (360..=830).step_by(10) {
        let lambda = lambda as f32;
        let ratio = daylight.eval_at(lambda) / daylight.eval_at(560.0);
        let expected = cie::D65.eval_at(lambda) / cie::D65.eval_at(560.0);
        assert!((ratio - expected).abs() < 2e-3, "{lambda} nm: {ratio} and {expected}");
    }
    assert!((correlated_temperature(xy_from_xyz(cie::xyz_of_table(&daylight))) - 6504.0).abs() < 10.0);
    // The two branches of the locus meet.
    let (below, above) = (planck::daylight(6995.0).unwrap(), planck::daylight(6997.5).unwrap());
    assert_xy("7000 K", xy_from_xyz(cie::xyz_of_table(&below)), xy_from_xyz(cie::xyz_of_table(&above)), 2e-4);
}

#[test]
fn matrices_are_those_of_the_standards() {
    // IEC 61966-2-1; the fourth digit depends on how the white was rounded.
    let srgb = ColorSpace::Srgb.xyz_from_rgb();
    let expected = [[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]];
    for r in 0..3 {
        for c in 0..3 {
            assert!((srgb.0[r][c] - expected[r][c]).abs() < 3e-4, "row {r}, column {c}: {}", srgb.0[r][c]);
        }
    }
    for space in ColorSpace::ALL {
        let product = space.xyz_from_rgb().then(space.rgb_from_xyz());
        for r in 0..3 {
            for c in 0..3 {
                assert!((product.0[r][c] - if r == c { 1.0 } else { 0.0 }).abs() < 2e-6, "{space:?}: {product:?}");
            }
        }
        let white = space.xyz_from_rgb().apply([1.0; 3]);
        assert_xy(space.name(), xy_from_xyz(white), space.white(), 1e-6);
        assert!((white[1] - 1.0).abs() < 1e-6);
        assert_eq!(ColorSpace::from_name(&space.name().to_uppercase()), Some(space));
        assert_eq!(ColorSpace::from_chromaticities(space.primaries(), space.white()), Some(space));
    }
    assert_eq!(ColorSpace::from_name("adobe"), None);
}

#[test]
fn white_balance_maps_white_to_white_and_back() {
    let (source, target) = ([0.44757, 0.40745], [0.31272, 0.32903]);
    let there = white_balance(source, target);
    let mapped = there.apply(xyz_from_xyy(source, 1.0));
    let expected = xyz_from_xyy(target, 1.0);
    assert!((0..3).all(|c| (mapped[c] - expected[c]).abs() < 1e-5), "{mapped:?} {expected:?}");
    let round = there.then(&white_balance(target, source)).apply([0.2, 0.5, 0.3]);
    assert!((0..3).all(|c| (round[c] - [0.2, 0.5, 0.3][c]).abs() < 1e-5), "{round:?}");
    assert_eq!(there.inverse().map(|inverse| inverse.apply(mapped)[1] > 0.99), Some(true));
    assert_eq!(steradian_spectrum::Matrix3([[1.0, 2.0, 3.0], [2.0, 4.0, 6.0], [0.0, 0.0, 1.0]]).inverse(), None);
}

#[test]
fn readings_of_measured_illuminants_agree_with_their_spectra() {
    for name in named::list().filter(|name| name.contains("illum")) {
        let spectrum = named::spectrum(name).unwrap();
        assert!((spectrum.photometric() / cie::Y_INTEGRAL - 1.0).abs() < 1e-5, "{name}");
        let xyz = ColorSpace::Srgb.xyz_from_rgb().apply(spectrum.rgb());
        assert!((xyz[1] / spectrum.photometric() - 1.0).abs() < 1e-4, "{name} reads {:?}", spectrum.rgb());
    }
    let equal_energy = Spectrum::constant(1.0, SpectrumUse::Illuminant);
    assert!((equal_energy.photometric() - cie::Y_INTEGRAL).abs() < 1e-3);
    assert_eq!(Wavelengths::rgb().mode(), ColorMode::Rgb);
}
