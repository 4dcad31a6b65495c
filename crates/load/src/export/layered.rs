//! Materials that pbrt has not, by those that it has.
//!
//! A layered surface of metal, glass and paint becomes a `mix` of `conductor`, `dielectric` and `coateddiffuse`, which is what it is,
//! but for two things. pbrt's paint darkens and saturates as light goes back and forth below its coat, where glTF states the colour
//! that comes out: the reflectance below is solved for it. And highlights of the parts are chosen instead of added.

use super::Writer;
use super::bake::{Flat, join};
use super::materials::ior;
use super::text::number;
use steradian_bsdf::diffuse_fresnel_reflectance;
use steradian_math::sqr;
use steradian_scene::{
    Handle, Ior, Material, MetallicRoughnessInputs, PlasticInputs, PrincipledInputs, Scattering, SpectrumInput, Texture,
};

/// A surface in terms of the parts that pbrt has.
struct Layers {
    /// The colour; none where it is a texture that cannot be worked out.
    base: Option<Flat>,
    /// That texture.
    texture: SpectrumInput,
    metallic: Flat,
    /// Roughness as alpha, along the two tangents.
    alpha: [Flat; 2],
    eta: Ior,
    /// The index of the interface above the paint; at most one is none.
    paint_eta: f32,
    transmission: Flat,
    /// Whether what is transmitted is not bent.
    thin: bool,
    /// Share that scatters to the other side, and its colour.
    translucent: Option<(Flat, Flat)>,
    /// The coat's alpha, where it covers more than half.
    coat: Option<Flat>,
}

