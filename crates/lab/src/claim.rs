//! A claim of the lecture as numbers: what theory predicts, what was measured, and which measurements agree.

use crate::Topic;
use crate::measure::{ErrorAt, slope};
use serde::{Serialize, Serializer};
use steradian_sampling::statistics::{normal_quantile, student_t_quantile};

/// How often a true claim is reported as failed, per claim: one in ten million.
pub const FALSE_ALARM: f64 = 1e-7;

/// The number of standard errors that a normal measurement may be away from the truth, at [`FALSE_ALARM`].
pub fn z_limit() -> f64 {
    normal_quantile(1.0 - 0.5 * FALSE_ALARM)
}

/// As [`z_limit`] for a standard error that was itself estimated from `repeats` numbers.
pub fn t_limit(repeats: u64) -> f64 {
    student_t_quantile(1.0 - 0.5 * FALSE_ALARM, (repeats.max(2) - 1) as f64)
}

/// As [`t_limit`], for each of `tests` numbers that one claim is about.
pub fn t_limit_of(repeats: u64, tests: u64) -> f64 {
    student_t_quantile(1.0 - 0.5 * FALSE_ALARM / tests.max(1) as f64, (repeats.max(2) - 1) as f64)
}

/// Whether a measurement agrees with its claim.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Verdict {
    /// The measured value lies in the interval.
    Holds,
    /// It does not.
    Fails,
}

/// One claim. Serialises to one JSON object; an infinite end of the interval is `null` there.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Claim {
    /// The section that makes it.
    pub topic: Topic,
    /// What is claimed, in words.
    pub claim: String,
    /// The value that theory gives; for an inequality, the bound.
    #[serde(serialize_with = "finite")]
    pub predicted: f64,
    /// The value that came out.
    #[serde(serialize_with = "finite")]
    pub measured: f64,
    /// The measured values that agree with the claim: the prediction with the error of the measurement around it.
    #[serde(serialize_with = "finite_pair")]
    pub interval: [f64; 2],
    /// Whether `measured` lies in `interval`.
    pub verdict: Verdict,
}

impl Claim {
    /// A claim with the range of measured values that agree with it. A measurement that is not a number fails.
    pub fn within(
        topic: Topic,
        claim: impl Into<String>,
        predicted: f64,
        measured: f64,
        [low, high]: [f64; 2],
    ) -> Self {
        let verdict = if low <= measured && measured <= high { Verdict::Holds } else { Verdict::Fails };
        Self { topic, claim: claim.into(), predicted, measured, interval: [low, high], verdict }
    }

    /// Measured equals predicted up to the standard error of the measurement, at [`FALSE_ALARM`].
    pub fn equal(topic: Topic, claim: impl Into<String>, predicted: f64, measured: f64, standard_error: f64) -> Self {
        Self::close(topic, claim, predicted, measured, standard_error, 0.0)
    }

    /// As [`Claim::equal`], with a tolerance on top for what the prediction itself leaves out.
    pub fn close(
        topic: Topic,
        claim: impl Into<String>,
        predicted: f64,
        measured: f64,
        standard_error: f64,
        tolerance: f64,
    ) -> Self {
        let half = z_limit() * standard_error + tolerance;
        Self::within(topic, claim, predicted, measured, [predicted - half, predicted + half])
    }

    /// A squared error falls like `n^predicted`; measured over points that know their own scatter.
    pub fn falls(topic: Topic, claim: impl Into<String>, predicted: f64, points: &[ErrorAt]) -> Self {
        // The reference picture has an error of its own, which bends the line a little.
        match slope(points) {
            Some(s) => Self::close(topic, claim, predicted, 2.0 * s.value, 2.0 * s.standard_error, 0.04),
            None => Self::equal(topic, claim, predicted, f64::NAN, 0.0),
        }
    }

    /// The ratio of two squared errors that know their own scatter, with a tolerance for the error of the reference.
    pub fn ratio(
        topic: Topic,
        claim: impl Into<String>,
        predicted: f64,
        top: &ErrorAt,
        bottom: &ErrorAt,
        tolerance: f64,
    ) -> Self {
        let measured = top.mean_square / bottom.mean_square;
        let error = measured * top.relative.hypot(bottom.relative);
        Self::close(topic, claim, predicted, measured, error, tolerance * predicted)
    }

    /// The ratio of two squared errors is at most `bound`, up to their scatter.
    pub fn better(topic: Topic, claim: impl Into<String>, bound: f64, top: &ErrorAt, bottom: &ErrorAt) -> Self {
        let measured = top.mean_square / bottom.mean_square;
        let error = measured * top.relative.hypot(bottom.relative);
        Self::within(topic, claim, bound, measured, [0.0, bound + z_limit() * error])
    }

    /// A squared error falls at least as fast as `n^bound`, up to the scatter of the points.
    pub fn falls_faster(topic: Topic, claim: impl Into<String>, bound: f64, points: &[ErrorAt]) -> Self {
        let (measured, error) = slope(points).map_or((f64::NAN, 0.0), |s| (2.0 * s.value, 2.0 * s.standard_error));
        Self::within(topic, claim, bound, measured, [f64::NEG_INFINITY, bound + z_limit() * error])
    }

    /// Measured is at most `bound`.
    pub fn at_most(topic: Topic, claim: impl Into<String>, bound: f64, measured: f64) -> Self {
        Self::within(topic, claim, bound, measured, [f64::NEG_INFINITY, bound])
    }

    /// Measured is at least `bound`.
    pub fn at_least(topic: Topic, claim: impl Into<String>, bound: f64, measured: f64) -> Self {
        Self::within(topic, claim, bound, measured, [bound, f64::INFINITY])
    }

    /// Whether it holds.
    pub fn holds(&self) -> bool {
        self.verdict == Verdict::Holds
    }

    /// The JSON object, on one line.
    pub fn to_json(&self) -> String {
        serde_json::to_string(self).expect("a claim is strings and numbers")
    }
}

fn finite<S: Serializer>(v: &f64, s: S) -> Result<S::Ok, S::Error> {
    v.is_finite().then_some(*v).serialize(s)
}

fn finite_pair<S: Serializer>(v: &[f64; 2], s: S) -> Result<S::Ok, S::Error> {
    v.map(|v| v.is_finite().then_some(v)).serialize(s)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_claim_is_one_line_of_json_with_the_promised_keys() {
        let claim = Claim::at_most(Topic::SoftShadows, "a \"quoted\"\nclaim", 2.0, 1.5);
        let line = claim.to_json();
        assert!(!line.contains('\n'));
        let value: serde_json::Value = serde_json::from_str(&line).unwrap();
        assert_eq!(value["topic"], "soft-shadows");
        assert_eq!(value["verdict"], "holds");
        assert_eq!(value["interval"], serde_json::json!([null, 2.0]));
        assert_eq!((value["predicted"].as_f64(), value["measured"].as_f64()), (Some(2.0), Some(1.5)));
    }

    #[test]
    fn what_is_outside_or_not_a_number_fails() {
        assert!(!Claim::equal(Topic::Mis, "", 1.0, 1.1, 0.01).holds());
        assert!(Claim::equal(Topic::Mis, "", 1.0, 1.05, 0.01).holds());
        assert!(!Claim::at_least(Topic::Mis, "", 1.0, f64::NAN).holds());
        assert!((z_limit() - 5.3267).abs() < 1e-3);
        assert!(t_limit(8) > z_limit() && t_limit_of(8, 20) > t_limit(8) && t_limit_of(8, 1) == t_limit(8));
    }
}
