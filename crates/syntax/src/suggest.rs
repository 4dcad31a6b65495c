//! "Did you mean": the nearest of a list of names by optimal string alignment distance (Damerau 1964, restricted edits).

/// The candidate that is nearest to `word`, or `None` when none is near: at most one edit per three characters (and one for
/// short words) may separate them. Case is ignored; of several equally near ones the first wins. An exact match is returned too.
pub fn did_you_mean<'a>(word: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let word: Vec<char> = word.chars().flat_map(char::to_lowercase).collect();
    // Nobody mistypes a name this long by a letter or two, and the distance below is quadratic.
    if word.len() > 64 {
        return None;
    }
    let allowed = (word.len() / 3).max(1);
    let mut best: Option<(usize, &'a str)> = None;
    for candidate in candidates {
        let other: Vec<char> = candidate.chars().flat_map(char::to_lowercase).collect();
        if other.len().abs_diff(word.len()) > allowed {
            continue;
        }
        let d = distance(&word, &other);
        // One letter replaced in a one-letter name is another name, not a slip.
        let near = d <= allowed && d < word.len().max(other.len());
        if near && best.is_none_or(|(b, _)| d < b) {
            best = Some((d, candidate));
        }
    }
    best.map(|(_, c)| c)
}

/// Insertions, deletions, replacements and swaps of neighbours that turn `a` into `b`.
fn distance(a: &[char], b: &[char]) -> usize {
    let mut older: Vec<usize> = vec![0; b.len() + 1];
    let mut old: Vec<usize> = (0..=b.len()).collect();
    let mut new = vec![0; b.len() + 1];
    for i in 0..a.len() {
        new[0] = i + 1;
        for j in 0..b.len() {
            let replace = old[j] + usize::from(a[i] != b[j]);
            let mut d = replace.min(old[j + 1] + 1).min(new[j] + 1);
            if i > 0 && j > 0 && a[i] == b[j - 1] && a[i - 1] == b[j] {
                d = d.min(older[j - 1] + 1);
            }
            new[j + 1] = d;
        }
        std::mem::swap(&mut older, &mut old);
        std::mem::swap(&mut old, &mut new);
    }
    old[b.len()]
}

#[cfg(test)]
mod tests {
    use super::did_you_mean;

    #[test]
    fn near_names_are_offered_and_far_ones_are_not() {
        let names = ["roughness", "uroughness", "reflectance", "eta", "k"];
        assert_eq!(did_you_mean("roughnes", names), Some("roughness"));
        assert_eq!(did_you_mean("refelctance", names), Some("reflectance"));
        assert_eq!(did_you_mean("Reflectance", names), Some("reflectance"));
        assert_eq!(did_you_mean("ate", names), None);
        assert_eq!(did_you_mean("eat", names), Some("eta"));
        assert_eq!(did_you_mean("g", names), None);
        assert_eq!(did_you_mean("thickness", names), None);
    }
}
