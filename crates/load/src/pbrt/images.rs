//! Pictures for textures, normal maps and lights: read once each, however often they are used.

use super::Loader;
use super::params::Params;
use crate::files::describe;
use std::path::Path;
use steradian_image::{Encoding, Lookup, Texels, Wrap, read_texels};
use steradian_scene::{Handle, TextureImage};
use steradian_spectrum::ColorSpace;
use steradian_syntax::Span;

/// How a picture is looked up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ImageUse {
    pub encoding: Option<Encoding>,
    pub lookup: Lookup,
    pub wrap: [Wrap; 2],
}

/// A picture that is already in the scene.
pub(super) struct LoadedImage {
    path: String,
    usage: ImageUse,
    handle: Handle<TextureImage>,
}

impl Loader<'_> {
    /// The picture in a file, in the scene; what is wrong is reported at `span`.
    pub(super) fn image(
        &mut self,
        params: &mut Params,
        name: &str,
        span: Span,
        usage: ImageUse,
    ) -> Option<Handle<TextureImage>> {
        if let Some(known) = self.images.iter().find(|i| i.path == name && i.usage == usage) {
            return Some(known.handle);
        }
        let texels = self.report_texels(params, name, span, usage.encoding)?;
        if let Some(what) = texels.not_finite() {
            params.warning(format!("{name}: {what}: samples that meet them are reported"), span);
        }
        Some(self.push_image(name, texels, usage))
    }

    fn push_image(&mut self, name: &str, texels: Texels, usage: ImageUse) -> Handle<TextureImage> {
        let color_space = texels
            .chromaticities
            .and_then(|c| ColorSpace::from_chromaticities([c.red, c.green, c.blue], c.white))
            .unwrap_or(ColorSpace::Srgb);
        let ImageUse { lookup, wrap, .. } = usage;
        let image = TextureImage { name: name.to_string(), texels, lookup, wrap, color_space };
        let handle = self.scene.images.push(image);
        self.images.push(LoadedImage { path: name.to_string(), usage, handle });
        handle
    }

    /// The texels of a file; what is wrong is reported at `span`.
    pub(super) fn report_texels(
        &self,
        params: &mut Params,
        name: &str,
        span: Span,
        encoding: Option<Encoding>,
    ) -> Option<Texels> {
        let path = self.resolve(name);
        self.read_texels(&path, encoding).map_err(|message| params.error(message, span)).ok()
    }

    fn read_texels(&self, path: &Path, encoding: Option<Encoding>) -> Result<Texels, String> {
        let bytes = self.files.read(path).map_err(|e| describe(path, &e))?;
        read_texels(&bytes, &path.display().to_string(), encoding).map_err(|e| e.to_string())
    }

    /// The picture of a light: all of its samples must be finite. Its shape decides how it is laid out, and so how it wraps.
    pub(super) fn light_image(
        &mut self,
        params: &mut Params,
        name: &str,
        span: Span,
        wrap: impl Fn(&Texels) -> [Wrap; 2],
    ) -> Option<Handle<TextureImage>> {
        let usage = |texels: &Texels| ImageUse { encoding: None, lookup: Lookup::Bilinear, wrap: wrap(texels) };
        let images = &self.scene.images;
        let known = self.images.iter().find(|i| i.path == name && i.usage == usage(&images[i.handle].texels));
        if let Some(known) = known {
            return Some(known.handle);
        }
        let texels = self.report_texels(params, name, span, None)?;
        if let Some(what) = texels.not_finite() {
            params.error(format!("{name}: a light's image cannot have {what}"), span);
            return None;
        }
        let usage = usage(&texels);
        Some(self.push_image(name, texels, usage))
    }
}

/// Linear RGB of a texel; grey where there is one colour channel only.
pub(super) fn texel_rgb(texels: &Texels, x: usize, y: usize) -> [f32; 3] {
    if texels.channels() >= 3 { [0, 1, 2].map(|c| texels.texel(x, y, c)) } else { [texels.texel(x, y, 0); 3] }
}
