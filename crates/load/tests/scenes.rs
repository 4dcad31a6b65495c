//! What a scene's words become: transforms, names, defaults, units of light.

use std::io::Write;
use std::path::Path;
use steradian_geometry::TriangleMesh;
use steradian_load::{Input, LoadOptions, LoadOutcome, Memory, load_pbrt};
use steradian_math::{Normal3, PI, Point3, Transform, Vec3};
use steradian_sampling::{Randomization, SamplerKind};
use steradian_scene::{
    Bands, Bidirectional, CheckerMapping, EnvironmentMapping, FilmKind, Glow, IntegratorKind, Ior, Light,
    LightSelection, Mapping2, Metal, Metropolis, Phase, PhotonMapping, Primitive, Projection, Scattering, Scene, Shape,
    SphericalMapping, TestFunction, Texture, Volume,
};
use steradian_spectrum::{ColorSpace, SpectrumUse, cie};

fn try_load(text: &str, files: Memory) -> LoadOutcome {
    let files = files.with("dir/scene.pbrt", text);
    load_pbrt(Input::File(Path::new("dir/scene.pbrt")), &files, &LoadOptions::default())
}

fn load_with(text: &str, files: Memory) -> Scene {
    let out = try_load(text, files);
    let rendered: String = out.diagnostics.iter().map(|d| d.render(&out.sources)).collect();
    out.scene.unwrap_or_else(|| panic!("{rendered}"))
}

/// The scene of a text that has no problems at all.
fn load(text: &str) -> Scene {
    let out = try_load(text, Memory::new());
    let rendered: String = out.diagnostics.iter().map(|d| d.render(&out.sources)).collect();
    assert_eq!(rendered, "");
    out.scene.unwrap()
}

fn near(a: f32, b: f32) {
    assert!((a - b).abs() <= 1e-4 * b.abs().max(1e-3), "{a} is not {b}");
}

fn point_near(a: Point3, b: [f32; 3]) {
    assert!((a - Point3::from_array(b)).length() < 1e-4, "{a:?} is not {b:?}");
}

#[test]
fn a_scene_that_says_nothing_has_pbrts_defaults() {
    let s = load("WorldBegin Shape \"sphere\"");
    assert_eq!(s.settings.film.resolution, [1280, 720]);
    assert_eq!(s.settings.sampler.kind, SamplerKind::ZSobol);
    assert_eq!((s.settings.sampler.spp, s.settings.integrator.max_depth), (16, 5));
    assert_eq!(s.settings.integrator.light_selection, LightSelection::Tree);
    assert_eq!(s.settings.filter.radius().x, 1.5);
    assert_eq!(s.camera.projection, Projection::Perspective { fov: 90.0 });
    let Scattering::Diffuse { reflectance } = &s.materials[s.primitives[0].material].scattering else { panic!() };
    let Texture::Constant(c) = &s.spectrum_textures[*reflectance].kind else { panic!() };
    assert_eq!((c.eval_at(500.0), c.usage()), (0.5, SpectrumUse::Albedo));
}

#[test]
fn settings_are_read() {
    let s = load(
        "Film \"rgb\" \"integer xresolution\" 200 \"integer yresolution\" 100 \"string filename\" \"out.exr\" \"bool savefp16\" false\n\
         \"float cropwindow\" [.25 .75 0 .5] \"float iso\" 200 \"float maxcomponentvalue\" 10\n\
         Camera \"perspective\" \"float fov\" 40 \"float lensradius\" .1 \"float focaldistance\" 3 \"float shutterclose\" .5 \
         \"float screenwindow\" [-1 1 -2 2]\n\
         Sampler \"halton\" \"integer pixelsamples\" 33 \"integer seed\" 7 PixelFilter \"triangle\" \"float xradius\" 1\n\
         Integrator \"path\" \"integer maxdepth\" 9 \"string lightsampler\" \"power\" \"bool regularize\" true\n\
         Option \"force-diffuse\" true Option \"seed\" 5 WorldBegin",
    );
    let f = &s.settings.film;
    assert_eq!((f.resolution, f.pixel_bounds), ([200, 100], [50, 150, 0, 50]));
    assert_eq!((f.filename.as_str(), f.half, f.max_component_value), ("out.exr", false, 10.0));
    near(f.sensor.imaging_ratio(), 1.0);
    assert_eq!((s.camera.lens_radius, s.camera.focal_distance), (0.1, 3.0));
    assert_eq!((s.camera.shutter, s.camera.screen_window), ([0.0, 0.5], Some([-1.0, 1.0, -2.0, 2.0])));
    let m = &s.settings.sampler;
    assert_eq!((m.kind, m.spp, m.seed, m.resolution), (SamplerKind::Halton, 33, 7, [200, 100]));
    assert_eq!(m.randomization, Randomization::PermuteDigits);
    let i = &s.settings.integrator;
    assert_eq!(
        (i.kind, i.max_depth, i.light_selection, i.regularize),
        (IntegratorKind::Path, 9, LightSelection::Power, true)
    );
    assert!(s.settings.force_diffuse && !s.settings.disable_pixel_jitter);
    let s = load(
        "Option \"seed\" 5 Camera \"spherical\" \"string mapping\" \"equirectangular\" Sampler \"stratified\" \"integer xsamples\" 3 \
         Integrator \"ambientocclusion\" \"float maxdistance\" 2 WorldBegin",
    );
    assert_eq!(s.camera.projection, Projection::Spherical { mapping: SphericalMapping::Equirectangular });
    assert_eq!((s.settings.sampler.spp, s.settings.sampler.strata, s.settings.sampler.seed), (12, [3, 4], 5));
    assert_eq!(s.settings.integrator.kind, IntegratorKind::AmbientOcclusion { cosine: true, max_distance: 2.0 });
}

