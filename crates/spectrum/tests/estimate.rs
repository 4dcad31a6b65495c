//! Four wavelengths at a time: the estimators of the film are unbiased, and sensors show white as white.

use steradian_spectrum::{
    ColorMode, ColorSpace, Lanes, PixelSensor, Spectrum, SpectrumError, SpectrumUse, Wavelengths, cie, named,
};

/// Uniform numbers in [0,1), fixed by the seed (PCG-XSH-RR).
fn uniforms(seed: u64) -> impl FnMut() -> f32 {
    let mut state = seed;
    move || {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        let word = (((state >> 18) ^ state) >> 27) as u32;
        (word.rotate_right((state >> 59) as u32) >> 8) as f32 / (1u32 << 24) as f32
    }
}

/// Fails when the mean of `samples` is more than 5.5 standard errors (false alarm 4e-8) off `expected`.
fn assert_unbiased(what: &str, samples: &[f64], expected: f64) {
    let n = samples.len() as f64;
    let mean = samples.iter().sum::<f64>() / n;
    let variance = samples.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>() / (n - 1.0);
    let error = (variance / n).sqrt();
    // The slack is for the rounding of single precision, where an estimator has next to no variance.
    assert!(
        (mean - expected).abs() <= 5.5 * error + 2e-6 * expected.abs(),
        "{what}: {mean} +- {error}, expected {expected}"
    );
}

#[test]
fn wavelengths_follow_their_density() {
    let mut u = uniforms(1);
    // The density integrates to one, and each sample comes with it.
    let sum: f64 =
        (0..47000).map(|i| f64::from(Wavelengths::visible_pdf(360.0 + (i as f32 + 0.5) * 0.01)) * 0.01).sum();
    assert!((sum - 1.0).abs() < 1e-4, "{sum}");
    let mut below = [0.0f64; 4];
    const N: usize = 40000;
    for _ in 0..N {
        let wavelengths = Wavelengths::sample_visible(u());
        for (lane, lambda) in wavelengths.lambda().into_iter().enumerate() {
            assert!((360.0..=830.0).contains(&lambda));
            let expected = Wavelengths::visible_pdf(lambda);
            assert!((wavelengths.pdf()[lane] - expected).abs() <= 2e-4 * expected, "{lambda} nm");
            below[lane] += f64::from(u8::from(lambda < 520.0));
        }
    }
    let share: f64 =
        (0..16000).map(|i| f64::from(Wavelengths::visible_pdf(360.0 + (i as f32 + 0.5) * 0.01)) * 0.01).sum();
    for lane in 0..4 {
        let error = (share * (1.0 - share) / N as f64).sqrt();
        assert!(
            (below[lane] / N as f64 - share).abs() < 5.5 * error,
            "lane {lane}: {} below 520 nm, expected {share}",
            below[lane] / N as f64
        );
    }
}

#[test]
fn extremes_of_the_random_number_are_fine() {
    for u in [0.0, f32::MIN_POSITIVE, 0.25, 0.5, 0.75, 1.0 - f32::EPSILON / 2.0] {
        for wavelengths in [Wavelengths::sample_visible(u), Wavelengths::sample_uniform(u, 400.0, 700.0)] {
            assert!(wavelengths.lambda().iter().all(|l| (360.0..=830.0).contains(l)), "{u}: {wavelengths:?}");
            assert!(wavelengths.pdf().min_component() > 0.0 && wavelengths.pdf().is_finite(), "{u}: {wavelengths:?}");
            assert!(!wavelengths.is_rgb());
        }
    }
}

#[test]
fn film_estimates_are_unbiased_with_all_lanes_and_with_the_hero_alone() {
    let light = named::spectrum("stdillum-F11").unwrap();
    let sensor = PixelSensor::cie1931(ColorSpace::Srgb, None, 1.0).unwrap();
    // Estimators see steps of 1 nm, so the exact integral is that of the table.
    let light = Spectrum::dense(light.to_dense(), SpectrumUse::Illuminant);
    let expected = cie::xyz_integral(|lambda| light.eval_at(lambda));
    for (what, uniform, terminate) in [
        ("visible", false, false),
        ("visible, hero alone", false, true),
        ("uniform", true, false),
        ("uniform, hero alone", true, true),
    ] {
        let mut u = uniforms(7);
        let mut samples = [const { Vec::new() }; 3];
        for _ in 0..60000 {
            let mut wavelengths =
                if uniform { Wavelengths::sample_uniform(u(), 359.5, 830.5) } else { Wavelengths::sample_visible(u()) };
            if terminate {
                wavelengths.terminate_secondary();
                wavelengths.terminate_secondary();
                assert!(wavelengths.secondary_terminated());
            }
            let rgb = sensor.to_sensor_rgb(light.eval(&wavelengths), &wavelengths);
            for c in 0..3 {
                samples[c].push(f64::from(rgb[c]));
            }
        }
        for c in 0..3 {
            assert_unbiased(&format!("{what}, channel {c}"), &samples[c], f64::from(expected[c]));
        }
    }
}

