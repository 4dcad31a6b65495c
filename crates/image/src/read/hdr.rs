//! Radiance pictures (Ward, "Real Pixels", Graphics Gems II): an 8-bit mantissa each for R, G, B and a shared exponent.
//!
//! Header lines are read with tolerance, since many writers get them wrong: unknown lines are skipped, and `PRIMARIES` that are
//! not a triangle (all zeros occur) are ignored.

use crate::{Chromaticities, Error, Image, Precision, read::Limits};

struct Header {
    /// Bytes before the pixels.
    len: usize,
    /// Length of a scan line and number of scan lines, as stored.
    size: [usize; 2],
    /// Whether the lines run along y, and whether each axis is reversed against left-to-right, top-to-bottom.
    transposed: bool,
    flip_x: bool,
    flip_y: bool,
    exposure: f32,
    xyz: bool,
    primaries: Option<Chromaticities>,
}

/// Reads channels `R G B` (`X Y Z` for `32-bit_rle_xyze`), divided by the product of the `EXPOSURE` lines.
pub(super) fn read(bytes: &[u8], name: &str, limits: Limits) -> Result<Image, Error> {
    let bad = |what: &str| Error::malformed(name, "HDR", what);
    let header = header(bytes).map_err(bad)?;
    let [line, lines] = header.size;
    limits.check(name, bytes.len(), line as u64, lines as u64, 16)?;
    let mut at = header.len;
    let (width, height) = if header.transposed { (lines, line) } else { (line, lines) };
    let mut planes: [Vec<f32>; 3] = std::array::from_fn(|_| vec![0.0; width * height]);
    let mut row = vec![[0_u8; 4]; line];
    for j in 0..lines {
        scan_line(bytes, &mut at, &mut row).ok_or_else(|| bad("its pixel data break off or overrun a line"))?;
        for (i, rgbe) in row.iter().enumerate() {
            let (x, y) = if header.transposed { (j, i) } else { (i, j) };
            let x = if header.flip_x { width - 1 - x } else { x };
            let y = if header.flip_y { height - 1 - y } else { y };
            for c in 0..3 {
                planes[c][y * width + x] = decode(rgbe[c], rgbe[3]) / header.exposure;
            }
        }
    }
    let mut image = Image::new(width, height);
    image.metadata.chromaticities = header.primaries;
    let names = if header.xyz { ["X", "Y", "Z"] } else { ["R", "G", "B"] };
    for (channel, samples) in names.into_iter().zip(planes) {
        image.add(channel, samples, Precision::Float)?;
    }
    Ok(image)
}

/// Radiance of one mantissa. Like Radiance's own `ldexp(m / 256, e - 128)` without the half step: 0 stays 0 and 1.0 is exact.
fn decode(mantissa: u8, exponent: u8) -> f32 {
    if exponent == 0 {
        return 0.0;
    }
    // 2^(e - 136), which reaches into the subnormals for e < 10.
    let scale = (f64::from(mantissa)) * f64::from_bits((1023 + u64::from(exponent) - 136) << 52);
    scale as f32
}

fn header(bytes: &[u8]) -> Result<Header, &'static str> {
    if !bytes.starts_with(b"#?") {
        return Err("it does not start with #?");
    }
    let mut at = 0;
    let mut h = Header {
        len: 0,
        size: [0; 2],
        transposed: false,
        flip_x: false,
        flip_y: false,
        exposure: 1.0,
        xyz: false,
        primaries: None,
    };
    loop {
        let line = next_line(bytes, &mut at).ok_or("its header has no end")?;
        if let Some(v) = line.strip_prefix("FORMAT=") {
            h.xyz = match v.trim() {
                "32-bit_rle_rgbe" => false,
                "32-bit_rle_xyze" => true,
                _ => return Err("its FORMAT is neither 32-bit_rle_rgbe nor 32-bit_rle_xyze"),
            };
        } else if let Some(v) = line.strip_prefix("EXPOSURE=") {
            // Several lines multiply. A useless value is ignored.
            if let Some(e) = v.trim().parse::<f32>().ok().filter(|e| e.is_finite() && *e > 0.0) {
                h.exposure *= e;
            }
        } else if let Some(v) = line.strip_prefix("PRIMARIES=") {
            h.primaries = primaries(v);
        } else if resolution(&line, &mut h) {
            h.len = at;
            if !(h.exposure.is_finite() && h.exposure > 0.0) {
                h.exposure = 1.0;
            }
            return Ok(h);
        }
    }
}

