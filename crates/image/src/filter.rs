//! Reconstruction filters: how the samples near a pixel are weighed, and how to place samples so that they need no weighing.
//!
//! Ernst, Stamminger, Greiner 2006, "Filter importance sampling"; Pharr, Jakob, Humphreys (4th edition), section 8.8. All five filters are
//! products of one function of x and one of y, so each axis has a table of its own.

use steradian_math::{ONE_MINUS_EPSILON, Point2, Vec2, exp};

use crate::{Error, resample::windowed_sinc};

/// Which filter, with its shape.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FilterKind {
    /// Every sample within the radius counts the same.
    Box,
    /// Falls linearly to the radius.
    Triangle,
    /// A Gaussian of this standard deviation, moved down so that it reaches zero at the radius.
    Gaussian {
        /// Standard deviation in pixels.
        sigma: f32,
    },
    /// Mitchell and Netravali 1988; `b + 2 c = 1` is best. Negative lobes.
    Mitchell {
        /// Blurring.
        b: f32,
        /// Ringing.
        c: f32,
    },
    /// A sinc under a sinc window (Lanczos). Negative lobes.
    Sinc {
        /// Half-width of the window, in pixels: how many lobes are kept.
        tau: f32,
    },
}

/// A sample's place and weight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FilterSample {
    /// Offset from the pixel's centre, in pixels.
    pub offset: Vec2,
    /// What the sample counts: filter value over density, and over the filter's integral, so that its expectation is 1. Negative in
    /// negative lobes.
    pub weight: f32,
}

/// A filter ready for evaluation and sampling. The offset is from the centre of the pixel.
#[derive(Clone, Debug)]
pub struct Filter {
    kind: FilterKind,
    radius: Vec2,
    /// One table per axis, for the kinds that have no closed form to sample by.
    tables: Option<Box<[AxisTable; 2]>>,
    integral: f32,
}

/// Cells per pixel of radius (twice as many over the whole axis). The weight varies within a cell by its share of the slope, and
/// 64 keeps that to a few per cent, so that it adds no visible noise.
const CELLS_PER_PIXEL: f32 = 64.0;
/// A scene may ask for any radius; beyond this the cells get wider instead of more.
const MAX_CELLS: usize = 8192;

/// Piecewise constant density over `[-radius, radius]`, proportional to each cell's share of the absolute filter.
#[derive(Clone, Debug)]
struct AxisTable {
    radius: f32,
    /// Cumulative probability at the cells' left ends; one more entry, 1, at the end.
    cdf: Vec<f32>,
    /// Signed integral of the filter along this axis.
    integral: f64,
}

impl Filter {
    /// A filter that reaches `radius.x`, `radius.y` pixels from the centre.
    ///
    /// # Errors
    /// `Error::Shape` if a radius or parameter is not a finite number that makes sense, or if the filter integrates to (almost) nothing.
    pub fn new(kind: FilterKind, radius: Vec2) -> Result<Filter, Error> {
        let positive = |v: f32| v.is_finite() && v > 0.0;
        let (shape_is_good, is_tabulated) = match kind {
            FilterKind::Box | FilterKind::Triangle => (true, false),
            FilterKind::Gaussian { sigma } => (positive(sigma), true),
            FilterKind::Mitchell { b, c } => (b.is_finite() && c.is_finite(), true),
            FilterKind::Sinc { tau } => (positive(tau), true),
        };
        if !(shape_is_good && positive(radius.x) && positive(radius.y)) {
            return Err(Error::shape(format!("{kind:?} with radius {} x {} is not a filter", radius.x, radius.y)));
        }
        let mut filter = Filter { kind, radius, tables: None, integral: 1.0 };
        let closed_form = match kind {
            FilterKind::Box => Some(4.0 * radius.x * radius.y),
            FilterKind::Triangle => Some(radius.x * radius.x * radius.y * radius.y),
            // The Mitchell polynomial integrates to 1 over [-2, 2] for every b and c, and is stretched to the radius.
            FilterKind::Mitchell { .. } => Some(radius.x * radius.y * 0.25),
            FilterKind::Gaussian { .. } | FilterKind::Sinc { .. } => None,
        };
        if is_tabulated {
            let tables = [AxisTable::new(&filter, radius.x)?, AxisTable::new(&filter, radius.y)?];
            filter.integral = closed_form.unwrap_or((tables[0].integral * tables[1].integral) as f32);
            filter.tables = Some(Box::new(tables));
        } else {
            filter.integral = closed_form.unwrap_or(1.0);
        }
        if !(filter.integral.is_finite() && filter.integral.abs() > f32::MIN_POSITIVE) {
            return Err(Error::shape(format!(
                "{kind:?} with radius {} x {} integrates to nothing",
                radius.x, radius.y
            )));
        }
        Ok(filter)
    }

    /// Half a pixel of box: every sample counts in exactly one pixel.
    pub fn pixel_box() -> Filter {
        Filter { kind: FilterKind::Box, radius: Vec2::new(0.5, 0.5), tables: None, integral: 1.0 }
    }

    /// Which filter.
    pub fn kind(&self) -> FilterKind {
        self.kind
    }

    /// How far it reaches.
    pub fn radius(&self) -> Vec2 {
        self.radius
    }

    /// Value at an offset from the centre, not normalised; zero outside the radius.
    pub fn eval(&self, p: Point2) -> f32 {
        self.axis(p.x, self.radius.x) * self.axis(p.y, self.radius.y)
    }

    /// Integral over the plane.
    pub fn integral(&self) -> f32 {
        self.integral
    }