#[test]
fn transforms_apply_from_the_inside_out() {
    let s = load(
        "LookAt 0 0 5  0 0 0  0 1 0 Camera \"orthographic\" CoordinateSystem \"eye\" WorldBegin\n\
         Translate 1 0 0 Scale 2 2 2 Rotate 90 0 0 1 Shape \"sphere\"\n\
         Identity ConcatTransform [1 0 0 0 0 1 0 0 0 0 1 0 4 5 6 1] Shape \"sphere\"\n\
         CoordSysTransform \"camera\" Shape \"sphere\" CoordSysTransform \"eye\" Shape \"sphere\"\n\
         Transform [1 0 0 0 0 1 0 0 0 0 1 0 7 8 9 1] ReverseOrientation Shape \"sphere\"",
    );
    let at = |i: usize, p: [f32; 3]| s.primitives[i].world_from_object.point(Point3::from_array(p));
    point_near(at(0, [1.0, 0.0, 0.0]), [1.0, 2.0, 0.0]);
    point_near(at(1, [0.0; 3]), [4.0, 5.0, 6.0]);
    // The camera's system is camera to world: its origin is the eye, its z the view direction.
    point_near(at(2, [0.0, 0.0, 2.0]), [0.0, 0.0, 3.0]);
    point_near(at(3, [0.0, 0.0, 5.0]), [0.0; 3]);
    point_near(at(4, [0.0; 3]), [7.0, 8.0, 9.0]);
    point_near(s.camera.world_from_camera.at(0.0).point(Point3::new(0.0, 0.0, 1.0)), [0.0, 0.0, 4.0]);
    assert!(s.primitives[4].reverse_orientation && !s.primitives[3].reverse_orientation);
}

#[test]
fn motion_makes_an_instance_that_moves() {
    let s = load(
        "TransformTimes 1 3 ActiveTransform EndTime Translate 0 1 0 ActiveTransform All Camera \"perspective\" WorldBegin\n\
         AttributeBegin ActiveTransform EndTime Translate 4 0 0 Shape \"sphere\" AttributeEnd Shape \"disk\"\n\
         ObjectBegin \"o\" Shape \"cylinder\" ObjectEnd ActiveTransform EndTime Translate 0 0 8 ObjectInstance \"o\"",
    );
    assert_eq!((s.primitives.len(), s.instances.len(), s.objects.len()), (1, 2, 2));
    let middle = |i: usize| s.instances[i].world_from_object.at(2.0).point(Point3::default());
    point_near(middle(0), [2.0, 0.0, 0.0]);
    point_near(middle(1), [0.0, 0.0, 4.0]);
    assert!(matches!(s.objects[s.instances[0].object].primitives[0].shape, Shape::Sphere(_)));
    assert!(s.camera.world_from_camera.is_animated());
    point_near(s.camera.world_from_camera.at(2.0).point(Point3::default()), [0.0, -0.5, 0.0]);
}

#[test]
fn instances_may_come_before_their_object_and_compose_with_it() {
    let s = load(
        "WorldBegin Translate 1 0 0 ObjectInstance \"o\" ObjectBegin \"o\" Scale 2 2 2 Shape \"sphere\" ObjectEnd \
         Shape \"disk\" ObjectInstance \"o\"",
    );
    let o = &s.objects[s.instances[0].object];
    assert_eq!((o.name.as_str(), o.primitives.len(), s.instances.len(), s.primitives.len()), ("o", 1, 2, 1));
    let whole = o.primitives[0].world_from_object.then(&s.instances[0].world_from_object.start);
    point_near(whole.point(Point3::new(1.0, 0.0, 0.0)), [4.0, 0.0, 0.0]);
    assert_eq!(s.primitives[0].world_from_object.point(Point3::default()), Point3::new(1.0, 0.0, 0.0));
}

#[test]
fn attributes_are_inherited_and_explicit_parameters_win() {
    let out = try_load(
        "WorldBegin AttributeBegin Attribute \"shape\" \"float radius\" 3 \"float nonsense\" 1\n\
         Shape \"sphere\" Shape \"sphere\" \"float radius\" 4 AttributeEnd Shape \"sphere\"\n\
         ColorSpace \"rec2020\" Attribute \"material\" \"rgb reflectance\" [.2 .4 .6] ColorSpace \"srgb\"\n\
         Material \"diffuse\" Shape \"disk\" Material \"diffuse\" \"rgb reflectance\" [.2 .4 .6] Shape \"disk\"",
        Memory::new(),
    );
    assert_eq!(out.diagnostics, [], "an inherited parameter need not fit");
    let s = out.scene.unwrap();
    let radius = |i: usize| match &s.primitives[i].shape {
        Shape::Sphere(sphere) => sphere.radius(),
        other => panic!("{other:?}"),
    };
    assert_eq!([radius(0), radius(1), radius(2)], [3.0, 4.0, 1.0]);
    let reflectance = |i: usize| match &s.materials[s.primitives[i].material].scattering {
        Scattering::Diffuse { reflectance } => match &s.spectrum_textures[*reflectance].kind {
            Texture::Constant(c) => c.eval_at(620.0),
            other => panic!("{other:?}"),
        },
        other => panic!("{other:?}"),
    };
    let in_space = |space: ColorSpace| steradian_spectrum::Spectrum::rgb_albedo(space, [0.2, 0.4, 0.6]).eval_at(620.0);
    assert_eq!(reflectance(3), in_space(ColorSpace::Rec2020), "the colour space of the Attribute directive counts");
    assert_eq!(reflectance(4), in_space(ColorSpace::Srgb));
}

