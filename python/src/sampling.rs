//! The sampling toolbox over arrays: sequences, samplers, warps with their densities and inverses, distributions.

use numpy::{
    IntoPyArray, PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2, PyUntypedArrayMethods,
};
use pyo3::prelude::*;
use steradian_sampling::sampler::{Randomization, Sampler, SamplerKind, SamplerSettings};
use steradian_sampling::{Piecewise1D, Piecewise2D, sequence, statistics, warp};

use crate::trouble::text;

type Points<'py> = Bound<'py, PyArray2<f32>>;
type Numbers<'py> = Bound<'py, PyArray1<f32>>;

fn rows<'py, const N: usize>(py: Python<'py>, points: impl Iterator<Item = [f32; N]>) -> PyResult<Points<'py>> {
    let flat: Vec<f32> = points.flatten().collect();
    let n = flat.len() / N;
    flat.into_pyarray(py).reshape([n, N])
}

/// The rows of an array of N columns.
fn points<const N: usize>(array: &PyReadonlyArray2<'_, f32>) -> PyResult<Vec<[f32; N]>> {
    if array.shape()[1] != N {
        return Err(text(array.py(), "InputError", &format!("there must be {N} columns, not {}", array.shape()[1])));
    }
    let view = array.as_array();
    Ok(view.rows().into_iter().map(|row| std::array::from_fn(|i| row[i])).collect())
}

fn randomization(py: Python<'_>, name: &str) -> PyResult<Randomization> {
    match name {
        "none" => Ok(Randomization::None),
        "permutedigits" => Ok(Randomization::PermuteDigits),
        "fastowen" => Ok(Randomization::FastOwen),
        "owen" => Ok(Randomization::Owen),
        _ => Err(text(
            py,
            "InputError",
            &format!("there is no randomization `{name}`: none, permutedigits, fastowen, owen"),
        )),
    }
}

/// Samples of one pixel, `count` x `dimensions`, of a sampler by its name on the command line.
#[pyfunction]
#[pyo3(signature = (sampler, count, dimensions, seed=0, randomize="fastowen", pixel=(0, 0), resolution=(1, 1)))]
fn sampler_points<'py>(
    py: Python<'py>,
    sampler: &str,
    count: u32,
    dimensions: u32,
    seed: u64,
    randomize: &str,
    pixel: (u32, u32),
    resolution: (u32, u32),
) -> PyResult<Points<'py>> {
    let kind = match sampler {
        "independent" => SamplerKind::Independent,
        "stratified" => SamplerKind::Stratified,
        "halton" => SamplerKind::Halton,
        "sobol" => SamplerKind::Sobol,
        "paddedsobol" => SamplerKind::PaddedSobol,
        "zsobol" => SamplerKind::ZSobol,
        "pmj02bn" => SamplerKind::Pmj02bn,
        _ => {
            return Err(text(
                py,
                "InputError",
                &format!(
                    "there is no sampler `{sampler}`: independent, stratified, halton, sobol, paddedsobol, zsobol, pmj02bn"
                ),
            ));
        }
    };
    let settings = SamplerSettings {
        kind,
        seed,
        spp: count.max(1),
        randomization: randomization(py, randomize)?,
        resolution: resolution.into(),
        ..SamplerSettings::default()
    };
    let mut source = Sampler::new(&settings);
    let mut flat = Vec::with_capacity(count as usize * dimensions as usize);
    for index in 0..count {
        source.start(pixel.into(), index, 0);
        let mut left = dimensions;
        while left > 0 {
            if left == 1 {
                flat.push(source.next_1d());
                left = 0;
            } else {
                flat.extend(if left == dimensions { source.pixel_2d() } else { source.next_2d() });
                left -= 2;
            }
        }
    }
    flat.into_pyarray(py).reshape([count as usize, dimensions as usize])
}

/// The first points of Sobol's sequence, `count` x `dimensions`, unscrambled.
#[pyfunction]
fn sobol<'py>(py: Python<'py>, count: u32, dimensions: usize) -> PyResult<Points<'py>> {
    const MOST: usize = 1024;
    if dimensions > MOST {
        return Err(text(py, "InputError", "Sobol's sequence has 1024 dimensions here"));
    }
    let value = |i: u32, d: usize| {
        // 24 bits are what a number below one has.
        (sequence::sobol_bits(u64::from(i), d) >> 8) as f32 / (1u32 << 24) as f32
    };
    let flat: Vec<f32> = (0..count).flat_map(|i| (0..dimensions).map(move |d| value(i, d))).collect();
    flat.into_pyarray(py).reshape([count as usize, dimensions])
}

