//! Channels beside the picture, chosen by `--aov`: what is seen, how much of it, and how well it is known.

use std::sync::atomic::AtomicBool;

use clap::ValueEnum;
use serde::{Deserialize, Serialize};
use steradian_image::{Error, Image, Precision};
use steradian_integrator::Integrator;
use steradian_math::Transform;
use steradian_render::{
    ErrorMeasure, Features, Film, Layer, Layers, MOST_LAYERS, Part, Rendered, Seen, features, light_groups,
    pixel_errors,
};
use steradian_scene::{FilmKind, World};
use steradian_spectrum::ColorMode;

use crate::failure::Failure;
use crate::{cryptomatte, gbuffer};

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

/// What channels need besides features and sums: a part of a distributed render has it as its note.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
struct Wanted {
    /// The channels, by their names on the command line.
    aovs: Vec<String>,
    /// The names of the materials, of which some are empty.
    materials: Vec<String>,
    /// Of a `gbuffer` film.
    gbuffer: Option<Space>,
}

/// The space that places and normals of a `gbuffer` are in.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
enum Space {
    World,
    /// The way there: the bits of a matrix and of its inverse.
    Camera([[[u32; 4]; 4]; 2]),
}

impl Wanted {
    fn of(asked: &[Aov], world: &World) -> Self {
        let mut aovs = asked.to_vec();
        aovs.sort();
        aovs.dedup();
        let named = aovs.contains(&Aov::CryptoMaterial);
        let gbuffer = match world.settings().film.kind {
            FilmKind::GBuffer { in_world: true } => Some(Space::World),
            FilmKind::GBuffer { in_world: false } => {
                let t = gbuffer::from_world(world);
                Some(Space::Camera([t.m, t.inv].map(|m| m.map(|row| row.map(f32::to_bits)))))
            }
            _ => None,
        };
        Self {
            aovs: aovs.into_iter().map(Aov::name).collect(),
            materials: world.scene().materials.iter().filter(|_| named).map(|m| m.name.clone()).collect(),
            gbuffer,
        }
    }

    fn list(&self) -> Vec<Aov> {
        self.aovs.iter().filter_map(|name| Aov::from_str(name, false).ok()).collect()
    }

    /// Whether the scene has to be looked at again.
    fn needs_features(&self) -> bool {
        self.gbuffer.is_some() || self.list().iter().any(|a| a.needs_features())
    }

    /// Adds everything; `seen` is empty where no features are needed.
    fn add(&self, image: &mut Image, seen: &[Features], film: &Film) -> Result<(), Error> {
        for aov in self.list() {
            add_feature(image, aov, seen, &self.materials)?;
        }
        add_of_film(image, &self.list(), film)?;
        if let Some(space) = &self.gbuffer {
            let from_world = match space {
                Space::World => None,
                Space::Camera(bits) => {
                    let [m, inv] = bits.map(|m| m.map(|row| row.map(f32::from_bits)));
                    Some(Transform { m, inv })
                }
            };
            gbuffer::add(image, seen, film, from_world)?;
        }
        Ok(())
    }
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
    let mut wanted = Wanted::of(asked, world);
    let mut seen = Vec::new();
    let mut complete = true;
    if wanted.needs_features() {
        match features(world, looks(world, rendered.spp), threads, cancel) {
            Some(all) => seen = all,
            None => {
                complete = false;
                wanted.gbuffer = None;
                wanted.aovs.retain(|name| Aov::from_str(name, false).is_ok_and(|a| !a.needs_features()));
            }
        }
    }
    wanted.add(image, &seen, &rendered.film)?;
    Ok(complete)
}

/// So often a pixel is looked at that has `spp` samples.
fn looks(world: &World, spp: u32) -> u32 {
    world.settings().sampler.spp.max(spp)
}

/// Whether a render with these channels looks at the scene again.
pub(crate) fn looks_again(asked: &[Aov], kind: &FilmKind) -> bool {
    matches!(kind, FilmKind::GBuffer { .. }) || asked.iter().any(|a| a.needs_features())
}

/// What a part of a render with `spp` samples per pixel keeps for the channels that were asked for: nothing where none were; `None` if
/// cancelled.
pub(crate) fn seen(
    asked: &[Aov],
    world: &World,
    (part, spp): (Part, u32),
    threads: usize,
    cancel: &AtomicBool,
) -> Option<Option<Seen>> {
    let wanted = Wanted::of(asked, world);
    if wanted.gbuffer.is_none() && wanted.aovs.is_empty() {
        return Some(None);
    }
    let note = serde_json::to_vec(&wanted).unwrap_or_default();
    if wanted.needs_features() {
        Seen::look(world, part, note, looks(world, spp), threads, cancel).map(Some)
    } else {
        Some(Some(Seen { note, ..Seen::default() }))
    }
}

/// Adds the channels that the parts of a render were asked for, and `more`, which their sums may tell.
pub(crate) fn add_of_parts(image: &mut Image, more: &[Aov], parts: &[&Seen], film: &Film) -> Result<(), Failure> {
    let mut wanted = match parts.first() {
        Some(part) => serde_json::from_slice(&part.note)
            .map_err(|_| Failure::Input("what the parts have seen is of another version of Steradian".into()))?,
        None => Wanted::default(),
    };
    if parts.iter().any(|p| p.note != parts[0].note) {
        return Err(Failure::Input("the parts were rendered with different --aov".into()));
    }
    let lost = |a: &&Aov| !a.is_of_film() && !wanted.aovs.contains(&a.name());
    if let Some(aov) = more.iter().find(lost) {
        let name = aov.name();
        return Err(Failure::Input(format!("--aov {name}: the parts do not have it; render them with --aov {name}")));
    }
    for name in more.iter().map(|a| a.name()) {
        if !wanted.aovs.contains(&name) {
            wanted.aovs.push(name);
        }
    }
    // In the order of a render on one machine.
    let mut list = wanted.list();
    list.sort();
    wanted.aovs = list.into_iter().map(Aov::name).collect();
    let seen = if wanted.needs_features() {
        Seen::join(parts, film.bounds).map_err(|e| Failure::Input(e.to_string()))?
    } else {
        Vec::new()
    };
    wanted.add(image, &seen, film).map_err(|e| Failure::Input(format!("the channels cannot be added: {e}")))
}

fn add_feature(image: &mut Image, aov: Aov, seen: &[Features], materials: &[String]) -> Result<(), Error> {
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
                match materials.get(m as usize).filter(|name| !name.is_empty()) {
                    Some(name) => name.clone(),
                    None => format!("material {}", m + 1),
                }
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
