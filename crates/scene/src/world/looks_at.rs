//! What textures look at: their values may depend on less than all of a [`TextureContext`](super::TextureContext).

use crate::{CheckerMapping, FloatTexture, Handle, Mapping2, Metal, Scattering, Scene, SpectrumTexture, Texture};
use std::ops::BitOr;
use steradian_image::Lookup;

/// What the value of a texture depends on beside coordinates and vertices.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct LooksAt {
    /// Whether there is any point where it may differ from elsewhere.
    pub varies: bool,
    /// On the position or the normal.
    pub place: bool,
    /// On the size of the sample.
    pub footprint: bool,
}

impl LooksAt {
    const NOTHING: Self = Self { varies: false, place: false, footprint: false };
    const COORDINATES: Self = Self { varies: true, ..Self::NOTHING };
    const PLACE: Self = Self { place: true, ..Self::COORDINATES };
    const FOOTPRINT: Self = Self { footprint: true, ..Self::COORDINATES };
}

impl BitOr for LooksAt {
    type Output = Self;
    fn bitor(self, o: Self) -> Self {
        Self { varies: self.varies | o.varies, place: self.place | o.place, footprint: self.footprint | o.footprint }
    }
}

fn mapping(m: &Mapping2) -> LooksAt {
    match m {
        Mapping2::Uv { .. } | Mapping2::Affine { .. } => LooksAt::COORDINATES,
        Mapping2::Spherical { .. } | Mapping2::Cylindrical { .. } | Mapping2::Planar { .. } => LooksAt::PLACE,
    }
}

impl Scene {
    /// What a matte surface or a metal looks at; `None` for all others.
    pub(super) fn scattering_looks_at(&self, scattering: &Scattering) -> Option<LooksAt> {
        let of = |t: &Handle<SpectrumTexture>| self.spectrum_looks_at(*t);
        Some(match scattering {
            Scattering::Diffuse { reflectance } => of(reflectance),
            Scattering::DiffuseTransmission { reflectance, transmittance, .. } => of(reflectance) | of(transmittance),
            Scattering::Conductor { metal, roughness } => {
                let of_metal = match metal {
                    Metal::Ior { eta, k } => of(eta) | of(k),
                    Metal::Reflectance(r) => of(r),
                };
                of_metal | self.float_looks_at(roughness.u) | self.float_looks_at(roughness.v)
            }
            _ => return None,
        })
    }

    fn float_looks_at(&self, t: Handle<FloatTexture>) -> LooksAt {
        self.looks_at(&self.float_textures[t].0, &|t| self.float_looks_at(t))
    }

    fn spectrum_looks_at(&self, t: Handle<SpectrumTexture>) -> LooksAt {
        self.looks_at(&self.spectrum_textures[t].kind, &|t| self.spectrum_looks_at(t))
    }

    fn looks_at<T: Copy, C>(&self, texture: &Texture<T, C>, of: &dyn Fn(T) -> LooksAt) -> LooksAt {
        match texture {
            Texture::Constant(_) => LooksAt::NOTHING,
            Texture::Vertex | Texture::Attribute(_) => LooksAt::COORDINATES,
            Texture::Scale { tex, scale } => of(*tex) | self.float_looks_at(*scale),
            Texture::Product { a, b } => of(*a) | of(*b),
            Texture::Threshold { tex, .. } => of(*tex),
            Texture::Mix { a, b, amount } => of(*a) | of(*b) | self.float_looks_at(*amount),
            Texture::DirectionMix { a, b, .. } => LooksAt::PLACE | of(*a) | of(*b),
            Texture::Bilerp { mapping: m, .. } => mapping(m),
            Texture::Dots { mapping: m, inside, outside } => mapping(m) | of(*inside) | of(*outside),
            Texture::Checkerboard { mapping: m, a, b } => {
                let m = match m {
                    CheckerMapping::Plane(m) => mapping(m),
                    CheckerMapping::Space(_) => LooksAt::PLACE,
                };
                LooksAt::FOOTPRINT | m | of(*a) | of(*b)
            }
            Texture::Image(map) => match self.images[map.image].lookup {
                Lookup::Point | Lookup::Bilinear => mapping(&map.mapping),
                Lookup::Trilinear | Lookup::Ewa { .. } => LooksAt::FOOTPRINT | mapping(&map.mapping),
            },
            Texture::Grid(_) => LooksAt::PLACE,
            Texture::Noise { .. } => LooksAt::FOOTPRINT | LooksAt::PLACE,
        }
    }
}
