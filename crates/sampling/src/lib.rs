//! The lecture's toolbox: sample sequences, warps, distributions, estimators, statistics, multiple importance sampling.
