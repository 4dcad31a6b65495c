//! What is wrong with an input, where, and what to do about it; and the plain text form of that.

use crate::source::{SourceMap, Span};
use std::fmt::Write;

/// How bad it is.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub enum Severity {
    /// The input cannot be used.
    Error,
    /// The input is used, but not as its author may think.
    Warning,
    /// Something worth knowing.
    Note,
}

impl Severity {
    /// The word that starts the report.
    pub fn word(self) -> &'static str {
        match self {
            Severity::Error => "error",
            Severity::Warning => "warning",
            Severity::Note => "note",
        }
    }
}

/// A second place that belongs to a diagnostic, such as the first of two definitions.
#[derive(Clone, PartialEq, Debug)]
pub struct Related {
    /// What is there.
    pub message: String,
    /// Where.
    pub span: Span,
}

/// One problem of an input.
#[derive(Clone, PartialEq, Debug)]
pub struct Diagnostic {
    /// How bad.
    pub severity: Severity,
    /// What is wrong, in one sentence without a full stop.
    pub message: String,
    /// Where, unless the whole input is meant.
    pub span: Option<Span>,
    /// What to do about it.
    pub hint: Option<String>,
    /// Other places that matter.
    pub related: Vec<Related>,
}

impl Diagnostic {
    /// A problem of the given severity.
    pub fn new(severity: Severity, message: impl Into<String>, span: impl Into<Option<Span>>) -> Diagnostic {
        Diagnostic { severity, message: message.into(), span: span.into(), hint: None, related: Vec::new() }
    }

    /// An error.
    pub fn error(message: impl Into<String>, span: impl Into<Option<Span>>) -> Diagnostic {
        Diagnostic::new(Severity::Error, message, span)
    }

    /// A warning.
    pub fn warning(message: impl Into<String>, span: impl Into<Option<Span>>) -> Diagnostic {
        Diagnostic::new(Severity::Warning, message, span)
    }

    /// A note.
    pub fn note(message: impl Into<String>, span: impl Into<Option<Span>>) -> Diagnostic {
        Diagnostic::new(Severity::Note, message, span)
    }

    /// With a hint.
    #[must_use]
    pub fn with_hint(mut self, hint: impl Into<String>) -> Diagnostic {
        self.hint = Some(hint.into());
        self
    }

    /// With the hint "did you mean `..`?" when there is something to suggest.
    #[must_use]
    pub fn with_suggestion(self, suggestion: Option<&str>) -> Diagnostic {
        match suggestion {
            Some(s) => self.with_hint(format!("did you mean `{s}`?")),
            None => self,
        }
    }

    /// With a second place.
    #[must_use]
    pub fn with_related(mut self, message: impl Into<String>, span: Span) -> Diagnostic {
        self.related.push(Related { message: message.into(), span });
        self
    }

    /// The report as plain text, each line ended by a newline:
    ///
    /// ```text
    /// error: unknown directive `Shpae`
    ///   --> scene.pbrt:12:1
    ///    |
    /// 12 | Shpae "sphere"
    ///    | ^^^^^
    ///    = help: did you mean `Shape`?
    /// ```
    pub fn render(&self, sources: &SourceMap) -> String {
        let mut out = format!("{}: {}\n", self.severity.word(), self.message);
        let gutter = match self.span {
            Some(span) => snippet(&mut out, sources, span),
            None => 1,
        };
        if let Some(hint) = &self.hint {
            let _ = writeln!(out, "{:gutter$} = help: {hint}", "");
        }
        for related in &self.related {
            let _ = writeln!(out, "note: {}", related.message);
            snippet(&mut out, sources, related.span);
        }
        out
    }
}

/// Longest stretch of a source line to show; mesh data often stands in one line of many megabytes.
const WINDOW: usize = 120;

/// Appends the place, its line and carets; returns the width of the line number.
fn snippet(out: &mut String, sources: &SourceMap, span: Span) -> usize {
    let Some(source) = sources.get(span.file) else { return 1 };
    let at = source.location(span.start);
    let number = at.line.to_string();
    let gutter = number.len();
    let line = source.line_range(span.start);
    let start = source.clamp(span.start).min(line.end);
    let end = source.clamp(span.end.max(span.start)).clamp(start, line.end);
    let (from, cut_left) = if start - line.start > WINDOW / 2 {
        (source.clamp((start - WINDOW / 3) as u32), true)
    } else {
        (line.start, false)
    };
    let to = source.clamp(line.end.min(from + WINDOW) as u32);
    let end = end.min(to).max(start);
    let dots = |cut: bool| if cut { "..." } else { "" };
    // A tab would take more than the one column that the carets give it.
    let text: String = source.text[from..to].chars().map(|c| if c.is_control() { ' ' } else { c }).collect::<String>();
    let pad = source.text[from..start].chars().count() + dots(cut_left).len();
    let carets = source.text[start..end].chars().count().max(1);
    let _ = writeln!(out, "{:gutter$}--> {}:{}:{}", "", source.name, at.line, at.column);
    let _ = writeln!(out, "{:gutter$} |", "");
    let _ = writeln!(out, "{number} | {}{}{}", dots(cut_left), text.trim_end(), dots(to < line.end));
    let _ = writeln!(out, "{:gutter$} | {:pad$}{}", "", "", "^".repeat(carets));
    gutter
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_full_report_reads_like_a_compilers() {
        let mut map = SourceMap::new();
        let id = map.add("scene.pbrt", "# one\n\tShpae \"sphere\"\n");
        let d = Diagnostic::error("unknown directive `Shpae`", Span::new(id, 7, 12))
            .with_suggestion(Some("Shape"))
            .with_related("the file starts here", Span::new(id, 0, 1));
        assert_eq!(
            d.render(&map),
            "error: unknown directive `Shpae`\n\
             \x20--> scene.pbrt:2:2\n\
             \x20 |\n\
             2 |  Shpae \"sphere\"\n\
             \x20 |  ^^^^^\n\
             \x20 = help: did you mean `Shape`?\n\
             note: the file starts here\n\
             \x20--> scene.pbrt:1:1\n\
             \x20 |\n\
             1 | # one\n\
             \x20 | ^\n"
        );
        let d = Diagnostic::warning("no lights", None).with_hint("add one");
        assert_eq!(d.render(&map), "warning: no lights\n  = help: add one\n");
    }

    #[test]
    fn a_line_of_megabytes_is_shown_as_a_window() {
        let mut map = SourceMap::new();
        let text = format!("[{} x {}]", "1 ".repeat(5000), "2 ".repeat(5000));
        let id = map.add("m", text.as_str());
        let at = text.find('x').unwrap();
        let r = Diagnostic::error("bad", Span::new(id, at, at + 1)).render(&map);
        assert!(r.len() < 500, "{r}");
        let lines: Vec<&str> = r.lines().collect();
        let caret = lines[4].find('^').unwrap();
        assert_eq!(lines[3].as_bytes()[caret], b'x', "{r}");
        assert!(lines[3].ends_with("...") && lines[3].contains("| ..."), "{r}");
    }

    #[test]
    fn spans_outside_the_text_do_not_panic() {
        let mut map = SourceMap::new();
        let id = map.add("m", "ä\nb");
        for start in 0..8 {
            for end in 0..8 {
                let r = Diagnostic::error("bad", Span { file: id, start, end }).render(&map);
                assert!(r.contains('^'));
            }
        }
        let r = Diagnostic::error("bad", Span { file: crate::FileId(7), start: 0, end: 1 }).render(&map);
        assert_eq!(r, "error: bad\n");
    }
}
