//! One tab: a thread that listens to it, and one that talks.
//!
//! Pictures are sent when the tab has said that it has taken in the one before: a tab that is slow, asleep or behind a thin wire holds up
//! nobody and costs no memory. Answers to its questions wait in a short queue, and while that is full no more questions are read.

use crate::explore;
use crate::hub::{Ask, Hub, PANES, lock};
use crate::message::{self, PROTOCOL, Sent};
use crate::reference;
use crate::scan;
use crate::stage::Options;
use serde::Deserialize;
use serde_json::{Value, json};
use std::collections::VecDeque;
use std::io::{self, Read, Write};
use std::net::TcpStream;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::{Condvar, Mutex, PoisonError};
use std::time::{Duration, Instant};
use tungstenite::protocol::{Role, WebSocketConfig};
use tungstenite::{Message, WebSocket};

/// A file that somebody drops into the page may be so large.
const MOST_MESSAGE: usize = 256 << 20;
/// Answers that wait.
const MOST_ANSWERS: usize = 32;
/// Pictures on their way.
const MOST_FRAMES: u32 = 2;
/// Between two pictures.
const PAUSE: Duration = Duration::from_millis(25);
/// Whoever takes nothing in for so long has gone.
const GONE: Duration = Duration::from_secs(30);

/// What a tab says.
#[derive(Deserialize)]
#[serde(tag = "type", rename_all = "kebab-case")]
enum Word {
    /// Other options for a pane.
    Set {
        pane: usize,
        options: Options,
    },
    /// A second pane, or none.
    Compare {
        options: Option<Options>,
    },
    Pause {
        on: bool,
    },
    Goal {
        spp: Option<u32>,
        error: Option<f64>,
    },
    Adaptive {
        on: bool,
    },
    /// A picture has been taken in.
    Ack {
        frame: u32,
    },
    /// Why a pixel is as it is.
    Explore {
        id: u32,
        pane: usize,
        pixel: [u32; 2],
    },
    /// One path.
    Path {
        id: u32,
        pane: usize,
        pixel: [u32; 2],
        sample: u32,
    },
    /// What the camera sees, as points.
    Scan {
        id: u32,
        pane: usize,
    },
    /// What lies under a pixel.
    Probe {
        id: u32,
        pane: usize,
        pixel: [u32; 2],
    },
    /// A picture of something else than light.
    Feature {
        id: u32,
        pane: usize,
        name: String,
    },
    /// The camera in the words of a scene.
    Pbrt {
        id: u32,
        pane: usize,
    },
    /// Keep the picture of a pane to compare with; or none.
    Keep {
        id: u32,
        pane: Option<usize>,
    },
    /// The picture to compare with.
    Reference {
        id: u32,
    },
    /// How visibly a pane differs from it.
    Flip {
        id: u32,
        pane: usize,
    },
}

/// What both threads know.
struct Tab {
    out: Mutex<VecDeque<Message>>,
    room: Condvar,
    gone: AtomicBool,
    taken: AtomicU32,
}

/// Reads from the stream; what is written is dropped. The talking thread alone writes, so that no two frames are mixed.
struct Ear(TcpStream);

impl Read for Ear {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.0.read(buffer)
    }
}

impl Write for Ear {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        Ok(bytes.len())
    }
    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// Looks after a tab until it goes.
pub(crate) fn serve(hub: &Hub, stream: TcpStream) {
    let Ok(voice) = stream.try_clone() else { return };
    let Ok(handle) = stream.try_clone() else { return };
    let config = WebSocketConfig::default().max_message_size(Some(MOST_MESSAGE)).max_frame_size(Some(MOST_MESSAGE));
    if stream.set_read_timeout(None).is_err() || voice.set_write_timeout(Some(GONE)).is_err() {
        return;
    }
    let tab =
        Tab { out: Mutex::default(), room: Condvar::new(), gone: AtomicBool::new(false), taken: AtomicU32::new(0) };
    std::thread::scope(|scope| {
        scope.spawn(|| {
            listen(hub, &tab, WebSocket::from_raw_socket(Ear(stream), Role::Server, Some(config)));
            tab.leave();
            hub.notify();
        });
        talk(hub, &tab, WebSocket::from_raw_socket(voice, Role::Server, Some(config)));
        tab.leave();
        // Ends the listening too.
        let _ = handle.shutdown(std::net::Shutdown::Both);
    });
}

