//! Weights of multiple importance sampling over all strategies that can make a path (Veach 1997, 10.2): the power
//! heuristic, with the true densities of all of them but for free flight in media, which is left out everywhere alike.
//!
//! A path `x0 .. xk` from light to camera has strategies by how many vertices come from the light's side. Strategy n has the
//! density `L(n) * product of the light's densities of x1 .. x(n-1) * product of the camera's densities of the rest`, where
//! `L` is the density of the light's end: one (it is among the rest) for none, that of light sampling at x1 for one, that
//! of emission for more. Ratios between neighbours are all that is needed; a Dirac factor cancels in them.

use super::vertex::Vertex;

/// What depends on the connection.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Connection {
    /// The light's end by light sampling from the next vertex, and by emission.
    pub light_end: [f32; 2],
    /// Whether the light can be hit by chance.
    pub is_hittable: bool,
    /// The camera path's last vertex and the one before, as made from the light's side.
    pub camera_reverse: [f32; 2],
    /// The light path's last vertex and the one before, as made from the camera's side.
    pub light_reverse: [f32; 2],
}

/// The weight of connecting two paths, among all strategies that could have made the same path. A light path of one vertex
/// is only looked at for its length.
pub(crate) fn weight(light: &[Vertex<'_>], camera: &[Vertex<'_>], connection: &Connection) -> f32 {
    let (s, t) = (light.len(), camera.len());
    if s + t == 2 {
        return 1.0;
    }
    let end = |n: usize| match n {
        0 => 1.0,
        1 => f64::from(connection.light_end[0]),
        _ => f64::from(connection.light_end[1]),
    };
    let own = end(s);
    if own <= 0.0 {
        return 0.0;
    }
    let mut sum = 1.0;
    let mut add = |ratio: f64| sum += ratio * ratio;

    // More vertices from the light.
    let mut ratio = 1.0 / own;
    for i in (1..t).rev() {
        let reverse = match t - i {
            1 => connection.camera_reverse[0],
            2 => connection.camera_reverse[1],
            _ => camera[i].pdf_reverse,
        };
        // The light's end has its own density.
        let is_end = s == 0 && i == t - 1;
        ratio *= quotient(if is_end { 1.0 } else { reverse }, camera[i].pdf);
        let connects = (i == t - 1 || !camera[i].is_dirac) && !camera[i - 1].is_dirac;
        if connects {
            add(ratio * end(s + t - i));
        }
    }

    // More vertices from the camera.
    let mut ratio = 1.0 / own;
    let reverse_of = |i: usize| match s - i {
        1 => connection.light_reverse[0],
        2 => connection.light_reverse[1],
        _ => light[i].pdf_reverse,
    };
    for i in (1..s).rev() {
        ratio *= quotient(reverse_of(i), light[i].pdf);
        let connects = (i == s - 1 || !light[i].is_dirac) && !light[i - 1].is_dirac;
        if connects {
            add(ratio * end(i));
        }
    }
    if s > 0 && connection.is_hittable {
        add(ratio * f64::from(reverse_of(0)));
    }
    (1.0 / sum) as f32
}

/// A ratio of densities; a vertex that cannot be made one way has none.
fn quotient(a: f32, b: f32) -> f64 {
    if b > 0.0 { f64::from(a) / f64::from(b) } else { 0.0 }
}
