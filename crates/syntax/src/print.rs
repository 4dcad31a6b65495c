//! The tree back to text, so that parsing the result gives the same tree.

use crate::tree::{ArgValue, Directive, Signature, Values};
use std::fmt::Write;

/// Numbers per line of a long list.
const PER_LINE: usize = 12;

/// Writes directives as pbrt-v4 text: one per line, parameters indented below.
pub fn print(directives: &[Directive]) -> String {
    let mut out = String::new();
    for d in directives {
        out.push_str(d.kind.name());
        let bracketed = matches!(d.kind.signature(), Signature::Bracketed(_));
        out.push_str(if bracketed { " [" } else { "" });
        for arg in &d.args {
            match &arg.value {
                ArgValue::Number(v) => _ = write!(out, " {v}"),
                ArgValue::String(s) => _ = write!(out, " {}", quote(s)),
                ArgValue::Word(s) => _ = write!(out, " {s}"),
            }
        }
        out.push_str(if bracketed { " ]\n" } else { "\n" });
        for p in &d.params {
            let _ = write!(out, "    {} [", quote(&format!("{} {}", p.ty.keyword(), p.name)));
            match &p.values {
                Values::Floats(v) => list(&mut out, v.iter()),
                Values::Ints(v) => list(&mut out, v.iter()),
                Values::Bools(v) => list(&mut out, v.iter()),
                Values::Strings(v) => list(&mut out, v.iter().map(|(s, _)| quote(s))),
            }
            out.push_str(" ]\n");
        }
    }
    out
}

fn list<T: std::fmt::Display>(out: &mut String, values: impl Iterator<Item = T>) {
    for (i, v) in values.enumerate() {
        out.push_str(if i > 0 && i % PER_LINE == 0 { "\n        " } else { " " });
        let _ = write!(out, "{v}");
    }
}

/// A string in quotes with the escapes of the format.
pub fn quote(s: &str) -> String {
    let mut out = String::with_capacity(s.len() + 2);
    out.push('"');
    for c in s.chars() {
        match c {
            '\u{8}' => out.push_str("\\b"),
            '\u{c}' => out.push_str("\\f"),
            '\n' => out.push_str("\\n"),
            '\r' => out.push_str("\\r"),
            '\t' => out.push_str("\\t"),
            '\\' => out.push_str("\\\\"),
            '"' => out.push_str("\\\""),
            c => out.push(c),
        }
    }
    out.push('"');
    out
}
