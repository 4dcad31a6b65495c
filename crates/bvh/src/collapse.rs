//! From a binary tree to nodes of eight, at the least expected cost: for every binary node and every number of slots, the
//! best way to fill them with its descendants, from the leaves up (Ylitie, Karras and Laine, "Efficient incoherent ray
//! traversal on GPUs through compressed wide BVHs", 2017, section 3).

use steradian_math::Bounds3;

use crate::build::BinaryNode;
use crate::node::{ChildRef, Node};
use crate::{Leaf, WIDTH};

/// The cost of opening a wide node, in leaf tests.
const NODE_COST: f32 = 1.0;

/// `cost[i]`: the expected cost of what is below a binary node, given `i + 1` slots of the wide node above.
type Costs = [f32; WIDTH - 1];

/// How slots are shared out: `[0]` how many of its eight slots the left child gets if the binary node becomes a wide node;
/// `[i]`, for `i + 1` slots, how many the left child gets, or 0 if the binary node takes only one.
type Shares = [u8; WIDTH - 1];

/// Half the surface area; infinite boxes compare as infinite, which is all that is asked of them.
fn half_area(b: &Bounds3) -> f32 {
    let d = b.diagonal();
    d.x * d.y + d.y * d.z + d.z * d.x
}

/// The best way to part `slots` among two children, the left one getting at least one.
fn share(left: &Costs, right: &Costs, slots: usize) -> (f32, u8) {
    let mut best = (f32::INFINITY, 0);
    for l in 1..slots {
        // More than seven slots for one child are as good as seven.
        let cost = left[l - 1] + right[slots - l - 1];
        if cost < best.0 || best.1 == 0 {
            best = (cost, l as u8);
        }
    }
    best
}

/// Fills in the shares of the subtree at `index`; the depth of the recursion is that of the binary tree.
fn plan(binary: &[BinaryNode], shares: &mut [Shares], index: usize, leaf_cost: &dyn Fn(u32) -> f32) -> Costs {
    let node = &binary[index];
    let area = half_area(&node.bounds);
    if node.leaf != 0 {
        return [area * leaf_cost(node.leaf); WIDTH - 1];
    }
    let left = plan(binary, shares, index + 1, leaf_cost);
    let right = plan(binary, shares, index + node.right_or_first as usize, leaf_cost);
    let mut costs = [0.0; WIDTH - 1];
    let (below, all) = share(&left, &right, WIDTH);
    costs[0] = area * NODE_COST + below;
    shares[index][0] = all;
    for i in 1..WIDTH - 1 {
        let (cost, l) = share(&left, &right, i + 1);
        let fewer = costs[i - 1];
        (costs[i], shares[index][i]) = if cost < fewer { (cost, l) } else { (fewer, 0) };
    }
    costs
}

/// The descendants of `index` that fill at most `slots` slots, appended to `out`.
fn fill(binary: &[BinaryNode], shares: &[Shares], index: usize, slots: usize, out: &mut Vec<usize>) {
    if binary[index].leaf != 0 || slots == 1 {
        out.push(index);
        return;
    }
    match shares[index][slots - 1] {
        0 => fill(binary, shares, index, slots - 1, out),
        l => {
            fill(binary, shares, index + 1, l as usize, out);
            fill(binary, shares, index + binary[index].right_or_first as usize, slots - l as usize, out);
        }
    }
}

/// The wide nodes, the root first. `binary` must not be empty; `leaf_cost` is the cost of a leaf by its tag.
pub(crate) fn collapse(binary: &[BinaryNode], leaf_cost: &dyn Fn(u32) -> f32) -> Vec<Node> {
    let mut shares = vec![[0; WIDTH - 1]; binary.len()];
    plan(binary, &mut shares, 0, leaf_cost);
    let mut nodes = Vec::with_capacity(binary.len() / 20 + 1);
    nodes.push(Node::EMPTY);
    let mut pending = vec![(0usize, 0usize)];
    let mut children = Vec::with_capacity(WIDTH);
    while let Some((index, root)) = pending.pop() {
        children.clear();
        if binary[root].leaf != 0 {
            children.push(root);
        } else {
            let l = shares[root][0] as usize;
            fill(binary, &shares, root + 1, l, &mut children);
            fill(binary, &shares, root + binary[root].right_or_first as usize, WIDTH - l, &mut children);
        }
        // A search for any hit takes children in this order: what is small costs little to search, and is seldom met for nothing.
        let area = |i: usize| half_area(&binary[i].bounds);
        children.sort_by(|&a, &b| area(a).total_cmp(&area(b)).then(a.cmp(&b)));
        for (slot, &child) in children.iter().enumerate() {
            let b = &binary[child];
            let reference = if b.leaf != 0 {
                ChildRef::from_leaf(Leaf { first: b.right_or_first, count: b.leaf >> 1, kind: b.leaf & 1 })
            } else {
                nodes.push(Node::EMPTY);
                pending.push((nodes.len() - 1, child));
                ChildRef(nodes.len() as u32 - 1)
            };
            nodes[index].set(slot, &b.bounds, reference);
        }
    }
    nodes
}
