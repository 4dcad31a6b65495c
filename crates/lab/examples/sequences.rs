//! The reading on careful sample placement: discrepancy of random, jittered and low-discrepancy points.
#![expect(clippy::print_stdout, reason = "an example talks")]

use steradian_sampling::Rng;
use steradian_sampling::rng::unit_f32;
use steradian_sampling::sequence::{halton, jittered_2d, sobol_02};
use steradian_sampling::statistics::star_discrepancy;

fn main() {
    println!("points  random   jittered  Halton   Sobol'");
    for side in [4u32, 8, 16, 32] {
        let n = side * side;
        let mut rng = Rng::new(1, 0);
        let random: Vec<_> = (0..n).map(|_| rng.f32_2d()).collect();
        let jittered: Vec<_> = (0..n).map(|i| jittered_2d(i, side, side, 1)).collect();
        let low: Vec<_> = (0..n).map(|i| [halton(u64::from(i), 0), halton(u64::from(i), 1)]).collect();
        let sobol: Vec<_> = (0..n).map(|i| sobol_02(i).map(unit_f32)).collect();
        let [a, b, c, d] = [random, jittered, low, sobol].map(|p| star_discrepancy(&p));
        println!("{n:6}  {a:.5}  {b:.5}   {c:.5}  {d:.5}");
    }
}