#[test]
fn included_files_share_the_state_and_imported_ones_do_not() {
    let mut gz = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
    gz.write_all(b"Translate 0 5 0 Shape \"disk\" NamedMaterial \"m\"").unwrap();
    let files = Memory::new()
        .with("dir/sub/a.pbrt", "Translate 1 0 0 Include \"sub/b.pbrt.gz\"")
        .with("dir/sub/b.pbrt.gz", gz.finish().unwrap())
        .with("dir/c.pbrt", "Translate 0 0 9 AttributeBegin Shape \"sphere\" AttributeEnd CoordinateSystem \"gone\"");
    let s = load_with(
        "WorldBegin MakeNamedMaterial \"m\" \"string type\" \"dielectric\"\n\
         Include \"sub/a.pbrt\" Shape \"disk\" Import \"c.pbrt\" Shape \"disk\"",
        files,
    );
    let origin = |i: usize| s.primitives[i].world_from_object.point(Point3::default()).to_array();
    assert_eq!([origin(0), origin(1)], [[1.0, 5.0, 0.0]; 2], "files are found next to the top-level one");
    assert_eq!([origin(2), origin(3)], [[1.0, 5.0, 9.0], [1.0, 5.0, 0.0]]);
    assert!(matches!(s.materials[s.primitives[3].material].scattering, Scattering::Dielectric { .. }));
}

#[test]
fn text_from_elsewhere_finds_its_files() {
    let files = Memory::new().with("here/a.pbrt", "Shape \"sphere\"");
    let input = Input::Text { name: "<stdin>", text: "WorldBegin Include \"a.pbrt\"", directory: Path::new("here") };
    assert_eq!(load_pbrt(input, &files, &LoadOptions::default()).scene.unwrap().primitives.len(), 1);
}

fn mesh<'a>(s: &'a Scene, p: &Primitive) -> &'a TriangleMesh {
    match &p.shape {
        Shape::Triangles(h) => &s.triangle_meshes[*h],
        other => panic!("{other:?}"),
    }
}

#[test]
fn meshes_keep_their_data() {
    let ply = "ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\nproperty float z\nelement face 2\n\
        property list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n2 0 0\n4 0 1 2 3\n3 1 4 2\n";
    let s = load_with(
        "WorldBegin Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0] \"normal N\" [0 0 1 0 0 1 0 1 0] \"point2 uv\" [0 0 1 0 0 1] \
         \"vector3 S\" [1 0 0 1 0 0 1 0 0]\n\
         Shape \"bilinearmesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0 1 1 0]\nShape \"plymesh\" \"string filename\" \"m.ply\"",
        Memory::new().with("dir/m.ply", ply),
    );
    let m = mesh(&s, &s.primitives[0]);
    assert_eq!(m.indices, [[0, 1, 2]], "three points are a triangle without saying so");
    assert_eq!((m.normals[2], m.tangents[0], m.uvs[1].x), (Normal3::new(0.0, 1.0, 0.0), Vec3::new(1.0, 0.0, 0.0), 1.0));
    let patches = |i: usize| match &s.primitives[i].shape {
        Shape::Bilinear(h) => &s.bilinear_meshes[*h],
        other => panic!("{other:?}"),
    };
    assert_eq!(patches(1).indices, [[0, 1, 2, 3]]);
    assert_eq!(patches(2).indices, [[0, 1, 3, 2]], "the corners of a PLY quadrilateral go round it");
    assert_eq!(mesh(&s, &s.primitives[3]).indices, [[1, 4, 2]]);
    for m in s.triangle_meshes.iter() {
        m.validate().unwrap();
    }
}

#[test]
fn subdivision_surfaces_become_meshes() {
    let s = load(
        "WorldBegin Shape \"loopsubdiv\" \"integer levels\" 2 \"point3 P\" [0 0 0 1 0 0 0 1 0 0 0 1] \
         \"integer indices\" [0 2 1 0 1 3 0 3 2 1 2 3]",
    );
    let m = mesh(&s, &s.primitives[0]);
    assert_eq!((m.indices.len(), m.normals.len()), (4 * 16, m.positions.len()));
}

