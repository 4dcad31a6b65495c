//! The channels of the `gbuffer` film, named and meant as pbrt-v4 does; only .exr files have room for them. One that --aov fills as
//! well is that of --aov.
//!
//! Slopes are per pixel, where pbrt's are per so many pixels as its samples are apart.

use steradian_image::{Error, Image, Precision};
use steradian_math::{Normal3, Point3, Transform};
use steradian_render::{Features, Film};
use steradian_scene::{CameraSample, World};

/// The way into the camera's space in the middle of the shutter.
pub(crate) fn from_world(world: &World) -> Transform {
    let camera = world.camera();
    let half = CameraSample { film: Default::default(), lens: [0.5; 2], time: 0.5 };
    camera.world_from_camera(camera.time_of(&half)).inverse()
}

/// Adds what is seen, in the space where `from_world` leads, and how unequal samples are.
///
/// # Errors
/// `Error::Shape` for a bug here.
pub(crate) fn add(
    image: &mut Image,
    seen: &[Features],
    film: &Film,
    from_world: Option<Transform>,
) -> Result<(), Error> {
    let place = |p: [f32; 3]| from_world.map_or(p, |t| t.point(Point3::from_array(p)).to_array());
    let normal = |[x, y, z]: [f32; 3]| {
        let n = Normal3::new(x, y, z);
        let n = from_world.map_or(n, |t| t.normal(n));
        let length = n.dot(n.to_vec()).sqrt();
        if length > 0.0 { [n.x / length, n.y / length, n.z / length] } else { [0.0; 3] }
    };
    let mut add = |name: &str, values: Vec<f32>| {
        if image.channel(name).is_some() { Ok(()) } else { image.add(name, values, Precision::Float) }
    };
    let mut three = |names: [&str; 3], values: Vec<[f32; 3]>| {
        names.into_iter().enumerate().try_for_each(|(c, name)| add(name, values.iter().map(|v| v[c]).collect()))
    };
    let of = |f: &dyn Fn(&Features) -> [f32; 3]| seen.iter().map(f).collect::<Vec<_>>();
    three(["Albedo.R", "Albedo.G", "Albedo.B"], of(&|f| f.albedo))?;
    three(["P.X", "P.Y", "P.Z"], of(&|f| if f.alpha > 0.0 { place(f.position) } else { [0.0; 3] }))?;
    three(["N.X", "N.Y", "N.Z"], of(&|f| normal(f.geometric)))?;
    three(["Ns.X", "Ns.Y", "Ns.Z"], of(&|f| normal(f.normal)))?;
    // Those of one sample, not of the mean.
    let samples = |f: fn([f32; 3], [f32; 3]) -> [f32; 3]| {
        film.map(|e| if e.samples > 1 { f(e.variance.map(|v| v * e.samples as f32), e.mean) } else { [0.0; 3] })
    };
    three(["Variance.R", "Variance.G", "Variance.B"], samples(|v, _| v))?;
    let relative =
        |v: [f32; 3], mean: [f32; 3]| std::array::from_fn(|c| if mean[c] != 0.0 { v[c] / mean[c] } else { 0.0 });
    three(["RelativeVariance.R", "RelativeVariance.G", "RelativeVariance.B"], samples(relative))?;
    add("dzdx", seen.iter().map(|f| f.slope[0].abs()).collect())?;
    add("dzdy", seen.iter().map(|f| f.slope[1].abs()).collect())?;
    add("u", seen.iter().map(|f| f.uv[0]).collect())?;
    add("v", seen.iter().map(|f| f.uv[1]).collect())
}
