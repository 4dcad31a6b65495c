//! Slides "Aliasing and anti-aliasing in rendering": a pixel crossed by an edge, by k x k rays.
#![expect(clippy::print_stdout, reason = "an example talks")]

use steradian_sampling::Rng;

fn main() {
    // White below the line y = 0.3 + 0.5 x: the exact average is 0.3 + 0.25.
    let white = |x: f64, y: f64| f64::from(y < 0.3 + 0.5 * x);
    let exact = 0.55;
    let mut rng = Rng::new(1, 0);
    println!("  k  regular error  jittered error (rms of 1000)");
    for k in [1u32, 2, 4, 8, 16] {
        let average = |mut place: Box<dyn FnMut() -> f64 + '_>| {
            let mut sum = 0.0;
            for cell in 0..k * k {
                let x = (f64::from(cell % k) + place()) / f64::from(k);
                let y = (f64::from(cell / k) + place()) / f64::from(k);
                sum += white(x, y);
            }
            sum / f64::from(k * k)
        };
        let regular = average(Box::new(|| 0.5)) - exact;
        let square: f64 = (0..1000).map(|_| average(Box::new(|| rng.f64())) - exact).map(|e| e * e).sum();
        println!("{k:3}  {regular:13.5}  {:14.5}", (square / 1000.0).sqrt());
    }
}
