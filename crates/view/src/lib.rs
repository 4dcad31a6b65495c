//! The live page: an HTTP and WebSocket server on this machine, the progressive render behind it, and the path explorer.
//!
//! One render serves any number of tabs. What the render is of is said in the words of the command line ([`Options`]), so that
//! whatever is seen can be had again by a command. The protocol is described in `docs/view-protocol.md`.

mod assets;
mod canvas;
mod client;
mod engine;
mod explore;
mod http;
mod hub;
mod look;
mod message;
mod pass;
mod path;
mod reference;
mod scan;
mod serve;
mod stage;

pub use serve::{Refusal, Server, Settings, start};
pub use stage::{Options, Said, Stage};
