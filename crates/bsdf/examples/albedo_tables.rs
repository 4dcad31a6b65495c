//! Writes the tables of `crates/bsdf/data`: directional albedos of rough reflections, by quadrature.

use std::f64::consts::PI;

const STEPS: usize = 64;

/// Height-correlated Smith masking of Trowbridge and Reitz' distribution, isotropic.
fn lambda(cos: f64, alpha: f64) -> f64 {
    let t = alpha * alpha * (1.0 - cos * cos) / (cos * cos);
    0.5 * ((1.0 + t).sqrt() - 1.0)
}

/// The factors of f0 and f90: an integral over the visible normals, whose density is sampled exactly on a fine grid.
fn reflected(cos: f64, alpha: f64) -> [f64; 2] {
    if alpha < 1e-6 {
        let rise = (1.0 - cos).powi(5);
        return [1.0 - rise, rise];
    }
    let n = 96;
    let sin = (1.0 - cos * cos).sqrt();
    let stretched = {
        let (x, z) = (alpha * sin, cos);
        let l = (x * x + z * z).sqrt();
        [x / l, z / l]
    };
    let (mut a, mut b) = (0.0, 0.0);
    for i in 0..n {
        let half_z = (1.0 - (i as f64 + 0.5) / n as f64) * (1.0 + stretched[1]);
        let cap = half_z - stretched[1];
        let s = (1.0 - cap * cap).max(0.0).sqrt();
        for j in 0..n {
            let phi = PI * (j as f64 + 0.5) / n as f64;
            let h = [alpha * (s * phi.cos() + stretched[0]), alpha * s * phi.sin(), half_z];
            let l = (h[0] * h[0] + h[1] * h[1] + h[2] * h[2]).sqrt();
            let h = h.map(|v| v / l);
            let c = sin * h[0] + cos * h[2];
            let out = 2.0 * c * h[2] - cos;
            if out <= 0.0 || c <= 0.0 {
                continue;
            }
            let (lo, li) = (lambda(cos, alpha), lambda(out, alpha));
            let weight = (1.0 + lo) / (1.0 + lo + li);
            let rise = (1.0 - c).clamp(0.0, 1.0).powi(5);
            a += weight * (1.0 - rise);
            b += weight * rise;
        }
    }
    [a / (n * n) as f64, b / (n * n) as f64]
}

fn sheen(cos: f64, alpha: f64) -> f64 {
    let n = 96;
    let sin = (1.0 - cos * cos).sqrt();
    let mut sum = 0.0;
    for i in 0..n {
        let ci = (i as f64 + 0.5) / n as f64;
        let si = (1.0 - ci * ci).sqrt();
        for j in 0..n {
            let phi = PI * (j as f64 + 0.5) / n as f64;
            let h = [si * phi.cos() + sin, si * phi.sin(), ci + cos];
            let z = h[2] / (h[0] * h[0] + h[1] * h[1] + h[2] * h[2]).sqrt();
            let d = (2.0 + 1.0 / alpha) * (1.0 - z * z).max(0.0).sqrt().powf(1.0 / alpha) / (2.0 * PI);
            sum += d / (4.0 * (cos + ci - cos * ci)) * ci;
        }
    }
    sum * 2.0 * PI / (n * n) as f64
}

/// A row with its average over the hemisphere, of what will be interpolated.
fn row(f: impl Fn(f64) -> f64) -> Vec<f32> {
    let mut out: Vec<f64> = (0..STEPS).map(|i| f((i as f64 / (STEPS - 1) as f64).powi(2).max(1e-5))).collect();
    let n = 100_000;
    let mean: f64 = (0..n)
        .map(|k| {
            let c = (k as f64 + 0.5) / n as f64;
            let x = c.sqrt() * (STEPS - 1) as f64;
            let i = (x as usize).min(STEPS - 2);
            let t = x - i as f64;
            2.0 * c * ((1.0 - t) * out[i] + t * out[i + 1]) / n as f64
        })
        .sum();
    out.push(mean);
    out.iter().map(|&v| v as f32).collect()
}

fn main() -> std::io::Result<()> {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/data");
    let alphas: Vec<f64> = (0..STEPS).map(|r| (r as f64 / (STEPS - 1) as f64).powi(2)).collect();
    let part = |k: usize| alphas.iter().flat_map(move |&a| row(|c| reflected(c, a)[k]));
    let tables: Vec<f32> = part(0).chain(part(1)).collect();
    std::fs::write(
        format!("{folder}/microfacet_albedo.f32"),
        tables.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>(),
    )?;
    let table: Vec<f32> = alphas.iter().flat_map(|&a| row(|c| sheen(c, a.max(1e-3)))).collect();
    std::fs::write(
        format!("{folder}/sheen_albedo.f32"),
        table.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>(),
    )
}
