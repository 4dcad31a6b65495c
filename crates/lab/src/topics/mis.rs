//! Multiple importance sampling on Veach's plates.

use super::prelude::*;
use crate::stage::{Rgb, Vertex, Weights};
use steradian_scene::World;

const TOPIC: Topic = Topic::Mis;

#[derive(Clone, Copy)]
enum Technique {
    Light,
    Lobe,
    Both(Weights),
}

/// Runs the topic.
pub fn run(setting: &Setting) -> Result<Experiment, Error> {
    let mut e = Experiment::new(
        TOPIC,
        "Multiple importance sampling",
        "(The reading:) where several densities each follow a part of the integrand, samples of all of them are combined with weights \
         that add up to one.",
        "Four plates from nearly a mirror to satin reflect four balls of light from small to large. Light sampling is good on rough \
         plates and small balls, lobe sampling on smooth plates and large balls; the balance and the power heuristic combine them. Equal \
         rays: two samples of one technique, or one of each.",
    );
    let plates = Plates::new(setting)?;
    let (pairs, errors) = plates.pictures(&mut e);
    // So few rays of the lobe never meet the small balls, and their scatter would not tell.
    let large = stage::plates_world(plates.size, &[0.5, 0.6, 0.7, 0.8])?;
    unbiased(&mut e, &large, setting);
    plates.slopes(&mut e);
    e.result = format!(
        "With {} reflected rays, relMSE is {:.2e} by light sampling, {:.2e} by lobe sampling, {:.2e} with the balance and {:.2e} with the \
         power heuristic: {:.0} times less than the better single technique. All four agree in the mean.",
        2 * pairs,
        errors[0],
        errors[1],
        errors[2],
        errors[3],
        errors[0].min(errors[1]) / errors[3]
    );
    Ok(e)
}

/// With their names in words and in files.
const TECHNIQUES: [(&str, &str, Technique); 4] = [
    ("light sampling", "light", Technique::Light),
    ("lobe sampling", "lobe", Technique::Lobe),
    ("balance heuristic", "balance", Technique::Both(Weights::Balance)),
    ("power heuristic", "power", Technique::Both(Weights::Power)),
];

/// The scene with its reference.
struct Plates<'a> {
    setting: &'a Setting,
    size: [u32; 2],
    world: World,
    truth: Vec<Rgb>,
}

impl<'a> Plates<'a> {
    fn new(setting: &'a Setting) -> Result<Self, Error> {
        let size = setting.effort.pick([48, 32], [120, 80], [210, 140]);
        let world = stage::plates_world(size, &[0.04, 0.13, 0.34, 0.7])?;
        let (all, spp) = (Technique::Both(Weights::Power), setting.effort.pick(1_024, 1_024, 4_096));
        let truth = render(&world, setting, all, spp, SamplerKind::PaddedSobol, setting.seed_for(TOPIC, 1) ^ 9);
        Ok(Self { setting, size, world, truth })
    }

    fn render(&self, technique: Technique, pairs: u32, salt: u64) -> Vec<Rgb> {
        let seed = self.setting.seed_for(TOPIC, 1) ^ salt;
        render(&self.world, self.setting, technique, pairs, SamplerKind::Independent, seed)
    }

    /// The four pictures with as many rays: how many pairs of them, and the errors.
    fn pictures(&self, e: &mut Experiment) -> (u32, Vec<f64>) {
        let width = self.size[0] as usize;
        let pairs = self.setting.effort.pick(16u32, 16, 32);
        let mut shown = Vec::new();
        let mut errors = Vec::new();
        for (name, id, technique) in TECHNIQUES {
            let picture = self.render(technique, pairs, 0);
            let error = stage::rel_mse(width, &picture, &self.truth);
            shown.push(paint::colour(id, format!("{name}: relMSE {error:.2e}"), width, &picture));
            errors.push(error);
        }
        shown.push(paint::colour("reference", "reference", width, &self.truth));
        e.pictures(shown);
        e.slider("light", "power", "Light sampling alone, and the power heuristic.");
        e.slider("lobe", "power", "Lobe sampling alone, and the power heuristic.");
        let mut table = Table::new(
            "errors",
            format!("{} reflected rays per pixel.", 2 * pairs),
            &["technique", "relative mean squared error", "rays that equal the power heuristic's"],
        );
        for ((name, _, _), error) in TECHNIQUES.iter().zip(&errors) {
            let rays = f64::from(2 * pairs) * error / errors[3];
            table.row([(*name).into(), format!("{error:.3e}"), format!("{rays:.0}")]);
        }
        e.table(table);
        for i in [2, 3] {
            e.claim(Claim::at_most(
                TOPIC,
                format!("relative squared error, {} over the better single technique", TECHNIQUES[i].0),
                0.7,
                errors[i] / errors[0].min(errors[1]),
            ));
        }
        (pairs, errors)
    }

