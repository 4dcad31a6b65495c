//! The small public face for programs: a file to a `Scene`, a `Scene` to an `Image`.

use std::fmt;
use std::path::Path;
use std::sync::atomic::AtomicBool;

use steradian_image::Image;
use steradian_load::{Disk, Input, LoadOptions, LoadOutcome, load_pbrt};
use steradian_render::{Plan, Quiet};
use steradian_scene::{Scene, World};

/// A scene that has errors: all of them, each with its place, as a person reads them.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub struct LoadError {
    /// One report each, of several lines.
    pub reports: Vec<String>,
}

impl fmt::Display for LoadError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.reports.join("\n").trim_end())
    }
}

/// Why a scene could not be rendered.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct RenderError(String);

/// Reads a pbrt-v4 scene file (`.pbrt` or `.pbrt.gz`) or a model (`.gltf`, `.glb`, `.obj`, `.stl`, `.ply`). Warnings are dropped: use `steradian_load` to see them.
///
/// # Errors
/// Every error in the scene.
pub fn load(path: impl AsRef<Path>) -> Result<Scene, LoadError> {
    outcome(steradian_load::load(Input::File(path.as_ref()), &Disk, &LoadOptions::default()))
}

/// Reads a pbrt-v4 scene from a text; `name` stands for it in messages, and other files are looked for in the current folder.
///
/// # Errors
/// Every error in the scene.
pub fn load_text(name: &str, text: &str) -> Result<Scene, LoadError> {
    outcome(load_pbrt(Input::Text { name, text, directory: Path::new("") }, &Disk, &LoadOptions::default()))
}

fn outcome(outcome: LoadOutcome) -> Result<Scene, LoadError> {
    outcome.scene.ok_or_else(|| LoadError {
        reports: outcome
            .diagnostics
            .iter()
            .filter(|d| d.severity == steradian_syntax::Severity::Error)
            .map(|d| d.render(&outcome.sources))
            .collect(),
    })
}

/// Renders a scene as its settings say, on all cores: linear colours in channels R, G, B, row 0 at the top. The same scene gives the
/// same bits on any machine with any number of cores.
///
/// # Errors
/// Where the scene cannot be put together.
pub fn render(scene: Scene) -> Result<Image, RenderError> {
    let world = World::build(scene).map_err(|e| RenderError(e.to_string()))?;
    let plan = Plan { spp: world.settings().sampler.spp, threads: crate::render::default_threads(), time_limit: None };
    let rendered = steradian_render::render(&world, &plan, &Quiet, &AtomicBool::new(false));
    let [width, height] = rendered.film.size();
    Image::from_rgb(width, height, &rendered.film.mean()).ok_or_else(|| RenderError("the film has no pixels".into()))
}
