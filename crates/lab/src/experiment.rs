//! What an experiment hands over: prose, figures, tables, pictures and claims.

use crate::{BruteForce, Claim, Topic};
use steradian_image::Image;

/// How hard to work.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Effort {
    /// As little as the claims can stand, for tests.
    Least,
    /// Under two minutes for everything on two cores.
    Quick,
    /// Under twenty minutes.
    Full,
}

impl Effort {
    /// One of three values.
    pub fn pick<T>(self, least: T, quick: T, full: T) -> T {
        match self {
            Self::Least => least,
            Self::Quick => quick,
            Self::Full => full,
        }
    }
}

/// What an experiment is given.
#[derive(Clone, Copy, Debug)]
pub struct Setting {
    /// How hard to work.
    pub effort: Effort,
    /// Where all random numbers start.
    pub seed: u64,
    /// Threads; at least one. No result depends on it.
    pub threads: usize,
    /// Brute force with these parameters too, counted by the topic `cost`.
    pub brute_force: Option<BruteForce>,
}

impl Default for Setting {
    fn default() -> Self {
        Self { effort: Effort::Quick, seed: 1, threads: 1, brute_force: None }
    }
}

impl Setting {
    /// The command that runs a topic alone and gets the numbers of this run.
    pub fn command(&self, topic: Topic) -> String {
        let mut out = format!("steradian lab {topic}");
        if self.effort == Effort::Full {
            out += " --full";
        }
        if self.seed != Self::default().seed {
            out += &format!(" --seed {}", self.seed);
        }
        if let Some(parameters) = self.brute_force.filter(|_| topic == Topic::Cost) {
            out += &format!(" --brute-force {parameters}");
        }
        out + " -o lab"
    }

    /// A seed for one part of an experiment.
    pub fn seed_for(&self, topic: Topic, part: u64) -> u64 {
        steradian_sampling::rng::hash_u64(&[self.seed, topic as u64, part])
    }
}

/// One axis of a figure.
#[derive(Clone, Debug, PartialEq)]
pub struct Axis {
    /// What is drawn along it.
    pub label: String,
    /// Whether it is logarithmic; points that are not positive are then left out.
    pub log: bool,
    /// Its ends, or those of the data.
    pub range: Option<[f64; 2]>,
}

impl Axis {
    /// A linear axis.
    pub fn linear(label: &str) -> Self {
        Self { label: label.into(), log: false, range: None }
    }

    /// A logarithmic axis.
    pub fn log(label: &str) -> Self {
        Self { label: label.into(), log: true, range: None }
    }

    /// The same axis from `low` to `high`.
    pub fn from_to(mut self, low: f64, high: f64) -> Self {
        self.range = Some([low, high]);
        self
    }
}

/// How a series is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mark {
    /// A line: theory.
    Line,
    /// A broken line: theory.
    Dashed,
    /// Dots: measurements.
    Dots,
    /// Dots on a line: measurements in order.
    LineDots,
}

/// Points with a name.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    /// For the legend.
    pub name: String,
    /// The points.
    pub points: Vec<(f64, f64)>,
    /// How to draw them.
    pub mark: Mark,
}

/// A plot.
#[derive(Clone, Debug, PartialEq)]
pub struct Figure {
    /// Name of its CSV file; unique in the experiment.
    pub id: String,
    /// What it shows and what to see in it.
    pub caption: String,
    /// Horizontal axis.
    pub x: Axis,
    /// Vertical axis.
    pub y: Axis,
    /// What is drawn.
    pub series: Vec<Series>,
}

impl Figure {
    /// An empty plot.
    pub fn new(id: &str, caption: impl Into<String>, x: Axis, y: Axis) -> Self {
        Self { id: id.into(), caption: caption.into(), x, y, series: Vec::new() }
    }

    /// With one more series.
    pub fn with(mut self, name: impl Into<String>, mark: Mark, points: Vec<(f64, f64)>) -> Self {
        self.series.push(Series { name: name.into(), points, mark });
        self
    }
}

/// Rows of text and numbers.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    /// Name of its CSV file; unique in the experiment.
    pub id: String,
    /// What it shows.
    pub caption: String,
    /// Column heads.
    pub columns: Vec<String>,
    /// Rows as wide as the heads.
    pub rows: Vec<Vec<String>>,
}

