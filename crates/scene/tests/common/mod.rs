//! Scenes to start from.

#![allow(dead_code, reason = "each test file uses a part")]

use steradian_image::Filter;
use steradian_sampling::SamplerSettings;
use steradian_scene::{
    FilmSettings, Handle, IntegratorSettings, Material, RenderSettings, Scattering, Scene, SpectrumTexture, Texture,
};
use steradian_spectrum::{ColorMode, ColorSpace, Spectrum, SpectrumUse};

/// Nothing, to be seen in RGB on four by four pixels.
pub fn empty() -> Scene {
    Scene::new(RenderSettings {
        film: FilmSettings::new(4, 4),
        filter: Filter::pixel_box(),
        sampler: SamplerSettings::default(),
        integrator: IntegratorSettings::default(),
        color: ColorMode::Rgb,
        disable_pixel_jitter: false,
        disable_wavelength_jitter: false,
        disable_texture_filtering: false,
        force_diffuse: false,
        layered_as_pbrt: false,
    })
}

/// White emission, and the factor that makes its luminance one.
pub fn white() -> (Spectrum, f32) {
    let s = Spectrum::rgb_illuminant(ColorSpace::Srgb, [1.0; 3]);
    let scale = 1.0 / s.photometric();
    (s, scale)
}

/// A diffuse surface that reflects half.
pub fn grey(scene: &mut Scene) -> Handle<Material> {
    let s = Spectrum::constant(0.5, SpectrumUse::Albedo);
    let texture = SpectrumTexture { usage: s.usage(), kind: Texture::Constant(s) };
    let reflectance = scene.spectrum_textures.push(texture);
    let scattering = Scattering::Diffuse { reflectance };
    scene.materials.push(Material { name: String::new(), scattering, displacement: None, normal_map: None, tilt: None })
}
