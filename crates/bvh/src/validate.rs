//! The invariants of a tree, checked one by one.

use steradian_math::Bounds3;

use crate::node::ChildRef;
use crate::{Bvh, InvalidBvh, Primitive, WIDTH};

impl Bvh {
    /// Checks that every primitive is in exactly one leaf, that every box contains what is below it, that no leaf mixes
    /// kinds, that every node is reached exactly once, and that the tree is no deeper than the stack allows.
    pub fn validate(&self, primitives: &[Primitive]) -> Result<(), InvalidBvh> {
        let fail = |node: usize, what| Err(InvalidBvh { node, what });
        if self.order.len() != primitives.len() {
            return fail(0, "the order has not as many entries as there are primitives");
        }
        if primitives.is_empty() {
            return if self.nodes.is_empty() { Ok(()) } else { fail(0, "an empty tree has nodes") };
        }
        if self.nodes.is_empty() {
            return fail(0, "primitives but no root");
        }
        let mut seen = vec![false; primitives.len()];
        let mut reached = vec![false; self.nodes.len()];
        let mut pending = vec![(0usize, self.bounds, 1usize)];
        while let Some((index, around, depth)) = pending.pop() {
            if depth > crate::build::MAX_DEPTH {
                return fail(index, "deeper than the stack allows");
            }
            if std::mem::replace(&mut reached[index], true) {
                return fail(index, "reached twice");
            }
            let node = &self.nodes[index];
            for i in 0..WIDTH {
                let (bounds, child) = (node.bounds(i), ChildRef(node.child[i]));
                if child == ChildRef::NONE {
                    if !bounds.is_empty() {
                        return fail(index, "an unused slot has a box");
                    }
                    continue;
                }
                if bounds.is_empty() || around.union(bounds) != around {
                    return fail(index, "a child's box is not inside its parent's");
                }
                if child.is_leaf() {
                    self.validate_leaf(index, child, &bounds, primitives, &mut seen)?;
                } else if child.0 as usize >= self.nodes.len() {
                    return fail(index, "a child that does not exist");
                } else {
                    pending.push((child.0 as usize, bounds, depth + 1));
                }
            }
        }
        if !seen.iter().all(|&s| s) {
            return fail(0, "a primitive is in no leaf");
        }
        if !reached.iter().all(|&r| r) {
            return fail(0, "a node is not reached");
        }
        Ok(())
    }

    fn validate_leaf(
        &self,
        node: usize,
        child: ChildRef,
        bounds: &Bounds3,
        primitives: &[Primitive],
        seen: &mut [bool],
    ) -> Result<(), InvalidBvh> {
        let fail = |what| Err(InvalidBvh { node, what });
        let leaf = child.leaf();
        if leaf.range().end > self.order.len() {
            return fail("a leaf beyond the primitives");
        }
        for position in leaf.range() {
            let id = self.order[position] as usize;
            let Some(p) = primitives.get(id) else { return fail("a leaf names no primitive") };
            if std::mem::replace(&mut seen[id], true) {
                return fail("a primitive is in two leaves");
            }
            if u32::from(p.kind) != leaf.kind {
                return fail("a leaf mixes kinds");
            }
            if bounds.union(p.bounds) != *bounds {
                return fail("a primitive's box is not inside its leaf's");
            }
        }
        Ok(())
    }
}
