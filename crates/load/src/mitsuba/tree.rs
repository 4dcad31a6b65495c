//! Mitsuba's XML as a tree of objects with typed parameters: includes read, variables put in, references found.

use crate::files::{FileAccess, describe};
use crate::gltf::inside;
use std::cell::Cell;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use steradian_math::{Point3, Transform, Vec3};
use steradian_syntax::{Diagnostic, FileId, SourceMap, Span};

/// A value.
#[derive(Clone, Debug)]
pub(super) enum Value {
    Float(f32),
    Integer(i64),
    Boolean(bool),
    Text(String),
    Vector([f32; 3]),
    Rgb([f32; 3]),
    /// One number for all wavelengths, or wavelengths and numbers.
    Spectrum(Vec<(f32, f32)>),
    /// A spectrum in a file.
    SpectrumFile(String),
    Transform(Transform),
}

/// A parameter that remembers whether somebody asked for it.
#[derive(Clone, Debug)]
pub(super) struct Param {
    pub value: Value,
    pub span: Span,
    asked: Cell<bool>,
}

/// An object and the name that it has as a parameter.
#[derive(Clone, Debug)]
pub(super) enum Child {
    Here(usize),
    Reference(String, Span),
}

/// A plugin with its parameters.
#[derive(Clone, Debug)]
pub(super) struct Object {
    /// The element: `bsdf`, `shape` and so on.
    pub class: String,
    pub kind: String,
    pub span: Span,
    pub params: BTreeMap<String, Param>,
    pub children: Vec<(String, Child)>,
}

impl Object {
    /// A parameter, which is asked for by this.
    pub fn get(&self, name: &str) -> Option<&Param> {
        let p = self.params.get(name)?;
        p.asked.set(true);
        Some(p)
    }

    /// What nobody asked for.
    pub fn unasked(&self) -> impl Iterator<Item = (&String, &Param)> {
        self.params.iter().filter(|(_, p)| !p.asked.get())
    }
}

/// Everything that was read.
pub(super) struct Tree {
    pub objects: Vec<Object>,
    pub ids: BTreeMap<String, usize>,
    /// The scene's own children, in order.
    pub top: Vec<(String, Child)>,
    /// Where files are looked for.
    pub folders: Vec<PathBuf>,
}

pub(super) struct Reader<'a> {
    pub files: &'a dyn FileAccess,
    pub allow_outside: bool,
    pub base: PathBuf,
    pub tree: Tree,
    pub sources: SourceMap,
    pub diagnostics: Vec<Diagnostic>,
    /// Values of `$variables`; those of the command line come first and win.
    pub variables: BTreeMap<String, String>,
    file: FileId,
    upgrade: bool,
    depth: usize,
}

/// Files may include each other this deep.
const MOST_INCLUDES: usize = 32;
/// A document of more elements than this is none that a person wrote.
const MOST_NODES: u32 = 20_000_000;

type Node<'x, 'i> = roxmltree::Node<'x, 'i>;

impl<'a> Reader<'a> {
    pub fn new(files: &'a dyn FileAccess, base: PathBuf, allow_outside: bool, defines: &[(String, String)]) -> Self {
        let tree = Tree { objects: Vec::new(), ids: BTreeMap::new(), top: Vec::new(), folders: vec![base.clone()] };
        Self {
            files,
            allow_outside,
            base,
            tree,
            sources: SourceMap::new(),
            diagnostics: Vec::new(),
            variables: defines.iter().cloned().collect(),
            file: FileId(0),
            upgrade: false,
            depth: 0,
        }
    }

    /// Whether the scene is of a version before 2.
    pub fn is_old(&self) -> bool {
        self.upgrade
    }

    fn span(&self, node: Node) -> Span {
        let r = node.range();
        // The opening tag is what a reader looks for.
        let text = node.document().input_text();
        let end = text[r.start..r.end].find('>').map_or(r.end, |n| r.start + n + 1);
        Span::new(self.file, r.start, end)
    }

    pub fn error(&mut self, message: impl Into<String>, span: Span) {
        self.diagnostics.push(Diagnostic::error(message, span));
    }

