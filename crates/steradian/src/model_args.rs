//! Options about models: what a glTF, OBJ, STL or PLY file does not say of itself.

use std::path::PathBuf;

use clap::{Args, ValueEnum, ValueHint};
use steradian_load::{EnvironmentMap, ModelOptions, Up};

use crate::camera_args::length;

/// The options.
#[derive(Args, Debug, Clone, Default)]
#[command(next_help_heading = "Models and Mitsuba scenes")]
pub(crate) struct ModelArgs {
    /// Light the model with FILE, an environment map in latitudes and longitudes (.hdr or .exr)
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub env: Option<PathBuf>,

    /// Turn the environment map about the vertical
    #[arg(long, value_name = "DEGREES", requires = "env", allow_hyphen_values = true, value_parser = number)]
    pub env_rotation: Option<f32>,

    /// Brighten the environment map by this factor
    #[arg(long, value_name = "FACTOR", requires = "env", value_parser = length)]
    pub env_strength: Option<f32>,

    /// Leave out the ground under a model that stands alone
    #[arg(long)]
    pub no_ground: bool,

    /// Look through this camera of the file: its name, or its number from 0 [default: the first]
    #[arg(long, value_name = "NAME|N")]
    pub camera: Option<String>,

    /// Which axis points up [default: z for .stl, else y]
    #[arg(long, value_name = "AXIS")]
    pub up: Option<UpArg>,

    /// Go around the model with the default camera by this angle
    #[arg(long, value_name = "DEGREES", allow_hyphen_values = true, value_parser = number)]
    pub turn: Option<f32>,

    /// Show this variant of the materials: its name, or its number from 0
    #[arg(long, value_name = "NAME|N")]
    pub variant: Option<String>,

    /// Play the animation to this time, in seconds
    #[arg(long, value_name = "SECONDS", allow_hyphen_values = true, value_parser = number)]
    pub at: Option<f32>,

    /// Keep the shutter open from then on, in seconds: what moves is blurred
    #[arg(long, value_name = "SECONDS", requires = "at", value_parser = length)]
    pub shutter: Option<f32>,

    /// Let the file name others outside its folder
    #[arg(long)]
    pub allow_outside: bool,

    /// Give a variable of a Mitsuba scene a value; may be given several times
    #[arg(short = 'D', long = "define", value_name = "NAME=VALUE", value_parser = definition)]
    pub define: Vec<(String, String)>,
}

/// The axes that may point up.
#[derive(ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum UpArg {
    /// As in glTF
    Y,
    /// As in technical drawings
    Z,
}

impl ModelArgs {
    /// As the loader wants them; `size` is the picture's, if that is given.
    pub fn options(&self, size: Option<[u32; 2]>) -> ModelOptions {
        let environment = self.env.as_ref().map(|file| EnvironmentMap {
            file: file.clone(),
            rotation: self.env_rotation.unwrap_or(0.0),
            strength: self.env_strength.unwrap_or(1.0),
        });
        ModelOptions {
            camera: self.camera.clone(),
            variant: self.variant.clone(),
            time: self.at,
            shutter: self.shutter.unwrap_or(0.0),
            ground: !self.no_ground,
            environment,
            up: self.up.map(|up| match up {
                UpArg::Y => Up::Y,
                UpArg::Z => Up::Z,
            }),
            turn: self.turn.unwrap_or(0.0),
            allow_outside: self.allow_outside,
            defines: self.define.clone(),
            size,
        }
    }

    /// The options as they would be typed.
    pub fn as_typed(&self, mut add: impl FnMut(&str, Option<String>)) {
        let number = |v: Option<f32>| v.map(|v| v.to_string());
        let flag = |v: bool| v.then(String::new);
        add("env", self.env.as_ref().map(|p| quoted(&p.to_string_lossy())));
        add("env-rotation", number(self.env_rotation));
        add("env-strength", number(self.env_strength));
        add("no-ground", flag(self.no_ground));
        add("camera", self.camera.as_deref().map(quoted));
        let up = self.up.and_then(|v| v.to_possible_value()).map(|v| v.get_name().to_owned());
        add("up", up);
        add("turn", number(self.turn));
        add("variant", self.variant.as_deref().map(quoted));
        add("at", number(self.at));
        add("shutter", number(self.shutter));
        add("allow-outside", flag(self.allow_outside));
        for (name, value) in &self.define {
            add("define", Some(quoted(&format!("{name}={value}"))));
        }
    }
}

fn number(s: &str) -> Result<f32, String> {
    s.parse::<f32>().ok().filter(|v| v.is_finite()).ok_or_else(|| "write a number".into())
}

fn definition(s: &str) -> Result<(String, String), String> {
    s.split_once('=')
        .map(|(n, v)| (n.to_owned(), v.to_owned()))
        .ok_or_else(|| "write it as NAME=VALUE, as in spp=16".into())
}

/// One word of a shell.
pub(crate) fn quoted(s: &str) -> String {
    let plain = |c: char| c.is_alphanumeric() || "/._-+=:,@%".contains(c);
    if !s.is_empty() && s.chars().all(plain) { s.to_owned() } else { format!("'{}'", s.replace('\'', "'\\''")) }
}

/// The words of a command line as [`quoted`] writes them.
pub(crate) fn words(line: &str) -> Vec<String> {
    let (mut out, mut word, mut inside, mut begun) = (Vec::new(), String::new(), false, false);
    let mut chars = line.chars();
    while let Some(c) = chars.next() {
        match c {
            '\'' => (inside, begun) = (!inside, true),
            '\\' if !inside => word.extend(chars.next()),
            c if c.is_whitespace() && !inside => {
                if begun {
                    out.push(std::mem::take(&mut word));
                }
                begun = false;
            }
            c => {
                word.push(c);
                begun = true;
            }
        }
    }
    if begun {
        out.push(word);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_what_was_quoted() {
        let all = ["plain", "two words", "it's", "", "a\"b"];
        let line: Vec<String> = all.iter().map(|w| quoted(w)).collect();
        assert_eq!(words(&line.join("  ")), all);
    }
}
