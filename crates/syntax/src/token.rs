//! Bytes to tokens: quoted strings, brackets and bare words, with comments and white space skipped (pbrt-v4 file format, "Lexing").

/// What a token is.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum TokenKind {
    /// A quoted string; the range includes the quotes.
    Quoted,
    /// A quote that is not closed in its line; the range runs to the end of the line.
    Unclosed,
    /// `[`
    Open,
    /// `]`
    Close,
    /// Anything else: a directive, a number, `true`, `false`.
    Word,
}

/// A token and the bytes that it covers.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Token {
    /// What it is.
    pub kind: TokenKind,
    /// First byte.
    pub start: usize,
    /// One past the last byte.
    pub end: usize,
}

/// Reads tokens off a text; cheap to copy, so that a reader can look ahead and come back.
#[derive(Clone, Copy, Debug)]
pub struct Lexer<'a> {
    text: &'a str,
    position: usize,
}

const SPACE: u8 = 1;
const DELIMITER: u8 = 2;

/// `SPACE` separates tokens; `SPACE` and `DELIMITER` both end a word.
static CLASS: [u8; 256] = {
    let mut c = [0; 256];
    c[b' ' as usize] = SPACE;
    c[b'\t' as usize] = SPACE;
    c[b'\n' as usize] = SPACE;
    c[b'\r' as usize] = SPACE;
    c[b'"' as usize] = DELIMITER;
    c[b'[' as usize] = DELIMITER;
    c[b']' as usize] = DELIMITER;
    c
};

impl<'a> Lexer<'a> {
    /// Starts at the beginning; a UTF-8 byte order mark is skipped.
    pub fn new(text: &'a str) -> Lexer<'a> {
        Lexer { text, position: if text.starts_with('\u{feff}') { 3 } else { 0 } }
    }

    /// The same from a byte on, if it is not there yet.
    #[must_use]
    pub fn from(self, position: usize) -> Lexer<'a> {
        Lexer { position: self.position.max(position), ..self }
    }

    /// The text that a token covers.
    pub fn slice(&self, token: Token) -> &'a str {
        &self.text[token.start..token.end]
    }

    /// The byte where the next look for a token starts.
    pub fn position(&self) -> usize {
        self.position
    }

    /// The next token without taking it.
    pub fn peek(&self) -> Option<Token> {
        let mut ahead = *self;
        ahead.next()
    }
}

/// Takes tokens; `None` at the end of the text.
impl Iterator for Lexer<'_> {
    type Item = Token;

    #[inline]
    fn next(&mut self) -> Option<Token> {
        let bytes = self.text.as_bytes();
        let mut i = self.position;
        loop {
            while i < bytes.len() && CLASS[bytes[i] as usize] == SPACE {
                i += 1;
            }
            if i < bytes.len() && bytes[i] == b'#' {
                while i < bytes.len() && bytes[i] != b'\n' && bytes[i] != b'\r' {
                    i += 1;
                }
            } else {
                break;
            }
        }
        if i >= bytes.len() {
            self.position = i;
            return None;
        }
        let start = i;
        let kind = match bytes[i] {
            b'[' => {
                i += 1;
                TokenKind::Open
            }
            b']' => {
                i += 1;
                TokenKind::Close
            }
            b'"' => {
                i += 1;
                loop {
                    match bytes.get(i) {
                        None | Some(b'\n' | b'\r') => break TokenKind::Unclosed,
                        Some(b'"') => {
                            i += 1;
                            break TokenKind::Quoted;
                        }
                        // A backslash takes the next byte with it, unless that is the end of the line.
                        Some(b'\\') if !matches!(bytes.get(i + 1), None | Some(b'\n' | b'\r')) => i += 2,
                        Some(_) => i += 1,
                    }
                }
            }
            _ => {
                while i < bytes.len() && CLASS[bytes[i] as usize] == 0 {
                    i += 1;
                }
                TokenKind::Word
            }
        };
        // `i += 2` over an escape may have stopped inside a character of several bytes.
        while !self.text.is_char_boundary(i) {
            i += 1;
        }
        self.position = i;
        Some(Token { kind, start, end: i })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words(text: &str) -> Vec<(TokenKind, &str)> {
        let lexer = Lexer::new(text);
        lexer.map(|t| (t.kind, lexer.slice(t))).collect()
    }

    #[test]
    fn tokens_follow_the_format_page() {
        use TokenKind::*;
        assert_eq!(
            words("\u{feff}Foo#bar[1 2]#note \"x\"\r\"a \\\" b\"\"c\"-.5e3"),
            [
                (Word, "Foo#bar"),
                (Open, "["),
                (Word, "1"),
                (Word, "2"),
                (Close, "]"),
                (Quoted, "\"a \\\" b\""),
                (Quoted, "\"c\""),
                (Word, "-.5e3")
            ]
        );
        assert_eq!(words("\"open\nnext"), [(Unclosed, "\"open"), (Word, "next")]);
        assert_eq!(words("\"end\\"), [(Unclosed, "\"end\\")]);
        assert_eq!(words("\"a\\ä\" b"), [(Quoted, "\"a\\ä\""), (Word, "b")]);
        assert_eq!(words(""), []);
    }
}
