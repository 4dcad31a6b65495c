//! Reading of files that the tests lay out byte by byte, whole and damaged.

use super::*;
use std::io::Write;
use steradian_math::Point3;

const UPPER: usize = 8256 + 8 * 32768;
const LOWER: usize = 1088 + 8 * 4096;
const ROOT_AT: usize = 672 + 64;
const UPPER_AT: usize = ROOT_AT + 64 + 32;
const LOWER_AT: usize = UPPER_AT + UPPER;
const LEAF_AT: usize = LOWER_AT + LOWER;
const SIZE: usize = LEAF_AT + 2144;

fn put(bytes: &mut [u8], at: usize, value: &[u8]) {
    bytes[at..at + value.len()].copy_from_slice(value);
}

/// A grid with one leaf at (-16, 8, 0)..(-9, 15, 7), whose values are their own index, and one tile of value 3 at
/// (-128, 0, 0)..(-121, 7, 7). Points are half a unit apart.
fn grid() -> Vec<u8> {
    let mut g = vec![0; SIZE];
    put(&mut g, 0, b"NanoVDB0");
    for i in 0..3 {
        put(&mut g, 296 + 36 + 16 * i, &2.0f32.to_le_bytes());
        put(&mut g, 560 + 8 * i, &(-100.0f64).to_le_bytes());
        put(&mut g, 584 + 8 * i, &100.0f64.to_le_bytes());
        put(&mut g, ROOT_AT + 4 * i, &[-128i32, 0, 0][i].to_le_bytes());
        put(&mut g, ROOT_AT + 12 + 4 * i, &[-9i32, 15, 7][i].to_le_bytes());
    }
    put(&mut g, 672 + 24, &64u64.to_le_bytes());
    put(&mut g, ROOT_AT + 24, &1u32.to_le_bytes());
    // The upper node that covers -4096..0 in x.
    let key = u64::from((-4096i32 as u32) >> 12) << 42;
    put(&mut g, ROOT_AT + 64, &key.to_le_bytes());
    put(&mut g, ROOT_AT + 72, &((UPPER_AT - ROOT_AT) as u64).to_le_bytes());
    // Its child at x = -128, which is number 31 of 32.
    let n = 31 * 32 * 32;
    g[UPPER_AT + 32 + 4096 + n / 8] |= 1 << (n % 8);
    put(&mut g, UPPER_AT + 8256 + 8 * n, &((LOWER_AT - UPPER_AT) as u64).to_le_bytes());
    put(&mut g, LOWER_AT + 1088, &3.0f32.to_le_bytes());
    // x = -16 is number 14 of 16, y = 8 is number 1.
    let n = 14 * 256 + 16;
    g[LOWER_AT + 32 + 512 + n / 8] |= 1 << (n % 8);
    put(&mut g, LOWER_AT + 1088 + 8 * n, &((LEAF_AT - LOWER_AT) as u64).to_le_bytes());
    for i in 0..512 {
        put(&mut g, LEAF_AT + 96 + 4 * i, &(i as f32).to_le_bytes());
    }
    g
}

fn file(grid: &[u8], codec: u16) -> Vec<u8> {
    let stored = if codec == 1 {
        let mut e = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::fast());
        e.write_all(grid).unwrap();
        let packed = e.finish().unwrap();
        [&(packed.len() as u64).to_le_bytes(), packed.as_slice()].concat()
    } else {
        grid.to_vec()
    };
    let mut f = b"NanoVDB0".to_vec();
    f.extend((32u32 << 21).to_le_bytes());
    f.extend(1u16.to_le_bytes());
    f.extend(codec.to_le_bytes());
    let mut d = [0; 176];
    put(&mut d, 0, &(grid.len() as u64).to_le_bytes());
    put(&mut d, 8, &(stored.len() as u64).to_le_bytes());
    put(&mut d, 32, &1u32.to_le_bytes());
    put(&mut d, 136, &8u32.to_le_bytes());
    put(&mut d, 168, &codec.to_le_bytes());
    f.extend(d);
    f.extend(b"density\0");
    f.extend(stored);
    f
}

