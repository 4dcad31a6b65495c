//! Pictures as arrays.

use std::path::PathBuf;

use numpy::{IntoPyArray, PyArray1, PyArray3, PyArrayMethods, PyReadonlyArray3, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use steradian::embed::Picture;
use steradian_image::agreement::{Estimate, Settings, agreement};
use steradian_image::{
    Attribute, Exposure, FlipSettings, Format, Operator, Precision, ToneMap, WriteOptions, encode, flip_hdr, metrics,
    write_bytes_atomically,
};

use crate::trouble::text;

/// A picture: named channels of 32-bit floats, and what it says about itself.
#[pyclass(name = "Image", module = "steradian._steradian", frozen)]
pub(crate) struct Image {
    image: steradian_image::Image,
    outcome: Option<&'static str>,
    bad_samples: u64,
}

impl Image {
    /// A render that has come to an end.
    pub fn finished(picture: Picture) -> Self {
        Self { image: picture.image, outcome: Some(picture.outcome), bad_samples: picture.bad_samples }
    }

    /// The picture itself.
    pub fn inner(&self) -> &steradian_image::Image {
        &self.image
    }

    /// A picture from elsewhere.
    pub fn unfinished(image: steradian_image::Image) -> Self {
        Self { image, outcome: None, bad_samples: 0 }
    }
}

fn tone_map(py: Python<'_>, operator: &str, exposure: Option<f32>) -> PyResult<ToneMap> {
    let Some(operator) = Operator::from_name(operator) else {
        let names: Vec<&str> = Operator::NAMES.iter().map(|(name, _)| *name).collect();
        return Err(text(py, "InputError", &format!("there is no tone map `{operator}`: {}", names.join(", "))));
    };
    let exposure = exposure.map_or(Exposure::Auto(0.0), Exposure::Stops);
    Ok(ToneMap { exposure, operator })
}

fn of_us(py: Python<'_>, e: steradian_image::Error) -> PyErr {
    text(py, "InputError", &e.to_string())
}

/// Channels side by side as an array of height x width x channels.
fn stacked<'py>(
    py: Python<'py>,
    planes: &[&[f32]],
    [height, width]: [usize; 2],
) -> PyResult<Bound<'py, PyArray3<f32>>> {
    let mut values = Vec::with_capacity(height * width * planes.len());
    for i in 0..height * width {
        values.extend(planes.iter().map(|p| p[i]));
    }
    values.into_pyarray(py).reshape([height, width, planes.len()])
}

#[pymethods]
impl Image {
    /// Reads a file.
    #[staticmethod]
    fn read(py: Python<'_>, path: PathBuf) -> PyResult<Image> {
        let name = path.display().to_string();
        let bytes = std::fs::read(&path)?;
        let image = py.detach(|| steradian_image::read(&bytes, &name)).map_err(|e| of_us(py, e))?;
        Ok(Image::unfinished(image))
    }

    /// From an array of height x width x channels with these names.
    #[staticmethod]
    fn from_array(py: Python<'_>, array: PyReadonlyArray3<'_, f32>, names: Vec<String>) -> PyResult<Image> {
        let [height, width, channels] = [array.shape()[0], array.shape()[1], array.shape()[2]];
        if channels != names.len() {
            return Err(text(py, "InputError", "there must be as many names as channels"));
        }
        let view = array.as_array();
        let mut image = steradian_image::Image::new(width, height);
        for (c, name) in names.iter().enumerate() {
            let plane = view.slice(numpy::ndarray::s![.., .., c]).iter().copied().collect();
            image.add(name, plane, Precision::Float).map_err(|e| of_us(py, e))?;
        }
        Ok(Image::unfinished(image))
    }

    /// Width and height in pixels.
    #[getter]
    fn size(&self) -> (usize, usize) {
        (self.image.width(), self.image.height())
    }

    /// Names of all channels.
    #[getter]
    fn channels(&self) -> Vec<String> {
        self.image.channels().iter().map(|c| c.name.clone()).collect()
    }

