//! Typed look-up in the parameter list of one entity, which remembers what was asked for: whatever nobody asks for is a mistake.

use std::rc::Rc;
use steradian_math::{Normal3, Point2, Point3, Vec3};
use steradian_spectrum::ColorSpace;
use steradian_syntax::{Diagnostic, Directive, Param, ParamType, Span, Values, did_you_mean};

/// A parameter that an `Attribute` directive gave to all later entities of a kind.
#[derive(Clone, Debug)]
pub(super) struct Inherited {
    pub param: Param,
    pub color_space: ColorSpace,
}

/// The types that a scalar texture may be given by.
pub(super) const FLOAT_TEXTURE: &[ParamType] = &[ParamType::Float, ParamType::Texture];
/// The types that a spectrum may be given by.
pub(super) const SPECTRUM: &[ParamType] = &[ParamType::Rgb, ParamType::Spectrum, ParamType::Blackbody];
/// The types that a spectral texture may be given by.
pub(super) const SPECTRUM_TEXTURE: &[ParamType] =
    &[ParamType::Rgb, ParamType::Spectrum, ParamType::Blackbody, ParamType::Texture];

/// The parameters of one entity. As in pbrt the last of several counts, and the entity's own ones before inherited ones.
#[derive(Clone, Debug)]
pub(super) struct Params {
    /// The entity in messages: `Shape "sphere"`.
    what: String,
    /// Where it is named.
    pub span: Span,
    own: Vec<Param>,
    used: Vec<bool>,
    inherited: Rc<Vec<Inherited>>,
    color_space: ColorSpace,
    asked: Vec<(&'static str, &'static [ParamType])>,
    /// What is wrong so far.
    pub diagnostics: Vec<Diagnostic>,
}

#[derive(Clone, Copy)]
enum Place {
    Own(usize),
    Inherited(usize),
}

impl Params {
    /// Takes the parameters of a directive.
    pub fn new(directive: &mut Directive, inherited: &Rc<Vec<Inherited>>, color_space: ColorSpace) -> Params {
        let own = std::mem::take(&mut directive.params);
        let last = directive.args.len().saturating_sub(1);
        Params {
            what: format!("{} \"{}\"", directive.kind.name(), directive.text(last)),
            span: directive.arg_span(last),
            used: vec![false; own.len()],
            own,
            inherited: inherited.clone(),
            color_space,
            asked: Vec::new(),
            diagnostics: Vec::new(),
        }
    }

    /// The entity in messages.
    pub fn what(&self) -> &str {
        &self.what
    }

    /// Replaces the name in messages, for entities whose type is a parameter.
    pub fn rename(&mut self, what: String) {
        self.what = what;
    }

    /// Reports an error, by default at the entity's name.
    pub fn error(&mut self, message: impl Into<String>, span: impl Into<Option<Span>>) {
        let span = span.into().unwrap_or(self.span);
        self.diagnostics.push(Diagnostic::error(message, span));
    }

    /// Reports a warning, by default at the entity's name.
    pub fn warning(&mut self, message: impl Into<String>, span: impl Into<Option<Span>>) {
        let span = span.into().unwrap_or(self.span);
        self.diagnostics.push(Diagnostic::warning(message, span));
    }

    fn locate(&mut self, name: &'static str, types: &'static [ParamType]) -> Option<Place> {
        if !self.asked.iter().any(|a| a.0 == name && std::ptr::eq(a.1, types)) {
            self.asked.push((name, types));
        }
        let fits = |p: &Param| p.name == name && types.contains(&p.ty);
        if let Some(i) = self.own.iter().rposition(fits) {
            self.used[i] = true;
            return Some(Place::Own(i));
        }
        self.inherited.iter().rposition(|h| fits(&h.param)).map(Place::Inherited)
    }

    fn at(&self, place: Place) -> &Param {
        match place {
            Place::Own(i) => &self.own[i],
            Place::Inherited(i) => &self.inherited[i].param,
        }
    }

