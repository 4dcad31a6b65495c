//! `--tev`: the picture in the viewer tev (<https://github.com/Tom94/tev>), tile by tile while it is rendered.
//!
//! A packet is its length in bytes, these four included, a byte for its kind, and its fields; numbers little endian, texts
//! ended by a zero. Kind 4 creates an image, kind 5 replaces a rectangle of some of its channels, plane after plane.
//!
//! A thread of its own talks to the viewer. Rendering never waits for it: tiles that it has no time for are left out, and sent
//! with the rest of the picture at the end of a pass.

use std::io::Write;
use std::net::{TcpStream, ToSocketAddrs};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::sync::{Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

use steradian_image::Metadata;
use steradian_render::{Film, Tile};

use crate::failure::{Failure, reason};

/// The port that tev listens on unless told otherwise.
const PORT: u16 = 14158;
/// A viewer that takes longer to answer or to read is not there.
const PATIENCE: Duration = Duration::from_secs(5);
/// So many packets may wait for the viewer.
const QUEUE: usize = 256;
const CREATE: u8 = 4;
const UPDATE: u8 = 5;
const CHANNELS: [&str; 3] = ["R", "G", "B"];

/// A connection to the viewer.
pub(crate) struct Tev {
    name: String,
    queue: Mutex<Option<SyncSender<Vec<u8>>>>,
    /// Whether a tile was left out since the last whole picture.
    behind: AtomicBool,
    thread: Mutex<Option<JoinHandle<()>>>,
    failure: std::sync::Arc<Mutex<Option<String>>>,
}

/// Connects to `HOST` or `HOST:PORT`.
///
/// # Errors
/// If nobody listens there.
pub(crate) fn connect(host: &str) -> Result<TcpStream, Failure> {
    let address = if has_port(host) { host.to_owned() } else { format!("{host}:{PORT}") };
    let refused = |why: String| Failure::Environment(format!("cannot reach tev at {address}: {why}"));
    let places = address.to_socket_addrs().map_err(|e| refused(reason(&e)))?;
    let mut last = refused("the name means nothing".into());
    for place in places {
        match TcpStream::connect_timeout(&place, PATIENCE) {
            Ok(stream) => return Ok(stream),
            Err(e) => last = refused(reason(&e)),
        }
    }
    Err(last)
}

impl Tev {
    /// Shows an empty picture called `name`.
    pub fn start(stream: TcpStream, name: &str, manifest: &Metadata) -> Tev {
        let (queue, packets) = sync_channel(QUEUE);
        let failure = std::sync::Arc::new(Mutex::new(None));
        let report = failure.clone();
        let thread = std::thread::spawn(move || {
            if let Err(e) = talk(stream, &packets) {
                let what = format!("tev has gone: {}", reason(&e));
                *report.lock().unwrap_or_else(PoisonError::into_inner) = Some(what);
            }
        });
        let size = manifest.frame.map(|f| [f.width, f.height]).unwrap_or_default();
        let tev = Tev {
            name: name.to_owned(),
            queue: Mutex::new(Some(queue)),
            behind: AtomicBool::new(false),
            thread: Mutex::new(Some(thread)),
            failure,
        };
        // The whole frame, of which a crop fills a part.
        tev.send(create(name, size));
        tev
    }

    /// Shows a tile.
    pub fn tile(&self, tile: &Tile) {
        let pixels: Vec<[f32; 3]> = (0..tile.len()).map(|i| tile.sum(i).mean(tile.samples())).collect();
        if !self.send(update(&self.name, tile.origin, tile.size, &pixels)) {
            self.behind.store(true, Ordering::Relaxed);
        }
    }

    /// The end of a pass: sends the whole picture if something was left out.
    pub fn pass(&self, film: &Film) {
        if self.behind.swap(false, Ordering::Relaxed) && !self.send(self.whole(film)) {
            self.behind.store(true, Ordering::Relaxed);
        }
    }

    /// Sends the picture as it is at the end, and waits until the viewer has it.
    pub fn finish(&self, film: &Film) {
        let queue = self.queue.lock().unwrap_or_else(PoisonError::into_inner).take();
        if let Some(queue) = queue {
            // The thread is gone only if the viewer is, and says so.
            let _ = queue.send(self.whole(film));
        }
        let thread = self.thread.lock().unwrap_or_else(PoisonError::into_inner).take();
        // A panic there is one of the standard library.
        let _ = thread.map(JoinHandle::join);
    }

    /// Why the viewer is gone, once.
    pub fn take_failure(&self) -> Option<String> {
        self.failure.lock().unwrap_or_else(PoisonError::into_inner).take()
    }

    fn whole(&self, film: &Film) -> Vec<u8> {
        let size = film.size().map(|n| n as u32);
        update(&self.name, [film.bounds[0], film.bounds[2]], size, &film.mean())
    }

    /// Whether the packet will be sent.
    fn send(&self, packet: Vec<u8>) -> bool {
        match self.queue.lock().unwrap_or_else(PoisonError::into_inner).as_ref() {
            Some(queue) => !matches!(queue.try_send(packet), Err(TrySendError::Full(_))),
            None => false,
        }
    }
}

fn talk(mut stream: TcpStream, packets: &Receiver<Vec<u8>>) -> std::io::Result<()> {
    stream.set_write_timeout(Some(PATIENCE))?;
    for packet in packets {
        stream.write_all(&packet)?;
    }
    stream.flush()
}

/// Whether the last part of a host is a port; an IPv6 address in brackets has colons of its own.
fn has_port(host: &str) -> bool {
    let rest = host.rsplit_once(']').map_or(host, |(_, rest)| rest);
    rest.rsplit_once(':').is_some_and(|(_, port)| port.parse::<u16>().is_ok())
}

fn create(name: &str, size: [usize; 2]) -> Vec<u8> {
    let mut p = begin(CREATE, true, name);
    size.iter().for_each(|&n| p.extend((n as i32).to_le_bytes()));
    channels(&mut p);
    end(p)
}

fn update(name: &str, origin: [u32; 2], size: [u32; 2], pixels: &[[f32; 3]]) -> Vec<u8> {
    let mut p = begin(UPDATE, false, name);
    channels(&mut p);
    origin.iter().chain(&size).for_each(|&n| p.extend((n as i32).to_le_bytes()));
    for c in 0..CHANNELS.len() {
        pixels.iter().for_each(|pixel| p.extend(pixel[c].to_le_bytes()));
    }
    end(p)
}

fn begin(kind: u8, grab_focus: bool, name: &str) -> Vec<u8> {
    let mut p = vec![0, 0, 0, 0, kind, u8::from(grab_focus)];
    text(&mut p, name);
    p
}

fn channels(p: &mut Vec<u8>) {
    p.extend((CHANNELS.len() as i32).to_le_bytes());
    CHANNELS.iter().for_each(|name| text(p, name));
}

fn text(p: &mut Vec<u8>, text: &str) {
    p.extend(text.bytes().filter(|&b| b != 0));
    p.push(0);
}

fn end(mut p: Vec<u8>) -> Vec<u8> {
    let length = (p.len() as u32).to_le_bytes();
    p[..4].copy_from_slice(&length);
    p
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Bytes as the viewer's own reader takes them apart.
    #[test]
    fn packets() {
        let p = create("a.exr", [640, 360]);
        assert_eq!(p[..4], (p.len() as u32).to_le_bytes());
        assert_eq!(p[4..12], [4, 1, b'a', b'.', b'e', b'x', b'r', 0]);
        assert_eq!(p[12..24], [128, 2, 0, 0, 104, 1, 0, 0, 3, 0, 0, 0]);
        assert_eq!(&p[24..], b"R\0G\0B\0");
        let p = update("a", [16, 32], [2, 1], &[[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]);
        assert_eq!(p[4..8], [5, 0, b'a', 0]);
        assert_eq!(p[8..18], [3, 0, 0, 0, b'R', 0, b'G', 0, b'B', 0]);
        assert_eq!(p[18..34], [16, 0, 0, 0, 32, 0, 0, 0, 2, 0, 0, 0, 1, 0, 0, 0]);
        let floats: Vec<f32> = p[34..].chunks(4).map(|b| f32::from_le_bytes(b.try_into().unwrap())).collect();
        assert_eq!(floats, [1.0, 4.0, 2.0, 5.0, 3.0, 6.0], "plane after plane");
    }

    #[test]
    fn ports() {
        let with = ["localhost:1", "[::1]:14158", "10.0.0.1:80"];
        let without = ["localhost", "[::1]", "10.0.0.1", "host:"];
        assert!(with.iter().all(|h| has_port(h)) && without.iter().all(|h| !has_port(h)));
    }
}