#[test]
fn materials_are_read_with_their_defaults() {
    let s = load(
        "WorldBegin Texture \"r\" \"float\" \"constant\" \"float value\" .3\n\
         Material \"conductor\" \"float uroughness\" .1 \"texture vroughness\" \"r\" \"bool remaproughness\" false Shape \"disk\"\n\
         Material \"conductor\" \"rgb reflectance\" [.9 .8 .7] Shape \"disk\"\n\
         Material \"dielectric\" \"spectrum eta\" \"glass-BK7\" \"float roughness\" .2 Shape \"disk\"\n\
         Material \"coatedconductor\" \"float interface.roughness\" .1 Shape \"disk\"\n",
    );
    let scattering = |i: usize| &s.materials[s.primitives[i].material].scattering;
    let float = |h: &steradian_scene::FloatInput| match s.float_textures[*h].0 {
        Texture::Constant(v) => v,
        ref other => panic!("{other:?}"),
    };
    let Scattering::Conductor { metal: Metal::Ior { eta, .. }, roughness } = scattering(0) else { panic!() };
    assert_eq!((float(&roughness.u), float(&roughness.v), roughness.remap), (0.1, 0.3, false));
    let Texture::Constant(copper) = &s.spectrum_textures[*eta].kind else { panic!() };
    assert!(copper.eval_at(450.0) > 1.0 && copper.eval_at(700.0) < 0.4, "copper is red");
    assert!(matches!(scattering(1), Scattering::Conductor { metal: Metal::Reflectance(_), .. }));
    let Scattering::Dielectric { eta: Ior::Spectrum(bk7), roughness } = scattering(2) else { panic!() };
    near(bk7.eval_at(587.6), 1.5168);
    assert_eq!((float(&roughness.u), float(&roughness.v), roughness.remap), (0.2, 0.2, true));
    let Scattering::CoatedConductor { coat, roughness, .. } = scattering(3) else { panic!() };
    assert!(matches!(coat.eta, Ior::Constant(eta) if eta == 1.5));
    assert_eq!((float(&coat.roughness.u), float(&roughness.u), float(&coat.thickness)), (0.1, 0.0, 0.01));
    assert_eq!((coat.max_depth, coat.samples), (10, 1));
}

#[test]
fn a_named_material_may_be_used_before_it_is_made() {
    let s = load(
        "WorldBegin NamedMaterial \"late\" Shape \"disk\" Shape \"disk\" \"texture alpha\" \"holes\"\n\
         MakeNamedMaterial \"a\" \"string type\" \"diffuse\"\n\
         MakeNamedMaterial \"late\" \"string type\" \"mix\" \"string materials\" [\"a\" \"a\"] \"texture amount\" \"holes\"\n\
         Texture \"holes\" \"float\" \"checkerboard\" \"integer dimension\" 3 \"float tex1\" .5",
    );
    let Scattering::Mix { materials, amount } = &s.materials[s.primitives[0].material].scattering else { panic!() };
    assert_eq!(s.materials[materials[0]].name, "a");
    assert_eq!(s.primitives[1].alpha, Some(*amount));
    let Texture::Checkerboard { mapping: CheckerMapping::Space(_), a, .. } = s.float_textures[*amount].0 else {
        panic!()
    };
    assert!(matches!(s.float_textures[a].0, Texture::Constant(0.5)));
}

#[test]
fn textures_remember_where_they_were_defined_and_what_they_are_for() {
    let s = load(
        "WorldBegin AttributeBegin Translate 3 0 0\n\
         Texture \"c\" \"spectrum\" \"checkerboard\" \"string mapping\" \"planar\" \"vector3 v1\" [0 0 1] \"rgb tex1\" [2 2 2] \"rgb tex2\" [0 0 0]\n\
         AttributeEnd Material \"conductor\" \"texture eta\" \"c\" \"spectrum k\" [300 3 900 3] Shape \"disk\"",
    );
    let Scattering::Conductor { metal: Metal::Ior { eta, .. }, .. } = &s.materials[s.primitives[0].material].scattering
    else {
        panic!()
    };
    let texture = &s.spectrum_textures[*eta];
    assert_eq!(texture.usage, SpectrumUse::Unbounded);
    let Texture::Checkerboard {
        mapping: CheckerMapping::Plane(Mapping2::Planar { texture_from_world, vs, .. }),
        a,
        ..
    } = &texture.kind
    else {
        panic!()
    };
    point_near(texture_from_world.point(Point3::new(3.0, 0.0, 0.0)), [0.0; 3]);
    assert_eq!(*vs, Vec3::new(0.0, 0.0, 1.0));
    let Texture::Constant(two) = &s.spectrum_textures[*a].kind else { panic!() };
    near(two.eval_at(500.0), 2.0);
    let out = try_load(
        "WorldBegin Texture \"c\" \"spectrum\" \"constant\" \"rgb value\" [2 2 2] Material \"diffuse\" \"texture reflectance\" \"c\"",
        Memory::new(),
    );
    assert_eq!(out.diagnostics.len(), 1, "above 1 is an error only once the texture is used as a reflectance");
    assert_eq!(out.diagnostics[0].message, "`value` of Texture \"constant\" is a reflectance and cannot be above 1");
}

/// Luminance that a light of this spectrum and scale shows on the film.
fn luminance(spectrum: &steradian_spectrum::Spectrum, scale: f32) -> f32 {
    cie::Y.integrate(|l| spectrum.eval_at(l)) as f32 * scale
}

