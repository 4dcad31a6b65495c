//! The contract of `Lobe`, checked for every kind of lobe from one table.

use std::sync::LazyLock;
use steradian_bsdf::{
    Altered, Beckmann, Bsdf, Bumped, Coating, Conductor, Dielectric, Diffuse, DiffuseTransmission, Film, Hair, Layered,
    Lobe, LobeSample, Lobes, Measured, MeasuredMaterial, MeasuredTables, MetallicRoughness, MetallicRoughnessParams,
    Microfacets, Part, Plastic, PlasticInterface, PlasticTable, Principled, PrincipledParams, SimpleInterface,
    SubsurfaceExit, ThinDielectric, TransportMode, TrowbridgeReitz,
};
use steradian_math::Vec3;
use steradian_spectrum::{Lanes, Wavelengths};
use steradian_testkit::{ChiSquareTest, TestRng, z_test};

/// False-alarm rate of every single statistical test here. There are about 200 of them.
const SIGNIFICANCE: f64 = 1e-8;

const MODES: [TransportMode; 2] = [TransportMode::Radiance, TransportMode::Importance];
const PARTS: [Part; 3] = [Part::All, Part::Reflection, Part::Transmission];

fn ggx(x: f32, y: f32) -> TrowbridgeReitz {
    TrowbridgeReitz::new(x, y)
}

fn beckmann(x: f32, y: f32) -> Microfacets {
    Microfacets::Beckmann(Beckmann::new(x, y))
}

fn altered(interface: SimpleInterface) -> Bsdf<'static> {
    let (reflection, transmission) = (Lanes([0.9, 0.5, 0.2, 1.0]), Lanes([0.3, 0.8, 0.6, 0.9]));
    Altered { interface, reflection, transmission }.into()
}

static PLASTIC_TABLE: LazyLock<PlasticTable> = LazyLock::new(|| PlasticTable::new(&beckmann(0.3, 0.3), 1.5));

fn plastic(interface: PlasticInterface<'static>, nonlinear: bool) -> Bsdf<'static> {
    Plastic::new(interface, 1.5, Lanes([0.2, 0.5, 0.8, 0.4]), Lanes([1.0, 0.9, 0.8, 1.0]), nonlinear).into()
}

/// A principled surface, changed.
fn principled(change: &dyn Fn(&mut PrincipledParams)) -> Bsdf<'static> {
    let mut p = PrincipledParams {
        base: Lanes([0.2, 0.5, 0.8, 0.4]),
        luminance: 0.45,
        roughness: 0.5,
        anisotropic: 0.0,
        metallic: 0.0,
        transmission: 0.0,
        eta: 1.5,
        specular_tint: 0.0,
        coat: 0.0,
        coat_gloss: 0.0,
        sheen: 0.0,
        sheen_tint: 0.0,
        flatness: 0.0,
        thin: None,
    };
    change(&mut p);
    Principled::new(p).into()
}

/// A coloured surface of glTF, changed.
fn gltf(change: &dyn Fn(&mut MetallicRoughnessParams)) -> Bsdf<'static> {
    let base = Lanes([0.2, 0.5, 0.8, 1.0]);
    let back = Lanes([0.9, 0.3, 0.5, 1.0]);
    let mut p = MetallicRoughnessParams {
        base,
        alpha: [0.4, 0.4],
        diffuse_transmission_color: back,
        ..MetallicRoughnessParams::default()
    };
    change(&mut p);
    MetallicRoughness::new(p).into()
}

fn metal(d: impl Into<Microfacets>) -> Conductor {
    Conductor::new(d, Lanes([0.2, 0.9, 1.1, 1.4]), Lanes([3.9, 2.5, 2.4, 1.9]))
}

