//! What the page needs of whoever can read scenes and knows the command line.

use std::collections::BTreeMap;
use std::time::Duration;
use steradian_render::Film;
use steradian_scene::{Camera, RenderSettings, Scene};

/// Options of the command line, by name without the dashes; a flag has an empty value.
pub type Options = BTreeMap<String, String>;

/// What the options replace in a scene.
#[derive(Clone, Debug)]
pub struct Said {
    /// The camera.
    pub camera: Camera,
    /// Film, filter, sampler, integrator.
    pub settings: RenderSettings,
}

/// Reads the scene, and turns options into settings and back into commands.
pub trait Stage: Send + Sync {
    /// What the page calls the scene.
    fn name(&self) -> String;
    /// The options that the server was started with.
    fn options(&self) -> Options;
    /// Reads the scene, without the options.
    ///
    /// # Errors
    /// One report for each problem, with file, line and caret.
    fn open(&self) -> Result<Scene, Vec<String>>;
    /// Whether any file of the scene has changed since it was last read.
    fn changed(&self) -> bool;
    /// Applies options to what the scene says; adds to the options what is needed to have the same picture by a command.
    ///
    /// # Errors
    /// Which option is wrong, and how.
    fn apply(&self, options: &mut Options, said: Said) -> Result<Said, String>;
    /// The command that does `word` (such as `trace`) with the options, and `more` at the end.
    fn command(&self, word: &str, options: &Options, more: &str) -> String;
    /// The picture as the bytes of an EXR that says how it was made.
    ///
    /// # Errors
    /// Why there is none.
    fn picture(
        &self,
        options: &Options,
        settings: &RenderSettings,
        film: &Film,
        took: Duration,
    ) -> Result<Vec<u8>, String>;
}
