//! Systems of spherical lenses, surface by surface (Kolb, Mitchell and Hanrahan, "A realistic camera model for computer
//! graphics", 1995; PBRT 4th ed., 5.4).
//!
//! Coordinates are those of the camera in metres: the film is the plane z = 0, the lenses lie on the +z axis, the scene is
//! beyond them. Rays are traced in double precision: a hundredth of a degree is a pixel.

/// One surface of a lens, or the stop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LensInterface {
    /// Radius of curvature in metres, positive where the surface bulges towards the scene; zero is the stop.
    pub curvature_radius: f64,
    /// Distance to the next surface towards the film (of the last one: to the film), in metres.
    pub thickness: f64,
    /// Refractive index between this surface and the next towards the film.
    pub eta: f64,
    /// Radius of the opening in metres.
    pub aperture_radius: f64,
}

/// The shape of the stop as a picture, as bright in total as a disc.
#[derive(Clone, Debug, PartialEq)]
pub struct ApertureImage {
    width: usize,
    height: usize,
    values: Vec<f32>,
}

impl ApertureImage {
    /// A picture that spans the stop's bounding square, row by row with the top first; `None` unless it lets some light
    /// through and nothing negative.
    pub fn new(width: usize, height: usize, values: &[f32]) -> Option<Self> {
        let sum: f64 = values.iter().map(|&v| f64::from(v)).sum();
        let valid = width > 0 && width.checked_mul(height) == Some(values.len());
        if !valid || sum <= 0.0 || !sum.is_finite() || values.iter().any(|v| *v < 0.0) {
            return None;
        }
        let scale = std::f64::consts::FRAC_PI_4 * values.len() as f64 / sum;
        Some(Self { width, height, values: values.iter().map(|&v| (f64::from(v) * scale) as f32).collect() })
    }

    fn texel(&self, x: i64, y: i64) -> f64 {
        let inside = x >= 0 && y >= 0 && x < self.width as i64 && y < self.height as i64;
        if inside { f64::from(self.values[y as usize * self.width + x as usize]) } else { 0.0 }
    }

    /// The transmittance at a point of the stop, whose radius is one.
    fn at(&self, x: f64, y: f64) -> f64 {
        let (u, v) = ((x + 1.0) * 0.5 * self.width as f64 - 0.5, (1.0 - y) * 0.5 * self.height as f64 - 0.5);
        let (u0, v0) = (u.floor(), v.floor());
        let (fu, fv) = (u - u0, v - v0);
        // Far outside, the cast to integers would not matter: all there is black.
        let (i, j) = (u0 as i64, v0 as i64);
        let row = |j: i64| (1.0 - fu) * self.texel(i, j) + fu * self.texel(i.saturating_add(1), j);
        (1.0 - fv) * row(j) + fv * row(j.saturating_add(1))
    }

    /// The largest distance from the axis that lets light through, in units of the stop's radius.
    fn reach(&self) -> f64 {
        let (w, h) = (self.width as f64, self.height as f64);
        let mut most = 0.0f64;
        for y in 0..self.height {
            for x in (0..self.width).filter(|x| self.values[y * self.width + x] > 0.0) {
                // Interpolation spreads a texel by its own size.
                let far = |i: usize, n: f64| ((2.0 * i as f64 + 1.0) / n - 1.0).abs() + 2.0 / n;
                let (dx, dy) = (far(x, w), far(y, h));
                most = most.max(dx * dx + dy * dy);
            }
        }
        most.sqrt()
    }
}

/// Why lenses do not make a picture.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum LensError {
    /// No surfaces.
    #[error("the lens has no surfaces")]
    Empty,
    /// A number of a surface makes no sense.
    #[error("surface {surface} of the lens makes no sense: {what}")]
    Surface {
        /// Which, from 1 at the front.
        surface: usize,
        /// What is wrong.
        what: &'static str,
    },
    /// Not even a ray beside the axis comes through.
    #[error("no ray comes through the lens near its axis; is the stop extremely small?")]
    Opaque,
    /// Nothing so close can be in focus.
    #[error("the lens cannot be focused at a distance of {distance} m: the nearest is about {nearest} m")]
    TooClose {
        /// The distance asked for.
        distance: f64,
        /// About the nearest that is possible.
        nearest: f64,
    },
}

