//! Slides "Depth of field": rays from random points of a lens through a point in focus spread over a disc elsewhere.
#![expect(clippy::print_stdout, reason = "an example talks")]

use steradian_sampling::Rng;
use steradian_sampling::warp::square_to_uniform_disk_concentric;

fn main() {
    let (radius, focus) = (0.2, 4.0);
    let mut rng = Rng::new(1, 0);
    println!("distance  diameter  A |z - F| / z");
    for z in [2.0, 3.0, 4.0, 6.0, 12.0] {
        // A point at distance z on the axis is seen from each point of the lens in another place of the plane in focus.
        let n = 20_000;
        let square: f64 = (0..n)
            .map(|_| square_to_uniform_disk_concentric(rng.f32_2d()).map(|v| radius * f64::from(v)))
            .map(|lens| lens.map(|v| v * (1.0 - focus / z)))
            .map(|[x, y]| x * x + y * y)
            .sum::<f64>()
            / f64::from(n);
        // A disc of radius R has a mean square of R^2 / 2.
        println!("{z:8}  {:8.4}  {:13.4}", 2.0 * (2.0 * square).sqrt(), 2.0 * radius * (z - focus).abs() / z);
    }
}