    /// Where the value of a parameter stands, if it is given in one of these types.
    pub fn span_of(&self, name: &str) -> Span {
        self.own.iter().rev().find(|p| p.name == name).map_or(self.span, |p| p.values_span)
    }

    /// Whether the entity itself has a parameter of that name.
    pub fn is_given(&self, name: &str) -> bool {
        self.own.iter().any(|p| p.name == name)
    }

    /// The parameter itself, with the colour space that its RGB values are in.
    pub fn raw(&mut self, name: &'static str, types: &'static [ParamType]) -> Option<(Param, ColorSpace)> {
        let place = self.locate(name, types)?;
        let space = match place {
            Place::Own(_) => self.color_space,
            Place::Inherited(i) => self.inherited[i].color_space,
        };
        Some((self.at(place).clone(), space))
    }

    /// The values of a parameter; the entity's own are moved out, since meshes are large.
    fn take(&mut self, name: &'static str, types: &'static [ParamType]) -> Option<(Values, Span)> {
        match self.locate(name, types)? {
            Place::Own(i) => {
                let p = &mut self.own[i];
                Some((std::mem::replace(&mut p.values, Values::Bools(Vec::new())), p.values_span))
            }
            Place::Inherited(i) => {
                let p = &self.inherited[i].param;
                Some((p.values.clone(), p.values_span))
            }
        }
    }

    /// Reports a parameter that does not have exactly one item.
    fn not_one(&mut self, name: &str, items: usize, span: Span) {
        self.error(format!("parameter `{name}` of {} takes one value, but {items} are given", self.what), span);
    }

    fn one<T: Copy>(
        &mut self,
        name: &'static str,
        types: &'static [ParamType],
        pick: impl Fn(&Values) -> Option<&[T]>,
    ) -> Option<T> {
        let place = self.locate(name, types)?;
        let p = self.at(place);
        let (span, value) = (p.values_span, pick(&p.values)?);
        match *value {
            [v] => Some(v),
            _ => {
                let n = value.len();
                self.not_one(name, n, span);
                None
            }
        }
    }

    /// A `float`, if it is given.
    pub fn maybe_float(&mut self, name: &'static str) -> Option<f32> {
        self.one(name, &[ParamType::Float], |v| match v {
            Values::Floats(v) => Some(v.as_slice()),
            _ => None,
        })
    }

    /// A `float`.
    pub fn float(&mut self, name: &'static str, default: f32) -> f32 {
        self.maybe_float(name).unwrap_or(default)
    }

    /// An `integer`, if it is given.
    pub fn maybe_int(&mut self, name: &'static str) -> Option<i32> {
        self.one(name, &[ParamType::Integer], |v| match v {
            Values::Ints(v) => Some(v.as_slice()),
            _ => None,
        })
    }

    /// An `integer`.
    pub fn int(&mut self, name: &'static str, default: i32) -> i32 {
        self.maybe_int(name).unwrap_or(default)
    }

    /// An `integer` that must lie in a range; out of it is an error and gives the default.
    pub fn int_in(&mut self, name: &'static str, default: i32, range: std::ops::RangeInclusive<i32>) -> i32 {
        let value = self.int(name, default);
        if range.contains(&value) {
            return value;
        }
        let message = if *range.end() == i32::MAX {
            format!("`{name}` of {} must be at least {}, not {value}", self.what, range.start())
        } else {
            format!("`{name}` of {} must be from {} to {}, not {value}", self.what, range.start(), range.end())
        };
        self.error(message, self.span_of(name));
        default
    }

    /// A `bool`.
    pub fn boolean(&mut self, name: &'static str, default: bool) -> bool {
        let value = self.one(name, &[ParamType::Bool], |v| match v {
            Values::Bools(v) => Some(v.as_slice()),
            _ => None,
        });
        value.unwrap_or(default)
    }

