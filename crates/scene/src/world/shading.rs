//! Materials at a point: textures evaluated, bump and normal maps applied, a lobe in its frame.

use super::World;
use super::surface::Surface;
use super::texture::{MeshPoint, TextureContext};
use crate::material::{
    Coat, HairColor, Ior, Material, Metal, MetallicRoughnessInputs, NormalMap, Roughness, Scattering, Slopes,
    SpectrumInput,
};
use crate::{FloatTexture, Handle};
use steradian_bsdf::{
    Altered, Beckmann, Bsdf, Bumped, Coating, Conductor, Dielectric, Diffuse, DiffuseTransmission, Film, Hair, Layered,
    Measured, MetallicRoughness, MetallicRoughnessParams, Microfacets, SimpleInterface, ThinDielectric,
    TrowbridgeReitz, index_of_reflectance, normal_reflectance,
};
use steradian_math::{Frame, Ray, RayDifferential, Vec2, Vec3, lerp, sin_cos, sqr};
use steradian_sampling::rng::{hash_combine, hash_floats, unit_f32};
use steradian_spectrum::{ColorSpace, Lanes, Wavelengths};

/// A lobe and the frame it is written in.
#[derive(Clone, Copy, Debug)]
pub struct Shading<'w> {
    /// Shading frame in world space: z is the shading normal, x lies along dp/du.
    pub frame: Frame,
    /// The lobe.
    pub bsdf: Bsdf<'w>,
}

