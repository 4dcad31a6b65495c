//! Radiance pictures: shared-exponent pixels, run-length coded per component as `freadscan` expects.

use crate::{Error, Image};

pub(super) fn encode(image: &Image, name: &str) -> Result<Vec<u8>, Error> {
    let planes = super::colour_planes(image, name)?;
    let (w, h) = (image.width(), image.height());
    let mut out = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n".to_vec();
    if let Some(c) = image.metadata.chromaticities {
        let v = [c.red, c.green, c.blue, c.white].concat().iter().map(f32::to_string).collect::<Vec<_>>();
        out.extend_from_slice(format!("PRIMARIES={}\n", v.join(" ")).as_bytes());
    }
    out.extend_from_slice(format!("\n-Y {h} +X {w}\n").as_bytes());
    let mut component = vec![0_u8; w];
    for y in 0..h {
        let row: Vec<[u8; 4]> = (y * w..(y + 1) * w).map(|i| rgbe(planes.map(|p| p[i]))).collect();
        if !(8..0x8000).contains(&w) {
            // Readers take shorter and longer lines as plain pixels.
            out.extend(row.iter().flatten());
            continue;
        }
        out.extend_from_slice(&[2, 2, (w >> 8) as u8, w as u8]);
        for c in 0..4 {
            for (to, from) in component.iter_mut().zip(&row) {
                *to = from[c];
            }
            runs(&component, &mut out);
        }
    }
    Ok(out)
}

/// The nearest shared-exponent colour. Negative and NaN components become 0, too large ones the largest value.
fn rgbe(rgb: [f32; 3]) -> [u8; 4] {
    // The format ends at 255 * 2^119.
    let rgb = rgb.map(|v| crate::tonemap::limited(v, 1.694e38));
    let largest = rgb[0].max(rgb[1]).max(rgb[2]);
    // Exponent e with largest < 2^(e-128): from the bits, since log2 would round.
    let mut e = (largest.to_bits() >> 23) as i32 - 126 + 128;
    if largest < 1e-37 || e < 1 {
        return [0; 4];
    }
    let quantize = |e: i32| {
        // 2^(136 - e)
        let scale = f64::from_bits(((1023 + 136 - e) as u64) << 52);
        rgb.map(|v| (f64::from(v) * scale + 0.5) as u32)
    };
    let mut q = quantize(e);
    if q.iter().any(|&m| m > 255) {
        e += 1;
        q = quantize(e);
    }
    [q[0].min(255) as u8, q[1].min(255) as u8, q[2].min(255) as u8, e.min(255) as u8]
}

/// Runs of four or more as (128 + n, value), the rest as (n, values...).
fn runs(data: &[u8], out: &mut Vec<u8>) {
    let run_at = |x: usize| data[x..].iter().take(127).take_while(|&&b| b == data[x]).count();
    let mut x = 0;
    while x < data.len() {
        let n = run_at(x);
        if n >= 4 {
            out.extend_from_slice(&[128 + n as u8, data[x]]);
            x += n;
            continue;
        }
        let start = x;
        while x < data.len() && x - start < 128 && (x == start || run_at(x) < 4) {
            x += 1;
        }
        out.push((x - start) as u8);
        out.extend_from_slice(&data[start..x]);
    }
}
