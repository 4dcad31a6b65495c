//! Media between surfaces.

use super::Writer;
use super::text::{integers, list, number, spectrum, transform};
use steradian_bsdf::TabulatedPhase;
use steradian_math::{Bounds3, Point3, Vec3};
use steradian_scene::{Coefficients, Field, Fields, Glow, Medium, Phase, RgbGrid, Texture, Volume, VoxelGrid};
use steradian_spectrum::ColorSpace;

impl Writer<'_> {
    pub(super) fn media(&mut self) {
        for (index, m) in self.scene.media.iter().enumerate() {
            let kind = self.medium(m);
            // The coefficients of a cloud have no factor, but its density has.
            let scale = match m.volume {
                Volume::Cloud(_) => String::new(),
                _ => format!(" \"float scale\" {}", number(m.scale)),
            };
            let text = format!(
                "MakeNamedMedium \"medium{index}\" \"float g\" {}{scale} \"string type\" {kind}",
                number(self.mean_cosine(&m.phase, &m.name))
            );
            self.head(&format!("AttributeBegin\n{}\n{text}\nAttributeEnd", transform(&m.world_from_medium)));
        }
    }

    /// The mean cosine of a phase function, which is all that pbrt knows of one.
    fn mean_cosine(&mut self, phase: &Phase, medium: &str) -> f32 {
        if !matches!(phase, Phase::HenyeyGreenstein { .. }) {
            self.subject = if medium.is_empty() { String::new() } else { format!("\"{medium}\"") };
            self.note("phase functions are written as Henyey and Greenstein's of the same mean cosine");
        }
        match phase {
            Phase::HenyeyGreenstein { g } => *g,
            Phase::Rayleigh => 0.0,
            Phase::Tabulated(values) => TabulatedPhase::new(values).map_or(0.0, |t| t.mean_cosine()),
            Phase::Blend { parts, amount } => {
                let w = match &self.scene.float_textures[*amount].0 {
                    Texture::Constant(w) => w.clamp(0.0, 1.0),
                    _ => 0.5,
                };
                (1.0 - w) * self.mean_cosine(&parts[0], medium) + w * self.mean_cosine(&parts[1], medium)
            }
        }
    }

    fn medium(&mut self, m: &Medium) -> String {
        self.subject = if m.name.is_empty() { String::new() } else { format!("\"{}\"", m.name) };
        match &m.volume {
            Volume::Homogeneous { coefficients, emission } => {
                let glow = emission.as_ref().map(|(s, scale)| {
                    format!(" {} \"float Lescale\" {}", spectrum("Le", s), number(scale * s.photometric()))
                });
                format!("\"homogeneous\" {}{}", sigmas(coefficients), glow.unwrap_or_default())
            }
            Volume::Grid { coefficients, bounds, density, glow } => {
                let values = list(&density.values);
                let glow = glow.as_ref().map_or(String::new(), |g| shine(g, density.values.len()));
                format!(
                    "\"uniformgrid\" {} {} \"float density\" {values}{glow}",
                    sigmas(coefficients),
                    cells(density.size, bounds)
                )
            }
            Volume::RgbGrid(grid) => rgb_grid(grid),
            Volume::Fields(fields) => {
                self.note(
                    "extinction and albedo are multiplied in each cell of one grid, which reaches a cell farther",
                );
                rgb_grid(&multiplied(fields))
            }
            Volume::Cloud(c) => format!(
                "\"cloud\" {} {} \"float density\" {} \"float wispiness\" {} \"float frequency\" {}",
                sigmas(&c.coefficients),
                corners(&c.bounds),
                number(c.density * m.scale),
                number(c.wispiness),
                number(c.frequency)
            ),
            Volume::Sparse { .. } => {
                self.note("sparse grids of NanoVDB are left out: the medium is written empty");
                "\"homogeneous\" \"rgb sigma_a\" [ 0 0 0 ] \"rgb sigma_s\" [ 0 0 0 ]".into()
            }
        }
    }
}

