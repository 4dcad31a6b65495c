//! Names that may be used before they are defined: a use and a definition share one handle.

use std::collections::BTreeMap;
use steradian_scene::{Arena, Handle};
use steradian_syntax::{ArgValue, Diagnostic, Directive, Kind, ParamType, Span, Values, did_you_mean};
use unicode_normalization::UnicodeNormalization;

/// Brings the names in a directive to one form, so that the same letters written in two ways are one name. Names of files stay as
/// they are.
pub(super) fn normalize(d: &mut Directive) {
    let same = |s: &mut String| {
        if !s.is_ascii() {
            *s = s.nfc().collect();
        }
    };
    let has_names = matches!(
        d.kind,
        Kind::CoordinateSystem
            | Kind::CoordSysTransform
            | Kind::MakeNamedMaterial
            | Kind::MakeNamedMedium
            | Kind::MediumInterface
            | Kind::NamedMaterial
            | Kind::ObjectBegin
            | Kind::ObjectInstance
            | Kind::Texture
    );
    for arg in d.args.iter_mut().filter(|_| has_names) {
        if let ArgValue::String(s) = &mut arg.value {
            same(s);
        }
    }
    for p in d.params.iter_mut().filter(|p| p.ty == ParamType::Texture || p.name == "materials") {
        if let Values::Strings(v) = &mut p.values {
            v.iter_mut().for_each(|(s, _)| same(s));
        }
    }
}

/// The names of one kind of thing.
pub(super) struct Names<T> {
    entries: BTreeMap<String, Entry<T>>,
}

struct Entry<T> {
    handle: Handle<T>,
    defined: Option<Span>,
    used: Option<Span>,
}

impl<T> Default for Names<T> {
    fn default() -> Names<T> {
        Names { entries: BTreeMap::new() }
    }
}

impl<T> Names<T> {
    fn entry(&mut self, name: &str, arena: &mut Arena<T>, placeholder: impl FnOnce() -> T) -> &mut Entry<T> {
        self.entries.entry(name.to_string()).or_insert_with(|| Entry {
            handle: arena.push(placeholder()),
            defined: None,
            used: None,
        })
    }

    /// The handle of a name that is used at `span`.
    pub fn used(&mut self, name: &str, span: Span, arena: &mut Arena<T>, placeholder: impl FnOnce() -> T) -> Handle<T> {
        let entry = self.entry(name, arena, placeholder);
        entry.used.get_or_insert(span);
        entry.handle
    }

    /// The handle of a name that is defined at `span`, or where it was defined before.
    pub fn defined(
        &mut self,
        name: &str,
        span: Span,
        arena: &mut Arena<T>,
        placeholder: impl FnOnce() -> T,
    ) -> Result<Handle<T>, Span> {
        let entry = self.entry(name, arena, placeholder);
        match entry.defined {
            Some(first) => Err(first),
            None => {
                entry.defined = Some(span);
                Ok(entry.handle)
            }
        }
    }

    /// The handle of a name that is defined.
    pub fn get(&self, name: &str) -> Option<Handle<T>> {
        self.entries.get(name).filter(|e| e.defined.is_some()).map(|e| e.handle)
    }

    /// All names that are defined.
    pub fn known(&self) -> impl Iterator<Item = &str> {
        self.entries.iter().filter(|(_, e)| e.defined.is_some()).map(|(n, _)| n.as_str())
    }

    /// An error for each name that is used but not defined; `what` is the kind of thing.
    pub fn undefined(&self, what: &str) -> Vec<Diagnostic> {
        let mut out = Vec::new();
        for (name, entry) in &self.entries {
            if let (None, Some(span)) = (entry.defined, entry.used) {
                let d = Diagnostic::error(format!("there is no {what} \"{name}\""), span);
                out.push(d.with_suggestion(did_you_mean(name, self.known())));
            }
        }
        out
    }
}

/// The report of a second definition.
pub(super) fn defined_twice(what: &str, name: &str, span: Span, first: Span) -> Diagnostic {
    Diagnostic::error(format!("{what} \"{name}\" is defined twice"), span)
        .with_related("the first definition is here", first)
}
