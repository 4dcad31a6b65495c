//! Fibres and translucent bodies under uniform light.

use crate::furnace::{check_mean, run};
use crate::scenes::*;
use steradian_math::Vec3;
use steradian_sampling::SamplerKind;
use steradian_scene::{HairColor, Roughness, Scattering, Translucency};
use steradian_spectrum::{ColorMode, ColorSpace, Spectrum, SpectrumUse};

/// Fibres that absorb nothing vanish in a furnace, wherever they are met.
#[test]
fn white_fibres_are_invisible() {
    for color in [ColorMode::Rgb, ColorMode::Spectral] {
        let mut s = empty(8, 256, 60, color, SamplerKind::PaddedSobol);
        s.camera = camera([0.0, 0.0, -4.0], [0.0, 0.0, 0.0], 30.0);
        environment(&mut s, 1.0);
        let none = spectrum(&mut s, Spectrum::constant(0.0, SpectrumUse::Unbounded));
        let (eta, beta_m, beta_n, alpha) =
            (float(&mut s, 1.55), float(&mut s, 0.4), float(&mut s, 0.3), float(&mut s, 2.0));
        let hair = Scattering::Hair { color: HairColor::Absorption(none), eta, beta_m, beta_n, alpha };
        let hair = material(&mut s, hair);
        // A sphere's second coordinate runs from pole to pole, so that all offsets occur.
        s.primitives.push(sphere(0.8, Vec3::default(), hair));
        check_mean(&run(s, 256), [1.0; 3], 3e-3, &format!("{color:?}"));
    }
}

/// Without a change of index a thick flat piece shows the reflectance that was asked for, however far light spreads.
#[test]
fn a_flat_translucent_body_shows_its_reflectance() {
    for color in [ColorMode::Rgb, ColorMode::Spectral] {
        let mut s = empty(8, 256, 4, color, SamplerKind::PaddedSobol);
        s.camera = camera([0.0, 3.0, -0.1], [0.0, 0.0, 0.0], 10.0);
        environment(&mut s, 1.0);
        let zero = float(&mut s, 0.0);
        let reflectance = spectrum(&mut s, Spectrum::constant(0.6, SpectrumUse::Albedo));
        let mean_free_path = spectrum(&mut s, Spectrum::rgb_unbounded(ColorSpace::Srgb, [0.2, 0.1, 0.05]));
        let wax = Scattering::Subsurface {
            inside: Translucency::Reflectance { reflectance, mean_free_path },
            scale: 1.0,
            g: 0.0,
            eta: 1.0,
            roughness: Roughness { u: zero, v: zero, remap: true },
        };
        let wax = material(&mut s, wax);
        let floor = quad(&mut s, [[-30.0, 0.0, -30.0], [-30.0, 0.0, 30.0], [30.0, 0.0, 30.0], [30.0, 0.0, -30.0]], wax);
        s.primitives.push(floor);
        // The reach of probes costs 0.1 %, the fit of the Fresnel moment 0.4 %.
        check_mean(&run(s, 256), [0.6; 3], 8e-3, &format!("{color:?}"));
    }
}