/// Smooth made-up tables that depend on everything they can depend on. Normals lean as those of a rough surface do.
fn measured(azimuths: usize) -> MeasuredMaterial {
    let ramp = |n: usize, low: f32, high: f32| -> Vec<f32> {
        (0..n).map(|i| low + (high - low) * i as f32 / (n.max(2) - 1) as f32).collect()
    };
    let phi = ramp(azimuths, -std::f32::consts::PI, std::f32::consts::PI);
    let theta = ramp(4, 0.0, 1.5);
    let (n, wavelengths) = (12, ramp(5, 400.0, 700.0));
    let grid = |f: &dyn Fn(f32, f32) -> f32| -> Vec<f32> {
        (0..n * n).map(|i| f((i % n) as f32 / (n - 1) as f32, (i / n) as f32 / (n - 1) as f32)).collect()
    };
    let around = |y: f32| steradian_math::sin(steradian_math::TAU * y);
    let (mut vndf, mut luminance, mut spectra) = (Vec::new(), Vec::new(), Vec::new());
    for p in 0..azimuths {
        for t in 0..4 {
            let skew = 0.1 * (p + t) as f32;
            // Normals at the pole take no solid angle, so their density in the square vanishes there.
            vndf.extend(grid(&|x, y| x * x * x * (1.02 - x) * (1.5 + skew * around(y))));
            luminance.extend(grid(&|x, y| 0.3 + x + skew * y));
            for l in 0..wavelengths.len() {
                spectra.extend(grid(&|x, y| 0.02 * (1.0 + skew * x + l as f32 * y)));
            }
        }
    }
    let size = [n, n];
    MeasuredMaterial::new(MeasuredTables {
        phi,
        theta,
        wavelengths,
        ndf: (grid(&|x, _| 2.0 * x * (1.02 - x)), size),
        sigma: (grid(&|x, _| 1.1 - 0.5 * x), size),
        vndf: (vndf, size),
        luminance: (luminance, size),
        spectra: (spectra, size),
    })
    .unwrap_or_else(|e| panic!("{e}"))
}

static ISOTROPIC: LazyLock<MeasuredMaterial> = LazyLock::new(|| measured(1));
static ANISOTROPIC: LazyLock<MeasuredMaterial> = LazyLock::new(|| measured(5));

