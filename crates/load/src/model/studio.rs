//! A photographer's studio as an environment: softboxes in a light room, over a ground that runs into the background.

use steradian_image::{Encoding, Error, Storage, Texels};
use steradian_math::{PI, Vec3, sin_cos, smoothstep};

const WIDTH: usize = 512;
const HEIGHT: usize = 256;

/// Share of light that the ground reflects.
pub(super) const GROUND: f32 = 0.72;
/// How bright the ground is under all of it.
const LEVEL: f32 = 0.62;

/// A rectangle of light far away.
struct Softbox {
    /// Towards its middle: degrees to the right of the front, and up.
    place: [f32; 2],
    /// Half of its width and height, as tangents.
    half: [f32; 2],
    rgb: [f32; 3],
}

/// Key from the left, fill from the right, rim from behind, and one from above.
const BOXES: [Softbox; 4] = [
    Softbox { place: [-48.0, 42.0], half: [0.42, 0.42], rgb: [15.0, 14.6, 14.0] },
    Softbox { place: [78.0, 28.0], half: [0.30, 0.75], rgb: [4.6, 4.7, 4.9] },
    Softbox { place: [165.0, 34.0], half: [0.9, 0.22], rgb: [7.0, 7.2, 7.6] },
    Softbox { place: [20.0, 82.0], half: [0.7, 0.7], rgb: [4.2, 4.2, 4.2] },
];

/// Light from direction `d` of the stage (y up, z to the front), above the horizon, before it is scaled.
fn light(d: Vec3) -> [f32; 3] {
    let dome = 0.22 + 0.1 * d.y.max(0.0);
    let mut out = [dome, dome, dome * 1.02];
    for b in &BOXES {
        let [a, e] = b.place.map(f32::to_radians);
        let ((sa, ca), (se, ce)) = (sin_cos(a), sin_cos(e));
        let axis = Vec3::new(sa * ce, se, ca * ce);
        let right = Vec3::new(ca, 0.0, -sa);
        let up = axis.cross(right);
        let along = d.dot(axis);
        if along <= 0.0 {
            continue;
        }
        let edge = |x: f32, half: f32| 1.0 - smoothstep(x.abs() / along, half * 0.88, half * 1.06);
        let inside = edge(d.dot(right), b.half[0]) * edge(d.dot(up), b.half[1]);
        out.iter_mut().zip(b.rgb).for_each(|(o, v)| *o += inside * v);
    }
    out
}

/// The direction of a pixel, in the stage.
fn direction(x: usize, y: usize) -> (Vec3, f32) {
    let (st, ct) = sin_cos(PI * (y as f32 + 0.5) / HEIGHT as f32);
    let (sp, cp) = sin_cos(2.0 * PI * (x as f32 + 0.5) / WIDTH as f32);
    let solid_angle = 2.0 * PI * PI / (WIDTH * HEIGHT) as f32 * st;
    (Vec3::new(st * cp, ct, st * sp), solid_angle)
}

/// The studio in latitudes and longitudes: columns go from +x to +z of the stage, the top row is +y. The room below the
/// horizon, and up to a little above it, has the colour of the ground, so that no edge is seen between them.
///
/// # Errors
/// Never.
pub(super) fn picture() -> Result<Texels, Error> {
    let mut rgb = vec![[0.0f32; 3]; WIDTH * HEIGHT];
    let mut irradiance = [0.0f32; 3];
    for y in 0..HEIGHT / 2 {
        for x in 0..WIDTH {
            let (d, solid_angle) = direction(x, y);
            rgb[y * WIDTH + x] = light(d);
            (0..3).for_each(|c| irradiance[c] += rgb[y * WIDTH + x][c] * d.y * solid_angle);
        }
    }
    let mean = irradiance.iter().sum::<f32>() / 3.0;
    let scale = LEVEL * PI / (GROUND * mean);
    let ground = irradiance.map(|e| e * scale * GROUND / PI);
    let mut samples = Vec::with_capacity(rgb.len() * 3);
    for y in 0..HEIGHT {
        for x in 0..WIDTH {
            let (d, _) = direction(x, y);
            let above = smoothstep(d.y, 0.0, 0.35);
            let room = rgb[y * WIDTH + x];
            samples.extend((0..3).map(|c| ground[c] + above * (room[c] * scale - ground[c])));
        }
    }
    Texels::new(WIDTH, HEIGHT, 3, Storage::F32(samples), Encoding::Linear)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_horizon_has_the_colour_of_the_ground_that_the_studio_lights() {
        let t = picture().unwrap();
        let mut irradiance = 0.0;
        for y in 0..HEIGHT / 2 {
            for x in 0..WIDTH {
                let (d, solid_angle) = direction(x, y);
                irradiance += t.texel(x, y, 1) * d.y * solid_angle;
            }
        }
        let ground = irradiance * GROUND / PI;
        let horizon = t.texel(7, HEIGHT - 3, 1);
        assert!((ground / horizon - 1.0).abs() < 0.08, "{ground} and {horizon}");
    }
}
