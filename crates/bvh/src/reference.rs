//! The scalar traversal: one box at a time, no ordering, no stack tricks. Tests compare the SIMD traversal with it.

use steradian_math::{Bounds3, Ray, gamma};

use crate::box_ray::is_traceable;
use crate::node::ChildRef;
use crate::{Bvh, Leaf, WIDTH};

/// The factor by which the exit distance grows so that rounding never loses a box (Ize 2013).
pub(crate) const GROW: f32 = 1.0 + 2.0 * gamma(3);

/// The distance at which the ray enters the box, if it does so before `t_max`.
///
/// A slab in whose face the ray lies gives `0 * inf = NaN`, which both comparisons ignore.
pub(crate) fn box_entry(bounds: &Bounds3, ray: &Ray, t_max: f32) -> Option<f32> {
    let (mut near, mut far) = (0.0f32, t_max);
    for axis in 0..3 {
        let inv = 1.0 / ray.d[axis];
        let (a, b) = (bounds.min[axis], bounds.max[axis]);
        let (a, b) = if ray.d[axis].is_sign_negative() { (b, a) } else { (a, b) };
        let (a, b) = ((a - ray.o[axis]) * inv, (b - ray.o[axis]) * inv);
        near = if a > near { a } else { near };
        far = if b < far { b } else { far };
    }
    (near <= far * GROW).then_some(near)
}

impl Bvh {
    /// What [`Bvh::closest`] computes, one box after another; `leaf` sees leaves in another order, and more of them.
    pub fn closest_reference(&self, ray: &Ray, mut leaf: impl FnMut(Leaf, &mut f32)) {
        if !is_traceable(ray) || self.nodes.is_empty() {
            return;
        }
        let mut t_max = ray.t_max;
        let mut pending = vec![ChildRef::ROOT];
        while let Some(child) = pending.pop() {
            if child.is_leaf() {
                leaf(child.leaf(), &mut t_max);
                continue;
            }
            let node = &self.nodes[child.0 as usize];
            for i in 0..WIDTH {
                if box_entry(&node.bounds(i), ray, t_max).is_some() {
                    pending.push(ChildRef(node.child[i]));
                }
            }
        }
    }
}
