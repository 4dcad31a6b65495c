//! A small scene on a stage, and a tab without a browser.

use serde_json::{Value, json};
use std::io::{Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use steradian_geometry::Sphere;
use steradian_image::{Filter, Format, Image, WriteOptions, encode};
use steradian_math::{Transform, Vec3};
use steradian_render::Film;
use steradian_sampling::{SamplerKind, SamplerSettings};
use steradian_scene::{
    Camera, FilmSettings, IntegratorSettings, Light, Material, Primitive, Projection, RenderSettings, Scattering,
    Scene, Shape, SpectrumTexture, Texture,
};
use steradian_spectrum::{ColorMode, ColorSpace, Spectrum, SpectrumUse};
use steradian_view::{Options, Said, Server, Settings, Stage, start};
use tungstenite::client::IntoClientRequest;
use tungstenite::{Message, WebSocket};

/// A grey sphere under an even sky.
pub fn scene(size: u32) -> Scene {
    let mut scene = Scene::new(RenderSettings {
        film: FilmSettings::new(size, size),
        filter: Filter::pixel_box(),
        sampler: SamplerSettings {
            kind: SamplerKind::PaddedSobol,
            spp: 16,
            resolution: [size, size],
            ..SamplerSettings::default()
        },
        integrator: IntegratorSettings { max_depth: 3, ..IntegratorSettings::default() },
        color: ColorMode::Rgb,
        disable_pixel_jitter: false,
        disable_wavelength_jitter: false,
        disable_texture_filtering: false,
        force_diffuse: false,
        layered_as_pbrt: false,
    });
    let grey = Spectrum::constant(0.5, SpectrumUse::Albedo);
    let reflectance =
        scene.spectrum_textures.push(SpectrumTexture { usage: grey.usage(), kind: Texture::Constant(grey) });
    let material = scene.materials.push(Material {
        name: "grey".into(),
        scattering: Scattering::Diffuse { reflectance },
        displacement: None,
        normal_map: None,
        tilt: None,
    });
    scene.primitives.push(Primitive {
        shape: Shape::Sphere(Sphere::full(1.0).unwrap()),
        world_from_object: Transform::translate(Vec3::new(0.0, 0.0, 4.0)),
        reverse_orientation: false,
        material,
        area_light: None,
        alpha: None,
        media: None,
    });
    let radiance = Spectrum::rgb_illuminant(ColorSpace::Srgb, [1.0; 3]);
    let scale = 1.0 / radiance.photometric();
    scene.lights.push(Light::UniformInfinite { radiance, scale });
    scene.camera = Camera { projection: Projection::Perspective { fov: 40.0 }, ..Camera::default() };
    scene
}

/// Knows three options: `depth`, `fov`, and `bad`, which is refused.
pub struct Plain {
    pub size: u32,
    pub changed: AtomicBool,
    pub broken: AtomicBool,
}

impl Stage for Plain {
    fn name(&self) -> String {
        "plain".into()
    }
    fn options(&self) -> Options {
        Options::new()
    }
    fn open(&self) -> Result<Scene, Vec<String>> {
        if self.broken.load(Ordering::SeqCst) { Err(vec!["error: line 3".into()]) } else { Ok(scene(self.size)) }
    }
    fn changed(&self) -> bool {
        self.changed.swap(false, Ordering::SeqCst)
    }
    fn apply(&self, options: &mut Options, mut said: Said) -> Result<Said, String> {
        for (name, value) in options.iter() {
            let number: Result<f32, _> = value.parse();
            match (name.as_str(), number) {
                ("depth", Ok(v)) => said.settings.integrator.max_depth = v as u32,
                ("fov", Ok(fov)) => said.camera.projection = Projection::Perspective { fov },
                _ => return Err(format!("no option {name}")),
            }
        }
        Ok(said)
    }
    fn command(&self, word: &str, _options: &Options, more: &str) -> String {
        format!("steradian {word} {more}")
    }
    fn picture(&self, _: &Options, _: &RenderSettings, film: &Film, _: Duration) -> Result<Vec<u8>, String> {
        let [w, h] = film.size();
        let image = Image::from_rgb(w, h, &film.mean()).ok_or("no pixels")?;
        encode(&image, Format::Exr, "p.exr", &WriteOptions::default()).map_err(|e| e.to_string())
    }
}

/// A server at work, and its stage.
pub fn serve(size: u32) -> (Server, Arc<Plain>) {
    let stage = Arc::new(Plain { size, changed: AtomicBool::new(false), broken: AtomicBool::new(false) });
    let settings = Settings { port: Some(0), threads: 2, ..Settings::default() };
    let server = start(stage.clone(), scene(size), &settings).unwrap_or_else(|e| panic!("{e:?}"));
    (server, stage)
}

/// The secret of a server.
pub fn token(server: &Server) -> String {
    server.url().split_once("token=").unwrap().1.to_owned()
}

/// Sends bytes as they are; what comes back until the other side ends or is silent.
pub fn raw(address: SocketAddr, bytes: &[u8]) -> Vec<u8> {
    let mut stream = TcpStream::connect(address).unwrap();
    stream.set_read_timeout(Some(Duration::from_secs(8))).unwrap();
    let _ = stream.write_all(bytes);
    let mut answer = Vec::new();
    let _ = stream.read_to_end(&mut answer);
    answer
}

/// The status of a plain request.
pub fn status(address: SocketAddr, path: &str, headers: &str) -> u16 {
    let answer = raw(address, format!("GET {path} HTTP/1.1\r\n{headers}\r\n").as_bytes());
    let text = String::from_utf8_lossy(&answer).into_owned();
    text.split(' ').nth(1).and_then(|s| s.parse().ok()).unwrap_or_else(|| panic!("{path}: {text:?}"))
}

/// A tab.
pub struct Tab {
    pub socket: WebSocket<TcpStream>,
    pub spp: f64,
    pub generation: u32,
    pub frames: usize,
    pub state: Value,
    next: u32,
}

impl Tab {
    pub fn open(server: &Server) -> Tab {
        let url = server.url().replace("http://", "ws://").replace("/?", "/ws?");
        let stream = TcpStream::connect(server.address()).unwrap();
        stream.set_read_timeout(Some(Duration::from_secs(60))).unwrap();
        let (socket, _) = tungstenite::client(url.into_client_request().unwrap(), stream).unwrap();
        Tab { socket, spp: 0.0, generation: 0, frames: 0, state: Value::Null, next: 1 }
    }

    pub fn say(&mut self, value: Value) {
        self.socket.send(Message::text(value.to_string())).unwrap();
    }

    /// Takes in one message: frames are acknowledged, news kept. The message, if it is another.
    pub fn step(&mut self) -> Option<Message> {
        let message = self.socket.read().unwrap();
        match &message {
            Message::Binary(bytes) => {
                let word = |i: usize| u32::from_le_bytes(bytes[4 * i..4 * i + 4].try_into().unwrap());
                if word(0) > 2 {
                    return Some(message);
                }
                self.frames += 1;
                self.generation = word(3);
                let frame = word(1);
                self.say(json!({ "type": "ack", "frame": frame }));
                None
            }
            Message::Text(text) => {
                let value: Value = serde_json::from_str(text.as_str()).unwrap();
                match value["type"].as_str().unwrap() {
                    "progress" => self.spp = value["panes"][0]["spp"].as_f64().unwrap_or(0.0),
                    "state" => self.state = value,
                    "answer" | "refusal" => return Some(message),
                    _ => {}
                }
                None
            }
            _ => None,
        }
    }

    /// Waits until something holds.
    pub fn until(&mut self, what: &str, f: impl Fn(&Tab) -> bool) {
        let start = Instant::now();
        while !f(self) {
            assert!(start.elapsed() < Duration::from_secs(60), "{what} does not come");
            self.step();
        }
    }

    /// Asks, and waits for the answer.
    pub fn ask(&mut self, mut question: Value) -> Result<Value, String> {
        let id = self.next;
        self.next += 1;
        question["id"] = json!(id);
        self.say(question);
        loop {
            if let Some(Message::Text(text)) = self.step() {
                let value: Value = serde_json::from_str(text.as_str()).unwrap();
                if value["id"] == json!(id) {
                    return match value["type"].as_str() {
                        Some("answer") => Ok(value["value"].clone()),
                        _ => Err(value["why"].as_str().unwrap_or_default().to_owned()),
                    };
                }
            }
        }
    }
}
