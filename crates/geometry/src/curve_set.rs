//! Curves put somewhere in space, in pieces whose boxes are tight enough for a tree.

use steradian_math::{Bounds3, Ray, Transform};

use crate::{Curve, CurveHit, SurfaceHit};

/// Each curve is handed to the tree in `2^SPLITS` pieces: a long thin arc fills little of one box.
const SPLITS: u32 = 3;

/// Curves with a common place. Everything here is in the space that the transform leads to.
#[derive(Clone, Debug)]
pub struct CurveSet {
    curves: Vec<Curve>,
    /// `None` where the curves themselves are already in place.
    to_world: Option<Transform>,
    flip: bool,
}

impl CurveSet {
    /// Puts curves in place. Normals are flipped if `reverse_orientation` is set, or if the transform swaps handedness,
    /// but not if both.
    pub fn new(curves: Vec<Curve>, to_world: &Transform, reverse_orientation: bool) -> Self {
        let mirrored = to_world.swaps_handedness();
        // A uniform scale keeps profiles round, so that the curve can be moved for good.
        if to_world.keeps_angles() && !mirrored {
            let curves = curves.iter().map(|c| c.transformed(to_world)).collect();
            return Self { curves, to_world: None, flip: reverse_orientation };
        }
        Self { curves, to_world: Some(*to_world), flip: reverse_orientation ^ mirrored }
    }

    /// The number of pieces.
    pub fn len(&self) -> usize {
        self.curves.len() << SPLITS
    }

    /// Whether there are no curves.
    pub fn is_empty(&self) -> bool {
        self.curves.is_empty()
    }

    /// Bytes of the curves.
    pub fn byte_size(&self) -> usize {
        size_of_val(self.curves.as_slice())
    }

    #[inline]
    fn piece(&self, piece: u32) -> Curve {
        let whole = &self.curves[(piece >> SPLITS) as usize];
        let n = 1u32 << SPLITS;
        let i = piece & (n - 1);
        let at = |i: u32| steradian_math::lerp(i as f32 / n as f32, whole.u[0], whole.u[1]);
        Curve { u: [at(i), at(i + 1)], ..*whole }
    }

    #[inline]
    fn local(&self, ray: &Ray) -> Ray {
        self.to_world.map_or(*ray, |t| t.inverse().ray(ray))
    }

    /// A box around a piece.
    pub fn bounds(&self, piece: u32) -> Bounds3 {
        let b = self.piece(piece).bounds();
        self.to_world.map_or(b, |t| t.bounds(&b))
    }

    /// The nearest hit of a piece with `0 < t <= ray.t_max`.
    pub fn intersect(&self, piece: u32, ray: &Ray) -> Option<CurveHit> {
        self.piece(piece).intersect(&self.local(ray))
    }

    /// Everything about the point where `ray` met a piece.
    pub fn interaction(&self, piece: u32, ray: &Ray, hit: &CurveHit) -> SurfaceHit {
        let local = self.curves[(piece >> SPLITS) as usize].interaction(&self.local(ray), hit);
        let local = if self.flip { local.flipped() } else { local };
        match &self.to_world {
            Some(t) => local.transformed(t),
            None => local,
        }
    }
}
