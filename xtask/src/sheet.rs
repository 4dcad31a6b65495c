//! A contact sheet: every model and Mitsuba scene below a folder, each as small as a stamp, on one picture to be looked at.
//!
//! `cargo run -p xtask -- sheet FOLDER OUT.png [STERADIAN]`. What is not rendered is told with the renderer's own words.

use anyhow::{Context, bail, ensure};
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::Command;
use steradian_image::{Encoding, Image, Precision, WriteOptions, read_texels, write_file};

const SIZE: usize = 192;
const SAMPLES: &str = "32";
const COLUMNS: usize = 8;

/// Renders the sheet; words about each model.
pub(crate) fn run(folder: &Path, out: &Path, steradian: &Path) -> anyhow::Result<String> {
    let mut models = Vec::new();
    find(folder, 0, &mut models)?;
    models.sort();
    ensure!(!models.is_empty(), "{}: no models", folder.display());
    let stamps = out.with_extension("stamps");
    std::fs::create_dir_all(&stamps)?;
    let rows = models.len().div_ceil(COLUMNS);
    let (width, height) = (COLUMNS * SIZE, rows * SIZE);
    let mut planes = [0, 1, 2].map(|_| vec![0.0f32; width * height]);
    let mut words = String::new();
    for (n, model) in models.iter().enumerate() {
        let stamp = stamps.join(format!("{n}.png"));
        let size = format!("{SIZE}x{SIZE}");
        let ran = Command::new(steradian)
            .arg("render")
            .arg(model)
            .args(["--size", &size, "--spp", SAMPLES, "--quiet", "--allow-outside", "-o"])
            .arg(&stamp)
            .output()
            .with_context(|| steradian.display().to_string())?;
        let (x0, y0) = (n % COLUMNS * SIZE, n / COLUMNS * SIZE);
        let name = model.strip_prefix(folder).unwrap_or(model).display();
        if !ran.status.success() {
            let said = String::from_utf8_lossy(&ran.stderr);
            let first = said.lines().find(|l| l.starts_with("error")).unwrap_or("no words").to_owned();
            writeln!(words, "{n:3} {name}: {first}")?;
            continue;
        }
        let texels = read_texels(&std::fs::read(&stamp)?, "stamp", Some(Encoding::Srgb))?;
        for y in 0..texels.height().min(SIZE) {
            for x in 0..texels.width().min(SIZE) {
                for (c, plane) in planes.iter_mut().enumerate() {
                    plane[(y0 + y) * width + x0 + x] = texels.texel(x, y, c.min(texels.channels() - 1));
                }
            }
        }
        writeln!(words, "{n:3} {name}")?;
    }
    let mut sheet = Image::new(width, height);
    for (name, plane) in ["R", "G", "B"].into_iter().zip(planes) {
        sheet.add(name, plane, Precision::Float)?;
    }
    write_file(&sheet, out, &WriteOptions::default())?;
    std::fs::remove_dir_all(&stamps)?;
    Ok(words)
}

/// Models, and scenes of Mitsuba by their usual name.
fn find(folder: &Path, depth: usize, out: &mut Vec<PathBuf>) -> anyhow::Result<()> {
    if depth > 8 {
        bail!("{}: folders are nested too deep", folder.display());
    }
    for entry in std::fs::read_dir(folder).with_context(|| folder.display().to_string())? {
        let path = entry?.path();
        let extension = path.extension().and_then(|e| e.to_str()).unwrap_or("").to_ascii_lowercase();
        let is_scene = path.file_name().is_some_and(|n| n == "scene.xml");
        if path.is_dir() {
            // Meshes of a scene are not models of their own.
            let inner = path.join("scene.xml").exists();
            if inner {
                out.push(path.join("scene.xml"));
            } else {
                find(&path, depth + 1, out)?;
            }
        } else if is_scene || ["gltf", "glb"].contains(&extension.as_str()) {
            out.push(path);
        }
    }
    Ok(())
}
