//! Scenes and renders.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::time::Duration;

use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use steradian::embed::{self, Held, Joined, Joining, Origin, Trouble, Watcher};
use steradian_load::Memory;
use steradian_render::{ENDLESS_SPP, Progress};
use steradian_scene::Value;

use crate::image::Image;
use crate::trouble::{error, report, text};

/// A scene, as it was read and changed since.
#[pyclass(name = "Scene", module = "steradian._steradian")]
pub(crate) struct Scene(Held);

/// What a running render tells.
enum News {
    Progress(Progress),
    Frame(Box<steradian_image::Image>),
}

struct Teller {
    sender: mpsc::Sender<News>,
    frames: bool,
}

impl Watcher for Teller {
    fn progress(&self, progress: &Progress) {
        // Nobody listens any more: the render is being cancelled.
        let _ = self.sender.send(News::Progress(*progress));
    }

    fn pass(&self, picture: &dyn Fn() -> Option<steradian_image::Image>) {
        if self.frames
            && let Some(image) = picture()
        {
            let _ = self.sender.send(News::Frame(Box::new(image)));
        }
    }
}

fn progress_of<'py>(py: Python<'py>, p: &Progress) -> PyResult<Bound<'py, PyDict>> {
    let d = PyDict::new(py);
    d.set_item("fraction", p.fraction)?;
    d.set_item("samples_per_pixel", p.spp[0])?;
    d.set_item("planned_samples_per_pixel", (p.spp[1] != ENDLESS_SPP).then_some(p.spp[1]))?;
    d.set_item("rays", p.rays)?;
    d.set_item("elapsed_seconds", p.elapsed.as_secs_f64())?;
    d.set_item("relative_error", p.error)?;
    d.set_item("error_bound", p.bound.filter(|b| b.is_finite()))?;
    let left = p.elapsed.as_secs_f64() * (1.0 - p.fraction) / p.fraction;
    d.set_item("seconds_left", (p.fraction > 0.0).then_some(left))?;
    Ok(d)
}

