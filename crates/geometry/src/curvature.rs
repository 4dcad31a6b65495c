//! Derivatives of the normal from those of the position: the Weingarten equations (PBRT 4th ed., 6.2.3).

use steradian_math::{Vec3, difference_of_products};

/// `dn/du` and `dn/dv` of the unit normal along `dpdu x dpdv`, from first and second derivatives of the position.
pub(crate) fn weingarten(dpdu: Vec3, dpdv: Vec3, duu: Vec3, duv: Vec3, dvv: Vec3) -> [Vec3; 2] {
    let (e1, f1, g1) = (dpdu.dot(dpdu), dpdu.dot(dpdv), dpdv.dot(dpdv));
    let n = dpdu.cross(dpdv).normalize();
    let (e2, f2, g2) = (n.dot(duu), n.dot(duv), n.dot(dvv));
    let det = difference_of_products(e1, g1, f1, f1);
    let inv = if det == 0.0 { 0.0 } else { 1.0 / det };
    [
        dpdu * ((f2 * f1 - e2 * g1) * inv) + dpdv * ((e2 * f1 - f2 * e1) * inv),
        dpdu * ((g2 * f1 - f2 * g1) * inv) + dpdv * ((f2 * f1 - g2 * e1) * inv),
    ]
}