/// The next line of text. Lines longer than 4096 bytes are no header.
fn next_line(bytes: &[u8], at: &mut usize) -> Option<String> {
    let rest = bytes.get(*at..)?;
    let end = rest.iter().take(4096).position(|&b| b == b'\n')?;
    *at += end + 1;
    Some(String::from_utf8_lossy(&rest[..end]).trim_end_matches('\r').to_owned())
}

/// Reads `-Y 480 +X 640` and its seven relatives.
fn resolution(line: &str, h: &mut Header) -> bool {
    let words: Vec<&str> = line.split_whitespace().collect();
    let [first, n0, second, n1] = words.as_slice() else { return false };
    let (Ok(n0), Ok(n1)) = (n0.parse::<u32>(), n1.parse::<u32>()) else { return false };
    let axis = |w: &str| match w {
        "-Y" => Some((true, false)),
        "+Y" => Some((true, true)),
        "+X" => Some((false, false)),
        "-X" => Some((false, true)),
        _ => None,
    };
    let (Some((first_is_y, flip0)), Some((second_is_y, flip1))) = (axis(first), axis(second)) else { return false };
    if first_is_y == second_is_y || n0 == 0 || n1 == 0 {
        return false;
    }
    // The first axis counts scan lines, the second runs along them.
    h.size = [n1 as usize, n0 as usize];
    h.transposed = !first_is_y;
    (h.flip_x, h.flip_y) = if first_is_y { (flip1, flip0) } else { (flip0, flip1) };
    true
}

/// Eight numbers that span a triangle with the white point's y not zero; anything else is taken as absent.
fn primaries(text: &str) -> Option<Chromaticities> {
    let v: Vec<f32> = text.split_whitespace().map(|w| w.parse().unwrap_or(f32::NAN)).collect();
    let &[rx, ry, gx, gy, bx, by, wx, wy] = v.as_slice() else { return None };
    let area = (gx - rx) * (by - ry) - (bx - rx) * (gy - ry);
    let sane = v.iter().all(|x| x.is_finite() && x.abs() < 10.0) && area.abs() > 1e-4 && wy > 1e-4;
    sane.then_some(Chromaticities { red: [rx, ry], green: [gx, gy], blue: [bx, by], white: [wx, wy] })
}

/// Decodes one scan line in any of the three codings. `None`: too few bytes, or a run past the end of the line.
fn scan_line(bytes: &[u8], at: &mut usize, row: &mut [[u8; 4]]) -> Option<()> {
    let head: [u8; 4] = bytes.get(*at..*at + 4)?.try_into().ok()?;
    let len = usize::from(head[2]) << 8 | usize::from(head[3]);
    if head[0] == 2 && head[1] == 2 && head[2] < 128 && len == row.len() && (8..0x8000).contains(&len) {
        *at += 4;
        return component_runs(bytes, at, row);
    }
    pixel_runs(bytes, at, row)
}

/// The newer coding: each of the four components by itself, in runs (count above 128) and literals.
fn component_runs(bytes: &[u8], at: &mut usize, row: &mut [[u8; 4]]) -> Option<()> {
    for c in 0..4 {
        let mut x = 0;
        while x < row.len() {
            let count = usize::from(*bytes.get(*at)?);
            *at += 1;
            let (n, is_run) = if count > 128 { (count - 128, true) } else { (count, false) };
            if n == 0 || n > row.len() - x {
                return None;
            }
            let data = bytes.get(*at..*at + if is_run { 1 } else { n })?;
            for (i, pixel) in row[x..x + n].iter_mut().enumerate() {
                pixel[c] = if is_run { data[0] } else { data[i] };
            }
            *at += data.len();
            x += n;
        }
    }
    Some(())
}

