//! Scattering lobes and phase functions in a local frame; no textures, no positions.
//!
//! The shading normal is `+z`, so `cos_theta(w) = w.z`. `wo` points to the viewer, `wi` is the sampled direction; both
//! point away from the surface and have unit length. The contract stands at [`Lobe`]; [`Bsdf`] is the closed set.
//!
//! ```
//! use steradian_bsdf::{Bsdf, Dielectric, Lobe, TransportMode, TrowbridgeReitz};
//! use steradian_math::Vec3;
//!
//! let glass: Bsdf = Dielectric::new(1.5, TrowbridgeReitz::smooth()).into();
//! let wo = Vec3::new(0.0, 0.0, 1.0);
//! // Four percent are reflected, so this number refracts.
//! let sample = glass.sample(wo, 0.5, [0.5, 0.5], TransportMode::Radiance).unwrap();
//! assert!(sample.flags.is_transmissive() && sample.flags.is_specular());
//! assert_eq!(sample.eta, 1.5);
//! ```

mod albedo;
mod altered;
mod beckmann;
mod bsdf;
mod bumped;
mod conductor;
mod dielectric;
mod diffuse;
mod diffuse_transmission;
mod diffusion;
pub mod direction;
mod fresnel;
mod hair;
mod layered;
mod lobe;
mod measured;
mod metallic_roughness;
mod microfacet;
mod microfacets;
mod phase;
mod phase_mix;
mod plastic;
mod principled;
mod rayleigh;
mod subsurface;
mod tabulated_phase;
mod thin_dielectric;

pub use altered::{Altered, SimpleInterface};
pub use beckmann::Beckmann;
pub use bsdf::Bsdf;
pub use bumped::{Bumped, TiltedLobe};
pub use conductor::{Conductor, RoughConductor};
pub use dielectric::Dielectric;
pub use diffuse::Diffuse;
pub use diffuse_transmission::DiffuseTransmission;
pub use diffusion::DiffusionTable;
pub use fresnel::{fresnel_conductor, fresnel_conductor_lanes, fresnel_dielectric, index_of_reflectance};
pub use hair::Hair;
pub use layered::{CoatedConductor, CoatedDiffuse, Coating, Layered};
pub use lobe::{Lobe, LobeSample, Lobes, Part, TransportMode};
pub use measured::{Measured, MeasuredMaterial, MeasuredTables};
pub use metallic_roughness::{Film, MetallicRoughness, MetallicRoughnessParams, normal_reflectance};
pub use microfacet::TrowbridgeReitz;
pub use microfacets::Microfacets;
pub use phase::{HenyeyGreenstein, PhaseSample};
pub use phase_mix::{MOST_PHASES, PhaseFunction, PhaseMix};
pub use plastic::{Plastic, PlasticInterface, PlasticTable, diffuse_fresnel_reflectance};
pub use principled::{Principled, PrincipledParams};
pub use rayleigh::Rayleigh;
pub use subsurface::{Probe, Subsurface, SubsurfaceExit};
pub use tabulated_phase::TabulatedPhase;
pub use thin_dielectric::{Straight, ThinDielectric};
