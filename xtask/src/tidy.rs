//! Rules of the repository that no compiler checks: who may know whom, how long a file may be, what may not be left lying about.
//!
//! The rules are data at the top of this file. A change of a rule is a change here, and so is seen in review.

use std::collections::BTreeSet;
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// Which crates a crate may use, besides those of others. A crate that is not listed may use none and may not exist.
const ARROWS: [(&str, &[&str]); 17] = [
    ("math", &[]),
    ("syntax", &[]),
    ("sampling", &["math"]),
    ("spectrum", &["math"]),
    ("bvh", &["math"]),
    ("geometry", &["math", "sampling", "bvh"]),
    ("bsdf", &["math", "sampling", "spectrum"]),
    ("image", &["math", "sampling", "spectrum"]),
    ("scene", &["math", "sampling", "spectrum", "bvh", "geometry", "bsdf", "image"]),
    ("integrator", &["math", "sampling", "spectrum", "geometry", "bsdf", "image", "scene"]),
    ("load", &["math", "syntax", "sampling", "spectrum", "geometry", "bsdf", "image", "scene"]),
    ("render", &["math", "sampling", "spectrum", "image", "scene", "integrator"]),
    (
        "lab",
        &[
            "math",
            "syntax",
            "sampling",
            "spectrum",
            "bvh",
            "geometry",
            "bsdf",
            "image",
            "scene",
            "integrator",
            "load",
            "render",
        ],
    ),
    ("view", &["math", "sampling", "spectrum", "image", "scene", "integrator", "render"]),
    (
        "steradian",
        &[
            "math",
            "syntax",
            "sampling",
            "spectrum",
            "geometry",
            "bsdf",
            "image",
            "scene",
            "integrator",
            "load",
            "render",
            "lab",
            "view",
        ],
    ),
    ("testkit", &[]),
    ("xtask", &["image"]),
];

/// What tests may use besides: tools, and crates whose values they need. Cargo alone keeps this acyclic.
const TEST_ONLY: [&str; 2] = ["testkit", "geometry"];

/// Crates that may use these libraries; nobody else may.
const LIBRARIES: [(&str, &[&str]); 9] = [
    ("anyhow", &["xtask"]),
    ("clap", &["steradian"]),
    ("indicatif", &["steradian"]),
    ("ctrlc", &["steradian"]),
    ("exr", &["image"]),
    ("flate2", &["load"]),
    ("memmap2", &["image"]),
    ("tungstenite", &["view"]),
    ("httparse", &["view"]),
];

/// The modules that may hold unsafe code.
const UNSAFE_MODULES: [&str; 4] =
    ["crates/bvh/src/stack.rs", "crates/image/src/scratch.rs", "crates/steradian/src/oidn.rs", "benches/src/embree.rs"];

/// A file longer than this is refused, and one longer than that is mentioned.
const MOST_LINES: usize = 800;
const MANY_LINES: usize = 500;

/// What may not be written anywhere in Rust code: unfinished work and tests that do not test. Spelled in halves, so that this file
/// does not break its own rule.
const FORBIDDEN: [(&str, &str); 5] =
    [("todo", "!("), ("unimplemented", "!("), ("#[ign", "ore"), ("#[should", "_panic"), ("dbg", "!(")];

/// Beginnings of paths that exist on one machine only.
const MACHINE_PATHS: [(&str, &str); 4] = [("/wo", "rk/"), ("/ro", "ot/"), ("/ho", "me/"), ("/Us", "ers/")];

/// What was found.
#[derive(Debug, Default)]
pub(crate) struct Findings {
    /// Broken rules.
    pub errors: Vec<String>,
    /// Worth a look.
    pub notes: Vec<String>,
    /// Number of files that were read.
    pub files: usize,
}

/// Checks the repository at `root`; an error lists what is wrong.
pub(crate) fn run(root: &Path) -> anyhow::Result<String> {
    let findings = check(root)?;
    let mut out = String::new();
    for note in &findings.notes {
        let _ = writeln!(out, "note: {note}");
    }
    let _ = write!(out, "tidy: {} files, {} problems", findings.files, findings.errors.len());
    anyhow::ensure!(findings.errors.is_empty(), "{}\n{out}", findings.errors.join("\n"));
    Ok(out)
}

