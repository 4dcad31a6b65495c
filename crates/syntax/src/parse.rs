//! Tokens to directives. A problem becomes a diagnostic, and reading goes on at the next directive.

use crate::diagnostic::Diagnostic;
use crate::source::{FileId, Span};
use crate::suggest::did_you_mean;
use crate::token::{Lexer, Token, TokenKind};
use crate::tree::{Arg, ArgValue, Directive, Kind, Param, ParamType, Signature, Values};

/// A parsed text.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Parsed {
    /// What could be read, in order.
    pub directives: Vec<Directive>,
    /// What could not.
    pub diagnostics: Vec<Diagnostic>,
}

/// Reads a whole text.
pub fn parse(file: FileId, text: &str) -> Parsed {
    let mut parser = Parser::new(file, text);
    let mut directives = Vec::new();
    while let Some(d) = parser.next_directive() {
        directives.push(d);
    }
    Parsed { directives, diagnostics: parser.take_diagnostics() }
}

/// A text that is all wrong would give a report per byte; nobody reads more than this.
const MOST_DIAGNOSTICS: usize = 100;

/// Reads a text one directive at a time, so that a mesh of a gigabyte is never held twice.
pub struct Parser<'a> {
    file: FileId,
    lexer: Lexer<'a>,
    diagnostics: Vec<Diagnostic>,
    reported: usize,
    accepts_v3: bool,
}

