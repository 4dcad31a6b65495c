//! Typed 32-bit handles and the arenas that they index: a scene has no pointers and no lifetimes.

use std::marker::PhantomData;
use std::num::NonZeroU32;
use std::ops::{Index, IndexMut};

/// The index of a `T` in an [`Arena`]; `Option<Handle<T>>` is four bytes, too.
pub struct Handle<T> {
    plus_one: NonZeroU32,
    marker: PhantomData<fn() -> T>,
}

impl<T> Handle<T> {
    /// The handle of the element at `index`.
    ///
    /// # Panics
    /// If `index` is `u32::MAX` or more.
    pub fn from_index(index: usize) -> Self {
        let plus_one = u32::try_from(index + 1).ok().and_then(NonZeroU32::new);
        Self { plus_one: plus_one.unwrap_or_else(|| panic!("arena index {index} is too large")), marker: PhantomData }
    }

    /// The index.
    #[inline]
    pub fn index(self) -> usize {
        self.plus_one.get() as usize - 1
    }
}

// Derives would ask the same of `T`, which a handle does not hold.
impl<T> Clone for Handle<T> {
    fn clone(&self) -> Self {
        *self
    }
}
impl<T> Copy for Handle<T> {}
impl<T> PartialEq for Handle<T> {
    fn eq(&self, other: &Self) -> bool {
        self.plus_one == other.plus_one
    }
}
impl<T> Eq for Handle<T> {}
impl<T> std::fmt::Debug for Handle<T> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "#{}", self.index())
    }
}

/// A growing array that hands out typed handles.
#[derive(Clone, Debug)]
pub struct Arena<T> {
    items: Vec<T>,
}

impl<T> Default for Arena<T> {
    fn default() -> Self {
        Self { items: Vec::new() }
    }
}

impl<T> Arena<T> {
    /// Adds an element.
    pub fn push(&mut self, item: T) -> Handle<T> {
        self.items.push(item);
        Handle::from_index(self.items.len() - 1)
    }

    /// The number of elements.
    pub fn len(&self) -> usize {
        self.items.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.items.is_empty()
    }

    /// The elements in the order of their handles.
    pub fn iter(&self) -> std::slice::Iter<'_, T> {
        self.items.iter()
    }

    /// The handles in order.
    pub fn handles(&self) -> impl Iterator<Item = Handle<T>> + use<T> {
        (0..self.items.len()).map(Handle::from_index)
    }

    /// The elements as a slice.
    pub fn as_slice(&self) -> &[T] {
        &self.items
    }
}

impl<T> Index<Handle<T>> for Arena<T> {
    type Output = T;
    #[inline]
    fn index(&self, h: Handle<T>) -> &T {
        &self.items[h.index()]
    }
}

impl<T> IndexMut<Handle<T>> for Arena<T> {
    fn index_mut(&mut self, h: Handle<T>) -> &mut T {
        &mut self.items[h.index()]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_optional_handle_is_four_bytes() {
        assert_eq!(size_of::<Option<Handle<String>>>(), 4);
        let mut a = Arena::default();
        let h = a.push("x");
        assert_eq!((a[h], h.index(), a.len()), ("x", 0, 1));
    }
}