/// Reads everything and applies every rule.
pub(crate) fn check(root: &Path) -> anyhow::Result<Findings> {
    let mut findings = Findings::default();
    let mut files = Vec::new();
    walk(root, &mut files)?;
    files.sort();
    for path in &files {
        let Ok(bytes) = std::fs::read(path) else { continue };
        let Ok(text) = String::from_utf8(bytes) else { continue };
        let name = path.strip_prefix(root)?.to_string_lossy().replace('\\', "/");
        findings.files += 1;
        check_text(&name, &text, &mut findings);
        if name.ends_with(".rs") {
            check_rust(&name, &text, &mut findings);
        }
    }
    check_arrows(root, &mut findings)?;
    check_readme(root, &mut findings)?;
    Ok(findings)
}

/// All files that git could hold.
fn walk(folder: &Path, out: &mut Vec<PathBuf>) -> std::io::Result<()> {
    for entry in std::fs::read_dir(folder)? {
        let entry = entry?;
        let name = entry.file_name().to_string_lossy().into_owned();
        if entry.file_type()?.is_dir() {
            let built = name.starts_with("target") || name == ".git" || name == "node_modules" || name == ".venv";
            // What lies next to the checkout under this name belongs to it no more than the build does.
            if !built && name != "shared" {
                walk(&entry.path(), out)?;
            }
        } else if name != ".git" {
            // A file of that name is what a second work tree has.
            out.push(entry.path());
        }
    }
    Ok(())
}

/// Rules for every text.
fn check_text(name: &str, text: &str, findings: &mut Findings) {
    for (i, line) in text.lines().enumerate() {
        for (a, b) in MACHINE_PATHS {
            if line.contains(&format!("{a}{b}")) {
                findings.errors.push(format!("{name}:{}: a path that exists on one machine only", i + 1));
            }
        }
    }
}

/// Rules for Rust.
fn check_rust(name: &str, text: &str, findings: &mut Findings) {
    let mut say = |line: usize, what: String| findings.errors.push(format!("{name}:{line}: {what}"));
    if !text.starts_with("//!") {
        say(1, "the first line must say with //! what the file is".into());
    }
    let exempt = UNSAFE_MODULES.contains(&name);
    for (i, line) in text.lines().enumerate() {
        let code = line.split("//").next().unwrap_or_default();
        for (a, b) in FORBIDDEN {
            // Tables for people take minutes and are run by hand; nothing else may be skipped.
            if code.contains(&format!("{a}{b}")) && !line.contains("= \"a table, minutes long\"") {
                say(i + 1, format!("{a}{b} has no place here"));
            }
        }
        let begins = |w: &str| code.contains(&format!("unsa{} {w}", "fe"));
        if !exempt && ["fn", "impl", "{", "extern", "trait"].iter().any(|w| begins(w)) {
            say(i + 1, "unsafe code outside the modules that may hold it".into());
        }
    }
    let lines = text.lines().count();
    if lines > MOST_LINES {
        say(lines, format!("{lines} lines; at most {MOST_LINES}"));
    } else if lines > MANY_LINES {
        findings.notes.push(format!("{name}: {lines} lines"));
    }
}

/// The names under `[dependencies]` and under `[dev-dependencies]` of a manifest.
fn dependencies(manifest: &str) -> [BTreeSet<String>; 2] {
    let mut out = [BTreeSet::new(), BTreeSet::new()];
    let mut section = None;
    for line in manifest.lines().map(str::trim) {
        if let Some(header) = line.strip_prefix('[') {
            section = match header.trim_end_matches(']') {
                "dependencies" | "build-dependencies" => Some(0),
                "dev-dependencies" => Some(1),
                other if other.starts_with("target.") && other.ends_with("dev-dependencies") => Some(1),
                other if other.starts_with("target.") => Some(0),
                _ => None,
            };
        } else if let Some(section) = section
            && let Some(name) = line.split(['=', '.', ' ']).next().filter(|n| !n.is_empty() && !n.starts_with('#'))
        {
            out[section].insert(name.to_owned());
        }
    }
    out
}

