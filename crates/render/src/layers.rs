//! Parts of the light, kept as sums beside the picture's own: by bounces, by lights, by how they were found, and what a limit or a
//! filter takes away. They cost nothing when nobody asks.
//!
//! Outliers are found by the means of seven interleaved sets of a pixel's samples: where they are as unequal as rare bright
//! samples make them, the greatest and the least are left out (Buisine, Delepoulle and Renaud 2021, "Firefly removal in Monte
//! Carlo rendering with adaptive Median of meaNs").

use crate::bands::{self, slots_of};
use crate::film::Film;
use crate::sample::{PixelSampler, Sampled};
use crate::sums::PixelSum;
use std::collections::BTreeMap;
use steradian_integrator::Scratch;
use steradian_integrator::record::{Contribution, Count, RayKind, Record, Technique};
use steradian_sampling::Sampler;
use steradian_sampling::rng::mix_bits;
use steradian_scene::{Bands, World};
use steradian_spectrum::Lanes;

/// So many colours a pixel may have besides its own.
pub const MOST_LAYERS: u32 = 256;

/// The name of the layer that says what the outlier filter takes away.
pub const OUTLIERS: &str = "outliers";
/// The name of the layer that says what the limit on samples takes away.
pub const CLAMPED: &str = "clamped";

/// Sets of samples whose means are compared. Odd, so that no set goes with the digits of a low-discrepancy sequence.
const SETS: usize = 7;

/// A part of the light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Layer {
    /// Lamps, sky and flames that the camera sees.
    Emission,
    /// Light that was scattered once.
    Direct,
    /// Light that was scattered more often.
    Indirect,
    /// Light that paths ran into.
    FoundByLobe,
    /// Light whose source was sampled.
    FoundByLight,
    /// Light of one of [`light_groups`].
    Group(u32),
    /// What [`steradian_scene::FilmSettings::max_component_value`] takes away.
    Clamped,
    /// What the outlier filter takes away.
    Outliers,
    /// Radiance by bands of wavelengths.
    Spectrum(Bands),
}

impl Layer {
    fn takes(self, c: &Contribution, group: u32) -> bool {
        match self {
            Self::Emission => c.depth == 0,
            Self::Direct => c.depth == 1,
            Self::Indirect => c.depth > 1,
            Self::FoundByLobe => c.technique == Technique::Hit,
            Self::FoundByLight => c.technique == Technique::LightSampling,
            Self::Group(wanted) => wanted == group,
            Self::Clamped | Self::Outliers | Self::Spectrum(_) => false,
        }
    }

    fn width(self) -> usize {
        match self {
            Self::Outliers => SETS,
            // For each band what fell into it, and how often something did.
            Self::Spectrum(bands) => slots_of(bands.count),
            _ => 1,
        }
    }

    fn needs_contributions(self) -> bool {
        !matches!(self, Self::Clamped | Self::Outliers | Self::Spectrum(_))
    }
}

/// The groups of a world's lights: their names, and for each light the index of its group.
///
/// Lights with one `lightgroup` are a group, and those without are `default`. Where no light has a name, each light
/// statement is a group of its own: `light1`, `light2`, ...
pub fn light_groups(world: &World) -> (Vec<String>, Vec<u32>) {
    let groups = &world.scene().light_groups;
    let named = groups.iter().any(|g| !g.name.is_empty());
    let mut names: Vec<String> = Vec::new();
    let mut seen: BTreeMap<String, u32> = BTreeMap::new();
    let mut index_of = |name: String| {
        *seen.entry(name.clone()).or_insert_with(|| {
            names.push(name);
            names.len() as u32 - 1
        })
    };
    let name = |at: usize| match groups.as_slice()[at].name.as_str() {
        "" if named => "default".to_owned(),
        "" => format!("light{}", at + 1),
        given => given.to_owned(),
    };
    let of_group: Vec<u32> = (0..groups.len()).map(|i| index_of(name(i))).collect();
    // Lights that no statement made, emission of media, and surfaces that cannot be sampled.
    let rest = index_of("default".to_owned());
    let lights = (0..world.light_count() as u32).map(|l| world.light_group(l).map_or(rest, |g| of_group[g.index()]));
    let lights = lights.collect();
    (names, lights)
}

/// The layers of a render.
#[derive(Clone, Debug, Default)]
pub struct Layers {
    list: Vec<Layer>,
    names: Vec<String>,
    group_of_light: Vec<u32>,
    rest: u32,
}

impl Layers {
    /// These layers; groups by their index in [`light_groups`].
    pub fn new(list: Vec<Layer>, world: &World) -> Self {
        let by_group = list.iter().any(|l| matches!(l, Layer::Group(_)));
        let (groups, group_of_light) = if by_group { light_groups(world) } else { Default::default() };
        let rest = groups.iter().position(|g| g == "default").map_or(u32::MAX, |i| i as u32);
        let name = |layer: &Layer| match layer {
            Layer::Emission => "emission".to_owned(),
            Layer::Direct => "direct".to_owned(),
            Layer::Indirect => "indirect".to_owned(),
            Layer::FoundByLobe => "technique_lobe".to_owned(),
            Layer::FoundByLight => "technique_light".to_owned(),
            Layer::Group(i) => format!("RGBA_{}", groups.get(*i as usize).map_or("", String::as_str)),
            Layer::Clamped => CLAMPED.to_owned(),
            Layer::Outliers => OUTLIERS.to_owned(),
            Layer::Spectrum(bands) => bands::name_of(*bands),
        };
        Self { names: list.iter().map(name).collect(), list, group_of_light, rest }
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.list.is_empty()
    }

