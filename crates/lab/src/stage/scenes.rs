//! The scenes that more than one experiment uses.

use super::build::Builder;
use crate::Error;
use steradian_sampling::SamplerKind;
use steradian_scene::World;

/// A floor under a square lamp with a card between them: the picture is mostly penumbra.
pub fn penumbra_world(size: [u32; 2], sampler: SamplerKind) -> Result<World, Error> {
    Ok(penumbra(size, sampler, true).build()?)
}

/// The scene of [`penumbra_world`]; without `area`, the lamp is a point of the same intensity.
pub fn penumbra(size: [u32; 2], sampler: SamplerKind, area: bool) -> Builder {
    let mut b = Builder::new(size, 1);
    b.scene.settings.sampler.kind = sampler;
    b.camera([0.0, 2.4, -4.2], [0.0, 0.25, 0.4], 38.0);
    let floor = b.checkerboard([0.72, 0.70, 0.66], [0.52, 0.53, 0.56], 12.0);
    b.quad([[-6.0, 0.0, -6.0], [-6.0, 0.0, 6.0], [6.0, 0.0, 6.0], [6.0, 0.0, -6.0]], floor);
    let card = b.diffuse([0.65, 0.2, 0.12]);
    b.quad([[-0.7, 0.0, 0.5], [-0.7, 0.9, 0.5], [0.5, 0.9, 0.5], [0.5, 0.0, 0.5]], card);
    let ball = b.diffuse([0.25, 0.42, 0.68]);
    b.sphere(0.32, [1.05, 0.32, 0.1], ball);
    let (y, z, r) = (3.0, 3.0, 0.55);
    if area {
        b.lamp([[-r, y, z - r], [-r, y, z + r], [r, y, z + r], [r, y, z - r]], 45.0);
    } else {
        b.point_light([0.0, y, z], 45.0 * 4.0 * r * r);
    }
    b
}

/// An even floor under a wide lamp with a card on it: most of the noise is the lamp's.
pub fn wide_lamp_world(size: [u32; 2]) -> Result<World, Error> {
    let mut b = Builder::new(size, 1);
    b.camera([0.0, 2.4, -4.2], [0.0, 0.25, 0.4], 38.0);
    let grey = b.diffuse([0.6; 3]);
    b.quad([[-6.0, 0.0, -6.0], [-6.0, 0.0, 6.0], [6.0, 0.0, 6.0], [6.0, 0.0, -6.0]], grey);
    b.quad([[-0.9, 0.0, 0.5], [-0.9, 1.1, 0.5], [0.9, 1.1, 0.5], [0.9, 0.0, 0.5]], grey);
    b.lamp([[-2.5, 2.6, 0.5], [-2.5, 2.6, 4.5], [2.5, 2.6, 4.5], [2.5, 2.6, 0.5]], 2.5);
    Ok(b.build()?)
}

/// A box with coloured walls, a lamp under its ceiling, a ball and a block of glass.
pub fn room(size: [u32; 2], max_depth: u32) -> Builder {
    let mut b = Builder::new(size, max_depth);
    b.camera([0.0, 1.0, -3.4], [0.0, 1.0, 0.0], 39.0);
    let white = b.diffuse([0.73; 3]);
    let red = b.diffuse([0.63, 0.065, 0.05]);
    let green = b.diffuse([0.14, 0.45, 0.09]);
    b.quad([[-1.0, 0.0, -1.0], [-1.0, 0.0, 1.0], [1.0, 0.0, 1.0], [1.0, 0.0, -1.0]], white);
    b.quad([[-1.0, 2.0, -1.0], [1.0, 2.0, -1.0], [1.0, 2.0, 1.0], [-1.0, 2.0, 1.0]], white);
    b.quad([[-1.0, 0.0, 1.0], [-1.0, 2.0, 1.0], [1.0, 2.0, 1.0], [1.0, 0.0, 1.0]], white);
    b.quad([[-1.0, 0.0, -1.0], [-1.0, 2.0, -1.0], [-1.0, 2.0, 1.0], [-1.0, 0.0, 1.0]], red);
    b.quad([[1.0, 0.0, -1.0], [1.0, 0.0, 1.0], [1.0, 2.0, 1.0], [1.0, 2.0, -1.0]], green);
    b.lamp([[-0.35, 1.98, -0.35], [0.35, 1.98, -0.35], [0.35, 1.98, 0.35], [-0.35, 1.98, 0.35]], 9.0);
    b.sphere(0.4, [-0.4, 0.4, 0.3], white);
    let gold = b.metal([0.9, 0.65, 0.3], 0.25);
    b.sphere(0.35, [0.45, 0.35, -0.2], gold);
    b
}

