//! The traversal stack: fixed capacity, not cleared at the start of a ray. The crate's only unsafe code.
#![allow(unsafe_code)]

use std::mem::MaybeUninit;

use crate::WIDTH;
use crate::build::MAX_DEPTH;

/// A node leaves at most seven siblings behind on each level; one push may overshoot by a node.
const CAPACITY: usize = (WIDTH - 1) * MAX_DEPTH + WIDTH;

/// Entries are `entry distance << 32 | child`. Distances are not negative, so their bits sort as they do.
pub(crate) struct Stack {
    entries: [MaybeUninit<u64>; CAPACITY],
    len: usize,
}

impl Stack {
    #[inline(always)]
    pub fn new() -> Self {
        // Clearing 4 KiB would cost as much as tracing a ray through a small scene.
        Self { entries: [const { MaybeUninit::uninit() }; CAPACITY], len: 0 }
    }

    #[inline(always)]
    pub fn len(&self) -> usize {
        self.len
    }

    #[inline(always)]
    pub fn push(&mut self, entry: u64) {
        self.entries[self.len].write(entry);
        self.len += 1;
    }

    #[inline(always)]
    pub fn pop(&mut self) -> Option<u64> {
        if self.len == 0 {
            return None;
        }
        self.len -= 1;
        // SAFETY: `len` counts the entries written by `push` and `insert`, each of which writes the one it counts
        // before counting it; the index is below the capacity because those writes are bounds checked.
        Some(unsafe { self.entries.get_unchecked(self.len).assume_init() })
    }

    /// Inserts into the part above `base`, which is sorted with the smallest on top.
    #[inline(always)]
    pub fn insert(&mut self, base: usize, entry: u64) {
        assert!(self.len < CAPACITY);
        let mut i = self.len;
        while i > base {
            // SAFETY: `base < i <= len`, so `i - 1` was written by an earlier push or insert; `i <= len < CAPACITY`.
            let below = unsafe { self.entries.get_unchecked(i - 1).assume_init() };
            if below >= entry {
                break;
            }
            self.entries[i].write(below);
            i -= 1;
        }
        self.entries[i].write(entry);
        self.len += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inserts_sort_above_the_base_only() {
        let mut s = Stack::new();
        s.push(1);
        let base = s.len();
        for e in [5, 9, 2, 9, 7, 0] {
            s.insert(base, e);
        }
        let popped: Vec<u64> = std::iter::from_fn(|| s.pop()).collect();
        assert_eq!(popped, [0, 2, 5, 7, 9, 9, 1]);
    }
}