#[test]
fn lights_of_scale_one_have_luminance_one_whatever_their_spectrum() {
    for spectrum in [
        "",
        "\"blackbody I\" 3000",
        "\"spectrum I\" \"stdillum-F5\"",
        "\"spectrum I\" [400 5 700 1]",
        "\"rgb I\" [1 1 1]",
    ] {
        let s = load(&format!("WorldBegin LightSource \"point\" {spectrum} \"float scale\" 3"));
        let Light::Point { intensity, scale, .. } = &s.lights[0] else { panic!() };
        near(luminance(intensity, *scale), 3.0);
    }
    // Of an RGB light the white counts, so that its luminance is that of the colour.
    let s = load("WorldBegin LightSource \"point\" \"rgb I\" [0 1 0]");
    let Light::Point { intensity, scale, .. } = &s.lights[0] else { panic!() };
    assert!((luminance(intensity, *scale) - 0.7152).abs() < 0.02);
}

#[test]
fn power_and_illuminance_set_the_scale() {
    let s = load(
        "WorldBegin Translate 0 0 7\n\
         LightSource \"point\" \"float power\" 8 \"point3 from\" [1 2 3]\n\
         LightSource \"spot\" \"float power\" 8 \"float coneangle\" 60 \"float conedeltaangle\" 10 \"point3 to\" [1 0 0]\n\
         LightSource \"distant\" \"float illuminance\" 5 \"point3 from\" [0 0 2] \"point3 to\" [0 0 0]\n\
         LightSource \"infinite\" \"float illuminance\" 5\n\
         AreaLightSource \"diffuse\" \"float power\" 6 \"bool twosided\" true \"blackbody L\" 4000 Shape \"disk\"",
    );
    let Light::Point { position, intensity, scale } = &s.lights[0] else { panic!() };
    near(4.0 * PI * luminance(intensity, *scale), 8.0);
    point_near(*position, [1.0, 2.0, 10.0]);
    let Light::Spot { world_from_light, intensity, scale, cos_end, cos_start } = &s.lights[1] else { panic!() };
    near(*cos_end, 0.5);
    near(*cos_start, 0.642_787_6);
    near(2.0 * PI * ((1.0 - cos_start) + (cos_start - cos_end) / 2.0) * luminance(intensity, *scale), 8.0);
    point_near(world_from_light.point(Point3::new(0.0, 0.0, 2.0)), [2.0, 0.0, 7.0]);
    let Light::Distant { to_light, radiance, scale } = &s.lights[2] else { panic!() };
    near(luminance(radiance, *scale), 5.0);
    assert_eq!(*to_light, Vec3::new(0.0, 0.0, 1.0));
    let Light::UniformInfinite { radiance, scale } = &s.lights[3] else { panic!() };
    near(PI * luminance(radiance, *scale), 5.0);
    let area = s.primitives[0].area_light.as_ref().unwrap();
    near(luminance(&area.radiance, area.scale), 1.0);
    assert_eq!((area.power, area.two_sided), (Some(6.0), true));
}

/// A PFM image, top row first.
fn pfm(width: usize, height: usize, pixel: impl Fn(usize, usize) -> [f32; 3]) -> Vec<u8> {
    let mut out = format!("PF\n{width} {height}\n-1\n").into_bytes();
    for y in (0..height).rev() {
        (0..width).for_each(|x| pixel(x, y).iter().for_each(|v| out.extend(v.to_le_bytes())));
    }
    out
}

#[test]
fn environment_maps_tell_their_layout_by_their_shape() {
    let files = Memory::new()
        .with("dir/square.pfm", pfm(32, 32, |_, _| [2.0; 3]))
        .with("dir/wide.pfm", pfm(256, 128, |_, y| if y < 64 { [2.0; 3] } else { [100.0; 3] }))
        .with("dir/nan.pfm", pfm(8, 8, |x, _| if x == 3 { [f32::NAN; 3] } else { [1.0; 3] }));
    let s = load_with(
        "WorldBegin LightSource \"infinite\" \"string filename\" \"square.pfm\"\n\
         LightSource \"infinite\" \"string filename\" \"wide.pfm\" \"float illuminance\" 10\n\
         LightSource \"infinite\" \"string filename\" \"square.pfm\" \"float illuminance\" 10",
        files.clone(),
    );
    let light = |i: usize| match &s.lights[i] {
        Light::ImageInfinite { mapping, scale, image, .. } => {
            (*mapping, scale * ColorSpace::Srgb.photometric(), image.index())
        }
        other => panic!("{other:?}"),
    };
    assert_eq!((light(0).0, light(1).0), (EnvironmentMapping::EqualArea, EnvironmentMapping::LatLong));
    assert_eq!((s.images.len(), light(2).2), (2, light(0).2), "a picture is read once");
    near(light(0).1, 1.0);
    // A sky of radiance 2 above gives 2 pi; what is below does not count. Half a percent for the pixels.
    assert!((light(1).1 * 2.0 * PI - 10.0).abs() < 0.05, "{}", light(1).1);
    assert!((light(2).1 * 2.0 * PI - 10.0).abs() < 0.05, "{}", light(2).1);
    let out = try_load("WorldBegin LightSource \"infinite\" \"string filename\" \"nan.pfm\"", files);
    assert_eq!(
        out.diagnostics[0].message,
        "nan.pfm: a light's image cannot have 8 of 64 pixels infinite or undefined, the first at 3,0"
    );
}

