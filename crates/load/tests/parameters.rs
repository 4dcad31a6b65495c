//! Parameters by name: what is set is what is found, and what makes no sense is refused.

use std::collections::BTreeMap;
use std::path::Path;
use steradian_load::{Input, LoadOptions, Memory, load_pbrt};
use steradian_scene::{Scene, Value};

const TEXT: &str = r#"
LookAt 0 1 -4   0 0 0   0 1 0
Camera "perspective" "float fov" 50
WorldBegin
LightSource "point" "rgb I" [ 2 4 6 ] "point3 from" [ 1 2 3 ]
LightSource "infinite" "rgb L" [ 0.5 0.5 0.5 ] "float scale" 2
MakeNamedMaterial "wall" "string type" "diffuse" "rgb reflectance" [ 0.5 0.5 0.5 ]
MakeNamedMaterial "metal" "string type" "conductor" "float roughness" 0.2
NamedMaterial "wall"
Shape "sphere"
Material "diffuse" "rgb reflectance" [ 0.5 0.5 0.5 ]
AreaLightSource "diffuse" "rgb L" [ 3 2 1 ]
Shape "sphere" "float radius" 2
"#;

fn scene() -> Scene {
    let input = Input::Text { name: "t", text: TEXT, directory: Path::new("") };
    load_pbrt(input, &Memory::new(), &LoadOptions::default()).scene.expect("a good scene")
}

fn near(a: Option<&Value>, b: [f32; 3]) -> bool {
    matches!(a, Some(Value::Triple(v)) if v.iter().zip(b).all(|(x, y)| (x - y).abs() < 2e-3 * y.abs().max(1.0)))
}

#[test]
fn what_is_set_is_what_is_found_and_nothing_else_changes() {
    let mut scene = scene();
    let before: BTreeMap<String, Value> = scene.parameters().into_iter().collect();
    assert!(near(before.get("lights.0.intensity"), [2.0, 4.0, 6.0]), "{before:?}");
    assert!(near(before.get("lights.1.radiance"), [1.0, 1.0, 1.0]), "{before:?}");
    assert!(near(before.get("shapes.1.emission"), [3.0, 2.0, 1.0]), "{before:?}");
    assert_eq!(before["camera.fov"], Value::Float(50.0));
    let changes = [
        ("camera.fov", Value::Integer(45)),
        ("camera.lens_radius", Value::Float(0.1)),
        ("sampler.seed", Value::Integer(u64::MAX)),
        ("lights.0.intensity", Value::Triple([5.0, 1.0, 0.5])),
        ("lights.0.position", Value::Triple([0.0, -1.0, 2.0])),
        ("shapes.1.emission", Value::Triple([0.5, 0.5, 4.0])),
        ("materials.wall.reflectance", Value::Triple([0.1, 0.2, 0.9])),
        ("materials.metal.roughness_u", Value::Float(0.3)),
        ("materials.wall.reflectance", Value::Float(0.25)),
    ];
    for (name, value) in &changes {
        let old: BTreeMap<String, Value> = scene.parameters().into_iter().collect();
        scene.set_parameter(name, value).unwrap();
        let new: BTreeMap<String, Value> = scene.parameters().into_iter().collect();
        let changed: Vec<&String> = new.iter().filter(|(n, v)| old[*n] != **v).map(|(n, _)| n).collect();
        assert_eq!(changed, [name]);
        match value {
            Value::Triple(v) => assert!(near(new.get(*name), *v), "{name}: {:?}", new[*name]),
            Value::Float(v) if name.ends_with("reflectance") => assert!(near(new.get(*name), [*v; 3])),
            Value::Integer(45) => assert_eq!(new[*name], Value::Float(45.0)),
            v => assert_eq!(&new[*name], v),
        }
    }
}

#[test]
fn values_that_make_no_sense_are_refused_and_change_nothing() {
    let mut scene = scene();
    let before = scene.parameters();
    let mut said = |name: &str, value: Value| scene.set_parameter(name, &value).unwrap_err().to_string();
    assert_eq!(said("camera.fv", Value::Float(1.0)), "there is no parameter `camera.fv`");
    assert_eq!(
        said("camera.fov", Value::Float(180.0)),
        "`camera.fov` cannot be 180: it must be between 0 and 180 degrees"
    );
    assert_eq!(said("camera.fov", Value::Triple([1.0; 3])), "`camera.fov` is a number, not [1.0, 1.0, 1.0]");
    assert_eq!(
        said("materials.wall.reflectance", Value::Triple([2.0; 3])),
        "`materials.wall.reflectance` cannot be [2.0, 2.0, 2.0]: it must be from 0 to 1"
    );
    assert!(said("lights.0.intensity", Value::Triple([-1.0; 3])).ends_with("it must not be negative"));
    assert!(said("camera.to_world", Value::Matrix([[0.0; 4]; 4])).ends_with("it cannot be inverted"));
    assert!(said("camera.to_world", Value::Matrix([[f32::NAN; 4]; 4])).ends_with("it must be a finite number"));
    assert_eq!(scene.parameters(), before);
}