impl Writer<'_> {
    /// What stands for a material that pbrt has not.
    pub(super) fn nearest(&mut self, name: &str, s: &Scattering, relief: &str) -> String {
        match s {
            Scattering::Sides { front, back } => {
                if front != back && !self.is_black(*back) {
                    self.note("surfaces of two materials have the front's on both sides");
                } else if front != back {
                    self.note("backs that are black scatter as their fronts do");
                }
                self.stated(name, *front, relief)
            }
            Scattering::Altered { interface, reflection, transmission, .. } => {
                let scene = self.scene;
                if [reflection, transmission].into_iter().flatten().any(|t| !self.is_one(*t)) {
                    self.note("factors of reflection and transmission are left out");
                }
                let smooth = match &scene.materials[*interface].scattering {
                    Scattering::Conductor { roughness, .. } | Scattering::Dielectric { roughness, .. } => {
                        self.is_smooth(roughness)
                    }
                    _ => true,
                };
                if !smooth {
                    self.note("microfacets of Mitsuba become pbrt's, of the same roughness");
                }
                self.stated(name, *interface, relief)
            }
            Scattering::Plastic(p) => self.plastic(name, p) + relief,
            Scattering::Principled(p) => {
                let layers = self.principled(p);
                self.layered(name, &layers, relief)
            }
            Scattering::MetallicRoughness(m) => {
                let layers = self.metallic_roughness(m);
                self.layered(name, &layers, relief)
            }
            _ => {
                self.note("tables of measured materials are not written: grey stands for them");
                format!("\"diffuse\"{relief}")
            }
        }
    }

    fn is_black(&self, m: Handle<Material>) -> bool {
        match self.scene.materials[m].scattering {
            Scattering::Diffuse { reflectance } => match &self.scene.spectrum_textures[reflectance].kind {
                Texture::Constant(s) => s.is_black(),
                _ => false,
            },
            _ => false,
        }
    }

    fn is_one(&self, t: SpectrumInput) -> bool {
        match &self.scene.spectrum_textures[t].kind {
            Texture::Constant(s) => s.rgb().iter().all(|v| (v - 1.0).abs() < 1e-3),
            _ => false,
        }
    }

    fn plastic(&mut self, name: &str, p: &PlasticInputs) -> String {
        self.note("plastic of Mitsuba becomes `coateddiffuse` of the same colour");
        if p.specular.is_some_and(|t| !self.is_one(t)) {
            self.note("factors of reflection and transmission are left out");
        }
        let alpha = p.roughness.map_or(0.0, |r| r.1);
        let below = self
            .flat_color(p.reflectance)
            .map(|f| if p.nonlinear { f } else { beneath(f, p.eta, most_reflected(alpha)) });
        let base = self.color_param(name, below.as_ref(), p.reflectance);
        let (eta, alpha) = (number(p.eta), number(alpha));
        format!(
            "\"coateddiffuse\" {base} \"float eta\" {eta} \"float roughness\" {alpha} \"bool remaproughness\" false"
        )
    }

    fn color_param(&mut self, name: &str, value: Option<&Flat>, texture: SpectrumInput) -> String {
        match value {
            Some(flat) => self.flat_param("reflectance", &format!("{name}-base"), flat, true),
            None => self.spectrum_param("reflectance", texture),
        }
    }

    fn metallic_roughness(&mut self, m: &MetallicRoughnessInputs) -> Layers {
        self.note("layered surfaces of glTF become mixes of `conductor`, `dielectric` and `coateddiffuse`");
        let eta = match &m.eta {
            Ior::Constant(v) => *v,
            Ior::Spectrum(s) => s.eval_at(587.6),
        };
        let mut share = |t: Option<_>, absent: f32| {
            let flat = t.map(|t| self.flat_float(t));
            flat.unwrap_or(Some(Flat::Even([absent; 3]))).unwrap_or(Flat::Even([absent; 3]))
        };
        let (metallic, rough) = (share(Some(m.metallic), 0.0), share(Some(m.roughness), 0.5).each(|r| r * r));
        let (transmission, specular) = (share(m.transmission, 0.0), share(m.specular, 1.0));
        let coat = m.coat.map(|[factor, rough]| (share(Some(factor), 1.0), share(Some(rough), 0.0)));
        let stretch = m.anisotropy.as_ref().map(|a| (share(Some(a.strength), 0.0), a.rotation, a.direction.is_some()));
        let tint = m.specular_color.and_then(|t| self.flat_color(t)).and_then(|f| f.even()).unwrap_or([1.0; 3]);
        let f0 = m.f0.and_then(|t| self.flat_color(t));
        if m.sheen.is_some() || m.film.is_some() {
            self.note("sheen and thin films are left out");
        }
        if tint.iter().any(|v| *v != tint[0]) || f0.as_ref().is_some_and(|f| f.even().is_none()) {
            self.note("dielectrics reflect without a colour of their own");
        }
        let grey = |v: [f32; 3]| (v[0] + v[1] + v[2]) / 3.0;
        let normal = match &f0 {
            Some(f) => f.even().map_or(0.04, grey),
            None => {
                let r = (eta - 1.0) / (eta + 1.0);
                (r * r * specular.number().unwrap_or(1.0) * grey(tint)).clamp(0.0, 1.0)
            }
        };
        let root = normal.clamp(0.0, 0.9).sqrt();
        let alpha = match &stretch {
            Some((strength, rotation, directed)) => {
                if *rotation != 0.0 || *directed {
                    self.note("anisotropic highlights lie along the texture coordinates");
                }
                let along = join(&rough, strength, |a, s| a + (1.0 - a) * s * s);
                [along.unwrap_or_else(|| rough.clone()), rough]
            }
            None => [rough.clone(), rough],
        };
        let coat = coat.and_then(|(factor, rough)| {
            if factor.number() != Some(1.0) {
                self.note("coats cover a surface wholly or not at all");
            }
            (factor.number().unwrap_or(1.0) > 0.5).then(|| rough.each(|r| r * r))
        });
        let translucent = m.diffuse_transmission.and_then(|(share, color)| {
            self.note("surfaces that scatter to their other side are without highlights");
            Some((self.flat_float(share)?, self.flat_color(color)?))
        });
        Layers {
            base: self.flat_color(m.base),
            texture: m.base,
            metallic,
            alpha,
            eta: m.eta.clone(),
            paint_eta: (1.0 + root) / (1.0 - root),
            transmission,
            thin: m.thin,
            translucent,
            coat,
        }
    }

    fn principled(&mut self, p: &PrincipledInputs) -> Layers {
        self.note("principled surfaces become mixes of `conductor`, `dielectric` and `coateddiffuse`, without sheen, tints and flatness");
        let mut share = |t, absent: f32| self.flat_float(t).unwrap_or(Flat::Even([absent; 3]));
        let (metallic, transmission) = (share(p.metallic, 0.0), share(p.transmission, 0.0));
        let alpha = share(p.roughness, 0.5).each(|r| r * r);
        let (coat, gloss) = (share(p.coat[0], 0.0).number().unwrap_or(0.0), share(p.coat[1], 0.0));
        Layers {
            base: self.flat_color(p.base),
            texture: p.base,
            metallic,
            alpha: [alpha.clone(), alpha],
            eta: Ior::Constant(p.eta),
            paint_eta: p.eta,
            transmission,
            thin: p.thin.is_some(),
            translucent: None,
            coat: (coat > 0.5).then(|| gloss.each(|g| 0.1 + (0.001 - 0.1) * g)),
        }
    }

    /// The parts of a surface under names of their own, and their mix.
    fn layered(&mut self, name: &str, l: &Layers, relief: &str) -> String {
        let paint = |w: &mut Self| w.paint(name, l, relief);
        let metal = |w: &mut Self| w.metal_part(name, l, relief);
        let glass = |w: &mut Self| w.glass(name, l) + relief;
        let mix = |w: &mut Self, key: &str, a: String, b: String, amount: &Flat| {
            let [first, second] = [format!("{name}-{key}1"), format!("{name}-{key}2")];
            w.make(&first, &a);
            w.make(&second, &b);
            let amount = w.flat_param("amount", &format!("{name}-{key}"), amount, false);
            format!("\"mix\" \"string materials\" [ \"{first}\" \"{second}\" ] {amount}")
        };
        let dielectric = |w: &mut Self| match l.transmission.number() {
            Some(t) if t <= 0.0 => paint(w),
            Some(t) if t >= 1.0 => glass(w),
            _ => {
                let (a, b) = (paint(w), glass(w));
                mix(w, "glass", a, b, &l.transmission)
            }
        };
        match l.metallic.number() {
            Some(m) if m <= 0.0 => dielectric(self),
            Some(m) if m >= 1.0 => metal(self),
            _ => {
                let (a, b) = (dielectric(self), metal(self));
                mix(self, "metal", a, b, &l.metallic)
            }
        }
    }

    fn paint(&mut self, name: &str, l: &Layers, relief: &str) -> String {
        if let (Some((share, color)), Some(base)) = (&l.translucent, &l.base) {
            let stays = join(base, share, |b, s| b * (1.0 - s));
            let goes = join(color, share, |c, s| c * s);
            if let (Some(stays), Some(goes)) = (stays, goes) {
                let stays = self.flat_param("reflectance", &format!("{name}-stays"), &stays, true);
                let goes = self.flat_param("transmittance", &format!("{name}-goes"), &goes, true);
                return format!("\"diffusetransmission\" {stays} {goes}{relief}");
            }
        }
        let (eta, alpha) = match &l.coat {
            Some(coat) => (1.5, [coat.clone(), coat.clone()]),
            None => (l.paint_eta, l.alpha.clone()),
        };
        let alphas = alpha.clone().map(|a| a.mean());
        if eta <= 1.001 {
            let base = self.color_param(name, l.base.as_ref(), l.texture);
            return format!("\"diffuse\" {base}{relief}");
        }
        if alphas.iter().any(|a| *a > MOST_GLOSSY) {
            return self.matte(name, l, eta, &alpha, relief);
        }
        let below = l.base.clone().map(|f| beneath(f, eta, most_reflected(alphas[0].max(alphas[1]))));
        let base = match &below {
            Some(flat) => self.flat_param("reflectance", &format!("{name}-below"), flat, true),
            None => self.spectrum_param("reflectance", l.texture),
        };
        let rough = self.alphas(name, "", "rough", &alpha);
        let eta = number(eta);
        format!("\"coateddiffuse\" {base} \"float eta\" {eta} {rough} \"bool remaproughness\" false{relief}")
    }

    /// Paint with a dull highlight: a part of it is a dim metal, whose reflection rises towards grazing angles as a dielectric's does.
    fn matte(&mut self, name: &str, l: &Layers, eta: f32, alpha: &[Flat; 2], relief: &str) -> String {
        let normal = sqr((eta - 1.0) / (eta + 1.0));
        let share = (1.6 * normal).clamp(0.1, 0.9);
        let [first, second] = [format!("{name}-paint"), format!("{name}-gloss")];
        let base = self.color_param(name, l.base.as_ref(), l.texture);
        self.make(&first, &format!("\"diffuse\" {base}{relief}"));
        let rough = self.alphas(name, "", "rough", alpha);
        let dim = number(normal / share);
        self.make(
            &second,
            &format!(
                "\"conductor\" \"rgb reflectance\" [ {dim} {dim} {dim} ] {rough} \"bool remaproughness\" false{relief}"
            ),
        );
        format!("\"mix\" \"string materials\" [ \"{first}\" \"{second}\" ] \"float amount\" {}", number(share))
    }

    fn metal_part(&mut self, name: &str, l: &Layers, relief: &str) -> String {
        let base = self.color_param(name, l.base.as_ref(), l.texture);
        if let Some(coat) = &l.coat {
            let inner = self.alphas(name, "conductor.", "rough", &l.alpha);
            let outer = self.alphas(name, "interface.", "coat", &[coat.clone(), coat.clone()]);
            return format!("\"coatedconductor\" {base} {inner} {outer} \"bool remaproughness\" false{relief}");
        }
        let rough = self.alphas(name, "", "rough", &l.alpha);
        let metal = format!("\"conductor\" {base} {rough} \"bool remaproughness\" false{relief}");
        // What bounces between microfacets is lost in pbrt: nearly half of all light at an alpha of one, where metal looks dull anyhow.
        let dull = (2.0 * l.alpha[0].mean().max(l.alpha[1].mean()) - 1.0).clamp(0.0, 1.0);
        if dull < 0.05 {
            return metal;
        }
        self.note("very rough metals are partly matte");
        let matte = format!("\"diffuse\" {base}{relief}");
        let [first, second] = [format!("{name}-bright"), format!("{name}-dull")];
        self.make(&first, &metal);
        self.make(&second, &matte);
        format!("\"mix\" \"string materials\" [ \"{first}\" \"{second}\" ] \"float amount\" {}", number(dull))
    }

    fn glass(&mut self, name: &str, l: &Layers) -> String {
        let white = l.base.as_ref().and_then(Flat::even).is_some_and(|v| v.iter().all(|&v| v > 0.99));
        if !white {
            self.note("glass does not tint what passes its surface");
        }
        if l.thin {
            if l.alpha[0].number() != Some(0.0) {
                self.note("thin glass is clear, however rough");
            }
            return format!("\"thindielectric\" {}", ior("eta", &l.eta));
        }
        let rough = self.alphas(name, "", "rough", &l.alpha);
        format!("\"dielectric\" {} {rough} \"bool remaproughness\" false", ior("eta", &l.eta))
    }

    fn alphas(&mut self, name: &str, prefix: &str, key: &str, [u, v]: &[Flat; 2]) -> String {
        let same = match (u, v) {
            (Flat::Even(a), Flat::Even(b)) => a == b,
            (Flat::Picture(a), Flat::Picture(b)) => a.values == b.values,
            _ => false,
        };
        if same {
            return self.flat_param(&format!("{prefix}roughness"), &format!("{name}-{key}"), u, false);
        }
        let u = self.flat_param(&format!("{prefix}uroughness"), &format!("{name}-{key}u"), u, false);
        let v = self.flat_param(&format!("{prefix}vroughness"), &format!("{name}-{key}v"), v, false);
        format!("{u} {v}")
    }
}

