//! Every format survives the way to a file and back, and files are written whole or not at all.

use std::fs;

use steradian_image::{
    Attribute, Chromaticities, Compression, Encoding, Error, Format, Image, Operator, Precision, Storage, ToneMap,
    Window, WriteOptions, encode, exact_differences, read, read_texels, write_file,
};

/// A picture with smooth parts, edges, and values above 1.
fn picture(width: usize, height: usize) -> Image {
    let pixel = |i: usize| {
        let (x, y) = ((i % width) as f32 / width as f32, (i / width) as f32 / height as f32);
        [x, y * y * 3.0, if (x - 0.5) * (y - 0.5) > 0.0 { 0.25 } else { 12.5 * x }]
    };
    Image::from_rgb(width, height, &(0..width * height).map(pixel).collect::<Vec<_>>()).unwrap()
}

fn bytes(image: &Image, format: Format, options: &WriteOptions) -> Vec<u8> {
    encode(image, format, "test", options).unwrap()
}

fn full_exr() -> Image {
    let mut image = picture(37, 21);
    let n = 37 * 21;
    image.add("Variance.R", (0..n).map(|i| i as f32 * 1e-9).collect(), Precision::Float).unwrap();
    image.add("N.X", (0..n).map(|i| half::f16::from_f32(i as f32 * 0.01).to_f32()).collect(), Precision::Half).unwrap();
    image.add("id", (0..n).map(|i| i as f32).collect(), Precision::Uint).unwrap();
    image.channel_mut("R").unwrap()[..3].copy_from_slice(&[f32::NAN, f32::INFINITY, -0.0]);
    let m = &mut image.metadata;
    m.set("samplesPerPixel", Attribute::Int(256));
    m.set("scene", Attribute::Text("caf\u{e9} / box".into()));
    m.set("seconds", Attribute::Double(1.25));
    m.set("bias", Attribute::Float(-0.5));
    m.set("software", Attribute::Text("Steradian".into()));
    m.set("isoSpeed", Attribute::Float(100.0));
    m.set("worldToCamera", Attribute::M44f(std::array::from_fn(|i| i as f32)));
    m.set("cameraToWorld", Attribute::M44f(std::array::from_fn(|i| -(i as f32))));
    m.set("corner", Attribute::V2f([1.0, 2.0]));
    m.set("point", Attribute::V3f([1.0, 2.0, 3.0]));
    m.set("tile", Attribute::V2i([-1, 2]));
    m.set("options", Attribute::TextList(vec!["one".into(), "two".into()]));
    m.chromaticities = Some(Chromaticities { red: [0.7, 0.29], ..Chromaticities::SRGB });
    m.origin = [-5, 7];
    m.frame = Some(Window { x: -10, y: 0, width: 64, height: 48 });
    image
}

#[test]
fn exr_keeps_every_bit_and_attribute() {
    let image = full_exr();
    for compression in [Compression::Zip, Compression::Uncompressed] {
        let options = WriteOptions { compression, ..WriteOptions::default() };
        let file = bytes(&image, Format::Exr, &options);
        let back = read(&file, "a.exr").unwrap();
        assert_eq!(exact_differences(&image, &back), []);
        assert_eq!(back.metadata, image.metadata);
    }
}

#[test]
fn equal_images_make_equal_files() {
    let first = bytes(&full_exr(), Format::Exr, &WriteOptions::default());
    for _ in 0..8 {
        assert!(bytes(&full_exr(), Format::Exr, &WriteOptions::default()) == first);
    }
}

#[test]
fn exr_attributes_that_cannot_be_are_refused() {
    for (key, value) in [("channels", Attribute::Int(1)), ("", Attribute::Int(1)), ("owner", Attribute::Int(1))] {
        let mut image = picture(4, 4);
        image.metadata.set(key, value);
        assert!(matches!(
            encode(&image, Format::Exr, "a.exr", &WriteOptions::default()),
            Err(Error::Unsupported { .. })
        ));
    }
    let mut image = picture(4, 4);
    image.metadata.set("note", Attribute::Text("\u{2192}".into()));
    let back = read(&bytes(&image, Format::Exr, &WriteOptions::default()), "a.exr").unwrap();
    assert_eq!(back.metadata.text("note"), Some("\\u{2192}"));
}

