//! Runs the built program in a folder of its own.

#![allow(dead_code, reason = "each test file uses a part")]

use std::path::PathBuf;
use std::process::{Command, Output, Stdio};

/// A scene of 16 x 12 pixels that is rendered in milliseconds: a lamp above a floor, and a ball.
pub const SCENE: &str = r#"Film "rgb" "integer xresolution" [ 16 ] "integer yresolution" [ 12 ] "string filename" "renders/small.exr"
Sampler "zsobol" "integer pixelsamples" [ 4 ]
Integrator "path" "integer maxdepth" [ 4 ]
LookAt 0 1 -4   0 0.5 0   0 1 0
Camera "perspective" "float fov" [ 40 ]
WorldBegin
AttributeBegin
  AreaLightSource "diffuse" "rgb L" [ 5 5 4 ]
  Shape "trianglemesh" "integer indices" [ 0 1 2 0 2 3 ] "point3 P" [ -1 3 -1  1 3 -1  1 3 1  -1 3 1 ]
AttributeEnd
Material "diffuse" "rgb reflectance" [ 0.7 0.5 0.3 ]
Shape "trianglemesh" "integer indices" [ 0 1 2 0 2 3 ] "point3 P" [ -5 0 -5  -5 0 5  5 0 5  5 0 -5 ]
Translate 0 0.5 0
Shape "sphere" "float radius" [ 0.5 ]
"#;

/// What came of a run.
pub struct Ran {
    /// Exit code; none where a signal ended the program.
    pub code: Option<i32>,
    /// Standard output.
    pub out: String,
    /// Standard error.
    pub err: String,
}

/// A folder that goes away, and the program run in it.
pub struct Folder(tempfile::TempDir);

impl Folder {
    /// With nothing in it.
    pub fn empty() -> Folder {
        Folder(tempfile::tempdir().unwrap())
    }

    /// With `small.pbrt` in it.
    pub fn with_scene() -> Folder {
        Folder::empty().with("small.pbrt", SCENE)
    }

    /// With one more file.
    pub fn with(self, name: &str, content: impl AsRef<[u8]>) -> Folder {
        std::fs::write(self.path(name), content).unwrap();
        self
    }

    /// The path of a file in it.
    pub fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// The bytes of a file in it.
    pub fn bytes(&self, name: &str) -> Vec<u8> {
        std::fs::read(self.path(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
    }

    /// The names of what is in it, sorted.
    pub fn list(&self) -> Vec<String> {
        let mut names: Vec<String> =
            std::fs::read_dir(self.0.path()).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    /// The program with these words after its name, ready to start.
    pub fn command(&self, line: &str) -> Command {
        let mut c = Command::new(env!("CARGO_BIN_EXE_steradian"));
        c.args(line.split_whitespace()).current_dir(self.0.path()).env("NO_COLOR", "1").stdin(Stdio::null());
        c
    }

    /// Runs the program.
    pub fn run(&self, line: &str) -> Ran {
        Ran::from(self.command(line).output().unwrap())
    }

    /// Runs the program, which must succeed; what it printed to standard output.
    pub fn ok(&self, line: &str) -> String {
        let ran = self.run(line);
        assert_eq!(ran.code, Some(0), "steradian {line}\n{}{}", ran.out, ran.err);
        ran.out
    }
}

impl From<Output> for Ran {
    fn from(o: Output) -> Ran {
        let text = |bytes| String::from_utf8(bytes).unwrap();
        Ran { code: o.status.code(), out: text(o.stdout), err: text(o.stderr) }
    }
}
