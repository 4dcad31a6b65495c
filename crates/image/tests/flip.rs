//! FLIP against its authors' own evaluator (flip-evaluator 1.7), on images that both can make from integers.

use steradian_image::{FlipSettings, Image, flip_hdr, flip_ldr};

const W: usize = 48;
const H: usize = 32;

fn pair() -> (Vec<[f32; 3]>, Vec<[f32; 3]>) {
    let base = |x: usize, y: usize, c: usize| ((x * 7 + y * 13 + c * 29 + ((x * y) % 11) * 5) % 64) as f32 / 64.0;
    let mut reference = Vec::new();
    let mut test = Vec::new();
    for y in 0..H {
        for x in 0..W {
            let r: [f32; 3] = std::array::from_fn(|c| {
                0.5 * (x + 2 * y + 9 * c) as f32 / (W + 2 * H + 18) as f32 + 0.5 * base(x / 4, y / 4, c)
            });
            let t = std::array::from_fn(|c| {
                let mut t = r[c];
                if (10..20).contains(&x) && (8..16).contains(&y) {
                    t = 1.0 - t;
                }
                if x >= 30 && c == 1 {
                    t *= 0.8;
                }
                if (x * 5 + y * 3) % 17 == 0 {
                    t = (t + 0.3).min(1.0);
                }
                t
            });
            reference.push(r);
            test.push(t);
        }
    }
    (reference, test)
}

fn image(p: &[[f32; 3]]) -> Image {
    Image::from_rgb(W, H, p).unwrap()
}

fn mean(v: &[f32]) -> f32 {
    v.iter().sum::<f32>() / v.len() as f32
}

const PLACES: [(usize, usize); 5] = [(0, 0), (15, 12), (40, 20), (47, 31), (9, 8)];

fn assert_places(map: &[f32], want: [f32; 5]) {
    for ((x, y), want) in PLACES.into_iter().zip(want) {
        let v = map[y * W + x];
        assert!((v - want).abs() < 2e-4, "{x}, {y}: {v} for {want}");
    }
}

#[test]
fn low_dynamic_range() {
    let (r, t) = pair();
    let map = flip_ldr(&image(&r), &image(&t), &FlipSettings::default()).unwrap();
    assert!((mean(&map) - 0.249_563_34).abs() < 1e-4, "{}", mean(&map));
    assert_places(&map, [0.476_782_08, 0.623_8, 0.352_382_48, 0.303_820_82, 0.417_743_5]);
    let closer = FlipSettings { pixels_per_degree: 30.0 };
    let map = flip_ldr(&image(&r), &image(&t), &closer).unwrap();
    assert!((mean(&map) - 0.246_290_56).abs() < 1e-4, "{}", mean(&map));
}

#[test]
fn high_dynamic_range() {
    let (r, t) = pair();
    let brighten = |p: Vec<[f32; 3]>| p.into_iter().map(|p| p.map(|v| v * v * v * v * 50.0 + 0.01)).collect::<Vec<_>>();
    let map = flip_hdr(&image(&brighten(r)), &image(&brighten(t)), &FlipSettings::default()).unwrap();
    assert!((mean(&map) - 0.431_195_1).abs() < 3e-4, "{}", mean(&map));
    assert_places(&map, [0.960_309_5, 0.905_189_75, 0.526_715_3, 0.584_200_5, 0.689_479_7]);
}

#[test]
fn the_same_image_does_not_flip_and_black_is_no_trap() {
    let (r, _) = pair();
    assert_eq!(flip_ldr(&image(&r), &image(&r), &FlipSettings::default()).unwrap(), vec![0.0; W * H]);
    let black = image(&vec![[0.0; 3]; W * H]);
    for map in
        [flip_hdr(&black, &black, &FlipSettings::default()), flip_hdr(&black, &image(&r), &FlipSettings::default())]
    {
        assert!(map.unwrap().iter().all(|v| (0.0..=1.0).contains(v)));
    }
    assert!(flip_ldr(&black, &black, &FlipSettings { pixels_per_degree: f32::NAN }).is_err());
}
