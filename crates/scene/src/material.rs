//! Materials: textures that feed a scattering model. `World` evaluates them to a `Bsdf` at a point.

use crate::{FloatTexture, Handle, ImageMap, Mapping2, SpectrumTexture, TextureImage};
use steradian_bsdf::MeasuredMaterial;
use steradian_spectrum::Spectrum;

/// A scalar texture.
pub type FloatInput = Handle<FloatTexture>;
/// A spectral texture.
pub type SpectrumInput = Handle<SpectrumTexture>;

/// Microfacet roughness along the two tangents.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Roughness {
    /// Along dp/du.
    pub u: FloatInput,
    /// Along dp/dv.
    pub v: FloatInput,
    /// Whether the numbers are perceptual (alpha is their square root) or alpha itself.
    pub remap: bool,
}

/// An index of refraction.
#[derive(Clone, Debug)]
pub enum Ior {
    /// The same at every wavelength.
    Constant(f32),
    /// Dispersive.
    Spectrum(Spectrum),
}

/// What a conductor is made of.
#[derive(Clone, Copy, Debug)]
pub enum Metal {
    /// Complex index of refraction.
    Ior {
        /// Real part.
        eta: SpectrumInput,
        /// Absorption.
        k: SpectrumInput,
    },
    /// The colour at normal incidence.
    Reflectance(SpectrumInput),
}

/// A layer of dielectric, perhaps with a scattering medium, above something else.
#[derive(Clone, Debug)]
pub struct Coat {
    /// Roughness of the outer interface.
    pub roughness: Roughness,
    /// Index of refraction.
    pub eta: Ior,
    /// Thickness in units of the medium's mean free path.
    pub thickness: FloatInput,
    /// Single-scattering albedo of the medium.
    pub albedo: SpectrumInput,
    /// Mean cosine of the medium's phase function.
    pub g: FloatInput,
    /// The longest random walk.
    pub max_depth: u32,
    /// Walks averaged by one evaluation.
    pub samples: u32,
}

/// Colour of hair, by whichever quantity is known.
#[derive(Clone, Copy, Debug)]
pub enum HairColor {
    /// Absorption coefficient per fibre radius.
    Absorption(SpectrumInput),
    /// The colour of a full head.
    Reflectance(SpectrumInput),
    /// Concentrations of pigment.
    Melanin {
        /// Brown to black.
        eumelanin: FloatInput,
        /// Red.
        pheomelanin: FloatInput,
    },
}

/// What is inside of something translucent.
#[derive(Clone, Copy, Debug)]
pub enum Translucency {
    /// Coefficients per unit length.
    Coefficients {
        /// Absorption.
        sigma_a: SpectrumInput,
        /// Scattering.
        sigma_s: SpectrumInput,
    },
    /// How it looks.
    Reflectance {
        /// The colour of a thick piece.
        reflectance: SpectrumInput,
        /// Mean free path, a length.
        mean_free_path: SpectrumInput,
    },
}

