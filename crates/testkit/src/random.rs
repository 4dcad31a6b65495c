//! Random numbers for tests: SplitMix64 (Steele, Lea and Flood 2014), seeded, the same on every machine.

/// A deterministic generator.
#[derive(Clone, Debug)]
pub struct TestRng(u64);

impl TestRng {
    /// A generator for a seed.
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// 64 uniform bits.
    pub fn u64(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Uniform number in `[0, 1)`, a multiple of 2^-24.
    pub fn f32(&mut self) -> f32 {
        (self.u64() >> 40) as f32 / 16_777_216.0
    }

    /// Uniform number in `[0, 1)`.
    pub fn f64(&mut self) -> f64 {
        (self.u64() >> 11) as f64 / 9_007_199_254_740_992.0
    }

    /// Uniform point of the unit square.
    pub fn f32_2d(&mut self) -> [f32; 2] {
        [self.f32(), self.f32()]
    }

    /// Uniform direction of the unit sphere.
    pub fn direction(&mut self) -> [f32; 3] {
        let z = 2.0 * self.f64() - 1.0;
        let (sin, cos) = (std::f64::consts::TAU * self.f64()).sin_cos();
        let r = (1.0 - z * z).max(0.0).sqrt();
        [(r * cos) as f32, (r * sin) as f32, z as f32]
    }
}
