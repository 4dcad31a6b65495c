//! The server from outside: who is let in, what garbage does, and what tabs see.

mod common;

use common::{Tab, raw, serve, status, token};
use serde_json::json;
use std::io::Write;
use std::net::TcpStream;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

#[test]
fn strangers_stay_outside() {
    let (server, _) = serve(32);
    let (address, secret) = (server.address(), token(&server));
    let host = format!("Host: {address}\r\n");
    let socket = format!(
        "{host}Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n"
    );
    assert_eq!(status(address, "/", &host), 200);
    assert_eq!(status(address, "/page.js", &host), 200);
    // Names and origins of others.
    assert_eq!(status(address, "/", "Host: evil.example\r\n"), 403);
    assert_eq!(status(address, "/", ""), 403);
    assert_eq!(status(address, "/", &format!("{host}Origin: http://evil.example\r\n")), 403);
    let good = format!("/ws?token={secret}");
    assert_eq!(status(address, &good, &format!("{socket}Origin: http://evil.example\r\n")), 403);
    assert_eq!(status(address, &good, &format!("{socket}Origin: http://127.0.0.1:1\r\n")), 403);
    // Without the secret, or with another.
    let wrong = format!("/ws?token={}0", &secret[..secret.len() - 1]);
    for path in ["/ws", "/ws?token=", &wrong, "/picture.exr", "/picture.exr?token=x"] {
        if *path != good {
            assert_eq!(status(address, path, &socket), 403, "{path}");
        }
    }
    assert_eq!(status(address, &good, &host), 400, "no handshake");
    // Files of the machine have no address.
    for path in [
        "/../Cargo.toml",
        "/..%2f..%2fetc/passwd",
        "/etc/passwd",
        "//etc/passwd",
        "/page.js/../../Cargo.toml",
        "/src/main.ts",
    ] {
        assert_eq!(status(address, path, &host), 404, "{path}");
    }
    assert!(raw(address, format!("POST / HTTP/1.1\r\n{host}\r\n").as_bytes()).starts_with(b"HTTP/1.1 405"));
    let page = String::from_utf8(raw(address, format!("GET / HTTP/1.1\r\n{host}\r\n").as_bytes())).unwrap();
    assert!(page.contains("Content-Security-Policy: default-src 'none'") && !page.contains(&secret));
    Tab::open(&server).until("the picture", |t| t.frames > 0);
}

#[test]
fn the_picture_is_the_one_of_a_plain_render() {
    let (server, _) = serve(40);
    let mut tab = Tab::open(&server);
    tab.say(json!({ "type": "goal", "spp": 11, "error": null }));
    tab.until("eleven samples", |t| t.spp >= 10.99);
    let path = format!("/picture.exr?token={}", token(&server));
    let answer = raw(server.address(), format!("GET {path} HTTP/1.1\r\nHost: {}\r\n\r\n", server.address()).as_bytes());
    let body = answer.windows(4).position(|w| w == b"\r\n\r\n").unwrap() + 4;
    let seen = steradian_image::read(&answer[body..], "p.exr").unwrap();
    let mut scene = common::scene(40);
    scene.settings.sampler.spp = 16;
    let world = steradian_scene::World::build(scene).unwrap();
    let plan = steradian_render::Plan { spp: 11, threads: 1, time_limit: None };
    let cancel = std::sync::atomic::AtomicBool::new(false);
    let plain = steradian_render::render(&world, &plan, &steradian_render::Quiet, &cancel);
    assert_eq!(seen.rgb().unwrap(), plain.film.mean(), "to the last bit");
}