    /// How the errors fall.
    fn slopes(&self, e: &mut Experiment) {
        let counts: &[u32] = self.setting.effort.pick(&[2, 8, 32], &[2, 8, 32], &[2, 8, 32, 128, 512]);
        let mut figure = Figure::new(
            "error",
            "Relative squared error over the reflected rays per pixel.",
            Axis::log("reflected rays per pixel"),
            Axis::log("relMSE"),
        );
        for (name, _, technique) in TECHNIQUES {
            let at = |&n: &u32| stage::error_at(2.0 * f64::from(n), &self.render(technique, n, 3), &self.truth, true);
            let points: Vec<ErrorAt> = counts.iter().map(at).collect();
            if matches!(technique, Technique::Both(_)) {
                e.claim(Claim::falls(TOPIC, format!("{name}: slope of the error over rays"), -1.0, &points));
            }
            figure = figure.with(name, Mark::LineDots, squares(&points));
        }
        e.figure(figure);
    }
}

/// Two reflected rays for each camera ray, by one technique or one by each.
fn render(
    world: &World,
    setting: &Setting,
    technique: Technique,
    pairs: u32,
    kind: SamplerKind,
    seed: u64,
) -> Vec<Rgb> {
    stage::average(world, setting.threads, kind, pairs, seed, |pixel, s| {
        let v = Vertex::of_pixel(world, pixel, s);
        let Vertex::Surface(p) = &v else { return v.emitted() };
        let (light, lobe) = ((s.next_1d(), s.next_2d()), (s.next_1d(), s.next_2d()));
        let reflected = match technique {
            Technique::Light => stage::scaled(
                stage::add(p.light(light.0, light.1, Weights::None), p.light(lobe.0, lobe.1, Weights::None)),
                0.5,
            ),
            Technique::Lobe => stage::scaled(
                stage::add(p.lobe(light.0, light.1, Weights::None), p.lobe(lobe.0, lobe.1, Weights::None)),
                0.5,
            ),
            Technique::Both(w) => stage::add(p.light(light.0, light.1, w), p.lobe(lobe.0, lobe.1, w)),
        };
        stage::add(p.emitted, reflected)
    })
}

/// Each technique has the same mean: compared pixel by pixel, over blocks, with its own variance.
fn unbiased(e: &mut Experiment, world: &World, setting: &Setting) {
    let spp = setting.effort.pick(64u32, 64, 512);
    // Only the floor and the rough plate: where each technique has a variance that so few rays can tell.
    let mean = |technique: Technique, seed: u64| {
        let source = stage::sampler(world, SamplerKind::Independent, spp, seed);
        let [_, height] = world.settings().film.resolution;
        let pixels = stage::per_pixel(world, setting.threads, &source, |pixel, s| {
            if pixel[1] * 10 < height * 7 {
                return None;
            }
            let mut values = VarianceEstimator::default();
            for i in 0..spp {
                s.start(pixel, i, 0);
                let v = Vertex::of_pixel(world, pixel, s);
                let Vertex::Surface(p) = &v else { continue };
                let (light, lobe) = ((s.next_1d(), s.next_2d()), (s.next_1d(), s.next_2d()));
                values.add(paint::luminance(match technique {
                    Technique::Light => p.light(light.0, light.1, Weights::None),
                    Technique::Lobe => p.lobe(lobe.0, lobe.1, Weights::None),
                    Technique::Both(w) => stage::add(p.light(light.0, light.1, w), p.lobe(lobe.0, lobe.1, w)),
                }));
            }
            Some(values)
        });
        let used: Vec<VarianceEstimator> = pixels.into_iter().flatten().filter(|v| v.count() > 1).collect();
        let n = used.len().max(1) as f64;
        (
            used.iter().map(VarianceEstimator::mean).sum::<f64>() / n,
            used.iter().map(VarianceEstimator::variance_of_mean).sum::<f64>() / (n * n),
        )
    };
    let results: Vec<(&str, (f64, f64))> = TECHNIQUES
        .into_iter()
        .enumerate()
        .map(|(i, (name, _, t))| (name, mean(t, setting.seed_for(TOPIC, 50 + i as u64))))
        .collect();
    let (reference, reference_variance) = results[3].1;
    for &(name, (value, variance)) in &results[..3] {
        e.claim(Claim::equal(
            TOPIC,
            format!(
                "{name}: mean of the lower part of the picture with large balls against that of the power heuristic"
            ),
            reference,
            value,
            (variance + reference_variance).sqrt(),
        ));
    }
}
