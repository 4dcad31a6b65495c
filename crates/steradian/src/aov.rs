//! Channels beside the picture, chosen by `--aov`: what is seen, how much of it, and how well it is known.

use std::sync::atomic::AtomicBool;

use clap::ValueEnum;
use steradian_image::{Error, Image, Precision};
use steradian_integrator::Integrator;
use steradian_render::{
    ErrorMeasure, Features, Film, Layer, Layers, MOST_LAYERS, Rendered, features, light_groups, pixel_errors,
};
use steradian_scene::{FilmKind, Handle, Scene, World};
use steradian_spectrum::ColorMode;

use crate::cryptomatte;
use crate::failure::Failure;

/// What can be asked for. Channels are named as is usual in EXR files.
#[derive(ValueEnum, Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Aov {
    /// Share of the pixel that shows a surface: channel A, in .png too
    Alpha,
    /// Reflected share of light: albedo.R .G .B
    Albedo,
    /// Shading normal in world space: N.X .Y .Z
    Normal,
    /// Normal of the surface itself: Ng.X .Y .Z
    GeometricNormal,
    /// Distance along the view axis: Z
    Depth,
    /// Position in world space: P.X .Y .Z
    Position,
    /// Surface coordinates: uv.U .V
    Uv,
    /// Motion while the shutter is open, in pixels, to the right and up: forward.u .v
    Motion,
    /// Numbers of the object and the material that fill most of the pixel, from 1: id.object .material
    Ids,
    /// Cryptomatte layers by object
    CryptoObject,
    /// Cryptomatte layers by material
    CryptoMaterial,
    /// Light of lamps, sky and flames that are seen as they are: emission.R .G .B
    Emission,
    /// Light scattered once on its way: direct.R .G .B
    Direct,
    /// Light scattered more often: indirect.R .G .B
    Indirect,
    /// Light by its source, each `lightgroup` of the scene or else each light by itself: RGBA_name.R .G .B
    LightGroups,
    /// Light by how it was found: technique_lobe.R .G .B ran into it, technique_light.R .G .B sampled it
    Techniques,
    /// Variance of the pixel's mean: Variance.R .G .B
    Variance,
    /// Samples taken: samples.Y
    Samples,
    /// Standard error relative to brightness, as --error takes it: error.Y
    Error,
}

impl Aov {
    /// Whether the scene has to be looked at again.
    fn needs_features(self) -> bool {
        !self.is_of_film() && !self.is_light()
    }

    /// Whether the sums of the picture are enough.
    pub fn is_of_film(self) -> bool {
        matches!(self, Aov::Variance | Aov::Samples | Aov::Error)
    }

    /// Whether it is a part of the light, which is sorted while rendering.
    pub fn is_light(self) -> bool {
        matches!(self, Aov::Emission | Aov::Direct | Aov::Indirect | Aov::LightGroups | Aov::Techniques)
    }

    /// The name on the command line.
    pub fn name(self) -> String {
        self.to_possible_value().map(|v| v.get_name().to_owned()).unwrap_or_default()
    }
}

/// What is to be kept beside the picture while rendering: parts of the light that were asked for, and what limits and filters take.
pub(crate) fn layers(wanted: &[Aov], filter_outliers: bool, world: &World) -> Result<Layers, Failure> {
    let mut wanted: Vec<Aov> = wanted.iter().copied().filter(|a| a.is_light()).collect();
    wanted.sort();
    wanted.dedup();
    if let Some(aov) = wanted.first()
        && !Integrator::new(world).tells_light()
    {
        let name = crate::overrides::integrator_name(world.settings().integrator.kind);
        return Err(Failure::Input(format!("--aov {}: {name} does not tell where light comes from", aov.name())));
    }
    let mut list = Vec::new();
    for aov in wanted {
        match aov {
            Aov::Emission => list.push(Layer::Emission),
            Aov::Direct => list.push(Layer::Direct),
            Aov::Indirect => list.push(Layer::Indirect),
            Aov::Techniques => list.extend([Layer::FoundByLobe, Layer::FoundByLight]),
            Aov::LightGroups => {
                let groups = light_groups(world).0.len();
                if groups > MOST_GROUPS {
                    return Err(Failure::Input(format!(
                        "--aov light-groups: {groups} lights would be groups of their own, and {MOST_GROUPS} are the most; \
                         put lights together with \"string lightgroup\" in the scene"
                    )));
                }
                list.extend((0..groups as u32).map(Layer::Group));
            }
            _ => {}
        }
    }
    let settings = world.settings();
    // Where light lands on other pixels, nobody keeps what the limit takes from it.
    if settings.film.max_component_value.is_finite() && !settings.integrator.kind.splats() {
        list.push(Layer::Clamped);
    }
    if let FilmKind::Spectral(bands) = settings.film.kind {
        if settings.color == ColorMode::Rgb {
            return Err(Failure::Input("the `spectral` film needs wavelengths: leave out --color rgb".into()));
        }
        if settings.integrator.kind.splats() {
            let name = crate::overrides::integrator_name(settings.integrator.kind);
            return Err(Failure::Input(format!(
                "the `spectral` film keeps what samples bring to their own pixels, and those of `{name}` bring light to others: \
                 --integrator path and volpath do not"
            )));
        }
        list.push(Layer::Spectrum(bands));
    }
    if filter_outliers {
        list.push(Layer::Outliers);
    }
    Ok(Layers::new(list, world))
}

