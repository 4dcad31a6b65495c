//! The choice of one light among many.

use super::bounds::LightBounds;
use super::moving::MovingFar;
use super::tree::{LightTree, PickRows};
use super::{LightContext, Lights};
use crate::LightSelection;
use crate::world::World;
use steradian_bvh::fearless_simd::{Level, dispatch};
use steradian_math::{Bounds3, Row, Rows3, row_end};
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
    /// Lights without a place alike, the rest by the tree. The second list is for callers that find lights by their lobes, too.
    /// `of_all`: without the tree's way down.
    Tree { tree: LightTree, placeless: [Placeless; 2], of_all: bool },
}

/// Infinite and distant lights, which have no place in the tree.
#[derive(Clone, Debug)]
pub(super) struct Placeless {
    ids: Vec<u32>,
    /// Of each of them; the tree has what they leave.
    probability: f32,
}

impl Placeless {
    fn new(ids: Vec<u32>, has_tree: bool) -> Self {
        let groups = ids.len() + usize::from(has_tree);
        Self { ids, probability: if groups == 0 { 0.0 } else { 1.0 / groups as f32 } }
    }

    fn total(&self) -> f32 {
        self.probability * self.ids.len() as f32
    }
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
            LightSelection::Tree | LightSelection::Exhaustive => {
                let tree = LightTree::build(self.light_bounds(world, radius), n);
                let first = self.emitters.len();
                // A sky alone is worth two looks; beside lamps, the lamps have more need of them.
                let alone = tree.is_empty() && self.far.iter().all(MovingFar::is_left_to_lobes);
                let placeless = |beside_lobes: bool| {
                    let left_out =
                        |far: &MovingFar| far.bounds(1.0).is_some() || beside_lobes && !alone && far.is_left_to_lobes();
                    let ids = (0..self.far.len()).filter(|&i| !left_out(&self.far[i])).map(|i| (first + i) as u32);
                    Placeless::new(ids.collect(), !tree.is_empty())
                };
                let of_all = how == LightSelection::Exhaustive;
                Selection::Tree { placeless: [placeless(false), placeless(true)], tree, of_all }
            }
        }
    }

    /// The bounds of all lights that have a place, with their numbers.
    fn light_bounds(&self, world: &World, radius: f32) -> Vec<(u32, LightBounds)> {
        let mut items = Vec::new();
        for (i, e) in self.emitters.iter().enumerate() {
            let (axis, cos) = world.emitter_normals(e);
            let two_sided = world.area_lights[e.emission as usize].two_sided;
            let power = self.power(world, i as u32, radius);
            let bounds = LightBounds::new(world.emitter_bounds(e), axis, cos, 0.0, power, two_sided);
            items.push((i as u32, bounds));
        }
        for (i, far) in self.far.iter().enumerate() {
            let id = (self.emitters.len() + i) as u32;
            items.extend(far.bounds(self.power(world, id, radius)).map(|b| (id, b)));
        }
        items
    }
}

/// A light that was picked.
#[derive(Clone, Copy, Debug)]
pub(in crate::world) struct Pick {
    pub light: u32,
    /// Of this choice.
    pub probability: f32,
    /// What is left of the random number: uniform in `[0, 1)`.
    pub u: f32,
}

impl Pick {
    /// Rounding may have left more than there is.
    #[inline(always)]
    pub fn new(light: u32, probability: f32, u: f32) -> Self {
        Self { light, probability, u: u.clamp(0.0, steradian_math::ONE_MINUS_EPSILON) }
    }
}

impl World {
    /// Picks a light.
    #[inline]
    pub(in crate::world) fn pick_light(&self, context: &LightContext, u: f32) -> Option<Pick> {
        let lights = &self.lights;
        match &lights.selection {
            Selection::None => None,
            Selection::Uniform(n) => {
                let place = u * *n as f32;
                let light = (place as u32).min(n - 1);
                Some(Pick::new(light, 1.0 / *n as f32, place - light as f32))
            }
            Selection::Power(table) => {
                let s = table.sample(u);
                Some(Pick::new(s.index as u32, s.probability, s.remapped))
            }
            Selection::Tree { tree, placeless, of_all } => {
                let placeless = &placeless[usize::from(context.beside_lobes)];
                let (p, below) = (placeless.probability, placeless.total());
                if u < below {
                    let place = u / p;
                    let i = (place as usize).min(placeless.ids.len() - 1);
                    return Some(Pick::new(placeless.ids[i], p, place - i as f32));
                }
                if tree.is_empty() {
                    return placeless.ids.last().map(|&id| Pick::new(id, p, u));
                }
                let from = &context.reference;
                let share = 1.0 - below;
                let u = ((u - below) / share).min(steradian_math::ONE_MINUS_EPSILON);
                let pick =
                    if *of_all { tree.sample_of_all(from.p, from.ns, u) } else { tree.sample(from.p, from.ns, u) };
                pick.map(|pick| Pick { probability: pick.probability * share, ..pick })
            }
        }
    }

    /// Picks lights for the first `n` points of a row, beside lobes. `false` if they have to be picked one by one.
    pub(in crate::world) fn pick_lights(
        &self,
        level: Level,
        (p, ns): (&Rows3, &Rows3),
        u: &Row,
        n: usize,
        out: &mut PickRows,
    ) -> bool {
        let Selection::Tree { tree, placeless, of_all: false } = &self.lights.selection else { return false };
        if !placeless[1].ids.is_empty() || tree.is_empty() {
            return false;
        }
        match tree.one_node() {
            Some(node) => dispatch!(level, _simd => node.sample_rows(p, ns, u, row_end(n), out)),
            None => dispatch!(level, simd => tree.sample_each(simd, (p, ns), u, n, out)),
        }
        true
    }

    /// The probability of that choice.
    #[inline]
    pub(super) fn pick_probability(&self, context: &LightContext, light: u32) -> f32 {
        match &self.lights.selection {
            Selection::None => 0.0,
            Selection::Uniform(n) => 1.0 / *n as f32,
            Selection::Power(table) => table.probability(light as usize),
            Selection::Tree { tree, placeless, of_all } => {
                let placeless = &placeless[usize::from(context.beside_lobes)];
                if placeless.ids.contains(&light) {
                    placeless.probability
                } else {
                    let from = &context.reference;
                    let p = match of_all {
                        true => tree.probability_of_all(from.p, from.ns, light),
                        false => tree.probability(from.p, from.ns, light),
                    };
                    p * (1.0 - placeless.total())
                }
            }
        }
    }
}
