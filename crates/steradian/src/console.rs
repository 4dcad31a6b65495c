//! The one place that prints. Results go to standard output; progress, warnings and errors to standard error.

use std::fmt::Display;
use std::io::{IsTerminal, Write};

/// Where words go, and whether in colour.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Console {
    quiet: bool,
    color_out: bool,
    color_err: bool,
    /// Whether standard error is a terminal that can redraw a line.
    pub live: bool,
}

/// The colours in use, as SGR parameters.
#[derive(Clone, Copy, Debug)]
enum Paint {
    Bold,
    Red,
    Yellow,
    Cyan,
}

impl Paint {
    fn code(self) -> &'static str {
        match self {
            Paint::Bold => "1",
            Paint::Red => "1;31",
            Paint::Yellow => "1;33",
            Paint::Cyan => "1;36",
        }
    }
}

impl Console {
    /// As the environment has it: colours only on a terminal, and never under `NO_COLOR`.
    pub fn new() -> Console {
        let set = |name: &str| std::env::var_os(name).is_some_and(|v| !v.is_empty());
        let dumb = std::env::var_os("TERM").is_some_and(|v| v == "dumb");
        let colors = !set("NO_COLOR") && !dumb;
        let (out, err) = (std::io::stdout().is_terminal(), std::io::stderr().is_terminal());
        Console { quiet: false, color_out: colors && out, color_err: colors && err, live: err && !dumb }
    }

    /// The same, silent but for errors if `quiet`.
    pub fn quiet(self, quiet: bool) -> Console {
        Console { quiet, ..self }
    }

    /// Whether only errors are printed.
    pub fn is_quiet(&self) -> bool {
        self.quiet
    }

    /// A line of results.
    pub fn out(&self, line: impl Display) {
        // Whoever closed the pipe has read enough.
        let _ = writeln!(std::io::stdout().lock(), "{line}");
    }

    /// A line of results in bold.
    pub fn heading(&self, line: impl Display) {
        self.out(paint(self.color_out, Paint::Bold, line));
    }

    /// Results that carry their own line ends.
    pub fn raw(&self, bytes: &[u8]) {
        let _ = std::io::stdout().lock().write_all(bytes);
    }

    /// A line about how things are going.
    pub fn say(&self, line: impl Display) {
        if !self.quiet {
            self.err(line);
        }
    }

    /// Something the user should know.
    pub fn warning(&self, text: impl Display) {
        if !self.quiet {
            self.err(format_args!("{} {text}", paint(self.color_err, Paint::Yellow, "warning:")));
        }
    }

    /// Why it did not work.
    pub fn error(&self, text: impl Display) {
        self.err(format_args!("{} {text}", paint(self.color_err, Paint::Red, "error:")));
    }

    /// A rendered diagnostic, its first word in colour; `to_out` makes it a result.
    pub fn diagnostic(&self, text: &str, to_out: bool) {
        let color = if to_out { self.color_out } else { self.color_err };
        let mut text = text.trim_end().to_owned();
        for (word, with) in [("error:", Paint::Red), ("warning:", Paint::Yellow), ("note:", Paint::Cyan)] {
            if let Some(rest) = text.strip_prefix(word) {
                text = format!("{}{rest}", paint(color, with, word));
                break;
            }
        }
        if to_out { self.out(text) } else { self.err(text) }
    }

    fn err(&self, line: impl Display) {
        let _ = writeln!(std::io::stderr().lock(), "{line}");
    }
}

fn paint(on: bool, with: Paint, text: impl Display) -> String {
    if on { format!("\x1b[{}m{text}\x1b[0m", with.code()) } else { text.to_string() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paint_is_off_unless_asked_for() {
        assert_eq!(paint(false, Paint::Red, "x"), "x");
        assert_eq!(paint(true, Paint::Red, "x"), "\x1b[1;31mx\x1b[0m");
    }
}
