//! Where the picture goes: which files, whether they can be written, what they say about themselves.

use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

use steradian_image::{
    Attribute, Chromaticities, Exposure, Format, Image, Metadata, Operator, Precision, ToneMap, Window, WriteOptions,
    encode, remove_leftovers, write_bytes_atomically,
};
use steradian_render::{CLAMPED, Film, OUTLIERS, Rendered, read_layers, read_spectrum};
use steradian_scene::{FilmSettings, IntegratorKind, RenderSettings};
use steradian_spectrum::ColorSpace;

use crate::args::{OutputArgs, PictureArgs, ToneMapArg};
use crate::console::Console;
use crate::failure::{Failure, reason};
use crate::numbers::ExposureArg;
use crate::stop::StopArgs;
use crate::{aov, overrides};

/// The files to write, checked before any work is done.
pub(crate) struct Outputs {
    /// The picture.
    pub pictures: Vec<PathBuf>,
    /// Its variance.
    pub variance: Option<PathBuf>,
    options: WriteOptions,
    half: bool,
}

impl From<ToneMapArg> for Operator {
    fn from(arg: ToneMapArg) -> Operator {
        match arg {
            ToneMapArg::Clip => Operator::Clip,
            ToneMapArg::Reinhard => Operator::Reinhard,
            ToneMapArg::Hable => Operator::Hable,
            ToneMapArg::Aces => Operator::Aces,
            ToneMapArg::Agx => Operator::Agx,
        }
    }
}

impl Outputs {
    /// Chooses the files and makes sure that they can be written; `none` if there shall be no picture.
    pub fn prepare(args: &OutputArgs, scene_file: Option<&str>, none: bool) -> Result<Outputs, Failure> {
        let pictures = match () {
            () if none => Vec::new(),
            () if args.output.is_empty() => default_files(scene_file),
            () => args.output.clone(),
        };
        for path in &pictures {
            match format_of(path)? {
                format if !format.is_writable() => {
                    return Err(unwritable(
                        path,
                        "this kind of file is read but not written; write .exr, .png, .jpg, .hdr or .pfm",
                    ));
                }
                _ => check(path)?,
            }
        }
        if let Some(path) = &args.variance {
            if !matches!(format_of(path)?, Format::Exr | Format::Pfm) {
                return Err(unwritable(path, "variance needs full precision; write .exr or .pfm"));
            }
            check(path)?;
        }
        let all: Vec<&PathBuf> = pictures.iter().chain(&args.variance).collect();
        if let Some((_, twice)) = all.iter().enumerate().find(|(i, p)| all[..*i].contains(p)) {
            return Err(Failure::Input(format!("{}: the same file is to be written twice", twice.display())));
        }
        let exposure = match args.exposure {
            ExposureArg::Stops(s) => Exposure::Stops(s),
            ExposureArg::Auto => Exposure::Auto(0.0),
        };
        let operator = Operator::from(args.tonemap);
        let options = WriteOptions { tone_map: Some(ToneMap { exposure, operator }), ..WriteOptions::default() };
        Ok(Outputs { pictures, variance: args.variance.clone(), options, half: args.half })
    }

    /// Says which files were written.
    pub fn say(&self, console: &Console) {
        for path in self.pictures.iter().chain(&self.variance) {
            console.say(format_args!("wrote {}", path.display()));
        }
    }

    /// Refreshes a picture for the eye while rendering goes on.
    pub fn write_preview(&self, path: &Path, picture: &Image, raw: bool) -> Option<String> {
        let options = WriteOptions { tone_map: self.options.tone_map.filter(|_| !raw), ..self.options.clone() };
        write_one(path, &screen_picture(picture), &options)
    }

    /// Writes everything that can be written; the errors are of the files that could not.
    pub fn write(&self, picture: &Image, variance: Option<&Image>, raw: bool) -> Vec<String> {
        let mut failed = Vec::new();
        // Numbers that stand for no light (normals, coordinates) are shown as they are.
        let options = WriteOptions { tone_map: self.options.tone_map.filter(|_| !raw), ..self.options.clone() };
        let mut full = picture.clone();
        if self.half {
            // Light; identities, counts and positions need what they have.
            full.set_precision_of(&["R", "G", "B", "A"], Precision::Half);
        }
        let screen = screen_picture(picture);
        for path in &self.pictures {
            let image = if Format::from_name(&path.to_string_lossy()) == Some(Format::Exr) { &full } else { &screen };
            failed.extend(write_one(path, image, &options));
        }
        if let (Some(path), Some(image)) = (&self.variance, variance) {
            failed.extend(write_one(path, image, &options));
        }
        failed
    }
}