impl Tab {
    fn leave(&self) {
        self.gone.store(true, Ordering::SeqCst);
        self.room.notify_all();
    }

    /// Queues a message; waits while the queue is full.
    fn say(&self, hub: &Hub, message: Message) {
        let out = lock(&self.out);
        let full = |out: &mut VecDeque<Message>| out.len() >= MOST_ANSWERS && !self.gone.load(Ordering::SeqCst);
        let mut out = self.room.wait_while(out, full).unwrap_or_else(PoisonError::into_inner);
        out.push_back(message);
        drop(out);
        hub.notify();
    }
}

fn talk(hub: &Hub, tab: &Tab, mut socket: WebSocket<TcpStream>) {
    let hello = json!({
        "type": "hello", "protocol": PROTOCOL, "version": env!("CARGO_PKG_VERSION"), "scene": hub.stage.name(),
        "threads": hub.threads,
    });
    if socket.send(Message::text(hello.to_string())).is_err() {
        return;
    }
    let (mut seen, mut frame) = (0, 0u32);
    let (mut state, mut progress) = (0, 0);
    let mut sent = [Sent::default(); PANES];
    let mut last_frame: Option<Instant> = None;
    let mut last_progress: Option<Instant> = None;
    let mut last_pane = 0;
    while !hub.closing.load(Ordering::SeqCst) && !tab.gone.load(Ordering::SeqCst) {
        let mut messages: Vec<Message> = lock(&tab.out).drain(..).collect();
        tab.room.notify_all();
        {
            let board = lock(&hub.board);
            if board.state.stamp > state {
                state = board.state.stamp;
                messages.push(Message::text(&*board.state.text));
            }
            if board.progress.stamp > progress && last_progress.is_none_or(|t| t.elapsed() > Duration::from_millis(150))
            {
                progress = board.progress.stamp;
                last_progress = Some(Instant::now());
                messages.push(Message::text(&*board.progress.text));
            }
        }
        let on_the_way = frame.wrapping_sub(tab.taken.load(Ordering::SeqCst));
        let rested = last_frame.is_none_or(|t| t.elapsed() >= PAUSE);
        if on_the_way < MOST_FRAMES && rested {
            for k in 1..=PANES {
                let pane = (last_pane + k) % PANES;
                let next = message::next_frame(pane as u32, frame + 1, &lock(&hub.panes[pane].canvas), &mut sent[pane]);
                if let Some(bytes) = next {
                    (frame, last_pane, last_frame) = (frame + 1, pane, Some(Instant::now()));
                    messages.push(Message::binary(bytes));
                    break;
                }
            }
        }
        if messages.is_empty() {
            let patience = if rested { Duration::from_millis(500) } else { PAUSE };
            seen = hub.wait(seen, patience);
            // Many small changes make one picture.
            continue;
        }
        for message in messages {
            if socket.send(message).is_err() {
                return;
            }
        }
    }
    let _ = socket.close(None);
    let _ = socket.flush();
}

