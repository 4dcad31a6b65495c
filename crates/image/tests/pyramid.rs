//! Texture look-ups: what is derived by hand, and that filtering neither adds nor loses light.

use steradian_image::{Encoding, Lookup, Pyramid, Storage, Texels, Wrap};
use steradian_math::{Point2, Vec2};

const FILTERS: [Lookup; 4] = [Lookup::Point, Lookup::Bilinear, Lookup::Trilinear, Lookup::Ewa { max_anisotropy: 8.0 }];

fn floats(width: usize, height: usize, channels: usize, f: impl Fn(usize, usize, usize) -> f32) -> Texels {
    let n = width * height * channels;
    let samples = (0..n).map(|i| f(i / channels % width, i / channels / width, i % channels)).collect();
    Texels::new(width, height, channels, Storage::F32(samples), Encoding::Linear).unwrap()
}

fn pyramid(texels: Texels, wrap: Wrap) -> Pyramid {
    Pyramid::new(texels, [wrap; 2]).unwrap()
}

#[test]
fn point_and_bilinear_by_hand() {
    let p = pyramid(floats(2, 2, 1, |x, y, _| (1 + x + 2 * y) as f32), Wrap::Repeat);
    let tiny = Vec2::new(1e-4, 0.0);
    let at = |x, y, f| p.lookup1(Point2::new(x, y), tiny, Vec2::new(0.0, 1e-4), f);
    assert_eq!(at(0.1, 0.1, Lookup::Point), 1.0);
    assert_eq!(at(0.9, 0.1, Lookup::Point), 2.0);
    assert_eq!(at(0.1, 0.9, Lookup::Point), 3.0);
    assert_eq!(at(1.9, -0.1, Lookup::Point), 4.0);
    assert_eq!(at(0.25, 0.25, Lookup::Bilinear), 1.0);
    assert_eq!(at(0.5, 0.25, Lookup::Bilinear), 1.5);
    assert_eq!(at(0.5, 0.5, Lookup::Bilinear), 2.5);
    // Across the seam, half of each side.
    assert_eq!(at(0.0, 0.25, Lookup::Bilinear), 1.5);
}

#[test]
fn wrap_modes() {
    let tiny = Vec2::new(1e-6, 1e-6);
    let value = |wrap, x, y| {
        let p = pyramid(floats(4, 4, 1, |x, y, _| (1 + x + 4 * y) as f32), wrap);
        p.lookup1(Point2::new(x, y), tiny, tiny, Lookup::Point)
    };
    assert_eq!(value(Wrap::Repeat, -0.1, 0.1), 4.0);
    assert_eq!(value(Wrap::Clamp, -0.9, 0.1), 1.0);
    assert_eq!(value(Wrap::Black, -0.1, 0.1), 0.0);
    // Leaving an octahedral map to the left in the first row comes back in at the left in the last row.
    assert_eq!(value(Wrap::Octahedral, -0.1, 0.1), 13.0);
    assert_eq!(value(Wrap::Octahedral, 1.1, 0.4), 12.0);
    assert_eq!(value(Wrap::Octahedral, 0.1, -0.1), 4.0);
    assert_eq!(value(Wrap::Octahedral, 0.4, 1.1), 15.0);
    assert_eq!(value(Wrap::Octahedral, -0.1, -0.1), 16.0);
    let odd = floats(4, 4, 1, |_, _, _| 1.0);
    assert!(Pyramid::new(odd, [Wrap::Octahedral, Wrap::Repeat]).is_err());
}

#[test]
fn a_constant_comes_out_of_every_filter_at_every_size() {
    for (w, h) in [(1, 1), (16, 16), (5, 7), (1, 9)] {
        for n in 1..=4 {
            let p = pyramid(floats(w, h, n, |_, _, c| 0.5 + c as f32), Wrap::Repeat);
            for filter in FILTERS {
                for size in [0.0, 1e-6, 0.01, 0.3, 1.0, 7.0, 1e6] {
                    let (d0, d1) = (Vec2::new(size, 0.3 * size), Vec2::new(-0.1 * size, 0.2 * size));
                    let got = p.lookup3(Point2::new(0.37, -3.21), d0, d1, filter);
                    for (c, v) in got.into_iter().enumerate() {
                        let want = 0.5 + if n < 3 { 0.0 } else { c as f32 };
                        assert!((v - want).abs() < 1e-5 * want, "{w}x{h}x{n} {filter:?} {size}: {v} for {want}");
                    }
                }
            }
        }
    }
}