    /// The names, as [`read_layers`] wants them.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// Colours of a pixel besides its own.
    pub fn width(&self) -> usize {
        self.list.iter().map(|l| l.width()).sum()
    }

    /// Whether a path has to be told apart.
    pub fn needs_contributions(&self) -> bool {
        self.list.iter().any(|l| l.needs_contributions())
    }
}

/// Colours of a pixel besides its own, for layers of these names.
pub fn layer_width(names: &[String]) -> usize {
    names.iter().map(|n| width_of(n)).sum()
}

fn width_of(name: &str) -> usize {
    if name == OUTLIERS { SETS } else { bands::from_name(name).map_or(1, |b| slots_of(b.count)) }
}

/// The set that a sample belongs to: each block of seven has one of each, turned at random.
fn set_of(pixel: [u32; 2], sample: u32) -> usize {
    let block = sample / SETS as u32;
    let turn = mix_bits(u64::from(pixel[0]) << 32 ^ u64::from(pixel[1]) ^ mix_bits(u64::from(block)));
    (sample as usize % SETS + (turn >> 40) as usize) % SETS
}

/// One sample and its layers.
pub(crate) struct LayerSampler<'a> {
    layers: &'a Layers,
    parts: Vec<Lanes>,
    colors: Vec<[f32; 3]>,
}

impl<'a> LayerSampler<'a> {
    pub fn new(layers: &'a Layers) -> Self {
        Self { layers, parts: vec![Lanes::ZERO; layers.list.len()], colors: vec![[0.0; 3]; layers.width()] }
    }

    /// As [`PixelSampler::sample`], with the colours of the layers; none of them, if one is not finite.
    pub fn sample<'w, C: Count>(
        &mut self,
        sampler: &PixelSampler<'w>,
        (numbers, scratch): (&mut Sampler, &mut Scratch<'w>),
        (pixel, index): ([u32; 2], u32),
        counts: &mut C,
    ) -> (Sampled, Option<&[[f32; 3]]>) {
        self.parts.fill(Lanes::ZERO);
        let sampled = if self.layers.needs_contributions() {
            let mut sort = Sort { counts, layers: self.layers, parts: &mut self.parts, weight: 1.0 };
            sampler.sample(numbers, pixel, index, &mut sort, scratch)
        } else {
            sampler.sample(numbers, pixel, index, counts, scratch)
        };
        let mut at = 0;
        for (layer, part) in self.layers.list.iter().zip(&self.parts) {
            let slots = &mut self.colors[at..at + layer.width()];
            at += layer.width();
            match layer {
                Layer::Clamped => slots[0] = sampled.rgb.map(|v| v * (1.0 / sampled.kept - 1.0)),
                Layer::Outliers => {
                    slots.fill([0.0; 3]);
                    slots[set_of(pixel, index)] = sampled.rgb;
                }
                Layer::Spectrum(bands) => bands::sort(*bands, &sampled, slots),
                _ => slots[0] = sampler.color(*part, &sampled),
            }
        }
        let finite = self.colors.iter().flatten().all(|v| v.is_finite());
        (sampled, finite.then_some(&self.colors))
    }
}

/// Sorts the light of a path into layers.
struct Sort<'a, C> {
    counts: &'a mut C,
    layers: &'a Layers,
    parts: &'a mut [Lanes],
    weight: f32,
}

impl<C: Count> Record for Sort<'_, C> {
    const LIGHT: bool = true;
    const TESTS: bool = C::TESTS;
    #[inline]
    fn ray(&mut self, kind: RayKind) {
        self.counts.ray(kind);
    }
    #[inline]
    fn tests(&mut self, boxes: u64, primitives: u64) {
        self.counts.tests(boxes, primitives);
    }
    #[inline]
    fn path(&mut self, bounces: u32) {
        self.counts.path(bounces);
    }
    #[inline]
    fn weight(&mut self, weight: f32) {
        self.weight = weight;
    }
    fn contribution(&mut self, c: Contribution) {
        if c.occluded {
            return;
        }
        let light = c.light.and_then(|l| self.layers.group_of_light.get(l as usize).copied());
        let group = light.unwrap_or(self.layers.rest);
        for (layer, part) in self.layers.list.iter().zip(self.parts.iter_mut()) {
            if layer.takes(&c, group) {
                *part += c.value * self.weight;
            }
        }
    }
}