fn write_one(path: &Path, image: &Image, options: &WriteOptions) -> Option<String> {
    let name = path.display().to_string();
    let written = Format::from_name(&name)
        .ok_or_else(|| steradian_image::Error::UnknownFormat { name: name.clone() })
        .and_then(|format| encode(image, format, &name, options))
        .and_then(|bytes| write_bytes_atomically(path, &bytes));
    match written {
        Ok(()) => None,
        Err(steradian_image::Error::Io { source, .. }) => Some(format!("cannot write {name}: {}", reason(&source))),
        Err(other) => Some(format!("cannot write {other}")),
    }
}

/// The picture with sRGB primaries, which is what screens and formats without a note of primaries take it to have.
fn screen_picture(image: &Image) -> Image {
    let space =
        image.metadata.chromaticities.and_then(|c| ColorSpace::from_chromaticities([c.red, c.green, c.blue], c.white));
    match (space, image.rgb()) {
        (Some(space), Some(pixels)) if space != ColorSpace::Srgb => {
            let converted: Vec<[f32; 3]> = pixels.into_iter().map(|p| space.emission_to_srgb(p)).collect();
            let mut out = Image::from_rgb(image.width(), image.height(), &converted).unwrap_or_else(|| image.clone());
            if let Some(alpha) = image.channel("A") {
                // It fits: it is of the same size, and a picture from colours has no alpha yet.
                let _ = out.add("A", alpha.to_vec(), Precision::Float);
            }
            out
        }
        _ => image.clone(),
    }
}

/// The file that the scene names, without its folder, and a PNG; the built-in scene is called after the program.
fn default_files(scene_file: Option<&str>) -> Vec<PathBuf> {
    let Some(name) = scene_file.and_then(|f| Path::new(f).file_name()).map(PathBuf::from) else {
        return vec!["steradian.png".into(), "steradian.exr".into()];
    };
    let writable = Format::from_name(&name.to_string_lossy()).is_some_and(Format::is_writable);
    let first = if writable { name } else { name.with_extension("exr") };
    let png = first.with_extension("png");
    if first == png { vec![first] } else { vec![first, png] }
}

fn format_of(path: &Path) -> Result<Format, Failure> {
    Format::from_name(&path.to_string_lossy()).ok_or_else(|| {
        Failure::Input(format!(
            "{}: the extension must say what kind of file to write: .exr, .png, .jpg, .hdr or .pfm",
            path.display()
        ))
    })
}

fn unwritable(path: &Path, what: &str) -> Failure {
    Failure::Input(format!("{}: {what}", path.display()))
}

/// Makes sure that a file can be created where `path` will be, so that nobody waits for a picture that cannot be kept, and takes away what
/// a process that was killed while it wrote there has left.
pub(crate) fn check(path: &Path) -> Result<(), Failure> {
    let refused = |why: String| Err(Failure::Environment(format!("cannot write {}: {why}", path.display())));
    if path.is_dir() {
        return refused("it is a folder".into());
    }
    let parent = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    match std::fs::metadata(parent) {
        Ok(m) if !m.is_dir() => return refused(format!("{} is not a folder", parent.display())),
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => {
            return refused(format!("there is no folder {}", parent.display()));
        }
        Err(e) => return refused(reason(&e)),
        Ok(_) => {}
    }
    // A file without a name, where the system has such: a kill in this moment leaves nothing.
    tempfile::tempfile_in(parent)
        .map_err(|e| Failure::Environment(format!("cannot write {}: {}", path.display(), reason(&e))))?;
    remove_leftovers(path);
    Ok(())
}

/// What the run is, for the picture's metadata.
pub(crate) struct Story<'a> {
    /// The scene as the user named it.
    pub scene: &'a str,
    /// See [`crate::opened::Opened::hash`].
    pub scene_hash: &'a str,
    /// The settings that are in force.
    pub settings: &'a RenderSettings,
    /// What the command line replaced.
    pub picture: &'a PictureArgs,
    /// When it ends.
    pub stop: &'a StopArgs,
}

