//! The lens of a realistic camera: its file of surfaces, and the shape of its stop.

use super::Loader;
use super::images::texel_rgb;
use super::params::Params;
use crate::files::read_all;
use steradian_math::{Point2, TAU, exp, sin_cos};
use steradian_scene::{ApertureImage, LensInterface, LensSystem};
use steradian_syntax::Span;

/// Side of the built-in pictures of stops.
const STOP_PIXELS: usize = 256;

impl Loader<'_> {
    /// The lenses of `Camera "realistic"`, in focus; `diagonal` is the film's in metres.
    pub(super) fn lens_system(&mut self, p: &mut Params, diagonal: f32) -> Option<LensSystem> {
        let diameter = p.float("aperturediameter", 1.0);
        let focus = p.float("focusdistance", 10.0);
        let aperture = p.string("aperture").filter(|a| !a.0.is_empty());
        let Some((name, span)) = p.string("lensfile") else {
            p.error(format!("{} needs a `lensfile`", p.what()), None);
            return None;
        };
        let path = self.resolve(&name);
        let surfaces = read_all(self.files, &path)
            .and_then(|bytes| surfaces(&bytes).map_err(|what| format!("{}: {what}", path.display())));
        let mut surfaces = match surfaces {
            Ok(surfaces) => surfaces,
            Err(message) => {
                p.error(message, span);
                return None;
            }
        };
        if diameter.is_nan() || diameter <= 0.0 {
            let span = p.span_of("aperturediameter");
            p.error("`aperturediameter` must be positive", span);
            return None;
        }
        let radius = f64::from(diameter) * 0.5e-3;
        for s in surfaces.iter_mut().filter(|s| s.curvature_radius == 0.0) {
            if radius > s.aperture_radius {
                let most = s.aperture_radius * 2e3;
                let at = p.span_of("aperturediameter");
                p.warning(format!("the stop opens to {most} mm only, not to {diameter} mm"), at);
            }
            s.aperture_radius = s.aperture_radius.min(radius);
        }
        let aperture = match aperture {
            Some((shape, span)) => Some(self.stop_image(p, &shape, span)?),
            None => None,
        };
        match LensSystem::new(surfaces, aperture, f64::from(focus), f64::from(diagonal)) {
            Ok(lens) => Some(lens),
            Err(e) => {
                p.error(format!("{name}: {e}"), span);
                None
            }
        }
    }

    /// The shape of the stop: one of the built-in ones, or a picture.
    fn stop_image(&self, p: &mut Params, shape: &str, span: Span) -> Option<ApertureImage> {
        let n = STOP_PIXELS;
        let rasterized = |f: &dyn Fn(Point2) -> f32| {
            let values = (0..n * n).map(|i| {
                let at = |i: usize| 2.0 * (i as f32 + 0.5) / n as f32 - 1.0;
                f(Point2::new(at(i % n), -at(i / n)))
            });
            ApertureImage::new(n, n, &values.collect::<Vec<f32>>())
        };
        let corners = |count: usize, first: f32, radius: &dyn Fn(usize) -> f32| -> Vec<Point2> {
            let corner = |i: usize| {
                let (sin, cos) = sin_cos(TAU * (i as f32 / count as f32 + first));
                Point2::new(radius(i) * cos, radius(i) * sin)
            };
            (0..count).map(corner).collect()
        };
        let image = match shape {
            "gaussian" => rasterized(&|q| (exp(-(q.x * q.x + q.y * q.y)) - exp(-1.0)).max(0.0)),
            "square" => rasterized(&|q| f32::from(u8::from(q.x.abs() < 0.5 && q.y.abs() < 0.5))),
            "pentagon" => {
                // With a corner down, as in pbrt.
                let pentagon = corners(5, 0.75, &|_| 0.8);
                rasterized(&|q| f32::from(u8::from(is_inside(&pentagon, q))))
            }
            "star" => {
                // The inner corners of the pentagram.
                let inner = sin_cos(TAU / 5.0).1 / sin_cos(TAU / 10.0).1;
                let star = corners(10, 0.0, &|i| if i % 2 == 1 { 1.0 } else { inner });
                rasterized(&|q| f32::from(u8::from(is_inside(&star, q))))
            }
            _ => {
                let texels = self.report_texels(p, shape, span, None)?;
                let (w, h) = (texels.width(), texels.height());
                let mean = |i: usize| texel_rgb(&texels, i % w, i / w).iter().sum::<f32>() / 3.0;
                ApertureImage::new(w, h, &(0..w * h).map(mean).collect::<Vec<f32>>())
            }
        };
        if image.is_none() {
            p.error(format!("{shape}: a stop must let some light through, and no negative light"), span);
        }
        image
    }
}

/// Whether a point is inside a simple polygon.
fn is_inside(corners: &[Point2], q: Point2) -> bool {
    let mut inside = false;
    for (i, a) in corners.iter().enumerate() {
        let b = corners[(i + 1) % corners.len()];
        if (a.y > q.y) != (b.y > q.y) && q.x < a.x + (b.x - a.x) * (q.y - a.y) / (b.y - a.y) {
            inside = !inside;
        }
    }
    inside
}

/// The surfaces in a lens file: four numbers each, from the front to the film, in millimetres; `#` begins a comment.
fn surfaces(bytes: &[u8]) -> Result<Vec<LensInterface>, String> {
    let text = std::str::from_utf8(bytes).map_err(|_| "not UTF-8 text".to_string())?;
    let words = text.lines().flat_map(|l| l.split('#').next().unwrap_or_default().split_whitespace());
    let numbers = words
        .map(|w| w.parse::<f32>().map(f64::from).map_err(|_| format!("`{w}` is not a number")))
        .collect::<Result<Vec<f64>, String>>()?;
    let (rows, rest) = numbers.as_chunks::<4>();
    if rows.is_empty() || !rest.is_empty() {
        return Err(format!(
            "a lens file has four numbers for each surface (curvature radius, thickness, refractive index, aperture \
             diameter), but {} numbers were found",
            numbers.len()
        ));
    }
    Ok(rows
        .iter()
        .map(|&[radius, thickness, eta, diameter]| LensInterface {
            curvature_radius: radius * 1e-3,
            thickness: thickness * 1e-3,
            eta,
            aperture_radius: diameter * 0.5e-3,
        })
        .collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lens_files_are_fours_with_comments() {
        let s = surfaces(b"# radius thickness eta aperture\n50 2 1.5 20 # front\n 0 1\n0 8").unwrap();
        assert_eq!(s.len(), 2);
        assert_eq!((s[0].curvature_radius, s[0].eta, s[1].aperture_radius), (0.05, 1.5, 0.004));
        assert!(surfaces(b"1 2 3").unwrap_err().contains("3 numbers"));
        assert_eq!(surfaces(b"1 2 x 4").unwrap_err(), "`x` is not a number");
    }

    #[test]
    fn polygons_have_an_inside() {
        let triangle = [Point2::new(0.0, 1.0), Point2::new(1.0, -1.0), Point2::new(-1.0, -1.0)];
        assert!(is_inside(&triangle, Point2::new(0.0, 0.0)) && !is_inside(&triangle, Point2::new(0.6, 0.5)));
    }
}
