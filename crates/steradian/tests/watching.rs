//! `--tev`: what arrives at a viewer is the picture, and a viewer that goes away takes nothing with it.

mod common;

use common::Folder;
use std::io::Read;
use std::net::TcpListener;

/// What a viewer would show: size, then channel after channel.
#[derive(Default)]
struct Viewer {
    size: [usize; 2],
    planes: [Vec<f32>; 3],
    tiles: usize,
}

struct Packet<'a>(&'a [u8]);

impl Packet<'_> {
    fn byte(&mut self) -> u8 {
        let b = self.0[0];
        self.0 = &self.0[1..];
        b
    }
    fn int(&mut self) -> usize {
        let (head, rest) = self.0.split_at(4);
        self.0 = rest;
        usize::try_from(i32::from_le_bytes(head.try_into().unwrap())).unwrap()
    }
    fn float(&mut self) -> f32 {
        let (head, rest) = self.0.split_at(4);
        self.0 = rest;
        f32::from_le_bytes(head.try_into().unwrap())
    }
    fn text(&mut self) -> String {
        let end = self.0.iter().position(|&b| b == 0).unwrap();
        let text = String::from_utf8(self.0[..end].to_vec()).unwrap();
        self.0 = &self.0[end + 1..];
        text
    }
    fn names(&mut self) -> Vec<String> {
        (0..self.int()).map(|_| self.text()).collect()
    }
}

impl Viewer {
    fn take(&mut self, bytes: &[u8]) {
        let mut p = Packet(bytes);
        let (kind, _focus, name) = (p.byte(), p.byte(), p.text());
        assert_eq!(name, "a.exr");
        match kind {
            4 => {
                self.size = [p.int(), p.int()];
                assert_eq!(p.names(), ["R", "G", "B"]);
                self.planes = std::array::from_fn(|_| vec![f32::NAN; self.size[0] * self.size[1]]);
            }
            5 => {
                assert_eq!(p.names(), ["R", "G", "B"]);
                let [x0, y0, w, h] = std::array::from_fn(|_| p.int());
                for plane in &mut self.planes {
                    for i in 0..w * h {
                        plane[(y0 + i / w) * self.size[0] + x0 + i % w] = p.float();
                    }
                }
                self.tiles += 1;
            }
            other => panic!("a packet of kind {other}"),
        }
        assert!(p.0.is_empty(), "nothing is left of a packet");
    }
}

#[test]
fn a_viewer_sees_the_picture() {
    let f = Folder::with_scene();
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = listener.local_addr().unwrap().port();
    let viewer = std::thread::spawn(move || {
        let mut stream = listener.accept().unwrap().0;
        let mut bytes = Vec::new();
        stream.read_to_end(&mut bytes).unwrap();
        let mut viewer = Viewer::default();
        let mut rest = bytes.as_slice();
        while !rest.is_empty() {
            let length = u32::from_le_bytes(rest[..4].try_into().unwrap()) as usize;
            viewer.take(&rest[4..length]);
            rest = &rest[length..];
        }
        viewer
    });
    f.ok(&format!("render small.pbrt -q --size 70x40 --spp 5 --tev 127.0.0.1:{port} -o a.exr"));
    let viewer = viewer.join().unwrap();
    let image = steradian_image::read(&f.bytes("a.exr"), "a.exr").unwrap();
    assert_eq!(viewer.size, [70, 40]);
    assert!(viewer.tiles > 5 * 3, "tile by tile: {}", viewer.tiles);
    for (seen, written) in viewer.planes.iter().zip(image.planes("").unwrap()) {
        assert_eq!(seen, written);
    }
}

#[test]
fn a_viewer_that_goes_away_stops_nothing_and_one_that_is_not_there_is_said() {
    let f = Folder::with_scene();
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = listener.local_addr().unwrap().port();
    let gone = std::thread::spawn(move || drop(listener.accept().unwrap()));
    let ran = f.run(&format!("render small.pbrt --size 320x240 --spp 8 --tev 127.0.0.1:{port} -o a.exr"));
    gone.join().unwrap();
    assert_eq!(ran.code, Some(0), "{}", ran.err);
    assert!(ran.err.contains("tev has gone") && ran.err.contains("wrote a.exr"), "{}", ran.err);
    let ran = f.run(&format!("render small.pbrt --tev 127.0.0.1:{port} -o b.exr"));
    assert_eq!(ran.code, Some(3));
    assert!(ran.err.contains(&format!("cannot reach tev at 127.0.0.1:{port}: ")), "{}", ran.err);
}

/// One object a line, whatever files are called and however large numbers are.
#[test]
fn json_stays_json_whatever_the_names() {
    for name in ["a \"b\".exr", "a\\u0000\\.exr", "a\nb.exr", "\u{202e}\u{0}x.exr".trim_matches('\0'), "ü{}[],:.exr"] {
        let name = name.replace('\0', "");
        let f = Folder::empty().with(
            "s.pbrt",
            common::SCENE.replace("\"rgb L\" [ 5 5 4 ]", "\"rgb L\" [ 1e30 1e30 1e30 ] \"float scale\" [ 1e15 ]"),
        );
        let ran = f.command("render s.pbrt --spp 3 --progress json -o").arg(&name).output().unwrap();
        assert_eq!(ran.status.code(), Some(0), "{name:?}: {}", String::from_utf8_lossy(&ran.stderr));
        let out = String::from_utf8(ran.stdout).unwrap();
        let values: Vec<serde_json::Value> = out.lines().map(|l| serde_json::from_str(l).unwrap()).collect();
        let last = values.last().unwrap();
        assert_eq!(last["files"][0], name.as_str());
        assert!(last["bad_samples"].as_u64().unwrap() > 0);
        let ran = f.command("render s.pbrt --spp 1 -q -o b.exr --like").arg(&name).output().unwrap();
        assert_eq!(ran.status.code(), Some(0), "{name:?}: {}", String::from_utf8_lossy(&ran.stderr));
    }
}

/// What a picture says of its options is not believed.
#[test]
fn options_of_a_hostile_picture_are_refused() {
    use steradian_image::{Attribute, Image, WriteOptions, write_file};
    let f = Folder::with_scene();
    for (options, fine) in [
        ("--spp 3 --seed 4", true),
        ("--spp 99999999999999999999", false),
        ("--spp -1", false),
        ("--checkpoint stolen --resume", true),
        ("-o other.exr --variance v.exr", true),
        ("--size 0x0", false),
        ("--crop nan,1,0,1", false),
        ("--help", false),
        ("\u{1} \\ \" --", false),
        ("small.pbrt small.pbrt", false),
    ] {
        let mut image = Image::from_rgb(2, 2, &[[0.0; 3]; 4]).unwrap();
        image.metadata.set("steradian.scene", Attribute::Text("small.pbrt".into()));
        image.metadata.set("steradian.options", Attribute::Text(options.into()));
        write_file(&image, &f.path("like.exr"), &WriteOptions::default()).unwrap();
        let ran = f.run("render --like like.exr -q -o a.exr");
        assert_eq!(ran.code, Some(if fine { 0 } else { 2 }), "{options}: {}{}", ran.out, ran.err);
        assert!(fine || ran.err.contains("like.exr: its options are none of this version"), "{options}: {}", ran.err);
        assert!(!f.path("stolen").exists() && !f.path("other.exr").exists() && !f.path("v.exr").exists());
    }
}
