//! How stored numbers stand for light: sRGB (IEC 61966-2-1), linear, or a power law.

use steradian_math::powf;

/// Meaning of the integer samples of an 8-bit or 16-bit image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Encoding {
    /// The piecewise sRGB curve.
    Srgb,
    /// Proportional to light.
    Linear,
    /// Light is the stored value to this power (2.2 for old displays).
    Gamma(f32),
}

impl Encoding {
    /// Stored value in `[0,1]` to linear light.
    pub fn to_linear(self, v: f32) -> f32 {
        match self {
            Encoding::Srgb => srgb_to_linear(v),
            Encoding::Linear => v,
            Encoding::Gamma(g) => powf(v.max(0.0), g),
        }
    }

    /// Linear light to a stored value; `[0,1]` maps onto `[0,1]`, and larger values go on rising.
    pub fn from_linear(self, v: f32) -> f32 {
        match self {
            Encoding::Srgb => linear_to_srgb(v),
            Encoding::Linear => v,
            Encoding::Gamma(g) => powf(v.max(0.0), 1.0 / g),
        }
    }

    /// Linear light to the nearest of 256 codes, clamped; NaN becomes 0.
    pub fn quantize8(self, v: f32) -> u8 {
        // A cast from float to integer saturates and sends NaN to 0, which is what is wanted here.
        (self.from_linear(v.clamp(0.0, 1.0)) * 255.0 + 0.5) as u8
    }

    /// Linear light to the nearest of 65536 codes, clamped; NaN becomes 0.
    pub fn quantize16(self, v: f32) -> u16 {
        (self.from_linear(v.clamp(0.0, 1.0)) * 65535.0 + 0.5) as u16
    }

    /// The linear value of each 8-bit code.
    pub fn table(self) -> [f32; 256] {
        std::array::from_fn(|i| self.to_linear(i as f32 / 255.0))
    }

    /// The name in scene files: `sRGB`, `linear`, or `gamma 2.2`.
    pub fn from_name(name: &str) -> Option<Encoding> {
        match name {
            "sRGB" | "srgb" => Some(Encoding::Srgb),
            "linear" => Some(Encoding::Linear),
            _ => {
                let g: f32 = name.strip_prefix("gamma")?.trim().parse().ok()?;
                (g > 0.0 && g.is_finite()).then_some(Encoding::Gamma(g))
            }
        }
    }
}

/// The sRGB decoding curve, IEC 61966-2-1.
pub fn srgb_to_linear(v: f32) -> f32 {
    if v <= 0.04045 { v / 12.92 } else { powf((v + 0.055) / 1.055, 2.4) }
}

/// The sRGB encoding curve, the inverse of `srgb_to_linear`.
pub fn linear_to_srgb(v: f32) -> f32 {
    if v <= 0.003_130_8 { v * 12.92 } else { 1.055 * powf(v, 1.0 / 2.4) - 0.055 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn eight_bit_codes_survive_the_round_trip() {
        for e in [Encoding::Srgb, Encoding::Linear, Encoding::Gamma(2.2)] {
            let table = e.table();
            for (code, &v) in table.iter().enumerate() {
                assert_eq!(e.quantize8(v) as usize, code, "{e:?}");
            }
        }
    }

    #[test]
    fn srgb_has_its_published_values() {
        // Half light is code 187.5 and middle code 128 is 0.2158605.
        assert!((linear_to_srgb(0.5) - 0.735_356_98).abs() < 1e-6);
        assert!((srgb_to_linear(128.0 / 255.0) - 0.215_860_5).abs() < 1e-6);
        assert_eq!(Encoding::Srgb.quantize8(f32::NAN), 0);
        assert_eq!(Encoding::Srgb.quantize8(f32::INFINITY), 255);
    }

    #[test]
    fn names_of_encodings() {
        assert_eq!(Encoding::from_name("gamma 2.2"), Some(Encoding::Gamma(2.2)));
        assert_eq!(Encoding::from_name("sRGB"), Some(Encoding::Srgb));
        assert_eq!(Encoding::from_name("gamma -1"), None);
        assert_eq!(Encoding::from_name("cineon"), None);
    }
}