/// All that can be said before rendering: the part of a picture's metadata that every part of a distributed render has as well.
pub(crate) fn manifest(story: &Story) -> Metadata {
    let settings = story.settings;
    let mut meta = Metadata::default();
    meta.set("software", text(concat!("Steradian ", env!("CARGO_PKG_VERSION"))));
    meta.set("steradian.version", text(env!("CARGO_PKG_VERSION")));
    meta.set("steradian.scene", text(story.scene));
    meta.set("steradian.sceneHash", text(story.scene_hash));
    meta.set("steradian.options", text((overrides::as_typed(story.picture) + &story.stop.as_typed()).trim()));
    meta.set("steradian.seed", text(settings.sampler.seed.to_string()));
    meta.set("steradian.plannedSpp", int(settings.sampler.spp));
    meta.set("steradian.sampler", text(settings.sampler.kind.name()));
    meta.set("steradian.integrator", text(overrides::integrator_name(settings.integrator.kind)));
    meta.set("steradian.maxDepth", int(settings.integrator.max_depth));
    meta.set("steradian.color", text(overrides::color_name(settings.color)));
    let mut biased = biased_options(settings);
    if story.picture.filter_outliers {
        biased.push("filter-outliers");
    }
    if !biased.is_empty() {
        meta.set("steradian.biased", text(biased.join(", ")));
    }
    place(&mut meta, &settings.film);
    meta
}

/// The manifest as bytes, for files that are no pictures yet: a picture of one pixel.
pub(crate) fn note_of_metadata(metadata: &Metadata) -> Vec<u8> {
    let mut carrier = Image::new(1, 1);
    carrier.metadata = metadata.clone();
    let named = carrier.add("Y", vec![0.0], Precision::Half);
    let bytes = named.and_then(|()| encode(&carrier, Format::Exr, "description", &WriteOptions::default()));
    bytes.unwrap_or_default()
}

/// And back.
pub(crate) fn metadata_of_note(note: &[u8]) -> Option<Metadata> {
    steradian_image::read(note, "description.exr").ok().map(|i| i.metadata)
}

/// What an option took from the picture.
pub(crate) struct Taken {
    /// The layer that holds it.
    pub name: String,
    /// The share of all light.
    pub share: f64,
}

/// Takes from the picture what outliers add, and adds its layers; what was taken away.
pub(crate) fn add_layers(
    picture: &mut Image,
    film: &Film,
    names: &[String],
) -> Result<Vec<Taken>, steradian_image::Error> {
    let mut taken = Vec::new();
    let sum = |pixels: &[[f32; 3]]| pixels.iter().flatten().map(|&v| f64::from(v)).sum::<f64>();
    let seen = sum(&film.mean());
    for (name, pixels) in read_layers(film, names) {
        let all = if name == CLAMPED { seen + sum(&pixels) } else { seen };
        if name == OUTLIERS {
            for (c, channel) in ["R", "G", "B"].into_iter().enumerate() {
                let Some(plane) = picture.channel_mut(channel) else { continue };
                plane.iter_mut().zip(&pixels).for_each(|(v, p)| *v -= p[c]);
            }
        }
        if name == OUTLIERS || name == CLAMPED {
            let share = if all > 0.0 { sum(&pixels) / all } else { 0.0 };
            picture.metadata.set(&format!("steradian.{name}Share"), Attribute::Double(share));
            taken.push(Taken { name: name.clone(), share });
        }
        aov::planes(picture, &name, ["R", "G", "B"], pixels.iter().copied())?;
    }
    if let Some((bands, planes)) = read_spectrum(film, names) {
        // The layout of Fichet, Pacanowski and Wilkie 2021, in which a dot would begin a layer.
        for (band, plane) in (0..).zip(planes) {
            let name = format!("S0.{:.3}nm", bands.centre(band));
            let name = name.replacen('.', "|", 1).replace('.', ",").replace('|', ".");
            picture.add(&name, plane, Precision::Float)?;
        }
        picture.metadata.set("spectralLayoutVersion", text("1.0"));
        picture.metadata.set("emissiveUnits", text("W.m^-2.sr^-1"));
    }
    Ok(taken)
}

