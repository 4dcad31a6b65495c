//! The built camera: film position to ray (PBRT 4th ed., 5.1-5.3; thin lens of Potmesil and Chakravarty 1981).

use super::lens::Lens;
use crate::{Camera, Handle, Medium, Projection, SphericalMapping};
use steradian_bvh::fearless_simd::{Level, dispatch};
use steradian_math::{
    AnimatedTransform, Normal3, PI, Point2, Point3, ROW, Ray, RayDifferential, Row, Rows3, TAU, Transform, Vec3, lerp,
    radians, row_end, sin_cos, tan,
};
use steradian_sampling::warp::{square_to_octahedral, square_to_uniform_disk_concentric, wrap_octahedral};

/// Where on film, lens and shutter a camera ray starts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraSample {
    /// Raster position: pixels, y down.
    pub film: Point2,
    /// Uniform in the unit square.
    pub lens: [f32; 2],
    /// Uniform in `[0, 1)`: the moment within the shutter interval.
    pub time: f32,
}

/// Differentials are spaced like samples, not pixels: every pixel gets at least this many samples per axis in a render
/// that anybody keeps. A fixed number, because a resumed or adaptive render does not know how many there will be.
pub const DIFFERENTIAL_SCALE: f32 = 0.125;

/// A camera ready to generate rays.
#[derive(Clone, Debug)]
pub struct CameraModel {
    pub(super) projection: Projection,
    /// The lenses of a realistic camera.
    lens: Option<Lens>,
    world_from_camera: AnimatedTransform,
    shutter: [f32; 2],
    lens_radius: f32,
    pub(super) focal_distance: f32,
    /// Raster to the plane z = 1 of camera space: `[x0, x1, y0, y1]` of the film's edges there.
    pub(super) window: [f32; 4],
    pub(super) resolution: [f32; 2],
    /// The least change of origin and direction between neighbouring pixels, x then y, in a frame that looks along +z.
    min_differential: [[Vec3; 2]; 2],
    differential_scale: f32,
    /// The medium around the camera.
    pub medium: Option<Handle<Medium>>,
}

impl CameraModel {
    /// Builds the camera for a film of `resolution` pixels. `pixel_jitter` off means one sample per pixel centre, whose
    /// footprint is the whole pixel.
    pub fn new(camera: &Camera, resolution: [u32; 2], pixel_jitter: bool) -> Self {
        let resolution = resolution.map(|n| n as f32);
        let aspect = camera.frame_aspect_ratio.unwrap_or(resolution[0] / resolution[1]);
        let mut window = camera.screen_window.unwrap_or(if aspect > 1.0 {
            [-aspect, aspect, -1.0, 1.0]
        } else {
            [-1.0, 1.0, -1.0 / aspect, 1.0 / aspect]
        });
        if let Projection::Perspective { fov } = camera.projection {
            let half = tan(radians(fov) * 0.5);
            window = window.map(|w| w * half);
        }
        let lens = match &camera.projection {
            Projection::Realistic { lens, diagonal } => Some(Lens::new(lens, f64::from(*diagonal), resolution)),
            _ => None,
        };
        let mut model = Self {
            projection: camera.projection.clone(),
            lens,
            world_from_camera: camera.world_from_camera,
            shutter: camera.shutter,
            lens_radius: camera.lens_radius,
            focal_distance: camera.focal_distance,
            window,
            resolution,
            min_differential: [[Vec3::default(); 2]; 2],
            differential_scale: if pixel_jitter { DIFFERENTIAL_SCALE } else { 1.0 },
            medium: camera.medium,
        };
        model.find_min_differentials();
        model
    }

    /// Whether rays start on a lens.
    pub fn has_lens(&self) -> bool {
        match self.projection {
            Projection::Perspective { .. } | Projection::Orthographic => self.lens_radius > 0.0,
            Projection::Spherical { .. } => false,
            Projection::Realistic { .. } => true,
        }
    }

    /// Whether the camera moves while the shutter is open.
    pub fn is_animated(&self) -> bool {
        self.world_from_camera.is_animated()
    }

    /// The length of the shutter interval.
    pub fn exposure_time(&self) -> f32 {
        self.shutter[1] - self.shutter[0]
    }

    /// The transform to world space at `time`.
    pub fn world_from_camera(&self, time: f32) -> Transform {
        self.world_from_camera.at(time)
    }