#[test]
fn a_boundary_is_where_media_differ() {
    let out = try_load(
        "WorldBegin MakeNamedMedium \"fog\" \"string type\" \"homogeneous\" \"rgb sigma_a\" [1 2 3] \"float scale\" 2 \"float g\" .5\n\
         \"blackbody Le\" 5000 \"float Lescale\" 4\n\
         MediumInterface \"fog\" \"\" Shape \"sphere\" MediumInterface \"fog\" Shape \"sphere\" MediumInterface \"\" Shape \"sphere\"",
        Memory::new(),
    );
    let s = out.scene.unwrap();
    let fog = s.primitives[0].media.unwrap().inside.unwrap();
    assert_eq!(s.primitives[0].media.unwrap().outside, None);
    assert_eq!((s.primitives[1].media, s.primitives[2].media), (None, None));
    let m = &s.media[fog];
    assert_eq!((m.name.as_str(), m.scale), ("fog", 2.0));
    assert_eq!(m.phase, Phase::HenyeyGreenstein { g: 0.5 });
    let Volume::Homogeneous { emission, .. } = &m.volume else { panic!("{:?}", m.volume) };
    let (le, scale) = emission.as_ref().unwrap();
    near(luminance(le, *scale), 4.0);
}

#[test]
fn the_identity_is_what_a_world_starts_with() {
    let s = load("Scale 3 3 3 Camera \"perspective\" WorldBegin Shape \"sphere\"");
    assert_eq!(s.primitives[0].world_from_object, Transform::IDENTITY);
}

#[test]
fn media_of_every_type_become_volumes() {
    let s = load(
        "Integrator \"volpath\" Translate 1 2 3 WorldBegin Translate 0 0 5\n\
         MakeNamedMedium \"a\" \"string type\" \"homogeneous\" \"string preset\" \"Skin2\" \"float scale\" .8\n\
         MakeNamedMedium \"b\" \"string type\" \"uniformgrid\" \"integer nx\" 2 \"float density\" [1 2] \"float temperature\" [300 900]\n\
         \"float temperaturecutoff\" 20 \"float temperaturescale\" 2 \"float Lescale\" [3 4] \"point3 p1\" [2 1 1]\n\
         MakeNamedMedium \"c\" \"string type\" \"uniformgrid\" \"float density\" 7 \"rgb Le\" [1 1 1]\n\
         MakeNamedMedium \"d\" \"string type\" \"rgbgrid\" \"integer ny\" 2 \"rgb sigma_a\" [1 2 3 4 5 6] \"rgb Le\" [1 0 0 0 1 0]\n\
         MakeNamedMedium \"e\" \"string type\" \"cloud\" \"float wispiness\" 3",
    );
    assert_eq!(s.settings.integrator.kind, IntegratorKind::VolPath);
    let m = s.media.as_slice();
    assert_eq!(m[0].world_from_medium, Transform::translate(Vec3::new(0.0, 0.0, 5.0)));
    let Volume::Homogeneous { coefficients, emission: None } = &m[0].volume else { panic!("{:?}", m[0]) };
    // At 600 nm skin scatters much and absorbs little.
    assert!(coefficients.sigma_s.eval_at(600.0) > 1.0 && coefficients.sigma_a.eval_at(600.0) < 0.1);
    let Volume::Grid { density, glow: Some(glow), bounds, .. } = &m[1].volume else { panic!("{:?}", m[1]) };
    assert_eq!((density.size, density.values.as_slice(), bounds.max.x), ([2, 1, 1], [1.0, 2.0].as_slice(), 2.0));
    let Glow::Blackbody { temperature, offset, temperature_scale, scale, field } = glow else { panic!("{glow:?}") };
    assert_eq!((temperature.values[1], *offset, *temperature_scale, *scale), (900.0, 20.0, 2.0, 1.0));
    assert_eq!(field.as_ref().unwrap().values, [3.0, 4.0]);
    let Volume::Grid { glow: Some(Glow::Spectrum { radiance, scale, field: Some(field) }), .. } = &m[2].volume else {
        panic!("{:?}", m[2])
    };
    near(luminance(radiance, *scale), 1.0);
    // Not nothing, which would be one everywhere: what pbrt takes without an `Lescale` fades towards the corners.
    assert_eq!((field.size, field.values.as_slice()), ([1; 3], [1.0].as_slice()));
    let Volume::RgbGrid(g) = &m[3].volume else { panic!("{:?}", m[3]) };
    assert_eq!(g.sigma_a.as_ref().unwrap().values, [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]);
    assert!(g.sigma_s.is_none() && g.emission.as_ref().unwrap().1 == 1.0);
    let Volume::Cloud(c) = &m[4].volume else { panic!("{:?}", m[4]) };
    assert_eq!((c.density, c.wispiness, c.frequency), (1.0, 3.0, 5.0));
}

#[test]
fn the_simple_integrators_are_paths_without_some_techniques() {
    use steradian_scene::{LobeSampling, MisHeuristic};
    let of = |words: &str| {
        let s = load(&format!("Integrator {words} WorldBegin Shape \"sphere\"")).settings.integrator;
        assert_eq!((s.kind, s.techniques.mis, s.techniques.roulette), (IntegratorKind::Path, MisHeuristic::None, None));
        (s.techniques.light_sampling, s.techniques.lobe_sampling, s.max_depth)
    };
    assert_eq!(of("\"simplepath\""), (true, LobeSampling::Lobe, 5));
    let off = "\"simplepath\" \"bool samplelights\" false \"bool samplebsdf\" false \"integer maxdepth\" 2";
    assert_eq!(of(off), (false, LobeSampling::Uniform, 2));
    assert_eq!(of("\"randomwalk\" \"integer maxdepth\" 7"), (false, LobeSampling::Uniform, 7));
}