#[test]
fn a_wide_footprint_gives_the_mean_where_it_is_looked_at() {
    let p = pyramid(floats(8, 8, 3, |x, y, c| if (x + y + c) % 2 == 0 { 1.0 } else { 0.0 }), Wrap::Repeat);
    let at = |size, filter| p.lookup3(Point2::new(0.2, 0.7), Vec2::new(size, 0.0), Vec2::new(0.0, size), filter);
    for filter in &FILTERS[2..] {
        let v = at(2.0, *filter);
        assert!(v.iter().all(|v| (v - 0.5).abs() < 1e-6), "{filter:?} {v:?}");
    }
    for filter in &FILTERS[..2] {
        assert_eq!(at(2.0, *filter), at(0.0, *filter));
    }
}

#[test]
fn the_ellipse_follows_its_long_axis() {
    // Stripes along x: blur along x keeps them, blur along y removes them.
    let p = pyramid(floats(64, 64, 1, |_, y, _| (y % 2) as f32), Wrap::Repeat);
    let filter = Lookup::Ewa { max_anisotropy: 16.0 };
    let at = Point2::new(0.5, 10.5 / 64.0);
    let (far, near) = (0.1, 0.3 / 64.0);
    let along = p.lookup1(at, Vec2::new(far, 0.0), Vec2::new(0.0, near), filter);
    let across = p.lookup1(at, Vec2::new(near, 0.0), Vec2::new(0.0, far), filter);
    assert!(along < 0.35, "{along}");
    assert!((across - 0.5).abs() < 0.03, "{across}");
}

#[test]
fn eight_bits_stay_eight_bits() {
    let codes: Vec<u8> = (0..8 * 8 * 3).map(|i| (i * 5 % 256) as u8).collect();
    let texels = Texels::new(8, 8, 3, Storage::U8(codes.clone()), Encoding::Srgb).unwrap();
    let p = pyramid(texels, Wrap::Repeat);
    assert_eq!(p.level(0).storage(), &Storage::U8(codes));
    assert_eq!(p.bytes(), 3 * (64 + 16 + 4 + 1));
    assert_eq!(p.levels(), 4);
}

#[test]
fn opaque_alpha_is_dropped_and_real_alpha_is_kept() {
    let p = pyramid(floats(4, 4, 4, |_, _, _| 1.0), Wrap::Repeat);
    assert_eq!(p.channels(), 3);
    let p = pyramid(floats(4, 4, 4, |x, _, c| if c == 3 && x > 1 { 0.0 } else { 1.0 }), Wrap::Repeat);
    let tiny = Vec2::new(1e-6, 1e-6);
    assert_eq!(p.lookup1(Point2::new(0.9, 0.5), tiny, tiny, Lookup::Point), 0.0);
    assert_eq!(p.lookup4(Point2::new(0.1, 0.5), tiny, tiny, Lookup::Point), [1.0; 4]);
}

#[test]
fn odd_sizes_are_enlarged_without_changing_the_mean() {
    let f = |x: usize, y: usize, _: usize| ((x * 3 + y * 5) % 7) as f32;
    let mean = (0..15 * 13).map(|i| f(i % 15, i / 15, 0)).sum::<f32>() / (15.0 * 13.0);
    let p = pyramid(floats(15, 13, 1, f), Wrap::Repeat);
    assert_eq!((p.level(0).width(), p.level(0).height(), p.levels()), (16, 16, 5));
    assert!((p.level(4).texel(0, 0, 0) / mean - 1.0).abs() < 0.02);
}

#[test]
fn undefined_footprints_still_give_a_number() {
    let p = pyramid(floats(16, 16, 1, |x, _, _| x as f32), Wrap::Repeat);
    let odd = [f32::NAN, f32::INFINITY, -f32::INFINITY, 1e30, 1e-40, 0.0];
    for filter in FILTERS.into_iter().chain([Lookup::Ewa { max_anisotropy: f32::INFINITY }]) {
        for a in odd {
            for b in odd {
                let v = p.lookup1(Point2::new(a, 0.3), Vec2::new(b, a), Vec2::new(0.01, b), filter);
                assert!((0.0..=15.0).contains(&v), "{filter:?} {a} {b}: {v}");
            }
        }
    }
}
