//! Lights.

use super::Writer;
use super::bake::{Baked, Flat};
use super::text::{list, number, quoted, spectrum, transform, triples};
use steradian_image::{Precision, Texels};
use steradian_math::{PI, Transform, Vec3, safe_acos, sin_cos};
use steradian_sampling::warp::{lat_long_to_square, square_to_octahedral};
use steradian_scene::{AreaLight, EnvironmentMapping, Handle, Light, Mapping2, TextureImage};
use steradian_spectrum::{ColorSpace, Dense, Spectrum, SpectrumUse};

impl Writer<'_> {
    pub(super) fn area_light(&mut self, l: &AreaLight) -> String {
        let sides = if l.two_sided { " \"bool twosided\" true" } else { "" };
        let power = l.power.map(|p| format!(" \"float power\" {}", number(p))).unwrap_or_default();
        let file = match (l.image, l.texture) {
            (Some(image), _) => Some((self.light_picture(image), self.scene.images[image].color_space)),
            (None, Some(texture)) => match self.flat_color(texture) {
                Some(Flat::Picture(p)) => {
                    let straight = if self.straight { "s" } else { "" };
                    let file = self.baked(&format!("glow{}{straight}", texture.index()), &p, Precision::Float);
                    Some((file, ColorSpace::Srgb))
                }
                Some(Flat::Even(_)) => None,
                None => {
                    self.note("lamps whose textures pbrt has not shine evenly");
                    None
                }
            },
            (None, None) => None,
        };
        match file {
            Some((file, space)) => {
                let scale = number(l.scale * space.photometric());
                let file = quoted(&file);
                format!(
                    "AreaLightSource \"diffuse\" \"string filename\" \"{file}\" \"float scale\" {scale}{sides}{power}"
                )
            }
            None => format!("AreaLightSource \"diffuse\" {}{sides}{power}", emission("L", &l.radiance, l.scale)),
        }
    }

    pub(super) fn lights(&mut self) {
        for light in &self.scene.lights {
            let text = self.light(light);
            self.line(&format!("AttributeBegin\n{text}\nAttributeEnd"));
        }
    }

    fn light(&mut self, light: &Light) -> String {
        match light {
            Light::Point { position: p, intensity, scale } => {
                let from = list(&[p.x, p.y, p.z]);
                format!("LightSource \"point\" \"point3 from\" {from} {}", emission("I", intensity, *scale))
            }
            Light::Spot { world_from_light, intensity, scale, cos_end, cos_start } => {
                let (end, start) = (safe_acos(*cos_end).to_degrees(), safe_acos(*cos_start).to_degrees());
                let light = emission("I", intensity, *scale);
                format!("{}\nLightSource \"spot\" {} {light}", transform(world_from_light), cone(end, start))
            }
            Light::Cone { world_from_light, intensity, scale, end, start, slide } => {
                self.note("spots of Mitsuba fall off smoothly instead of in proportion to the angle");
                if slide.is_some() {
                    self.note("slides of spots are left out");
                }
                let light = emission("I", intensity, *scale);
                let cone = cone(end.to_degrees(), start.to_degrees());
                format!("{}\nLightSource \"spot\" {cone} {light}", transform(world_from_light))
            }
            Light::Distant { to_light: d, radiance, scale } => {
                let from = list(&[d.x, d.y, d.z]);
                let light = emission("L", radiance, *scale);
                format!("LightSource \"distant\" \"point3 from\" {from} \"point3 to\" [ 0 0 0 ] {light}")
            }
            Light::Sun { to_light: d, half_angle, profile, scale } => {
                self.note("the disc of a sun becomes parallel light: its shadows are sharp, and it is not seen");
                let half = sin_cos(0.5 * half_angle).0;
                let solid_angle = 4.0 * PI * half * half;
                // The mean of a power of the height over a disc is 2 / (power + 2).
                let mean = |f: &dyn Fn(&Spectrum) -> f32| {
                    (2u8..).zip(profile).map(|(k, s)| f(s) * 2.0 / f32::from(k)).sum::<f32>().max(0.0)
                };
                let table = Dense::from_fn(|l| mean(&|s| s.eval_at(l)));
                let radiance = Spectrum::dense(table, SpectrumUse::Illuminant);
                let from = list(&[d.x, d.y, d.z]);
                let light = emission("L", &radiance, scale * solid_angle);
                format!("LightSource \"distant\" \"point3 from\" {from} \"point3 to\" [ 0 0 0 ] {light}")
            }
            Light::Goniometric { world_from_light, intensity, image, scale } => {
                let file = self.light_picture(*image);
                // The picture's pole is y of pbrt's light, z of the scene's.
                let swap = [[1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]];
                let t = transform(&world_from_light.mul(&Transform { m: swap, inv: swap }));
                let light = emission("I", intensity, *scale);
                format!("{t}\nLightSource \"goniometric\" \"string filename\" \"{}\" {light}", quoted(&file))
            }
            Light::Projection { world_from_light, image, screen, fov, scale } => {
                if screen.is_some() {
                    self.note("projectors of Mitsuba shine on a sphere around them as on a screen, and so are darker at their edges");
                }
                let (scale, file) = (self.scaled(*image, *scale), self.light_picture(*image));
                let (t, fov) = (transform(world_from_light), number(*fov));
                format!(
                    "{t}\nLightSource \"projection\" \"string filename\" \"{}\" \"float fov\" {fov} \"float scale\" {scale}",
                    quoted(&file)
                )
            }
            Light::UniformInfinite { radiance, scale } => {
                format!("LightSource \"infinite\" {}", emission("L", radiance, *scale))
            }
            Light::ImageInfinite { world_from_light, image, mapping, scale } => {
                let file = match mapping {
                    EnvironmentMapping::EqualArea => self.light_picture(*image),
                    EnvironmentMapping::LatLong | EnvironmentMapping::LatLongToPoles => {
                        self.note("maps of latitude and longitude are drawn again on pbrt's square");
                        let at_poles = *mapping == EnvironmentMapping::LatLongToPoles;
                        let square = octahedral(&self.scene.images[*image].texels, *image, at_poles);
                        self.baked(&format!("sky{}", image.index()), &square, Precision::Float)
                    }
                };
                let scale = self.scaled(*image, *scale);
                sky(world_from_light, &file, &scale, "")
            }
            Light::PortalInfinite { world_from_light, image, scale, portal } => {
                let (scale, file) = (self.scaled(*image, *scale), self.light_picture(*image));
                let corners = triples(portal.iter().map(|p| [p.x, p.y, p.z]));
                sky(world_from_light, &file, &scale, &format!(" \"point3 portal\" {corners}"))
            }
            Light::Moving { light, world_from_light: moving } => {
                self.note("lights that move stand still in pbrt, where they are first");
                let [start, end] = self.scene.camera.shutter.map(|time| transform(&moving.at(time)));
                let light = self.light(light);
                let within = if light.starts_with("Transform") { "Concat" } else { "" };
                format!(
                    "ActiveTransform StartTime {start}\nActiveTransform EndTime {end}\nActiveTransform All\n{within}{light}"
                )
            }
        }
    }

    /// A factor before it is divided by the white of a picture.
    fn scaled(&self, image: Handle<TextureImage>, scale: f32) -> String {
        number(scale * self.scene.images[image].color_space.photometric())
    }
}

