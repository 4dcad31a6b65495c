//! Scattering lobes and phase functions in a local frame; no textures, no positions.
//!
//! The shading normal is `+z`, so `cos_theta(w) = w.z`. `wo` points to the viewer, `wi` is the sampled direction; both
//! point away from the surface and have unit length. The contract stands at [`Lobe`]; [`Bsdf`] is the closed set.

mod albedo;
mod bsdf;
mod conductor;
mod dielectric;
mod diffuse;
mod diffuse_transmission;
pub mod direction;
mod fresnel;
mod layered;
mod lobe;
mod microfacet;
mod phase;
mod thin_dielectric;

pub use bsdf::Bsdf;
pub use conductor::Conductor;
pub use dielectric::Dielectric;
pub use diffuse::Diffuse;
pub use diffuse_transmission::DiffuseTransmission;
pub use fresnel::{fresnel_conductor, fresnel_conductor_lanes, fresnel_dielectric, index_of_reflectance};
pub use layered::{CoatedConductor, CoatedDiffuse, Coating, Layered};
pub use lobe::{Lobe, LobeSample, Lobes, Part, TransportMode};
pub use microfacet::TrowbridgeReitz;
pub use phase::{HenyeyGreenstein, PhaseSample};
pub use thin_dielectric::ThinDielectric;