/// More groups than a compositor turns.
const MOST_GROUPS: usize = MOST_LAYERS as usize / 4;

/// Adds what the sums of the picture tell.
///
/// # Errors
/// `Error::Shape` for a bug here.
pub(crate) fn add_of_film(image: &mut Image, wanted: &[Aov], film: &Film) -> Result<(), Error> {
    let mut wanted = wanted.to_vec();
    wanted.sort();
    wanted.dedup();
    for aov in wanted {
        match aov {
            Aov::Variance => {
                let v = film.variance();
                planes(image, "Variance", ["R", "G", "B"], v.iter().copied())?;
            }
            Aov::Samples => image.add("samples.Y", film.map(|e| e.samples as f32), Precision::Float)?,
            Aov::Error => image.add("error.Y", pixel_errors(film, &ErrorMeasure::Linear), Precision::Float)?,
            _ => {}
        }
    }
    Ok(())
}

/// Adds the channels that were asked for; whether all could be had before `cancel`.
///
/// # Errors
/// `Error::Shape` for a bug here.
pub(crate) fn add(
    image: &mut Image,
    asked: &[Aov],
    rendered: &Rendered,
    world: &World,
    threads: usize,
    cancel: &AtomicBool,
) -> Result<bool, Error> {
    let mut wanted = asked.to_vec();
    wanted.sort();
    wanted.dedup();
    let mut complete = true;
    let look = || features(world, world.settings().sampler.spp.max(rendered.spp), threads, cancel);
    let seen = if wanted.iter().any(|a| a.needs_features()) {
        let seen = look();
        complete = seen.is_some();
        seen.unwrap_or_default()
    } else {
        Vec::new()
    };
    for aov in wanted.into_iter().filter(|a| complete || !a.needs_features()) {
        add_feature(image, aov, &seen, world.scene())?;
    }
    add_of_film(image, asked, &rendered.film)?;
    if let FilmKind::GBuffer { in_world } = world.settings().film.kind {
        let Some(seen) = (if seen.is_empty() { look() } else { Some(seen) }) else { return Ok(false) };
        crate::gbuffer::add(image, &seen, &rendered.film, world, in_world)?;
    }
    Ok(complete)
}

fn add_feature(image: &mut Image, aov: Aov, seen: &[Features], scene: &Scene) -> Result<(), Error> {
    let one = |image: &mut Image, name: &str, f: fn(&Features) -> f32, precision| {
        image.add(name, seen.iter().map(f).collect(), precision)
    };
    match aov {
        Aov::Alpha => one(image, "A", |f| f.alpha, Precision::Float),
        Aov::Depth => one(image, "Z", |f| f.depth, Precision::Float),
        Aov::Albedo => planes(image, "albedo", ["R", "G", "B"], seen.iter().map(|f| f.albedo)),
        Aov::Normal => planes(image, "N", ["X", "Y", "Z"], seen.iter().map(|f| f.normal)),
        Aov::GeometricNormal => planes(image, "Ng", ["X", "Y", "Z"], seen.iter().map(|f| f.geometric)),
        Aov::Position => planes(image, "P", ["X", "Y", "Z"], seen.iter().map(|f| f.position)),
        Aov::Uv => {
            one(image, "uv.U", |f| f.uv[0], Precision::Float)?;
            one(image, "uv.V", |f| f.uv[1], Precision::Float)
        }
        Aov::Ids => {
            let first =
                |f: &Features| f.objects.first().map_or(0.0, |((i, p), _)| (if *i > 0 { *i } else { p + 1 }) as f32);
            image.add("id.object", seen.iter().map(first).collect(), Precision::Uint)?;
            one(image, "id.material", |f| f.materials.first().map_or(0.0, |(m, _)| (m + 1) as f32), Precision::Uint)
        }
        Aov::CryptoObject => {
            let pixels: Vec<_> = seen.iter().map(|f| f.objects.as_slice()).collect();
            cryptomatte::add(image, "CryptoObject", &pixels, |(instance, primitive)| {
                if instance > 0 { format!("instance {instance}") } else { format!("shape {}", primitive + 1) }
            })
        }
        Aov::CryptoMaterial => {
            let pixels: Vec<_> = seen.iter().map(|f| f.materials.as_slice()).collect();
            cryptomatte::add(image, "CryptoMaterial", &pixels, |m| {
                let name = &scene.materials[Handle::from_index(m as usize)].name;
                if name.is_empty() { format!("material {}", m + 1) } else { name.clone() }
            })
        }
        Aov::Motion => {
            one(image, "forward.u", |f| f.motion[0], Precision::Float)?;
            one(image, "forward.v", |f| -f.motion[1], Precision::Float)
        }
        // Not features of what is seen.
        Aov::Variance | Aov::Samples | Aov::Error => Ok(()),
        Aov::Emission | Aov::Direct | Aov::Indirect | Aov::LightGroups | Aov::Techniques => Ok(()),
    }
}

/// Adds three channels of a layer.
pub(crate) fn planes(
    image: &mut Image,
    layer: &str,
    names: [&str; 3],
    values: impl Iterator<Item = [f32; 3]> + Clone,
) -> Result<(), Error> {
    for (c, name) in names.into_iter().enumerate() {
        image.add(&format!("{layer}.{name}"), values.clone().map(|v| v[c]).collect(), Precision::Float)?;
    }
    Ok(())
}
