//! Gradient noise (Perlin 2002) and sums of it (PBRT 4th ed., 10.5 of the online edition).

use steradian_math::{Point3, Vec3, lerp, log2, smoothstep};

/// Perlin's permutation of 0..256 (Perlin 2002), the published reference table.
#[rustfmt::skip]
const PERMUTATION: [u8; 256] = [
    151,160,137,91,90,15,131,13,201,95,96,53,194,233,7,225,140,36,103,30,69,142,8,99,37,240,21,10,23,190,6,148,247,120,
    234,75,0,26,197,62,94,252,219,203,117,35,11,32,57,177,33,88,237,149,56,87,174,20,125,136,171,168,68,175,74,165,71,
    134,139,48,27,166,77,146,158,231,83,111,229,122,60,211,133,230,220,105,92,41,55,46,245,40,244,102,143,54,65,25,63,161,
    1,216,80,73,209,76,132,187,208,89,18,169,200,196,135,130,116,188,159,86,164,100,109,198,173,186,3,64,52,217,226,250,
    124,123,5,202,38,147,118,126,255,82,85,212,207,206,59,227,47,16,58,17,182,189,28,42,223,183,170,213,119,248,152,2,44,
    154,163,70,221,153,101,155,167,43,172,9,129,22,39,253,19,98,108,110,79,113,224,232,178,185,112,104,218,246,97,228,251,
    34,242,193,238,210,144,12,191,179,162,241,81,51,145,235,249,14,239,107,49,192,214,31,181,199,106,157,184,84,204,176,
    115,121,50,45,127,4,150,254,138,236,205,93,222,114,67,29,24,72,243,141,128,195,78,66,215,61,156,180,
];

fn permuted(i: i32) -> i32 {
    i32::from(PERMUTATION[(i & 255) as usize])
}

/// The gradient of lattice point `(x, y, z)`, one of twelve, times the offset `d` from it.
fn gradient(x: i32, y: i32, z: i32, d: Vec3) -> f32 {
    let h = permuted(permuted(permuted(x) + y) + z) & 15;
    let u = if h < 8 || h == 12 || h == 13 { d.x } else { d.y };
    let v = if h < 4 || h == 12 || h == 13 { d.y } else { d.z };
    (if h & 1 == 1 { -u } else { u }) + (if h & 2 == 2 { -v } else { v })
}

/// Perlin noise at a point: about -1..1, zero at lattice points.
pub fn noise(p: Point3) -> f32 {
    // Keep the cell index representable.
    const LIMIT: f32 = (1 << 30) as f32;
    let split = |v: f32| {
        let v = v % LIMIT;
        let cell = v.floor();
        (cell as i32 & 255, v - cell)
    };
    let ((ix, dx), (iy, dy), (iz, dz)) = (split(p.x), split(p.y), split(p.z));
    let fade = |t: f32| t * t * t * (t * (t * 6.0 - 15.0) + 10.0);
    let corner = |i: i32, j: i32, k: i32| {
        gradient(ix + i, iy + j, iz + k, Vec3::new(dx - i as f32, dy - j as f32, dz - k as f32))
    };
    let (wx, wy, wz) = (fade(dx), fade(dy), fade(dz));
    let row = |j, k| lerp(wx, corner(0, j, k), corner(1, j, k));
    let plane = |k| lerp(wy, row(0, k), row(1, k));
    lerp(wz, plane(0), plane(1))
}

/// Noise in the plane: the slice z = 1/2.
pub fn noise2(x: f32, y: f32) -> f32 {
    noise(Point3::new(x, y, 0.5))
}

/// How many octaves the footprint `(dpdx, dpdy)` resolves, with a fraction.
fn resolved_octaves(dpdx: Vec3, dpdy: Vec3, most: u32) -> (u32, f32) {
    let len2 = dpdx.length_squared().max(dpdy.length_squared());
    let n = (-1.0 - log2(len2) / 2.0).clamp(0.0, most as f32);
    (n.floor() as u32, n - n.floor())
}

/// The ratio of frequencies between octaves: not quite 2, so that lattice points do not coincide.
const LACUNARITY: f32 = 1.99;

/// Fractional Brownian motion: octaves of noise with amplitudes falling by `omega`, as far as the footprint resolves them.
pub fn fbm(p: Point3, dpdx: Vec3, dpdy: Vec3, omega: f32, octaves: u32) -> f32 {
    let (n, partial) = resolved_octaves(dpdx, dpdy, octaves);
    let (mut sum, mut lambda, mut amplitude) = (0.0, 1.0, 1.0);
    for _ in 0..n {
        sum += amplitude * noise(p * lambda);
        lambda *= LACUNARITY;
        amplitude *= omega;
    }
    sum + amplitude * smoothstep(partial, 0.3, 0.7) * noise(p * lambda)
}

/// Turbulence: absolute values of noise; octaves that the footprint hides are replaced by their mean.
pub fn turbulence(p: Point3, dpdx: Vec3, dpdy: Vec3, omega: f32, octaves: u32) -> f32 {
    const MEAN: f32 = 0.2;
    let (n, partial) = resolved_octaves(dpdx, dpdy, octaves);
    let (mut sum, mut lambda, mut amplitude) = (0.0, 1.0, 1.0);
    for _ in 0..n {
        sum += amplitude * noise(p * lambda).abs();
        lambda *= LACUNARITY;
        amplitude *= omega;
    }
    sum += amplitude * lerp(smoothstep(partial, 0.3, 0.7), MEAN, noise(p * lambda).abs());
    for _ in n..octaves {
        sum += amplitude * MEAN;
        amplitude *= omega;
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_is_a_permutation() {
        let mut seen = [false; 256];
        PERMUTATION.iter().for_each(|&p| seen[p as usize] = true);
        assert!(seen.iter().all(|&s| s));
    }

    #[test]
    fn noise_vanishes_on_the_lattice_and_is_continuous() {
        assert_eq!(noise(Point3::new(3.0, -7.0, 12.0)), 0.0);
        let mut largest = 0.0f32;
        for i in 0..4000 {
            let p = Point3::new(i as f32 * 0.37, i as f32 * -0.11, i as f32 * 0.05);
            let step = (noise(p + Vec3::new(1e-3, 0.0, 0.0)) - noise(p)).abs();
            assert!(step < 6e-3, "{p:?} {step}");
            largest = largest.max(noise(p).abs());
        }
        assert!(largest > 0.4 && largest <= 1.1);
    }

    #[test]
    fn a_wide_footprint_hides_every_octave() {
        let wide = Vec3::splat(10.0);
        let p = Point3::new(0.3, 0.2, 0.9);
        assert_eq!(fbm(p, wide, wide, 0.5, 8), 0.0);
        let mean: f32 = (0..8).map(|i| 0.2 * 0.5f64.powi(i) as f32).sum();
        assert!((turbulence(p, wide, wide, 0.5, 8) - mean - 0.0).abs() < 0.21);
    }
}