#[test]
fn paths_from_lights_have_their_parameters() {
    let settings = |text: &str| load(&format!("{text} WorldBegin")).settings.integrator;
    let s = settings(
        "Integrator \"bdpt\" \"integer maxdepth\" 7 \"bool regularize\" true \"string lightsampler\" \"uniform\"",
    );
    assert_eq!((s.kind, s.max_depth, s.regularize), (IntegratorKind::Bdpt(Bidirectional::default()), 7, true));
    assert_eq!(s.light_selection, LightSelection::Uniform);
    let s = settings("Integrator \"lightpath\"");
    assert_eq!((s.kind, s.max_depth), (IntegratorKind::LightPath, 5));
}

#[test]
fn photons_chains_functions_and_films() {
    let s = load(
        "Film \"spectral\" \"integer nbuckets\" 8 \"float lambdamin\" 400 \"float lambdamax\" 700\n\
         Integrator \"sppm\" \"float radius\" .5 \"integer photonsperiteration\" -1 \"integer seed\" -3 \"integer maxdepth\" 9 WorldBegin",
    );
    assert_eq!(s.settings.film.kind, FilmKind::Spectral(Bands { count: 8, range: [400.0, 700.0] }));
    let photons = PhotonMapping { radius: Some(0.5), per_iteration: None, seed: Some(-3i64 as u64) };
    assert_eq!((s.settings.integrator.kind, s.settings.integrator.max_depth), (IntegratorKind::Sppm(photons), 9));
    let s = load(
        "Film \"gbuffer\" \"string coordinatesystem\" \"world\" Sampler \"halton\" \"integer pixelsamples\" 7\n\
         Integrator \"mlt\" \"integer mutationsperpixel\" 33 \"integer chains\" 12 \"integer bootstrapsamples\" 99\n\
         \"float sigma\" .2 \"float largestepprobability\" .5 WorldBegin",
    );
    assert_eq!(s.settings.film.kind, FilmKind::GBuffer { in_world: true });
    let chains = Metropolis { bootstrap_samples: 99, chains: 12, large_step_probability: 0.5, sigma: 0.2 };
    assert_eq!((s.settings.integrator.kind, s.settings.sampler.spp), (IntegratorKind::Mlt(chains), 33));
    let s = load("Integrator \"function\" \"string function\" \"disk\" WorldBegin");
    assert_eq!(s.settings.integrator.kind, IntegratorKind::Function(TestFunction::Disk));
    assert_eq!(s.settings.integrator.report.as_deref(), Some("disk-mse.txt"));
}

/// What pbrt-v4 calls otherwise, side by side: the same scene in all that can be compared as text.
#[test]
fn scenes_of_pbrt_v3_are_read_as_v4_would_say_it() {
    let v3 = r#"Film "image" "integer xresolution" 30 "float scale" 2 "float maxsampleluminance" 5
Sampler "random" "integer pixelsamples" 8
PixelFilter "gaussian" "float xwidth" 2 "float ywidth" 1 "float alpha" 2
Integrator "directlighting" "integer maxdepth" 7
Camera "environment"
WorldBegin
LightSource "distant" "point from" [ 0 1 0 ] "blackbody L" [ 3000 2 ] "color scale" [ 3 3 3 ] "integer samples" 4
AreaLightSource "area" "color L" [ 1 1 1 ] "integer nsamples" 2
Texture "u" "color" "constant" "color value" [ .2 .3 .4 ]
Texture "t" "color" "scale" "color tex1" [ .5 .5 .5 ] "texture tex2" "u"
MakeNamedMaterial "a" "string type" "matte" "color Kd" [ .1 .2 .3 ] "float sigma" 20
MakeNamedMaterial "b" "string type" "glass" "float index" 1.4 "color Kr" [ 1 1 1 ]
Material "mix" "color amount" [ .25 .25 .25 ] "string namedmaterial1" "a" "string namedmaterial2" "b"
Shape "loopsubdiv" "integer nlevels" 1 "integer indices" [ 0 1 2 ] "point P" [ 0 0 0 1 0 0 0 1 0 ]
Material "substrate" "color Kd" [ .4 .4 .4 ] "color Ks" [ 1 1 1 ] "bool remaproughness" "false"
Shape "trianglemesh" "integer indices" [ 0 1 2 ] "point P" [ 0 0 0 1 0 0 0 1 0 ] "float st" [ 0 0 1 0 0 1 ]
Material ""
Shape "sphere"
WorldEnd
"#;
    let v4 = r#"Film "rgb" "integer xresolution" 30 "float iso" 200 "float maxcomponentvalue" 5
Sampler "independent" "integer pixelsamples" 8
PixelFilter "gaussian" "float xradius" 2 "float yradius" 1 "float sigma" .5
Integrator "path" "integer maxdepth" 1
Camera "spherical" "string mapping" "equirectangular"
WorldBegin
LightSource "distant" "point3 from" [ 0 1 0 ] "blackbody L" [ 3000 ] "float scale" 6
AreaLightSource "diffuse" "rgb L" [ 1 1 1 ]
Texture "u" "spectrum" "constant" "rgb value" [ .2 .3 .4 ]
Texture "t" "spectrum" "scale" "float scale" .5 "texture tex" "u"
MakeNamedMaterial "a" "string type" "diffuse" "rgb reflectance" [ .1 .2 .3 ]
MakeNamedMaterial "b" "string type" "dielectric" "float eta" 1.4
Material "mix" "float amount" .25 "string materials" [ "b" "a" ]
Shape "loopsubdiv" "integer levels" 1 "integer indices" [ 0 1 2 ] "point3 P" [ 0 0 0 1 0 0 0 1 0 ]
Material "coateddiffuse" "rgb reflectance" [ .4 .4 .4 ] "float roughness" .1 "bool remaproughness" false
Shape "trianglemesh" "integer indices" [ 0 1 2 ] "point3 P" [ 0 0 0 1 0 0 0 1 0 ] "point2 uv" [ 0 0 1 0 0 1 ]
Material "interface"
Shape "sphere"
"#;
    let old = try_load(v3, Memory::new());
    let said: Vec<&str> = old.diagnostics.iter().map(|d| d.message.as_str()).collect();
    assert!(said[0].starts_with("a scene of pbrt-v3, by its `WorldEnd`"), "{said:?}");
    let (old, new) = (old.scene.unwrap_or_else(|| panic!("{said:?}")), load_with(v4, Memory::new()));
    assert_eq!(format!("{:?}", old.settings), format!("{:?}", new.settings));
    assert_eq!(format!("{:?}", old.camera), format!("{:?}", new.camera));
    assert_eq!(format!("{:?}", old.lights), format!("{:?}", new.lights));
    assert_eq!(format!("{:?}", old.materials), format!("{:?}", new.materials));
    assert_eq!(format!("{:?}", old.spectrum_textures), format!("{:?}", new.spectrum_textures));
    assert_eq!(format!("{:?}", old.float_textures), format!("{:?}", new.float_textures));
    assert_eq!(format!("{:?}", old.primitives), format!("{:?}", new.primitives));
    assert_eq!(format!("{:?}", old.triangle_meshes), format!("{:?}", new.triangle_meshes));
    // Without its end it is a scene of pbrt-v4, and wrong.
    assert!(try_load(&v3.replace("WorldEnd", ""), Memory::new()).scene.is_none());
}