impl Table {
    /// An empty table.
    pub fn new(id: &str, caption: impl Into<String>, columns: &[&str]) -> Self {
        let columns = columns.iter().map(|&c| c.into()).collect();
        Self { id: id.into(), caption: caption.into(), columns, rows: Vec::new() }
    }

    /// Adds a row.
    pub fn row(&mut self, cells: impl IntoIterator<Item = String>) {
        self.rows.push(cells.into_iter().collect());
    }
}

/// A picture: linear colours, shown with the sRGB curve.
#[derive(Clone, Debug)]
pub struct Picture {
    /// Name of its files; unique in the experiment.
    pub id: String,
    /// What it shows.
    pub caption: String,
    /// Linear RGB.
    pub image: Image,
}

/// A piece of an experiment's section, in the order of reading.
#[derive(Clone, Debug)]
pub enum Block {
    /// A paragraph.
    Text(String),
    /// A plot.
    Figure(Figure),
    /// A table.
    Table(Table),
    /// Pictures next to each other.
    Pictures(Vec<Picture>),
    /// Two pictures of one size on top of each other with a slider between them; named by their ids.
    Slider {
        /// Id of the picture on the left.
        left: String,
        /// Id of the picture on the right.
        right: String,
        /// What to look for.
        caption: String,
    },
}

/// The answer to a question that a slide asks.
#[derive(Clone, Debug, PartialEq)]
pub struct Answer {
    /// The number of the question in the lecture, counted through; see [`crate::slides::QUESTIONS`].
    pub question: u32,
    /// The answer, with measured numbers.
    pub text: String,
}

/// A slip of the slides, with the number that shows it.
#[derive(Clone, Debug, PartialEq)]
pub struct Erratum {
    /// What the slide says.
    pub slide: String,
    /// What is right, and what was measured.
    pub correction: String,
}

/// The result of one topic.
#[derive(Clone, Debug)]
pub struct Experiment {
    /// Which.
    pub topic: Topic,
    /// Heading.
    pub title: &'static str,
    /// The lecture's claim or question.
    pub lecture: &'static str,
    /// What is done here.
    pub method: String,
    /// What came out, in a few sentences with numbers.
    pub result: String,
    /// Figures, tables, pictures, paragraphs.
    pub blocks: Vec<Block>,
    /// Numbers against theory.
    pub claims: Vec<Claim>,
    /// Answers to the questions on the slides.
    pub answers: Vec<Answer>,
    /// Slips of the slides.
    pub errata: Vec<Erratum>,
}

impl Experiment {
    /// An experiment without results.
    pub fn new(topic: Topic, title: &'static str, lecture: &'static str, method: impl Into<String>) -> Self {
        Self {
            topic,
            title,
            lecture,
            method: method.into(),
            result: String::new(),
            blocks: Vec::new(),
            claims: Vec::new(),
            answers: Vec::new(),
            errata: Vec::new(),
        }
    }

    /// Adds a paragraph.
    pub fn text(&mut self, text: impl Into<String>) {
        self.blocks.push(Block::Text(text.into()));
    }

    /// Adds a plot.
    pub fn figure(&mut self, figure: Figure) {
        self.blocks.push(Block::Figure(figure));
    }

    /// Adds a table.
    pub fn table(&mut self, table: Table) {
        self.blocks.push(Block::Table(table));
    }

    /// Adds a row of pictures.
    pub fn pictures(&mut self, pictures: Vec<Picture>) {
        self.blocks.push(Block::Pictures(pictures));
    }

    /// Adds a slider between two pictures that were added before.
    pub fn slider(&mut self, left: &str, right: &str, caption: impl Into<String>) {
        self.blocks.push(Block::Slider { left: left.into(), right: right.into(), caption: caption.into() });
    }

    /// Adds a claim.
    pub fn claim(&mut self, claim: Claim) {
        self.claims.push(claim);
    }

    /// Answers a question of the slides.
    pub fn answer(&mut self, question: u32, text: impl Into<String>) {
        self.answers.push(Answer { question, text: text.into() });
    }

    /// Notes a slip of the slides.
    pub fn erratum(&mut self, slide: impl Into<String>, correction: impl Into<String>) {
        self.errata.push(Erratum { slide: slide.into(), correction: correction.into() });
    }

    /// The picture of this id.
    pub fn picture(&self, id: &str) -> Option<&Picture> {
        self.blocks.iter().find_map(|b| match b {
            Block::Pictures(all) => all.iter().find(|p| p.id == id),
            _ => None,
        })
    }
}