/// A lobe about a normal that was elsewhere.
fn tilted(lobe: impl Into<Bsdf<'static>>, up: [f32; 3], shadowing: bool) -> Bsdf<'static> {
    Bumped::new(lobe.into(), Vec3::from_array(up).normalize(), shadowing)
        .unwrap_or_else(|| panic!("not to be tilted"))
        .into()
}

/// Every kind of lobe, with parameters at and between the borders of its regimes.
fn table() -> Vec<(&'static str, Bsdf<'static>)> {
    let paint = |coat, coating| Layered::new(coat, Diffuse::new(Lanes([0.1, 0.4, 0.7, 0.9])), coating);
    let fog = Coating {
        thickness: 0.5,
        albedo: Lanes([0.9, 0.5, 0.2, 0.7]),
        g: 0.4,
        walks: 2,
        max_depth: 200,
        ..Coating::default()
    };
    vec![
        ("diffuse", Diffuse::new(Lanes([0.2, 0.5, 0.8, 1.0])).into()),
        ("translucent", DiffuseTransmission::new(Lanes([0.2, 0.3, 0.1, 0.4]), Lanes([0.7, 0.1, 0.5, 0.3])).into()),
        ("transmitting only", DiffuseTransmission::new(Lanes::ZERO, Lanes::splat(0.8)).into()),
        ("mirror metal", metal(TrowbridgeReitz::smooth()).into()),
        ("polished metal", metal(ggx(0.08, 0.08)).into()),
        ("brushed metal", metal(ggx(0.1, 0.5)).into()),
        ("rough metal", metal(ggx(0.9, 0.9)).into()),
        ("glass", Dielectric::new(1.5, TrowbridgeReitz::smooth()).into()),
        ("air bubble", Dielectric::new(1.0 / 1.33, TrowbridgeReitz::smooth()).into()),
        ("no interface", Dielectric::new(1.0, ggx(0.3, 0.3)).into()),
        ("frosted glass", Dielectric::new(1.5, ggx(0.2, 0.2)).into()),
        ("rough anisotropic glass", Dielectric::new(1.8, ggx(0.7, 0.3)).into()),
        ("rough bubble", Dielectric::new(1.0 / 1.5, ggx(0.4, 0.4)).into()),
        ("pane", ThinDielectric::new(1.5).into()),
        ("blond hair", Hair::new(0.3, 1.55, Lanes([0.1, 0.2, 0.5, 0.0]), 0.3, 0.3, 2.0).into()),
        ("edge of black hair", Hair::new(-0.95, 1.55, Lanes([3.0, 5.0, 9.0, 2.0]), 0.3, 0.4, 2.0).into()),
        ("measured", Measured::new(&ISOTROPIC, &Wavelengths::sample_uniform(0.1, 400.0, 700.0)).into()),
        ("measured, anisotropic, in RGB", Measured::new(&ANISOTROPIC, &Wavelengths::rgb()).into()),
        ("subsurface exit", SubsurfaceExit::new(1.4).into()),
        ("plastic", gltf(&|_| {})),
        ("half metal", gltf(&|p| (p.metallic, p.alpha) = (0.5, [0.3, 0.3]))),
        ("brushed", gltf(&|p| (p.metallic, p.alpha) = (1.0, [0.6, 0.15]))),
        ("tinted pane", gltf(&|p| (p.transmission, p.alpha) = (0.8, [0.2, 0.2]))),
        ("tinted glass", gltf(&|p| (p.transmission, p.thin, p.alpha) = (0.7, false, [0.3, 0.3]))),
        ("leaf", gltf(&|p| p.diffuse_transmission = 0.6)),
        ("car paint", gltf(&|p| (p.coat, p.metallic) = ([0.9, 0.15], 0.3))),
        ("velvet", gltf(&|p| (p.sheen, p.sheen_alpha) = (Lanes([0.9, 0.4, 0.2, 0.6]), 0.2))),
        (
            "soap",
            gltf(&|p| {
                let lambda = Lanes([630.0, 540.0, 460.0, 500.0]);
                p.film = Some(Film { factor: 0.8, eta: 1.3, thickness: 420.0, lambda, width: 20.0 });
                (p.transmission, p.metallic) = (0.4, 0.3);
            }),
        ),
        ("beckmann metal", metal(beckmann(0.3, 0.3)).into()),
        ("brushed beckmann metal", metal(beckmann(0.15, 0.5)).into()),
        ("separable metal", metal(Microfacets::SeparableTrowbridgeReitz(ggx(0.4, 0.2))).into()),
        ("beckmann glass", Dielectric::new(1.5, beckmann(0.25, 0.25)).into()),
        ("beckmann bubble", Dielectric::new(1.0 / 1.5, beckmann(0.4, 0.2)).into()),
        ("tinted glass of no kind", altered(SimpleInterface::Dielectric(Dielectric::new(1.5, ggx(0.3, 0.3))))),
        ("tinted mirror", altered(SimpleInterface::Conductor(metal(TrowbridgeReitz::smooth())))),
        ("tinted window", altered(SimpleInterface::ThinDielectric(ThinDielectric::new(1.5)))),
        ("mitsuba plastic", plastic(PlasticInterface::Smooth { internal: 0.6 }, false)),
        ("rough mitsuba plastic", plastic(PlasticInterface::Rough(beckmann(0.3, 0.3), &PLASTIC_TABLE), true)),
        ("principled", principled(&|_| {})),
        ("principled metal", principled(&|p| (p.metallic, p.anisotropic, p.roughness) = (1.0, 0.7, 0.6))),
        ("principled coat", principled(&|p| (p.coat, p.coat_gloss, p.specular_tint) = (1.0, 0.1, 0.6))),
        ("principled glass", principled(&|p| (p.transmission, p.metallic) = (0.8, 0.1))),
        ("principled felt", principled(&|p| (p.sheen, p.sheen_tint, p.flatness) = (0.9, 0.5, 0.7))),
        ("principled leaf", principled(&|p| (p.thin, p.transmission, p.specular_tint) = (Some(0.4), 0.3, 0.5))),
        ("tilted diffuse", tilted(Diffuse::new(Lanes([0.2, 0.5, 0.8, 1.0])), [0.3, -0.2, 0.9], true)),
        ("tilted far", tilted(Diffuse::new(Lanes([0.2, 0.5, 0.8, 1.0])), [0.9, 0.1, 0.3], true)),
        ("tilted, without shadows", tilted(principled(&|_| {}), [0.0, 0.5, 0.8], false)),
        (
            "tilted glass",
            tilted(altered(SimpleInterface::Dielectric(Dielectric::new(1.5, ggx(0.3, 0.3)))), [0.2, 0.3, 0.9], true),
        ),
        (
            "tilted mirror",
            tilted(altered(SimpleInterface::Conductor(metal(TrowbridgeReitz::smooth()))), [0.4, 0.0, 0.9], true),
        ),
        ("rough fur", Hair::new(-0.6, 1.4, Lanes([0.4, 0.1, 1.0, 0.2]), 0.9, 0.9, 5.0).into()),
        ("paint", paint(Dielectric::new(1.5, TrowbridgeReitz::smooth()), Coating::default()).into()),
        ("matt paint", paint(Dielectric::new(1.5, ggx(0.4, 0.4)), Coating { walks: 2, ..Coating::default() }).into()),
        ("foggy paint", paint(Dielectric::new(1.3, ggx(0.3, 0.5)), fog).into()),
        (
            "varnished metal",
            Layered::new(Dielectric::new(1.5, ggx(0.3, 0.3)), metal(ggx(0.5, 0.5)), Coating::default()).into(),
        ),
        (
            "foggy varnished mirror",
            Layered::new(Dielectric::new(1.5, TrowbridgeReitz::smooth()), metal(TrowbridgeReitz::smooth()), fog).into(),
        ),
    ]
}

/// Attenuation in hair depends on the viewing direction alone, and so do the tables of measurements; neither is the same
/// both ways; the shadows of bumps fall on the side of the light. Leaving the inside is half of an event.
fn is_reciprocal(bsdf: &Bsdf) -> bool {
    !is_layered(bsdf) && !matches!(bsdf, Bsdf::Hair(_) | Bsdf::Measured(_) | Bsdf::SubsurfaceExit(_) | Bsdf::Bumped(_))
}

fn is_layered(bsdf: &Bsdf) -> bool {
    matches!(bsdf, Bsdf::CoatedDiffuse(_) | Bsdf::CoatedConductor(_))
}

/// Viewing directions: steep, oblique, grazing, and from below.
fn views() -> [Vec3; 5] {
    [(1.0f32, 0.0), (0.7, 0.4), (0.15, 2.0), (-0.5, 1.0), (-0.9, -2.0)]
        .map(|(cos, phi)| Vec3::spherical((1.0 - cos * cos).sqrt(), cos, phi))
}

fn draw(bsdf: &Bsdf, wo: Vec3, rng: &mut TestRng, mode: TransportMode, part: Part) -> Option<LobeSample> {
    let u_lobe = rng.f32();
    bsdf.sample_part(wo, u_lobe, rng.f32_2d(), mode, part)
}

/// Mean of a stream of lanes and the variance of that mean, for lane `i`.
struct Means {
    sum: [f64; 4],
    squares: [f64; 4],
    count: f64,
}

impl Means {
    fn of(count: u32, mut f: impl FnMut() -> Lanes) -> Self {
        let mut means = Self { sum: [0.0; 4], squares: [0.0; 4], count: f64::from(count) };
        for _ in 0..count {
            let x = f();
            for i in 0..4 {
                means.sum[i] += f64::from(x[i]);
                means.squares[i] += f64::from(x[i]) * f64::from(x[i]);
            }
        }
        means
    }

    fn mean(&self, i: usize) -> f64 {
        self.sum[i] / self.count
    }

    fn variance_of_mean(&self, i: usize) -> f64 {
        let variance = (self.squares[i] / self.count - self.mean(i) * self.mean(i)).max(0.0);
        variance / self.count
    }

    /// Two independent estimates of the same number.
    fn assert_same(&self, other: &Self, what: &str) {
        for i in 0..4 {
            // Rounding of the sums is not the tests' business.
            let variance = self.variance_of_mean(i) + other.variance_of_mean(i) + 1e-10;
            let p = z_test(self.mean(i), variance, other.mean(i));
            assert!(
                p > SIGNIFICANCE,
                "{what}, lane {i}: {} and {} differ, standard deviation {}, p-value {p:e}",
                self.mean(i),
                other.mean(i),
                variance.sqrt()
            );
        }
    }
}

#[test]
fn samples_follow_the_density() {
    let mut tests = 0;
    for (name, bsdf) in table() {
        if is_layered(&bsdf) || !bsdf.flags().is_non_specular() {
            continue;
        }
        for wo in views() {
            for part in PARTS {
                // Parts of these are all directions but those of the other side, and their densities take long.
                let layered = matches!(bsdf, Bsdf::MetallicRoughness(_)) && name != "tinted glass";
                if part != Part::All && (layered || matches!(bsdf, Bsdf::Hair(_) | Bsdf::Measured(_))) {
                    continue;
                }
                let test = ChiSquareTest { samples: 50_000, columns: 32, rows: 16, ..ChiSquareTest::default() };
                let mode = TransportMode::Radiance;
                test.sphere(
                    &format!("{name} from {wo:?}, {part:?}"),
                    // What is mirrored exactly has no density: it counts as not drawn.
                    |rng| {
                        let drawn = draw(&bsdf, wo, rng, mode, part)?;
                        (!drawn.flags.contains(Lobes::SPECULAR)).then(|| drawn.wi.to_array())
                    },
                    |w| bsdf.pdf_part(wo, Vec3::from_array(w), mode, part),
                )
                .assert(SIGNIFICANCE);
                tests += 1;
            }
        }
    }
    assert!(tests >= 100, "only {tests} tests were done");
}

#[test]
fn samples_are_what_they_say() {
    for (name, bsdf) in table() {
        let mut rng = TestRng::new(3);
        let cases = views().into_iter().flat_map(|w| MODES.map(|m| (w, m)));
        for (wo, mode, part) in cases.flat_map(|(w, m)| PARTS.map(|p| (w, m, p))) {
            for _ in 0..500 {
                let Some(s) = draw(&bsdf, wo, &mut rng, mode, part) else { continue };
                let what = format!("{name} from {wo:?}: {s:?}");
                assert!((s.wi.length() - 1.0).abs() < 1e-4 && s.wi.z != 0.0, "{what}");
                assert!(s.weight.is_finite() && s.weight.min_component() >= 0.0, "{what}");
                assert!(s.pdf > 0.0 && s.pdf.is_finite(), "{what}");
                let reflects = s.wi.z * wo.z > 0.0;
                assert_eq!(s.flags.is_reflective(), reflects, "{what}");
                assert_eq!(s.flags.is_transmissive(), !reflects, "{what}");
                let kinds = [Lobes::DIFFUSE, Lobes::GLOSSY, Lobes::SPECULAR];
                assert_eq!(kinds.iter().filter(|k| s.flags.contains(**k)).count(), 1, "{what}");
                assert!(part != Part::Reflection || reflects, "{what}");
                assert!(part != Part::Transmission || !reflects, "{what}");
                assert!(!s.flags.is_specular() || bsdf.flags().is_specular(), "{what}");
                assert!(!reflects || s.eta == 1.0, "{what}");
                assert_eq!(s.pdf_is_proportional, is_layered(&bsdf), "{what}");
            }
        }
    }
}

#[test]
fn weight_is_value_over_density() {
    for (name, bsdf) in table() {
        if is_layered(&bsdf) || !bsdf.flags().is_non_specular() {
            continue;
        }
        let mut rng = TestRng::new(5);
        let mut compared = 0;
        for wo in views() {
            for mode in MODES {
                for _ in 0..2000 {
                    let Some(s) = draw(&bsdf, wo, &mut rng, mode, Part::All) else { continue };
                    if s.flags.is_specular() {
                        // A Dirac part beside others; values and densities are those of the others.
                        continue;
                    }
                    let (value, pdf) = bsdf.eval_and_pdf(wo, s.wi, mode);
                    let alone = bsdf.eval_cos(wo, s.wi, mode);
                    assert!((0..4).all(|i| (value[i] - alone[i]).abs() <= 2e-6 * alone[i]), "{value:?} {alone:?}");
                    let alone = bsdf.pdf(wo, s.wi, mode);
                    assert!((pdf - alone).abs() <= 2e-6 * alone, "{name}: {pdf} {alone}");
                    if s.wi.z.abs() < 1e-3 || pdf == 0.0 {
                        // The half vector of a grazing pair is lost to rounding.
                        continue;
                    }
                    compared += 1;
                    assert!((pdf / s.pdf - 1.0).abs() < 0.02, "{name}: density {pdf} and sampled {}", s.pdf);
                    for i in 0..4 {
                        let ratio = value[i] / pdf;
                        assert!(
                            (ratio - s.weight[i]).abs() <= 1e-4 + 5e-3 * s.weight[i],
                            "{name} from {wo:?} to {:?}, {mode:?}: ratio {ratio}, weight {}",
                            s.wi,
                            s.weight[i]
                        );
                    }
                }
            }
        }
        assert!(compared > 3000, "{name}: only {compared} samples compared");
    }
}

#[test]
fn scattering_is_reciprocal() {
    // Radiance one way is importance the other way, which contains the factor eta^2 of refraction.
    for (name, bsdf) in table() {
        if !is_reciprocal(&bsdf) {
            continue;
        }
        let mut rng = TestRng::new(7);
        for _ in 0..3000 {
            let (wo, wi) = (Vec3::from_array(rng.direction()), Vec3::from_array(rng.direction()));
            let there = bsdf.eval(wo, wi, TransportMode::Radiance);
            let back = bsdf.eval(wi, wo, TransportMode::Importance);
            for i in 0..4 {
                let scale = there[i].max(back[i]).max(1e-3);
                assert!((there[i] - back[i]).abs() < 2e-3 * scale, "{name}: {wo:?} {wi:?}: {there:?} and {back:?}");
            }
        }
    }
}

#[test]
fn layered_scattering_is_reciprocal_on_average() {
    for (name, bsdf) in table() {
        if !is_layered(&bsdf) {
            continue;
        }
        for (wo, wi) in [(views()[1], views()[2]), (views()[0], views()[2])] {
            let estimate = |a: Vec3, b: Vec3, mode: TransportMode, first: u64| {
                let mut seed = first;
                Means::of(6_000, || {
                    seed += 1;
                    with_seed(&bsdf, seed).eval(a, b, mode)
                })
            };
            let there = estimate(wo, wi, TransportMode::Radiance, 0);
            there.assert_same(&estimate(wi, wo, TransportMode::Radiance, 1 << 40), name);
            there.assert_same(&estimate(wi, wo, TransportMode::Importance, 1 << 41), name);
        }
    }
}

/// The same layers with other random numbers.
fn with_seed<'w>(bsdf: &Bsdf<'w>, seed: u64) -> Bsdf<'w> {
    match *bsdf {
        Bsdf::CoatedDiffuse(l) => Layered::new(*l.coat(), *l.base(), Coating { seed, ..*l.coating() }).into(),
        Bsdf::CoatedConductor(l) => Layered::new(*l.coat(), *l.base(), Coating { seed, ..*l.coating() }).into(),
        other => other,
    }
}

