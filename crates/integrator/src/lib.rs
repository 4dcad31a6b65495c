//! A ray and a sampler in, radiance out.
