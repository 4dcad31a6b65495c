//! Alternates the two ways.
use std::path::Path;
use steradian_integrator::record::RayCounts;
use steradian_integrator::Scratch;
use steradian_load::*;
use steradian_render::PixelSampler;
use steradian_sampling::Sampler;
use steradian_scene::World;
use steradian_spectrum::ColorMode;
fn user() -> f64 {
    let s = std::fs::read_to_string("/proc/self/stat").unwrap();
    s.rsplit(')').next().unwrap().split_whitespace().nth(11).unwrap().parse::<f64>().unwrap() / 100.0
}
fn main() {
    let a: Vec<String> = std::env::args().collect();
    let spp: u32 = a[3].parse().unwrap();
    let what = a.get(4).map_or("both", |s| s.as_str());
    let out = load(Input::File(Path::new(&a[1])), &Disk, &LoadOptions::default());
    let mut scene = out.scene.unwrap();
    scene.settings.color = if a[2] == "rgb" { ColorMode::Rgb } else { ColorMode::Spectral };
    scene.settings.sampler.spp = spp;
    let world = World::build(scene).unwrap();
    let ps = PixelSampler::new(&world);
    let mut sampler = Sampler::new(&world.settings().sampler);
    let [w, h] = world.settings().film.resolution;
    let mut batch = ps.batch(&sampler);
    let (mut ta, mut tb) = (0.0, 0.0);
    let (mut ca, mut cb) = (RayCounts::default(), RayCounts::default());
    let (mut sa, mut sb) = (Vec::new(), Vec::new());
    let mut scratch = Scratch::default();
    let n = 256 / spp.min(16);
    for y in 0..h {
        for x in (0..w).step_by(n as usize) {
            let pixels: Vec<[u32; 2]> = (x..(x + n).min(w)).map(|x| [x, y]).collect();
            for s0 in (0..spp).step_by(16) {
                let range = s0..(s0 + 16).min(spp);
                sa.clear();
                sb.clear();
                let t = std::time::Instant::now();
                if what != "batch" {
                    for &p in &pixels {
                        for i in range.clone() {
                            sa.push(ps.sample(&mut sampler, p, i, &mut ca, &mut scratch).rgb);
                        }
                    }
                }
                let u = std::time::Instant::now();
                if what != "alone" && let Some(b) = &mut batch {
                    ps.sample_many(b, &mut sampler, &pixels, range.clone(), &mut cb, &mut sb);
                }
                let e1 = (u - t).as_secs_f64();
                let e2 = u.elapsed().as_secs_f64();
                // Leave out what was interrupted.
                if e1 < 2e-3 && e2 < 2e-3 || what != "both" { ta += e1; tb += e2; }
                if what == "both" && batch.is_some() {
                    assert_eq!(sa, sb, "pixels {pixels:?} samples {range:?}");
                }
            }
        }
    }
    if what == "both" { assert_eq!(ca, cb); }
    println!("{} {}: alone {ta:.2} batch {tb:.2} ratio {:.3} rays {} user {:.2}", a[1].split('/').rev().nth(1).unwrap(), a[2], ta / tb, ca.total().max(cb.total()), user());
}