/// The scattering model of a surface.
#[derive(Clone, Debug)]
pub enum Scattering {
    /// Lambert's law.
    Diffuse {
        /// Albedo.
        reflectance: SpectrumInput,
    },
    /// A metal.
    Conductor {
        /// Fresnel data.
        metal: Metal,
        /// Microfacets.
        roughness: Roughness,
    },
    /// Glass, water.
    Dielectric {
        /// Index of refraction inside relative to outside.
        eta: Ior,
        /// Microfacets.
        roughness: Roughness,
    },
    /// A thin slab of glass: interreflection folded in, no bending.
    ThinDielectric {
        /// Index of refraction.
        eta: Ior,
    },
    /// Lambertian on both sides.
    DiffuseTransmission {
        /// Reflected fraction.
        reflectance: SpectrumInput,
        /// Transmitted fraction.
        transmittance: SpectrumInput,
        /// Factor of both.
        scale: f32,
    },
    /// A dielectric coat over a diffuse base.
    CoatedDiffuse {
        /// Albedo of the base.
        reflectance: SpectrumInput,
        /// The coat.
        coat: Coat,
    },
    /// A dielectric coat over metal.
    CoatedConductor {
        /// The base.
        metal: Metal,
        /// Microfacets of the base.
        roughness: Roughness,
        /// The coat.
        coat: Coat,
    },
    /// A fibre.
    Hair {
        /// Absorption inside.
        color: HairColor,
        /// Index of refraction inside.
        eta: FloatInput,
        /// Roughness along the fibre.
        beta_m: FloatInput,
        /// Roughness around the fibre.
        beta_n: FloatInput,
        /// Tilt of the scales in degrees.
        alpha: FloatInput,
    },
    /// Tabulated reflectance.
    Measured(Handle<MeasuredMaterial>),
    /// A dielectric interface with something translucent below it.
    Subsurface {
        /// What is inside.
        inside: Translucency,
        /// Factor of the coefficients, or of the mean free path.
        scale: f32,
        /// Mean cosine of the phase function inside.
        g: f32,
        /// Index of refraction inside relative to outside.
        eta: f32,
        /// Microfacets of the interface.
        roughness: Roughness,
    },
    /// One of two materials, chosen by a hash of place and direction; the second with probability `amount`.
    Mix {
        /// The candidates.
        materials: [Handle<Material>; 2],
        /// Probability of the second.
        amount: FloatInput,
    },
    /// One material on the side that the shading normal points to, another on the other side.
    Sides {
        /// Where the normal points to.
        front: Handle<Material>,
        /// Behind.
        back: Handle<Material>,
    },
    /// A conductor or dielectric with other statistics of its microfacets, and with factors that no physical interface has.
    Altered {
        /// The material: a conductor, a dielectric or a thin dielectric.
        interface: Handle<Material>,
        /// How the slopes of rough ones are distributed.
        slopes: Slopes,
        /// Factor of what is reflected.
        reflection: Option<SpectrumInput>,
        /// Factor of what is transmitted.
        transmission: Option<SpectrumInput>,
    },
    /// Mitsuba's plastic: a diffuse base dimmed by what a dielectric interface lets through.
    Plastic(PlasticInputs),
    /// Disney's principled surface, as Mitsuba states it.
    Principled(Box<PrincipledInputs>),
    /// The layered surface of glTF 2.0.
    MetallicRoughness(Box<MetallicRoughnessInputs>),
    /// No scattering: the boundary between two media.
    Interface,
}

/// How the slopes of microfacets are distributed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Slopes {
    /// Trowbridge-Reitz, masking and shadowing independent of each other.
    TrowbridgeReitz,
    /// Beckmann, masking and shadowing independent of each other.
    Beckmann,
}

/// The textures of a principled surface; see [`steradian_bsdf::PrincipledParams`].
#[derive(Clone, Debug)]
pub struct PrincipledInputs {
    /// Colour of the base.
    pub base: SpectrumInput,
    /// Perceptual roughness.
    pub roughness: FloatInput,
    /// How far highlights are stretched.
    pub anisotropic: FloatInput,
    /// Share of metal.
    pub metallic: FloatInput,
    /// Share of glass.
    pub transmission: FloatInput,
    /// Index of refraction.
    pub eta: f32,
    /// How far the dielectric's reflection is tinted.
    pub specular_tint: FloatInput,
    /// Strength of the coat, and its gloss.
    pub coat: [FloatInput; 2],
    /// Strength of the sheen, and how far it is tinted.
    pub sheen: [FloatInput; 2],
    /// Share of flattened diffuse reflection.
    pub flatness: FloatInput,
    /// Of thin surfaces: from 0 to 2, twice the share of diffuse light that goes to the other side.
    pub thin: Option<FloatInput>,
}

/// What plastic is made of.
#[derive(Clone, Copy, Debug)]
pub struct PlasticInputs {
    /// Index of refraction over that of the outside.
    pub eta: f32,
    /// Statistics and alpha of a rough interface; a smooth one has none.
    pub roughness: Option<(Slopes, f32)>,
    /// Albedo of the base.
    pub reflectance: SpectrumInput,
    /// Factor of the mirrored light.
    pub specular: Option<SpectrumInput>,
    /// Whether light that comes back to the base is coloured again each time.
    pub nonlinear: bool,
}

