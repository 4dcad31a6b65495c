//! Which image format a file has, by its first bytes or by its extension.

/// An image format that is read here.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// OpenEXR.
    Exr,
    /// Portable network graphics, 8 or 16 bits.
    Png,
    /// JPEG, 8 bits.
    Jpeg,
    /// Radiance RGBE.
    Hdr,
    /// Portable float map.
    Pfm,
    /// Truevision TGA (read only).
    Tga,
    /// Windows bitmap (read only).
    Bmp,
    /// Quite OK Image (read only).
    Qoi,
    /// WebP, lossy and lossless (read only).
    WebP,
}

impl Format {
    /// The format of a file, whose first bytes have the last word; TGA has none that are its own, so there the name decides.
    pub fn detect(bytes: &[u8], name: &str) -> Option<Format> {
        let magic: [(&[u8], Format); 10] = [
            (b"\x76\x2f\x31\x01", Format::Exr),
            (b"\x89PNG\r\n\x1a\n", Format::Png),
            (b"\xff\xd8\xff", Format::Jpeg),
            (b"#?", Format::Hdr),
            (b"PF\n", Format::Pfm),
            (b"Pf\n", Format::Pfm),
            (b"PF ", Format::Pfm),
            (b"PF\r", Format::Pfm),
            (b"BM", Format::Bmp),
            (b"qoif", Format::Qoi),
        ];
        if bytes.starts_with(b"RIFF") && bytes.get(8..12) == Some(b"WEBP") {
            return Some(Format::WebP);
        }
        let found = magic.iter().find(|(m, _)| bytes.starts_with(m)).map(|(_, f)| *f);
        found.or_else(|| Format::from_name(name))
    }

    /// The format that a file name's extension stands for.
    pub fn from_name(name: &str) -> Option<Format> {
        let (_, extension) = name.rsplit_once('.')?;
        Some(match extension.to_ascii_lowercase().as_str() {
            "exr" => Format::Exr,
            "png" => Format::Png,
            "jpg" | "jpeg" => Format::Jpeg,
            "hdr" | "pic" | "rgbe" => Format::Hdr,
            "pfm" => Format::Pfm,
            "tga" => Format::Tga,
            "bmp" => Format::Bmp,
            "qoi" => Format::Qoi,
            "webp" => Format::WebP,
            _ => return None,
        })
    }

    /// Whether its numbers are light as they stand, without a limit at 1.
    pub fn is_high_dynamic_range(self) -> bool {
        matches!(self, Format::Exr | Format::Hdr | Format::Pfm)
    }

    /// Whether files of this format are written as well.
    pub fn is_writable(self) -> bool {
        !matches!(self, Format::Tga | Format::Bmp | Format::Qoi | Format::WebP)
    }

    pub(crate) fn label(self) -> &'static str {
        match self {
            Format::Exr => "EXR",
            Format::Png => "PNG",
            Format::Jpeg => "JPEG",
            Format::Hdr => "HDR",
            Format::Pfm => "PFM",
            Format::Tga => "TGA",
            Format::Bmp => "BMP",
            Format::Qoi => "QOI",
            Format::WebP => "WebP",
        }
    }
}
