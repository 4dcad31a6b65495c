//! A JSON value that knows where it stands, so that every complaint names the place (RFC 6901).

use serde_json::Value;

/// What is wrong, and where.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Problem {
    /// JSON pointer.
    pub pointer: String,
    /// One sentence without a full stop.
    pub message: String,
    /// What to do about it.
    pub hint: Option<String>,
}

pub(super) type Result<T> = std::result::Result<T, Problem>;

/// A value in a document.
#[derive(Clone, Debug)]
pub(super) struct Json<'a> {
    value: &'a Value,
    pointer: String,
}

impl<'a> Json<'a> {
    pub fn root(value: &'a Value) -> Self {
        Self { value, pointer: String::new() }
    }

    pub fn problem(&self, message: impl Into<String>) -> Problem {
        Problem { pointer: self.pointer.clone(), message: message.into(), hint: None }
    }

    pub fn pointer(&self) -> &str {
        &self.pointer
    }

    fn inside(&self, key: &str, value: &'a Value) -> Self {
        let key = key.replace('~', "~0").replace('/', "~1");
        Self { value, pointer: format!("{}/{key}", self.pointer) }
    }

    /// A member; none where it is absent or null.
    pub fn get(&self, key: &str) -> Option<Json<'a>> {
        self.value.get(key).filter(|v| !v.is_null()).map(|v| self.inside(key, v))
    }

    /// The names of the members.
    pub fn keys(&self) -> Vec<&'a str> {
        self.value.as_object().map_or(Vec::new(), |o| o.keys().map(String::as_str).collect())
    }

    pub fn need(&self, key: &str) -> Result<Json<'a>> {
        self.get(key).ok_or_else(|| self.problem(format!("`{key}` is missing")))
    }

    /// An extension of this object.
    pub fn extension(&self, name: &str) -> Option<Json<'a>> {
        self.get("extensions")?.get(name)
    }

    /// The elements of an array member; none if it is absent.
    pub fn list(&self, key: &str) -> Result<Vec<Json<'a>>> {
        self.get(key).map_or(Ok(Vec::new()), |v| v.items())
    }

    pub fn items(&self) -> Result<Vec<Json<'a>>> {
        let Value::Array(items) = self.value else { return Err(self.problem("must be an array")) };
        Ok(items.iter().enumerate().map(|(i, v)| self.inside(&i.to_string(), v)).collect())
    }

    pub fn as_str(&self) -> Result<&'a str> {
        self.value.as_str().ok_or_else(|| self.problem("must be a text"))
    }

    pub fn as_number(&self) -> Result<f32> {
        let v = self.value.as_f64().ok_or_else(|| self.problem("must be a number"))? as f32;
        if v.is_finite() { Ok(v) } else { Err(self.problem("is too large for single precision")) }
    }

    pub fn as_count(&self) -> Result<usize> {
        let whole = self.value.as_u64().or_else(|| {
            // Some writers give whole numbers a fraction of zero.
            let v = self.value.as_f64()?;
            (v >= 0.0 && v.fract() == 0.0 && v < 9e15).then_some(v as u64)
        });
        let whole = whole.ok_or_else(|| self.problem("must be a whole number that is not negative"))?;
        usize::try_from(whole).map_err(|_| self.problem("is too large"))
    }

    pub fn text(&self, key: &str) -> Result<Option<&'a str>> {
        self.get(key).map(|v| v.as_str()).transpose()
    }

    pub fn flag(&self, key: &str) -> Result<bool> {
        let Some(v) = self.get(key) else { return Ok(false) };
        v.value.as_bool().ok_or_else(|| v.problem("must be true or false"))
    }

    pub fn is_false(&self) -> bool {
        self.value.as_bool() == Some(false)
    }

    pub fn number(&self, key: &str, absent: f32) -> Result<f32> {
        self.get(key).map_or(Ok(absent), |v| v.as_number())
    }

    /// A number that must not be negative.
    pub fn amount(&self, key: &str, absent: f32) -> Result<f32> {
        let v = self.number(key, absent)?;
        if v >= 0.0 { Ok(v) } else { Err(self.need(key)?.problem("must not be negative")) }
    }

    pub fn count(&self, key: &str) -> Result<Option<usize>> {
        self.get(key).map(|v| v.as_count()).transpose()
    }

    pub fn numbers<const N: usize>(&self, key: &str) -> Result<Option<[f32; N]>> {
        let Some(v) = self.get(key) else { return Ok(None) };
        let items = v.items()?;
        if items.len() != N {
            return Err(v.problem(format!("must have {N} numbers, not {}", items.len())));
        }
        let mut out = [0.0; N];
        for (o, i) in out.iter_mut().zip(&items) {
            *o = i.as_number()?;
        }
        Ok(Some(out))
    }
}

/// Members that are objects wherever they stand. One that is something else would count as absent.
const OBJECTS: [&str; 8] =
    ["asset", "attributes", "extensions", "orthographic", "pbrMetallicRoughness", "perspective", "sparse", "spot"];

/// Holds a document to what is an object in it, and what is true or false.
pub(super) fn shapes(value: &Value) -> Result<()> {
    fn walk(at: &Json, is_object: bool) -> Result<()> {
        match at.value {
            // The parser has bounded the depth.
            Value::Object(members) => {
                for (key, value) in members.iter().filter(|(key, v)| *key != "extras" && !v.is_null()) {
                    let inner = at.inside(key, value);
                    if ["doubleSided", "normalized"].contains(&key.as_str()) && !value.is_boolean() {
                        return Err(inner.problem("must be true or false"));
                    }
                    let in_extensions = at.pointer.ends_with("/extensions");
                    if in_extensions && !super::KNOWN.contains(&key.as_str()) {
                        continue;
                    }
                    let is_object = in_extensions || key.ends_with("Texture") || OBJECTS.contains(&key.as_str());
                    walk(&inner, is_object)?;
                }
                Ok(())
            }
            _ if is_object => Err(at.problem("must be an object")),
            Value::Array(items) => {
                for (i, value) in items.iter().enumerate().filter(|(_, v)| v.is_object()) {
                    walk(&at.inside(&i.to_string(), value), false)?;
                }
                Ok(())
            }
            _ => Ok(()),
        }
    }
    walk(&Json::root(value), true)
}