/// What glows in a grid of `count` cells.
fn shine(glow: &Glow<VoxelGrid<f32>>, count: usize) -> String {
    let factors = |field: &Option<VoxelGrid<f32>>, scale: f32| match field {
        // One cell is what is taken where nothing is said.
        Some(f) if f.size == [1; 3] && count != 1 => String::new(),
        Some(f) => format!(" \"float Lescale\" {}", list(&f.values.iter().map(|v| v * scale).collect::<Vec<_>>())),
        None => format!(" \"float Lescale\" {}", list(&vec![scale; count])),
    };
    match glow {
        Glow::Spectrum { radiance, scale, field } => {
            let scale = scale * radiance.photometric();
            format!("\n  {}{}", spectrum("Le", radiance), factors(field, scale))
        }
        Glow::Blackbody { temperature, offset, temperature_scale, scale, field } => format!(
            "\n  \"float temperature\" {} \"float temperatureoffset\" {} \"float temperaturescale\" {}{}",
            list(&temperature.values),
            number(*offset),
            number(*temperature_scale),
            factors(field, *scale)
        ),
    }
}

fn sigmas(c: &Coefficients) -> String {
    format!("{} {}", spectrum("sigma_a", &c.sigma_a), spectrum("sigma_s", &c.sigma_s))
}

fn corners(b: &Bounds3) -> String {
    let of = |p: Point3| list(&[p.x, p.y, p.z]);
    format!("\"point3 p0\" {} \"point3 p1\" {}", of(b.min), of(b.max))
}

fn cells([x, y, z]: [u32; 3], b: &Bounds3) -> String {
    format!(
        "\"integer nx\" {} \"integer ny\" {} \"integer nz\" {}\n  {}",
        integers([x]),
        integers([y]),
        integers([z]),
        corners(b)
    )
}

/// Absorption and scattering on one grid. pbrt's thin out within the outermost cells, so that there is a further layer of them.
fn multiplied(f: &Fields) -> RgbGrid {
    // Where nothing varies, the layer should be thin.
    const EVEN: [u32; 3] = [16; 3];
    let size = [&f.sigma_t, &f.albedo].into_iter().fold(None, |most: Option<[u32; 3]>, field| match field {
        Field::Even(_) => most,
        Field::Grid(g) => Some(most.map_or(g.size, |m| std::array::from_fn(|k| m[k].max(g.size[k])))),
    });
    let inner = size.unwrap_or(EVEN);
    let (low, d) = (f.bounds.min, f.bounds.diagonal());
    let cell = Vec3::new(d.x / inner[0] as f32, d.y / inner[1] as f32, d.z / inner[2] as f32);
    let size = inner.map(|n| n + 2);
    let (mut sigma_a, mut sigma_s) = (Vec::new(), Vec::new());
    for z in 0..size[2] {
        for y in 0..size[1] {
            for x in 0..size[0] {
                let middle = |i: u32, n: u32| i.clamp(1, n) as f32 - 0.5;
                let (i, j, k) = (middle(x, inner[0]), middle(y, inner[1]), middle(z, inner[2]));
                let p: Point3 = low + Vec3::new(i * cell.x, j * cell.y, k * cell.z);
                let (t, a) = (f.sigma_t.rgb(p), f.albedo.rgb(p).map(|a| a.clamp(0.0, 1.0)));
                sigma_a.push(std::array::from_fn(|c| t[c] * (1.0 - a[c])));
                sigma_s.push(std::array::from_fn(|c| t[c] * a[c]));
            }
        }
    }
    let grid = |values| Some(VoxelGrid { size, values });
    let (sigma_a, sigma_s) = (grid(sigma_a), grid(sigma_s));
    let bounds = Bounds3 { min: low - cell, max: f.bounds.max + cell };
    RgbGrid { bounds, color_space: ColorSpace::Srgb, sigma_a, sigma_s, emission: None }
}

fn rgb_grid(g: &RgbGrid) -> String {
    let emission = g.emission.as_ref().map(|e| &e.0);
    let all = [("sigma_a", g.sigma_a.as_ref()), ("sigma_s", g.sigma_s.as_ref()), ("Le", emission)];
    let size = all.iter().find_map(|(_, v)| v.map(|v: &VoxelGrid<[f32; 3]>| v.size)).unwrap_or([1; 3]);
    let mut text = format!("\"rgbgrid\" {}", cells(size, &g.bounds));
    for (name, values) in all.into_iter().filter_map(|(name, v)| Some((name, &v?.values))) {
        let flat: Vec<f32> = values.iter().flatten().copied().collect();
        text += &format!("\n  \"rgb {name}\" {}", list(&flat));
    }
    if let Some((_, scale)) = &g.emission {
        text += &format!(" \"float Lescale\" {}", number(*scale));
    }
    text
}