#[test]
fn no_lobe_creates_energy() {
    for (name, bsdf) in table() {
        // Disney's coat and sheen are added to the base, whatever that reflects already.
        if matches!(bsdf, Bsdf::Principled(_)) {
            continue;
        }
        for wo in views() {
            let mut rng = TestRng::new(11);
            let mean = Means::of(10_000, || {
                draw(&bsdf, wo, &mut rng, TransportMode::Importance, Part::All).map_or(Lanes::ZERO, |s| s.weight)
            });
            for i in 0..4 {
                // Seven standard deviations.
                let bound = 1.0 + 7.0 * mean.variance_of_mean(i).sqrt() + 1e-5;
                assert!(mean.mean(i) <= bound, "{name} from {wo:?}, lane {i}: albedo {}", mean.mean(i));
            }
        }
    }
}

/// Integral of `eval_cos` over a band of cosines by uniform directions, against the weights of the samples that fall into
/// it: value and sampling of a lobe must be the same lobe, also where the density is only proportional.
#[test]
fn values_integrate_to_the_weights() {
    for (name, bsdf) in table() {
        if !bsdf.flags().is_non_specular() {
            continue;
        }
        // A walk costs as much as many closed forms.
        let count = if is_layered(&bsdf) { 8_000 } else { 20_000 };
        for wo in [views()[1], views()[2], views()[3]] {
            for band in [-1.0f32, -0.5, 0.0, 0.3, 0.6, 0.8] {
                let width = if band < 0.0 { 0.5 } else { 0.3 };
                let inside = |w: Vec3| (band..band + width).contains(&w.z);
                let mut rng = TestRng::new(13);
                let mode = TransportMode::Radiance;
                let values = Means::of(count, || {
                    let (z, phi) = (band + width * rng.f32(), std::f32::consts::TAU * rng.f32());
                    if z.abs() > 1.0 {
                        return Lanes::ZERO;
                    }
                    let wi = Vec3::spherical((1.0 - z * z).sqrt(), z, phi);
                    bsdf.eval_cos(wo, wi, mode) * (std::f32::consts::TAU * width)
                });
                let weights = Means::of(count, || {
                    draw(&bsdf, wo, &mut rng, mode, Part::All)
                        .filter(|s| !s.flags.is_specular() && inside(s.wi))
                        .map_or(Lanes::ZERO, |s| s.weight)
                });
                values.assert_same(&weights, &format!("{name} from {wo:?}, band from {band}"));
            }
        }
    }
}