#[test]
fn a_crop_knows_its_place() {
    let image = picture(20, 10);
    let crop = image.crop(15, 4, 100, 3);
    assert_eq!((crop.width(), crop.height(), crop.metadata.origin), (5, 3, [15, 4]));
    let back = read(&bytes(&crop, Format::Exr, &WriteOptions::default()), "a.exr").unwrap();
    assert_eq!(back.frame(), Window { x: 0, y: 0, width: 20, height: 10 });
    assert_eq!(back.channel("R").unwrap()[7], image.channel("R").unwrap()[5 * 20 + 17]);
}

#[test]
fn pfm_is_exact_in_colour_and_grey() {
    let image = picture(13, 7);
    let back = read(&bytes(&image, Format::Pfm, &WriteOptions::default()), "a.pfm").unwrap();
    assert_eq!(back.rgb(), image.rgb());
    let mut grey = Image::new(3, 2);
    grey.add("Y", vec![1.0, 2.0, 3.0, 4.0, 5.0, 6.0], Precision::Float).unwrap();
    let file = bytes(&grey, Format::Pfm, &WriteOptions::default());
    assert!(file.starts_with(b"Pf\n3 2\n"));
    assert_eq!(read(&file, "a.pfm").unwrap().channel("Y").unwrap(), [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
}

#[test]
fn big_endian_pfm_with_a_scale() {
    let mut file = b"Pf\n1 2\n2.0\n".to_vec();
    file.extend(1.5_f32.to_be_bytes());
    file.extend((-4.0_f32).to_be_bytes());
    assert_eq!(read(&file, "a.pfm").unwrap().channel("Y").unwrap(), [-8.0, 3.0]);
}

#[test]
fn hdr_is_right_to_its_eight_bits() {
    // Widths below 8 are stored plain; 300 needs more than one run per line.
    for width in [1, 7, 8, 300] {
        let mut image = picture(width, 5);
        image.channel_mut("G").unwrap()[0] = 1e-9;
        image.channel_mut("B").unwrap()[0] = 3e8;
        let back = read(&bytes(&image, Format::Hdr, &WriteOptions::default()), "a.hdr").unwrap();
        for (a, b) in image.rgb().unwrap().iter().zip(back.rgb().unwrap()) {
            let largest = a[0].max(a[1]).max(a[2]);
            for c in 0..3 {
                assert!((a[c] - b[c]).abs() <= largest / 255.0, "{a:?} {b:?}");
            }
        }
    }
}

#[test]
fn hdr_never_writes_a_pixel_that_reads_as_nan() {
    let odd = [f32::NAN, -1.0, f32::INFINITY, f32::MAX, 1e-40, 0.0, 1.0, 255.9];
    let image = Image::from_rgb(8, 1, &odd.map(|v| [v; 3])).unwrap();
    let back = read(&bytes(&image, Format::Hdr, &WriteOptions::default()), "a.hdr").unwrap();
    let r = back.channel("R").unwrap();
    assert_eq!((r[0], r[1], r[4], r[5], r[6]), (0.0, 0.0, 0.0, 0.0, 1.0));
    assert!(r[2] > 1e38 && r[2].is_finite() && (r[7] - 256.0).abs() < 1.0);
}

#[test]
fn png_is_right_to_half_a_code() {
    let image = picture(19, 11);
    for sixteen_bits in [false, true] {
        let options = WriteOptions { sixteen_bits, ..WriteOptions::default() };
        let back = read(&bytes(&image, Format::Png, &options), "a.png").unwrap();
        let half_code = 0.5001 / if sixteen_bits { 65535.0 } else { 255.0 };
        for (a, b) in image.rgb().unwrap().iter().zip(back.rgb().unwrap()) {
            for c in 0..3 {
                let code = |v: f32| Encoding::Srgb.from_linear(v.clamp(0.0, 1.0));
                assert!((code(a[c]) - code(b[c])).abs() < half_code, "{a:?} {b:?}");
            }
        }
    }
}

#[test]
fn png_keeps_alpha_and_grey() {
    let mut image = Image::new(2, 1);
    image.add("Y", vec![0.0, 1.0], Precision::Float).unwrap();
    let back = read(&bytes(&image, Format::Png, &WriteOptions::default()), "a.png").unwrap();
    assert_eq!(back.channel("Y").unwrap(), [0.0, 1.0]);
    image.add("A", vec![0.5, 1.0], Precision::Float).unwrap();
    let back = read(&bytes(&image, Format::Png, &WriteOptions::default()), "a.png").unwrap();
    // Alpha is stored as it is, not on the sRGB curve.
    assert!((back.channel("A").unwrap()[0] - 128.0 / 255.0).abs() < 1e-6);
}

#[test]
fn jpeg_is_near() {
    let flat = Image::from_rgb(16, 16, &[[0.2, 0.5, 0.7]; 256]).unwrap();
    let back = read(&bytes(&flat, Format::Jpeg, &WriteOptions::default()), "a.jpg").unwrap();
    for p in back.rgb().unwrap() {
        for (v, want) in p.iter().zip([0.2, 0.5, 0.7]) {
            assert!((v - want).abs() < 0.02, "{p:?}");
        }
    }
}

#[test]
fn tone_mapping_is_applied_on_the_way_out() {
    let image = Image::from_rgb(1, 1, &[[4.0; 3]]).unwrap();
    let plain = read(&bytes(&image, Format::Png, &WriteOptions::default()), "a.png").unwrap();
    assert_eq!(plain.rgb().unwrap(), [[1.0; 3]]);
    let options = WriteOptions { tone_map: Some(ToneMap::default()), ..WriteOptions::default() };
    let mapped = read(&bytes(&image, Format::Png, &options), "a.png").unwrap().rgb().unwrap()[0][0];
    assert!((mapped - Operator::Agx.apply([4.0; 3])[0]).abs() < 0.01 && mapped < 0.99);
}

#[test]
fn read_only_formats_are_read() {
    let codes: Vec<u8> = (0..6 * 4 * 3).map(|i| (i * 7 % 256) as u8).collect();
    let buffer = image::RgbImage::from_raw(6, 4, codes.clone()).unwrap();
    for (format, name) in [
        (image::ImageFormat::Tga, "a.tga"),
        (image::ImageFormat::Bmp, "a.bmp"),
        (image::ImageFormat::Qoi, "a.qoi"),
        (image::ImageFormat::WebP, "a.webp"),
    ] {
        let mut file = std::io::Cursor::new(Vec::new());
        buffer.write_to(&mut file, format).unwrap();
        let texels = read_texels(file.get_ref(), name, None).unwrap();
        assert_eq!(texels.storage(), &Storage::U8(codes.clone()), "{name}");
        let error = encode(&texels.to_image(), Format::from_name(name).unwrap(), name, &WriteOptions::default());
        assert!(matches!(error, Err(Error::Unsupported { .. })));
    }
}

/// 24 x 18 pixels with red along x, green along y, blue 64 and alpha 255 - 10 x, at quality 90.
#[test]
fn lossy_webp_is_near() {
    let texels = read_texels(include_bytes!("data/lossy.webp"), "a.webp", None).unwrap();
    assert_eq!((texels.width(), texels.height(), texels.channels()), (24, 18, 4));
    let Storage::U8(codes) = texels.storage() else { panic!("not bytes") };
    let mut worst = 0;
    for (i, p) in codes.chunks(4).enumerate() {
        let (x, y) = (i % 24, i / 24);
        let want = [40 + 8 * x, 30 + 10 * y, 64, 255 - 10 * x].map(|v| v as i32);
        worst = (0..3).map(|c| (i32::from(p[c]) - want[c]).abs()).max().unwrap().max(worst);
        assert_eq!(i32::from(p[3]), want[3]);
    }
    assert!(worst < 12, "{worst}");
}

#[test]
fn textures_stay_in_their_own_precision() {
    let image = picture(8, 8);
    let png = bytes(&image, Format::Png, &WriteOptions::default());
    let texels = read_texels(&png, "a.png", None).unwrap();
    assert_eq!((texels.bytes(), texels.channels()), (8 * 8 * 3, 3));
    let linear = read_texels(&png, "a.png", Some(Encoding::Linear)).unwrap();
    assert_eq!(texels.storage(), linear.storage());
    assert!((Encoding::Srgb.to_linear(linear.texel(3, 2, 0)) - texels.texel(3, 2, 0)).abs() < 1e-6);
    let mut half = image.clone();
    half.set_precision(Precision::Half);
    let texels = read_texels(&bytes(&half, Format::Exr, &WriteOptions::default()), "a.exr", None).unwrap();
    assert_eq!(texels.bytes(), 2 * 8 * 8 * 3);
}

#[test]
fn the_bytes_decide_before_the_name() {
    let png = bytes(&picture(2, 2), Format::Png, &WriteOptions::default());
    assert!(read(&png, "wrong.exr").is_ok());
    assert!(matches!(read(b"hello", "a.txt"), Err(Error::UnknownFormat { .. })));
    assert!(matches!(read(b"", "noextension"), Err(Error::UnknownFormat { .. })));
}

#[test]
fn a_file_is_written_whole_or_not_at_all() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("out.png");
    write_file(&picture(4, 4), &path, &WriteOptions::default()).unwrap();
    let first = fs::read(&path).unwrap();
    write_file(&picture(5, 4), &path, &WriteOptions::default()).unwrap();
    assert_ne!(fs::read(&path).unwrap(), first);
    let names = || fs::read_dir(folder.path()).unwrap().map(|e| e.unwrap().file_name()).collect::<Vec<_>>();
    assert_eq!(names(), ["out.png"]);

    // A folder stands where the file should go: the rename fails, and nothing is left behind.
    let blocked = folder.path().join("blocked.exr");
    fs::create_dir(&blocked).unwrap();
    assert!(matches!(write_file(&picture(4, 4), &blocked, &WriteOptions::default()), Err(Error::Io { .. })));
    assert_eq!(names().len(), 2);
    // An image that cannot be encoded leaves what was there.
    assert!(write_file(&Image::new(4, 4), &path, &WriteOptions::default()).is_err());
    assert_eq!(names().len(), 2);
    assert!(matches!(
        write_file(&picture(4, 4), &folder.path().join("no/such/folder.exr"), &WriteOptions::default()),
        Err(Error::Io { .. })
    ));
}

#[test]
fn exact_comparison_sees_bits_and_forgives_dates() {
    let a = full_exr();
    let mut b = a.clone();
    b.metadata.set("renderSeconds", Attribute::Float(3.0));
    b.metadata.set("capDate", Attribute::Text("2026:01:01 00:00:00".into()));
    assert_eq!(exact_differences(&a, &b), []);
    b.channel_mut("R").unwrap()[2] = 0.0;
    b.metadata.set("samplesPerPixel", Attribute::Int(255));
    b.metadata.chromaticities = None;
    b.metadata.origin = [0, 0];
    b.add("extra", vec![0.0; 37 * 21], Precision::Float).unwrap();
    let found: Vec<String> = exact_differences(&a, &b).iter().map(ToString::to_string).collect();
    assert_eq!(found.len(), 5, "{found:?}");
    assert_eq!(found[0], "channel R: 1 samples differ, first at 2, 0: -0e0 and 0e0");
}
