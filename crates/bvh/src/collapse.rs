//! From a binary tree to nodes of eight: each wide node takes a binary node and opens its largest descendants until
//! eight are gathered (Wald, Benthin and Boulos, "Getting rid of packets", 2008).

use steradian_math::Bounds3;

use crate::build::BinaryNode;
use crate::node::{ChildRef, Node};
use crate::{Leaf, WIDTH};

/// Half the surface area; infinite boxes compare as infinite, which is all that is asked of them.
fn half_area(b: &Bounds3) -> f32 {
    let d = b.diagonal();
    d.x * d.y + d.y * d.z + d.z * d.x
}

/// The children that a wide node made of binary node `root` gets; a leaf is its own only child.
fn gather(binary: &[BinaryNode], root: usize) -> ([usize; WIDTH], usize) {
    let mut children = [0; WIDTH];
    children[0] = root;
    let mut count = 1;
    while count < WIDTH {
        let mut widest: Option<(usize, f32)> = None;
        for (slot, &child) in children[..count].iter().enumerate() {
            if binary[child].leaf == 0 {
                let area = half_area(&binary[child].bounds);
                if widest.is_none_or(|(_, a)| area > a) {
                    widest = Some((slot, area));
                }
            }
        }
        let Some((slot, _)) = widest else { break };
        let opened = children[slot];
        children[slot] = opened + 1;
        children[count] = opened + binary[opened].right_or_first as usize;
        count += 1;
    }
    (children, count)
}

/// The wide nodes, the root first. `binary` must not be empty.
pub(crate) fn collapse(binary: &[BinaryNode]) -> Vec<Node> {
    let mut nodes = Vec::with_capacity(binary.len() / 20 + 1);
    nodes.push(Node::EMPTY);
    let mut pending = vec![(0usize, 0usize)];
    while let Some((index, root)) = pending.pop() {
        let (children, count) = gather(binary, root);
        for (slot, &child) in children[..count].iter().enumerate() {
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
