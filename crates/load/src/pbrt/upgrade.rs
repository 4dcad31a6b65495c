//! Scenes of pbrt-v3, read as pbrt-v4's `--upgrade` would rewrite them. `WorldEnd`, which only they have, gives them away.
//!
//! Each directive is rewritten before anything looks at it. What v4 has nothing for is left out with a warning.

use super::Loader;
use steradian_syntax::{Arg, ArgValue, Diagnostic, Directive, Kind, Param, ParamType, Span, Values};

/// Whether a text is a scene of pbrt-v3: its last word that is no comment is `WorldEnd`.
pub(super) fn is_v3(text: &str) -> bool {
    let code = |line: &'_ str| line.split('#').next().unwrap_or("").trim().to_owned();
    text.lines().rev().map(code).find(|line| !line.is_empty()).is_some_and(|line| {
        // Something may stand before it on its line.
        line.split([' ', '\t', ']', '"']).next_back() == Some("WorldEnd")
    })
}

/// A directive with what v3 calls otherwise.
struct Old<'d> {
    d: &'d mut Directive,
    warnings: Vec<Diagnostic>,
}

impl Old<'_> {
    fn find(&self, name: &str) -> Option<&Param> {
        self.d.params.iter().rev().find(|p| p.name == name)
    }

    fn rename(&mut self, from: &str, to: &str) {
        self.d.params.iter_mut().filter(|p| p.name == from).for_each(|p| p.name = to.to_owned());
    }

    fn drop(&mut self, names: &[&str]) {
        self.d.params.retain(|p| !names.contains(&p.name.as_str()));
    }

    /// Leaves a parameter out, silently if it has the value that changes nothing; whether it had.
    fn drop_unless(&mut self, name: &str, value: f32) -> bool {
        let Some(p) = self.find(name) else { return false };
        let same = matches!(&p.values, Values::Floats(v) if !v.is_empty() && v.iter().all(|&x| x == value));
        if !same {
            let message = format!("`{name}` of pbrt-v3 has no counterpart here and is left out");
            self.warnings.push(Diagnostic::warning(message, p.span));
        }
        self.drop(&[name]);
        same
    }

    fn retype(&mut self, name: &str, ty: ParamType) {
        self.d.params.iter_mut().filter(|p| p.name == name).for_each(|p| p.ty = ty);
    }

    fn add(&mut self, ty: ParamType, name: &str, values: Values) {
        let span = self.d.span;
        self.d.params.push(Param { ty, name: name.to_owned(), span, values_span: span, values });
    }

    fn text(&mut self, name: &str, value: &str) {
        let span = self.d.span;
        self.add(ParamType::String, name, Values::Strings(vec![(value.to_owned(), span)]));
    }

    fn take(&mut self, name: &str) -> Option<Param> {
        let at = self.d.params.iter().rposition(|p| p.name == name)?;
        Some(self.d.params.remove(at))
    }

    /// A number that v3 takes as a colour; the mean, with a warning where that is not the same.
    fn scalar(&mut self, name: &str) -> Option<f32> {
        let p = self.take(name)?;
        let Values::Floats(v) = &p.values else {
            self.d.params.push(p);
            return None;
        };
        let mean = v.iter().sum::<f32>() / v.len().max(1) as f32;
        if v.iter().any(|&x| x != v[0]) {
            let message = format!("`{name}` is one number here: the mean of these, {mean}, is taken");
            self.warnings.push(Diagnostic::warning(message, p.span));
        }
        Some(mean)
    }

    /// Film, camera, sampler and the like.
    fn option(&mut self, kind: &str) -> Option<&'static str> {
        match (self.d.kind, kind) {
            (Kind::Film, "image") => {
                self.rename("maxsampleluminance", "maxcomponentvalue");
                if let Some(scale) = self.scalar("scale") {
                    self.add(ParamType::Float, "iso", Values::Floats(vec![100.0 * scale]));
                }
                Some("rgb")
            }
            (Kind::Sampler, "lowdiscrepancy" | "02sequence") => Some("paddedsobol"),
            (Kind::Sampler, "maxmindist") => Some("pmj02bn"),
            (Kind::Sampler, "random") => Some("independent"),
            (Kind::PixelFilter, _) => {
                self.rename("xwidth", "xradius");
                self.rename("ywidth", "yradius");
                if let Some(alpha) = self.scalar("alpha") {
                    let sigma = 1.0 / (2.0 * alpha).sqrt();
                    self.add(ParamType::Float, "sigma", Values::Floats(vec![sigma]));
                }
                None
            }
            (Kind::Camera, "environment") => {
                self.text("mapping", "equirectangular");
                Some("spherical")
            }
            (Kind::Camera, _) => {
                self.drop(&["simpleweighting"]);
                None
            }
            (Kind::Integrator, _) => {
                self.drop(&["rrthreshold", "imagewritefrequency", "numiterations", "strategy"]);
                if let Some(p) = self.take("lightsamplestrategy")
                    && let Values::Strings(v) = &p.values
                    && let [(word, span)] = v.as_slice()
                {
                    let word = if word == "spatial" { "bvh" } else { word };
                    let values = Values::Strings(vec![(word.to_owned(), *span)]);
                    self.d.params.push(Param { name: "lightsampler".into(), values, ..p });
                }
                if kind == "directlighting" {
                    self.drop(&["maxdepth"]);
                    self.add(ParamType::Integer, "maxdepth", Values::Ints(vec![1]));
                    return Some("path");
                }
                None
            }
            (Kind::MakeNamedMedium, _) => {
                if let Some(p) = self.d.params.iter_mut().find(|p| p.name == "type")
                    && let Values::Strings(v) = &mut p.values
                {
                    v.iter_mut().filter(|(s, _)| s == "heterogeneous").for_each(|(s, _)| *s = "uniformgrid".into());
                }
                None
            }
            _ => None,
        }
    }

    /// A material by its v3 name; the v4 name.
    fn material(&mut self, kind: &str) -> Option<&'static str> {
        self.rename("bumpmap", "displacement");
        let is_rough = |old: &Self| old.find("roughness").is_some() || old.find("uroughness").is_some();
        match kind {
            "matte" => {
                self.drop(&["sigma"]);
                self.rename("Kd", "reflectance");
                Some("diffuse")
            }
            "plastic" | "uber" => {
                let dull = self.drop_unless("Ks", 0.0);
                self.rename("Kd", "reflectance");
                self.rename("index", "eta");
                self.drop_unless("Kr", 0.0);
                self.drop_unless("Kt", 0.0);
                self.drop_unless("opacity", 1.0);
                if dull {
                    self.drop(&["roughness", "uroughness", "vroughness", "eta", "remaproughness"]);
                    return Some("diffuse");
                }
                if !is_rough(self) {
                    self.add(ParamType::Float, "roughness", Values::Floats(vec![0.1]));
                }
                Some("coateddiffuse")
            }
            "substrate" => {
                self.drop_unless("Ks", 1.0);
                self.rename("Kd", "reflectance");
                if !is_rough(self) {
                    self.add(ParamType::Float, "roughness", Values::Floats(vec![0.1]));
                }
                Some("coateddiffuse")
            }
            "glass" => {
                self.drop_unless("Kr", 1.0);
                self.drop_unless("Kt", 1.0);
                self.rename("index", "eta");
                Some("dielectric")
            }
            "metal" => {
                self.drop_unless("Kr", 1.0);
                if !is_rough(self) {
                    self.add(ParamType::Float, "roughness", Values::Floats(vec![0.01]));
                }
                Some("conductor")
            }
            "mirror" => {
                // As reflective as it says: what pbrt's own upgrade loses.
                self.rename("Kr", "reflectance");
                if self.find("reflectance").is_none() {
                    self.add(ParamType::Rgb, "reflectance", Values::Floats(vec![0.9; 3]));
                }
                self.add(ParamType::Float, "roughness", Values::Floats(vec![0.0]));
                Some("conductor")
            }
            "translucent" => {
                self.rename("Kd", "transmittance");
                for (name, value) in [("reflect", 0.0), ("transmit", 1.0), ("Ks", 0.0)] {
                    self.drop_unless(name, value);
                }
                self.drop(&["roughness", "remaproughness"]);
                Some("diffusetransmission")
            }
            "kdsubsurface" => {
                self.rename("Kd", "reflectance");
                Some("subsurface")
            }
            "disney" => {
                self.rename("color", "reflectance");
                let kept = ["reflectance", "displacement", "type"];
                self.d.params.retain(|p| kept.contains(&p.name.as_str()));
                let message = "`disney` is read as `diffuse` of its colour";
                self.warnings.push(Diagnostic::warning(message, self.d.span));
                Some("diffuse")
            }
            "hair" => {
                self.rename("color", "reflectance");
                None
            }
            "mix" => {
                let amount = self.find("amount").is_some_and(|p| p.ty != ParamType::Texture);
                if amount && let Some(amount) = self.scalar("amount") {
                    self.add(ParamType::Float, "amount", Values::Floats(vec![amount]));
                }
                // What v3 names first is what v4's amount is a share of.
                let names: Vec<(String, Span)> = ["namedmaterial2", "namedmaterial1"]
                    .into_iter()
                    .filter_map(|n| match self.take(n)?.values {
                        Values::Strings(v) => v.into_iter().next(),
                        _ => None,
                    })
                    .collect();
                if !names.is_empty() {
                    self.add(ParamType::String, "materials", Values::Strings(names));
                }
                None
            }
            "" | "none" => Some("interface"),
            _ => None,
        }
    }

    /// A texture's type and parameters.
    fn texture(&mut self) {
        if self.d.text(1) == "color" {
            self.set_arg(1, "spectrum");
        }
        match self.d.text(2) {
            "scale" => {
                // The factor is a number, whichever of the two that is.
                let number = |p: &Param| match (&p.values, p.ty) {
                    (Values::Floats(v), ParamType::Float | ParamType::Rgb) => v.iter().all(|&x| x == v[0]),
                    _ => false,
                };
                let first = self.find("tex1").is_some_and(number) && !self.find("tex2").is_some_and(number);
                let (factor, other) = if first { ("tex1", "tex2") } else { ("tex2", "tex1") };
                if self.find(factor).is_some_and(number)
                    && let Some(scale) = self.scalar(factor)
                {
                    self.add(ParamType::Float, "scale", Values::Floats(vec![scale]));
                } else {
                    self.rename(factor, "scale");
                }
                self.rename(other, "tex");
            }
            "imagemap" | "ptex" => {
                if let Some(p) = self.take("trilinear") {
                    let on = matches!(&p.values, Values::Bools(v) if v.first() == Some(&true));
                    self.text("filter", if on { "trilinear" } else { "bilinear" });
                }
                match self.take("gamma").map(|p| p.values) {
                    Some(Values::Floats(v)) if v.len() == 1 => self.text("encoding", &format!("gamma {}", v[0])),
                    Some(Values::Bools(v)) if v.first() == Some(&false) => self.text("encoding", "linear"),
                    Some(Values::Bools(_)) => self.text("encoding", "sRGB"),
                    _ => {}
                }
            }
            _ => {}
        }
    }

    fn light(&mut self) {
        self.drop(&["samples", "nsamples"]);
        let colour = self.find("scale").is_some_and(|p| p.ty == ParamType::Rgb || p.ty == ParamType::Spectrum);
        let mut scale = if colour { self.scalar("scale").unwrap_or(1.0) } else { 1.0 };
        if self.find("mapname").is_some() {
            for name in ["L", "I"] {
                scale *= self.scalar(name).unwrap_or(1.0);
            }
            self.rename("mapname", "filename");
        }
        for p in self.d.params.iter_mut().filter(|p| p.ty == ParamType::Blackbody) {
            if let Values::Floats(v) = &mut p.values
                && v.len() == 2
            {
                scale *= v[1];
                v.truncate(1);
            }
        }
        if scale != 1.0 {
            let more = self.scalar("scale").unwrap_or(1.0);
            self.add(ParamType::Float, "scale", Values::Floats(vec![scale * more]));
        }
        if self.d.text(0) == "area" {
            self.set_arg(0, "diffuse");
        }
    }

    fn shape(&mut self) {
        self.drop(&["discarddegenerateUVs", "shadowalpha"]);
        self.rename("nlevels", "levels");
        for name in ["st", "uv"] {
            self.rename(name, "uv");
        }
        self.retype("uv", ParamType::Point2);
    }

    fn set_arg(&mut self, i: usize, text: &str) {
        let span = self.d.arg_span(i);
        if let Some(arg) = self.d.args.get_mut(i) {
            *arg = Arg { value: ArgValue::String(text.to_owned()), span };
        }
    }
}