    /// Reads a file into the tree.
    pub fn file(&mut self, path: &Path, at: Option<Span>) {
        let fail = |message: String| Diagnostic::error(message, at);
        let bytes = match self.files.read(path) {
            Ok(b) => b,
            Err(e) => return self.diagnostics.push(fail(describe(path, &e))),
        };
        let text = match String::from_utf8(bytes) {
            Ok(t) => t,
            Err(e) => {
                let at = e.utf8_error().valid_up_to();
                let message = format!("{}: not UTF-8 text (byte {at} is not part of a character)", path.display());
                return self.diagnostics.push(fail(message));
            }
        };
        let outer = self.file;
        self.file = self.sources.add(path.display().to_string(), text.as_str());
        let options = roxmltree::ParsingOptions { nodes_limit: MOST_NODES, ..roxmltree::ParsingOptions::default() };
        match roxmltree::Document::parse_with_options(&text, options) {
            Ok(document) => {
                let root = document.root_element();
                if root.tag_name().name() == "scene" {
                    let version = root.attribute("version").unwrap_or("3.0.0");
                    self.upgrade = version.starts_with("0.") || version.starts_with("1.");
                    let mut top = self.children(root, None);
                    self.tree.top.append(&mut top);
                } else {
                    self.error("the root of a scene is `<scene>`", self.span(root));
                }
            }
            Err(e) => {
                let at = e.pos();
                let offset: usize = text.lines().take(at.row as usize - 1).map(|l| l.len() + 1).sum();
                let offset = (offset + at.col as usize - 1).min(text.len());
                self.error(format!("not XML: {e}"), Span::new(self.file, offset, offset + 1));
            }
        }
        self.file = outer;
    }

    /// The children of an element that are objects; parameters go into `owner`.
    fn children(&mut self, node: Node, mut owner: Option<&mut Object>) -> Vec<(String, Child)> {
        let mut out = Vec::new();
        for child in node.children().filter(Node::is_element) {
            let name = child.tag_name().name().to_string();
            match name.as_str() {
                "default" => self.default(child),
                "path" => {
                    if let Some(folder) = self.attribute(child, "value") {
                        match inside(self.files, &self.base, &folder, self.allow_outside) {
                            Ok(path) => self.tree.folders.push(path),
                            Err(message) => {
                                let d = Diagnostic::error(message, self.span(child))
                                    .with_hint("--allow-outside permits it");
                                self.diagnostics.push(d);
                            }
                        }
                    }
                }
                "include" => {
                    if let Some(file) = self.attribute(child, "filename") {
                        self.include(&file, child);
                    }
                }
                "alias" => {
                    if let (Some(id), Some(name)) = (self.attribute(child, "id"), self.attribute(child, "as"))
                        && let Some(&object) = self.tree.ids.get(&id)
                    {
                        self.tree.ids.insert(name, object);
                    }
                }
                "ref" => {
                    if let Some(id) = self.attribute(child, "id") {
                        let name = self.name(child);
                        out.push((name, Child::Reference(id, self.span(child))));
                    }
                }
                "spectrum" | "rgb" if child.attribute("type").is_some() => {
                    let name = self.name(child);
                    if let Some(object) = self.object(child) {
                        out.push((name, Child::Here(object)));
                    }
                }
                "float" | "integer" | "boolean" | "string" | "vector" | "point" | "rgb" | "spectrum" | "transform"
                | "color" => {
                    let param = self.param(child, &name);
                    if let (Some(value), Some(owner)) = (param, owner.as_deref_mut()) {
                        let name = self.name(child);
                        owner.params.insert(name, Param { value, span: self.span(child), asked: Cell::new(false) });
                    }
                }
                _ => {
                    let name = self.name(child);
                    if let Some(object) = self.object(child) {
                        out.push((name, Child::Here(object)));
                    }
                }
            }
        }
        out
    }

    fn object(&mut self, node: Node) -> Option<usize> {
        let span = self.span(node);
        let class = node.tag_name().name().to_string();
        const CLASSES: [&str; 16] = [
            "spectrum",
            "bsdf",
            "shape",
            "emitter",
            "luminaire",
            "sensor",
            "camera",
            "film",
            "sampler",
            "rfilter",
            "texture",
            "medium",
            "phase",
            "volume",
            "integrator",
            "subsurface",
        ];
        if !CLASSES.contains(&class.as_str()) {
            let d = Diagnostic::error(format!("unknown element `<{class}>`"), span);
            self.diagnostics.push(d.with_suggestion(steradian_syntax::did_you_mean(&class, CLASSES)));
            return None;
        }
        if self.depth > 200 {
            self.error("elements are nested more than 200 deep", span);
            return None;
        }
        let kind = self.attribute(node, "type")?;
        let mut object = Object {
            class: match class.as_str() {
                "luminaire" => "emitter".into(),
                "spectrum" => "texture".into(),
                _ => class,
            },
            kind,
            span,
            params: BTreeMap::new(),
            children: Vec::new(),
        };
        self.depth += 1;
        object.children = self.children(node, Some(&mut object));
        self.depth -= 1;
        let index = self.tree.objects.len();
        self.tree.objects.push(object);
        if node.attribute("id").is_some()
            && let Some(id) = self.attribute(node, "id")
            && self.tree.ids.insert(id.clone(), index).is_some()
        {
            self.error(format!("a second object with the id `{id}`"), span);
        }
        Some(index)
    }