/// Who knows whom.
fn check_arrows(root: &Path, findings: &mut Findings) -> anyhow::Result<()> {
    let mut folders: Vec<PathBuf> = std::fs::read_dir(root.join("crates"))?.flatten().map(|e| e.path()).collect();
    folders.push(root.join("xtask"));
    for folder in folders.iter().filter(|f| f.join("Cargo.toml").exists()) {
        let name = folder.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let manifest = std::fs::read_to_string(folder.join("Cargo.toml"))?;
        check_manifest(&name, &manifest, findings);
    }
    Ok(())
}

fn check_manifest(name: &str, manifest: &str, findings: &mut Findings) {
    let [normal, dev] = dependencies(manifest);
    let allowed = ARROWS.iter().find(|(n, _)| *n == name).map(|(_, a)| *a);
    if allowed.is_none() && name != "xtask" {
        findings.errors.push(format!("{name}: this crate is not in tidy's table of arrows"));
        return;
    }
    let allowed = allowed.unwrap_or_default();
    let own = |d: &str| d.strip_prefix("steradian-").map(str::to_owned);
    for d in normal.iter().filter_map(|d| own(d)) {
        if !allowed.contains(&d.as_str()) {
            findings.errors.push(format!("{name} may not use {d}"));
        }
    }
    for d in dev.iter().filter_map(|d| own(d)) {
        if !allowed.contains(&d.as_str()) && !TEST_ONLY.contains(&d.as_str()) {
            findings.errors.push(format!("the tests of {name} may not use {d}"));
        }
    }
    for (library, users) in LIBRARIES {
        if normal.contains(library) && !users.contains(&name) {
            findings.errors.push(format!("{name} may not use {library}"));
        }
    }
}

/// Every option that the README types after `steradian` must exist. The command line's grammar is the source that is read, so
/// that this check needs no build.
fn check_readme(root: &Path, findings: &mut Findings) -> anyhow::Result<()> {
    let readme = std::fs::read_to_string(root.join("README.md"))?;
    let mut grammar = String::new();
    for entry in std::fs::read_dir(root.join("crates/steradian/src"))? {
        let path = entry?.path();
        if path.extension().is_some_and(|e| e == "rs") {
            grammar.push_str(&std::fs::read_to_string(path)?);
        }
    }
    let known = known_flags(&grammar);
    anyhow::ensure!(
        known.contains("spp") && known.contains("max-depth"),
        "the flags of the command line were not found"
    );
    for (line, flag) in typed_flags(&readme) {
        if !known.contains(&flag) {
            findings.errors.push(format!("README.md:{line}: there is no option --{flag}"));
        }
    }
    Ok(())
}

/// Names of fields with `#[arg(long)]`, explicit names and aliases.
fn known_flags(grammar: &str) -> BTreeSet<String> {
    let mut known: BTreeSet<String> = ["help", "version"].map(str::to_owned).into();
    let mut pending = None;
    for line in grammar.lines().map(str::trim) {
        if line.starts_with("#[arg(") && line.contains("long") {
            let quoted = |key: &str| {
                let rest = line.split_once(&format!("{key} = \""))?.1;
                Some(rest.split_once('"')?.0.to_owned())
            };
            known.extend(quoted("alias"));
            pending = Some(quoted("long"));
        } else if let Some(field) = line.strip_prefix("pub ").and_then(|l| l.split_once(':'))
            && let Some(explicit) = pending.take()
        {
            known.insert(explicit.unwrap_or_else(|| field.0.replace('_', "-")));
        }
    }
    known
}

