//! Linear algebra of three-component colour: matrices, chromaticities, white balance.

/// A 3 by 3 matrix, row by row, that maps colour triples: XYZ to RGB and the like.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Matrix3(pub [[f32; 3]; 3]);

impl Default for Matrix3 {
    fn default() -> Matrix3 {
        Matrix3::IDENTITY
    }
}

impl Matrix3 {
    /// Maps each triple to itself.
    pub const IDENTITY: Matrix3 = Matrix3([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);

    /// The matrix times the column `v`.
    #[inline]
    pub fn apply(&self, v: [f32; 3]) -> [f32; 3] {
        self.0.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2])
    }

    /// The map that applies `self` first and `next` after it: the product `next * self`.
    pub fn then(&self, next: &Matrix3) -> Matrix3 {
        narrow(multiply(widen(next), widen(self)))
    }

    /// The inverse, or `None` when there is none.
    pub fn inverse(&self) -> Option<Matrix3> {
        let inverse = narrow(invert(widen(self)));
        inverse.0.as_flattened().iter().all(|v| v.is_finite()).then_some(inverse)
    }

    /// The transpose.
    pub fn transpose(&self) -> Matrix3 {
        Matrix3([0, 1, 2].map(|r| [0, 1, 2].map(|c| self.0[c][r])))
    }
}

/// In double precision.
pub(crate) const fn widen(m: &Matrix3) -> [[f64; 3]; 3] {
    let mut wide = [[0.0; 3]; 3];
    let mut k = 0;
    while k < 9 {
        wide[k / 3][k % 3] = m.0[k / 3][k % 3] as f64;
        k += 1;
    }
    wide
}

/// In single precision.
pub(crate) const fn narrow(m: [[f64; 3]; 3]) -> Matrix3 {
    let mut narrow = [[0.0; 3]; 3];
    let mut k = 0;
    while k < 9 {
        narrow[k / 3][k % 3] = m[k / 3][k % 3] as f32;
        k += 1;
    }
    Matrix3(narrow)
}

/// The product `a b`.
pub(crate) const fn multiply(a: [[f64; 3]; 3], b: [[f64; 3]; 3]) -> [[f64; 3]; 3] {
    let mut product = [[0.0; 3]; 3];
    let mut k = 0;
    while k < 9 {
        let (r, c) = (k / 3, k % 3);
        product[r][c] = a[r][0] * b[0][c] + a[r][1] * b[1][c] + a[r][2] * b[2][c];
        k += 1;
    }
    product
}

/// The inverse by cofactors; not finite when the matrix is singular.
pub(crate) const fn invert(m: [[f64; 3]; 3]) -> [[f64; 3]; 3] {
    let mut cofactor = [[0.0; 3]; 3];
    let mut k = 0;
    while k < 9 {
        let (r, c) = (k / 3, k % 3);
        let (r1, r2, c1, c2) = ((r + 1) % 3, (r + 2) % 3, (c + 1) % 3, (c + 2) % 3);
        cofactor[r][c] = m[r1][c1] * m[r2][c2] - m[r1][c2] * m[r2][c1];
        k += 1;
    }
    let det = m[0][0] * cofactor[0][0] + m[0][1] * cofactor[0][1] + m[0][2] * cofactor[0][2];
    let mut inverse = [[0.0; 3]; 3];
    let mut k = 0;
    while k < 9 {
        inverse[k / 3][k % 3] = cofactor[k % 3][k / 3] / det;
        k += 1;
    }
    inverse
}

/// The matrix times a column.
pub(crate) const fn apply(m: [[f64; 3]; 3], v: [f64; 3]) -> [f64; 3] {
    let mut out = [0.0; 3];
    let mut r = 0;
    while r < 3 {
        out[r] = m[r][0] * v[0] + m[r][1] * v[1] + m[r][2] * v[2];
        r += 1;
    }
    out
}

/// XYZ of the chromaticity `xy` with luminance `luminance`; black when `y` is 0.
pub fn xyz_from_xyy(xy: [f32; 2], luminance: f32) -> [f32; 3] {
    let [x, y] = xy;
    if y == 0.0 {
        return [0.0; 3];
    }
    [x * luminance / y, luminance, (1.0 - x - y) * luminance / y]
}

/// The chromaticity `x, y` of an XYZ triple; zeros for black.
pub fn xy_from_xyz(xyz: [f32; 3]) -> [f32; 2] {
    let sum = xyz[0] + xyz[1] + xyz[2];
    if sum == 0.0 { [0.0; 2] } else { [xyz[0] / sum, xyz[1] / sum] }
}

/// Correlated colour temperature in kelvin of a chromaticity near the black body locus (McCamy 1992; within 2 K from 2856 K to 6500 K).
pub fn correlated_temperature(xy: [f32; 2]) -> f32 {
    let n = (xy[0] - 0.3320) / (0.1858 - xy[1]);
    ((449.0 * n + 3525.0) * n + 6823.3) * n + 5520.33
}

/// Linear sRGB luminance weights: the Y row of the Rec.709 matrix with its D65 white.
pub fn luminance(rgb: [f32; 3]) -> f32 {
    0.212639 * rgb[0] + 0.715169 * rgb[1] + 0.072192 * rgb[2]
}

/// Cone responses of the Bradford transform (Lam 1985), as in ICC.1.
const BRADFORD: [[f64; 3]; 3] = [[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]];

/// The von Kries adaptation in Bradford's cone space that maps XYZ seen under a white of chromaticity `source` to XYZ under `target`.
pub fn white_balance(source: [f32; 2], target: [f32; 2]) -> Matrix3 {
    let wide = |xy: [f32; 2]| xyz_from_xyy(xy, 1.0).map(f64::from);
    narrow(white_balance_f64(wide(source), wide(target)))
}

/// [`white_balance`] for whites given as XYZ of equal luminance.
pub(crate) const fn white_balance_f64(source: [f64; 3], target: [f64; 3]) -> [[f64; 3]; 3] {
    let (from, to) = (apply(BRADFORD, source), apply(BRADFORD, target));
    let mut scaled = BRADFORD;
    let mut k = 0;
    while k < 9 {
        scaled[k / 3][k % 3] *= to[k / 3] / from[k / 3];
        k += 1;
    }
    multiply(invert(BRADFORD), scaled)
}
