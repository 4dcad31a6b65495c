//! Damaged and malicious files are errors: never a panic, never a large allocation.

use std::time::{Duration, Instant};

use steradian_image::{Attribute, Error, Format, Image, Limits, WriteOptions, encode, read, read_limited, read_texels};

const FORMATS: [(Format, &str); 5] = [
    (Format::Exr, "a.exr"),
    (Format::Png, "a.png"),
    (Format::Jpeg, "a.jpg"),
    (Format::Hdr, "a.hdr"),
    (Format::Pfm, "a.pfm"),
];

fn good(format: Format) -> Vec<u8> {
    let pixels: Vec<_> = (0..24 * 10).map(|i| [i as f32 / 240.0, (i % 7) as f32, 0.5]).collect();
    encode(&Image::from_rgb(24, 10, &pixels).unwrap(), format, "a", &WriteOptions::default()).unwrap()
}

fn other_formats() -> Vec<(Vec<u8>, &'static str)> {
    let buffer = image::RgbImage::from_fn(9, 5, |x, y| image::Rgb([x as u8 * 20, y as u8 * 40, 7]));
    let kinds = [
        (image::ImageFormat::Tga, "a.tga"),
        (image::ImageFormat::Bmp, "a.bmp"),
        (image::ImageFormat::Qoi, "a.qoi"),
        (image::ImageFormat::WebP, "lossless.webp"),
    ];
    kinds
        .map(|(format, name)| {
            let mut file = std::io::Cursor::new(Vec::new());
            buffer.write_to(&mut file, format).unwrap();
            (file.into_inner(), name)
        })
        .to_vec()
}

fn all() -> Vec<(Vec<u8>, &'static str)> {
    let lossy = (include_bytes!("data/lossy.webp").to_vec(), "lossy.webp");
    FORMATS.iter().map(|&(f, n)| (good(f), n)).chain(other_formats()).chain([lossy]).collect()
}

#[test]
fn no_truncation_panics() {
    for (file, name) in all() {
        assert!(read(&file, name).is_ok(), "{name}");
        let mut refused = 0;
        for len in 0..file.len() {
            refused += usize::from(read(&file[..len], name).is_err());
        }
        // Some decoders forgive missing trailers, and JPEG by design shows what it has.
        let least = if name == "a.jpg" { file.len() / 4 } else { file.len() * 8 / 10 };
        assert!(refused >= least, "{name}: {refused} of {}", file.len());
    }
}

#[test]
fn no_flipped_byte_panics() {
    for (file, name) in all() {
        let step = (file.len() / 400).max(1);
        for at in (0..file.len().min(800)).chain((800..file.len()).step_by(step)) {
            for value in [0, 0x7f, 0x80, 0xff, file[at] ^ 1] {
                let mut damaged = file.clone();
                damaged[at] = value;
                if let Ok(image) = read(&damaged, name) {
                    assert!(image.width() * image.height() > 0);
                }
                // Whether it is an error depends on the byte; that it returns is the claim.
                let _ = read_texels(&damaged, name, None);
            }
        }
    }
}

/// Whatever a file says about itself, and however: read and written again, or an error. FUZZ_ROUNDS asks for more.
#[test]
fn descriptions_that_lie_are_survived() {
    let mut image = Image::from_rgb(6, 5, &[[0.5; 3]; 30]).unwrap();
    image.metadata.origin = [3, 4];
    let text = "--spp 4 --size 6x5 --crop 0,1,0,1";
    for (name, value) in [
        ("steradian.options", Attribute::Text(text.into())),
        ("steradian.nominalSpp", Attribute::Int(7)),
        ("steradian.errorBound", Attribute::Float(0.25)),
        ("worldToCamera", Attribute::M44f([0.5; 16])),
        ("names", Attribute::TextList(vec!["a".into(), "bc".into()])),
    ] {
        image.metadata.set(name, value);
    }
    let file = encode(&image, Format::Exr, "a", &WriteOptions::default()).unwrap();
    let header = file.windows(text.len()).position(|w| w == text.as_bytes()).unwrap() + 300;
    let rounds = std::env::var("FUZZ_ROUNDS").ok().and_then(|n| n.parse().ok()).unwrap_or(6_000u64);
    let mut state = 7u64;
    let mut next = |n: usize| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize % n
    };
    let (mut read_again, mut refused) = (0, 0);
    for _ in 0..rounds {
        let mut damaged = file.clone();
        for _ in 0..=next(3) {
            let at = next(header.min(damaged.len()));
            damaged[at] = [0, 1, 0x7f, 0x80, 0xff, next(256) as u8][next(6)];
        }
        match read(&damaged, "a.exr") {
            Ok(image) => {
                read_again += 1;
                // What cannot be written, such as an empty name, is an error.
                if let Ok(again) = encode(&image, Format::Exr, "a", &WriteOptions::default()) {
                    read(&again, "a.exr").unwrap();
                }
            }
            Err(_) => refused += 1,
        }
    }
    assert!(read_again > 0 && refused > 0, "{read_again}, {refused}");
}

