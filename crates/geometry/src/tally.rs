//! Counting of intersection tests, the unit of cost of the lecture's models. Costs nothing when off.

use std::cell::Cell;

/// Is told of tests. Shared, because traversals nest.
pub trait Tally {
    /// Boxes were tested.
    fn boxes(&self, count: impl FnOnce() -> u32);
    /// Triangles, other shapes or instances were tested.
    fn primitives(&self, count: impl FnOnce() -> u32);
}

/// Counts nothing.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoTally;

impl Tally for NoTally {
    #[inline(always)]
    fn boxes(&self, _count: impl FnOnce() -> u32) {}
    #[inline(always)]
    fn primitives(&self, _count: impl FnOnce() -> u32) {}
}

/// Numbers of intersection tests.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct TestCounts {
    boxes: Cell<u64>,
    primitives: Cell<u64>,
}

impl TestCounts {
    /// Boxes tested: the children of every node that was opened.
    pub fn boxes(&self) -> u64 {
        self.boxes.get()
    }

    /// Triangles, other shapes and instances tested.
    pub fn primitives(&self) -> u64 {
        self.primitives.get()
    }
}

impl Tally for TestCounts {
    #[inline]
    fn boxes(&self, count: impl FnOnce() -> u32) {
        self.boxes.set(self.boxes.get() + u64::from(count()));
    }
    #[inline]
    fn primitives(&self, count: impl FnOnce() -> u32) {
        self.primitives.set(self.primitives.get() + u64::from(count()));
    }
}
