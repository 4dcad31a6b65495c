//! How far a render has come: a bar on a terminal, a line now and then elsewhere, nothing when quiet.

use std::sync::Mutex;
use std::time::Duration;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use steradian_render::{Observer, Progress};

use crate::console::Console;
use crate::numbers;

/// Shows progress.
pub(crate) enum Display {
    /// A bar that redraws itself.
    Bar(ProgressBar),
    /// Lines, for files, pipes and dumb terminals.
    Lines(Console, Mutex<Duration>),
    /// Nothing.
    Silent,
}

/// The bar counts in thousandths.
const STEPS: u64 = 1000;
/// The first line comes after this time, and each later one after half as much again as has passed: few in a long render, and yet
/// never long in coming.
const FIRST_LINE: Duration = Duration::from_secs(2);

impl Display {
    /// What suits the console.
    pub fn new(console: &Console) -> Display {
        if console.is_quiet() {
            return Display::Silent;
        }
        if !console.live {
            return Display::Lines(*console, Mutex::new(FIRST_LINE));
        }
        let bar = ProgressBar::with_draw_target(Some(STEPS), ProgressDrawTarget::stderr_with_hz(10));
        if let Ok(style) = ProgressStyle::with_template("{bar:30} {percent:>3}%  {msg}") {
            bar.set_style(style);
        }
        Display::Bar(bar)
    }

    /// Takes the bar away.
    pub fn finish(&self) {
        if let Display::Bar(bar) = self {
            bar.finish_and_clear();
        }
    }
}

impl Observer for Display {
    fn progress(&self, progress: &Progress) {
        match self {
            Display::Silent => {}
            Display::Bar(bar) => {
                bar.set_position((progress.fraction * STEPS as f64) as u64);
                bar.set_message(describe(progress));
            }
            Display::Lines(console, next) => {
                // Whoever finds the lock taken has nothing to add.
                if let Ok(mut next) = next.try_lock()
                    && progress.elapsed >= *next
                {
                    *next = progress.elapsed.mul_f64(1.5);
                    console.say(format_args!("{:3.0}%  {}", progress.fraction * 100.0, describe(progress)));
                }
            }
        }
    }
}

/// `12 of 64 samples, 3.1 Mrays/s, error 4.2 %, 12 s left`.
fn describe(p: &Progress) -> String {
    let mut out = format!("{} of {} samples", p.spp[0], p.spp[1]);
    out += &format!(", {:.1} Mrays/s", numbers::mega_rate(p.rays, p.elapsed));
    if let Some(error) = p.relative_error {
        out += &format!(", error {}", percent(error));
    }
    if let Some(left) = time_left(p) {
        out += &format!(", {} left", numbers::duration(left));
    }
    out
}

/// A share with two digits.
pub(crate) fn percent(v: f32) -> String {
    let v = v * 100.0;
    if v < 10.0 { format!("{v:.1} %") } else { format!("{v:.0} %") }
}

/// By the rate so far; unknown at the very start.
fn time_left(p: &Progress) -> Option<Duration> {
    let left = p.elapsed.as_secs_f64() * (1.0 - p.fraction) / p.fraction;
    (p.fraction > 0.0).then(|| Duration::try_from_secs_f64(left).ok()).flatten()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn progress_in_words() {
        let p = Progress {
            spp: [12, 64],
            fraction: 0.25,
            rays: 8_000_000,
            elapsed: Duration::from_secs(4),
            relative_error: Some(0.042),
            bound: None,
        };
        assert_eq!(describe(&p), "12 of 64 samples, 2.0 Mrays/s, error 4.2 %, 12 s left");
        let start = Progress { fraction: 0.0, relative_error: None, rays: 0, ..p };
        assert_eq!(describe(&start), "12 of 64 samples, 0.0 Mrays/s");
    }
}
