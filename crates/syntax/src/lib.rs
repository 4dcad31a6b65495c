//! Scene text to a tree with spans; pure, never fails; owns `Span` and `Diagnostic`.
//!
//! The way through: [`SourceMap`] owns the texts, [`parse()`] (or [`Parser`], one directive at a time) turns one text into
//! [`Directive`]s plus [`Diagnostic`]s, [`print()`] writes a tree back. This crate knows how the pbrt-v4 language is *written*:
//! tokens, directives and their arguments, typed parameter lists. What a directive means is for the loader to say.
//!
//! Memory is bounded by a small multiple of the length of the text, and so is time.

mod diagnostic;
mod parse;
mod pieces;
mod print;
mod source;
mod suggest;
mod token;
mod tree;

pub use diagnostic::{Diagnostic, Related, Severity};
pub use parse::{Parsed, Parser, parse, parse_number};
pub use pieces::pieces;
pub use print::{print, quote};
pub use source::{FileId, Location, Source, SourceMap, Span};
pub use suggest::did_you_mean;
pub use token::{Lexer, Token, TokenKind};
pub use tree::{Arg, ArgValue, Directive, Kind, Param, ParamType, Signature, Values};