impl Loader<'_> {
    /// Rewrites a directive of pbrt-v3.
    pub(super) fn upgrade(&mut self, d: &mut Directive) {
        let mut old = Old { d, warnings: Vec::new() };
        let kind = old.d.text(0).to_owned();
        match old.d.kind {
            Kind::Material => {
                if let Some(name) = old.material(&kind) {
                    old.set_arg(0, name);
                }
            }
            Kind::MakeNamedMaterial => {
                let given = old.take("type").map(|p| p.values);
                let name = match &given {
                    Some(Values::Strings(v)) => v.first().map_or(String::new(), |(s, _)| s.clone()),
                    _ => String::new(),
                };
                let new = old.material(&name).map_or(name, str::to_owned);
                old.text("type", &new);
            }
            Kind::Texture => old.texture(),
            Kind::LightSource | Kind::AreaLightSource => old.light(),
            Kind::Shape => old.shape(),
            Kind::Film
            | Kind::Sampler
            | Kind::PixelFilter
            | Kind::Camera
            | Kind::Integrator
            | Kind::MakeNamedMedium => {
                if let Some(name) = old.option(&kind) {
                    old.set_arg(0, name);
                }
            }
            _ => {}
        }
        let mut warnings = old.warnings;
        self.diagnostics.append(&mut warnings);
    }
}

#[cfg(test)]
mod tests {
    use super::is_v3;

    #[test]
    fn the_end_gives_it_away() {
        for text in ["a\nWorldEnd", "a\n  WorldEnd  # that is all\n\n# really", "Shape \"s\" WorldEnd\n"] {
            assert!(is_v3(text), "{text}");
        }
        for text in ["", "#WorldEnd", "Shape \"WorldEnd\"", "WorldEnd\nShape \"sphere\"", "NoWorldEnd"] {
            assert!(!is_v3(text), "{text}");
        }
    }
}
