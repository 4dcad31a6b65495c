//! Slides "Aliasing": a sinusoid beyond half the sampling rate gives the samples of a lower one.
#![expect(clippy::print_stdout, reason = "an example talks")]

use std::f64::consts::TAU;

fn main() {
    let rate: f64 = 10.0;
    println!("frequency  alias  largest difference of the samples");
    for frequency in [1.0, 4.0, 6.0, 9.0, 11.0, 23.0] {
        // The nearest multiple of the rate is taken away; what is left is at most half the rate.
        let alias: f64 = frequency - rate * (frequency / rate).round();
        let difference = (0..20)
            .map(|i| f64::from(i) / rate)
            .map(|x| ((TAU * frequency * x).cos() - (TAU * alias * x).cos()).abs())
            .fold(0.0, f64::max);
        println!("{frequency:9}  {:5}  {difference:.1e}", alias.abs());
    }
}
