//! Functions over the unit square with the integral one, to measure samplers by.

use steradian_math::{cos, exp, sin};

/// A function over the unit square.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum TestFunction {
    /// Two on the left half.
    #[default]
    Step,
    /// Two below the diagonal.
    Diagonal,
    /// One value on a disk.
    Disk,
    /// Two on every other of ten by ten squares.
    Checkerboard,
    /// The same, turned by an eighth of a circle.
    RotatedCheckerboard,
    /// A normal distribution around the middle, of deviation a quarter.
    Gaussian,
}

impl TestFunction {
    /// Each with its name.
    pub const ALL: [(&'static str, Self); 6] = [
        ("step", Self::Step),
        ("diagonal", Self::Diagonal),
        ("disk", Self::Disk),
        ("checkerboard", Self::Checkerboard),
        ("rotatedcheckerboard", Self::RotatedCheckerboard),
        ("gaussian", Self::Gaussian),
    ];

    /// Its name.
    pub fn name(self) -> &'static str {
        Self::ALL.iter().find(|(_, f)| *f == self).map_or("", |(name, _)| name)
    }

    /// Its value at a point.
    pub fn value(self, [x, y]: [f32; 2]) -> f32 {
        let (dx, dy) = (x - 0.5, y - 0.5);
        match self {
            Self::Step => two_if(x < 0.5),
            Self::Diagonal => two_if(x + y < 1.0),
            Self::Disk => two_if(dx * dx + dy * dy < 0.25) * (2.0 / std::f32::consts::PI),
            Self::Checkerboard => checkerboard(x, y),
            Self::RotatedCheckerboard => {
                /// The integral before division, as pbrt has it.
                const INTEGRAL: f32 = 1.000_068_7;
                let (s, c) = (sin(std::f32::consts::FRAC_PI_4), cos(std::f32::consts::FRAC_PI_4));
                // So far away that no square is cut at zero.
                checkerboard(10.0 + x * c - y * s, 10.0 + x * s + y * c) / INTEGRAL
            }
            Self::Gaussian => {
                const SIGMA: f32 = 0.25;
                /// The integral over the square of the distribution, which is that over two deviations each way, squared.
                const INSIDE: f32 = 0.954_499_74 * 0.954_499_74;
                let scale = std::f32::consts::TAU * SIGMA * SIGMA * INSIDE;
                exp(-0.5 * (dx * dx + dy * dy) / (SIGMA * SIGMA)) / scale
            }
        }
    }
}

fn two_if(is_inside: bool) -> f32 {
    if is_inside { 2.0 } else { 0.0 }
}

fn checkerboard(x: f32, y: f32) -> f32 {
    two_if(((x * 10.0) as i32 ^ (y * 10.0) as i32) & 1 == 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_integrals_are_one() {
        const N: usize = 1000;
        for (name, f) in TestFunction::ALL {
            let at = |i: usize| (i as f32 + 0.5) / N as f32;
            let sum: f64 = (0..N * N).map(|i| f64::from(f.value([at(i % N), at(i / N)]))).sum();
            // Edges cut the cells of the grid.
            assert!((sum / (N * N) as f64 - 1.0).abs() < 1.5e-3, "{name}: {}", sum / (N * N) as f64);
            assert_eq!(f.name(), name);
        }
    }
}
