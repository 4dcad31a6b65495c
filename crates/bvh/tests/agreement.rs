//! Every traversal (scalar, and SIMD on each instruction set of this machine) against brute force, on random and on
//! degenerate boxes.

use proptest::prelude::*;
use steradian_bvh::{BuildError, BuildOptions, Bvh, Primitive, available_levels};
use steradian_math::{Bounds3, Point3, Ray, Vec3};

/// The distance at which a ray enters a box, exactly as rational geometry would have it, up to `f64` rounding.
fn exact_entry(b: &Bounds3, ray: &Ray) -> Option<f64> {
    let (mut near, mut far) = (0.0f64, f64::from(ray.t_max));
    for a in 0..3 {
        let (o, d) = (f64::from(ray.o[a]), f64::from(ray.d[a]));
        let (lo, hi) = (f64::from(b.min[a]), f64::from(b.max[a]));
        if d == 0.0 {
            if o < lo || o > hi {
                return None;
            }
            continue;
        }
        let (t0, t1) = ((lo - o) / d, (hi - o) / d);
        near = near.max(t0.min(t1));
        far = far.min(t0.max(t1));
    }
    (near <= far).then_some(near)
}

/// All traversals must visit every primitive whose box the ray exactly enters, and find the same nearest box.
fn check(primitives: &[Primitive], options: &BuildOptions, rays: &[Ray]) {
    let mut bvh = Bvh::build(primitives.iter().copied(), options).expect("boxes are finite");
    bvh.validate(primitives).expect("the tree is valid");
    for ray in rays {
        let entries: Vec<Option<f64>> = primitives.iter().map(|p| exact_entry(&p.bounds, ray)).collect();
        // The nearest box, ties by index, by brute force in f32 as a leaf closure would compute it.
        let entry32 = |i: usize| entries[i].map(|t| t as f32);
        let expected = (0..primitives.len())
            .filter_map(|i| entry32(i).map(|t| (t, i)))
            .min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let nearest = |order: &[u32], leaf: steradian_bvh::Leaf, t_max: &mut f32, best: &mut Option<(f32, usize)>| {
            for position in leaf.range() {
                let i = order[position] as usize;
                if let Some(t) = entry32(i)
                    && best.is_none_or(|b| (t, i) < b)
                    && t <= *t_max
                {
                    *best = Some((t, i));
                    *t_max = t;
                }
            }
        };
        let mut best = None;
        bvh.closest_reference(ray, |leaf, t| nearest(bvh.order(), leaf, t, &mut best));
        assert_eq!(best, expected, "scalar, {ray:?}");
        for level in available_levels() {
            bvh.set_level(level);
            let mut best = None;
            bvh.closest(ray, |leaf, t| nearest(bvh.order(), leaf, t, &mut best));
            assert_eq!(best, expected, "{level:?}, {ray:?}");
            let mut visited = vec![false; primitives.len()];
            let found = bvh.any(ray, |leaf| {
                leaf.range().for_each(|p| visited[bvh.order()[p] as usize] = true);
                false
            });
            assert!(!found);
            for (i, e) in entries.iter().enumerate() {
                assert!(e.is_none() || visited[i], "{level:?} lost box {i}, {ray:?}");
            }
            assert_eq!(
                bvh.any(ray, |l| l.range().any(|p| entries[bvh.order()[p] as usize].is_some())),
                expected.is_some()
            );
        }
    }
}

fn primitive(a: [f32; 3], b: [f32; 3], kind: u8) -> Primitive {
    Primitive { bounds: Bounds3::new(a.into(), b.into()), kind }
}

fn axis_rays() -> Vec<Ray> {
    let mut rays = Vec::new();
    for d in [[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [-0.0, -0.0, -2.0], [1.0, 1.0, 0.0], [0.3, -0.5, 0.8]]
    {
        for o in [[0.0, 0.0, 0.0], [1.0, 1.0, -3.0], [-2.0, 0.5, 0.5], [0.5, 3.0, 1.0]] {
            rays.push(Ray::new(o.into(), d.into(), 0.0));
        }
    }
    rays
}

/// A coordinate from a coarse grid (so that faces, edges and entry distances coincide) or from anywhere.
fn coordinate() -> impl Strategy<Value = f32> {
    prop_oneof![(-4i32..5).prop_map(|i| i as f32), -4.0f32..4.0]
}

fn triple() -> impl Strategy<Value = [f32; 3]> {
    [coordinate(), coordinate(), coordinate()]
}

prop_compose! {
    fn any_primitive()(a in triple(), size in triple(), flat in 0usize..6, kind in 0u8..2) -> Primitive {
        let mut b = [a[0] + 0.3 * size[0], a[1] + 0.3 * size[1], a[2] + 0.3 * size[2]];
        if flat < 3 { b[flat] = a[flat]; }
        primitive(a, b, kind)
    }
}

prop_compose! {
    fn any_ray()(o in triple(), d in triple(), t in prop_oneof![Just(f32::INFINITY), 0.0f32..10.0]) -> Ray {
        let d = if d == [0.0; 3] { [1.0, 0.0, 0.0] } else { d };
        Ray { o: o.into(), d: d.into(), t_max: t, time: 0.0 }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, rng_seed: proptest::test_runner::RngSeed::Fixed(7), ..ProptestConfig::with_cases(200) })]

    #[test]
    fn random_boxes(
        primitives in prop::collection::vec(any_primitive(), 0..120),
        rays in prop::collection::vec(any_ray(), 12),
        leaf in 1usize..9, unit in 1usize..5,
    ) {
        check(&primitives, &BuildOptions { leaf_size: [leaf, 9 - leaf], unit: [unit, 1] }, &rays);
    }
}

