//! Lights, and the media between surfaces.

use super::{Writer, exr, list, quoted, spectrum, transform};
use steradian_image::{Encoding, Storage, Texels};
use steradian_math::{Transform, Vec3, safe_acos};
use steradian_sampling::warp::{lat_long_to_square, square_to_octahedral};
use steradian_scene::{AreaLight, EnvironmentMapping, Light, Volume};
use steradian_spectrum::Spectrum;

impl Writer<'_> {
    pub(super) fn area_light(&mut self, l: &AreaLight) -> String {
        let sides = if l.two_sided { " \"bool twosided\" true" } else { "" };
        let power = l.power.map(|p| format!(" \"float power\" {p}")).unwrap_or_default();
        let white = |s: &Spectrum| l.scale * s.photometric();
        match (l.image, l.texture) {
            (Some(image), _) => {
                let file = self.image(image, true);
                let scale = l.scale * self.scene.images[image].color_space.photometric();
                format!(
                    "AreaLightSource \"diffuse\" \"string filename\" \"{}\" \"float scale\" {scale}{sides}{power}",
                    quoted(&file)
                )
            }
            (None, Some(_)) => {
                self.note("lamps with textures shine evenly");
                format!(
                    "AreaLightSource \"diffuse\" {} \"float scale\" {}{sides}{power}",
                    spectrum("L", &l.radiance),
                    white(&l.radiance)
                )
            }
            _ => format!(
                "AreaLightSource \"diffuse\" {} \"float scale\" {}{sides}{power}",
                spectrum("L", &l.radiance),
                white(&l.radiance)
            ),
        }
    }

    pub(super) fn lights(&mut self) {
        for light in &self.scene.lights {
            let text = self.light(light);
            self.line(&format!("AttributeBegin\n{text}\nAttributeEnd"));
        }
    }

    fn light(&mut self, light: &Light) -> String {
        let emission = |name: &str, s: &Spectrum, scale: f32| {
            format!("{} \"float scale\" {}", spectrum(name, s), scale * s.photometric())
        };
        match light {
            Light::Point { position: p, intensity, scale } => {
                let from = list(&[p.x, p.y, p.z]);
                format!("LightSource \"point\" \"point3 from\" {from} {}", emission("I", intensity, *scale))
            }
            Light::Spot { world_from_light, intensity, scale, cos_end, cos_start } => {
                let (end, start) = (safe_acos(*cos_end).to_degrees(), safe_acos(*cos_start).to_degrees());
                let cone = format!("\"float coneangle\" {end} \"float conedeltaangle\" {}", end - start);
                format!(
                    "{}\nLightSource \"spot\" {cone} {}",
                    transform(world_from_light),
                    emission("I", intensity, *scale)
                )
            }
            Light::Cone { world_from_light, intensity, scale, end, start, slide } => {
                self.note("spots of Mitsuba fall off smoothly instead of in proportion to the angle");
                if slide.is_some() {
                    self.note("slides of spots are left out");
                }
                let (end, start) = (end.to_degrees(), start.to_degrees());
                let cone = format!("\"float coneangle\" {end} \"float conedeltaangle\" {}", end - start);
                format!(
                    "{}\nLightSource \"spot\" {cone} {}",
                    transform(world_from_light),
                    emission("I", intensity, *scale)
                )
            }
            Light::Distant { to_light: d, radiance, scale } => {
                let from = list(&[d.x, d.y, d.z]);
                format!(
                    "LightSource \"distant\" \"point3 from\" {from} \"point3 to\" [ 0 0 0 ] {}",
                    emission("L", radiance, *scale)
                )
            }
            Light::Goniometric { world_from_light, intensity, image, scale } => {
                let file = self.image(*image, false);
                let t = transform(world_from_light);
                format!(
                    "{t}\nLightSource \"goniometric\" \"string filename\" \"{}\" {}",
                    quoted(&file),
                    emission("I", intensity, *scale)
                )
            }
            Light::Projection { world_from_light, image, on_screen, fov, scale } => {
                if *on_screen {
                    self.note("projectors of Mitsuba are darker towards their edges");
                }
                let file = self.image(*image, true);
                let scale = scale * self.scene.images[*image].color_space.photometric();
                let t = transform(world_from_light);
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
                    EnvironmentMapping::EqualArea => self.image(*image, true),
                    EnvironmentMapping::LatLong => {
                        let name = format!("{}/sky{}.exr", self.folder, image.index());
                        if let Some(square) = octahedral(&self.scene.images[*image].texels) {
                            self.note("maps of latitude and longitude are drawn again on pbrt's square");
                            self.out.files.push((name.clone(), exr(&square, true)));
                        }
                        name
                    }
                };
                self.sky(world_from_light, &file, *scale * self.scene.images[*image].color_space.photometric(), "")
            }
            Light::PortalInfinite { world_from_light, image, scale, portal } => {
                let file = self.image(*image, true);
                let corners: Vec<f32> = portal.iter().flat_map(|p| [p.x, p.y, p.z]).collect();
                let scale = scale * self.scene.images[*image].color_space.photometric();
                self.sky(world_from_light, &file, scale, &format!(" \"point3 portal\" {}", list(&corners)))
            }
        }
    }

    fn sky(&self, t: &Transform, file: &str, scale: f32, more: &str) -> String {
        let t = transform(t);
        format!("{t}\nLightSource \"infinite\" \"string filename\" \"{}\" \"float scale\" {scale}{more}", quoted(file))
    }

    pub(super) fn media(&mut self) {
        for (index, m) in self.scene.media.iter().enumerate() {
            let start = format!("MakeNamedMedium \"medium{index}\" \"float g\" {} \"float scale\" {}", m.g, m.scale);
            let text = match &m.volume {
                Volume::Homogeneous { coefficients: c, emission } => {
                    let glow = emission.as_ref().map(|(s, scale)| {
                        format!(" {} \"float Lescale\" {}", spectrum("Le", s), scale * s.photometric())
                    });
                    format!(
                        "{start} \"string type\" \"homogeneous\" {} {}{}",
                        spectrum("sigma_a", &c.sigma_a),
                        spectrum("sigma_s", &c.sigma_s),
                        glow.unwrap_or_default()
                    )
                }
                Volume::Grid { coefficients: c, bounds, density, glow } => {
                    if glow.is_some() {
                        self.note("glowing media are written dark");
                    }
                    let [x, y, z] = density.size;
                    let (low, high) = (bounds.min, bounds.max);
                    format!(
                        "{start} \"string type\" \"uniformgrid\" {} {} \"integer nx\" {x} \"integer ny\" {y} \"integer nz\" {z}\n  \"point3 p0\" {} \"point3 p1\" {} \"float density\" {}",
                        spectrum("sigma_a", &c.sigma_a),
                        spectrum("sigma_s", &c.sigma_s),
                        list(&[low.x, low.y, low.z]),
                        list(&[high.x, high.y, high.z]),
                        list(&density.values)
                    )
                }
                Volume::RgbGrid(g) => {
                    let size = g.sigma_a.as_ref().or(g.sigma_s.as_ref()).map_or([1; 3], |v| v.size);
                    let grid = |name: &str, v: &Option<steradian_scene::VoxelGrid<[f32; 3]>>| {
                        let values = v.as_ref().map(|v| v.values.iter().flatten().copied().collect::<Vec<f32>>());
                        values.map(|v| format!(" \"rgb {name}\" {}", list(&v))).unwrap_or_default()
                    };
                    let (low, high) = (g.bounds.min, g.bounds.max);
                    format!(
                        "{start} \"string type\" \"rgbgrid\"{}{} \"integer nx\" {} \"integer ny\" {} \"integer nz\" {}\n  \"point3 p0\" {} \"point3 p1\" {}",
                        grid("sigma_a", &g.sigma_a),
                        grid("sigma_s", &g.sigma_s),
                        size[0],
                        size[1],
                        size[2],
                        list(&[low.x, low.y, low.z]),
                        list(&[high.x, high.y, high.z])
                    )
                }
                Volume::Cloud(_) | Volume::Sparse { .. } => {
                    self.note("clouds and sparse grids are left out");
                    format!(
                        "{start} \"string type\" \"homogeneous\" \"rgb sigma_a\" [ 0 0 0 ] \"rgb sigma_s\" [ 0 0 0 ]"
                    )
                }
            };
            self.line(&format!("AttributeBegin\n{}\n{text}\nAttributeEnd", transform(&m.world_from_medium)));
        }
    }
}

/// A map of latitude and longitude on the equal-area square (Clarberg 2008), four by four points to a texel.
fn octahedral(map: &Texels) -> Option<Texels> {
    const POINTS: usize = 4;
    let (w, h) = (map.width(), map.height());
    let side = (h + h / 2).next_power_of_two().clamp(64, 4096);
    let mut values = Vec::with_capacity(3 * side * side);
    for y in 0..side {
        for x in 0..side {
            let mut sum = [0.0f32; 3];
            for k in 0..POINTS * POINTS {
                let at = |i: usize, k: usize| (i as f32 + (k as f32 + 0.5) / POINTS as f32) / side as f32;
                let d: Vec3 = square_to_octahedral([at(x, k % POINTS), at(y, k / POINTS)]);
                let [u, v] = lat_long_to_square(d);
                let cell = |u: f32, n: usize| ((u * n as f32) as usize).min(n - 1);
                for (c, s) in sum.iter_mut().enumerate() {
                    *s += map.texel(cell(u, w), cell(v, h), if map.channels() < 3 { 0 } else { c });
                }
            }
            values.extend(sum.map(|s| s / (POINTS * POINTS) as f32));
        }
    }
    Texels::new(side, side, 3, Storage::F32(values), Encoding::Linear).ok()
}