    fn default(&mut self, node: Node) {
        if let (Some(name), Some(value)) = (node.attribute("name"), node.attribute("value")) {
            let value = self.expand(value, node);
            self.variables.entry(name.to_string()).or_insert(value);
        }
    }

    fn include(&mut self, file: &str, node: Node) {
        let span = self.span(node);
        if self.depth >= MOST_INCLUDES {
            self.error(format!("files include each other more than {MOST_INCLUDES} deep"), span);
            return;
        }
        match self.resolve(file) {
            Ok(path) => {
                self.depth += 1;
                self.file(&path, Some(span));
                self.depth -= 1;
            }
            Err(message) => self.error(message, span),
        }
    }

    /// A file by its name, in the folders that are searched.
    pub fn resolve(&self, name: &str) -> Result<PathBuf, String> {
        let mut last = Err(format!("{name}: no such file"));
        for folder in &self.tree.folders {
            match inside(self.files, folder, name, self.allow_outside) {
                Ok(path) if self.files.exists(&path) => return Ok(path),
                Ok(_) => {}
                Err(message) => last = Err(message),
            }
        }
        last
    }

    /// The parameter's name, in the present spelling.
    fn name(&mut self, node: Node) -> String {
        let name = node.attribute("name").unwrap_or("").to_string();
        if self.upgrade { underscored(&name) } else { name }
    }

    fn attribute(&mut self, node: Node, name: &str) -> Option<String> {
        match node.attribute(name) {
            Some(text) => Some(self.expand(text, node)),
            None => {
                let tag = node.tag_name().name();
                self.error(format!("`<{tag}>` needs the attribute `{name}`"), self.span(node));
                None
            }
        }
    }

    /// A text with its variables replaced.
    fn expand(&mut self, text: &str, node: Node) -> String {
        if !text.contains('$') {
            return text.trim().to_string();
        }
        let mut out = text.to_string();
        // Longer names first, so that `$resx` is not `$res` and an x.
        let mut names: Vec<&String> = self.variables.keys().collect();
        names.sort_by_key(|n| std::cmp::Reverse(n.len()));
        for name in names {
            out = out.replace(&format!("${name}"), &self.variables[name]);
        }
        if let Some(at) = out.find('$') {
            let name: String =
                out[at..].chars().take_while(|c| *c == '$' || c.is_alphanumeric() || *c == '_').collect();
            let d = Diagnostic::error(format!("the variable `{name}` has no value"), self.span(node));
            self.diagnostics.push(d.with_hint(format!("give it one with -D {}=VALUE", &name[1..])));
        }
        out.trim().to_string()
    }

    fn param(&mut self, node: Node, tag: &str) -> Option<Value> {
        if tag == "transform" {
            return self.transform(node).map(Value::Transform);
        }
        if matches!(tag, "vector" | "point") && node.attribute("value").is_none() {
            return Some(Value::Vector(self.axes(node, 0.0)));
        }
        if tag == "spectrum" && node.attribute("filename").is_some() {
            return self.attribute(node, "filename").map(Value::SpectrumFile);
        }
        let text = self.attribute(node, "value")?;
        let span = self.span(node);
        let value = match tag {
            "float" => number(&text).map(Value::Float),
            "integer" => text.parse().ok().map(Value::Integer),
            "boolean" => match text.to_ascii_lowercase().as_str() {
                "true" => Some(Value::Boolean(true)),
                "false" => Some(Value::Boolean(false)),
                _ => None,
            },
            "string" => Some(Value::Text(text.clone())),
            "vector" | "point" => triple(&text).map(Value::Vector),
            "rgb" | "color" => hex(&text).or_else(|| triple(&text)).map(Value::Rgb),
            _ if text.contains(':') => {
                let pair = |p: &str| {
                    let (l, v) = p.split_once(':')?;
                    Some((number(l)?, number(v)?))
                };
                words(&text).map(pair).collect::<Option<Vec<_>>>().map(Value::Spectrum)
            }
            _ => match words(&text).map(number).collect::<Option<Vec<f32>>>().as_deref() {
                Some(&[v]) => Some(Value::Spectrum(vec![(550.0, v)])),
                // Old scenes write colours so.
                Some(&[r, g, b]) => Some(Value::Rgb([r, g, b])),
                _ => None,
            },
        };
        if value.is_none() {
            let shown: String = text.chars().take(40).collect();
            self.error(format!("`{shown}` is no {tag}"), span);
        }
        value
    }

    /// x, y and z of an element.
    fn axes(&mut self, node: Node, absent: f32) -> [f32; 3] {
        ["x", "y", "z"].map(|a| match node.attribute(a) {
            None => absent,
            Some(text) => {
                let text = self.expand(text, node);
                number(&text).unwrap_or_else(|| {
                    self.error(format!("`{text}` is no number"), self.span(node));
                    absent
                })
            }
        })
    }