    /// The direction of view, in world space, at the opening of the shutter.
    pub fn view_direction(&self) -> Vec3 {
        self.world_from_camera.at(self.shutter[0]).vector(Vec3::new(0.0, 0.0, 1.0)).normalize()
    }

    #[inline(always)]
    fn on_plane(&self, film: Point2) -> (f32, f32) {
        (
            lerp(film.x / self.resolution[0], self.window[0], self.window[1]),
            lerp(film.y / self.resolution[1], self.window[3], self.window[2]),
        )
    }

    /// Origin and unit direction in camera space, and the weight of the ray. Where real lenses let nothing through, the
    /// ray along the axis with no weight.
    #[inline]
    fn camera_ray(&self, film: Point2, u: [f32; 2]) -> (Point3, Vec3, f32) {
        if let Some(lens) = &self.lens {
            let at = [film.x / self.resolution[0], film.y / self.resolution[1]];
            return lens.ray(at, u).unwrap_or((Point3::default(), Vec3::new(0.0, 0.0, 1.0), 0.0));
        }
        let (o, d) = self.ideal_ray(film, self.lens_point(u));
        (o, d, 1.0)
    }

    /// Origin and unit direction in camera space, for projections without real lenses.
    #[inline]
    fn ideal_ray(&self, film: Point2, lens: Option<(f32, f32)>) -> (Point3, Vec3) {
        match self.projection {
            Projection::Perspective { .. } => {
                let (x, y) = self.on_plane(film);
                let d = Vec3::new(x, y, 1.0);
                match lens {
                    None => (Point3::default(), d.normalize()),
                    Some((lx, ly)) => {
                        let focus = Point3::default() + d * self.focal_distance;
                        let o = Point3::new(lx, ly, 0.0);
                        (o, (focus - o).normalize())
                    }
                }
            }
            // A realistic camera has its lens, and its rays from there.
            Projection::Orthographic | Projection::Realistic { .. } => {
                let (x, y) = self.on_plane(film);
                match lens {
                    None => (Point3::new(x, y, 0.0), Vec3::new(0.0, 0.0, 1.0)),
                    Some((lx, ly)) => {
                        let o = Point3::new(x + lx, y + ly, 0.0);
                        (o, (Point3::new(x, y, self.focal_distance) - o).normalize())
                    }
                }
            }
            Projection::Spherical { mapping } => {
                let (u, v) = (film.x / self.resolution[0], film.y / self.resolution[1]);
                let d = match mapping {
                    SphericalMapping::EqualArea => square_to_octahedral(wrap_octahedral([u, v])),
                    SphericalMapping::Equirectangular => {
                        let (sin_theta, cos_theta) = sin_cos(PI * v);
                        Vec3::spherical(sin_theta, cos_theta, TAU * u)
                    }
                };
                // Those mappings have z up; a camera has y up.
                (Point3::default(), Vec3::new(d.x, d.z, d.y))
            }
        }
    }

    /// The moment of a sample.
    #[inline]
    pub fn time_of(&self, sample: &CameraSample) -> f32 {
        lerp(sample.time, self.shutter[0], self.shutter[1])
    }

    /// The ray through a film position, with unit direction, in world space.
    #[inline]
    pub fn ray(&self, sample: &CameraSample) -> Ray {
        self.weighted_ray(sample).0
    }

    /// [`CameraModel::ray`], and what radiance along it counts: one without real lenses, zero where they let nothing
    /// through.
    #[inline]
    pub fn weighted_ray(&self, sample: &CameraSample) -> (Ray, f32) {
        let time = self.time_of(sample);
        let (o, d, weight) = self.camera_ray(sample.film, sample.lens);
        let t = self.world_from_camera.at(time);
        (Ray::new(t.point(o), t.vector(d).normalize(), time), weight)
    }

    /// Directions of the rays through the first `n` film positions, where all start at one point at one time, which are returned: those of
    /// [`CameraModel::weighted_ray`] for a lens that is a point.
    pub(super) fn pinhole_rays(&self, level: Level, film: &[Row; 2], n: usize, d: &mut Rows3) -> Option<(Point3, f32)> {
        let fits = matches!(self.projection, Projection::Perspective { .. }) && !self.has_lens() && !self.is_animated();
        if !fits {
            return None;
        }
        let time = lerp(0.5, self.shutter[0], self.shutter[1]);
        let t = self.world_from_camera.at(time);
        dispatch!(level, _simd => self.pinhole_directions(&t, film, row_end(n), d));
        Some((t.point(Point3::default()), time))
    }