#[test]
fn furnaces_are_white() {
    let white_gltf = |metallic: f32, alpha: f32| -> Bsdf {
        let p = MetallicRoughnessParams { metallic, alpha: [alpha; 2], ..MetallicRoughnessParams::default() };
        MetallicRoughness::new(p).into()
    };
    let white = Diffuse::new(Lanes::ONE);
    let thin = Coating { thickness: 1e-6, max_depth: 2000, ..Coating::default() };
    let milk = Coating { thickness: 0.7, albedo: Lanes::ONE, g: -0.3, max_depth: 5000, ..Coating::default() };
    // A perfect mirror as the limit of a metal: no real part, a large imaginary one.
    let silver = Conductor::new(TrowbridgeReitz::smooth(), Lanes::ZERO, Lanes::splat(1e6));
    let lossless: Vec<(&str, Bsdf)> = vec![
        ("diffuse", white.into()),
        ("translucent", DiffuseTransmission::new(Lanes::splat(0.25), Lanes::splat(0.75)).into()),
        ("glass", Dielectric::new(1.5, TrowbridgeReitz::smooth()).into()),
        ("pane", ThinDielectric::new(1.5).into()),
        ("silver", silver.into()),
        ("white hair", Hair::new(0.4, 1.55, Lanes::ZERO, 0.3, 0.3, 2.0).into()),
        ("rough white hair", Hair::new(-0.8, 1.55, Lanes::ZERO, 0.8, 0.7, 3.0).into()),
        ("paint", Layered::new(Dielectric::new(1.5, TrowbridgeReitz::smooth()), white, thin).into()),
        ("white plastic", white_gltf(0.0, 0.4)),
        ("rough white plastic", white_gltf(0.0, 1.0)),
        ("rough white metal", white_gltf(1.0, 0.8)),
        ("half white metal", white_gltf(0.5, 0.2)),
        ("milk", Layered::new(Dielectric::new(1.5, TrowbridgeReitz::smooth()), white, milk).into()),
        ("milk on silver", Layered::new(Dielectric::new(1.33, TrowbridgeReitz::smooth()), silver, milk).into()),
    ];
    for (name, bsdf) in lossless {
        for wo in views() {
            let mut rng = TestRng::new(17);
            let mean = Means::of(20_000, || {
                draw(&bsdf, wo, &mut rng, TransportMode::Importance, Part::All).map_or(Lanes::ZERO, |s| s.weight)
            });
            let p = z_test(mean.mean(0), mean.variance_of_mean(0) + 1e-9, 1.0);
            assert!(p > SIGNIFICANCE, "{name} from {wo:?}: albedo {}, p-value {p:e}", mean.mean(0));
        }
    }
}