/// A ray inside the camera; the direction need not be of unit length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LensRay {
    /// Origin.
    pub o: [f64; 3],
    /// Direction.
    pub d: [f64; 3],
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn scaled(a: [f64; 3], s: f64) -> [f64; 3] {
    a.map(|v| v * s)
}

fn sum(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

impl LensRay {
    fn at(&self, t: f64) -> [f64; 3] {
        sum(self.o, scaled(self.d, t))
    }

    /// Moves on to the surface at `z` and bends there from index `eta_i` to `eta_t`. Returns whether there is a ray
    /// afterwards; the opening is not tested.
    fn cross(&mut self, surface: &LensInterface, z: f64, eta_i: f64, eta_t: f64) -> bool {
        let r = surface.curvature_radius;
        if r == 0.0 {
            let t = (z - self.o[2]) / self.d[2];
            self.o = self.at(t);
            return t >= 0.0;
        }
        let centre = [0.0, 0.0, z - r];
        let o = sum(self.o, scaled(centre, -1.0));
        let (a, half_b, c) = (dot(self.d, self.d), dot(self.d, o), dot(o, o) - r * r);
        let discriminant = half_b * half_b - a * c;
        if discriminant < 0.0 {
            return false;
        }
        // Of the two points of the sphere, the one on the side of the axis where the lens is.
        let root = discriminant.sqrt();
        let nearer = (self.d[2] < 0.0) != (r < 0.0);
        let t = if nearer { (-half_b - root) / a } else { (-half_b + root) / a };
        if t < 0.0 {
            return false;
        }
        self.o = self.at(t);
        let mut n = scaled(sum(self.o, scaled(centre, -1.0)), 1.0 / r.abs());
        let w = scaled(self.d, 1.0 / a.sqrt());
        if dot(n, w) > 0.0 {
            n = scaled(n, -1.0);
        }
        let (eta, cos_i) = (eta_i / eta_t, -dot(n, w));
        let sin2_t = eta * eta * (1.0 - cos_i * cos_i).max(0.0);
        if sin2_t >= 1.0 {
            return false;
        }
        let cos_t = (1.0 - sin2_t).sqrt();
        self.d = sum(scaled(w, eta), scaled(n, eta * cos_i - cos_t));
        true
    }
}

/// Lenses in focus.
#[derive(Clone, Debug, PartialEq)]
pub struct LensSystem {
    /// The surfaces, the one towards the scene first.
    interfaces: Vec<LensInterface>,
    aperture: Option<ApertureImage>,
}

impl LensSystem {
    /// Moves the lenses as a whole so that what is `focus_distance` metres from the film appears sharp on it, by the
    /// thick-lens approximation. `film_diagonal` is in metres.
    ///
    /// # Errors
    /// If a surface makes no sense, or that distance cannot be in focus.
    pub fn new(
        interfaces: Vec<LensInterface>,
        aperture: Option<ApertureImage>,
        focus_distance: f64,
        film_diagonal: f64,
    ) -> Result<Self, LensError> {
        if interfaces.is_empty() {
            return Err(LensError::Empty);
        }
        for (i, s) in interfaces.iter().enumerate() {
            let numbers = [s.curvature_radius, s.thickness, s.eta, s.aperture_radius];
            let what = if numbers.iter().any(|v| !v.is_finite()) {
                Some("a number is not finite")
            } else if s.aperture_radius <= 0.0 {
                Some("its opening is not positive")
            } else if s.eta < 0.0 || s.thickness < 0.0 {
                Some("its thickness or refractive index is negative")
            } else {
                None
            };
            if let Some(what) = what {
                return Err(LensError::Surface { surface: i + 1, what });
            }
        }
        let mut system = Self { interfaces, aperture };
        let delta = system.focusing_shift(focus_distance, film_diagonal)?;
        let last = system.interfaces.len() - 1;
        system.interfaces[last].thickness += delta;
        if system.rear_z() > 0.0 { Ok(system) } else { Err(LensError::Opaque) }
    }

    /// Distance of the last surface from the film.
    pub fn rear_z(&self) -> f64 {
        self.interfaces.last().map_or(0.0, |s| s.thickness)
    }

    /// Radius of the opening nearest to the film.
    pub fn rear_radius(&self) -> f64 {
        self.interfaces.last().map_or(0.0, |s| s.aperture_radius)
    }

    /// The refractive index in front of surface `i`.
    fn eta_before(&self, i: usize) -> f64 {
        let eta = if i == 0 { 0.0 } else { self.interfaces[i - 1].eta };
        if eta == 0.0 { 1.0 } else { eta }
    }

    fn eta_behind(&self, i: usize) -> f64 {
        let eta = self.interfaces[i].eta;
        if eta == 0.0 { 1.0 } else { eta }
    }

    /// The ray on the side of the scene that a ray from the film becomes, and the stop's transmittance on the way.
    /// `None` if it does not come through.
    #[inline]
    pub fn trace_from_film(&self, ray: LensRay) -> Option<(LensRay, f64)> {
        self.trace(ray, |x, y| self.aperture.as_ref().map_or(f64::from(x * x + y * y <= 1.0), |a| a.at(x, y)))
    }

    /// Whether a ray from the film would come through if the stop were the smallest disc around its shape.
    pub fn passes_round_stop(&self, ray: LensRay, reach: f64) -> bool {
        self.trace(ray, |x, y| f64::from(x * x + y * y <= reach * reach)).is_some()
    }

    /// The radius of the smallest disc around the shape of the stop, in units of the stop's radius.
    pub fn stop_reach(&self) -> f64 {
        self.aperture.as_ref().map_or(1.0, ApertureImage::reach)
    }

    #[inline]
    fn trace(&self, mut ray: LensRay, stop: impl Fn(f64, f64) -> f64) -> Option<(LensRay, f64)> {
        let (mut z, mut weight) = (0.0, 1.0);
        for (i, surface) in self.interfaces.iter().enumerate().rev() {
            z += surface.thickness;
            if !ray.cross(surface, z, self.eta_behind(i), self.eta_before(i)) {
                return None;
            }
            let (x, y) = (ray.o[0] / surface.aperture_radius, ray.o[1] / surface.aperture_radius);
            if surface.curvature_radius == 0.0 {
                weight *= stop(x, y);
                if weight <= 0.0 {
                    return None;
                }
            } else if x * x + y * y > 1.0 {
                return None;
            }
        }
        Some((ray, weight))
    }

    /// The ray on the side of the film that a ray from the scene becomes; the stop is a disc.
    fn trace_from_scene(&self, mut ray: LensRay) -> Option<LensRay> {
        let mut z = self.front_z();
        for (i, surface) in self.interfaces.iter().enumerate() {
            if !ray.cross(surface, z, self.eta_before(i), self.eta_behind(i)) {
                return None;
            }
            let [x, y, _] = ray.o;
            if x * x + y * y > surface.aperture_radius * surface.aperture_radius {
                return None;
            }
            z -= surface.thickness;
        }
        Some(ray)
    }

    fn front_z(&self) -> f64 {
        self.interfaces.iter().map(|s| s.thickness).sum()
    }

    /// The positions of principal plane and focal point, from a ray that came in parallel to the axis at height `x`.
    fn cardinal_points(x: f64, out: &LensRay) -> (f64, f64) {
        let z_at = |height: f64| -out.at((height - out.o[0]) / out.d[0])[2];
        (z_at(x), z_at(0.0))
    }

    fn focusing_shift(&self, focus_distance: f64, film_diagonal: f64) -> Result<f64, LensError> {
        let x = 1e-3 * film_diagonal;
        let parallel = |z: f64, dz: f64| LensRay { o: [x, 0.0, z], d: [0.0, 0.0, dz] };
        let from_scene = self.trace_from_scene(parallel(self.front_z() + 1.0, -1.0)).ok_or(LensError::Opaque)?;
        let start = parallel(self.rear_z() - 1.0, 1.0);
        let (from_film, _) = self.trace(start, |x, y| f64::from(x * x + y * y <= 1.0)).ok_or(LensError::Opaque)?;
        let (p0, f0) = Self::cardinal_points(x, &from_scene);
        let (p1, _) = Self::cardinal_points(x, &from_film);
        let f = f0 - p0;
        let z = -focus_distance;
        let c = (p1 - z - p0) * (p1 - z - 4.0 * f - p0);
        if c > 0.0 {
            return Ok((p1 - z + p0 - c.sqrt()) / 2.0);
        }
        if c.is_finite() {
            return Err(LensError::TooClose { distance: focus_distance, nearest: p0 - p1 + 4.0 * f });
        }
        Err(LensError::Opaque)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn doublet(focus: f64) -> Result<LensSystem, LensError> {
        let s = |r: f64, t: f64, eta: f64, d: f64| LensInterface {
            curvature_radius: r * 1e-3,
            thickness: t * 1e-3,
            eta,
            aperture_radius: d * 0.5e-3,
        };
        let all = vec![s(51.7, 4.0, 1.5168, 22.0), s(-1900.0, 6.0, 1.0, 22.0), s(0.0, 6.0, 0.0, 8.0)];
        let rear = [s(1900.0, 4.0, 1.5168, 22.0), s(-51.7, 50.0, 1.0, 22.0)];
        LensSystem::new(all.into_iter().chain(rear).collect(), None, focus, 0.035)
    }

    #[test]
    fn rays_of_one_film_point_meet_in_the_focal_plane() {
        let lens = doublet(2.0).unwrap();
        let at = |x: f64, u: f64| {
            let d = [u - x, 0.0, lens.rear_z()];
            let (r, w) = lens.trace_from_film(LensRay { o: [x, 0.0, 0.0], d }).unwrap();
            assert_eq!(w, 1.0);
            r.at((2.0 - r.o[2]) / r.d[2])[0]
        };
        for x in [0.0, 0.001, 0.002] {
            // The inverted image of the plane two metres from the film, to third-order aberrations.
            let (a, b) = (at(x, 0.0005), at(x, -0.0005));
            assert!((a - b).abs() < 2e-4, "{a} and {b}");
            assert!(x == 0.0 || a < 0.0);
        }
        assert!(lens.trace_from_film(LensRay { o: [0.0; 3], d: [0.02, 0.0, lens.rear_z()] }).is_none());
    }

    #[test]
    fn what_cannot_be_is_an_error() {
        assert!(matches!(doublet(0.1), Err(LensError::TooClose { .. })));
        assert_eq!(LensSystem::new(Vec::new(), None, 1.0, 0.035), Err(LensError::Empty));
        let flat = LensInterface { curvature_radius: 0.0, thickness: 0.01, eta: 0.0, aperture_radius: 0.0 };
        assert!(matches!(LensSystem::new(vec![flat], None, 1.0, 0.035), Err(LensError::Surface { surface: 1, .. })));
        let open = LensInterface { aperture_radius: 0.01, ..flat };
        assert_eq!(LensSystem::new(vec![open], None, 1.0, 0.035), Err(LensError::Opaque));
    }

    #[test]
    fn a_picture_of_a_stop_is_as_bright_as_a_disc() {
        let values: Vec<f32> = (0..16).map(|i| if i == 1 { 3.0 } else { 0.0 }).collect();
        let a = ApertureImage::new(4, 4, &values).unwrap();
        // The one open texel is the second of the top row.
        assert!((a.at(-0.25, 0.75) - 16.0 * std::f64::consts::FRAC_PI_4).abs() < 1e-5);
        assert_eq!((a.at(-0.25, -0.75), a.at(3.0, 3.0)), (0.0, 0.0));
        assert!(a.reach() > 1.2 && a.reach() < 1.5);
        assert!(ApertureImage::new(2, 2, &[0.0; 4]).is_none() && ApertureImage::new(2, 2, &[1.0; 3]).is_none());
    }
}