    #[inline(always)]
    fn pinhole_directions(&self, t: &Transform, film: &[Row; 2], end: usize, d: &mut Rows3) {
        for i in 0..end.min(ROW) {
            let (x, y) = self.on_plane(Point2::new(film[0].0[i], film[1].0[i]));
            d.set(i, t.vector(Vec3::new(x, y, 1.0).normalize()).normalize());
        }
    }

    #[inline]
    pub(super) fn lens_point(&self, u: [f32; 2]) -> Option<(f32, f32)> {
        (self.has_lens() && self.lens.is_none()).then(|| {
            let d = square_to_uniform_disk_concentric(u);
            (d[0] * self.lens_radius, d[1] * self.lens_radius)
        })
    }

    /// How many pixels the rays of [`differential`](Self::differential) are away.
    pub fn differential_scale(&self) -> f32 {
        self.differential_scale
    }

    /// The rays of the neighbouring samples in x and y, for texture filtering.
    pub fn differential(&self, sample: &CameraSample, ray: &Ray) -> RayDifferential {
        let t = self.world_from_camera.at(ray.time);
        // Where the neighbour is not seen through the lenses, the one on the other side tells as much.
        let neighbour = |dx: f32, dy: f32| {
            let (o, d, weight) = self.camera_ray(Point2::new(sample.film.x + dx, sample.film.y + dy), sample.lens);
            (weight > 0.0).then(|| (t.point(o), t.vector(d).normalize()))
        };
        let at = |dx: f32, dy: f32| {
            let mirrored = || neighbour(-dx, -dy).map(|(o, d)| (ray.o - (o - ray.o), ray.d - (d - ray.d)));
            neighbour(dx, dy).or_else(mirrored).unwrap_or((ray.o, ray.d))
        };
        let (rx_o, rx_d) = at(1.0, 0.0);
        let (ry_o, ry_d) = at(0.0, 1.0);
        RayDifferential { rx_o, ry_o, rx_d, ry_d }.scaled(ray, self.differential_scale)
    }

    /// The raster position where a point is seen at `time`, from the middle of the lens; `None` behind the camera, and for
    /// projections that are no planes.
    pub fn raster(&self, p: Point3, time: f32) -> Option<Point2> {
        let p = self.world_from_camera.at(time).inverse().point(p);
        let (x, y) = match self.projection {
            Projection::Perspective { .. } if p.z > 0.0 => (p.x / p.z, p.y / p.z),
            Projection::Orthographic => (p.x, p.y),
            _ => return None,
        };
        let [x0, x1, y0, y1] = self.window;
        Some(Point2::new((x - x0) / (x1 - x0) * self.resolution[0], (y1 - y) / (y1 - y0) * self.resolution[1]))
    }

    /// Whether [`CameraModel::raster`] knows points.
    pub fn has_raster(&self) -> bool {
        matches!(self.projection, Projection::Perspective { .. } | Projection::Orthographic)
    }

    /// When the shutter opens and closes.
    pub fn shutter(&self) -> [f32; 2] {
        self.shutter
    }

    /// Samples the diagonal of the film for the smallest footprint, seen in a frame that looks along +z.
    fn find_min_differentials(&mut self) {
        let mut best = [[Vec3::splat(f32::INFINITY); 2]; 2];
        const N: usize = 512;
        for i in 0..N {
            let f = i as f32 / (N - 1) as f32;
            let film = Point2::new(f * self.resolution[0], f * self.resolution[1]);
            let (o, d, weight) = self.camera_ray(film, [0.5, 0.5]);
            if weight == 0.0 {
                continue;
            }
            let frame = steradian_math::Frame::from_z(d);
            for (axis, step) in
                [Point2::new(film.x + 1.0, film.y), Point2::new(film.x, film.y + 1.0)].iter().enumerate()
            {
                let (o2, d2, weight) = self.camera_ray(*step, [0.5, 0.5]);
                if weight == 0.0 {
                    continue;
                }
                let (dp, dd) = (frame.to_local(o2 - o), frame.to_local(d2) - Vec3::new(0.0, 0.0, 1.0));
                if dp.length_squared() < best[axis][0].length_squared() {
                    best[axis][0] = dp;
                }
                if dd.length_squared() < best[axis][1].length_squared() {
                    best[axis][1] = dd;
                }
            }
        }
        self.min_differential = best.map(|axis| axis.map(|v| if v.is_finite() { v } else { Vec3::default() }));
    }

