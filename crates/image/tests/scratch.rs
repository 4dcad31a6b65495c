//! Samples in a scratch file are the samples that were put there.

use half::f16;
use steradian_image::{Encoding, Pyramid, Scratch, Storage, Texels, Wrap};

#[test]
fn what_is_put_into_a_scratch_file_is_read_from_it() {
    let scratch = Scratch::new(tempfile::tempfile().unwrap());
    let n = 300 * 400 * 4;
    let code = |i: usize| (i * 7 + i / 251) as u8;
    let storages = [
        Storage::U8((0..n).map(code).collect()),
        Storage::F16((0..n).map(|i| f16::from_f32(i as f32 * 0.37 - 9.0)).collect()),
        Storage::F32((0..n).map(|i| (i as f32).sqrt() - 5.0).collect()),
    ];
    let kept: Vec<(Texels, Texels)> = storages
        .into_iter()
        .map(|s| {
            let texels = Texels::new(300, 400, 4, s, Encoding::Srgb).unwrap();
            let mapped = texels.clone().into_scratch(&scratch).unwrap();
            assert!(mapped.memory() == 0 && mapped.bytes() == texels.memory());
            (texels, mapped)
        })
        .collect();
    // Later entries have not moved earlier ones.
    for (texels, mapped) in &kept {
        for (i, c) in (0..n / 4).step_by(97).flat_map(|i| (0..4).map(move |c| (i * 4, c))) {
            assert_eq!(texels.value(i, c), mapped.value(i, c));
        }
        assert_eq!(texels.clone().truncated(3).storage(), mapped.clone().truncated(3).storage());
        let [a, b] = [texels, mapped].map(|t| Pyramid::new(t.clone(), [Wrap::Repeat; 2]).unwrap());
        let b = b.into_scratch(&scratch).unwrap();
        assert!(b.memory() < a.memory() / 10 && b.bytes() == a.bytes());
        for level in 0..a.levels() {
            assert_eq!(a.level(level).texel(0, 0, 1), b.level(level).texel(0, 0, 1));
        }
    }
}

#[test]
fn small_ones_stay_in_memory() {
    let scratch = Scratch::new(tempfile::tempfile().unwrap());
    let texels = Texels::new(2, 1, 1, Storage::U8(vec![1, 2]), Encoding::Linear).unwrap();
    assert_eq!(texels.clone().into_scratch(&scratch).unwrap().storage(), texels.storage());
}
