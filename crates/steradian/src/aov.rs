//! Channels beside the picture, chosen by `--aov`: what is seen, how much of it, and how well it is known.

use std::sync::atomic::AtomicBool;

use clap::ValueEnum;
use steradian_image::{Error, Image, Precision};
use steradian_render::{ErrorMeasure, Features, Rendered, features, pixel_errors};
use steradian_scene::{Handle, Scene, World};

use crate::cryptomatte;

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
    /// Numbers of the object and the material that fill most of the pixel, from 1: id.object .material
    Ids,
    /// Cryptomatte layers by object
    CryptoObject,
    /// Cryptomatte layers by material
    CryptoMaterial,
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
        !matches!(self, Aov::Variance | Aov::Samples | Aov::Error)
    }

    /// The name on the command line.
    pub fn name(self) -> String {
        self.to_possible_value().map(|v| v.get_name().to_owned()).unwrap_or_default()
    }
}

/// Adds the channels that were asked for; whether all could be had before `cancel`.
///
/// # Errors
/// `Error::Shape` for a bug here.
pub(crate) fn add(
    image: &mut Image,
    wanted: &[Aov],
    rendered: &Rendered,
    world: &World,
    threads: usize,
    cancel: &AtomicBool,
) -> Result<bool, Error> {
    let mut wanted = wanted.to_vec();
    wanted.sort();
    wanted.dedup();
    let mut complete = true;
    let seen = if wanted.iter().any(|a| a.needs_features()) {
        let seen = features(world, world.settings().sampler.spp.max(rendered.spp), threads, cancel);
        complete = seen.is_some();
        seen.unwrap_or_default()
    } else {
        Vec::new()
    };
    for aov in wanted.into_iter().filter(|a| complete || !a.needs_features()) {
        match aov {
            Aov::Variance => {
                let v = rendered.film.variance();
                planes(image, "Variance", ["R", "G", "B"], v.iter().copied())?;
            }
            Aov::Samples => {
                let samples = rendered.film.map(|e| e.samples as f32);
                image.add("samples.Y", samples, Precision::Float)?;
            }
            Aov::Error => {
                image.add("error.Y", pixel_errors(&rendered.film, &ErrorMeasure::Linear), Precision::Float)?
            }
            other => add_feature(image, other, &seen, world.scene())?,
        }
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
        Aov::Variance | Aov::Samples | Aov::Error => Ok(()),
    }
}

fn planes(
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