#[test]
fn nothing_one_and_identical() {
    let options = BuildOptions::default();
    let one = primitive([0.0; 3], [1.0; 3], 1);
    check(&[], &options, &axis_rays());
    check(&[one], &options, &axis_rays());
    check(&vec![one; 300], &options, &axis_rays());
    let mixed: Vec<_> = (0..300).map(|i| Primitive { kind: (i % 3 == 0) as u8, ..one }).collect();
    check(&mixed, &options, &axis_rays());
    // Points: boxes of no extent at all.
    check(&vec![primitive([1.0, 1.0, 0.0], [1.0, 1.0, 0.0], 0); 20], &options, &axis_rays());
}

#[test]
fn huge_tiny_and_skewed() {
    let options = BuildOptions::default();
    let mut boxes: Vec<_> = (0..60)
        .map(|i| {
            let x = 5e36 * i as f32;
            primitive([-x, 0.0, -1e38], [-x, 1.0, 3e38], 0)
        })
        .collect();
    check(&boxes, &options, &axis_rays());
    // Sizes that halve: a heuristic without a depth limit makes a list of this.
    boxes.clear();
    let mut x = 1e30f32;
    for _ in 0..600 {
        boxes.push(primitive([x, 0.0, 0.0], [x * 1.1, 0.1, 0.1], 0));
        x *= 0.8;
    }
    check(&boxes, &options, &axis_rays());
}

#[test]
fn boxes_that_are_not_finite_are_refused() {
    let good = primitive([0.0; 3], [1.0; 3], 0);
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let mut p = good;
        p.bounds.max.y = bad;
        assert_eq!(
            Bvh::build([good, p].into_iter(), &BuildOptions::default()).err(),
            Some(BuildError::BadBounds { primitive: 1 })
        );
    }
    let empty = Primitive { bounds: Bounds3::EMPTY, kind: 0 };
    assert!(matches!(
        Bvh::build([empty].into_iter(), &BuildOptions::default()),
        Err(BuildError::BadBounds { primitive: 0 })
    ));
    let kind = Primitive { kind: 2, ..good };
    assert!(matches!(
        Bvh::build([kind].into_iter(), &BuildOptions::default()),
        Err(BuildError::BadKind { primitive: 0 })
    ));
}

#[test]
fn rays_that_are_none_reach_nothing() {
    let bvh = Bvh::build([primitive([-1.0; 3], [1.0; 3], 0)].into_iter(), &BuildOptions::default()).unwrap();
    let x = Vec3::new(1.0, 0.0, 0.0);
    let nan = f32::NAN;
    let o = Point3::default();
    for ray in [
        Ray::new(o, Vec3::default(), 0.0),
        Ray::new(o, Vec3::new(nan, 1.0, 0.0), 0.0),
        Ray::new(o, Vec3::new(f32::INFINITY, 1.0, 0.0), 0.0),
        Ray::new(Point3::new(nan, 0.0, 0.0), x, 0.0),
        Ray { t_max: nan, ..Ray::new(o, x, 0.0) },
        Ray { t_max: -1.0, ..Ray::new(o, x, 0.0) },
    ] {
        assert!(!bvh.any(&ray, |_| true), "{ray:?}");
    }
    assert!(bvh.any(&Ray::new(o, x, 0.0), |_| true));
}

#[test]
fn the_tree_does_not_depend_on_the_number_of_threads() {
    let mut state = 1u64;
    let mut next = || {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (state >> 40) as f32 / (1u64 << 24) as f32
    };
    let boxes: Vec<_> = (0..40_000)
        .map(|i| {
            let a = [next(), next(), next()];
            primitive(a, [a[0] + 0.01 * next(), a[1] + 0.01, a[2]], (i % 7 == 0) as u8)
        })
        .collect();
    let alone = Bvh::build(boxes.iter().copied(), &BuildOptions::default()).unwrap();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(3).build().unwrap();
    let together = pool.install(|| Bvh::build(boxes.iter().copied(), &BuildOptions::default()).unwrap());
    assert_eq!(alone.order(), together.order());
    assert_eq!(format!("{:?}", alone.nodes()), format!("{:?}", together.nodes()));
    alone.validate(&boxes).unwrap();
}