    fn transform(&mut self, node: Node) -> Option<Transform> {
        let mut out = Transform::IDENTITY;
        for step in node.children().filter(Node::is_element) {
            let span = self.span(step);
            let t = self.step(step);
            match t {
                Some(t) => out = out.then(&t),
                None => self.error("a transform that cannot be: singular, or not understood", span),
            }
        }
        Some(out)
    }

    fn step(&mut self, node: Node) -> Option<Transform> {
        let value = node.attribute("value").map(|v| self.expand(v, node));
        let vector = |this: &mut Self, absent: f32| match &value {
            Some(v) => triple(v),
            None => Some(this.axes(node, absent)),
        };
        let vec3 = Vec3::from_array;
        match node.tag_name().name() {
            "translate" => Some(Transform::translate(vec3(vector(self, 0.0)?))),
            "scale" => {
                let [x, y, z] = vector(self, 1.0)?;
                Transform::scale(x, y, z)
            }
            "rotate" => {
                let axis = vector(self, 0.0)?;
                let angle = self.attribute(node, "angle")?;
                Transform::rotate(number(&angle)?, vec3(axis))
            }
            "lookat" | "lookAt" => {
                let mut of = |name: &str| self.attribute(node, name).and_then(|t| triple(&t));
                let (origin, target) = (of("origin")?, of("target")?);
                let up = if node.attribute("up").is_some() { of("up")? } else { [0.0, 1.0, 0.0] };
                let o = vec3(origin);
                let forward = (vec3(target) - o).try_normalize()?;
                let left = vec3(up).cross(forward).try_normalize()?;
                let up = forward.cross(left);
                let row = |i: usize| [left[i], up[i], forward[i], o[i]];
                Transform::from_matrix([row(0), row(1), row(2), [0.0, 0.0, 0.0, 1.0]])
            }
            "matrix" => {
                let numbers: Vec<f32> = words(value.as_deref()?).map(number).collect::<Option<_>>()?;
                let m = match numbers.len() {
                    16 => std::array::from_fn(|r| std::array::from_fn(|c| numbers[4 * r + c])),
                    9 => std::array::from_fn(|r| {
                        std::array::from_fn(|c| {
                            if r < 3 && c < 3 { numbers[3 * r + c] } else { f32::from(u8::from(r == c)) }
                        })
                    }),
                    _ => return None,
                };
                Transform::from_matrix(m)
            }
            _ => None,
        }
    }
}

/// `toWorld` as it is spelled today: `to_world`.
fn underscored(name: &str) -> String {
    let known = match name {
        "intIOR" => "int_ior",
        "extIOR" => "ext_ior",
        "sRGB" => "srgb",
        _ => "",
    };
    if !known.is_empty() {
        return known.into();
    }
    let mut out = String::new();
    for c in name.chars() {
        if c.is_ascii_uppercase() {
            out.push('_');
        }
        out.push(c.to_ascii_lowercase());
    }
    out
}

fn words(text: &str) -> impl Iterator<Item = &str> {
    text.split(|c: char| c == ',' || c.is_whitespace()).filter(|w| !w.is_empty())
}

fn number(text: &str) -> Option<f32> {
    text.trim().parse::<f32>().ok().filter(|v| v.is_finite())
}

/// Three numbers, or one for all three.
fn triple(text: &str) -> Option<[f32; 3]> {
    let numbers: Vec<f32> = words(text).map(number).collect::<Option<_>>()?;
    match numbers[..] {
        [v] => Some([v; 3]),
        [x, y, z] => Some([x, y, z]),
        _ => None,
    }
}

/// `#rrggbb`, in sRGB.
fn hex(text: &str) -> Option<[f32; 3]> {
    let digits = text.strip_prefix('#').filter(|d| d.len() == 6 && d.is_ascii())?;
    let part = |i: usize| u8::from_str_radix(&digits[2 * i..2 * i + 2], 16).ok();
    Some([part(0)?, part(1)?, part(2)?].map(|v| steradian_image::srgb_to_linear(f32::from(v) / 255.0)))
}

/// The origin of a transform.
pub(super) fn origin(t: &Transform) -> Point3 {
    t.point(Point3::default())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn old_names_are_brought_up_to_date() {
        assert_eq!(underscored("toWorld"), "to_world");
        assert_eq!(underscored("intIOR"), "int_ior");
        assert_eq!(underscored("fov"), "fov");
    }

    #[test]
    fn numbers_come_in_lists() {
        assert_eq!(triple("1, 2 3"), Some([1.0, 2.0, 3.0]));
        assert_eq!(triple("0.5"), Some([0.5; 3]));
        assert_eq!(triple("1 2"), None);
        assert_eq!(hex("#ff0000").map(|c| c.map(|v| (v * 100.0).round())), Some([100.0, 0.0, 0.0]));
    }
}