fn listen(hub: &Hub, tab: &Tab, mut socket: WebSocket<Ear>) {
    loop {
        match socket.read() {
            Ok(Message::Text(text)) => match serde_json::from_str::<Word>(text.as_str()) {
                Ok(word) => {
                    // A broken rule costs its question, not the tab.
                    if catch_unwind(AssertUnwindSafe(|| obey(hub, tab, word))).is_err() {
                        let id = serde_json::from_str::<Value>(text.as_str()).ok().and_then(|v| v["id"].as_u64());
                        tab.say(hub, refusal(id.map(|id| id as u32), "the renderer broke one of its own rules here"));
                    }
                }
                Err(e) => tab.say(hub, refusal(None, &format!("this is not understood: {e}"))),
            },
            Ok(Message::Binary(bytes)) => {
                let answer = match reference::receive(hub, &bytes) {
                    Ok(id) => json!({ "type": "answer", "id": id }),
                    Err((id, why)) => json!({ "type": "refusal", "id": id, "why": why }),
                };
                tab.say(hub, Message::text(answer.to_string()));
            }
            Ok(Message::Ping(payload)) => tab.say(hub, Message::Pong(payload)),
            Ok(Message::Pong(_) | Message::Frame(_)) => {}
            Ok(Message::Close(_)) | Err(_) => return,
        }
        if tab.gone.load(Ordering::SeqCst) {
            return;
        }
    }
}

fn refusal(id: Option<u32>, why: &str) -> Message {
    Message::text(json!({ "type": "refusal", "id": id, "why": why }).to_string())
}

fn obey(hub: &Hub, tab: &Tab, word: Word) {
    match word {
        Word::Set { pane, options } => hub.ask(Ask::Set { pane, options }),
        Word::Compare { options } => hub.ask(Ask::Compare(options)),
        Word::Pause { on } => hub.ask(Ask::Pause(on)),
        Word::Goal { spp, error } => {
            let spp = spp.map(|n| n.clamp(1, steradian_render::ENDLESS_SPP));
            hub.ask(Ask::Goal { spp, error: error.filter(|e| *e > 0.0) });
        }
        Word::Adaptive { on } => hub.ask(Ask::Adaptive(on)),
        Word::Ack { frame } => {
            tab.taken.store(frame, Ordering::SeqCst);
            hub.notify();
        }
        Word::Explore { id, pane, pixel } => {
            answer(hub, tab, id, hub.with_world(pane, |s| explore::explore(hub, pane, s, pixel)));
        }
        Word::Path { id, pane, pixel, sample } => {
            answer(hub, tab, id, hub.with_world(pane, |s| explore::path(hub, s, pixel, sample)));
        }
        Word::Probe { id, pane, pixel } => {
            answer(hub, tab, id, hub.with_world(pane, |s| scan::probe(&s.world, pixel)));
        }
        Word::Pbrt { id, pane } => {
            let text = hub.with_world(pane, |s| Ok(json!(crate::look::as_pbrt(&s.world, &s.options))));
            answer(hub, tab, id, text);
        }
        Word::Keep { id, pane } => answer(hub, tab, id, Some(reference::keep(hub, pane).map(|()| Value::Null))),
        Word::Scan { id, pane } => picture(hub, tab, id, hub.with_world(pane, |s| scan::scan(id, &s.world, hub))),
        Word::Feature { id, pane, name } => {
            picture(hub, tab, id, hub.with_world(pane, |s| scan::feature(id, &s.world, &name, hub)));
        }
        Word::Reference { id } => picture(hub, tab, id, Some(reference::plane(hub, id))),
        Word::Flip { id, pane } => picture(hub, tab, id, Some(reference::flip(hub, id, pane))),
    }
}

const NO_PANE: &str = "there is no such pane";

fn answer(hub: &Hub, tab: &Tab, id: u32, result: Option<Result<Value, String>>) {
    let message = match result.unwrap_or_else(|| Err(NO_PANE.into())) {
        Ok(value) => Message::text(json!({ "type": "answer", "id": id, "value": value }).to_string()),
        Err(why) => refusal(Some(id), &why),
    };
    tab.say(hub, message);
}

fn picture(hub: &Hub, tab: &Tab, id: u32, result: Option<Result<Vec<u8>, String>>) {
    let message = match result.unwrap_or_else(|| Err(NO_PANE.into())) {
        Ok(bytes) => Message::binary(bytes),
        Err(why) => refusal(Some(id), &why),
    };
    tab.say(hub, message);
}
