//! Spectra from parameters: RGB, black body, samples, names and files.

use super::params::{Params, SPECTRUM};
use super::{Loader, use_key};
use crate::files::read_all;
use steradian_spectrum::{ColorSpace, Spectrum, SpectrumUse, named};
use steradian_syntax::{Diagnostic, Param, ParamType, Span, Values, did_you_mean, parse_number};

impl Loader<'_> {
    /// A spectrum, if it is given. What is wrong with it is reported, and gives `None`.
    pub(super) fn spectrum(&mut self, params: &mut Params, name: &'static str, usage: SpectrumUse) -> Option<Spectrum> {
        let (param, space) = params.raw(name, SPECTRUM)?;
        self.spectrum_of(params, &param, space, usage)
    }

    /// The spectrum that a parameter of one of the spectral types stands for.
    pub(super) fn spectrum_of(
        &mut self,
        params: &mut Params,
        param: &Param,
        space: ColorSpace,
        usage: SpectrumUse,
    ) -> Option<Spectrum> {
        let name = &param.name;
        match (&param.values, param.ty) {
            (Values::Floats(v), ParamType::Rgb) => {
                let &[r, g, b] = v.as_slice() else {
                    params.error(
                        format!("`{name}` of {} takes three numbers, but {} are given", params.what(), v.len()),
                        param.values_span,
                    );
                    return None;
                };
                rgb_spectrum(params, param, space, usage, [r, g, b])
            }
            (Values::Floats(v), ParamType::Blackbody) => {
                let &[kelvin] = v.as_slice() else {
                    params.error(
                        format!("`{name}` of {} takes one temperature, but {} are given", params.what(), v.len()),
                        param.values_span,
                    );
                    return None;
                };
                let spectrum = Spectrum::blackbody(kelvin).map_err(|e| format!("`{name}` of {}: {e}", params.what()));
                report(params, spectrum.map(|s| s.with_use(usage)), param.values_span)
            }
            (Values::Floats(v), _) => {
                if v.len() % 2 != 0 {
                    params.error(
                        format!(
                            "`{name}` of {} needs pairs of a wavelength and a value, but has {} numbers",
                            params.what(),
                            v.len()
                        ),
                        param.values_span,
                    );
                    return None;
                }
                if v.len() == 2 {
                    params.warning(
                        format!("`{name}` of {} has a single sample, and is zero elsewhere", params.what()),
                        param.values_span,
                    );
                }
                let (lambda, values): (Vec<f32>, Vec<f32>) = v.as_chunks::<2>().0.iter().map(|&[l, v]| (l, v)).unzip();
                let spectrum = Spectrum::piecewise_linear(&lambda, &values, usage)
                    .map_err(|e| format!("`{name}` of {}: {e}", params.what()));
                report(params, spectrum, param.values_span)
            }
            (Values::Strings(v), _) => {
                let [(text, span)] = v.as_slice() else {
                    params.error(
                        format!("`{name}` of {} takes one name, but {} are given", params.what(), v.len()),
                        param.values_span,
                    );
                    return None;
                };
                self.spectrum_by_name(params, text, *span, usage)
            }
            _ => None,
        }
    }

    /// A spectrum of the table of names, or else of a file.
    fn spectrum_by_name(
        &mut self,
        params: &mut Params,
        text: &str,
        span: Span,
        usage: SpectrumUse,
    ) -> Option<Spectrum> {
        if let Some(s) = named::spectrum(text) {
            return Some(s.with_use(usage));
        }
        if let Some(s) = self.spectrum_files.get(&(text.to_string(), use_key(usage))) {
            return Some(s.clone());
        }
        let path = self.resolve(text);
        // Something without an extension was meant to be a name.
        if path.extension().is_none() && !self.files.exists(&path) {
            let d = Diagnostic::error(format!("unknown spectrum \"{text}\""), span);
            params.diagnostics.push(d.with_suggestion(did_you_mean(text, named::list())));
            return None;
        }
        let read = read_all(self.files, &path).and_then(|bytes| {
            let at = |what: String| format!("{}: {what}", path.display());
            let text = String::from_utf8(bytes).map_err(|_| at("not a text file of wavelengths and values".into()))?;
            let (lambda, values) = parse_samples(&text).map_err(at)?;
            Spectrum::piecewise_linear(&lambda, &values, usage).map_err(|e| at(e.to_string()))
        });
        let spectrum = report(params, read, span)?;
        self.spectrum_files.insert((text.to_string(), use_key(usage)), spectrum.clone());
        Some(spectrum)
    }
}

fn report<T>(params: &mut Params, result: Result<T, String>, span: Span) -> Option<T> {
    result.map_err(|message| params.error(message, span)).ok()
}

fn rgb_spectrum(
    params: &mut Params,
    param: &Param,
    space: ColorSpace,
    usage: SpectrumUse,
    rgb: [f32; 3],
) -> Option<Spectrum> {
    if rgb.iter().any(|&v| v < 0.0) {
        params.error(format!("`{}` of {} has a negative component", param.name, params.what()), param.values_span);
        return None;
    }
    match usage {
        SpectrumUse::Albedo => {
            if rgb.iter().any(|&v| v > 1.0) {
                let message = format!("`{}` of {} is a reflectance and cannot be above 1", param.name, params.what());
                params.error(message, param.values_span);
                return None;
            }
            Some(Spectrum::rgb_albedo(space, rgb))
        }
        SpectrumUse::Unbounded => Some(Spectrum::rgb_unbounded(space, rgb)),
        SpectrumUse::Illuminant => Some(Spectrum::rgb_illuminant(space, rgb)),
    }
}

/// Wavelengths and values of a spectrum file: numbers by turns, `#` starts a comment.
fn parse_samples(text: &str) -> Result<(Vec<f32>, Vec<f32>), String> {
    let (mut lambda, mut values) = (Vec::new(), Vec::new());
    for (i, line) in text.lines().enumerate() {
        let line = line.split('#').next().unwrap_or("");
        for word in line.split(|c: char| c.is_whitespace() || c == ',').filter(|w| !w.is_empty()) {
            let number = parse_number(word).ok_or_else(|| format!("line {}: `{word}` is not a number", i + 1))?;
            if lambda.len() == values.len() { lambda.push(number) } else { values.push(number) }
        }
    }
    if lambda.len() != values.len() {
        return Err("the last wavelength has no value".into());
    }
    Ok((lambda, values))
}

#[cfg(test)]
mod tests {
    use super::parse_samples;

    #[test]
    fn spectrum_files_are_pairs_with_comments() {
        assert_eq!(parse_samples("# a\n400 1 # b\n500\n2.5\n").unwrap(), (vec![400.0, 500.0], vec![1.0, 2.5]));
        assert_eq!(parse_samples("400 1\n500 x").unwrap_err(), "line 2: `x` is not a number");
        assert_eq!(parse_samples("400 1 500").unwrap_err(), "the last wavelength has no value");
    }
}