/// The options behind `steradian` (or `cargo run ... --`) in a text's code, with their lines.
fn typed_flags(text: &str) -> Vec<(usize, String)> {
    let mut out = Vec::new();
    for (i, line) in text.lines().enumerate() {
        let command = match (line.split_once("cargo run --release -- "), line.split_once("steradian ")) {
            (Some((_, rest)), _) => rest,
            (None, Some((_, rest))) if !line.contains("cargo ") => rest,
            _ => continue,
        };
        for word in command.split(|c: char| c.is_whitespace() || "`|[](),;.=".contains(c)) {
            if let Some(flag) = word.strip_prefix("--").filter(|f| !f.is_empty()) {
                out.push((i + 1, flag.to_owned()));
            }
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_repository_is_tidy() {
        let root = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/.."));
        let findings = check(root).unwrap();
        assert!(findings.files > 100, "only {} files were found", findings.files);
        assert!(findings.errors.is_empty(), "{}", findings.errors.join("\n"));
    }

    #[test]
    fn broken_rules_are_found() {
        let mut f = Findings::default();
        check_rust("a.rs", "fn a() {}\n", &mut f);
        assert_eq!(f.errors, ["a.rs:1: the first line must say with //! what the file is"]);
        let mut f = Findings::default();
        let text = format!("//! A file.\n#[ign{}]\nfn a() {{ unsafe {{ b() }} }}\n// {}!(x)\n", "ore", "todo");
        check_rust("a.rs", &text, &mut f);
        assert_eq!(f.errors.len(), 2, "comments are free: {:?}", f.errors);
        let mut f = Findings::default();
        check_rust(UNSAFE_MODULES[0], "//! A file.\nunsafe { b() }\n", &mut f);
        check_rust("b.rs", &format!("//! A file.{}", "\n".repeat(600)), &mut f);
        assert_eq!((f.errors.len(), f.notes.len()), (0, 1));
        check_rust("b.rs", &format!("//! A file.{}", "\n".repeat(900)), &mut f);
        check_text("c.md", &format!("see /ho{}someone", "me/"), &mut f);
        assert_eq!(f.errors.len(), 2);
    }

    #[test]
    fn arrows_point_down() {
        let said = |name: &str, manifest: &str| {
            let mut f = Findings::default();
            check_manifest(name, manifest, &mut f);
            f.errors.join("; ")
        };
        assert_eq!(said("bvh", "[dependencies]\nsteradian-math.workspace = true\nthiserror = \"2\"\n"), "");
        assert_eq!(said("bvh", "[dependencies]\nsteradian-scene = { path = \"x\" }\n"), "bvh may not use scene");
        assert_eq!(said("bvh", "[dev-dependencies]\nsteradian-testkit.workspace = true\n"), "");
        assert_eq!(
            said("bvh", "[dev-dependencies]\nsteradian-load.workspace = true\n"),
            "the tests of bvh may not use load"
        );
        assert_eq!(said("render", "[dependencies]\nclap.workspace = true\n"), "render may not use clap");
        assert_eq!(said("common", ""), "common: this crate is not in tidy's table of arrows");
        // The table itself has no cycle: every crate uses only crates that stand above it.
        for (i, (name, uses)) in ARROWS.iter().enumerate() {
            for used in *uses {
                assert!(ARROWS[..i].iter().any(|(n, _)| n == used), "{name} -> {used}");
            }
        }
    }

    #[test]
    fn options_in_prose_are_read() {
        let text = "run `steradian render a.pbrt --spp 16 --crop=0,1`\ncargo run --release -- render --sze 4\ncargo test --release\n";
        let typed: Vec<String> = typed_flags(text).into_iter().map(|(_, f)| f).collect();
        assert_eq!(typed, ["spp", "crop", "sze"]);
        let grammar = "#[arg(short, long = \"output\", visible_alias = \"outfile\")]\npub output: Vec<PathBuf>,\n\
                       #[arg(long, value_name = \"N\")]\npub max_depth: Option<u32>,\n#[arg(value_name = \"A\")]\npub candidate: PathBuf,\n";
        let known: Vec<String> = known_flags(grammar).into_iter().collect();
        assert_eq!(known, ["help", "max-depth", "outfile", "output", "version"]);
    }
}
