//! The server: who may come in, and who looks after them.

use crate::assets::asset;
use crate::client;
use crate::engine::Engine;
use crate::http::{self, Request};
use crate::hub::{Ask, Hub};
use crate::stage::Stage;
use serde_json::json;
use std::io::{self, Write};
use std::net::{IpAddr, Ipv4Addr, SocketAddr, TcpListener, TcpStream};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::sync_channel;
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::Duration;
use steradian_scene::Scene;

/// So many connections at a time.
const MOST_CONNECTIONS: usize = 128;
/// Where the page is looked for first.
const USUAL_PORT: u16 = 7700;
/// How often the scene's files are looked at.
const WATCH: Duration = Duration::from_millis(400);

/// How to serve.
#[derive(Clone, Debug)]
pub struct Settings {
    /// The address; the loopback unless somebody wants otherwise.
    pub host: IpAddr,
    /// The port; by default the usual one, or any if it is taken.
    pub port: Option<u16>,
    /// Threads that render.
    pub threads: usize,
}

impl Default for Settings {
    fn default() -> Self {
        Self { host: Ipv4Addr::LOCALHOST.into(), port: None, threads: 1 }
    }
}

/// A server at work. It ends when it is dropped.
pub struct Server {
    hub: Arc<Hub>,
    address: SocketAddr,
    token: Arc<str>,
    threads: Vec<JoinHandle<()>>,
}

/// Why there is no page.
#[derive(Debug)]
pub enum Refusal {
    /// The scene or an option is at fault.
    Input(String),
    /// The machine is.
    Machine(io::Error),
}

fn listen(settings: &Settings) -> io::Result<TcpListener> {
    match settings.port {
        Some(port) => TcpListener::bind((settings.host, port)),
        None => TcpListener::bind((settings.host, USUAL_PORT)).or_else(|_| TcpListener::bind((settings.host, 0))),
    }
}

/// A secret that nobody can guess.
fn token() -> io::Result<String> {
    let mut bytes = [0u8; 16];
    getrandom::fill(&mut bytes).map_err(|e| io::Error::other(e.to_string()))?;
    Ok(bytes.iter().map(|b| format!("{b:02x}")).collect())
}

/// Serves a scene that has been read.
///
/// # Errors
/// If the scene cannot be built, or the address cannot be had.
pub fn start(stage: Arc<dyn Stage>, scene: Scene, settings: &Settings) -> Result<Server, Refusal> {
    let listener = listen(settings).map_err(Refusal::Machine)?;
    let address = listener.local_addr().map_err(Refusal::Machine)?;
    let token: Arc<str> = token().map_err(Refusal::Machine)?.into();
    let hub = Arc::new(Hub::new(stage, settings.threads));
    let engine = Engine::new(hub.clone(), scene).map_err(Refusal::Input)?;
    let mut threads = Vec::new();
    let told = hub.clone();
    threads.push(std::thread::spawn(move || {
        if catch_unwind(AssertUnwindSafe(|| engine.run())).is_err() {
            let sorry = "the renderer broke one of its own rules and stands still; its words are where it was started";
            let state = json!({
                "type": "state", "panes": [], "paused": true, "adaptive": false, "goal": { "spp": null, "error": null },
                "problems": [sorry], "refused": null, "reference": null,
            });
            told.publish(|board| &mut board.state, &state);
        }
    }));
    let watched = hub.clone();
    threads.push(std::thread::spawn(move || watch(&watched)));
    let door = Arc::new(Door {
        hub: hub.clone(),
        token: token.clone(),
        known: names(settings.host),
        inside: AtomicUsize::new(0),
    });
    threads.push(std::thread::spawn(move || accept(&listener, &door)));
    Ok(Server { hub, address, token, threads })
}

/// The names, besides those of the loopback, under which a server on this address is known.
fn names(host: IpAddr) -> Vec<String> {
    let mut names = match host {
        IpAddr::V4(a) => vec![a.to_string()],
        IpAddr::V6(a) => vec![format!("[{a}]")],
    };
    // On every address of the machine: under each of them, and under the name that it gives itself.
    if host.is_unspecified() {
        names.push(http::ANY_ADDRESS.into());
        if let Ok(name) = std::fs::read_to_string("/proc/sys/kernel/hostname") {
            names.push(name.trim().to_ascii_lowercase());
        }
    }
    names
}

impl Server {
    /// Where the page is, the secret included.
    pub fn url(&self) -> String {
        let ip = self.address.ip();
        let shown: IpAddr = if ip.is_unspecified() { Ipv4Addr::LOCALHOST.into() } else { ip };
        format!("http://{}/?token={}", SocketAddr::new(shown, self.address.port()), self.token)
    }

