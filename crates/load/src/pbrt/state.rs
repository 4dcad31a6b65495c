//! The graphics state: what a directive leaves behind for the next one, saved and restored by `AttributeBegin` and its kin.

use super::params::Inherited;
use std::rc::Rc;
use steradian_math::{AnimatedTransform, Transform};
use steradian_scene::{AreaLight, Handle, Material, Medium};
use steradian_spectrum::ColorSpace;
use steradian_syntax::Span;

/// Which later entities an `Attribute` directive is for.
pub(super) const TARGETS: [&str; 5] = ["shape", "light", "material", "medium", "texture"];
pub(super) const SHAPE: usize = 0;
pub(super) const LIGHT: usize = 1;
pub(super) const MATERIAL: usize = 2;
pub(super) const MEDIUM: usize = 3;
pub(super) const TEXTURE: usize = 4;

/// The transforms at the start and at the end of the motion.
pub(super) type Transforms = [Transform; 2];

/// The state. Cloned by every block, so that all that is large is shared.
#[derive(Clone)]
pub(super) struct State {
    /// World from object (or camera from world, before the camera).
    pub ctm: Transforms,
    /// Which of the two the transform directives change.
    pub active: [bool; 2],
    /// The times of the two.
    pub times: [f32; 2],
    pub reverse_orientation: bool,
    pub color_space: ColorSpace,
    pub inside: Option<Handle<Medium>>,
    pub outside: Option<Handle<Medium>>,
    /// Emission of the following shapes, and where it is declared.
    pub area_light: Option<Rc<(AreaLight, Span)>>,
    pub material: Handle<Material>,
    /// Parameters by target.
    pub inherited: [Rc<Vec<Inherited>>; 5],
}

impl State {
    /// The state at the start of a scene.
    pub fn new(material: Handle<Material>) -> State {
        State {
            ctm: [Transform::IDENTITY; 2],
            active: [true; 2],
            times: [0.0, 1.0],
            reverse_orientation: false,
            color_space: ColorSpace::Srgb,
            inside: None,
            outside: None,
            area_light: None,
            material,
            inherited: Default::default(),
        }
    }

    /// Whether the transform changes over time.
    pub fn is_animated(&self) -> bool {
        self.ctm[0].m != self.ctm[1].m
    }

    /// The transform over time.
    pub fn animated(&self) -> AnimatedTransform {
        AnimatedTransform::new(self.ctm[0], self.times[0], self.ctm[1], self.times[1])
    }

    /// Multiplies the active transforms from the right: `next` is applied to points before what is there.
    pub fn concat(&mut self, next: &Transform) {
        for (t, _) in self.ctm.iter_mut().zip(self.active).filter(|(_, active)| *active) {
            *t = t.mul(next);
        }
    }

    /// Replaces the active transforms.
    pub fn set(&mut self, to: &Transforms) {
        for i in (0..2).filter(|&i| self.active[i]) {
            self.ctm[i] = to[i];
        }
    }
}