    /// The footprint on a surface (dp/dx, dp/dy) as if `p` were seen straight from the camera: for rays that carry no
    /// differentials of their own (PBRT 4th ed., 10.1.3).
    pub fn approximate_footprint(&self, p: Point3, n: Normal3, time: f32) -> (Vec3, Vec3) {
        let t = self.world_from_camera.at(time);
        let inverse = t.inverse();
        let pc = inverse.point(p).to_vec();
        let distance = pc.length();
        let Some(z) = pc.try_normalize() else { return Default::default() };
        let frame = steradian_math::Frame::from_z(z);
        let nz = frame.to_local(inverse.normal(n));
        let plane = nz.z * distance;
        let along = |[dp, dd]: [Vec3; 2]| {
            let d = Vec3::new(0.0, 0.0, 1.0) + dd;
            let hit = -(nz.dot(dp) - plane) / nz.dot(d);
            let offset = dp + d * hit - Vec3::new(0.0, 0.0, distance);
            let v = t.vector(frame.from_local(offset)) * self.differential_scale;
            if v.is_finite() { v } else { Vec3::default() }
        };
        (along(self.min_differential[0]), along(self.min_differential[1]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(x: f32, y: f32) -> CameraSample {
        CameraSample { film: Point2::new(x, y), lens: [0.3, 0.8], time: 0.5 }
    }

    #[test]
    fn fov_is_the_full_angle_of_the_shorter_axis() {
        let camera = Camera { projection: Projection::Perspective { fov: 60.0 }, ..Camera::default() };
        let model = CameraModel::new(&camera, [200, 100], true);
        let top = model.ray(&sample(100.0, 0.0)).d;
        let bottom = model.ray(&sample(100.0, 100.0)).d;
        assert!((top.angle_between(bottom) - radians(60.0)).abs() < 1e-5);
        assert!(top.y > 0.0 && model.ray(&sample(200.0, 50.0)).d.x > 0.0);
    }

    #[test]
    fn points_are_seen_where_their_rays_start() {
        for projection in [Projection::Perspective { fov: 50.0 }, Projection::Orthographic] {
            let model = CameraModel::new(&Camera { projection, ..Camera::default() }, [200, 100], true);
            for (x, y) in [(3.0, 4.0), (150.0, 99.0)] {
                let at = model.raster(model.ray(&sample(x, y)).at(7.0), 0.0).unwrap();
                assert!((at.x - x).abs() < 1e-3 && (at.y - y).abs() < 1e-3, "{at:?}");
            }
        }
    }

    #[test]
    fn all_lens_points_meet_in_the_focal_plane() {
        let camera = Camera { lens_radius: 0.5, focal_distance: 3.0, ..Camera::default() };
        let model = CameraModel::new(&camera, [64, 64], true);
        let pinhole = CameraModel::new(&Camera::default(), [64, 64], true).ray(&sample(10.0, 50.0));
        let target = pinhole.at(3.0 / pinhole.d.z);
        for lens in [[0.1, 0.2], [0.9, 0.4], [0.5, 0.99]] {
            let r = model.ray(&CameraSample { lens, ..sample(10.0, 50.0) });
            assert!(r.at((3.0 - r.o.z) / r.d.z).distance(target) < 1e-5);
        }
    }

    #[test]
    fn the_approximate_footprint_matches_the_differential_on_axis() {
        let model = CameraModel::new(&Camera::default(), [64, 64], true);
        let s = sample(32.0, 32.0);
        let r = model.ray(&s);
        let p = r.at(5.0);
        let d = model.differential(&s, &r);
        let exact = (d.rx_o + d.rx_d * (5.0 / d.rx_d.z)) - p;
        let (dx, _) = model.approximate_footprint(p, Normal3::new(0.0, 0.0, -1.0), 0.0);
        // The least footprint is smaller than the one at the centre by at most the ratio of directions over the film.
        assert!(dx.length() <= exact.length() * 1.01 && dx.length() > exact.length() * 0.3, "{dx:?} {exact:?}");
    }
}
