//! Ctrl-C, and the signals that schedulers send: the first one asks to stop and write what there is, the second one ends at once.

use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};

/// Whether somebody asked to stop.
static ASKED: AtomicBool = AtomicBool::new(false);
/// Whether there is something to lose: before that, the first signal ends the process.
static WORKING: AtomicBool = AtomicBool::new(false);

/// From here on signals are ours. Where that cannot be had, they end the process as they always do.
pub(crate) fn listen() {
    static INSTALLED: OnceLock<bool> = OnceLock::new();
    INSTALLED.get_or_init(|| ctrlc::set_handler(on_signal).is_ok());
}

fn on_signal() {
    let second = ASKED.swap(true, Ordering::SeqCst);
    if second || !WORKING.load(Ordering::SeqCst) {
        #[expect(clippy::exit, reason = "a signal has no caller to return to")]
        std::process::exit(i32::from(crate::failure::INTERRUPTED));
    }
}

/// The flag that the renderer watches.
pub(crate) fn flag() -> &'static AtomicBool {
    &ASKED
}

/// While this lives, the first signal asks instead of ending.
pub(crate) struct Working;

impl Working {
    /// There is something to lose.
    pub fn begin() -> Working {
        WORKING.store(true, Ordering::SeqCst);
        Working
    }
}

impl Drop for Working {
    fn drop(&mut self) {
        WORKING.store(false, Ordering::SeqCst);
    }
}