/// The layers of a film by name, row by row, but for [`crate::read_spectrum`]; that of [`OUTLIERS`] is what is to be taken from the picture.
///
/// # Panics
/// If the film has other layers.
pub fn read_layers(film: &Film, names: &[String]) -> Vec<(String, Vec<[f32; 3]>)> {
    assert_eq!(film.layers(), layer_width(names), "the film has other layers");
    let means = film.layer_means();
    let mut at = 0;
    names
        .iter()
        .filter_map(|name| {
            let from = at;
            at += width_of(name);
            let pixels = if name == OUTLIERS { outliers(film, from) } else { means.iter().map(|m| m[from]).collect() };
            bands::from_name(name).is_none().then(|| (name.clone(), pixels))
        })
        .collect()
}

/// For each pixel what outliers add to its mean, by the sets of samples whose sums begin at slot `from`.
fn outliers(film: &Film, from: usize) -> Vec<[f32; 3]> {
    let [width, height] = film.size();
    let mut out = vec![[0.0; 3]; width * height];
    for tile in &film.tiles {
        for i in 0..tile.len() {
            let [x, y] = tile.pixel(i);
            if tile.samples() < 2 * SETS as u32 {
                continue;
            }
            let counts = counts_of([x, y], tile.first, tile.end);
            let sums = tile.layer_sums(i);
            let means: [[f32; 3]; SETS] = std::array::from_fn(|k| sums[from + k].map(|v| v / counts[k].max(1) as f32));
            let at = (y - film.bounds[2]) as usize * width + (x - film.bounds[0]) as usize;
            out[at] = excess(means, tile.sum(i).mean(tile.samples()));
        }
    }
    out
}

/// How many of the samples `first .. end` belong to each set.
fn counts_of(pixel: [u32; 2], first: u32, end: u32) -> [u32; SETS] {
    let n = SETS as u32;
    let (head, tail) = (first.next_multiple_of(n).min(end), (end / n * n).max(first));
    // Whole blocks have one of each.
    let mut counts = [tail.saturating_sub(head) / n; SETS];
    (first..head).chain(tail.max(head)..end).for_each(|s| counts[set_of(pixel, s)] += 1);
    counts
}

/// What the mean of all sets is above the mean of those that are not left out.
fn excess(mut means: [[f32; 3]; SETS], mean: [f32; 3]) -> [f32; 3] {
    let brightness = |c: &[f32; 3]| f64::from(c[0]) + f64::from(c[1]) + f64::from(c[2]);
    means.sort_by(|a, b| brightness(a).total_cmp(&brightness(b)));
    let values = means.map(|m| brightness(&m).max(0.0));
    let total: f64 = values.iter().sum();
    if total <= 0.0 {
        return [0.0; 3];
    }
    // Gini's coefficient: 0 where all are equal, near 1 where one has everything.
    let n = SETS as f64;
    let gini = values.iter().zip(1..).map(|(v, i)| (2.0 * f64::from(i) - n - 1.0) * v).sum::<f64>() / (n * total);
    let left_out = ((gini * n / 2.0) as usize).min(SETS / 2);
    if left_out == 0 {
        return [0.0; 3];
    }
    let kept = &means[left_out..SETS - left_out];
    std::array::from_fn(|c| mean[c] - kept.iter().map(|m| m[c]).sum::<f32>() / kept.len() as f32)
}

/// The sum of a sample, and its layers, if all is finite.
pub(crate) fn finite<'l>(sampled: &Sampled, layers: Option<&'l [[f32; 3]]>) -> Option<(PixelSum, &'l [[f32; 3]])> {
    let layers = layers.filter(|_| sampled.rgb.iter().all(|v| v.is_finite()))?;
    Some((PixelSum::of(sampled.rgb), layers))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_sets_lose_nothing_and_one_firefly_is_lost() {
        let even: [[f32; 3]; SETS] = std::array::from_fn(|i| [1.0 + 0.05 * i as f32; 3]);
        assert_eq!(excess(even, [1.15; 3]), [0.0; 3]);
        let mut odd = even;
        odd[2] = [50.0, 0.0, 0.0];
        let mean = std::array::from_fn(|c| odd.iter().map(|m| m[c]).sum::<f32>() / SETS as f32);
        let found = excess(odd, mean);
        assert!((mean[0] - found[0] - 1.15).abs() < 0.1 && (mean[1] - found[1] - 1.15).abs() < 0.1, "{found:?}");
        assert_eq!(excess([[0.0; 3]; SETS], [0.0; 3]), [0.0; 3]);
    }

    #[test]
    fn each_block_has_one_sample_of_each_set() {
        for block in 0..50 {
            let mut seen = [0; SETS];
            (0..SETS as u32).for_each(|i| seen[set_of([3, 900], block * SETS as u32 + i)] += 1);
            assert_eq!(seen, [1; SETS]);
        }
        for (first, end) in [(0, 14), (0, 20), (3, 5), (3, 9), (3, 14), (16, 16), (16, 100), (7, 21)] {
            let mut seen = [0; SETS];
            (first..end).for_each(|s| seen[set_of([9, 4], s)] += 1);
            assert_eq!(counts_of([9, 4], first, end), seen, "{first}..{end}");
        }
    }
}
