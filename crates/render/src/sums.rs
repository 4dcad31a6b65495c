//! Sums of samples in a fixed tree.
//!
//! The sum over samples `[a 2^k, (a + 1) 2^k)` is the sum of its two halves, whatever thread, pass, interruption or
//! machine computed them. A pixel with `n` samples is then one partial sum for each bit of `n`, and continuing to more
//! samples never touches what is finished. The result has the same bits as if all had been added at once, and its
//! rounding error grows with the logarithm of `n`.

/// Sums over samples of one pixel: colour in the film's space, and its square, for the variance.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct PixelSum {
    /// Sum of the weighted colours.
    pub rgb: [f32; 3],
    /// Sum of their squares.
    pub squares: [f32; 3],
}

impl PixelSum {
    /// The sum over one sample.
    #[inline]
    pub fn of(rgb: [f32; 3]) -> Self {
        Self { rgb, squares: rgb.map(|v| v * v) }
    }

    /// The sum over two sets of samples.
    #[inline]
    pub fn add(&self, o: &Self) -> Self {
        Self {
            rgb: std::array::from_fn(|i| self.rgb[i] + o.rgb[i]),
            squares: std::array::from_fn(|i| self.squares[i] + o.squares[i]),
        }
    }

    /// The mean over `n` samples.
    pub fn mean(&self, n: u32) -> [f32; 3] {
        let s = if n == 0 { 0.0 } else { 1.0 / n as f32 };
        self.rgb.map(|v| v * s)
    }

    /// The estimated variance of the mean over `n` samples, taking them as independent: an upper estimate for
    /// low-discrepancy samplers. Infinite for fewer than two samples.
    pub fn variance_of_mean(&self, n: u32) -> [f32; 3] {
        if n < 2 {
            return [f32::INFINITY; 3];
        }
        let n = f64::from(n);
        std::array::from_fn(|i| {
            let (s, q) = (f64::from(self.rgb[i]), f64::from(self.squares[i]));
            ((q - s * s / n).max(0.0) / (n * (n - 1.0))) as f32
        })
    }
}

/// The partial sums of one pixel while samples are added in order.
#[derive(Clone, Debug)]
pub struct PixelStack {
    count: u32,
    levels: [PixelSum; 32],
}

impl PixelStack {
    /// No samples.
    pub fn new() -> Self {
        Self { count: 0, levels: [PixelSum::default(); 32] }
    }

    /// Continues from `count` samples: `level(k)` is the partial sum of size `2^k`, asked for each bit of `count`.
    #[inline]
    pub fn resume(&mut self, count: u32, mut level: impl FnMut(usize) -> PixelSum) {
        self.count = count;
        for k in bits(count) {
            self.levels[k] = level(k);
        }
    }

    /// Adds the next sample.
    #[inline]
    pub fn push(&mut self, mut sum: PixelSum) {
        let mut k = 0;
        while self.count & (1 << k) != 0 {
            sum = self.levels[k].add(&sum);
            k += 1;
        }
        self.levels[k] = sum;
        self.count += 1;
    }

    /// The partial sum of size `2^k`; meaningful where that bit of the count is set.
    #[inline]
    pub fn level(&self, k: usize) -> PixelSum {
        self.levels[k]
    }
}

impl Default for PixelStack {
    fn default() -> Self {
        Self::new()
    }
}

/// The set bits of a number, lowest first.
pub fn bits(n: u32) -> impl Iterator<Item = usize> {
    (0..32).filter(move |k| n & (1 << k) != 0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(i: u32) -> PixelSum {
        PixelSum::of([(i as f32 * 0.37).fract(), 1.0 / (i + 1) as f32, 1e6 * (i % 3) as f32])
    }

    fn total(stack: &PixelStack) -> PixelSum {
        bits(stack.count).map(|k| stack.level(k)).reduce(|a, b| b.add(&a)).unwrap_or_default()
    }

    #[test]
    fn any_interruption_gives_the_same_bits() {
        let mut whole = PixelStack::new();
        (0..1000).for_each(|i| whole.push(sample(i)));
        for cut in [1, 2, 7, 64, 500, 513, 999] {
            let mut first = PixelStack::new();
            (0..cut).for_each(|i| first.push(sample(i)));
            let mut second = PixelStack::new();
            second.resume(cut, |k| first.level(k));
            (cut..1000).for_each(|i| second.push(sample(i)));
            assert_eq!(total(&second), total(&whole), "cut at {cut}");
        }
    }

    #[test]
    fn mean_and_variance_of_a_known_set() {
        let s = [1.0f32, 2.0, 3.0, 4.0].map(|v| PixelSum::of([v; 3])).iter().fold(PixelSum::default(), |a, b| a.add(b));
        assert_eq!(s.mean(4), [2.5; 3]);
        assert!((s.variance_of_mean(4)[0] - (5.0 / 3.0) / 4.0).abs() < 1e-6);
        assert_eq!(s.variance_of_mean(1), [f32::INFINITY; 3]);
    }
}
