//! Properties of a PLY file that are not geometry, grouped by their names as Mitsuba groups them.

use super::PlyAttribute;
use super::header::{Element, Property};

/// Which columns make up an attribute.
pub(super) struct Group {
    columns: Vec<usize>,
    attribute: PlyAttribute,
}

/// The endings of names that belong together, one alphabet after the other.
const ENDINGS: [&str; 4] = ["xyzw", "rgba", "0123", "1234"];

/// Groups what is left of an element's properties.
pub(super) fn groups(element: &Element, per_face: bool, taken: &[&str]) -> Vec<Group> {
    let prefix = if per_face { "face_" } else { "vertex_" };
    let at = |name: &str| element.properties.iter().position(|p| p.name == name && p.list.is_none());
    let mut out = Vec::new();
    let mut push = |name: String, columns: Vec<usize>| {
        // A fourth number, opacity mostly, is not asked for.
        let columns = if columns.len() == 4 { columns[..3].to_vec() } else { columns };
        if matches!(columns.len(), 1 | 3) {
            let attribute = PlyAttribute { name, per_face, width: columns.len(), values: Vec::new() };
            out.push(Group { columns, attribute });
        }
    };
    for names in [["r", "g", "b"], ["red", "green", "blue"]] {
        if let [Some(r), Some(g), Some(b)] = names.map(at) {
            push(format!("{prefix}color"), vec![r, g, b]);
            break;
        }
    }
    let split = |p: &Property| -> Option<(String, char)> {
        let (name, ending) = p.name.rsplit_once('_')?;
        let mut letters = ending.chars();
        let letter = letters.next().filter(|_| letters.next().is_none())?;
        (p.list.is_none() && !taken.contains(&p.name.as_str())).then(|| (name.to_string(), letter))
    };
    let mut i = 0;
    while i < element.properties.len() {
        let Some((name, first)) = split(&element.properties[i]) else {
            i += 1;
            continue;
        };
        let Some(alphabet) = ENDINGS.iter().find(|e| e.starts_with(first)) else {
            i += 1;
            continue;
        };
        let follows = |(k, letter): (usize, char)| {
            element.properties.get(i + k).and_then(split).is_some_and(|(n, l)| n == name && l == letter)
        };
        let length = alphabet.chars().enumerate().take_while(|&kl| follows(kl)).count();
        let color = if *alphabet == "rgba" { "_color" } else { "" };
        push(format!("{prefix}{name}{color}"), (i..i + length).collect());
        i += length.max(1);
    }
    out
}

/// Adds one row to all groups.
pub(super) fn push_row(groups: &mut [Group], get: impl Fn(usize) -> f32) {
    for g in groups {
        g.attribute.values.extend(g.columns.iter().map(|&c| {
            let v = get(c);
            if v.is_finite() { v } else { 0.0 }
        }));
    }
}

/// What was gathered.
pub(super) fn attributes(groups: Vec<Group>) -> impl Iterator<Item = PlyAttribute> {
    groups.into_iter().map(|g| g.attribute)
}
