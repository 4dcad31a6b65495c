//! The slides: which section shows which, and the questions that they ask.

use crate::Topic;

/// A question of the lecture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Question {
    /// Counted through the lecture from 1.
    pub number: u32,
    /// The slide that asks.
    pub slide: &'static str,
    /// The question.
    pub text: &'static str,
    /// The topic that answers it.
    pub topic: Topic,
}

macro_rules! questions {
    ($($number:literal $topic:ident, $slide:literal: $text:literal;)*) => {
        /// Every question of the slides, in order.
        pub const QUESTIONS: &[Question] =
            &[$(Question { number: $number, slide: $slide, text: $text, topic: Topic::$topic }),*];
    };
}

questions! {
    1 Aliasing, "Aliasing": "How well does f[i] approximate f(x)?";
    2 Supersampling, "Aliasing and anti-aliasing in rendering": "How exactly do we compute the average color?";
    3 Adaptive, "Antialiasing by adaptive sampling": "When do we decide to cast more rays in a particular area?";
    4 MotionBlur, "Motion blur": "How can we use super-sampling and averaging down to get motion blur?";
    5 Cost, "MCPT vs. Whitted": "For a fixed number of rays per pixel, does MCPT trace more total rays than Whitted?";
    6 Estimator, "MCPT vs. Whitted": "Does MCPT give the same answer every time?";
    7 Quadrature, "Approximating integrals": "How many samples do we need if we have integrals over d dimensions, and we sample N times in each dimension?";
    8 Quadrature, "Approximating integrals (cont'd)": "Which x_i should we pick?";
    9 Quadrature, "Approximating integrals (cont'd)": "When the x_i are more closely spaced, do they get larger or smaller weight?";
    10 Estimator, "A stochastic approach": "How would we estimate the mean from the samples?";
    11 Estimator, "A stochastic approach": "Suppose we repeated the process, drawing N samples and re-computing the mean. Will we get the exact same answer?";
    12 Estimator, "Sample variance": "How much does the answer vary?";
    13 Estimator, "Sample variance": "What parameter can we control to reduce the variance?";
    14 Estimator, "Sample variance": "How does standard deviation change when adjusting that parameter?";
    15 Estimator, "Stochastic sampling as integration": "What is its expected value (of the mean of the f(X_i))?";
    16 Estimator, "Stochastic sampling as integration (cont'd)": "What is the expected value of f(X) where X is drawn from a uniform pdf over [a, b]?";
    17 Importance, "Monte Carlo integration": "How do we get more samples in the large value areas?";
    18 Importance, "Monte Carlo integration": "What function tells us how close spaced samples will be?";
    19 Estimator, "Monte Carlo integration (cont'd)": "But is this sample mean really approximating the integral?";
    20 Importance, "Monte Carlo integration (cont'd)": "What variables and/or functions are under our control here?";
    21 Importance, "Importance sampling": "Why don't we just do that (choose p = K f)?";
}

/// Every slide with the section that shows it.
pub const SLIDES: &[(&str, Topic)] = &[
    ("Reading: Marschner and Shirley 13.4 (distribution ray tracing)", Topic::Cost),
    ("Reading: Pharr, Jakob and Humphreys 13 (importance sampling, multiple importance sampling)", Topic::Mis),
    ("Reading: Pharr, Jakob and Humphreys 13 (Russian roulette and splitting)", Topic::Roulette),
    ("Reading: Pharr, Jakob and Humphreys 13 (careful sample placement)", Topic::Sequences),
    ("Aliasing", Topic::Aliasing),
    ("Aliasing (con't)", Topic::Aliasing),
    ("Aliasing and anti-aliasing in rendering", Topic::Supersampling),
    ("Antialiasing in a ray tracer", Topic::Supersampling),
    ("Antialiasing by adaptive sampling", Topic::Adaptive),
    ("Gloss and translucency", Topic::Gloss),
    ("Soft shadows", Topic::SoftShadows),
    ("Depth of field", Topic::DepthOfField),
    ("Depth of field (cont'd)", Topic::DepthOfField),
    ("Motion blur", Topic::MotionBlur),
    ("Naively improving Whitted ray tracing", Topic::Cost),
    ("Penumbra revisited (three slides)", Topic::Penumbra),
    ("Monte Carlo Path Tracing vs. Brute Force", Topic::Cost),
    ("MCPT vs. Whitted", Topic::Cost),
    ("Ray tracing as integration", Topic::Convergence),
    ("Approximating integrals", Topic::Quadrature),
    ("Approximating integrals (cont'd)", Topic::Quadrature),
    ("A stochastic approach", Topic::Estimator),
    ("Sample mean", Topic::Estimator),
    ("Sample variance", Topic::Estimator),
    ("Stochastic sampling as integration", Topic::Estimator),
    ("Stochastic sampling as integration (cont'd)", Topic::Estimator),
    ("Monte Carlo integration", Topic::Importance),
    ("Monte Carlo integration (cont'd)", Topic::Estimator),
    ("Importance sampling", Topic::Importance),
    ("Stratified sampling", Topic::Stratified),
    ("Importance sampling of reflection", Topic::Importance),
    ("Rays/pixel without and with importance sampling (pictures)", Topic::Importance),
    ("Penumbra revisited: clumped samples", Topic::Penumbra),
    ("Penumbra: stratified sampling", Topic::Penumbra),
    ("Stratified sampling of a 2D pixel", Topic::Stratified),
    ("Rays/pixel without and with stratified sampling (pictures)", Topic::Stratified),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn questions_are_numbered_and_every_topic_has_a_slide() {
        for (i, q) in QUESTIONS.iter().enumerate() {
            assert_eq!(q.number as usize, i + 1);
        }
        for topic in Topic::ALL {
            assert!(SLIDES.iter().any(|(_, t)| *t == topic), "{topic}");
        }
    }
}