/// The film's colour of radiance `light * scale` seen directly, by quadrature over the random number in spectral mode.
fn seen(sensor: &PixelSensor, mode: ColorMode, light: &Spectrum, scale: f32) -> [f32; 3] {
    let n = if mode == ColorMode::Rgb { 1 } else { 20000 };
    let mut sum = [0.0f64; 3];
    for i in 0..n {
        let wavelengths = Wavelengths::sample(mode, (i as f32 + 0.5) / n as f32);
        let rgb = sensor.to_sensor_rgb(light.eval(&wavelengths) * scale, &wavelengths);
        for c in 0..3 {
            sum[c] += f64::from(rgb[c]) / f64::from(n);
        }
    }
    sensor.output_rgb_from_sensor(mode).apply(sum.map(|v| v as f32))
}

#[test]
fn both_modes_agree_on_exposure() {
    for space in ColorSpace::ALL {
        let light = Spectrum::rgb_illuminant(space, [1.0; 3]);
        let sensor = PixelSensor::cie1931(space, None, 2.0).unwrap();
        for mode in [ColorMode::Rgb, ColorMode::Spectral] {
            let rgb = seen(&sensor, mode, &light, 3.0 / light.photometric());
            assert!(rgb.iter().all(|v| (v - 6.0).abs() < 6.0 * 3e-4), "{space:?} {mode:?}: {rgb:?}");
        }
    }
}

#[test]
fn nothing_is_rounded_where_nothing_is_converted() {
    let sensor = PixelSensor::cie1931(ColorSpace::Srgb, None, 1.0).unwrap();
    let rgb = sensor.to_sensor_rgb(Lanes::from_rgb([0.1, 0.7, 0.3]), &Wavelengths::rgb());
    assert_eq!(sensor.output_rgb_from_sensor(ColorMode::Rgb).apply(rgb), [0.1, 0.7, 0.3]);
}

#[test]
fn white_balance_makes_its_daylight_white() {
    for space in [ColorSpace::Srgb, ColorSpace::Aces2065] {
        let sensor = PixelSensor::cie1931(space, Some(5000.0), 1.0).unwrap();
        let table = steradian_spectrum::planck::daylight(5000.0).unwrap();
        let light = Spectrum::dense(table, SpectrumUse::Illuminant);
        for mode in [ColorMode::Rgb, ColorMode::Spectral] {
            let rgb = seen(&sensor, mode, &light, 1.0 / light.photometric());
            assert!(rgb.iter().all(|v| (v - 1.0).abs() < 2e-3), "{space:?} {mode:?}: {rgb:?}");
        }
    }
}

#[test]
fn measured_cameras_show_white_nearly_white() {
    let light = Spectrum::rgb_illuminant(ColorSpace::Srgb, [1.0; 3]);
    let mut count = 0;
    for name in PixelSensor::names() {
        let sensor = PixelSensor::from_name(name, ColorSpace::Srgb, None, 1.0).unwrap();
        for mode in [ColorMode::Rgb, ColorMode::Spectral] {
            let rgb = seen(&sensor, mode, &light, 1.0 / light.photometric());
            // The least squares fit to the chart does not favour white.
            assert!(rgb.iter().all(|v| (v - 1.0).abs() < 0.025), "{name} {mode:?}: {rgb:?}");
        }
        count += 1;
    }
    assert_eq!(count, 18);
    let unknown = PixelSensor::from_name("polaroid", ColorSpace::Srgb, None, 1.0);
    assert_eq!(unknown, Err(SpectrumError::UnknownSensor { name: "polaroid".to_owned() }));
    assert!(PixelSensor::cie1931(ColorSpace::Srgb, Some(-1.0), 1.0).is_err());
}

#[test]
fn albedo_images_show_the_color_of_the_surface() {
    for space in [ColorSpace::Srgb, ColorSpace::Rec2020, ColorSpace::Aces2065] {
        let rgb = [0.4, 0.5, 0.6];
        let exact = space.reflectance_rgb(space.albedo_lanes(rgb, &Wavelengths::rgb()), &Wavelengths::rgb());
        let n = 5000;
        let mut mean = [0.0; 3];
        for i in 0..n {
            let wavelengths = Wavelengths::sample_visible((i as f32 + 0.5) / n as f32);
            let estimate = space.reflectance_rgb(space.albedo_lanes(rgb, &wavelengths), &wavelengths);
            (0..3).for_each(|c| mean[c] += estimate[c] / n as f32);
        }
        for c in 0..3 {
            assert!((exact[c] - rgb[c]).abs() < 1e-5, "{space:?}: {exact:?}");
            assert!((mean[c] - rgb[c]).abs() < 3e-3, "{space:?}: {mean:?}");
        }
    }
}