#[test]
fn a_pixel_is_explained_by_the_very_paths_that_made_it() {
    let (server, _) = serve(48);
    let mut tab = Tab::open(&server);
    tab.say(json!({ "type": "goal", "spp": 100, "error": null }));
    tab.until("a hundred samples", |t| t.spp >= 99.99);
    let told = tab.ask(json!({ "type": "explore", "pane": 0, "pixel": [24, 20] })).unwrap();
    assert_eq!((told["samples"].as_u64(), told["same_as_picture"].as_bool()), (Some(100), Some(true)));
    let (mean, half) = (told["luminance"].as_f64().unwrap(), told["half_width"].as_f64().unwrap());
    assert!(mean > 0.1 && mean < 0.9 && half > 0.0 && half < 0.2 * mean, "{mean} {half}");
    let paths: Vec<_> = told["brightest"].as_array().unwrap().iter().chain(told["usual"].as_array().unwrap()).collect();
    assert!(paths.len() > 10);
    for path in paths {
        assert_eq!(path["exact"], json!(true), "the contributions are the sample's radiance: {path}");
        let again = tab.ask(json!({ "type": "path", "pane": 0, "pixel": [24, 20], "sample": path["sample"] })).unwrap();
        assert_eq!(&again, path);
        for c in 0..3 {
            let (sum, rgb) = (path["sum"][c].as_f64().unwrap(), path["rgb"][c].as_f64().unwrap());
            assert!((sum - rgb).abs() <= 1e-5 * rgb.abs().max(1e-3), "{sum} {rgb}");
        }
    }
    let first = told["brightest"][0]["luminance"].as_f64().unwrap();
    assert!(told["brightest"].as_array().unwrap().iter().all(|p| p["luminance"].as_f64().unwrap() <= first));
    assert!(tab.ask(json!({ "type": "explore", "pane": 0, "pixel": [48, 0] })).unwrap_err().contains("48 x 48"));
    assert!(tab.ask(json!({ "type": "explore", "pane": 7, "pixel": [0, 0] })).is_err());
}

#[test]
fn tabs_see_what_one_of_them_changes_and_bad_options_are_refused() {
    let (server, stage) = serve(32);
    let (mut one, mut two) = (Tab::open(&server), Tab::open(&server));
    one.until("a picture", |t| t.frames > 0);
    two.until("a picture", |t| t.frames > 0);
    let before = two.generation;
    one.say(json!({ "type": "set", "pane": 0, "options": { "fov": "10" } }));
    two.until("the other picture", |t| t.generation > before);
    assert_eq!(two.state["panes"][0]["options"], json!({ "fov": "10" }));
    one.say(json!({ "type": "set", "pane": 0, "options": { "bad": "1" } }));
    one.until("the refusal", |t| t.state["refused"] == json!("no option bad"));
    assert_eq!(one.state["panes"][0]["options"], json!({ "fov": "10" }), "what was stands");
    // Side by side.
    one.say(json!({ "type": "compare", "options": { "depth": "0" } }));
    one.until("two panes", |t| t.state["panes"].as_array().is_some_and(|p| p.len() == 2));
    one.say(json!({ "type": "compare", "options": null }));
    one.until("one pane", |t| t.state["panes"].as_array().is_some_and(|p| p.len() == 1));
    // A scene that breaks leaves the picture standing; one that is mended comes.
    let standing = one.generation;
    stage.broken.store(true, Ordering::SeqCst);
    stage.changed.store(true, Ordering::SeqCst);
    one.until("the problem", |t| t.state["problems"] == json!(["error: line 3"]));
    assert!(one.ask(json!({ "type": "explore", "pane": 0, "pixel": [3, 3] })).is_ok());
    stage.broken.store(false, Ordering::SeqCst);
    stage.changed.store(true, Ordering::SeqCst);
    one.until("the mended scene", |t| t.state["problems"] == json!([]) && t.generation > standing);
}

