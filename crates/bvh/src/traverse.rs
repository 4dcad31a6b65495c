//! Traversal: eight boxes at a time, nearest child first.

use std::ops::ControlFlow;

use fearless_simd::prelude::*;
use fearless_simd::{Simd, dispatch, f32x8};
use steradian_math::Ray;

use crate::node::{ChildRef, Node};
use crate::reference::GROW;
use crate::stack::Stack;
use crate::{BoxRay, Bvh, Leaf};

/// What happens at a leaf.
///
/// `leaf` is compiled into the traversal once for each instruction set: it gets the SIMD token, and should be
/// `#[inline(always)]`.
pub trait Visitor {
    /// The boxes of an inner node are about to be tested; for counting. Costs nothing unless overridden.
    #[inline(always)]
    fn node(&mut self, _node: &Node) {}

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
        dispatch!(self.level, simd => self.visit_nearest_in(simd, &BoxRay::new(ray), visitor))
    }

    /// As [`Bvh::any`], with a visitor compiled for each instruction set; true if the visitor broke off.
    #[inline]
    pub fn visit_any<V: Visitor>(&self, ray: &Ray, visitor: &mut V) -> bool {
        dispatch!(self.level, simd => self.visit_any_in(simd, &BoxRay::new(ray), visitor))
    }

    /// As [`Bvh::visit_nearest`], for callers that trace many rays with one SIMD token.
    #[inline(always)]
    pub fn visit_nearest_in<S: Simd, V: Visitor>(&self, simd: S, ray: &BoxRay, visitor: &mut V) -> bool {
        traverse::<_, V, true>(simd, self, ray, visitor)
    }

    /// As [`Bvh::visit_any`], for callers that trace many rays with one SIMD token.
    #[inline(always)]
    pub fn visit_any_in<S: Simd, V: Visitor>(&self, simd: S, ray: &BoxRay, visitor: &mut V) -> bool {
        traverse::<_, V, false>(simd, self, ray, visitor)
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

/// A ray ready to be tested against the eight boxes of a node.
struct Slabs<S: Simd> {
    origin: [f32x8<S>; 3],
    inverse: [f32x8<S>; 3],
    /// Whether the direction is negative, so that the ray enters through the greatest plane.
    negative: [bool; 3],
    zero: f32x8<S>,
    grow: f32x8<S>,
}

impl<S: Simd> Slabs<S> {
    #[inline(always)]
    fn new(simd: S, ray: &BoxRay) -> Self {
        let inverse = ray.inverse.to_array();
        Self {
            origin: ray.o.to_array().map(|x| f32x8::splat(simd, x)),
            inverse: inverse.map(|x| f32x8::splat(simd, x)),
            negative: inverse.map(f32::is_sign_negative),
            zero: f32x8::splat(simd, 0.0),
            grow: f32x8::splat(simd, GROW),
        }
    }

    /// The distance to one plane across `axis` for each box: the one through which the ray enters, or leaves.
    #[inline(always)]
    fn plane(&self, simd: S, node: &Node, axis: usize, leave: bool) -> f32x8<S> {
        let plane = &node.planes[axis][usize::from(self.negative[axis] != leave)];
        (f32x8::load_array_ref(simd, plane) - self.origin[axis]) * self.inverse[axis]
    }

    /// The boxes that the ray enters before `limit`, as bits, and where it enters them.
    #[inline(always)]
    fn enter(&self, simd: S, node: &Node, limit: f32x8<S>) -> (u32, f32x8<S>) {
        let mut near = self.zero;
        let mut far = limit;
        for axis in [2, 1, 0] {
            near = max_or_second(self.plane(simd, node, axis, false), near);
            far = min_or_second(self.plane(simd, node, axis, true), far);
        }
        (near.simd_le(far * self.grow).to_bitmask() as u32, near)
    }
}

/// The stack entry of child `i`.
#[inline(always)]
fn key(near: &[f32; 8], node: &Node, i: usize) -> u64 {
    u64::from(near[i].to_bits()) << 32 | u64::from(node.child[i])
}

/// Takes the lowest bit out of `bits`: the next child.
#[inline(always)]
fn take(bits: &mut u32) -> usize {
    let i = bits.trailing_zeros() as usize & 7;
    *bits &= *bits - 1;
    i
}

#[inline(always)]
fn traverse<S: Simd, V: Visitor, const NEAREST: bool>(simd: S, bvh: &Bvh, ray: &BoxRay, visitor: &mut V) -> bool {
    let nodes = bvh.nodes.as_slice();
    if nodes.is_empty() || !ray.traceable {
        return false;
    }
    let slabs = Slabs::new(simd, ray);
    let mut t_max = ray.t_max;
    let mut limit = f32x8::splat(simd, t_max);
    let mut stack = Stack::new();
    let mut current = ChildRef::ROOT;
    loop {
        if !current.is_leaf() {
            let node = &nodes[current.0 as usize];
            visitor.node(node);
            let (mut hits, near) = slabs.enter(simd, node, limit);
            if hits != 0 {
                let near: [f32; 8] = near.into();
                let first = take(&mut hits);
                if hits == 0 || !NEAREST {
                    while hits != 0 {
                        let last = (31 - hits.leading_zeros()) as usize & 7;
                        hits &= !(1 << last);
                        stack.push(key(&near, node, last));
                    }
                    current = ChildRef(node.child[first]);
                } else {
                    let mut best = key(&near, node, first);
                    let base = stack.len();
                    while hits != 0 {
                        let k = key(&near, node, take(&mut hits));
                        stack.insert(base, best.max(k));
                        best = best.min(k);
                    }
                    current = ChildRef(best as u32);
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
            // What was within reach when it was pushed may not be any more.
            if !NEAREST || f32::from_bits((entry >> 32) as u32) <= t_max * GROW {
                current = ChildRef(entry as u32);
                break;
            }
        }
    }
}
