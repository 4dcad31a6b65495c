//! Sums of samples in a fixed tree.
//!
//! The sum over samples `[a 2^k, (a + 1) 2^k)` is the sum of its two halves, whatever thread, pass, interruption or
//! machine computed them. A range of samples is then a short list of such nodes, and continuing to more samples, or
//! joining two ranges that meet, never touches what is finished. The result has the same bits as if all had been added
//! at once, and its rounding error grows with the logarithm of their number.

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

/// A node of the tree: the samples `start .. start + 2^level`, with `start` a multiple of `2^level`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Node {
    /// The first sample.
    pub start: u32,
    /// The height above single samples.
    pub level: u8,
}

impl Node {
    /// One sample.
    pub fn leaf(sample: u32) -> Self {
        Self { start: sample, level: 0 }
    }

    /// The sample after the last.
    pub fn end(&self) -> u32 {
        self.start + (1 << self.level)
    }

    /// The node that this one, on the right, makes with its left neighbour, if they are halves of one.
    #[inline]
    pub fn join(&self, left: &Node) -> Option<Node> {
        let halves = left.level == self.level && left.end() == self.start && left.start & ((2 << left.level) - 1) == 0;
        halves.then_some(Node { start: left.start, level: left.level + 1 })
    }
}

/// Levels above this would overflow the sample index.
pub(crate) const MOST_LEVEL: u8 = 30;

/// At most so many nodes make up a range: each level at most twice.
const MOST_NODES: usize = 64;

/// The nodes of one pixel while samples are added in order.
#[derive(Clone, Debug)]
pub struct PixelStack {
    len: usize,
    nodes: [Node; MOST_NODES],
    sums: [PixelSum; MOST_NODES],
    /// Colours of each node besides: `width` for each.
    layers: Vec<[f32; 3]>,
    width: usize,
    next: u32,
}

impl PixelStack {
    /// No samples; the next to come is number `next`. Each has `layers` colours besides its own.
    pub fn new(next: u32, layers: usize) -> Self {
        Self {
            len: 0,
            nodes: [Node::default(); MOST_NODES],
            sums: [PixelSum::default(); MOST_NODES],
            layers: Vec::new(),
            width: layers,
            next,
        }
    }

    /// Continues from finished nodes, which lie side by side.
    #[inline]
    pub fn resume<'l>(&mut self, next: u32, nodes: impl Iterator<Item = (Node, PixelSum, &'l [[f32; 3]])>) {
        self.len = 0;
        self.layers.clear();
        for (node, sum, layers) in nodes {
            self.nodes[self.len] = node;
            self.sums[self.len] = sum;
            self.layers.extend_from_slice(layers);
            self.len += 1;
        }
        self.next = next;
    }

    /// Adds the next sample, without anything in the layers.
    #[inline]
    pub fn push(&mut self, sum: PixelSum) {
        self.layers.resize(self.layers.len() + self.width, [0.0; 3]);
        self.join(sum);
    }

    /// Adds the next sample and its layers.
    ///
    /// # Panics
    /// If there are not as many layers as was said.
    pub fn push_layers(&mut self, sum: PixelSum, layers: &[[f32; 3]]) {
        assert_eq!(layers.len(), self.width, "the layers of a sample");
        self.layers.extend_from_slice(layers);
        self.join(sum);
    }

    #[inline]
    fn join(&mut self, mut sum: PixelSum) {
        let mut node = Node::leaf(self.next);
        while self.len > 0
            && let Some(joined) = node.join(&self.nodes[self.len - 1])
        {
            self.len -= 1;
            sum = self.sums[self.len].add(&sum);
            if self.width > 0 {
                let at = self.layers.len() - self.width;
                let (before, right) = self.layers.split_at_mut(at);
                add_layers(&mut before[at - self.width..], right);
                self.layers.truncate(at);
            }
            node = joined;
        }
        self.nodes[self.len] = node;
        self.sums[self.len] = sum;
        self.len += 1;
        self.next += 1;
    }

    /// The nodes, in the order of their samples.
    #[inline]
    pub fn nodes(&self) -> impl Iterator<Item = (Node, PixelSum, &[[f32; 3]])> + '_ {
        (0..self.len).map(|i| (self.nodes[i], self.sums[i], &self.layers[i * self.width..(i + 1) * self.width]))
    }
}

/// The colours of two sets of samples together.
pub(crate) fn add_layers(left: &mut [[f32; 3]], right: &[[f32; 3]]) {
    for (a, b) in left.iter_mut().zip(right) {
        *a = std::array::from_fn(|c| a[c] + b[c]);
    }
}

/// The nodes of the samples `begin .. end`, in order.
pub fn nodes_of(begin: u32, end: u32) -> Vec<Node> {
    let mut out = Vec::new();
    let mut at = begin;
    while at < end {
        let aligned = if at == 0 { u32::from(MOST_LEVEL) } else { at.trailing_zeros() };
        let fits = (end - at).ilog2();
        let node = Node { start: at, level: aligned.min(fits) as u8 };
        at = node.end();
        out.push(node);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(i: u32) -> PixelSum {
        PixelSum::of([(i as f32 * 0.37).fract(), 1.0 / (i + 1) as f32, 1e6 * (i % 3) as f32])
    }

    fn layers(i: u32) -> [[f32; 3]; 2] {
        [sample(i + 1).rgb, sample(7 * i).rgb]
    }

    fn filled(begin: u32, end: u32) -> PixelStack {
        let mut stack = PixelStack::new(begin, 2);
        (begin..end).for_each(|i| stack.push_layers(sample(i), &layers(i)));
        stack
    }

    #[test]
    fn any_interruption_gives_the_same_bits() {
        let whole = filled(0, 1000);
        for cut in [1, 2, 7, 64, 500, 513, 999] {
            let first = filled(0, cut);
            let mut second = PixelStack::new(0, 2);
            second.resume(cut, first.nodes());
            (cut..1000).for_each(|i| second.push_layers(sample(i), &layers(i)));
            assert!(second.nodes().eq(whole.nodes()), "cut at {cut}");
        }
    }

    #[test]
    fn a_range_has_the_nodes_that_it_is_said_to_have() {
        for (begin, end) in [(0, 0), (0, 1), (1, 2), (0, 100), (1, 4), (3, 64), (5, 1000), (64, 96), (511, 513)] {
            let stack = filled(begin, end);
            assert_eq!(stack.nodes().map(|n| n.0).collect::<Vec<_>>(), nodes_of(begin, end), "{begin}..{end}");
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