/// The older coding: plain pixels, where 1 1 1 n repeats the pixel before it n times (consecutive ones in growing powers of 256).
fn pixel_runs(bytes: &[u8], at: &mut usize, row: &mut [[u8; 4]]) -> Option<()> {
    let (mut x, mut shift) = (0, 0);
    while x < row.len() {
        let p: [u8; 4] = bytes.get(*at..*at + 4)?.try_into().ok()?;
        *at += 4;
        if p[..3] == [1, 1, 1] && x > 0 {
            let n = usize::from(p[3]).checked_shl(shift)?;
            if shift > 24 || n > row.len() - x {
                return None;
            }
            let last = row[x - 1];
            row[x..x + n].fill(last);
            x += n;
            shift += 8;
        } else {
            row[x] = p;
            x += 1;
            shift = 0;
        }
    }
    Some(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn with_header(extra: &str, size: &str, pixels: &[u8]) -> Vec<u8> {
        let mut v = format!("#?RADIANCE\n{extra}FORMAT=32-bit_rle_rgbe\n\n{size}\n").into_bytes();
        v.extend_from_slice(pixels);
        v
    }

    #[test]
    fn zero_primaries_are_ignored_and_exposure_is_divided_out() {
        let one = [128, 128, 128, 129];
        let file = with_header("PRIMARIES=0 0 0 0 0 0 0 0\nEXPOSURE=2.0\nEXPOSURE=4\n", "-Y 1 +X 1", &one);
        let image = read(&file, "a.hdr", Limits::default()).unwrap();
        assert_eq!(image.metadata.chromaticities, None);
        assert_eq!(image.channel("R").unwrap(), [0.125]);
    }

    #[test]
    fn proper_primaries_are_kept() {
        let file = with_header("PRIMARIES=.64 .33 .3 .6 .15 .06 .3127 .329\n", "-Y 1 +X 1", &[1, 2, 3, 136]);
        let image = read(&file, "a.hdr", Limits::default()).unwrap();
        assert_eq!(image.metadata.chromaticities, Some(Chromaticities::SRGB));
        assert_eq!(image.rgb().unwrap(), [[1.0, 2.0, 3.0]]);
    }

    #[test]
    fn the_axes_may_be_flipped_or_swapped() {
        let pixels = [1, 0, 0, 136, 2, 0, 0, 136];
        let row = |size: &str| {
            let image = read(&with_header("", size, &pixels), "a.hdr", Limits::default()).unwrap();
            ((image.width(), image.height()), image.channel("R").unwrap().to_vec())
        };
        assert_eq!(row("-Y 1 +X 2"), ((2, 1), vec![1.0, 2.0]));
        assert_eq!(row("-Y 1 -X 2"), ((2, 1), vec![2.0, 1.0]));
        assert_eq!(row("+Y 2 +X 1"), ((1, 2), vec![2.0, 1.0]));
        assert_eq!(row("+X 1 -Y 2"), ((1, 2), vec![1.0, 2.0]));
    }

    #[test]
    fn old_runs_repeat_the_last_pixel() {
        let pixels = [7, 0, 0, 136, 1, 1, 1, 3];
        let image = read(&with_header("", "-Y 1 +X 4", &pixels), "a.hdr", Limits::default()).unwrap();
        assert_eq!(image.channel("R").unwrap(), [7.0; 4]);
        let overrun = [7, 0, 0, 136, 1, 1, 1, 9];
        assert!(read(&with_header("", "-Y 1 +X 4", &overrun), "a.hdr", Limits::default()).is_err());
    }
}