impl World {
    /// The material at a surface point; `None` where nothing scatters.
    ///
    /// Works out the surface's footprint, if any texture needs it, and moves its shading geometry as bump and normal
    /// maps demand. Dispersive materials leave only the hero wavelength alive.
    #[inline]
    pub fn shading(
        &self,
        surface: &mut Surface,
        ray: &Ray,
        differential: Option<&RayDifferential>,
        wavelengths: &mut Wavelengths,
    ) -> Option<Shading<'_>> {
        self.measure(surface, ray, differential);
        let mut context = self.texture_context(surface);
        let material = &self.scene.materials[self.unmixed(self.material(surface), surface, &context)];
        let up = surface.shading.n;
        if material.displacement.is_some() || material.normal_map.is_some() {
            self.perturb(material, surface, &context);
            context.n = surface.n;
        }
        let bsdf = self.bsdf(material, &context, wavelengths)?;
        let frame = Frame::from_xz(surface.shading.dpdu, surface.shading.n);
        let bsdf = match material.tilt {
            Some(t) => Bumped::new(bsdf, frame.to_local(up.to_vec()), t.shadowing).map_or(bsdf, Bsdf::from),
            None => bsdf,
        };
        let frame = self.turned(material, frame, &context);
        let bsdf = if self.scene.settings.force_diffuse {
            Diffuse::new(bsdf.albedo(frame.to_local(surface.wo))).into()
        } else {
            bsdf
        };
        Some(Shading { frame, bsdf })
    }

    /// The material that mixes come down to at this point.
    #[inline]
    pub(super) fn unmixed(
        &self,
        mut material: Handle<Material>,
        surface: &Surface,
        context: &TextureContext,
    ) -> Handle<Material> {
        loop {
            material = match &self.scene.materials[material].scattering {
                Scattering::Mix { materials, amount } => self.choose(*materials, *amount, surface, context),
                Scattering::Sides { front, back } => {
                    if surface.shading.n.to_vec().dot(surface.wo) > 0.0 {
                        *front
                    } else {
                        *back
                    }
                }
                _ => return material,
            };
        }
    }

    #[inline]
    pub(super) fn texture_context(&self, surface: &Surface) -> TextureContext {
        let f = &surface.footprint;
        TextureContext {
            p: surface.p,
            dpdx: f.dpdx,
            dpdy: f.dpdy,
            n: surface.n,
            uv: surface.uv,
            duv_dx: f.duv_dx,
            duv_dy: f.duv_dy,
            on_mesh: self.mesh_point(surface),
        }
    }

    /// Where a surface point lies on a mesh of triangles, if it does.
    #[inline]
    pub(super) fn mesh_point(&self, surface: &Surface) -> Option<MeshPoint> {
        let record = &self.groups[surface.group as usize].primitives[surface.primitive as usize];
        record.is_mesh.then_some(MeshPoint { mesh: record.mesh, face: surface.element, b: surface.coordinates })
    }

    /// The member of a mix at this point: a hash of place and direction against the amount.
    fn choose(
        &self,
        materials: [Handle<Material>; 2],
        amount: Handle<FloatTexture>,
        surface: &Surface,
        context: &TextureContext,
    ) -> Handle<Material> {
        let amount = self.float_texture(amount, context);
        if amount <= 0.0 {
            return materials[0];
        }
        if amount >= 1.0 {
            return materials[1];
        }
        let (p, w) = (surface.p, surface.wo);
        let names = (materials[0].index() as u64) << 32 | materials[1].index() as u64;
        let u = unit_f32((hash_combine(hash_floats(&[p.x, p.y, p.z, w.x, w.y, w.z]), names) >> 32) as u32);
        materials[usize::from(u >= 1.0 - amount)]
    }

    /// Moves the shading frame by a normal map, or by the slope of a bump map (Blinn 1978).
    fn perturb(&self, material: &Material, surface: &mut Surface, context: &TextureContext) {
        let (dpdu, dpdv) = match (&material.normal_map, material.displacement) {
            (Some(map), _) => self.normal_mapped(map, surface, context),
            (None, Some(height)) if material.tilt.is_some() => self.raised(height, surface, context),
            (None, Some(height)) => self.bumped(height, surface, context),
            (None, None) => return,
        };
        let Some(n) = dpdu.cross(dpdv).try_normalize() else { return };
        let wo = surface.wo;
        // The side that counts as outside stays what it was.
        let n = n.to_normal().face_forward(surface.geometry.n).to_vec();
        let s = &mut surface.geometry.shading;
        let up = s.n.to_vec();
        if material.tilt.is_some_and(|t| t.mirrors) && wo.dot(up) * wo.dot(n) <= 0.0 {
            let n = up * (2.0 * n.dot(up)) - n;
            s.dpdu -= n * n.dot(s.dpdu);
            s.dpdv -= n * n.dot(s.dpdv);
            s.n = n.to_normal();
            return;
        }
        s.n = n.to_normal();
        s.dpdu = dpdu;
        s.dpdv = dpdv;
    }

    fn normal_mapped(&self, map: &NormalMap, surface: &Surface, context: &TextureContext) -> (Vec3, Vec3) {
        let s = &surface.shading;
        let uv = self.coordinates(&map.mapping, context);
        let zero = Vec2::default();
        let Some(pyramid) = &self.pyramids[map.image.index()] else { return (s.dpdu, s.dpdv) };
        let rgb = pyramid.lookup3(uv, zero, zero, steradian_image::Lookup::Bilinear);
        let [x, y, z] = rgb.map(|v| 2.0 * v - 1.0);
        let local = Vec3::new(x * map.scale, y * if map.mirrored { -map.scale } else { map.scale }, z);
        let frame = Frame::from_xz(s.dpdu, s.n);
        let Some(n) = frame.from_local(local).try_normalize() else { return (s.dpdu, s.dpdv) };
        let (u_length, v_length) = (s.dpdu.length(), s.dpdv.length());
        let tangent = s.dpdu - n * n.dot(s.dpdu);
        let Some(tangent) = tangent.try_normalize() else { return (s.dpdu, s.dpdv) };
        (tangent * u_length, n.cross(tangent) * v_length)
    }

    /// The tangents of the plane that the slope of a height at this very point makes, as Mitsuba has it: what the height itself does to them is left out.
    fn raised(&self, height: Handle<FloatTexture>, surface: &Surface, context: &TextureContext) -> (Vec3, Vec3) {
        // Small beside texels, and great beside rounding.
        const STEP: f32 = 1.0 / 8192.0;
        let at = |duv: Vec2| self.float_texture(height, &TextureContext { uv: context.uv + duv, ..*context });
        let slope = |duv: Vec2| (at(duv) - at(Vec2::default() - duv)) / (2.0 * STEP);
        let (u, v) = (slope(Vec2::new(STEP, 0.0)), slope(Vec2::new(0.0, STEP)));
        // Of the surface itself: the shading frame of a mesh has not the length of both.
        let (dpdu, dpdv, n) = (surface.dpdu, surface.dpdv, surface.shading.n.to_vec());
        (dpdu + n * (u - n.dot(dpdu)), dpdv + n * (v - n.dot(dpdv)))
    }

    fn bumped(&self, height: Handle<FloatTexture>, surface: &Surface, context: &TextureContext) -> (Vec3, Vec3) {
        let (s, f) = (&surface.shading, &surface.footprint);
        // Half a sample's footprint; where that is unknown, something small.
        let step = |a: f32, b: f32| {
            let d = 0.5 * (a.abs() + b.abs());
            if d == 0.0 { 0.0005 } else { d }
        };
        let (du, dv) = (step(f.duv_dx.x, f.duv_dy.x), step(f.duv_dx.y, f.duv_dy.y));
        let here = self.float_texture(height, context);
        let shifted = |dp: Vec3, duv: Vec2| {
            self.float_texture(height, &TextureContext { p: context.p + dp, uv: context.uv + duv, ..*context })
        };
        let u = (shifted(s.dpdu * du, Vec2::new(du, 0.0)) - here) / du;
        let v = (shifted(s.dpdv * dv, Vec2::new(0.0, dv)) - here) / dv;
        let n = s.n.to_vec();
        (s.dpdu + n * u + s.dndu.to_vec() * here, s.dpdv + n * v + s.dndv.to_vec() * here)
    }

    fn bsdf(&self, material: &Material, c: &TextureContext, w: &mut Wavelengths) -> Option<Bsdf<'_>> {
        Some(match &material.scattering {
            Scattering::Diffuse { reflectance } => {
                Diffuse::new(self.spectrum_texture(*reflectance, c, w).clamp(0.0, 1.0)).into()
            }
            Scattering::Conductor { metal, roughness } => {
                let (eta, k) = self.metal(metal, c, w);
                Conductor::new(self.microfacets(roughness, c), eta, k).into()
            }
            Scattering::Dielectric { eta, roughness } => {
                Dielectric::new(index(eta, w), self.microfacets(roughness, c)).into()
            }
            Scattering::ThinDielectric { eta } => ThinDielectric::new(index(eta, w)).into(),
            Scattering::DiffuseTransmission { reflectance, transmittance, scale } => {
                let of = |t| (self.spectrum_texture(t, c, w) * *scale).clamp(0.0, 1.0);
                DiffuseTransmission::new(of(*reflectance), of(*transmittance)).into()
            }
            Scattering::CoatedDiffuse { reflectance, coat } => {
                let base = Diffuse::new(self.spectrum_texture(*reflectance, c, w).clamp(0.0, 1.0));
                let (interface, coating) = self.coat(coat, c, w);
                Bsdf::CoatedDiffuse(Layered::new(interface, base, coating))
            }
            Scattering::CoatedConductor { metal, roughness, coat } => {
                let (interface, coating) = self.coat(coat, c, w);
                let (eta, k) = self.metal(metal, c, w);
                // Indices relative to the coat.
                let relative = 1.0 / interface.eta;
                let base = Conductor::new(self.microfacets(roughness, c), eta * relative, k * relative);
                Bsdf::CoatedConductor(Layered::new(interface, base, coating))
            }
            Scattering::Hair { color, eta, beta_m, beta_n, alpha } => {
                let of = |t| self.float_texture(t, c);
                let around = of(*beta_n);
                let sigma_a = self.hair_absorption(color, around, c, w);
                // The curve's second coordinate runs across it.
                let h = 2.0 * c.uv.y - 1.0;
                Hair::new(h, of(*eta), sigma_a, of(*beta_m), around, of(*alpha)).into()
            }
            Scattering::Measured(tables) => Measured::new(&self.scene.measured[*tables], w).into(),
            Scattering::Subsurface { eta, roughness, .. } => {
                Dielectric::new(*eta, self.microfacets(roughness, c)).into()
            }
            Scattering::MetallicRoughness(inputs) => self.metallic_roughness(inputs, c, w),
            Scattering::Principled(inputs) => self.principled(inputs, c, w),
            Scattering::Plastic(inputs) => self.plastic(inputs, c, w),
            Scattering::Altered { interface, slopes, reflection, transmission } => {
                let factor =
                    |t: Option<SpectrumInput>| t.map_or(Lanes::ONE, |t| self.spectrum_texture(t, c, w).clamp_zero());
                let (reflection, transmission) = (factor(*reflection), factor(*transmission));
                let interface = match self.bsdf(&self.scene.materials[*interface], c, w)? {
                    Bsdf::Conductor(mut lobe) => {
                        lobe.distribution = with_slopes(lobe.distribution, *slopes);
                        SimpleInterface::Conductor(lobe)
                    }
                    Bsdf::Dielectric(mut lobe) => {
                        lobe.distribution = with_slopes(lobe.distribution, *slopes);
                        SimpleInterface::Dielectric(lobe)
                    }
                    Bsdf::ThinDielectric(lobe) => SimpleInterface::ThinDielectric(lobe),
                    other => return Some(other),
                };
                Altered { interface, reflection, transmission }.into()
            }
            Scattering::Mix { .. } | Scattering::Sides { .. } | Scattering::Interface => return None,
        })
    }

    fn metallic_roughness(&self, m: &MetallicRoughnessInputs, c: &TextureContext, w: &mut Wavelengths) -> Bsdf<'_> {
        let of = |t| self.float_texture(t, c);
        let amount = |t: Option<_>, absent: f32| t.map_or(absent, of);
        let eta = index(&m.eta, w);
        let transmission = amount(m.transmission, 0.0);
        let color = |t| self.spectrum_texture(t, c, w).clamp(0.0, 1.0);
        let specular = amount(m.specular, 1.0).clamp(0.0, 1.0);
        let f0 = match m.f0 {
            Some(f0) => color(f0),
            None => {
                let tint = m.specular_color.map_or(Lanes::ONE, |t| self.spectrum_texture(t, c, w));
                (tint * normal_reflectance(eta)).clamp(0.0, 1.0) * specular
            }
        };
        let square = |r: f32| sqr(r.clamp(0.0, 1.0));
        let alpha = square(of(m.roughness));
        let stretch = m.anisotropy.as_ref().map_or(0.0, |a| sqr(of(a.strength).clamp(0.0, 1.0)));
        let (diffuse_transmission, back) = match m.diffuse_transmission {
            Some((share, tint)) => (of(share), color(tint)),
            None => (0.0, Lanes::ONE),
        };
        let (sheen, sheen_alpha) = match m.sheen {
            Some((tint, roughness)) => (color(tint), square(of(roughness))),
            None => (Lanes::ZERO, 0.5),
        };
        let film = m.film.map(|f| {
            // In RGB a lane is a band around the eye's most sensitive wavelengths.
            let (lambda, width) = if w.is_rgb() { ([610.0, 550.0, 465.0, 550.0], 35.0) } else { (w.lambda(), 0.0) };
            Film { factor: of(f.factor), eta: f.eta, thickness: of(f.thickness), lambda: Lanes(lambda), width }
        });
        MetallicRoughness::new(MetallicRoughnessParams {
            base: color(m.base),
            metallic: of(m.metallic),
            alpha: [lerp(stretch, alpha, 1.0), alpha],
            f0,
            f90: specular,
            eta,
            transmission,
            thin: m.thin,
            diffuse_transmission,
            diffuse_transmission_color: back,
            coat: m.coat.map_or([0.0; 2], |[share, roughness]| [of(share), square(of(roughness))]),
            sheen,
            sheen_alpha,
            film,
        })
        .into()
    }

    /// The frame turned about the normal as a stretched roughness lies.
    fn turned(&self, material: &Material, frame: Frame, c: &TextureContext) -> Frame {
        let Scattering::MetallicRoughness(m) = &material.scattering else { return frame };
        let Some(a) = &m.anisotropy else { return frame };
        let (mut sin, mut cos) = sin_cos(a.rotation);
        if let Some(map) = &a.direction {
            let [x, y, _] = self.texel(map, c).map(|v| 2.0 * v - 1.0);
            let l = (x * x + y * y).sqrt();
            if l > 1e-4 {
                (cos, sin) = ((cos * x - sin * y) / l, (sin * x + cos * y) / l);
            }
        }
        if a.mirrored {
            sin = -sin;
        }
        Frame { x: frame.x * cos + frame.y * sin, y: frame.y * cos - frame.x * sin, z: frame.z }
    }

    fn hair_absorption(&self, color: &HairColor, beta_n: f32, c: &TextureContext, w: &Wavelengths) -> Lanes {
        match color {
            HairColor::Absorption(sigma_a) => self.spectrum_texture(*sigma_a, c, w),
            HairColor::Reflectance(color) => {
                Hair::absorption_of_reflectance(self.spectrum_texture(*color, c, w), beta_n)
            }
            HairColor::Melanin { eumelanin, pheomelanin } => {
                let rgb =
                    Hair::absorption_of_melanin(self.float_texture(*eumelanin, c), self.float_texture(*pheomelanin, c));
                ColorSpace::Srgb.unbounded_lanes(rgb, w)
            }
        }
    }

    pub(super) fn metal(&self, metal: &Metal, c: &TextureContext, w: &Wavelengths) -> (Lanes, Lanes) {
        match metal {
            Metal::Ior { eta, k } => (self.spectrum_texture(*eta, c, w), self.spectrum_texture(*k, c, w)),
            // A perfect mirror would need an infinite index.
            Metal::Reflectance(r) => index_of_reflectance(self.spectrum_texture(*r, c, w).clamp(0.0, 0.9999)),
        }
    }

    pub(super) fn microfacets(&self, roughness: &Roughness, c: &TextureContext) -> TrowbridgeReitz {
        let u = self.float_texture(roughness.u, c);
        let v = if roughness.u == roughness.v { u } else { self.float_texture(roughness.v, c) };
        let alpha = |r: f32| if roughness.remap { TrowbridgeReitz::roughness_to_alpha(r) } else { r };
        TrowbridgeReitz::new(alpha(u), alpha(v))
    }

    fn coat(&self, coat: &Coat, c: &TextureContext, w: &mut Wavelengths) -> (Dielectric, Coating) {
        let interface = Dielectric::new(index(&coat.eta, w), self.microfacets(&coat.roughness, c));
        let coating = Coating {
            thickness: self.float_texture(coat.thickness, c),
            albedo: self.spectrum_texture(coat.albedo, c, w).clamp(0.0, 1.0),
            g: self.float_texture(coat.g, c).clamp(-0.99, 0.99),
            max_depth: coat.max_depth,
            walks: coat.samples,
            seed: self.scene.settings.sampler.seed,
            pbrt_values: self.scene.settings.layered_as_pbrt,
        };
        (interface, coating)
    }

    /// The name of the surface's material, or its place in the scene if it has none.
    pub fn material_name(&self, surface: &Surface) -> String {
        let handle = self.groups[surface.group as usize].primitives[surface.primitive as usize].material;
        let name = &self.scene.materials[handle].name;
        if name.is_empty() { format!("{handle:?}") } else { name.clone() }
    }

    /// White in the four lanes: a constant radiance of luminance one.
    pub fn white(&self, w: &Wavelengths) -> Lanes {
        let space = self.scene.settings.film.color_space;
        space.illuminant_lanes([1.0; 3], w) * (1.0 / space.photometric())
    }
}

/// The same roughness with other statistics. What is smooth stays so.
pub(super) fn with_slopes(d: Microfacets, slopes: Slopes) -> Microfacets {
    if d.is_smooth() {
        return d;
    }
    let [x, y] = d.alpha();
    match slopes {
        Slopes::TrowbridgeReitz => Microfacets::SeparableTrowbridgeReitz(TrowbridgeReitz::new(x, y)),
        Slopes::Beckmann => Microfacets::Beckmann(Beckmann::new(x, y)),
    }
}

/// The index at the hero wavelength; one that changes with wavelength ends the others.
fn index(eta: &Ior, w: &mut Wavelengths) -> f32 {
    let value = match eta {
        Ior::Constant(v) => *v,
        Ior::Spectrum(s) => {
            let value = s.eval(w).0[w.hero_lane()];
            w.terminate_secondary();
            value
        }
    };
    // Outside the range of its table a spectrum is zero; no index is.
    if value > 0.0 { value } else { 1.0 }
}