/// The first points of Halton's sequence, `count` x `dimensions`.
#[pyfunction]
fn halton<'py>(py: Python<'py>, count: u32, dimensions: usize) -> PyResult<Points<'py>> {
    const MOST: usize = 1000;
    if dimensions > MOST {
        return Err(text(py, "InputError", "Halton's sequence has 1000 dimensions here"));
    }
    let flat: Vec<f32> =
        (0..count).flat_map(|i| (0..dimensions).map(move |d| sequence::halton(u64::from(i), d))).collect();
    flat.into_pyarray(py).reshape([count as usize, dimensions])
}

/// The star discrepancy of points in the unit square.
#[pyfunction]
fn star_discrepancy(array: PyReadonlyArray2<'_, f32>) -> PyResult<f64> {
    Ok(statistics::star_discrepancy(&points::<2>(&array)?))
}

/// A warp from the square to directions: the map, its density per solid angle, and its inverse.
macro_rules! direction_warp {
    ($($name:ident $pdf:ident $inverse:ident),* $(,)?) => {
        $(
            /// Points of the unit square to unit directions, N x 2 to N x 3.
            #[pyfunction]
            fn $name<'py>(py: Python<'py>, u: PyReadonlyArray2<'py, f32>) -> PyResult<Points<'py>> {
                let u = points::<2>(&u)?;
                rows(py, u.into_iter().map(|u| {
                    let w = warp::$name(u);
                    [w.x, w.y, w.z]
                }))
            }

            /// The density of directions per solid angle, N x 3 to N.
            #[pyfunction]
            fn $pdf<'py>(py: Python<'py>, w: PyReadonlyArray2<'py, f32>) -> PyResult<Numbers<'py>> {
                let w = points::<3>(&w)?;
                let pdf = w.into_iter().map(|[x, y, z]| warp::$pdf(steradian_math::Vec3::new(x, y, z)));
                Ok(PyArray1::from_iter(py, pdf))
            }

            /// Directions back to the unit square, N x 3 to N x 2.
            #[pyfunction]
            fn $inverse<'py>(py: Python<'py>, w: PyReadonlyArray2<'py, f32>) -> PyResult<Points<'py>> {
                let w = points::<3>(&w)?;
                rows(py, w.into_iter().map(|[x, y, z]| warp::$inverse(steradian_math::Vec3::new(x, y, z))))
            }
        )*

        fn register_directions(m: &Bound<'_, PyModule>) -> PyResult<()> {
            $(
                m.add_function(wrap_pyfunction!($name, m)?)?;
                m.add_function(wrap_pyfunction!($pdf, m)?)?;
                m.add_function(wrap_pyfunction!($inverse, m)?)?;
            )*
            Ok(())
        }
    };
}

direction_warp!(
    square_to_uniform_sphere square_to_uniform_sphere_pdf uniform_sphere_to_square,
    square_to_uniform_hemisphere square_to_uniform_hemisphere_pdf uniform_hemisphere_to_square,
    square_to_cosine_hemisphere square_to_cosine_hemisphere_pdf cosine_hemisphere_to_square,
);

/// Points of the unit square to the unit disk, N x 2 to N x 2, by Shirley and Chiu's concentric map.
#[pyfunction]
fn square_to_uniform_disk<'py>(py: Python<'py>, u: PyReadonlyArray2<'py, f32>) -> PyResult<Points<'py>> {
    rows(py, points::<2>(&u)?.into_iter().map(warp::square_to_uniform_disk_concentric))
}

/// And back.
#[pyfunction]
fn uniform_disk_to_square<'py>(py: Python<'py>, p: PyReadonlyArray2<'py, f32>) -> PyResult<Points<'py>> {
    rows(py, points::<2>(&p)?.into_iter().map(warp::uniform_disk_concentric_to_square))
}

/// The density of points of the disk per area, N x 2 to N.
#[pyfunction]
fn square_to_uniform_disk_pdf<'py>(py: Python<'py>, p: PyReadonlyArray2<'py, f32>) -> PyResult<Numbers<'py>> {
    Ok(PyArray1::from_iter(py, points::<2>(&p)?.into_iter().map(warp::square_to_uniform_disk_pdf)))
}

/// Points of the unit square to barycentric coordinates, N x 2 to N x 3.
#[pyfunction]
fn square_to_uniform_triangle<'py>(py: Python<'py>, u: PyReadonlyArray2<'py, f32>) -> PyResult<Points<'py>> {
    rows(py, points::<2>(&u)?.into_iter().map(warp::square_to_uniform_triangle))
}

