//! Slide "Motion blur": a box crosses a row of pixels while the shutter is open; every ray has a time of its own.
#![expect(clippy::print_stdout, reason = "an example talks")]

use steradian_sampling::Rng;

fn main() {
    // The box covers [0, 2] at first and moves by 6 pixels.
    let rays = 4_000;
    let mut rng = Rng::new(1, 0);
    for pixel in 0..8 {
        let left = f64::from(pixel);
        let hits = (0..rays)
            .filter(|_| {
                let (x, time) = (left + rng.f64(), rng.f64());
                (0.0..2.0).contains(&(x - 6.0 * time))
            })
            .count();
        // Exactly: the share of the time at which a point is covered, averaged over the pixel.
        let covered = |x: f64| ((x / 6.0).min(1.0) - ((x - 2.0) / 6.0).max(0.0)).max(0.0);
        let exact = (0..1_000).map(|i| covered(left + (f64::from(i) + 0.5) / 1e3)).sum::<f64>() / 1e3;
        println!("pixel {pixel}: {:.4}, exactly {exact:.4}", f64::from(hits as u32) / f64::from(rays));
    }
}
