//! Files that a scene includes, read before their turn and parsed on other threads meanwhile. What they say is obeyed in the order of the
//! text, so that nothing tells how many threads there were.

use super::{Loader, PIECE, Parsed, read_all_of};
use std::any::Any;
use std::collections::{BTreeMap, VecDeque};
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::path::PathBuf;
use std::sync::{Arc, mpsc};
use steradian_syntax::{FileId, Kind, Parser};

/// So many files are held parsed at a time. The same for any number of threads, as files are numbered when they are read.
const AHEAD: usize = 16;

/// What comes of a parser on another thread, its panic included.
type Answer = Result<Vec<Parsed>, Box<dyn Any + Send>>;

/// See above.
#[derive(Default)]
pub(super) struct Ahead {
    paths: VecDeque<PathBuf>,
    answers: BTreeMap<FileId, mpsc::Receiver<Answer>>,
}

impl Loader<'_> {
    /// Begins with the files that the outermost text includes, if they are several. Not from one of the threads that parse.
    pub(super) fn look_ahead(&mut self, file: FileId, text: &str) {
        if file != FileId(0) || !(text.contains("Import") || text.contains("Include")) {
            return;
        }
        let mut parser = Parser::new(file, text).accepting_v3(self.is_v3);
        let directives = std::iter::from_fn(|| parser.next_directive());
        let names = directives.filter(|d| matches!(d.kind, Kind::Include | Kind::Import));
        let mut names: Vec<String> = names.map(|d| d.text(0).to_owned()).collect();
        names.dedup();
        if names.len() > 1 && rayon::current_thread_index().is_none() {
            self.ahead.paths = names.iter().map(|name| self.resolve(name)).collect();
            self.go_on_ahead();
        }
    }

    /// What was parsed of a file before its turn, if anything.
    pub(super) fn parsed_ahead(&mut self, file: FileId) -> Option<Vec<Parsed>> {
        let answer = self.ahead.answers.remove(&file)?;
        let read = answer.recv().ok()?.unwrap_or_else(|bug| resume_unwind(bug));
        self.go_on_ahead();
        Some(read)
    }

    fn go_on_ahead(&mut self) {
        while self.ahead.answers.len() < AHEAD {
            let Some(path) = self.ahead.paths.pop_front() else { return };
            // What cannot be read is reported when it is its turn.
            let Ok(file) = self.open(&path) else { continue };
            let Some(text) = self.sources.get(file).map(|s| Arc::clone(&s.text)) else { continue };
            if file == FileId(0) || text.len() > 2 * PIECE || self.ahead.answers.contains_key(&file) {
                continue;
            }
            let (send, receive) = mpsc::channel();
            let is_v3 = self.is_v3;
            rayon::spawn(move || {
                let parse = || read_all_of(Parser::new(file, &text).accepting_v3(is_v3));
                // Nobody listens any more where the load has ended.
                let _ = send.send(catch_unwind(AssertUnwindSafe(parse)));
            });
            self.ahead.answers.insert(file, receive);
        }
    }
}
