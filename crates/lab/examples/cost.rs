//! Slide "Naively improving Whitted ray tracing": the number of intersection tests by the recursion, and along paths.
#![expect(clippy::print_stdout, reason = "an example talks")]

fn main() {
    let (n, m, k, a, l, s, r) = (1e6f64, 1e3f64, 8.0f64, 8.0f64, 4.0f64, 8.0f64, 8.0f64);
    println!("d  brute force  1000 paths for each pixel");
    let mut rays = 0.0;
    for d in 1..=8 {
        // One ray, l s^2 shadow rays, and r^2 rays on with the same below them.
        rays = 1.0 + l * s * s + if d > 1 { r * r * rays } else { 0.0 };
        println!("{d}  {:11.2e}  {:.2e}", n * m * m * k * k * a * a * rays, n * m * m * 1e3 * 2.0 * f64::from(d));
    }
    println!("the slide's 64e18 is one level: {:.2e}", n * m * m * k * k * a * a * r * r * l * s * s);
}
