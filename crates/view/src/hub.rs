//! What the engine and the tabs share: pictures, worlds to look into, news, and what is asked.

use crate::canvas::Canvas;
use crate::reference::Reference;
use crate::stage::{Options, Stage};
use serde_json::Value;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::SyncSender;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError, RwLock};
use std::time::Duration;
use steradian_scene::World;

/// Side by side, at most.
pub(crate) const PANES: usize = 2;

/// What tabs ask of the engine.
pub(crate) enum Ask {
    /// Other options for a pane.
    Set { pane: usize, options: Options },
    /// A second pane with these options, or none.
    Compare(Option<Options>),
    /// Stop or go on.
    Pause(bool),
    /// When to stop: samples per pixel, error.
    Goal { spp: Option<u32>, error: Option<f64> },
    /// Spend samples where the picture is noisy.
    Adaptive(bool),
    /// The scene's files have changed.
    Reload,
    /// To say how things are.
    State,
    /// The picture as a file.
    Picture { pane: usize, reply: SyncSender<Result<Vec<u8>, String>> },
}

/// A world with what it was made by.
pub(crate) struct Staged {
    /// The world.
    pub world: World,
    /// The options.
    pub options: Options,
    /// As in the pane's canvas.
    pub generation: u32,
}

/// One of the pictures.
#[derive(Default)]
pub(crate) struct Pane {
    /// What it is of.
    pub staged: RwLock<Option<Staged>>,
    /// What there is to see.
    pub canvas: Mutex<Canvas>,
}

/// Something that all tabs are told when it changes.
#[derive(Clone)]
pub(crate) struct News {
    /// Counts the changes.
    pub stamp: u64,
    /// The message.
    pub text: Arc<str>,
}

impl Default for News {
    fn default() -> Self {
        Self { stamp: 0, text: "".into() }
    }
}

/// What all tabs are told.
#[derive(Default)]
pub(crate) struct Board {
    /// What is rendered, and what is wrong.
    pub state: News,
    /// How far it is.
    pub progress: News,
    /// The picture to compare with.
    pub reference: Option<Arc<Reference>>,
    /// Counts the references.
    pub references: u64,
}

/// All that is shared.
pub(crate) struct Hub {
    /// Reads scenes.
    pub stage: Arc<dyn Stage>,
    /// The pictures.
    pub panes: [Pane; PANES],
    /// What all tabs are told.
    pub board: Mutex<Board>,
    /// Makes the engine leave what it does and look at what is asked.
    pub interrupt: AtomicBool,
    /// The end.
    pub closing: AtomicBool,
    /// Threads to render with.
    pub threads: usize,
    asked: Mutex<Vec<Ask>>,
    ask_came: Condvar,
    changes: Mutex<u64>,
    changed: Condvar,
}

/// Locks are held for copies and small sums; a panic leaves nothing half done in them.
pub(crate) fn lock<T>(shared: &Mutex<T>) -> MutexGuard<'_, T> {
    shared.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Hub {
    /// Nothing is rendered yet.
    pub fn new(stage: Arc<dyn Stage>, threads: usize) -> Self {
        Self {
            stage,
            panes: Default::default(),
            board: Mutex::default(),
            interrupt: AtomicBool::new(false),
            closing: AtomicBool::new(false),
            threads,
            asked: Mutex::default(),
            ask_came: Condvar::new(),
            changes: Mutex::default(),
            changed: Condvar::new(),
        }
    }

    /// Asks the engine.
    pub fn ask(&self, ask: Ask) {
        lock(&self.asked).push(ask);
        self.interrupt.store(true, Ordering::SeqCst);
        self.ask_came.notify_all();
    }

    /// Has the engine tell all tabs how things are.
    pub fn ask_for_state(&self) {
        self.ask(Ask::State);
    }

    /// What has been asked since; waits for it up to `patience`.
    pub fn asked(&self, patience: Duration) -> Vec<Ask> {
        self.interrupt.store(false, Ordering::SeqCst);
        let asked = lock(&self.asked);
        let waiting = |asked: &mut Vec<Ask>| asked.is_empty() && !self.closing.load(Ordering::SeqCst);
        let (mut asked, _) =
            self.ask_came.wait_timeout_while(asked, patience, waiting).unwrap_or_else(PoisonError::into_inner);
        std::mem::take(&mut *asked)
    }

    /// Tells the tabs that there is something new.
    pub fn notify(&self) {
        *lock(&self.changes) += 1;
        self.changed.notify_all();
    }

    /// Waits until there is something newer than `seen`; the number of the newest.
    pub fn wait(&self, seen: u64, patience: Duration) -> u64 {
        let changes = lock(&self.changes);
        let waiting = |n: &mut u64| *n == seen;
        *self.changed.wait_timeout_while(changes, patience, waiting).unwrap_or_else(PoisonError::into_inner).0
    }

    /// Ends everything that waits.
    pub fn close(&self) {
        self.closing.store(true, Ordering::SeqCst);
        self.interrupt.store(true, Ordering::SeqCst);
        self.ask_came.notify_all();
        self.notify();
    }

    /// Publishes how things are.
    pub fn publish(&self, which: fn(&mut Board) -> &mut News, value: &Value) {
        let mut board = lock(&self.board);
        let news = which(&mut board);
        *news = News { stamp: news.stamp + 1, text: value.to_string().into() };
        drop(board);
        self.notify();
    }

    /// Looks into the world of a pane.
    pub fn with_world<T>(&self, pane: usize, f: impl FnOnce(&Staged) -> T) -> Option<T> {
        let staged = self.panes.get(pane)?.staged.read().unwrap_or_else(PoisonError::into_inner);
        staged.as_ref().map(f)
    }
}
