//! Traversal: eight boxes at a time, nearest child first.

use std::ops::ControlFlow;

use fearless_simd::prelude::*;
use fearless_simd::{Simd, dispatch, f32x8};
use steradian_math::Ray;

use crate::node::{ChildRef, Node};
use crate::reference::{GROW, is_traceable};
use crate::stack::Stack;
use crate::{Bvh, Leaf};

/// What happens at a leaf.
///
/// `leaf` is compiled into the traversal once for each instruction set: it gets the SIMD token, and should be
/// `#[inline(always)]`.
pub trait Visitor {
    /// Tests what is in `leaf` against the ray and lowers `t_max` to the nearest hit; `Break` ends the traversal.
    fn leaf<S: Simd>(&mut self, simd: S, leaf: Leaf, t_max: &mut f32) -> ControlFlow<()>;
}

/// A visitor from a closure that does not need the SIMD token.
struct Scalar<F>(F);

impl<F: FnMut(Leaf, &mut f32) -> ControlFlow<()>> Visitor for Scalar<F> {
    #[inline(always)]
    fn leaf<S: Simd>(&mut self, _: S, leaf: Leaf, t_max: &mut f32) -> ControlFlow<()> {
        (self.0)(leaf, t_max)
    }
}

impl Bvh {
    /// Visits the leaves that the ray reaches, near ones first, until `leaf` has lowered the limit below all others.
    ///
    /// A ray that is not finite, or that has no direction, reaches nothing.
    #[inline]
    pub fn closest(&self, ray: &Ray, mut leaf: impl FnMut(Leaf, &mut f32)) {
        self.visit_nearest(
            ray,
            &mut Scalar(
                #[inline(always)]
                |l, t: &mut f32| {
                    leaf(l, t);
                    ControlFlow::Continue(())
                },
            ),
        );
    }

    /// Whether `leaf` answers true for any leaf that the ray reaches. The order is unspecified.
    #[inline]
    pub fn any(&self, ray: &Ray, mut leaf: impl FnMut(Leaf) -> bool) -> bool {
        self.visit_any(
            ray,
            &mut Scalar(
                #[inline(always)]
                |l, _: &mut f32| if leaf(l) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) },
            ),
        )
    }

    /// As [`Bvh::closest`], with a visitor compiled for each instruction set; true if the visitor broke off.
    #[inline]
    pub fn visit_nearest<V: Visitor>(&self, ray: &Ray, visitor: &mut V) -> bool {
        dispatch!(self.level, simd => traverse::<_, V, true>(simd, self, ray, visitor))
    }

    /// As [`Bvh::any`], with a visitor compiled for each instruction set; true if the visitor broke off.
    #[inline]
    pub fn visit_any<V: Visitor>(&self, ray: &Ray, visitor: &mut V) -> bool {
        dispatch!(self.level, simd => traverse::<_, V, false>(simd, self, ray, visitor))
    }
}

/// The larger of `a` and `b`, and `b` if `a` is NaN.
#[inline(always)]
fn max_or_second<S: Simd>(a: f32x8<S>, b: f32x8<S>) -> f32x8<S> {
    // The x86 instruction returns its second operand; elsewhere the IEEE maximum costs no more. Tests hold this fast.
    if cfg!(any(target_arch = "x86", target_arch = "x86_64")) { a.max(b) } else { a.max_precise(b) }
}

/// The smaller of `a` and `b`, and `b` if `a` is NaN.
#[inline(always)]
fn min_or_second<S: Simd>(a: f32x8<S>, b: f32x8<S>) -> f32x8<S> {
    if cfg!(any(target_arch = "x86", target_arch = "x86_64")) { a.min(b) } else { a.min_precise(b) }
}

/// The stack entry of child `i`.
#[inline(always)]
fn key(near: &[f32; 8], node: &Node, i: usize) -> u64 {
    u64::from(near[i].to_bits()) << 32 | u64::from(node.child[i])
}

#[inline(always)]
fn traverse<S: Simd, V: Visitor, const NEAREST: bool>(simd: S, bvh: &Bvh, ray: &Ray, visitor: &mut V) -> bool {
    let nodes = bvh.nodes.as_slice();
    if nodes.is_empty() || !is_traceable(ray) {
        return false;
    }
    let mut t_max = ray.t_max;
    // A negative direction enters through the greatest plane.
    let sign = [ray.d.x.is_sign_negative(), ray.d.y.is_sign_negative(), ray.d.z.is_sign_negative()];
    let (ox, oy, oz) = (f32x8::splat(simd, ray.o.x), f32x8::splat(simd, ray.o.y), f32x8::splat(simd, ray.o.z));
    let (ix, iy, iz) =
        (f32x8::splat(simd, 1.0 / ray.d.x), f32x8::splat(simd, 1.0 / ray.d.y), f32x8::splat(simd, 1.0 / ray.d.z));
    let zero = f32x8::splat(simd, 0.0);
    let grow = f32x8::splat(simd, GROW);
    let mut limit = f32x8::splat(simd, t_max);

    let mut stack = Stack::new();
    let mut current = ChildRef::ROOT;
    loop {
        if !current.is_leaf() {
            let node = &nodes[current.0 as usize];
            let near_x = (f32x8::load_array_ref(simd, &node.planes[0][usize::from(sign[0])]) - ox) * ix;
            let near_y = (f32x8::load_array_ref(simd, &node.planes[1][usize::from(sign[1])]) - oy) * iy;
            let near_z = (f32x8::load_array_ref(simd, &node.planes[2][usize::from(sign[2])]) - oz) * iz;
            let far_x = (f32x8::load_array_ref(simd, &node.planes[0][usize::from(!sign[0])]) - ox) * ix;
            let far_y = (f32x8::load_array_ref(simd, &node.planes[1][usize::from(!sign[1])]) - oy) * iy;
            let far_z = (f32x8::load_array_ref(simd, &node.planes[2][usize::from(!sign[2])]) - oz) * iz;
            let near = max_or_second(near_x, max_or_second(near_y, max_or_second(near_z, zero)));
            let far = min_or_second(far_x, min_or_second(far_y, min_or_second(far_z, limit))) * grow;
            let mut hits = near.simd_le(far).to_bitmask() as u32;
            if hits != 0 {
                let near: [f32; 8] = near.into();
                let i = hits.trailing_zeros() as usize & 7;
                hits &= hits - 1;
                if hits == 0 {
                    current = ChildRef(node.child[i]);
                    continue;
                }
                if NEAREST {
                    let mut best = key(&near, node, i);
                    let base = stack.len();
                    while hits != 0 {
                        let i = hits.trailing_zeros() as usize & 7;
                        hits &= hits - 1;
                        let k = key(&near, node, i);
                        stack.insert(base, best.max(k));
                        best = best.min(k);
                    }
                    current = ChildRef(best as u32);
                } else {
                    while hits != 0 {
                        let i = hits.trailing_zeros() as usize & 7;
                        hits &= hits - 1;
                        stack.push(key(&near, node, i));
                    }
                    current = ChildRef(node.child[i]);
                }
                continue;
            }
        } else {
            let before = t_max;
            if visitor.leaf(simd, current.leaf(), &mut t_max).is_break() {
                return true;
            }
            if t_max != before {
                limit = f32x8::splat(simd, t_max);
            }
        }
        loop {
            let Some(entry) = stack.pop() else { return false };
            if !NEAREST || f32::from_bits((entry >> 32) as u32) <= t_max * GROW {
                current = ChildRef(entry as u32);
                break;
            }
        }
    }
}