#[test]
fn objects_hold_objects_and_lights() {
    let s = load_with(
        "WorldBegin ObjectBegin \"a\" AreaLightSource \"diffuse\" Shape \"sphere\" ObjectEnd\n\
         ObjectBegin \"b\" Translate 1 0 0 ObjectInstance \"a\" Translate 1 0 0 ObjectInstance \"a\" ObjectEnd\n\
         ObjectInstance \"b\" Translate 0 5 0 ObjectInstance \"b\"",
        Memory::new(),
    );
    assert_eq!((s.instances.len(), s.objects.len()), (2, 2));
    let world = steradian_scene::World::build(s).unwrap();
    assert_eq!(world.light_count(), 4);
    let itself =
        try_load("WorldBegin ObjectBegin \"a\" Shape \"sphere\" ObjectInstance \"a\" ObjectEnd", Memory::new());
    assert_eq!(itself.diagnostics[0].message, "the object \"a\" contains itself");
}

#[test]
fn photometric_files_are_goniometric_lights() {
    let file = "IESNA:LM-63-2002\nTILT=NONE\n1 1000 1 3 1 1 2 0 0 0\n1 1 60\n0 90 180\n0\n100 100 0\n";
    let s = load_with(
        "WorldBegin LightSource \"goniometric\" \"string filename\" \"lamp.ies\"",
        Memory::new().with("dir/lamp.ies", file),
    );
    let Light::Goniometric { world_from_light, intensity, image, scale } = &s.lights[0] else { panic!() };
    let texels = &s.images[*image].texels;
    let seen = |d: [f32; 3]| {
        let local = world_from_light.inverse().vector(Vec3::from_array(d));
        let [u, v] = steradian_sampling::warp::octahedral_to_square(local);
        let cell = |u: f32, n: usize| ((u * n as f32) as usize).min(n - 1);
        texels.texel(cell(u, texels.width()), cell(v, texels.height()), 0)
    };
    // Straight down, aside, and straight up.
    near(seen([0.0, -1.0, 0.0]), 100.0);
    assert!((seen([1.0, 0.0, 0.0]) - 100.0).abs() < 0.5 && (seen([0.0, 0.0, -1.0]) - 100.0).abs() < 0.5);
    assert!(seen([0.0, 1.0, 0.0]) < 0.5);
    near(intensity.photometric() * scale, 1.0);
    let wrong = try_load(
        "WorldBegin LightSource \"goniometric\" \"string filename\" \"lamp.ies\"",
        Memory::new().with("dir/lamp.ies", "IESNA"),
    );
    assert!(wrong.diagnostics[0].message.contains("no photometric file"));
}

/// An e with an accent in one character, and in two.
#[test]
fn the_same_letters_are_the_same_name() {
    let s = load_with(
        "WorldBegin MakeNamedMaterial \"caf\u{e9}\" \"string type\" \"conductor\" NamedMaterial \"cafe\u{301}\" Shape \"sphere\"",
        Memory::new(),
    );
    assert!(matches!(s.materials[s.primitives[0].material].scattering, Scattering::Conductor { .. }));
}
