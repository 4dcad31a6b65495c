//! An interface whose reflection and transmission carry factors that no physical interface has: colours that artists ask for.

use crate::conductor::Conductor;
use crate::dielectric::Dielectric;
use crate::direction::same_hemisphere;
use crate::lobe::{Lobe, LobeSample, Lobes, Part, TransportMode};
use crate::thin_dielectric::{Straight, ThinDielectric};
use steradian_math::Vec3;
use steradian_spectrum::Lanes;

/// What carries the factors.
#[derive(Clone, Copy, Debug, PartialEq)]
#[expect(missing_docs, reason = "each variant is documented at its type")]
pub enum SimpleInterface {
    Conductor(Conductor),
    Dielectric(Dielectric),
    ThinDielectric(ThinDielectric),
}

/// An interface, what it reflects and what it transmits multiplied.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Altered {
    /// The interface.
    pub interface: SimpleInterface,
    /// Factor of what is reflected.
    pub reflection: Lanes,
    /// Factor of what is transmitted.
    pub transmission: Lanes,
}

macro_rules! with_interface {
    ($altered:expr, $lobe:ident => $body:expr) => {
        match $altered {
            SimpleInterface::Conductor($lobe) => $body,
            SimpleInterface::Dielectric($lobe) => $body,
            SimpleInterface::ThinDielectric($lobe) => $body,
        }
    };
}

impl Altered {
    #[inline]
    fn factor(&self, wo: Vec3, wi: Vec3) -> Lanes {
        if same_hemisphere(wo, wi) { self.reflection } else { self.transmission }
    }
}

impl Altered {
    /// What goes straight through a pane.
    #[inline]
    pub(crate) fn straight(&self, wo: Vec3) -> Option<Straight> {
        let SimpleInterface::ThinDielectric(pane) = &self.interface else { return None };
        let s = pane.straight(wo);
        Some(Straight { transmittance: s.transmittance * self.transmission, ..s })
    }
}

impl Lobe for Altered {
    #[inline]
    fn flags(&self) -> Lobes {
        with_interface!(&self.interface, lobe => lobe.flags())
    }

    #[inline]
    fn eval(&self, wo: Vec3, wi: Vec3, mode: TransportMode) -> Lanes {
        self.factor(wo, wi) * with_interface!(&self.interface, lobe => lobe.eval(wo, wi, mode))
    }

    #[inline]
    fn pdf_part(&self, wo: Vec3, wi: Vec3, mode: TransportMode, part: Part) -> f32 {
        with_interface!(&self.interface, lobe => lobe.pdf_part(wo, wi, mode, part))
    }

    #[inline]
    fn eval_and_pdf(&self, wo: Vec3, wi: Vec3, mode: TransportMode) -> (Lanes, f32) {
        let (f, pdf) = with_interface!(&self.interface, lobe => lobe.eval_and_pdf(wo, wi, mode));
        (f * self.factor(wo, wi), pdf)
    }

    #[inline]
    fn sample_part(&self, wo: Vec3, u_lobe: f32, u: [f32; 2], mode: TransportMode, part: Part) -> Option<LobeSample> {
        let mut sample = with_interface!(&self.interface, lobe => lobe.sample_part(wo, u_lobe, u, mode, part))?;
        sample.weight *= if sample.flags.is_reflective() { self.reflection } else { self.transmission };
        Some(sample)
    }

    fn regularize(&mut self) {
        with_interface!(&mut self.interface, lobe => lobe.regularize());
    }
}