#[test]
fn evaluation_stays_finite_on_hostile_input() {
    let mut rng = TestRng::new(23);
    let odd = |rng: &mut TestRng| {
        let mut w = Vec3::from_array(rng.direction());
        match rng.u64() % 6 {
            0 => w.z = 0.0,
            1 => w.z *= 1e-6,
            2 => w = Vec3::new(0.0, 0.0, w.z.signum()),
            3 => w = Vec3::new(w.x * 1e-4, w.y * 1e-4, w.z),
            _ => {}
        }
        w.normalize()
    };
    for round in 0..300 {
        let alpha = [0.0, 1e-3, 0.0011, 0.02, 1.0, 5.0][round % 6];
        let eta = [1.0, 1.0001, 1.5, 0.4, 10.0][round % 5];
        let d = ggx(alpha, rng.f32());
        let coat = Dielectric::new(eta, d);
        let coating = Coating {
            thickness: [0.0, 1e-20, 0.01, 1e6][round % 4],
            albedo: Lanes::splat([0.0, 1.0][round % 2]),
            g: [-1.0, 0.0, 1.0][round % 3],
            ..Coating::default()
        };
        let lobes: [Bsdf; 7] = [
            Hair::new(alpha - 1.0, eta, Lanes::splat(coating.thickness), alpha, rng.f32(), 2.0 * alpha).into(),
            metal(d).into(),
            coat.into(),
            ThinDielectric::new(eta).into(),
            Diffuse::new(Lanes::ONE).into(),
            Layered::new(coat, Diffuse::new(Lanes::splat(0.5)), coating).into(),
            Layered::new(coat, metal(ggx(rng.f32(), alpha)), coating).into(),
        ];
        for bsdf in lobes {
            for _ in 0..20 {
                let (wo, wi) = (odd(&mut rng), odd(&mut rng));
                for mode in MODES {
                    let (value, pdf) = bsdf.eval_and_pdf(wo, wi, mode);
                    assert!(value.is_finite() && value.min_component() >= 0.0, "{bsdf:?} {wo:?} {wi:?}: {value:?}");
                    assert!(pdf.is_finite() && pdf >= 0.0, "{bsdf:?} {wo:?} {wi:?}: {pdf}");
                    if let Some(s) = draw(&bsdf, wo, &mut rng, mode, Part::All) {
                        let good = s.weight.is_finite() && s.weight.min_component() >= 0.0 && s.pdf > 0.0;
                        assert!(good && (s.wi.length() - 1.0).abs() < 1e-3, "{bsdf:?} {wo:?}: {s:?}");
                    }
                }
            }
            assert!(bsdf.sample(Vec3::new(1.0, 0.0, 0.0), 0.5, [0.5; 2], TransportMode::Radiance).is_none());
        }
    }
}