#[test]
fn huge_claims_are_refused_at_once() {
    let mut files: Vec<(Vec<u8>, &str)> = vec![
        (b"PF\n4000000000 4000000000\n-1.0\nxxxx".to_vec(), "a.pfm"),
        (b"Pf\n1000000 1000000\n1.0\nxxxx".to_vec(), "a.pfm"),
        (b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 4000000000 +X 4000000000\nxxxx".to_vec(), "a.hdr"),
        (b"#?RADIANCE\n\n-Y 100000 +X 100000\nxxxx".to_vec(), "a.hdr"),
    ];
    let mut qoi = b"qoif\xff\xff\xff\xff\xff\xff\xff\xff\x03\x00".to_vec();
    qoi.extend([0; 40]);
    files.push((qoi, "a.qoi"));
    files.push((png_of(100_000, 100_000), "a.png"));
    files.push((png_of(0x7fff_ffff, 0x7fff_ffff), "a.png"));
    // A lossless WebP that claims 16384 x 16384 pixels; what it takes is within the limit of nobody's file of 30 bytes.
    let mut webp = b"RIFF\x16\0\0\0WEBPVP8L\x0a\0\0\0\x2f\xff\xff\xff\x0f".to_vec();
    webp.extend([0; 5]);
    files.push((webp, "a.webp"));
    let mut tga = vec![0_u8; 18];
    (tga[2], tga[16]) = (2, 24);
    tga[12..16].fill(0xff);
    files.push((tga, "a.tga"));
    let mut exr = good(Format::Exr);
    // The data window's last column and row.
    let at = exr.windows(10).position(|w| w == b"dataWindow").unwrap() + 10 + 1 + 6 + 4 + 8;
    exr[at..at + 4].copy_from_slice(&1_000_000_i32.to_le_bytes());
    exr[at + 4..at + 8].copy_from_slice(&1_000_000_i32.to_le_bytes());
    files.push((exr, "a.exr"));
    for (file, name) in files {
        let start = Instant::now();
        let result = read(&file, name);
        assert!(result.is_err(), "{name}");
        assert!(start.elapsed() < Duration::from_secs(2), "{name} took {:?}", start.elapsed());
    }
}

/// A PNG header of this size with nothing behind it.
fn png_of(width: u32, height: u32) -> Vec<u8> {
    let mut chunk = b"IHDR".to_vec();
    chunk.extend(width.to_be_bytes());
    chunk.extend(height.to_be_bytes());
    chunk.extend([8, 2, 0, 0, 0]);
    let crc = !chunk.iter().fold(!0_u32, |crc, &b| {
        (0..8).fold(crc ^ u32::from(b), |c, _| if c & 1 == 1 { c >> 1 ^ 0xedb8_8320 } else { c >> 1 })
    });
    let mut file = b"\x89PNG\r\n\x1a\n\0\0\0\x0d".to_vec();
    file.extend(chunk);
    file.extend(crc.to_be_bytes());
    file.extend(b"\0\0\0\x01IDAT\0");
    file.extend([0; 16]);
    file
}

#[test]
fn the_limit_is_the_callers_and_the_error_says_how_much() {
    let pixels = vec![[0.5; 3]; 100 * 100];
    let file =
        encode(&Image::from_rgb(100, 100, &pixels).unwrap(), Format::Pfm, "a", &WriteOptions::default()).unwrap();
    let limits = Limits { max_bytes: 119_999, ..Limits::default() };
    match read_limited(&file, "big.pfm", limits) {
        Err(e @ Error::TooLarge { bytes: 120_000, .. }) => {
            assert_eq!(
                e.to_string(),
                "big.pfm: 100 x 100 pixels would take 120000 bytes, and the limit for this file is 119999"
            );
        }
        other => panic!("{other:?}"),
    }
    assert!(read_limited(&file, "big.pfm", Limits { max_bytes: 120_000, ..Limits::default() }).is_ok());
}