#[test]
fn leaves_tiles_and_background_are_where_they_belong() {
    for codec in [0, 1] {
        let g = read_grid(&file(&grid(), codec), "density").unwrap().unwrap();
        assert_eq!(g.value([-16, 8, 0]), 0.0);
        assert_eq!(g.value([-16, 8, 5]), 5.0);
        assert_eq!(g.value([-15, 10, 7]), 64.0 + 16.0 + 7.0);
        assert_eq!((g.value([-128, 0, 0]), g.value([-121, 7, 7]), g.value([-120, 0, 0])), (3.0, 3.0, 0.0));
        assert_eq!(g.value([5000, 0, 0]), 0.0);
        // Between z = 4 and z = 5.
        assert_eq!(g.sample(Point3::new(-8.0, 4.0, 2.25)), 4.5);
    }
    assert_eq!(read_grid(&file(&grid(), 0), "flame"), Ok(None));
    // The grid of a second segment is found as well.
    let two = [file(&grid(), 1), file(&grid(), 0)].concat();
    assert_eq!(read_grid(&two, "flame"), Ok(None));
}

#[test]
fn damage_is_an_error() {
    let whole = file(&grid(), 0);
    assert_eq!(read_grid(b"OpenVDB", "density"), Err(NanoVdbError::NotNanoVdb));
    for cut in [10, 20, 100, 195, 300, 1000, 280_000, whole.len() - 1] {
        let e = read_grid(&whole[..cut], "density").unwrap_err();
        assert!(matches!(e, NanoVdbError::Truncated { .. }), "{cut} {e}");
    }
    let with = |at: usize, value: &[u8]| {
        let mut f = whole.clone();
        put(&mut f, at, value);
        read_grid(&f, "density").unwrap_err()
    };
    let data = 16 + 176 + 8;
    assert_eq!(with(8, &(31u32 << 21).to_le_bytes()), NanoVdbError::Version(31));
    assert_eq!(with(16 + 32, &[6]), NanoVdbError::ValueType { name: "density".into(), kind: 6 });
    assert_eq!(with(16 + 36, &[1]), NanoVdbError::Class { name: "density".into(), class: 1 });
    assert_eq!(with(16 + 168, &[2]), NanoVdbError::Codec { name: "density".into(), codec: 2 });
    assert!(matches!(with(data + 672 + 24, &[0xff; 8]), NanoVdbError::Tree(_)));
    assert!(matches!(with(data + ROOT_AT + 24, &[0xff; 4]), NanoVdbError::Truncated { .. }));
    // Two children of one node that are the same leaf.
    let mut twice = whole.clone();
    let n = 3;
    twice[data + LOWER_AT + 32 + 512] |= 1 << n;
    let child = ((LEAF_AT - LOWER_AT) as u64).to_le_bytes();
    put(&mut twice, data + LOWER_AT + 1088 + 8 * n, &child);
    assert!(read_grid(&twice, "density").is_ok());
    twice[data + LOWER_AT + 32 + 512..data + LOWER_AT + 32 + 1024].fill(0xff);
    for n in 0..4096 {
        put(&mut twice, data + LOWER_AT + 1088 + 8 * n, &child);
    }
    assert_eq!(read_grid(&twice, "density"), Err(NanoVdbError::Tree("it refers to more nodes than it has room for")));
    let far = with(data + ROOT_AT + 12, &i32::MAX.to_le_bytes());
    assert_eq!(far, NanoVdbError::Tree("its box is far too large for what it holds"));
    let mut zipped = file(&grid(), 1);
    let middle = zipped.len() / 2;
    zipped[middle..].fill(0x55);
    assert_eq!(read_grid(&zipped, "density"), Err(NanoVdbError::Unzip("density".into())));
}

#[test]
fn no_single_byte_makes_the_reader_panic() {
    let whole = file(&grid(), 0);
    let table = 16 + 176 + 8 + UPPER_AT + 40;
    for at in (0..table).step_by(3) {
        let mut f = whole.clone();
        f[at] ^= 0xff;
        // An error or another grid; the assertion is that it comes back.
        let _ = read_grid(&f, "density");
    }
}