impl Taken {
    /// What it did to the picture, in words.
    pub fn say(&self, console: &Console) {
        let (option, what) = if self.name == CLAMPED {
            ("the limit on samples", "scaled down")
        } else {
            ("the outlier filter", "left out")
        };
        console.warning(format_args!(
            "{option} {what} {} of the light: the picture is biased by that; {}.R .G .B of an .exr show where",
            crate::progress::percent(self.share),
            self.name
        ));
    }
}

/// The picture, and the variance of its pixels' means, with all that they say about themselves.
pub(crate) fn images(rendered: &Rendered, manifest: &Metadata, threads: Option<usize>) -> (Image, Image) {
    let make = |pixels: Vec<[f32; 3]>| {
        let [w, h] = rendered.film.size();
        let mut image = Image::from_rgb(w, h, &pixels).unwrap_or_else(|| Image::new(w, h));
        image.metadata = manifest.clone();
        describe(&mut image.metadata, rendered, threads);
        image
    };
    let mean = make(rendered.film.mean());
    let mut variance = make(rendered.film.variance());
    variance.metadata.set("steradian.content", text("variance of the mean"));
    (mean, variance)
}

/// The picture as it stands.
pub(crate) fn unfinished(film: &Film, manifest: &Metadata) -> Option<Image> {
    let [w, h] = film.size();
    let mut image = Image::from_rgb(w, h, &film.mean())?;
    image.metadata = manifest.clone();
    Some(image)
}

fn place(meta: &mut Metadata, film: &FilmSettings) {
    let [x0, _, y0, _] = film.pixel_bounds;
    meta.origin = [x0 as i32, y0 as i32];
    let [width, height] = film.resolution.map(|n| n as usize);
    meta.frame = Some(Window { x: 0, y: 0, width, height });
    if film.color_space != ColorSpace::Srgb {
        let [red, green, blue] = film.color_space.primaries();
        meta.chromaticities = Some(Chromaticities { red, green, blue, white: film.color_space.white() });
    }
}

fn text(s: impl Into<String>) -> Attribute {
    Attribute::Text(s.into())
}

fn int(v: u32) -> Attribute {
    Attribute::Int(i32::try_from(v).unwrap_or(i32::MAX))
}

/// Which build made a picture: processor, system, and the commit where whoever built it has said so.
fn build() -> String {
    use std::env::consts::{ARCH, OS};
    let kind = if cfg!(debug_assertions) { ", with checks" } else { "" };
    let commit = option_env!("STERADIAN_COMMIT").map_or(String::new(), |c| format!(", {c}"));
    format!("{ARCH} {OS}{kind}{commit}")
}

/// What is known after rendering.
fn describe(meta: &mut Metadata, rendered: &Rendered, threads: Option<usize>) {
    meta.set("samplesPerPixel", int(rendered.spp));
    let [least, most] = rendered.film.samples();
    if least != most {
        meta.set("steradian.averageSpp", Attribute::Double(rendered.film.average_samples()));
        meta.set("steradian.mostSpp", int(most));
    }
    // What --spp would have ended here.
    meta.set("steradian.nominalSpp", int(rendered.nominal));
    meta.set("renderTimeSeconds", Attribute::Float(rendered.elapsed.as_secs_f32()));
    meta.set("steradian.outcome", text(crate::stop::outcome_name(rendered.outcome)));
    if let Some(bound) = rendered.bound {
        meta.set("steradian.errorBound", Attribute::Float(bound as f32));
    }
    if let Some(error) = rendered.error {
        // What progress and the summary show.
        meta.set("steradian.relativeError", Attribute::Float(error as f32));
    }
    meta.set("steradian.build", text(build()));
    if rendered.bad_count > 0 {
        meta.set("steradian.badSamples", text(rendered.bad_count.to_string()));
    }
    meta.set("steradian.date", text(utc(SystemTime::now())));
    if let Some(threads) = threads {
        meta.set("steradian.threads", int(threads as u32));
    }
    if let Some(host) = host() {
        meta.set("steradian.host", text(host));
    }
}

/// Whether an integrator's pixels are numbers that no exposure may change.
pub(crate) fn is_raw_name(integrator: &str) -> bool {
    matches!(integrator, "function" | "normals" | "albedo" | "depth" | "uv")
}

