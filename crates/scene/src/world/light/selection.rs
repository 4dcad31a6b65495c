//! The choice of one light among many.

use super::Lights;
use super::bounds::{LightBounds, LightTree};
use crate::LightSelection;
use crate::world::World;
use steradian_geometry::Reference;
use steradian_math::Bounds3;
use steradian_sampling::AliasTable;

/// How lights are picked, with the tables for it.
#[derive(Clone, Debug, Default)]
pub(super) enum Selection {
    /// There are none.
    #[default]
    None,
    /// All alike.
    Uniform(u32),
    /// In proportion to power.
    Power(AliasTable),
    /// Lights without a place alike, the rest by the tree.
    Tree { tree: LightTree, probability_placeless: f32 },
}

impl Lights {
    /// Builds the tables over all lights.
    pub(super) fn select(&self, world: &World, how: LightSelection, bounds: &Bounds3) -> Selection {
        let n = self.len();
        if n == 0 {
            return Selection::None;
        }
        let radius = bounds.bounding_sphere().1;
        match how {
            LightSelection::Uniform => Selection::Uniform(n as u32),
            LightSelection::Power => {
                let weights: Vec<f32> = (0..n as u32).map(|i| self.power(world, i, radius)).collect();
                AliasTable::new(&weights).map_or(Selection::Uniform(n as u32), Selection::Power)
            }
            LightSelection::Tree => {
                let tree = LightTree::build(self.light_bounds(world, radius), n);
                let groups = self.placeless.len() + usize::from(!tree.is_empty());
                Selection::Tree { tree, probability_placeless: if groups == 0 { 0.0 } else { 1.0 / groups as f32 } }
            }
        }
    }

    /// The bounds of all lights that have a place, with their numbers.
    fn light_bounds(&self, world: &World, radius: f32) -> Vec<(u32, LightBounds)> {
        let mut items = Vec::new();
        for (i, e) in self.emitters.iter().enumerate() {
            let (axis, cos) = world.emitter_normals(&e.shape);
            let two_sided = world.area_lights[e.emission as usize].two_sided;
            let power = self.power(world, i as u32, radius);
            let bounds = LightBounds::new(world.emitter_bounds(&e.shape), axis, cos, 0.0, power, two_sided);
            items.push((i as u32, bounds));
        }
        for (i, far) in self.far.iter().enumerate() {
            let id = (self.emitters.len() + i) as u32;
            items.extend(far.bounds(self.power(world, id, radius)).map(|b| (id, b)));
        }
        items
    }
}

impl World {
    /// Picks a light: its number and the probability of that choice.
    #[inline]
    pub(super) fn pick_light(&self, from: &Reference, u: f32) -> Option<(u32, f32)> {
        let lights = &self.lights;
        match &lights.selection {
            Selection::None => None,
            Selection::Uniform(n) => Some((((u * *n as f32) as u32).min(n - 1), 1.0 / *n as f32)),
            Selection::Power(table) => {
                let s = table.sample(u);
                Some((s.index as u32, s.probability))
            }
            Selection::Tree { tree, probability_placeless } => {
                let p = *probability_placeless;
                let placeless = &self.lights.placeless;
                let below = p * placeless.len() as f32;
                if u < below {
                    let i = ((u / p) as usize).min(placeless.len() - 1);
                    return Some((placeless[i], p));
                }
                if tree.is_empty() {
                    return placeless.last().map(|&id| (id, p));
                }
                let share = 1.0 - below;
                let u = ((u - below) / share).min(steradian_math::ONE_MINUS_EPSILON);
                tree.sample(from.p, from.ns, u).map(|(id, pmf)| (id, pmf * share))
            }
        }
    }

    /// The probability of that choice.
    #[inline]
    pub(super) fn pick_probability(&self, from: &Reference, light: u32) -> f32 {
        match &self.lights.selection {
            Selection::None => 0.0,
            Selection::Uniform(n) => 1.0 / *n as f32,
            Selection::Power(table) => table.probability(light as usize),
            Selection::Tree { tree, probability_placeless } => {
                if self.lights.placeless.contains(&light) {
                    *probability_placeless
                } else {
                    let share = 1.0 - probability_placeless * self.lights.placeless.len() as f32;
                    tree.probability(from.p, from.ns, light) * share
                }
            }
        }
    }
}