    /// A `string`.
    pub fn string(&mut self, name: &'static str) -> Option<(String, Span)> {
        let (strings, span) = self.strings(name)?;
        match <[(String, Span); 1]>::try_from(strings) {
            Ok([one]) => Some(one),
            Err(strings) => {
                self.not_one(name, strings.len(), span);
                None
            }
        }
    }

    /// A `string` that is one of a few words; anything else is an error and gives the first.
    pub fn choice<T: Copy>(&mut self, name: &'static str, choices: &[(&'static str, T)]) -> T {
        let Some((word, span)) = self.string(name) else { return choices[0].1 };
        if let Some((_, value)) = choices.iter().find(|(w, _)| *w == word) {
            return *value;
        }
        let words = choices.iter().map(|(w, _)| *w);
        let list: Vec<String> = words.clone().map(|w| format!("\"{w}\"")).collect();
        let message = format!("`{name}` of {} cannot be \"{word}\"", self.what);
        let hint = match did_you_mean(&word, words) {
            Some(w) => format!("did you mean `{w}`?"),
            None => format!("it can be {}", list.join(", ")),
        };
        self.diagnostics.push(Diagnostic::error(message, span).with_hint(hint));
        choices[0].1
    }

    /// A list of `string`s. Unlike long lists of numbers it may be asked for more than once.
    pub fn strings(&mut self, name: &'static str) -> Option<(Vec<(String, Span)>, Span)> {
        let place = self.locate(name, &[ParamType::String])?;
        let p = self.at(place);
        match &p.values {
            Values::Strings(v) => Some((v.clone(), p.values_span)),
            _ => None,
        }
    }

    /// A list of `float`s.
    pub fn floats(&mut self, name: &'static str) -> Option<(Vec<f32>, Span)> {
        let place = self.locate(name, &[ParamType::Float])?;
        let p = self.at(place);
        match &p.values {
            Values::Floats(v) => Some((v.clone(), p.values_span)),
            _ => None,
        }
    }

    /// A list of `integer`s, moved out.
    pub fn take_ints(&mut self, name: &'static str) -> Option<(Vec<i32>, Span)> {
        match self.take(name, &[ParamType::Integer])? {
            (Values::Ints(v), span) => Some((v, span)),
            _ => None,
        }
    }

    fn take_groups<const N: usize, T>(
        &mut self,
        name: &'static str,
        types: &'static [ParamType],
        make: impl Fn([f32; N]) -> T,
    ) -> Option<(Vec<T>, Span)> {
        let (Values::Floats(v), span) = self.take(name, types)? else { return None };
        let (groups, rest) = v.as_chunks::<N>();
        if !rest.is_empty() {
            let message = format!("`{name}` of {} needs {N} numbers for each item, but has {}", self.what, v.len());
            self.error(message, span);
        }
        Some((groups.iter().map(|&g| make(g)).collect(), span))
    }

    /// A list of `point3`s, moved out.
    pub fn take_points(&mut self, name: &'static str) -> Option<(Vec<Point3>, Span)> {
        self.take_groups(name, &[ParamType::Point3], Point3::from_array)
    }

    /// A list of `normal`s, moved out.
    pub fn take_normals(&mut self, name: &'static str) -> Option<(Vec<Normal3>, Span)> {
        self.take_groups(name, &[ParamType::Normal], Normal3::from_array)
    }

    /// A list of `vector3`s, moved out.
    pub fn take_vectors(&mut self, name: &'static str) -> Option<(Vec<Vec3>, Span)> {
        self.take_groups(name, &[ParamType::Vector3], Vec3::from_array)
    }

    /// A list of `rgb`s, moved out.
    pub fn take_rgbs(&mut self, name: &'static str) -> Option<(Vec<[f32; 3]>, Span)> {
        self.take_groups(name, &[ParamType::Rgb], |rgb| rgb)
    }

    /// The colour space of the entity's own RGB values.
    pub fn color_space(&self) -> ColorSpace {
        self.color_space
    }

    /// A list of `point2`s, moved out.
    pub fn take_points2(&mut self, name: &'static str) -> Option<(Vec<Point2>, Span)> {
        self.take_groups(name, &[ParamType::Point2], Point2::from_array)
    }

    fn one_group(&mut self, name: &'static str, types: &'static [ParamType]) -> Option<[f32; 3]> {
        let place = self.locate(name, types)?;
        let p = self.at(place);
        let Values::Floats(v) = &p.values else { return None };
        match v.as_slice() {
            &[x, y, z] => Some([x, y, z]),
            v => {
                let (n, span) = (v.len(), p.values_span);
                self.error(format!("`{name}` of {} takes three numbers, but {n} are given", self.what), span);
                None
            }
        }
    }

    /// A `point3`.
    pub fn point(&mut self, name: &'static str, default: Point3) -> Point3 {
        self.one_group(name, &[ParamType::Point3]).map_or(default, Point3::from_array)
    }

    /// A `vector3`.
    pub fn vector(&mut self, name: &'static str, default: Vec3) -> Vec3 {
        self.one_group(name, &[ParamType::Vector3]).map_or(default, Vec3::from_array)
    }

    /// Whether anything of that name is given, in whatever type. Does not count as a look-up.
    pub fn has(&self, name: &str) -> bool {
        self.own.iter().any(|p| p.name == name) || self.inherited.iter().any(|h| h.param.name == name)
    }

    /// Declares all parameters as known, for entities that are recognised but not built.
    pub fn accept_all(&mut self) {
        self.used.fill(true);
    }

    /// Reports what nobody asked for, and hands over all that is wrong.
    pub fn finish(mut self) -> Vec<Diagnostic> {
        for i in 0..self.own.len() {
            let p = &self.own[i];
            let twin = (i + 1..self.own.len()).rfind(|&j| self.own[j].name == p.name);
            if let Some(j) = twin
                && self.own[j].ty == p.ty
            {
                let message = format!("parameter `{}` of {} is given twice; the last one counts", p.name, self.what);
                let d = Diagnostic::warning(message, self.own[j].span).with_related("the first one is here", p.span);
                self.diagnostics.push(d);
                continue;
            }
            if self.used[i] {
                continue;
            }
            let d = self.unused(p);
            self.diagnostics.push(d);
        }
        self.diagnostics
    }

    fn unused(&self, p: &Param) -> Diagnostic {
        let mut types: Vec<ParamType> = Vec::new();
        for (_, t) in self.asked.iter().filter(|a| a.0 == p.name) {
            types.extend(t.iter().filter(|t| !types.contains(t)).copied().collect::<Vec<_>>());
        }
        if self.own.iter().zip(&self.used).any(|(other, used)| *used && other.name == p.name) {
            let message = format!("parameter `{}` of {} is given twice, in different types", p.name, self.what);
            return Diagnostic::error(message, p.span);
        }
        if !types.is_empty() {
            let list: Vec<String> = types.iter().map(|t| format!("`{}`", t.keyword())).collect();
            let list = match list.split_last() {
                Some((last, rest)) if !rest.is_empty() => format!("{} or {last}", rest.join(", ")),
                _ => list.concat(),
            };
            let message =
                format!("parameter `{}` of {} must be of type {list}, not `{}`", p.name, self.what, p.ty.keyword());
            return Diagnostic::error(message, p.span);
        }
        let mut names: Vec<&str> = self.asked.iter().map(|a| a.0).collect();
        names.dedup();
        let d = Diagnostic::error(format!("unknown parameter `{}` of {}", p.name, self.what), p.span);
        match did_you_mean(&p.name, names.iter().copied()) {
            Some(name) => d.with_suggestion(Some(name)),
            None if names.is_empty() => d.with_hint("it takes no parameters"),
            None => {
                names.sort_unstable();
                names.dedup();
                d.with_hint(format!("it takes {}", names.join(", ")))
            }
        }
    }
}