/// Runs `work` on a thread of its own and waits for it with Python's signals at work: Ctrl-C cancels.
fn watched<T: Send>(
    py: Python<'_>,
    work: impl FnOnce(&dyn Watcher, &AtomicBool) -> Result<T, Trouble> + Send,
    frames: bool,
    mut hear: impl FnMut(Python<'_>, News) -> PyResult<()> + Send,
) -> PyResult<T> {
    let cancel = AtomicBool::new(false);
    let (sender, news) = mpsc::channel();
    let mut heard: PyResult<()> = Ok(());
    let (cancelled, first) = (&cancel, &mut heard);
    let result = py.detach(move || {
        std::thread::scope(|scope| {
            let teller = Teller { sender, frames };
            let worker = scope.spawn(move || work(&teller, cancelled));
            loop {
                let said = news.recv_timeout(Duration::from_millis(50));
                if matches!(said, Err(RecvTimeoutError::Disconnected)) {
                    break worker.join();
                }
                let now = Python::attach(|py| {
                    py.check_signals()?;
                    said.map_or(Ok(()), |said| hear(py, said))
                });
                if let Err(e) = now
                    && first.is_ok()
                {
                    *first = Err(e);
                    cancelled.store(true, Ordering::Relaxed);
                }
            }
        })
    });
    heard?;
    match result {
        Ok(result) => result.map_err(|t| error(py, t)),
        Err(_) => Err(text(py, "MachineError", "the renderer broke one of its own rules; please report this")),
    }
}

/// A value from Python: a number, three of them, or a matrix of four rows.
fn value_of(v: &Bound<'_, PyAny>) -> PyResult<Value> {
    let plain = v.hasattr("tolist")?.then(|| v.call_method0("tolist")).transpose()?;
    let v = plain.as_ref().unwrap_or(v);
    let whole = v.is_instance_of::<pyo3::types::PyInt>() && !v.is_instance_of::<pyo3::types::PyBool>();
    if whole && let Ok(v) = v.extract::<u64>() {
        return Ok(Value::Integer(v));
    }
    if let Ok(v) = v.extract::<f32>() {
        return Ok(Value::Float(v));
    }
    if let Ok(v) = v.extract::<[f32; 3]>() {
        return Ok(Value::Triple(v));
    }
    if let Ok(v) = v.extract::<[[f32; 4]; 4]>() {
        return Ok(Value::Matrix(v));
    }
    Err(text(v.py(), "InputError", "a parameter is a number, a list of three, or a matrix of four rows of four"))
}

fn value_to(py: Python<'_>, v: &Value) -> PyResult<Py<PyAny>> {
    Ok(match *v {
        Value::Float(v) => v.into_pyobject(py)?.into_any().unbind(),
        Value::Integer(v) => v.into_pyobject(py)?.into_any().unbind(),
        Value::Triple(v) => v.into_pyobject(py)?.into_any().unbind(),
        Value::Matrix(v) => v.into_pyobject(py)?.into_any().unbind(),
    })
}

#[pymethods]
impl Scene {
    /// The scene that is built in.
    #[staticmethod]
    fn showcase(py: Python<'_>) -> PyResult<Scene> {
        open(py, Origin::Showcase, &[])
    }

    /// Reads a file; `options` are words of the command line that say how.
    #[staticmethod]
    fn from_file(py: Python<'_>, path: PathBuf, options: Vec<String>) -> PyResult<Scene> {
        open(py, Origin::File(path), &options)
    }

    /// Reads a pbrt text; files that it names may be given as bytes.
    #[staticmethod]
    fn from_text(py: Python<'_>, name: String, text: String, files: BTreeMap<String, Vec<u8>>) -> PyResult<Scene> {
        let files = files.into_iter().fold(Memory::new(), |m, (name, bytes)| m.with(name, bytes));
        open(py, Origin::Text { name, text, files }, &[])
    }

    /// A scene from the bytes of `pack`.
    #[staticmethod]
    fn unpack(py: Python<'_>, packed: &[u8]) -> PyResult<Scene> {
        py.detach(|| Held::unpack(packed)).map(Scene).map_err(|t| error(py, t))
    }

    /// The scene with all its files and changes, as bytes.
    fn pack<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        let bytes = py.detach(|| self.0.pack()).map_err(|t| error(py, t))?;
        Ok(PyBytes::new(py, &bytes))
    }

    /// How a person would name it.
    #[getter]
    fn name(&self) -> &str {
        &self.0.name
    }

    /// A hash of all files that were read and of all changes.
    #[getter]
    fn hash(&self) -> String {
        self.0.hash()
    }

    /// Width and height of the picture.
    #[getter]
    fn size(&self) -> (u32, u32) {
        self.0.size().into()
    }

    /// What was noticed while reading.
    #[getter]
    fn warnings<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyDict>>> {
        self.0.warnings.iter().map(|r| report(py, r)).collect()
    }

    /// All parameters with their values.
    fn parameters<'py>(&mut self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let d = PyDict::new(py);
        for (name, value) in self.0.parameters() {
            d.set_item(name, value_to(py, &value)?)?;
        }
        Ok(d)
    }

    /// Gives a parameter another value.
    fn set(&mut self, py: Python<'_>, name: &str, value: &Bound<'_, PyAny>) -> PyResult<()> {
        let value = value_of(value)?;
        self.0.set(name, &value).map_err(|t| error(py, t))
    }

    /// A scene of its own with the same content.
    fn copy(&self) -> Scene {
        Scene(self.0.clone())
    }

    /// Renders. `progress` is called with a dictionary now and then, `frame` with the picture at the end of each pass.
    #[pyo3(signature = (words, progress=None, frame=None))]
    fn render(
        &self,
        py: Python<'_>,
        words: Vec<String>,
        progress: Option<Py<PyAny>>,
        frame: Option<Py<PyAny>>,
    ) -> PyResult<Image> {
        let frames = frame.is_some();
        let held = &self.0;
        let hear = |py: Python<'_>, news: News| {
            match (news, &progress, &frame) {
                (News::Progress(p), Some(f), _) => f.call1(py, (progress_of(py, &p)?,))?,
                (News::Frame(image), _, Some(f)) => f.call1(py, (Py::new(py, Image::unfinished(*image))?,))?,
                _ => return Ok(()),
            };
            Ok(())
        };
        let picture = watched(py, |watcher, cancel| held.render(&words, watcher, cancel), frames, hear)?;
        Ok(Image::finished(picture))
    }

    /// Renders the part that `--shard` among the words names; the bytes of a .part file.
    /// Cut by samples instead of tiles if `by_samples`; without what is seen besides light if `light_only`.
    #[pyo3(signature = (words, by_samples=false, light_only=false))]
    fn part<'py>(
        &self,
        py: Python<'py>,
        words: Vec<String>,
        by_samples: bool,
        light_only: bool,
    ) -> PyResult<Bound<'py, PyBytes>> {
        let held = &self.0;
        let how = (by_samples, light_only);
        let bytes = watched(py, |_, cancel| held.part(&words, how, cancel), false, |_, _| Ok(()))?;
        Ok(PyBytes::new(py, &bytes))
    }

    /// What that part sees besides light, by itself.
    fn seen<'py>(&self, py: Python<'py>, words: Vec<String>) -> PyResult<Bound<'py, PyBytes>> {
        let held = &self.0;
        let bytes = watched(py, |_, cancel| held.seen(&words, cancel), false, |_, _| Ok(()))?;
        Ok(PyBytes::new(py, &bytes))
    }

    /// Whether a render with these words looks at the scene again for what is seen besides light.
    fn looks_again(&self, py: Python<'_>, words: Vec<String>) -> PyResult<bool> {
        self.0.looks_again(&words).map_err(|t| error(py, t))
    }
}