impl<'a> Parser<'a> {
    /// At the start of a text.
    pub fn new(file: FileId, text: &'a str) -> Parser<'a> {
        Parser { file, lexer: Lexer::new(text), diagnostics: Vec::new(), reported: 0, accepts_v3: false }
    }

    /// At the start of one of the [`pieces()`](crate::pieces()) of a text, to its end.
    pub fn of_piece(file: FileId, text: &'a str, piece: std::ops::Range<usize>) -> Parser<'a> {
        let lexer = Lexer::new(&text[..piece.end]).from(piece.start);
        Parser { lexer, ..Parser::new(file, text) }
    }

    /// Whether the types of pbrt-v3 (`point`, `vector`, `color`) and truth in quotes are taken without a word.
    #[must_use]
    pub fn accepting_v3(self, accepts_v3: bool) -> Self {
        Self { accepts_v3, ..self }
    }

    /// The problems found since the last call.
    pub fn take_diagnostics(&mut self) -> Vec<Diagnostic> {
        std::mem::take(&mut self.diagnostics)
    }

    /// The next directive that can be read; `None` at the end of the text.
    pub fn next_directive(&mut self) -> Option<Directive> {
        loop {
            let token = self.lexer.next()?;
            let word = self.lexer.slice(token);
            let kind = match token.kind {
                TokenKind::Word => Kind::from_name(word),
                _ => None,
            };
            let Some(kind) = kind else {
                self.report_stray(token);
                self.skip_to_directive();
                continue;
            };
            let directive = Directive { kind, span: self.span(token), args: Vec::new(), params: Vec::new() };
            match self.directive_rest(directive) {
                Some(d) => return Some(d),
                None => self.skip_to_directive(),
            }
        }
    }

    fn span(&self, token: Token) -> Span {
        Span::new(self.file, token.start, token.end)
    }

    fn report(&mut self, diagnostic: Diagnostic) {
        self.reported += 1;
        if self.reported <= MOST_DIAGNOSTICS {
            self.diagnostics.push(diagnostic);
        } else if self.reported == MOST_DIAGNOSTICS + 1 {
            let message = format!("more than {MOST_DIAGNOSTICS} problems; the rest of this file's are not shown");
            self.diagnostics.push(Diagnostic::note(message, diagnostic.span));
        }
    }

    fn report_stray(&mut self, token: Token) {
        let span = self.span(token);
        let word = self.lexer.slice(token);
        let d = match token.kind {
            TokenKind::Unclosed => unclosed(span),
            TokenKind::Word if word.starts_with(|c: char| c.is_alphabetic()) => {
                Diagnostic::error(format!("unknown directive `{}`", shorten(word)), span)
                    .with_suggestion(did_you_mean(word, Kind::ALL.iter().map(|k| k.name())))
            }
            _ => Diagnostic::error(format!("expected a directive, found `{}`", shorten(word)), span),
        };
        self.report(d);
    }

    /// Leaves the lexer in front of the next word that is a directive.
    fn skip_to_directive(&mut self) {
        loop {
            match self.lexer.peek() {
                None => return,
                Some(t) if t.kind == TokenKind::Word && Kind::from_name(self.lexer.slice(t)).is_some() => return,
                Some(_) => _ = self.lexer.next(),
            }
        }
    }

    /// Arguments and parameters; `None` (reported) when the arguments are not as the directive needs them.
    fn directive_rest(&mut self, mut d: Directive) -> Option<Directive> {
        match d.kind.signature() {
            Signature::Nothing => {}
            Signature::Strings(n) => self.strings(&mut d, n)?,
            Signature::OneOrTwoStrings => {
                self.strings(&mut d, 1)?;
                if self.lexer.peek().is_some_and(|t| t.kind == TokenKind::Quoted) {
                    self.strings(&mut d, 1)?;
                }
            }
            Signature::Params(n) => {
                self.strings(&mut d, n)?;
                self.params(&mut d);
            }
            Signature::Numbers(n) => self.numbers(&mut d, n)?,
            Signature::Bracketed(n) => {
                let open = self.lexer.peek().filter(|t| t.kind == TokenKind::Open);
                if open.is_none() {
                    let found = self.found();
                    self.expected(&d, &format!("`[` and {n} numbers"), found);
                    return None;
                }
                self.lexer.next();
                self.numbers(&mut d, n)?;
                match self.lexer.peek() {
                    Some(t) if t.kind == TokenKind::Close => _ = self.lexer.next(),
                    found => {
                        self.expected(&d, &format!("`]` after {n} numbers"), found);
                        return None;
                    }
                }
            }
            Signature::Word => {
                let token = self.word(&d, "a word")?;
                let value = ArgValue::Word(self.lexer.slice(token).to_string());
                d.args.push(Arg { value, span: self.span(token) });
            }
            Signature::Option => {
                self.strings(&mut d, 1)?;
                if self.lexer.peek().is_some_and(|t| t.kind == TokenKind::Quoted) {
                    self.strings(&mut d, 1)?;
                } else {
                    let token = self.word(&d, "a value")?;
                    let value = ArgValue::Word(self.lexer.slice(token).to_string());
                    d.args.push(Arg { value, span: self.span(token) });
                }
            }
        }
        Some(d)
    }

    fn found(&self) -> Option<Token> {
        self.lexer.peek()
    }

    fn expected(&mut self, d: &Directive, what: &str, found: Option<Token>) {
        let name = d.kind.name();
        let diagnostic = match found {
            None => Diagnostic::error(format!("expected {what} after `{name}`, found the end of the file"), d.span),
            Some(t) if t.kind == TokenKind::Unclosed => unclosed(self.span(t)),
            Some(t) => {
                let word = shorten(self.lexer.slice(t));
                Diagnostic::error(format!("expected {what} after `{name}`, found `{word}`"), self.span(t))
            }
        };
        self.report(diagnostic);
    }

    fn strings(&mut self, d: &mut Directive, n: usize) -> Option<()> {
        for _ in 0..n {
            match self.found() {
                Some(t) if t.kind == TokenKind::Quoted => {
                    self.lexer.next();
                    let value = ArgValue::String(self.unquote(t));
                    d.args.push(Arg { value, span: self.span(t) });
                }
                found => {
                    self.expected(d, "a string in quotes", found);
                    return None;
                }
            }
        }
        Some(())
    }

    fn word(&mut self, d: &Directive, what: &str) -> Option<Token> {
        match self.found() {
            Some(t) if t.kind == TokenKind::Word && Kind::from_name(self.lexer.slice(t)).is_none() => self.lexer.next(),
            found => {
                self.expected(d, what, found);
                None
            }
        }
    }

    fn numbers(&mut self, d: &mut Directive, n: usize) -> Option<()> {
        for i in 0..n {
            let found = self.found();
            let value = match found {
                Some(t) if t.kind == TokenKind::Word => parse_number(self.lexer.slice(t)),
                _ => None,
            };
            match (value, found) {
                (Some(v), Some(t)) => {
                    self.lexer.next();
                    d.args.push(Arg { value: ArgValue::Number(v), span: self.span(t) });
                }
                _ => {
                    self.expected(d, &format!("{n} numbers (this is number {})", i + 1), found);
                    return None;
                }
            }
        }
        Some(())
    }

    /// The text of a quoted token with its escapes resolved; an unknown escape is reported and kept as it stands.
    fn unquote(&mut self, token: Token) -> String {
        let inner = &self.lexer.slice(token)[1..token.end - token.start - 1];
        if !inner.contains('\\') {
            return inner.to_string();
        }
        let mut out = String::with_capacity(inner.len());
        let mut chars = inner.char_indices();
        while let Some((at, c)) = chars.next() {
            if c != '\\' {
                out.push(c);
                continue;
            }
            match chars.next().map(|(_, c)| c) {
                Some('b') => out.push('\u{8}'),
                Some('f') => out.push('\u{c}'),
                Some('n') => out.push('\n'),
                Some('r') => out.push('\r'),
                Some('t') => out.push('\t'),
                Some(c @ ('\\' | '\'' | '"')) => out.push(c),
                other => {
                    let other = other.unwrap_or('\\');
                    let start = token.start + 1 + at;
                    let span = Span::new(self.file, start, start + 1 + other.len_utf8());
                    self.report(
                        Diagnostic::error(format!("unknown escape `\\{other}` in a string"), span)
                            .with_hint("write a backslash as `\\\\`, or `/` in the path of a file"),
                    );
                    out.push('\\');
                    out.push(other);
                }
            }
        }
        out
    }

    /// Parameters up to the first token that is not a quoted string. A bad one is reported and left out.
    fn params(&mut self, d: &mut Directive) {
        loop {
            match self.lexer.peek() {
                Some(t) if t.kind == TokenKind::Quoted => {
                    self.lexer.next();
                    if let Some(p) = self.param(t) {
                        d.params.push(p);
                    }
                }
                Some(t) if t.kind == TokenKind::Unclosed => {
                    self.lexer.next();
                    let span = self.span(t);
                    self.report(unclosed(span));
                    self.skip_to_directive();
                    return;
                }
                _ => return,
            }
        }
    }

    fn param(&mut self, token: Token) -> Option<Param> {
        let span = self.span(token);
        let text = self.unquote(token);
        let mut parts = text.split([' ', '\t']).filter(|s| !s.is_empty());
        let ty = match (parts.next(), parts.next()) {
            (Some(keyword), Some(name)) => self.param_type(keyword, span).map(|ty| (ty, name.to_string())),
            _ => {
                self.report(
                    Diagnostic::error(
                        format!("expected a parameter `\"type name\"`, found \"{}\"", shorten(&text)),
                        span,
                    )
                    .with_hint("a parameter is written as `\"float radius\" 2`"),
                );
                None
            }
        };
        let Some((ty, name)) = ty else {
            self.skip_value();
            return None;
        };
        let (values, values_span) = self.values(ty, &name, span)?;
        Some(Param { ty, name, span, values_span, values })
    }

    fn param_type(&mut self, keyword: &str, span: Span) -> Option<ParamType> {
        if let Some(ty) = ParamType::from_keyword(keyword) {
            return Some(ty);
        }
        // Names of pbrt-v3: what is meant is certain, so the rest of the file can still be checked.
        let renamed = match keyword {
            "point" => Some(ParamType::Point3),
            "vector" => Some(ParamType::Vector3),
            "color" => Some(ParamType::Rgb),
            "normal3" => Some(ParamType::Normal),
            _ => None,
        };
        if self.accepts_v3 && renamed.is_some() {
            return renamed;
        }
        let d = Diagnostic::error(format!("unknown parameter type `{}`", shorten(keyword)), span);
        let d = match renamed {
            Some(ty) => d.with_hint(format!("pbrt-v4 calls it `{}`", ty.keyword())),
            None => d.with_suggestion(did_you_mean(keyword, ParamType::ALL.iter().map(|t| t.keyword()))),
        };
        self.report(d);
        renamed
    }

    /// Passes over the value of a parameter that cannot be used.
    fn skip_value(&mut self) {
        match self.lexer.peek() {
            Some(t) if t.kind == TokenKind::Open => {
                self.lexer.next();
                while let Some(t) = self.lexer.peek() {
                    if t.kind == TokenKind::Word && Kind::from_name(self.lexer.slice(t)).is_some() {
                        return;
                    }
                    self.lexer.next();
                    if t.kind == TokenKind::Close {
                        return;
                    }
                }
            }
            Some(t) if t.kind == TokenKind::Word && Kind::from_name(self.lexer.slice(t)).is_none() => {
                self.lexer.next();
            }
            // A string may be the value or the next parameter: it is the next if it reads like one.
            Some(t) if t.kind == TokenKind::Quoted => {
                let text = self.lexer.slice(t);
                let first = text[1..].split([' ', '\t', '"']).find(|s| !s.is_empty()).unwrap_or("");
                if ParamType::from_keyword(first).is_none() {
                    self.lexer.next();
                }
            }
            _ => {}
        }
    }

    /// One bare value or a bracketed list. `None` (reported) when there is no value of the right kind.
    fn values(&mut self, ty: ParamType, name: &str, declared: Span) -> Option<(Values, Span)> {
        let mut values = match ty {
            ParamType::Integer => Values::Ints(Vec::new()),
            ParamType::Bool => Values::Bools(Vec::new()),
            ParamType::String | ParamType::Texture => Values::Strings(Vec::new()),
            _ => Values::Floats(Vec::new()),
        };
        let first = self.lexer.peek();
        let is_directive =
            |lexer: &Lexer, t: Token| t.kind == TokenKind::Word && Kind::from_name(lexer.slice(t)).is_some();
        match first {
            Some(t) if t.kind == TokenKind::Open => {
                self.lexer.next();
                let mut good = true;
                loop {
                    match self.lexer.peek() {
                        Some(t) if t.kind == TokenKind::Close => {
                            self.lexer.next();
                            return good.then(|| (values, self.span(first.unwrap_or(t)).to(self.span(t))));
                        }
                        Some(v) if v.kind != TokenKind::Open && !is_directive(&self.lexer, v) => {
                            self.lexer.next();
                            // One report per list is enough.
                            good = good && self.value(&mut values, ty, name, v);
                        }
                        _ => {
                            let span = self.span(t);
                            self.report(Diagnostic::error(
                                format!("the `[` of parameter `{name}` is not closed"),
                                span,
                            ));
                            return None;
                        }
                    }
                }
            }
            Some(t) if matches!(t.kind, TokenKind::Word | TokenKind::Quoted) && !is_directive(&self.lexer, t) => {
                self.lexer.next();
                let span = self.span(t);
                self.value(&mut values, ty, name, t).then_some((values, span))
            }
            _ => {
                self.report(Diagnostic::error(format!("parameter `{name}` has no value"), declared));
                None
            }
        }
    }

    /// Appends one value; false (reported) when it is not of the parameter's kind.
    #[inline]
    fn value(&mut self, values: &mut Values, ty: ParamType, name: &str, token: Token) -> bool {
        let text = self.lexer.slice(token);
        if token.kind == TokenKind::Word {
            match values {
                Values::Floats(v) => {
                    if let Some(x) = parse_number(text) {
                        v.push(x);
                        return true;
                    }
                }
                Values::Ints(v) => {
                    if let Ok(x) = text.parse::<i32>() {
                        v.push(x);
                        return true;
                    }
                }
                Values::Bools(v) => {
                    if let "true" | "false" = text {
                        v.push(text == "true");
                        return true;
                    }
                }
                Values::Strings(_) => {}
            }
        } else if token.kind == TokenKind::Quoted {
            if ty == ParamType::Spectrum && values.is_empty() && matches!(values, Values::Floats(_)) {
                *values = Values::Strings(Vec::new());
            }
            if let (Values::Bools(v), true, "\"true\"" | "\"false\"") = (&mut *values, self.accepts_v3, text) {
                v.push(text == "\"true\"");
                return true;
            }
            if matches!(values, Values::Strings(_)) {
                let string = (self.unquote(token), self.span(token));
                if let Values::Strings(v) = values {
                    v.push(string);
                }
                return true;
            }
        }
        self.wrong_value(values, ty, name, token);
        false
    }

    fn wrong_value(&mut self, values: &Values, ty: ParamType, name: &str, token: Token) {
        let span = self.span(token);
        let text = self.lexer.slice(token);
        let expected = match values {
            Values::Floats(_) => "a number",
            Values::Ints(_) => "an integer",
            Values::Bools(_) => "`true` or `false`",
            Values::Strings(_) => "a string in quotes",
        };
        let shown = shorten(text);
        // `inf` and `nan` are no numbers of the format, whatever `str::parse` thinks.
        let digits = text.trim_start_matches(['+', '-']).starts_with(|c: char| c.is_ascii_digit() || c == '.');
        let number = if token.kind == TokenKind::Word && digits { text.parse::<f64>().ok() } else { None };
        let d = match (values, number) {
            _ if token.kind == TokenKind::Unclosed => unclosed(span),
            (Values::Floats(_), Some(x)) if x.is_infinite() || x.abs() > f64::from(f32::MAX) => Diagnostic::error(
                format!("`{shown}` in parameter `{name}` does not fit in a 32-bit floating-point number"),
                span,
            ),
            (Values::Ints(_), Some(x)) if text.parse::<i128>().is_ok() || x.is_infinite() => {
                Diagnostic::error(format!("`{shown}` in parameter `{name}` does not fit in a 32-bit integer"), span)
            }
            _ => {
                let message = format!("expected {expected} for `\"{} {name}\"`, found `{shown}`", ty.keyword());
                let d = Diagnostic::error(message, span);
                match text {
                    "\"true\"" | "\"false\"" => d.with_hint("pbrt-v4 writes `true` and `false` without quotes"),
                    _ => d,
                }
            }
        };
        self.report(d);
    }
}

fn unclosed(span: Span) -> Diagnostic {
    Diagnostic::error("this string is not closed before the end of its line", span)
}

/// What fits in a message.
fn shorten(word: &str) -> String {
    if word.chars().count() <= 40 {
        return word.to_string();
    }
    word.chars().take(37).chain("...".chars()).collect()
}

/// A decimal number of the format as the nearest `f32`; `None` for anything else, `inf` and `nan` included, and for what is too large.
#[inline]
pub fn parse_number(text: &str) -> Option<f32> {
    let bytes = text.as_bytes();
    let digits = match bytes.first()? {
        b'+' | b'-' => &bytes[1..],
        _ => bytes,
    };
    // `str::parse` also takes `inf`, `infinity` and `nan`.
    if !matches!(digits.first()?, b'0'..=b'9' | b'.') {
        return None;
    }
    match text.parse::<f32>() {
        Ok(x) if x.is_finite() => Some(x),
        _ => None,
    }
}