/// And back.
#[pyfunction]
fn uniform_triangle_to_square<'py>(py: Python<'py>, b: PyReadonlyArray2<'py, f32>) -> PyResult<Points<'py>> {
    rows(py, points::<3>(&b)?.into_iter().map(warp::uniform_triangle_to_square))
}

/// A density that is constant in each of n equal steps of an interval.
#[pyclass(name = "Piecewise1D", module = "steradian._steradian", frozen)]
struct PyPiecewise1D(Piecewise1D);

#[pymethods]
impl PyPiecewise1D {
    #[new]
    #[pyo3(signature = (values, low=0.0, high=1.0))]
    fn new(py: Python<'_>, values: PyReadonlyArray1<'_, f32>, low: f32, high: f32) -> PyResult<Self> {
        let values: Vec<f32> = values.as_array().iter().copied().collect();
        Piecewise1D::new(&values, low, high).map(Self).ok_or_else(|| {
            text(
                py,
                "InputError",
                "a distribution needs values, finite and not negative, over an interval with a length",
            )
        })
    }

    /// The integral of the values over the interval.
    #[getter]
    fn integral(&self) -> f32 {
        self.0.integral()
    }

    /// Uniform numbers to points, and their densities.
    fn sample<'py>(&self, py: Python<'py>, u: PyReadonlyArray1<'py, f32>) -> (Numbers<'py>, Numbers<'py>) {
        let samples: Vec<_> = u.as_array().iter().map(|&u| self.0.sample(u)).collect();
        let x = PyArray1::from_iter(py, samples.iter().map(|s| s.x));
        (x, PyArray1::from_iter(py, samples.iter().map(|s| s.pdf)))
    }

    /// The densities of points.
    fn pdf<'py>(&self, py: Python<'py>, x: PyReadonlyArray1<'py, f32>) -> Numbers<'py> {
        PyArray1::from_iter(py, x.as_array().iter().map(|&x| self.0.pdf(x)))
    }
}

/// A density that is constant in each cell of a grid over the unit square; rows from y = 0.
#[pyclass(name = "Piecewise2D", module = "steradian._steradian", frozen)]
struct PyPiecewise2D(Piecewise2D);

#[pymethods]
impl PyPiecewise2D {
    #[new]
    fn new(py: Python<'_>, values: PyReadonlyArray2<'_, f32>) -> PyResult<Self> {
        let [ny, nx] = [values.shape()[0], values.shape()[1]];
        let values: Vec<f32> = values.as_array().iter().copied().collect();
        Piecewise2D::new(values, nx, ny)
            .map(Self)
            .ok_or_else(|| text(py, "InputError", "a distribution needs values, finite and not negative"))
    }

    /// The integral of the values over the unit square.
    #[getter]
    fn integral(&self) -> f32 {
        self.0.integral()
    }

    /// Points of the unit square to points, and their densities.
    fn sample<'py>(&self, py: Python<'py>, u: PyReadonlyArray2<'py, f32>) -> PyResult<(Points<'py>, Numbers<'py>)> {
        let samples: Vec<_> = points::<2>(&u)?.into_iter().map(|u| self.0.sample(u)).collect();
        let p = rows(py, samples.iter().map(|s| s.0))?;
        Ok((p, PyArray1::from_iter(py, samples.iter().map(|s| s.1))))
    }

    /// The densities of points.
    fn pdf<'py>(&self, py: Python<'py>, p: PyReadonlyArray2<'py, f32>) -> PyResult<Numbers<'py>> {
        Ok(PyArray1::from_iter(py, points::<2>(&p)?.into_iter().map(|p| self.0.pdf(p))))
    }
}

/// Registers all of it.
pub(crate) fn register(m: &Bound<'_, PyModule>) -> PyResult<()> {
    m.add_function(wrap_pyfunction!(sampler_points, m)?)?;
    m.add_function(wrap_pyfunction!(sobol, m)?)?;
    m.add_function(wrap_pyfunction!(halton, m)?)?;
    m.add_function(wrap_pyfunction!(star_discrepancy, m)?)?;
    m.add_function(wrap_pyfunction!(square_to_uniform_disk, m)?)?;
    m.add_function(wrap_pyfunction!(square_to_uniform_disk_pdf, m)?)?;
    m.add_function(wrap_pyfunction!(uniform_disk_to_square, m)?)?;
    m.add_function(wrap_pyfunction!(square_to_uniform_triangle, m)?)?;
    m.add_function(wrap_pyfunction!(uniform_triangle_to_square, m)?)?;
    m.add_class::<PyPiecewise1D>()?;
    m.add_class::<PyPiecewise2D>()?;
    register_directions(m)
}
