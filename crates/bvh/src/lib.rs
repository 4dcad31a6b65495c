//! An 8-wide bounding volume hierarchy over boxes; the leaf test is a closure.