#[test]
fn garbage_does_no_harm() {
    let (server, _) = serve(32);
    let address = server.address();
    let mut state = 12345u64;
    let mut noise = |n: usize| -> Vec<u8> {
        (0..n)
            .map(|_| {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                (state >> 56) as u8
            })
            .collect()
    };
    // On the door: heads that are none, too long, with too many lines, cut off.
    for n in [1, 10, 300, 5000] {
        raw_and_close(address, &noise(n));
    }
    let long = format!("GET /{} HTTP/1.1\r\nHost: localhost\r\n\r\n", "a".repeat(20_000));
    assert!(raw(address, long.as_bytes()).starts_with(b"HTTP/1.1 431"));
    let many = format!("GET / HTTP/1.1\r\nHost: localhost\r\n{}\r\n", "x: y\r\n".repeat(200));
    assert!(raw(address, many.as_bytes()).starts_with(b"HTTP/1.1 431"));
    raw_and_close(address, b"GET / HT");
    // On the socket: texts that are no words, numbers that are absurd, files that are none, frames that are broken.
    let mut tab = Tab::open(&server);
    for text in [
        "",
        "{",
        "null",
        "[]",
        "{\"type\":\"explode\"}",
        "{\"type\":\"set\"}",
        "{\"type\":\"ack\",\"frame\":-1}",
        "{\"type\":\"goal\",\"spp\":1e99,\"error\":null}",
        "{\"type\":\"set\",\"pane\":99,\"options\":{}}",
    ] {
        tab.socket.send(tungstenite::Message::text(text)).unwrap();
    }
    for n in [0, 3, 12, 100] {
        tab.socket.send(tungstenite::Message::binary(noise(n))).unwrap();
    }
    let mut file = Vec::new();
    [16u32, 5, 5].iter().for_each(|w| file.extend(w.to_le_bytes()));
    file.extend(b"a.exr");
    file.extend(noise(2000));
    tab.socket.send(tungstenite::Message::binary(file)).unwrap();
    tab.say(json!({ "type": "ack", "frame": 4_000_000_000u32 }));
    let big = tab.ask(json!({ "type": "explore", "pane": 0, "pixel": [4_000_000_000u32, 1] }));
    assert!(big.is_err());
    let mut broken = Tab::open(&server);
    let _ = broken.socket.get_mut().write_all(&noise(5000));
    // And still:
    let mut tab = Tab::open(&server);
    tab.until("the picture", |t| t.frames > 0);
    assert!(tab.ask(json!({ "type": "explore", "pane": 0, "pixel": [3, 3] })).is_ok());
}

fn raw_and_close(address: std::net::SocketAddr, bytes: &[u8]) {
    let mut stream = TcpStream::connect(address).unwrap();
    let _ = stream.write_all(bytes);
}

/// Bytes of memory of this process, where the system says.
fn memory() -> Option<u64> {
    let text = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = text.lines().find_map(|l| l.strip_prefix("VmRSS:"))?;
    line.trim().trim_end_matches("kB").trim().parse::<u64>().ok().map(|k| k * 1024)
}

#[test]
fn twenty_tabs_and_one_that_sleeps() {
    let (server, _) = serve(256);
    // Takes nothing in, ever.
    let _asleep: Vec<Tab> = (0..3).map(|_| Tab::open(&server)).collect();
    let mut tabs: Vec<Tab> = (0..20).map(|_| Tab::open(&server)).collect();
    let seconds = std::env::var("STERADIAN_LOAD_SECONDS").ok().and_then(|s| s.parse().ok()).unwrap_or(4u64);
    let start = Instant::now();
    let mut before = None;
    std::thread::scope(|scope| {
        for (i, tab) in tabs.iter_mut().enumerate() {
            scope.spawn(move || {
                let mut moves = 0;
                while start.elapsed() < Duration::from_secs(seconds) {
                    tab.step();
                    if i == 0 && tab.frames > 3 * moves {
                        moves += 1;
                        tab.say(
                            json!({ "type": "set", "pane": 0, "options": { "fov": (20 + moves % 40).to_string() } }),
                        );
                    }
                }
            });
        }
        std::thread::sleep(Duration::from_secs(seconds) / 4);
        before = memory();
    });
    let least = tabs.iter().map(|t| t.frames).min().unwrap_or(0);
    assert!(least as u64 >= 2 * seconds, "a tab got only {least} pictures in {seconds} s");
    if let (Some(before), Some(after)) = (before, memory()) {
        assert!(after < before + (64 << 20), "memory grew from {before} to {after}");
    }
    let ending = Instant::now();
    drop(server);
    assert!(ending.elapsed() < Duration::from_secs(8), "the server takes {:?} to end", ending.elapsed());
}
