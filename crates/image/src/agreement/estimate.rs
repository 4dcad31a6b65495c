//! An image as a statistical estimate: its mean, and what is known about its noise.

use crate::{Error, Image};

/// Three planes (R, G, B) in double precision, row by row.
pub type Planes = [Vec<f64>; 3];

/// A rendered image together with what is known of its noise.
#[derive(Clone, Debug)]
pub struct Estimate {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) mean: Planes,
    /// Variance of `mean`, per pixel.
    pub(super) variance: Option<Planes>,
    /// Degrees of freedom of `variance`.
    pub(super) dof: f64,
    /// The independent renderings behind `mean`, where there are enough to measure with.
    pub(super) seeds: Vec<Planes>,
}

/// From this many independent renderings on, their scatter is trusted by itself.
pub(super) const MANY_SEEDS: usize = 8;

impl Estimate {
    /// An image whose noise is not known. A grey image counts as three equal channels.
    ///
    /// # Errors
    /// `Error::Shape` if there is no colour.
    pub fn of_unknown_noise(image: &Image) -> Result<Estimate, Error> {
        Ok(Estimate {
            width: image.width(),
            height: image.height(),
            mean: planes(image)?,
            variance: None,
            dof: 0.0,
            seeds: Vec::new(),
        })
    }

    /// An image with the variance of its pixel means in three planes of the same size, estimated with `dof` degrees of freedom
    /// (samples or batches, less one).
    ///
    /// # Errors
    /// `Error::Shape` if the planes do not fit or `dof` is not positive.
    pub fn with_variance(image: &Image, variance: [&[f32]; 3], dof: f64) -> Result<Estimate, Error> {
        let mut e = Estimate::of_unknown_noise(image)?;
        if variance.iter().any(|p| p.len() != e.width * e.height)
            || dof.partial_cmp(&0.0) != Some(std::cmp::Ordering::Greater)
        {
            return Err(Error::shape("the variance does not fit the image"));
        }
        e.variance = Some(variance.map(|p| p.iter().map(|&v| f64::from(v)).collect()));
        e.dof = dof;
        Ok(e)
    }

    /// An image with what its file says: channels `Variance.R`, `.G`, `.B` hold the variance of the mean, with the integer attribute
    /// `refBatches` or `varianceBatches` (less one) as degrees of freedom. Without those channels the noise is unknown.
    ///
    /// # Errors
    /// `Error::Shape` if there is no colour.
    pub fn from_image(image: &Image) -> Result<Estimate, Error> {
        let batches = ["refBatches", "varianceBatches"].iter().find_map(|n| image.metadata.number(n));
        match image.planes("Variance") {
            Some(v) => Estimate::with_variance(image, v, (batches.unwrap_or(1e6) - 1.0).max(1.0)),
            None => Estimate::of_unknown_noise(image),
        }
    }

    /// The mean of independent renderings of one scene. From eight on their scatter is the noise. Below that, it only scales the
    /// pattern of `shape`'s variance (where that is given), since a variance out of two to seven numbers is itself mostly noise.
    ///
    /// # Errors
    /// `Error::Shape` if there are no images or their sizes differ.
    pub fn from_seeds(images: &[Image], shape: Option<&Estimate>) -> Result<Estimate, Error> {
        let [first, rest @ ..] = images else { return Err(Error::shape("no image to compare")) };
        if rest.is_empty() {
            return Estimate::from_image(first);
        }
        let mut e = Estimate::of_unknown_noise(first)?;
        e.seeds.push(e.mean.clone());
        for image in rest {
            if (image.width(), image.height()) != (e.width, e.height) {
                return Err(Error::shape("the renderings differ in size"));
            }
            e.seeds.push(planes(image)?);
        }
        let n = e.seeds.len() as f64;
        let mut variance: Planes = Default::default();
        for c in 0..3 {
            for i in 0..e.width * e.height {
                let (mean, v) = super::statistics::mean_and_variance(e.seeds.iter().map(|s| s[c][i]));
                e.mean[c][i] = mean;
                variance[c].push(v / n);
            }
        }
        e.dof = n - 1.0;
        let shape = shape.and_then(|s| s.variance.as_ref()).filter(|s| s[0].len() == variance[0].len());
        if let Some(shape) = shape.filter(|_| e.seeds.len() < MANY_SEEDS) {
            // As if the pattern were worth as many further renderings as are "many".
            let prior = MANY_SEEDS as f64;
            let weight = e.dof / (e.dof + prior);
            for c in 0..3 {
                let scale = variance[c].iter().sum::<f64>() / shape[c].iter().sum::<f64>().max(1e-300);
                for (v, s) in variance[c].iter_mut().zip(&shape[c]) {
                    *v = weight * *v + (1.0 - weight) * s * scale;
                }
            }
            e.dof += prior;
        }
        if e.seeds.len() < MANY_SEEDS {
            e.seeds.clear();
        }
        e.variance = Some(variance);
        Ok(e)
    }

    /// Whether the noise is known.
    pub fn has_variance(&self) -> bool {
        self.variance.is_some()
    }

    pub(super) fn is_finite(&self) -> bool {
        self.mean.iter().flatten().all(|v| v.is_finite())
    }

    /// The variance, where no pixel is trusted to be much quieter than its neighbours: few samples of a rare bright path often miss
    /// it, and then measure too little noise.
    pub(super) fn guarded_variance(&self) -> Option<Planes> {
        let variance = self.variance.as_ref()?;
        Some(variance.each_ref().map(|v| {
            let clean: Vec<f64> = v.iter().map(|&v| if v.is_finite() { v.max(0.0) } else { 0.0 }).collect();
            let around = mean_of_nine(&clean, self.width, self.height);
            clean.iter().zip(around).map(|(v, a)| v.max(0.5 * a)).collect()
        }))
    }
}

fn planes(image: &Image) -> Result<Planes, Error> {
    let planes = image.colour_planes().ok_or_else(|| {
        let names: Vec<_> = image.channels().iter().map(|c| c.name.as_str()).collect();
        Error::shape(format!("no channels R, G, B or Y among {}", names.join(", ")))
    })?;
    Ok(planes.map(|p| p.iter().map(|&v| f64::from(v)).collect()))
}

/// Mean over 3 x 3 pixels, the border repeated.
fn mean_of_nine(v: &[f64], width: usize, height: usize) -> Vec<f64> {
    let mut out = Vec::with_capacity(v.len());
    for y in 0..height {
        for x in 0..width {
            let mut sum = 0.0;
            for dy in 0..3 {
                let row = (y + dy).saturating_sub(1).min(height - 1) * width;
                for dx in 0..3 {
                    sum += v[row + (x + dx).saturating_sub(1).min(width - 1)];
                }
            }
            out.push(sum / 9.0);
        }
    }
    out
}
