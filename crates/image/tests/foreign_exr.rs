//! EXR files as other programs write them: tiles, every compression that the library knows, several parts.

use std::io::Cursor;

use exr::prelude::{
    AnyChannel, AnyChannels, Blocks, Compression, Encoding, FlatSamples, Image, ImageAttributes, IntegerBounds, Layer,
    LayerAttributes, Layers, LineOrder, Vec2, WritableImage, f16,
};
use steradian_image::{Precision, read, read_texels};

const W: usize = 70;
const H: usize = 33;

fn channel(name: &str, samples: FlatSamples) -> AnyChannel<FlatSamples> {
    AnyChannel::new(name, samples)
}

fn ramp(scale: f32) -> Vec<f32> {
    (0..W * H).map(|i| (i % W) as f32 * scale).collect()
}

fn layer(name: Option<&str>, encoding: Encoding, scale: f32) -> Layer<AnyChannels<FlatSamples>> {
    let attributes = name.map_or_else(LayerAttributes::default, LayerAttributes::named);
    let halves = ramp(scale).into_iter().map(f16::from_f32).collect();
    let list = vec![
        channel("B", FlatSamples::F16(halves)),
        channel("G", FlatSamples::F32(ramp(2.0 * scale))),
        channel("R", FlatSamples::F32(ramp(scale))),
        channel("id", FlatSamples::U32((0..(W * H) as u32).collect())),
    ];
    Layer::new((W, H), attributes, encoding, AnyChannels::sort(list.into()))
}

#[test]
fn every_compression_in_lines_and_tiles() {
    let kinds = [
        Compression::Uncompressed,
        Compression::RLE,
        Compression::ZIP1,
        Compression::ZIP16,
        Compression::PIZ,
        Compression::PXR24,
    ];
    for compression in kinds {
        for blocks in [Blocks::ScanLines, Blocks::Tiles(Vec2(32, 16))] {
            let encoding = Encoding { compression, blocks, line_order: LineOrder::Increasing };
            let mut file = Cursor::new(Vec::new());
            Image::from_layer(layer(None, encoding, 0.5)).write().non_parallel().to_buffered(&mut file).unwrap();
            let image = read(file.get_ref(), "a.exr").unwrap();
            assert_eq!((image.width(), image.height()), (W, H));
            for (name, precision, scale) in
                [("R", Precision::Float, 0.5), ("G", Precision::Float, 1.0), ("B", Precision::Half, 0.5)]
            {
                let c = image.channels().iter().find(|c| c.name == name).unwrap();
                assert_eq!(c.precision, precision);
                for (a, b) in c.samples.iter().zip(ramp(scale)) {
                    // PXR24 keeps 24 bits of a float.
                    assert!((a - b).abs() <= b * 1e-4, "{compression:?} {blocks:?} {name}: {a} {b}");
                }
            }
            assert_eq!(image.channel("id").unwrap()[W * H - 1], (W * H - 1) as f32);
            assert_eq!(read_texels(file.get_ref(), "a.exr", None).unwrap().channels(), 3);
        }
    }
}

#[test]
fn parts_with_the_same_channels_keep_apart() {
    let encoding =
        Encoding { compression: Compression::ZIP16, blocks: Blocks::ScanLines, line_order: LineOrder::Increasing };
    let layers = vec![layer(Some("left"), encoding, 1.0), layer(Some("right"), encoding, 3.0)];
    let frame = ImageAttributes::new(IntegerBounds::from_dimensions((W, H)));
    let image: Image<Layers<AnyChannels<FlatSamples>>> = Image::from_layers(frame, layers);
    let mut file = Cursor::new(Vec::new());
    image.write().non_parallel().to_buffered(&mut file).unwrap();
    let image = read(file.get_ref(), "a.exr").unwrap();
    assert_eq!(image.channel("R").unwrap()[5], 5.0);
    assert_eq!(image.planes("right").unwrap()[0][5], 15.0);
}
