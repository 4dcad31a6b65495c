//! Points, vectors and normals: three meanings of a triple, kept apart because they transform differently.

use std::ops::{Add, AddAssign, Div, DivAssign, Index, IndexMut, Mul, MulAssign, Neg, Sub, SubAssign};

macro_rules! tuple_type {
    ($(#[$doc:meta])* $name:ident, $array:literal, $($field:ident : $i:literal),+) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, Default, PartialEq)]
        #[repr(C)]
        pub struct $name {
            $(#[doc = concat!("The ", stringify!($field), " coordinate.")] pub $field: f32,)+
        }
        impl $name {
            /// From coordinates.
            #[inline]
            pub const fn new($($field: f32),+) -> Self { Self { $($field),+ } }
            /// All coordinates equal.
            #[inline]
            pub const fn splat(v: f32) -> Self { Self { $($field: v),+ } }
            /// The coordinates as an array.
            #[inline]
            pub const fn to_array(self) -> [f32; $array] { [$(self.$field),+] }
            /// From an array of coordinates.
            #[inline]
            pub const fn from_array(a: [f32; $array]) -> Self { Self { $($field: a[$i]),+ } }
            /// Componentwise minimum.
            #[inline]
            pub fn min(self, o: Self) -> Self { Self { $($field: self.$field.min(o.$field)),+ } }
            /// Componentwise maximum.
            #[inline]
            pub fn max(self, o: Self) -> Self { Self { $($field: self.$field.max(o.$field)),+ } }
            /// Componentwise absolute value.
            #[inline]
            pub fn abs(self) -> Self { Self { $($field: self.$field.abs()),+ } }
            /// Whether every coordinate is finite.
            #[inline]
            pub fn is_finite(self) -> bool { $(self.$field.is_finite())&&+ }
            /// The smallest coordinate.
            #[inline]
            pub fn min_component(self) -> f32 { f32::INFINITY$(.min(self.$field))+ }
            /// The largest coordinate.
            #[inline]
            pub fn max_component(self) -> f32 { f32::NEG_INFINITY$(.max(self.$field))+ }
            /// Linear interpolation from `self` to `o`.
            #[inline]
            pub fn lerp(self, o: Self, t: f32) -> Self { Self { $($field: crate::lerp(t, self.$field, o.$field)),+ } }
        }
        impl From<[f32; $array]> for $name {
            #[inline]
            fn from(a: [f32; $array]) -> Self { Self::from_array(a) }
        }
        impl Index<usize> for $name {
            type Output = f32;
            #[inline]
            fn index(&self, i: usize) -> &f32 {
                match i { $($i => &self.$field,)+ _ => panic!("index {i} of {}", stringify!($name)) }
            }
        }
        impl IndexMut<usize> for $name {
            #[inline]
            fn index_mut(&mut self, i: usize) -> &mut f32 {
                match i { $($i => &mut self.$field,)+ _ => panic!("index {i} of {}", stringify!($name)) }
            }
        }
        impl Mul<f32> for $name {
            type Output = Self;
            #[inline]
            fn mul(self, s: f32) -> Self { Self { $($field: self.$field * s),+ } }
        }
        impl Mul<$name> for f32 {
            type Output = $name;
            #[inline]
            fn mul(self, v: $name) -> $name { v * self }
        }
        impl MulAssign<f32> for $name {
            #[inline]
            fn mul_assign(&mut self, s: f32) { *self = *self * s; }
        }
        impl Div<f32> for $name {
            type Output = Self;
            #[inline]
            fn div(self, s: f32) -> Self { Self { $($field: self.$field / s),+ } }
        }
        impl DivAssign<f32> for $name {
            #[inline]
            fn div_assign(&mut self, s: f32) { *self = *self / s; }
        }
        impl Neg for $name {
            type Output = Self;
            #[inline]
            fn neg(self) -> Self { Self { $($field: -self.$field),+ } }
        }
    };
}

macro_rules! sum {
    ($a:ident + $b:ident = $c:ident, $($field:ident),+) => {
        impl Add<$b> for $a {
            type Output = $c;
            #[inline]
            fn add(self, o: $b) -> $c { $c { $($field: self.$field + o.$field),+ } }
        }
    };
    ($a:ident - $b:ident = $c:ident, $($field:ident),+) => {
        impl Sub<$b> for $a {
            type Output = $c;
            #[inline]
            fn sub(self, o: $b) -> $c { $c { $($field: self.$field - o.$field),+ } }
        }
    };
    ($a:ident += $b:ident) => {
        impl AddAssign<$b> for $a {
            #[inline]
            fn add_assign(&mut self, o: $b) { *self = *self + o; }
        }
        impl SubAssign<$b> for $a {
            #[inline]
            fn sub_assign(&mut self, o: $b) { *self = *self - o; }
        }
    };
}

tuple_type!(
    /// A direction or displacement in the plane.
    Vec2, 2, x: 0, y: 1);
tuple_type!(
    /// A position in the plane.
    Point2, 2, x: 0, y: 1);
tuple_type!(
    /// A direction or displacement in space.
    Vec3, 3, x: 0, y: 1, z: 2);
tuple_type!(
    /// A position in space.
    Point3, 3, x: 0, y: 1, z: 2);
tuple_type!(
    /// A surface normal: transforms by the inverse transpose. Not necessarily of unit length.
    Normal3, 3, x: 0, y: 1, z: 2);

sum!(Vec2 + Vec2 = Vec2, x, y);
sum!(Vec2 - Vec2 = Vec2, x, y);
sum!(Vec2 += Vec2);
sum!(Point2 + Vec2 = Point2, x, y);
sum!(Point2 - Vec2 = Point2, x, y);
sum!(Point2 - Point2 = Vec2, x, y);
sum!(Point2 + Point2 = Point2, x, y);
sum!(Point2 += Vec2);
sum!(Vec3 + Vec3 = Vec3, x, y, z);
sum!(Vec3 - Vec3 = Vec3, x, y, z);
sum!(Vec3 += Vec3);
sum!(Point3 + Vec3 = Point3, x, y, z);
sum!(Point3 - Vec3 = Point3, x, y, z);
sum!(Point3 - Point3 = Vec3, x, y, z);
// Affine combinations (weights that add up to one) are written as sums of scaled points.
sum!(Point3 + Point3 = Point3, x, y, z);
sum!(Point3 += Vec3);
sum!(Normal3 + Normal3 = Normal3, x, y, z);
sum!(Normal3 - Normal3 = Normal3, x, y, z);
sum!(Normal3 += Normal3);

macro_rules! metric3 {
    ($name:ident) => {
        impl $name {
            /// The squared Euclidean length.
            #[inline(always)]
            pub fn length_squared(self) -> f32 {
                self.x * self.x + self.y * self.y + self.z * self.z
            }
            /// The Euclidean length.
            #[inline(always)]
            pub fn length(self) -> f32 {
                self.length_squared().sqrt()
            }
            /// Scaled to unit length; not finite for a null vector.
            #[inline(always)]
            pub fn normalize(self) -> Self {
                self * (1.0 / self.length())
            }
            /// Scaled to unit length, or `None` for a null or non-finite vector.
            #[inline(always)]
            pub fn try_normalize(self) -> Option<Self> {
                let l = self.length();
                (l > 0.0 && l < f32::INFINITY).then(|| self / l)
            }
            /// The scalar product with a vector.
            #[inline(always)]
            pub fn dot(self, o: impl Into<Vec3>) -> f32 {
                let o = o.into();
                self.x * o.x + self.y * o.y + self.z * o.z
            }
            /// The absolute value of the scalar product.
            #[inline(always)]
            pub fn abs_dot(self, o: impl Into<Vec3>) -> f32 {
                self.dot(o).abs()
            }
            /// The vector product (right handed).
            #[inline(always)]
            pub fn cross(self, o: impl Into<Vec3>) -> Vec3 {
                let o = o.into();
                Vec3 {
                    x: crate::difference_of_products(self.y, o.z, self.z, o.y),
                    y: crate::difference_of_products(self.z, o.x, self.x, o.z),
                    z: crate::difference_of_products(self.x, o.y, self.y, o.x),
                }
            }
            /// `self` or its negative, whichever lies in the hemisphere of `o`.
            #[inline(always)]
            pub fn face_forward(self, o: impl Into<Vec3>) -> Self {
                if self.dot(o) < 0.0 { -self } else { self }
            }
        }
    };
}
metric3!(Vec3);
metric3!(Normal3);

impl From<Normal3> for Vec3 {
    #[inline]
    fn from(n: Normal3) -> Vec3 {
        n.to_vec()
    }
}

impl From<Point3> for Vec3 {
    #[inline]
    fn from(p: Point3) -> Vec3 {
        p.to_vec()
    }
}

impl Vec3 {
    /// Reinterpreted as a normal.
    #[inline]
    pub const fn to_normal(self) -> Normal3 {
        Normal3::new(self.x, self.y, self.z)
    }
    /// Reinterpreted as the point at this displacement from the origin.
    #[inline]
    pub const fn to_point(self) -> Point3 {
        Point3::new(self.x, self.y, self.z)
    }
    /// The unit vector of angle `theta` from +z and azimuth `phi`.
    #[inline]
    pub fn spherical(sin_theta: f32, cos_theta: f32, phi: f32) -> Vec3 {
        let (s, c) = crate::sin_cos(phi);
        Vec3::new(sin_theta.clamp(-1.0, 1.0) * c, sin_theta.clamp(-1.0, 1.0) * s, cos_theta.clamp(-1.0, 1.0))
    }
    /// The angle between two unit vectors, accurate near 0 and pi.
    #[inline]
    pub fn angle_between(self, o: Vec3) -> f32 {
        if self.dot(o) < 0.0 {
            crate::PI - 2.0 * crate::safe_asin((self + o).length() * 0.5)
        } else {
            2.0 * crate::safe_asin((o - self).length() * 0.5)
        }
    }
}

impl Normal3 {
    /// Reinterpreted as a vector.
    #[inline]
    pub const fn to_vec(self) -> Vec3 {
        Vec3::new(self.x, self.y, self.z)
    }
}

impl Point3 {
    /// The displacement from the origin.
    #[inline]
    pub const fn to_vec(self) -> Vec3 {
        Vec3::new(self.x, self.y, self.z)
    }
    /// The distance to another point.
    #[inline]
    pub fn distance(self, o: Point3) -> f32 {
        (self - o).length()
    }
    /// The squared distance to another point.
    #[inline]
    pub fn distance_squared(self, o: Point3) -> f32 {
        (self - o).length_squared()
    }
}

impl Vec2 {
    /// The squared Euclidean length.
    #[inline]
    pub fn length_squared(self) -> f32 {
        self.x * self.x + self.y * self.y
    }
    /// The Euclidean length.
    #[inline]
    pub fn length(self) -> f32 {
        self.length_squared().sqrt()
    }
    /// The scalar product.
    #[inline]
    pub fn dot(self, o: Vec2) -> f32 {
        self.x * o.x + self.y * o.y
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn products() {
        let (a, b) = (Vec3::new(1.0, 2.0, 3.0), Vec3::new(-2.0, 0.5, 4.0));
        let c = a.cross(b);
        assert_eq!(c, Vec3::new(6.5, -10.0, 4.5));
        assert_eq!(c.dot(a), 0.0);
        assert_eq!(c.dot(b), 0.0);
        assert_eq!(Normal3::new(0.0, 0.0, 1.0).face_forward(Vec3::new(0.0, 0.0, -1.0)).z, -1.0);
    }

    #[test]
    fn angle_is_accurate_when_tiny() {
        let a = Vec3::new(1.0, 0.0, 0.0);
        let b = Vec3::new(1.0, 1e-4, 0.0).normalize();
        assert!((a.angle_between(b) - 1e-4).abs() < 1e-9);
        assert!((a.angle_between(-b) - (crate::PI - 1e-4)).abs() < 1e-6);
    }
}
