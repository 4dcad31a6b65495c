//! Slide "Soft shadows": the share of a lamp that a point of the floor sees past an edge, by rays to random points of it.
#![expect(clippy::print_stdout, reason = "an example talks")]

use steradian_sampling::Rng;

fn main() {
    // A lamp 1 wide at height 4, an edge at height 1 that covers everything to the left: the penumbra is 1/3 wide.
    let (width, height, edge) = (1.0, 4.0, 1.0);
    println!("penumbra: {:.4} wide", width * edge / (height - edge));
    let mut rng = Rng::new(1, 0);
    for step in -5..=5 {
        let x = f64::from(step) * 0.05;
        let rays = 10_000;
        let seen = (0..rays)
            .filter(|_| {
                let lamp = width * (rng.f64() - 0.5);
                // Where the ray to the lamp passes the height of the edge.
                x + (lamp - x) * edge / height > 0.0
            })
            .count();
        let exact = (0.5 + x * (height - edge) / (width * edge)).clamp(0.0, 1.0);
        println!("x = {x:5.2}: sees {:.4} of the lamp, exactly {exact:.4}", seen as f64 / f64::from(rays));
    }
}