/// The settings that make the picture converge to something else than the scene.
pub(crate) fn biased_options(settings: &RenderSettings) -> Vec<&'static str> {
    [
        (settings.film.max_component_value.is_finite(), "clamp"),
        (settings.integrator.regularize, "regularize"),
        (matches!(settings.integrator.kind, IntegratorKind::Sppm(_)), "sppm"),
        (settings.force_diffuse, "forcediffuse"),
        (settings.disable_pixel_jitter, "disablepixeljitter"),
        (has_regular_grids(settings), "no-jitter"),
        (settings.disable_wavelength_jitter, "disablewavelengthjitter"),
    ]
    .into_iter()
    .filter_map(|(on, name)| on.then_some(name))
    .collect()
}

/// Whether brute force looks through the middles of its cells only.
fn has_regular_grids(settings: &RenderSettings) -> bool {
    matches!(settings.integrator.kind, IntegratorKind::Distribution(d) if !d.jitter)
}

fn host() -> Option<String> {
    let name = std::fs::read_to_string("/proc/sys/kernel/hostname").ok().or_else(|| std::env::var("HOSTNAME").ok())?;
    Some(name.trim().to_owned()).filter(|n| !n.is_empty())
}

/// A moment as ISO 8601 in universal time. Days to dates by the civil calendar's 400-year cycle.
fn utc(time: SystemTime) -> String {
    let seconds = time.duration_since(UNIX_EPOCH).map_or(0, |d| d.as_secs());
    let (days, rest) = (seconds / 86_400, seconds % 86_400);
    // Years begin in March here, so that the leap day comes last.
    let shifted = days + 719_468;
    let (era, day_of_era) = (shifted / 146_097, shifted % 146_097);
    let year_of_era = (day_of_era - day_of_era / 1460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let from_march = (5 * day_of_year + 2) / 153;
    let day = day_of_year - (153 * from_march + 2) / 5 + 1;
    let month = if from_march < 10 { from_march + 3 } else { from_march - 9 };
    let year = era * 400 + year_of_era + u64::from(month <= 2);
    format!("{year:04}-{month:02}-{day:02}T{:02}:{:02}:{:02}Z", rest / 3600, rest % 3600 / 60, rest % 60)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    #[test]
    fn dates_are_the_calendars() {
        let at = |s: u64| utc(UNIX_EPOCH + Duration::from_secs(s));
        assert_eq!(at(0), "1970-01-01T00:00:00Z");
        assert_eq!(at(951_782_400), "2000-02-29T00:00:00Z");
        assert_eq!(at(1_709_251_199), "2024-02-29T23:59:59Z");
        assert_eq!(at(4_107_542_400), "2100-03-01T00:00:00Z");
    }

    #[test]
    fn files_when_none_is_named() {
        let names = |s| default_files(s).iter().map(|p| p.display().to_string()).collect::<Vec<_>>();
        assert_eq!(names(None), ["steradian.png", "steradian.exr"]);
        assert_eq!(names(Some("renders/a.exr")), ["a.exr", "a.png"]);
        assert_eq!(names(Some("a.png")), ["a.png"]);
        assert_eq!(names(Some("a.tga")), ["a.exr", "a.png"]);
        assert_eq!(names(Some("a.b")), ["a.exr", "a.png"]);
    }

    #[test]
    fn files_that_cannot_be_written_are_refused_before_rendering() {
        let dir = tempfile::tempdir().unwrap();
        let in_dir = |name: &str| dir.path().join(name);
        std::fs::create_dir(in_dir("folder.exr")).unwrap();
        std::fs::write(in_dir("file"), b"").unwrap();
        let said = |path: PathBuf| match check(&path) {
            Ok(()) => String::new(),
            Err(e) => e.to_string().replace(&dir.path().display().to_string(), "DIR"),
        };
        assert_eq!(said(in_dir("a.exr")), "");
        assert_eq!(said(in_dir("no/a.exr")), "cannot write DIR/no/a.exr: there is no folder DIR/no");
        assert_eq!(said(in_dir("file/a.exr")), "cannot write DIR/file/a.exr: DIR/file is not a folder");
        assert_eq!(said(in_dir("folder.exr")), "cannot write DIR/folder.exr: it is a folder");
        assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 2, "the probe is removed");
    }
}
