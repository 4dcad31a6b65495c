//! How much a rough surface reflects in one bounce, tabulated: what makes layers exchange energy exactly (Kelemen and
//! Szirmay-Kalos 2001; Kulla and Conty 2017).
//!
//! With Schlick's Fresnel term the directional albedo of a microfacet reflection is linear in the reflectance at normal and
//! at grazing incidence, `f0 * A + f90 * B`, so that two tables over cosine and roughness say it all. The tables are written
//! by `cargo run --release -p steradian-bsdf --example albedo_tables`.

/// Steps of the tables along both axes: the square root of the cosine, and the square root of alpha.
pub(super) const STEPS: usize = 64;
/// One more for the average over the hemisphere.
const ROW: usize = STEPS + 1;

static REFLECTION: [f32; 2 * STEPS * ROW] = floats(include_bytes!("../../data/microfacet_albedo.f32"));
static SHEEN: [f32; STEPS * ROW] = floats(include_bytes!("../../data/sheen_albedo.f32"));

const fn floats<const N: usize, const BYTES: usize>(bytes: &[u8; BYTES]) -> [f32; N] {
    assert!(BYTES == 4 * N);
    let mut out = [0.0; N];
    let mut i = 0;
    while i < N {
        out[i] = f32::from_le_bytes([bytes[4 * i], bytes[4 * i + 1], bytes[4 * i + 2], bytes[4 * i + 3]]);
        i += 1;
    }
    out
}

/// A position between two steps.
#[inline]
fn place(x: f32) -> (usize, f32) {
    let x = x.clamp(0.0, 1.0) * (STEPS - 1) as f32;
    let i = (x as usize).min(STEPS - 2);
    (i, x - i as f32)
}

/// Bilinear interpolation in the table that starts at `first`; column `STEPS` holds averages.
#[inline]
fn look_up(table: &[f32], first: usize, cos: f32, alpha: f32) -> f32 {
    let (r, fr) = place(alpha.sqrt());
    let (c, fc) = place(cos.abs().sqrt());
    let row = |r: usize| {
        let at = first + r * ROW + c;
        (1.0 - fc) * table[at] + fc * table[at + 1]
    };
    (1.0 - fr) * row(r) + fr * row(r + 1)
}

#[inline]
fn average(table: &[f32], first: usize, alpha: f32) -> f32 {
    let (r, fr) = place(alpha.sqrt());
    let at = |r: usize| table[first + r * ROW + STEPS];
    (1.0 - fr) * at(r) + fr * at(r + 1)
}

/// The factors of `f0` and of `f90` in the directional albedo.
#[inline]
pub(super) fn reflected(cos: f32, alpha: f32) -> [f32; 2] {
    [look_up(&REFLECTION, 0, cos, alpha), look_up(&REFLECTION, STEPS * ROW, cos, alpha)]
}

/// The same, averaged over directions by their cosine.
#[inline]
pub(super) fn reflected_on_average(alpha: f32) -> [f32; 2] {
    [average(&REFLECTION, 0, alpha), average(&REFLECTION, STEPS * ROW, alpha)]
}

/// The directional albedo of white sheen.
#[inline]
pub(super) fn sheen(cos: f32, alpha: f32) -> f32 {
    look_up(&SHEEN, 0, cos, alpha)
}
