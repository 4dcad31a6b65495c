//! Where a long text can be cut, so that its pieces can be parsed at the same time.
//!
//! Strings and comments end with their line, and a list ends before a directive at the latest: a line that begins with a
//! directive begins a new one, whatever stands before it.

use crate::tree::Kind;
use std::ops::Range;

/// Cuts a text into pieces of about `size` bytes, each but the first beginning with a directive.
pub fn pieces(text: &str, size: usize) -> Vec<Range<usize>> {
    let mut out = Vec::new();
    let mut start = 0;
    while text.len() - start > size.max(1)
        && let Some(cut) = cut_after(text, start + size.max(1))
    {
        out.push(start..cut);
        start = cut;
    }
    out.push(start..text.len());
    out
}

/// The first line from `from` on that begins with a directive.
fn cut_after(text: &str, from: usize) -> Option<usize> {
    let bytes = text.as_bytes();
    let mut at = from;
    loop {
        // A carriage return ends lines as well, but no file has only those.
        at += bytes[at..].iter().position(|&b| b == b'\n')? + 1;
        let word = &bytes[at..];
        let first = word.iter().position(|b| !matches!(b, b' ' | b'\t'))?;
        let word = &word[first..];
        let end = word.iter().position(|b| !b.is_ascii_alphabetic()).unwrap_or(word.len());
        let ends = word.get(end).is_none_or(|b| matches!(b, b' ' | b'\t' | b'\n' | b'\r' | b'"' | b'['));
        if ends && std::str::from_utf8(&word[..end]).ok().and_then(Kind::from_name).is_some() {
            return Some(at);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{FileId, Parser};

    #[test]
    fn pieces_are_read_as_the_whole() {
        let part = "Shape \"trianglemesh\" # Shape\n  \"point3 P\" [ 0 0 0\n 1 0 0 0 1 0 ]\n\"string Shape\nTranslate 1 2 3\r\n\
            AttributeBegin\n\tNoDirective 5\nä Identity\nShaped\nRotate\n 1 2 3 4\n  Film \"rgb\" \"float iso\" [ 3 \nScale 1 1 1\n";
        let text = format!("\u{feff}{}", part.repeat(20));
        let read = |range: Range<usize>| {
            let mut parser = Parser::of_piece(FileId(0), &text, range);
            let directives: Vec<_> = std::iter::from_fn(|| parser.next_directive()).collect();
            (directives, parser.take_diagnostics())
        };
        let whole = read(0..text.len());
        assert!(whole.0.len() > 80 && whole.1.len() > 40);
        for size in [0, 1, 50, 333, 5000] {
            let pieces = pieces(&text, size);
            assert!(pieces.len() > 1 || size == 5000);
            assert_eq!(pieces.iter().map(|p| p.len()).sum::<usize>(), text.len());
            let (mut directives, mut diagnostics) = (Vec::new(), Vec::new());
            for piece in pieces {
                let (mut d, mut problems) = read(piece);
                directives.append(&mut d);
                diagnostics.append(&mut problems);
            }
            assert_eq!(directives, whole.0, "{size}");
            assert_eq!(diagnostics.len(), whole.1.len(), "{size}");
            assert!(diagnostics.iter().zip(&whole.1).all(|(a, b)| a.message == b.message && a.span == b.span));
        }
    }
}