    /// Why rendering ended, if this was rendered here.
    #[getter]
    fn outcome(&self) -> Option<&'static str> {
        self.outcome
    }

    /// How many samples went wrong and counted as black.
    #[getter]
    fn bad_samples(&self) -> u64 {
        self.bad_samples
    }

    /// What the picture says about itself.
    #[getter]
    fn metadata<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let d = PyDict::new(py);
        for (name, value) in &self.image.metadata.attributes {
            match value {
                Attribute::Text(v) => d.set_item(name, v)?,
                Attribute::Int(v) => d.set_item(name, v)?,
                Attribute::Float(v) => d.set_item(name, v)?,
                Attribute::Double(v) => d.set_item(name, v)?,
                Attribute::V2f(v) => d.set_item(name, v)?,
                Attribute::V3f(v) => d.set_item(name, v)?,
                Attribute::V2i(v) => d.set_item(name, v)?,
                other => d.set_item(name, format!("{other:?}"))?,
            }
        }
        Ok(d)
    }

    /// The named channels as an array of height x width x channels.
    fn stack<'py>(&self, py: Python<'py>, names: Vec<String>) -> PyResult<Bound<'py, PyArray3<f32>>> {
        let planes = names.iter().map(|name| {
            self.image.channel(name).ok_or_else(|| text(py, "InputError", &format!("there is no channel `{name}`")))
        });
        stacked(py, &planes.collect::<PyResult<Vec<_>>>()?, [self.image.height(), self.image.width()])
    }

    /// The bytes of a file in the format that the name tells.
    #[pyo3(signature = (name, tonemap="agx", exposure=None, auto=false))]
    fn encode<'py>(
        &self,
        py: Python<'py>,
        name: &str,
        tonemap: &str,
        exposure: Option<f32>,
        auto: bool,
    ) -> PyResult<Bound<'py, PyBytes>> {
        let format = Format::from_name(name).ok_or_else(|| {
            text(py, "InputError", &format!("{name}: the extension must say what kind of file to write"))
        })?;
        let stops = if auto { None } else { Some(exposure.unwrap_or(0.0)) };
        let options = WriteOptions { tone_map: Some(tone_map(py, tonemap, stops)?), ..WriteOptions::default() };
        let bytes = py.detach(|| encode(&self.image, format, name, &options)).map_err(|e| of_us(py, e))?;
        Ok(PyBytes::new(py, &bytes))
    }

    /// Writes a file, whole or not at all.
    #[pyo3(signature = (path, tonemap="agx", exposure=None, auto=false))]
    fn write(&self, py: Python<'_>, path: PathBuf, tonemap: &str, exposure: Option<f32>, auto: bool) -> PyResult<()> {
        let bytes = self.encode(py, &path.to_string_lossy(), tonemap, exposure, auto)?;
        write_bytes_atomically(&path, bytes.as_bytes()).map_err(|e| text(py, "MachineError", &e.to_string()))
    }
}

/// Light as it is to what a screen shows, both linear, height x width x 3; `exposure` None finds it.
#[pyfunction]
fn tonemap<'py>(
    py: Python<'py>,
    light: PyReadonlyArray3<'py, f32>,
    operator: &str,
    exposure: Option<f32>,
) -> PyResult<Bound<'py, PyArray3<f32>>> {
    let [height, width, channels] = [light.shape()[0], light.shape()[1], light.shape()[2]];
    if channels != 3 {
        return Err(text(py, "InputError", "a picture to tone map has three channels"));
    }
    let view = light.as_array();
    let planes = [0, 1, 2].map(|c| view.slice(numpy::ndarray::s![.., .., c]).iter().copied().collect::<Vec<f32>>());
    let map = tone_map(py, operator, exposure)?.prepared([&planes[0], &planes[1], &planes[2]]);
    let pixels = (0..width * height).flat_map(|i| map.apply([planes[0][i], planes[1][i], planes[2][i]]));
    PyArray1::from_vec(py, pixels.collect()).reshape([height, width, 3])
}

/// Metrics between two pictures, and the verdict whether they show the same.
#[pyfunction]
fn compare<'py>(py: Python<'py>, test: &Image, reference: &Image) -> PyResult<Bound<'py, PyDict>> {
    let (a, b) = (&test.image, &reference.image);
    let found = py.detach(|| {
        let m = metrics(a, b)?;
        let flip = flip_hdr(b, a, &FlipSettings::default())?;
        let verdict = agreement(&Estimate::from_image(b)?, &Estimate::from_image(a)?, &Settings::default());
        let flip = flip.iter().map(|&v| f64::from(v)).sum::<f64>() / flip.len().max(1) as f64;
        Ok((m, flip, verdict))
    });
    let (m, flip, verdict) = found.map_err(|e| of_us(py, e))?;
    let d = PyDict::new(py);
    d.set_item("agree", verdict.agree)?;
    d.set_item("mse", m.mse)?;
    d.set_item("rel_mse", m.rel_mse)?;
    d.set_item("mae", m.mae)?;
    d.set_item("psnr", m.psnr)?;
    d.set_item("flip", flip)?;
    d.set_item("bias", m.bias)?;
    d.set_item("max_error", m.max_error)?;
    Ok(d)
}

/// Registers the class and functions.
pub(crate) fn register(m: &Bound<'_, PyModule>) -> PyResult<()> {
    m.add_class::<Image>()?;
    m.add_function(wrap_pyfunction!(tonemap, m)?)?;
    m.add_function(wrap_pyfunction!(compare, m)?)
}