#[test]
fn fixed_albedo_is_close_to_the_mean_weight() {
    for (name, bsdf) in table() {
        for wo in [views()[0], views()[1], views()[3]] {
            let mut rng = TestRng::new(29);
            let mean = Means::of(20_000, || {
                draw(&bsdf, wo, &mut rng, TransportMode::Importance, Part::All).map_or(Lanes::ZERO, |s| s.weight)
            });
            let albedo = bsdf.albedo(wo);
            for i in 0..4 {
                let error = (f64::from(albedo[i]) - mean.mean(i)).abs();
                // Sixteen walks of the layered lobes are a rough estimate.
                let bound = if is_layered(&bsdf) { 0.4 } else { 0.15 };
                assert!(error < bound, "{name} from {wo:?}, lane {i}: {} and {}", albedo[i], mean.mean(i));
            }
        }
    }
}

#[test]
fn flags_tell_the_truth() {
    for (name, bsdf) in table() {
        let mut rng = TestRng::new(31);
        let mut seen = Lobes::NONE;
        for _ in 0..20_000 {
            let wo = Vec3::from_array(rng.direction());
            if let Some(s) = draw(&bsdf, wo, &mut rng, TransportMode::Radiance, Part::All) {
                seen |= s.flags;
            }
            let wi = Vec3::from_array(rng.direction());
            let value = bsdf.eval(wo, wi, TransportMode::Radiance);
            let side = if wo.z * wi.z > 0.0 { Lobes::REFLECTION } else { Lobes::TRANSMISSION };
            assert!(value.is_black() || bsdf.flags().contains(side) && bsdf.flags().is_non_specular(), "{name}");
        }
        let sides = Lobes::REFLECTION | Lobes::TRANSMISSION;
        assert_eq!(seen & sides, bsdf.flags() & sides, "{name}");
        assert_eq!(seen.is_specular(), bsdf.flags().is_specular(), "{name}");
        assert_eq!(seen.is_non_specular(), bsdf.flags().is_non_specular(), "{name}");
    }
}
