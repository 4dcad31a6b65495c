//! The choice of a light in proportion to what each of them may do at a point, all of them looked at: exact, and as slow as there are many.

use super::super::selection::Pick;
use super::{LIGHT, LightTree};
use steradian_math::{Normal3, Point3};

impl LightTree {
    /// All lights with their importances, in the order of the tree.
    fn each(&self, p: Point3, n: Normal3) -> impl Iterator<Item = (u32, f32)> + '_ {
        self.nodes.iter().flat_map(move |node| {
            let importances = node.importances(p, n);
            (0..node.count as usize)
                .filter(|&c| node.child[c] & LIGHT != 0)
                .map(move |c| (node.child[c] & !LIGHT, importances[c]))
        })
    }

    /// As [`LightTree::sample`], without going down the tree.
    pub fn sample_of_all(&self, p: Point3, n: Normal3, u: f32) -> Option<Pick> {
        let total: f32 = self.each(p, n).map(|(_, v)| v).sum();
        if total <= 0.0 {
            return None;
        }
        let mut left = u * total;
        let mut chosen = None;
        for (light, importance) in self.each(p, n).filter(|l| l.1 > 0.0) {
            chosen = Some(Pick::new(light, importance / total, left / importance));
            if left < importance {
                break;
            }
            left -= importance;
        }
        chosen
    }

    /// The probability of that choice.
    pub fn probability_of_all(&self, p: Point3, n: Normal3, light: u32) -> f32 {
        let Some((at, place)) = self.places[light as usize] else { return 0.0 };
        let total: f32 = self.each(p, n).map(|(_, v)| v).sum();
        if total > 0.0 { self.nodes[at as usize].importances(p, n)[place as usize] / total } else { 0.0 }
    }
}