fn emission(name: &str, s: &Spectrum, scale: f32) -> String {
    format!("{} \"float scale\" {}", spectrum(name, s), number(scale * s.photometric()))
}

fn cone(end: f32, start: f32) -> String {
    format!("\"float coneangle\" {} \"float conedeltaangle\" {}", number(end), number((end - start).max(0.0)))
}

fn sky(t: &Transform, file: &str, scale: &str, more: &str) -> String {
    let (t, file) = (transform(t), quoted(file));
    format!("{t}\nLightSource \"infinite\" \"string filename\" \"{file}\" \"float scale\" {scale}{more}")
}

/// A map of latitude and longitude on the equal-area square (Clarberg 2008): each texel the mean of some points of it.
fn octahedral(map: &Texels, like: Handle<TextureImage>, at_poles: bool) -> Baked {
    const POINTS: usize = 4;
    let (w, h) = (map.width(), map.height());
    let side = (h + h / 2).next_power_of_two().clamp(64, 4096);
    // Between the texels' centres, around and not over the poles.
    let look = |u: f32, v: f32, c: usize| {
        let y = if at_poles { v * (h - 1) as f32 } else { v * h as f32 - 0.5 };
        let x = u * w as f32 - 0.5;
        let (fx, fy) = (x - x.floor(), y - y.floor());
        let column = |i: i64| i.rem_euclid(w as i64) as usize;
        let row = |j: i64| j.clamp(0, h as i64 - 1) as usize;
        let at = |i: i64, j: i64| map.texel(column(i), row(j), if map.channels() < 3 { 0 } else { c });
        let (i, j) = (x.floor() as i64, y.floor() as i64);
        (at(i, j) * (1.0 - fx) + at(i + 1, j) * fx) * (1.0 - fy)
            + (at(i, j + 1) * (1.0 - fx) + at(i + 1, j + 1) * fx) * fy
    };
    let mut values = Vec::with_capacity(side * side);
    for y in 0..side {
        for x in 0..side {
            let mut sum = [0.0f32; 3];
            for k in 0..POINTS * POINTS {
                let at = |i: usize, k: usize| (i as f32 + (k as f32 + 0.5) / POINTS as f32) / side as f32;
                let d: Vec3 = square_to_octahedral([at(x, k % POINTS), at(y, k / POINTS)]);
                let [u, v] = lat_long_to_square(d);
                for (c, s) in sum.iter_mut().enumerate() {
                    *s += look(u, v, c);
                }
            }
            values.push(sum.map(|s| s / (POINTS * POINTS) as f32));
        }
    }
    Baked { width: side, height: side, values, mapping: Mapping2::default(), like }
}