    /// Density with which `sample` picks an offset, per square pixel.
    pub fn pdf(&self, p: Point2) -> f32 {
        if p.x.abs() > self.radius.x || p.y.abs() > self.radius.y {
            return 0.0;
        }
        match &self.tables {
            Some(t) => t[0].pdf(p.x) * t[1].pdf(p.y),
            None => self.eval(p) / self.integral,
        }
    }

    /// An offset with density `pdf`, from two random numbers in `[0,1)`, and its weight.
    pub fn sample(&self, u: Point2) -> FilterSample {
        let Some(tables) = &self.tables else {
            let place =
                |u, radius| if self.kind == FilterKind::Box { radius * (2.0 * u - 1.0) } else { tent(u, radius) };
            return FilterSample {
                offset: Vec2::new(place(u.x, self.radius.x), place(u.y, self.radius.y)),
                weight: 1.0,
            };
        };
        let ((x, pdf_x), (y, pdf_y)) = (tables[0].sample(u.x), tables[1].sample(u.y));
        let pdf = pdf_x * pdf_y;
        // A cell is only picked if its density is positive; rounding at u close to 1 is the one way to land elsewhere.
        let weight = if pdf > 0.0 { self.eval(Point2::new(x, y)) / (pdf * self.integral) } else { 0.0 };
        FilterSample { offset: Vec2::new(x, y), weight }
    }

    /// The factor of one axis.
    fn axis(&self, x: f32, radius: f32) -> f32 {
        if x.abs() > radius {
            return 0.0;
        }
        match self.kind {
            FilterKind::Box => 1.0,
            FilterKind::Triangle => radius - x.abs(),
            FilterKind::Gaussian { sigma } => (gaussian(x, sigma) - gaussian(radius, sigma)).max(0.0),
            FilterKind::Mitchell { b, c } => mitchell(2.0 * x / radius, b, c),
            FilterKind::Sinc { tau } => windowed_sinc(x, radius, tau),
        }
    }
}

impl AxisTable {
    fn new(filter: &Filter, radius: f32) -> Result<AxisTable, Error> {
        let n = ((2.0 * radius * CELLS_PER_PIXEL).ceil() as usize).clamp(16, MAX_CELLS);
        let width = 2.0 * f64::from(radius) / n as f64;
        let (mut total, mut integral) = (0.0_f64, 0.0_f64);
        let mut sums = Vec::with_capacity(n + 1);
        for i in 0..n {
            sums.push(total);
            let at = |t: f64| {
                let x = width * (i as f64 + t) - f64::from(radius);
                f64::from(filter.axis((x as f32).clamp(-radius, radius), radius))
            };
            // Simpson's rule over quarters, on the filter and on its absolute value.
            let f = [at(0.0), at(0.25), at(0.5), at(0.75), at(1.0)];
            let simpson =
                |g: fn(f64) -> f64| (g(f[0]) + 4.0 * g(f[1]) + 2.0 * g(f[2]) + 4.0 * g(f[3]) + g(f[4])) / 12.0;
            integral += width * simpson(|v| v);
            total += width * simpson(f64::abs);
        }
        if !(total.is_finite() && total > 1e-30) {
            return Err(Error::shape(format!("{:?} with radius {radius} is zero everywhere", filter.kind)));
        }
        let mut cdf: Vec<f32> = sums.into_iter().map(|s| (s / total) as f32).collect();
        cdf.push(1.0);
        Ok(AxisTable { radius, cdf, integral })
    }

    fn cells(&self) -> usize {
        self.cdf.len() - 1
    }

    /// Density of cell `i` per pixel.
    fn density(&self, i: usize) -> f32 {
        (self.cdf[i + 1] - self.cdf[i]) * self.cells() as f32 / (2.0 * self.radius)
    }

    fn pdf(&self, x: f32) -> f32 {
        let i = ((x + self.radius) / (2.0 * self.radius) * self.cells() as f32) as usize;
        self.density(i.min(self.cells() - 1))
    }

    fn sample(&self, u: f32) -> (f32, f32) {
        let u = u.clamp(0.0, ONE_MINUS_EPSILON);
        let i = self.cdf.partition_point(|&c| c <= u).clamp(1, self.cells()) - 1;
        let (low, high) = (self.cdf[i], self.cdf[i + 1]);
        let within = if high > low { ((u - low) / (high - low)).min(ONE_MINUS_EPSILON) } else { 0.5 };
        let x = (i as f32 + within) / self.cells() as f32 * 2.0 * self.radius - self.radius;
        (x.clamp(-self.radius, self.radius), self.density(i))
    }
}

/// The density of the normal distribution of mean zero.
fn gaussian(x: f32, sigma: f32) -> f32 {
    /// 1 / sqrt(2 pi)
    const NORM: f32 = 0.398_942_28;
    NORM / sigma * exp(-x * x / (2.0 * sigma * sigma))
}

/// Mitchell and Netravali's piecewise cubic, non-zero on `[-2, 2]`.
fn mitchell(x: f32, b: f32, c: f32) -> f32 {
    let x = x.abs();
    let cubic = if x <= 1.0 {
        ((12.0 - 9.0 * b - 6.0 * c) * x + (-18.0 + 12.0 * b + 6.0 * c)) * x * x + (6.0 - 2.0 * b)
    } else if x <= 2.0 {
        (((-b - 6.0 * c) * x + (6.0 * b + 30.0 * c)) * x + (-12.0 * b - 48.0 * c)) * x + (8.0 * b + 24.0 * c)
    } else {
        0.0
    };
    cubic * (1.0 / 6.0)
}

/// Inverse of the cumulative distribution of `(radius - |x|) / radius^2`.
fn tent(u: f32, radius: f32) -> f32 {
    if u < 0.5 { radius * ((2.0 * u).sqrt() - 1.0) } else { radius * (1.0 - (2.0 * (1.0 - u)).sqrt()) }
}
