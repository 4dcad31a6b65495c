//! What is wrong with a sample, and where.

/// What is wrong with one sample.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Fault {
    /// The radiance is NaN or infinite; it counts as black.
    NotFinite,
    /// The code broke one of its own rules; the sample counts as black.
    Panic(String),
}

/// A sample that went wrong, with what is needed to replay it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BadSample {
    /// The pixel, in the full image.
    pub pixel: [u32; 2],
    /// The index of the sample.
    pub sample: u32,
    /// What happened.
    pub fault: Fault,
}