    /// The address that it listens on.
    pub fn address(&self) -> SocketAddr {
        self.address
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        self.hub.close();
        // Whoever waits for a visitor gets one.
        let ip = if self.address.ip().is_unspecified() { Ipv4Addr::LOCALHOST.into() } else { self.address.ip() };
        let _ = TcpStream::connect_timeout(&SocketAddr::new(ip, self.address.port()), Duration::from_secs(1));
        for thread in self.threads.drain(..) {
            let _ = thread.join();
        }
    }
}

/// Has the scene read again when its files change.
fn watch(hub: &Hub) {
    let mut slept = Duration::ZERO;
    const NAP: Duration = Duration::from_millis(50);
    while !hub.closing.load(Ordering::SeqCst) {
        std::thread::sleep(NAP);
        slept += NAP;
        if slept >= WATCH {
            slept = Duration::ZERO;
            if hub.stage.changed() {
                hub.ask(Ask::Reload);
            }
        }
    }
}

/// What those at the door need.
struct Door {
    hub: Arc<Hub>,
    token: Arc<str>,
    known: Vec<String>,
    inside: AtomicUsize,
}

fn accept(listener: &TcpListener, door: &Arc<Door>) {
    let visitors: Mutex<Vec<JoinHandle<()>>> = Mutex::default();
    for stream in listener.incoming() {
        if door.hub.closing.load(Ordering::SeqCst) {
            break;
        }
        let Ok(mut stream) = stream else {
            // Out of file descriptors: some will be free again.
            std::thread::sleep(Duration::from_millis(20));
            continue;
        };
        if door.inside.fetch_add(1, Ordering::SeqCst) >= MOST_CONNECTIONS {
            http::refuse(&mut stream, 503);
            door.inside.fetch_sub(1, Ordering::SeqCst);
            continue;
        }
        let door = door.clone();
        let visitor = std::thread::spawn(move || {
            let _inside = Inside(&door.inside);
            visit(&door, stream);
        });
        let mut visitors = crate::hub::lock(&visitors);
        visitors.retain(|v| !v.is_finished());
        visitors.push(visitor);
    }
    for visitor in visitors.into_inner().unwrap_or_default() {
        let _ = visitor.join();
    }
}

/// Counts itself out, whatever happens.
struct Inside<'a>(&'a AtomicUsize);

impl Drop for Inside<'_> {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::SeqCst);
    }
}

fn visit(door: &Door, mut stream: TcpStream) {
    let _ = stream.set_nodelay(true);
    let request = match http::read(&mut stream) {
        Ok(request) => request,
        Err(Some(status)) => return http::refuse(&mut stream, status),
        Err(None) => return,
    };
    if !http::belongs(&request, &door.known) {
        return http::refuse(&mut stream, 403);
    }
    let head = request.method == "HEAD";
    if request.method != "GET" && !head {
        return http::refuse(&mut stream, 405);
    }
    if let Some((kind, body)) = asset(&request.path) {
        return http::respond(&mut stream, 200, kind, body, None, head);
    }
    let secret = request.value("token").is_some_and(|t| http::same_secret(t, &door.token));
    match request.path.as_str() {
        "/ws" | "/picture.exr" if !secret => http::refuse(&mut stream, 403),
        "/ws" => match socket(&request, stream) {
            Ok(stream) => client::serve(&door.hub, stream),
            Err(mut stream) => http::refuse(&mut stream, 400),
        },
        "/picture.exr" => picture(door, &request, &mut stream),
        _ => http::refuse(&mut stream, 404),
    }
}

/// Shakes hands.
fn socket(request: &Request, mut stream: TcpStream) -> Result<TcpStream, TcpStream> {
    let Some(key) = &request.key else { return Err(stream) };
    let accept = tungstenite::handshake::derive_accept_key(key.as_bytes());
    let answer = format!(
        "HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Accept: {accept}\r\n\r\n"
    );
    match stream.write_all(answer.as_bytes()) {
        Ok(()) => Ok(stream),
        Err(_) => Err(stream),
    }
}

fn picture(door: &Door, request: &Request, stream: &mut TcpStream) {
    let pane = request.value("pane").and_then(|p| p.parse().ok()).unwrap_or(0);
    let (reply, answer) = sync_channel(1);
    door.hub.ask(Ask::Picture { pane, reply });
    match answer.recv_timeout(Duration::from_secs(60)) {
        Ok(Ok(bytes)) => http::respond(stream, 200, "image/x-exr", &bytes, Some("steradian.exr"), false),
        Ok(Err(why)) => http::respond(stream, 503, "text/plain; charset=utf-8", why.as_bytes(), None, false),
        Err(_) => http::refuse(stream, 503),
    }
}
