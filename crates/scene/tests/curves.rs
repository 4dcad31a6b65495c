//! Curves in the world: placed, mirrored, instanced, shining.

mod common;

use common::{empty, grey};
use steradian_geometry::{Curve, CurveProfile};
use steradian_math::{Point3, Ray, Transform, Vec3};
use steradian_scene::{AreaLight, Instance, Object, Primitive, Scene, Shape, World};
use steradian_spectrum::{Spectrum, SpectrumUse, Wavelengths};

/// A straight curve along x, from -1 to 1, 0.2 wide.
fn strand(scene: &mut Scene, t: Transform, shines: bool) -> Primitive {
    let material = grey(scene);
    let p = [-1.0, -1.0 / 3.0, 1.0 / 3.0, 1.0].map(|x| Point3::new(x, 0.0, 0.0));
    let curve = Curve::new(p, [0.2; 2], CurveProfile::Flat).unwrap();
    let radiance = Spectrum::constant(3.0, SpectrumUse::Illuminant);
    let light =
        AreaLight { radiance, scale: 1.0, two_sided: true, power: None, image: None, group: None, texture: None };
    Primitive {
        shape: Shape::Curves(vec![curve]),
        world_from_object: t,
        reverse_orientation: false,
        material,
        area_light: shines.then_some(light),
        alpha: None,
        media: None,
    }
}

fn down(x: f32, y: f32) -> Ray {
    Ray::new(Point3::new(x, y, 4.0), Vec3::new(0.0, 0.0, -1.0), 0.0)
}

/// Rays on a grid meet the strip of the given half extent around a centre, and nothing beside it.
fn check_strip(world: &World, centre: [f32; 2], half: [f32; 2]) {
    for i in -12..=12 {
        for j in -12..=12 {
            let (dx, dy) = (i as f32 * 0.097 * half[0], j as f32 * 0.097 * half[1]);
            let ray = down(centre[0] + dx, centre[1] + dy);
            let hit = world.intersect(&ray);
            assert_eq!(hit.is_some(), dx.abs() < half[0] && dy.abs() < half[1], "{dx} {dy}");
            assert_eq!(world.occluded(&ray), hit.is_some());
            if let Some(hit) = hit {
                let s = world.surface(&ray, &hit);
                assert!((s.p - Point3::new(ray.o.x, ray.o.y, 0.0)).length() < 1e-4);
                assert!((s.n.z.abs() - 1.0).abs() < 1e-4 && (s.uv.x - (0.5 + 0.5 * dx / half[0])).abs() < 1e-3);
            }
        }
    }
}

#[test]
fn curves_are_where_their_transform_puts_them() {
    let shift = Transform::translate(Vec3::new(0.5, 0.25, 0.0));
    for (scale, half) in [
        (Transform::scale(1.5, 1.5, 1.5).unwrap(), [1.5, 0.15]),
        // The width grows with y alone: a uniform width would not.
        (Transform::scale(1.5, 3.0, 1.0).unwrap(), [1.5, 0.3]),
        (Transform::scale(1.0, -1.0, 1.0).unwrap(), [1.0, 0.1]),
    ] {
        let mut scene = empty();
        let p = strand(&mut scene, shift.mul(&scale), false);
        scene.primitives.push(p);
        check_strip(&World::build(scene).unwrap(), [0.5, 0.25], half);

        let mut scene = empty();
        let p = strand(&mut scene, scale, false);
        let object = Object { name: "strand".into(), primitives: vec![p], instances: Vec::new() };
        let object = scene.objects.push(object);
        scene.instances.push(Instance { object, world_from_object: shift.into() });
        check_strip(&World::build(scene).unwrap(), [0.5, 0.25], half);
    }
}

#[test]
fn a_shining_curve_is_seen_and_never_sampled() {
    let mut scene = empty();
    let p = strand(&mut scene, Transform::IDENTITY, true);
    scene.primitives.push(p);
    let world = World::build(scene).unwrap();
    assert_eq!(world.light_count(), 0);
    assert!(world.has_unsampled_lights());
    let ray = down(0.1, 0.02);
    let s = world.surface(&ray, &world.intersect(&ray).unwrap());
    assert!(s.light.is_none() && world.emitted(&s, &Wavelengths::rgb()).0[1] > 0.0);
}
