//! How far a render has come: a bar on a terminal, a line now and then elsewhere, JSON for programs, nothing when quiet.

use std::sync::Mutex;
use std::time::Duration;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use serde_json::{Map, Value, json};
use steradian_render::{ENDLESS_SPP, Progress, Rendered};

use crate::args::ProgressArg;
use crate::console::Console;
use crate::{numbers, stop};

/// Shows progress.
pub(crate) enum Display {
    /// A bar that redraws itself.
    Bar(ProgressBar),
    /// Lines, for files, pipes and dumb terminals.
    Lines(Console, Mutex<Duration>),
    /// One JSON object a line: see `docs/progress.schema.json`.
    Json(Console, Mutex<Duration>),
    /// Nothing.
    Silent,
}

/// The bar counts in thousandths.
const STEPS: u64 = 1000;
/// The first line comes after this time, and each later one after half as much again as has passed: few in a long render, and yet
/// never long in coming.
const FIRST_LINE: Duration = Duration::from_secs(2);
/// Programs want to know at an even pace.
const JSON_PAUSE: Duration = Duration::from_millis(500);

impl Display {
    /// What was asked for, or else suits the console.
    pub fn new(how: ProgressArg, console: &Console) -> Display {
        if how == ProgressArg::Json {
            return Display::Json(*console, Mutex::new(Duration::ZERO));
        }
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

    /// Another phase begins.
    pub fn phase(&self, name: &str) {
        if let Display::Json(console, _) = self {
            console.out(Value::Object(phase(name)));
        }
    }

    /// Shows how far it is.
    pub fn progress(&self, progress: &Progress) {
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
            Display::Json(console, next) => {
                if let Ok(mut next) = next.try_lock()
                    && progress.elapsed >= *next
                {
                    *next = progress.elapsed + JSON_PAUSE;
                    console.out(as_json(progress));
                }
            }
        }
    }

    /// Takes the bar away.
    pub fn finish(&self) {
        if let Display::Bar(bar) = self {
            bar.finish_and_clear();
        }
    }

    /// The last word to programs.
    pub fn summary(&self, rendered: &Rendered, files: &[String]) {
        if let Display::Json(console, _) = self {
            console.out(summary(rendered, files));
        }
    }
}

fn phase(name: &str) -> Map<String, Value> {
    let mut object = Map::new();
    object.insert("phase".into(), name.into());
    object.insert("memory_bytes".into(), memory().into());
    object
}

fn as_json(p: &Progress) -> Value {
    let mut object = phase("render");
    let mut set = |name: &str, value: Value| object.insert(name.to_owned(), value);
    set("percent", json!(p.fraction * 100.0));
    set("samples_per_pixel", json!(p.spp[0]));
    set("planned_samples_per_pixel", if p.spp[1] == ENDLESS_SPP { Value::Null } else { json!(p.spp[1]) });
    set("rays", json!(p.rays));
    set("rays_per_second", json!(p.rays as f64 / p.elapsed.as_secs_f64().max(1e-9)));
    set("relative_error", json!(p.error));
    set("error_bound", json!(p.bound.filter(|b| b.is_finite())));
    set("elapsed_seconds", json!(p.elapsed.as_secs_f64()));
    set("seconds_left", json!(time_left(p).map(|d| d.as_secs_f64())));
    Value::Object(object)
}

fn summary(r: &Rendered, files: &[String]) -> Value {
    let mut object = phase("done");
    let mut set = |name: &str, value: Value| object.insert(name.to_owned(), value);
    let [least, most] = r.film.samples();
    set("outcome", json!(stop::outcome_name(r.outcome)));
    set("samples_per_pixel", json!(r.film.average_samples()));
    set("least_samples_per_pixel", json!(least));
    set("most_samples_per_pixel", json!(most));
    set("rays", json!(r.rays.total()));
    set("relative_error", json!(r.error));
    set("error_bound", json!(r.bound));
    set("bad_samples", json!(r.bad_count));
    set("elapsed_seconds", json!(r.elapsed.as_secs_f64()));
    set("files", json!(files));
    Value::Object(object)
}

/// Memory in use, where the system says.
fn memory() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|l| l.strip_prefix("VmRSS:"))?;
    Some(line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()? * 1024)
}

/// `12 of 64 samples, 3.1 Mrays/s, error 4.2 %, 12 s left`.
fn describe(p: &Progress) -> String {
    let mut out = if p.spp[1] == ENDLESS_SPP {
        numbers::counted(u64::from(p.spp[0]), "sample")
    } else {
        format!("{} of {} samples", p.spp[0], p.spp[1])
    };
    out += &format!(", {:.1} Mrays/s", numbers::mega_rate(p.rays, p.elapsed));
    if let Some(error) = p.error {
        out += &format!(", error {}", percent(error));
    }
    if let Some(bound) = p.bound.filter(|b| b.is_finite()) {
        out += &format!(", bound {}", numbers::Percent(bound));
    }
    if let Some(left) = time_left(p) {
        out += &format!(", {} left", numbers::duration(left));
    }
    out
}

/// A share with two digits.
pub(crate) fn percent(v: f64) -> String {
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

    fn example() -> Progress {
        Progress {
            spp: [12, 64],
            fraction: 0.25,
            rays: 8_000_000,
            elapsed: Duration::from_secs(4),
            error: Some(0.042),
            bound: None,
        }
    }

    #[test]
    fn progress_in_words() {
        let p = example();
        assert_eq!(describe(&p), "12 of 64 samples, 2.0 Mrays/s, error 4.2 %, 12 s left");
        let start = Progress { fraction: 0.0, error: None, rays: 0, ..p };
        assert_eq!(describe(&start), "12 of 64 samples, 0.0 Mrays/s");
        let endless = Progress { spp: [12, ENDLESS_SPP], bound: Some(0.031), ..start };
        assert_eq!(describe(&endless), "12 samples, 0.0 Mrays/s, bound 3.1%");
    }

    #[test]
    fn progress_for_programs() {
        let v = as_json(&example());
        assert_eq!((&v["phase"], &v["percent"], &v["seconds_left"]), (&json!("render"), &json!(25.0), &json!(12.0)));
        assert_eq!(v["error_bound"], Value::Null);
    }
}