fn open(py: Python<'_>, origin: Origin, options: &[String]) -> PyResult<Scene> {
    py.detach(|| Held::open(origin, options)).map(Scene).map_err(|t| error(py, t))
}

/// Joins parts: the picture, the share of samples that is there, and at look number `look` the bound of the error that `rounds` ask for
/// with `--error`, with the wanted one. `rounds` are the words of one render that was continued, `seen` what [`Scene::seen`] saw.
#[pyfunction]
#[pyo3(signature = (parts, partial=false, rounds=None, look=0, seen=Vec::new()))]
fn join_parts(
    py: Python<'_>,
    parts: Vec<Vec<u8>>,
    partial: bool,
    rounds: Option<Vec<String>>,
    look: u32,
    seen: Vec<Vec<u8>>,
) -> PyResult<(Image, f64, Option<[f64; 2]>)> {
    let joined = py.detach(|| {
        let parts: Vec<&[u8]> = parts.iter().map(Vec::as_slice).collect();
        let seen: Vec<&[u8]> = seen.iter().map(Vec::as_slice).collect();
        embed::join_parts(&parts, Joining { partial, rounds: rounds.as_deref(), look, seen: &seen })
    });
    let Joined { picture, complete, bound } = joined.map_err(|t| error(py, t))?;
    let image = if partial { Image::unfinished(picture.image) } else { Image::finished(picture) };
    Ok((image, complete, bound))
}

/// Writes a picture where and how words of `steradian render` say it.
#[pyfunction]
fn write_outputs(py: Python<'_>, image: &Image, words: Vec<String>) -> PyResult<()> {
    py.detach(|| embed::write(image.inner(), &words)).map_err(|t| error(py, t))
}

/// The numbers of samples per pixel at which an error is looked at, up to `most`, each with the number of the look.
#[pyfunction]
fn looks(most: u32) -> Vec<(u32, u32)> {
    embed::looks().take_while(|&(spp, _)| spp <= most).collect()
}

/// Takes the words of `steradian render` apart for a driver that renders elsewhere.
#[pyfunction]
fn asked<'py>(py: Python<'py>, words: Vec<String>) -> PyResult<Bound<'py, PyDict>> {
    let asked = embed::asked(&words).map_err(|t| error(py, t))?;
    let d = PyDict::new(py);
    d.set_item("scene", asked.scene)?;
    d.set_item("reading", asked.reading)?;
    d.set_item("words", asked.words)?;
    d.set_item("writing", asked.writing)?;
    d.set_item("spp", asked.spp)?;
    d.set_item("error", asked.error)?;
    d.set_item("address", asked.address)?;
    d.set_item("parts", asked.parts)?;
    d.set_item("spill", asked.spill)?;
    d.set_item("threads", asked.threads)?;
    d.set_item("quiet", asked.quiet)?;
    d.set_item("preview", asked.preview)?;
    Ok(d)
}

/// Registers the classes and functions.
pub(crate) fn register(m: &Bound<'_, PyModule>) -> PyResult<()> {
    m.add_class::<Scene>()?;
    m.add_function(wrap_pyfunction!(join_parts, m)?)?;
    m.add_function(wrap_pyfunction!(write_outputs, m)?)?;
    m.add_function(wrap_pyfunction!(looks, m)?)?;
    m.add_function(wrap_pyfunction!(asked, m)?)
}
