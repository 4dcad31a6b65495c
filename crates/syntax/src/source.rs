//! Texts by number, and places in them: byte spans that become line and column only when somebody reads them.

use std::sync::Arc;

/// Which text of a [`SourceMap`].
#[derive(Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Debug, Default)]
pub struct FileId(pub u32);

/// A run of bytes in one text: `start..end`, both on character boundaries, `end` not included.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Default)]
pub struct Span {
    /// The text.
    pub file: FileId,
    /// First byte.
    pub start: u32,
    /// One past the last byte.
    pub end: u32,
}

impl Span {
    /// The bytes `start..end` of `file`.
    pub fn new(file: FileId, start: usize, end: usize) -> Span {
        Span { file, start: start.min(u32::MAX as usize) as u32, end: end.min(u32::MAX as usize) as u32 }
    }

    /// The smallest span that holds both; `other` must be of the same text (if it is not, `self` is returned).
    pub fn to(self, other: Span) -> Span {
        if self.file != other.file {
            return self;
        }
        Span { file: self.file, start: self.start.min(other.start), end: self.end.max(other.end) }
    }
}

/// A place as a person counts: line and column from 1, the column in characters.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Location {
    /// Line, from 1.
    pub line: u32,
    /// Character in the line, from 1.
    pub column: u32,
}

/// One text and the name to show for it.
#[derive(Clone, Debug)]
pub struct Source {
    /// What to print before `:line:column`; usually a path as the user wrote it.
    pub name: String,
    /// The whole text. Shared, so that a reader can walk it while the map grows.
    pub text: Arc<str>,
}

impl Source {
    /// Line and column of byte `offset`, which is clamped to the text. Costs one pass over what comes before.
    pub fn location(&self, offset: u32) -> Location {
        let offset = self.clamp(offset);
        let before = &self.text.as_bytes()[..offset];
        let line = before.iter().filter(|&&b| b == b'\n').count() + 1;
        let start = before.iter().rposition(|&b| b == b'\n').map_or(0, |i| i + 1);
        Location { line: line as u32, column: self.text[start..offset].chars().count() as u32 + 1 }
    }

    /// The byte range of the line that holds `offset`, without its line end.
    pub fn line_range(&self, offset: u32) -> std::ops::Range<usize> {
        let offset = self.clamp(offset);
        let bytes = self.text.as_bytes();
        let start = bytes[..offset].iter().rposition(|&b| b == b'\n').map_or(0, |i| i + 1);
        let mut end = bytes[offset..].iter().position(|&b| b == b'\n').map_or(bytes.len(), |i| offset + i);
        if end > start && bytes[end - 1] == b'\r' {
            end -= 1;
        }
        start..end
    }

    /// `offset` moved down to the nearest character boundary inside the text.
    pub(crate) fn clamp(&self, offset: u32) -> usize {
        let mut offset = (offset as usize).min(self.text.len());
        while !self.text.is_char_boundary(offset) {
            offset -= 1;
        }
        offset
    }
}

/// The texts of one load, in the order in which they were opened.
#[derive(Clone, Debug, Default)]
pub struct SourceMap {
    sources: Vec<Source>,
}

impl SourceMap {
    /// No texts.
    pub fn new() -> SourceMap {
        SourceMap::default()
    }

    /// Adds a text and returns its number.
    pub fn add(&mut self, name: impl Into<String>, text: impl Into<Arc<str>>) -> FileId {
        self.sources.push(Source { name: name.into(), text: text.into() });
        FileId(self.sources.len() as u32 - 1)
    }

    /// The text with that number, if there is one.
    pub fn get(&self, file: FileId) -> Option<&Source> {
        self.sources.get(file.0 as usize)
    }

    /// All texts in order.
    pub fn iter(&self) -> impl Iterator<Item = (FileId, &Source)> {
        self.sources.iter().enumerate().map(|(i, s)| (FileId(i as u32), s))
    }

    /// `name:line:column` of the start of `span`.
    pub fn describe(&self, span: Span) -> String {
        match self.get(span.file) {
            Some(source) => {
                let at = source.location(span.start);
                format!("{}:{}:{}", source.name, at.line, at.column)
            }
            None => "<unknown>".to_string(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_and_columns_count_from_one_and_in_characters() {
        let mut map = SourceMap::new();
        let id = map.add("a.pbrt", "ab\nöx\r\n\nlast");
        let s = map.get(id).unwrap();
        assert_eq!(s.location(0), Location { line: 1, column: 1 });
        assert_eq!(s.location(2), Location { line: 1, column: 3 });
        assert_eq!(s.location(3), Location { line: 2, column: 1 });
        assert_eq!(s.location(5), Location { line: 2, column: 2 }, "ö is two bytes and one column");
        assert_eq!(&s.text[s.line_range(5)], "öx", "the carriage return is not part of the line");
        assert_eq!(s.location(999), Location { line: 4, column: 5 }, "past the end is the end");
        assert_eq!(s.location(4), Location { line: 2, column: 1 }, "inside a character is its start");
        assert_eq!(map.describe(Span::new(id, 8, 9)), "a.pbrt:3:1");
    }
}