/// Rougher coats than this, as alpha, lose so much light in pbrt's random walks that they are not used.
const MOST_GLOSSY: f32 = 0.1;

/// The share of light that pbrt's `coateddiffuse` of white below an index of 1.5 sends back, by alpha: measured in a furnace.
fn most_reflected(alpha: f32) -> f32 {
    const MEASURED: [f32; 3] = [0.916, 0.900, 0.860];
    let x = (alpha / 0.05).clamp(0.0, 2.0);
    let i = (x as usize).min(1);
    MEASURED[i] + (MEASURED[i + 1] - MEASURED[i]) * (x - i as f32)
}

/// The reflectance below an interface that shows as `color` above it: the interface sends a share of the light from below back each
/// time, and all of it together sends no more than `most` back.
fn beneath(color: Flat, eta: f32, most: f32) -> Flat {
    let eta = eta.max(1.0);
    let back = diffuse_fresnel_reflectance(eta).clamp(0.0, 0.99);
    // What the interface reflects of diffuse light from outside, since as much goes in as comes out, but for the solid angle.
    let above = 1.0 - eta * eta * (1.0 - back);
    let lost = (1.0 - above) / (most - above).max(0.1);
    color.each(|a| {
        let a = (a * lost).clamp(0.0, 1.0);
        a / (1.0 - back + back * a)
    })
}