/// The textures of a metallic-roughness surface; see [`steradian_bsdf::MetallicRoughnessParams`].
#[derive(Clone, Debug)]
pub struct MetallicRoughnessInputs {
    /// Albedo, reflectance of metal, tint of glass.
    pub base: SpectrumInput,
    /// Share of metal.
    pub metallic: FloatInput,
    /// Perceptual roughness; alpha is its square.
    pub roughness: FloatInput,
    /// Index of refraction.
    pub eta: Ior,
    /// Strength of the dielectric's reflection.
    pub specular: Option<FloatInput>,
    /// Its colour, a factor of the reflectance at normal incidence.
    pub specular_color: Option<SpectrumInput>,
    /// Reflectance of the dielectric at normal incidence, where it does not follow from the index.
    pub f0: Option<SpectrumInput>,
    /// Share that transmits.
    pub transmission: Option<FloatInput>,
    /// Whether what is transmitted is not bent.
    pub thin: bool,
    /// Share that scatters to the other side, and its colour.
    pub diffuse_transmission: Option<(FloatInput, SpectrumInput)>,
    /// Share that is coated, and the coat's perceptual roughness.
    pub coat: Option<[FloatInput; 2]>,
    /// Colour of the sheen, and its perceptual roughness.
    pub sheen: Option<(SpectrumInput, FloatInput)>,
    /// A film on the surface.
    pub film: Option<FilmInputs>,
    /// Roughness that depends on the direction.
    pub anisotropy: Option<AnisotropyInputs>,
}

impl MetallicRoughnessInputs {
    /// A surface without extensions: metal, or a base under a dielectric of index 1.5.
    pub const fn plain(base: SpectrumInput, metallic: FloatInput, roughness: FloatInput) -> Self {
        Self {
            base,
            metallic,
            roughness,
            eta: Ior::Constant(1.5),
            specular: None,
            specular_color: None,
            f0: None,
            transmission: None,
            thin: true,
            diffuse_transmission: None,
            coat: None,
            sheen: None,
            film: None,
            anisotropy: None,
        }
    }
}

/// A thin film: what share it covers, its index, its thickness in nanometres.
#[derive(Clone, Copy, Debug)]
pub struct FilmInputs {
    /// Share.
    pub factor: FloatInput,
    /// Index of refraction.
    pub eta: f32,
    /// Thickness in nanometres.
    pub thickness: FloatInput,
}

/// Roughness stretched along one direction of the tangent plane.
#[derive(Clone, Debug)]
pub struct AnisotropyInputs {
    /// From 0, round, to 1.
    pub strength: FloatInput,
    /// Counterclockwise from the tangent, in radians.
    pub rotation: f32,
    /// Red and green as a direction from -1 to 1, turned further by `rotation`.
    pub direction: Option<ImageMap>,
    /// Whether the bitangent points the other way: on mirrored texture coordinates.
    pub mirrored: bool,
}

/// A normal map in the tangent frame.
#[derive(Clone, Debug)]
pub struct NormalMap {
    /// The picture: x, y, z from -1 to 1 as red, green and blue from 0 to 1.
    pub image: Handle<TextureImage>,
    /// Where it lies.
    pub mapping: Mapping2,
    /// Factor of x and y.
    pub scale: f32,
    /// Whether y points the other way: on mirrored texture coordinates.
    pub mirrored: bool,
}

impl NormalMap {
    /// A picture over the surface's own coordinates.
    pub fn new(image: Handle<TextureImage>) -> Self {
        Self { image, mapping: Mapping2::default(), scale: 1.0, mirrored: false }
    }
}

/// What tilting a normal does besides, as Mitsuba has it: no light comes from below the surface as it was.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tilt {
    /// Whether the bumps shadow each other.
    pub shadowing: bool,
    /// Whether normals that are tilted away from the viewer are mirrored about the normal as it was.
    pub mirrors: bool,
}

/// A surface's scattering model with what perturbs its shading frame.
#[derive(Clone, Debug)]
pub struct Material {
    /// Name, for messages; may be empty.
    pub name: String,
    /// The model.
    pub scattering: Scattering,
    /// Bump map: height along the normal.
    pub displacement: Option<FloatInput>,
    /// Normal map in the tangent frame; wins over `displacement`.
    pub normal_map: Option<NormalMap>,
    /// What either does besides moving the frame; nothing in most languages of scenes.
    pub tilt: Option<Tilt>,
}
