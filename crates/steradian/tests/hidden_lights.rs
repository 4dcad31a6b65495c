//! `hide_emitters` of Mitsuba: the camera sees through lamps and past the sky, and everything else is lit by them.

mod common;

use common::Folder;
use steradian_image::read;

/// A lamp of radiance 5, itself grey of 0.5, between the camera and a wall below a sky of 0.5; the wall is half as wide as the view.
const SCENE: &str = r#"<scene version="3.0.0">
<integrator type="path"><integer name="max_depth" value="3"/><boolean name="hide_emitters" value="$hide"/></integrator>
<sensor type="perspective"><float name="fov" value="40"/>
<transform name="to_world"><lookat origin="0, 0, 8" target="0, 0, 0" up="0, 1, 0"/></transform>
<film type="hdrfilm"><integer name="width" value="24"/><integer name="height" value="24"/><rfilter type="box"/></film>
<sampler type="independent"><integer name="sample_count" value="64"/></sampler></sensor>
<emitter type="constant"><rgb name="radiance" value="0.5"/></emitter>
<shape type="rectangle"><transform name="to_world"><scale x="1.4" y="9"/></transform>
<bsdf type="diffuse"><rgb name="reflectance" value="0.6"/></bsdf></shape>
<shape type="rectangle"><transform name="to_world"><scale value="0.5"/><translate z="2"/></transform>
<emitter type="area"><rgb name="radiance" value="5"/></emitter></shape>
MEDIUM</scene>"#;
/// Somewhere outside of the view: the integrator is then the one for media.
const MEDIUM: &str = r#"<shape type="sphere"><point name="center" x="40" y="0" z="0"/><bsdf type="null"/>
<medium type="homogeneous" name="interior"><float name="albedo" value="0.5"/></medium></shape>"#;

/// The green of the pixels in the middle and at the left edge.
fn seen(medium: &str, hide: bool) -> [f32; 2] {
    let f = Folder::empty().with("s.xml", SCENE.replace("MEDIUM", medium));
    f.ok(&format!("render s.xml -q --color rgb -D hide={hide} -o a.exr"));
    let a = read(&f.bytes("a.exr"), "a.exr").unwrap();
    let green = &a.planes("").unwrap()[1];
    [green[12 * 24 + 12], green[12 * 24 + 1]]
}

#[test]
fn the_camera_sees_through_lamps_and_past_the_sky() {
    for medium in ["", MEDIUM] {
        let [lamp, sky] = seen(medium, false);
        assert!((lamp - 5.25).abs() < 0.05 && (sky - 0.5).abs() < 0.005, "{lamp}, {sky}");
        let [wall, nothing] = seen(medium, true);
        assert_eq!(nothing, 0.0);
        // The lamp shines away from the wall, and shades some of the sky, which alone would give 0.3.
        assert!((0.2..0.32).contains(&wall), "{wall}");
    }
}

#[test]
fn integrators_that_cannot_hide_lights_say_so() {
    let f = Folder::empty().with("s.xml", SCENE.replace("MEDIUM", ""));
    let ran = f.run("render s.xml -q -D hide=true --integrator bdpt -o a.exr");
    assert_eq!(ran.code, Some(2), "{}", ran.err);
    assert!(ran.err.contains("hides its lights"), "{}", ran.err);
    f.ok("render s.xml -q -D hide=true --integrator normals --spp 1 -o a.exr");
}