/// Four plates of rising roughness that reflect balls of the given radii and equal power (after Veach 1997, figure 9.2).
pub fn plates_world(size: [u32; 2], radii: &[f32]) -> Result<World, Error> {
    let mut b = Builder::new(size, 1);
    b.camera([0.0, 2.0, -9.0], [0.0, 1.25, 0.0], 31.0);
    let wall = b.diffuse([0.35; 3]);
    b.quad([[-9.0, -1.0, -6.0], [-9.0, -1.0, 5.0], [9.0, -1.0, 5.0], [9.0, -1.0, -6.0]], wall);
    b.quad([[-9.0, -1.0, 5.0], [-9.0, 9.0, 5.0], [9.0, 9.0, 5.0], [9.0, -1.0, 5.0]], wall);
    // Each plate is turned so that it mirrors the balls towards the camera.
    for (alpha, height, depth) in
        [(0.006f32, 1.55f32, 1.6f32), (0.03, 0.72, 0.3), (0.1, 0.08, -1.2), (0.25, -0.42, -2.8)]
    {
        let metal = b.metal([0.75, 0.78, 0.82], alpha);
        let centre = [0.0, height, depth];
        let unit = |d: [f32; 3]| {
            let l = (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]).sqrt();
            d.map(|v| v / l)
        };
        let (eye, ball) = ([0.0, 2.0, -9.0], [0.0, 3.4, 2.2]);
        let to_eye = unit(std::array::from_fn(|i| eye[i] - centre[i]));
        let to_ball = unit(std::array::from_fn(|i| ball[i] - centre[i]));
        let n = unit(std::array::from_fn(|i| to_eye[i] + to_ball[i]));
        // The plate's long side lies along x, its short side across the normal.
        let across = unit([0.0, -n[2], n[1]]);
        let corner = |x: f32, t: f32| [x, centre[1] + across[1] * t, centre[2] + across[2] * t];
        let (w, h) = (2.6, 0.42);
        b.quad([corner(-w, -h), corner(w, -h), corner(w, h), corner(-w, h)], metal);
    }
    for (i, &radius) in radii.iter().enumerate() {
        b.ball_lamp(radius, [-2.3 + 1.55 * i as f32, 3.4, 2.2], 0.5 / (radius * radius));
    }
    Ok(b.build()?)
}

/// A floor with three balls of metal, from nearly a mirror to satin, under a lamp and a faint sky.
pub fn glossy_world(size: [u32; 2]) -> Result<World, Error> {
    let mut b = Builder::new(size, 1);
    b.camera([0.0, 1.5, -5.0], [0.0, 0.55, 0.0], 30.0);
    let floor = b.diffuse([0.5, 0.5, 0.52]);
    b.quad([[-8.0, 0.0, -8.0], [-8.0, 0.0, 8.0], [8.0, 0.0, 8.0], [8.0, 0.0, -8.0]], floor);
    for (x, alpha, rgb) in [(-1.25, 0.2, [0.9, 0.6, 0.5]), (0.0, 0.3, [0.85, 0.85, 0.85]), (1.25, 0.5, [0.6, 0.7, 0.9])]
    {
        let metal = b.metal(rgb, alpha);
        b.sphere(0.55, [x, 0.55, 0.0], metal);
    }
    b.lamp([[-1.4, 3.2, -1.2], [-1.4, 3.2, 0.4], [1.4, 3.2, 0.4], [1.4, 3.2, -1.2]], 6.0);
    b.sky(0.15);
    Ok(b.build()?)
}
