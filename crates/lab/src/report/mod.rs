//! The report: one HTML file that needs nothing else, and the numbers and pictures behind it as files.

mod files;
mod html;
mod plot;

use crate::experiment::{Experiment, Setting};
use crate::{Claim, Error};
use std::path::Path;

/// One topic of a report.
#[derive(Clone, Debug)]
pub struct Section {
    /// What came out.
    pub experiment: Experiment,
    /// How long it took.
    pub seconds: f64,
}

/// The results of a run.
#[derive(Clone, Debug)]
pub struct Report {
    /// In the order of the lecture.
    pub sections: Vec<Section>,
    /// What it was run with.
    pub setting: Setting,
}

impl Report {
    /// All claims in order.
    pub fn claims(&self) -> impl Iterator<Item = &Claim> {
        self.sections.iter().flat_map(|s| &s.experiment.claims)
    }

    /// Whether every claim holds.
    pub fn holds(&self) -> bool {
        self.claims().all(Claim::holds)
    }

    /// The page: pictures, plots, styles and script inline; no other resource is asked for.
    ///
    /// # Errors
    /// `Error::Plot` or `Error::Picture` if something cannot be drawn.
    pub fn html(&self) -> Result<String, Error> {
        html::page(self)
    }

    /// Writes everything into a folder, which is made if need be: `report.html`, `report.json`, `claims.jsonl`, `csv/` and
    /// `images/` (PNG and EXR).
    ///
    /// # Errors
    /// `Error::Write` if the folder is not writable; no file is left half-written.
    pub fn write(&self, folder: &Path) -> Result<(), Error> {
        files::write(self, folder)
    }
}
