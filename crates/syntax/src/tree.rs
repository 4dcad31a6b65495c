//! The tree: a list of directives, each with positional arguments and typed parameters.

use crate::source::Span;

/// How the arguments of a directive are written.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Signature {
    /// Nothing follows.
    Nothing,
    /// So many quoted strings.
    Strings(usize),
    /// One or two quoted strings.
    OneOrTwoStrings,
    /// So many quoted strings, then parameters.
    Params(usize),
    /// So many bare numbers.
    Numbers(usize),
    /// So many numbers in brackets.
    Bracketed(usize),
    /// A bare word.
    Word,
    /// A quoted name and one raw token.
    Option,
}

macro_rules! directives {
    ($($name:ident $signature:expr;)*) => {
        /// Every directive of the language.
        #[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
        #[allow(missing_docs, reason = "the names are those of the format")]
        pub enum Kind { $($name,)* }

        impl Kind {
            /// All kinds, in alphabetical order.
            pub const ALL: &'static [Kind] = &[$(Kind::$name,)*];

            /// The keyword.
            pub fn name(self) -> &'static str {
                match self { $(Kind::$name => stringify!($name),)* }
            }

            /// The kind with that keyword; case matters.
            pub fn from_name(name: &str) -> Option<Kind> {
                match name { $(stringify!($name) => Some(Kind::$name),)* _ => None }
            }

            /// What is written after the keyword.
            pub fn signature(self) -> Signature {
                match self { $(Kind::$name => $signature,)* }
            }
        }
    };
}

directives! {
    Accelerator Signature::Params(1);
    ActiveTransform Signature::Word;
    AreaLightSource Signature::Params(1);
    Attribute Signature::Params(1);
    AttributeBegin Signature::Nothing;
    AttributeEnd Signature::Nothing;
    Camera Signature::Params(1);
    ColorSpace Signature::Strings(1);
    ConcatTransform Signature::Bracketed(16);
    CoordSysTransform Signature::Strings(1);
    CoordinateSystem Signature::Strings(1);
    Film Signature::Params(1);
    Identity Signature::Nothing;
    Import Signature::Strings(1);
    Include Signature::Strings(1);
    Integrator Signature::Params(1);
    LightSource Signature::Params(1);
    LookAt Signature::Numbers(9);
    MakeNamedMaterial Signature::Params(1);
    MakeNamedMedium Signature::Params(1);
    Material Signature::Params(1);
    MediumInterface Signature::OneOrTwoStrings;
    NamedMaterial Signature::Strings(1);
    ObjectBegin Signature::Strings(1);
    ObjectEnd Signature::Nothing;
    ObjectInstance Signature::Strings(1);
    Option Signature::Option;
    PixelFilter Signature::Params(1);
    ReverseOrientation Signature::Nothing;
    Rotate Signature::Numbers(4);
    Sampler Signature::Params(1);
    Scale Signature::Numbers(3);
    Shape Signature::Params(1);
    Texture Signature::Params(3);
    Transform Signature::Bracketed(16);
    TransformBegin Signature::Nothing;
    TransformEnd Signature::Nothing;
    TransformTimes Signature::Numbers(2);
    Translate Signature::Numbers(3);
    WorldBegin Signature::Nothing;
    WorldEnd Signature::Nothing;
}

macro_rules! param_types {
    ($($name:ident $keyword:literal $per_item:literal $doc:literal;)*) => {
        /// The type that a parameter is declared with.
        #[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
        pub enum ParamType { $(#[doc = $doc] $name,)* }

        impl ParamType {
            /// All types.
            pub const ALL: &'static [ParamType] = &[$(ParamType::$name,)*];

            /// The keyword.
            pub fn keyword(self) -> &'static str {
                match self { $(ParamType::$name => $keyword,)* }
            }

            /// The type with that keyword.
            pub fn from_keyword(keyword: &str) -> Option<ParamType> {
                match keyword { $($keyword => Some(ParamType::$name),)* _ => None }
            }

            /// How many values make one item: 3 for a point in space.
            pub fn values_per_item(self) -> usize {
                match self { $(ParamType::$name => $per_item,)* }
            }
        }
    };
}

param_types! {
    Integer "integer" 1 "32-bit signed integers.";
    Float "float" 1 "32-bit floating-point numbers.";
    Bool "bool" 1 "`true` and `false`.";
    String "string" 1 "Quoted strings.";
    Point2 "point2" 2 "Points in the plane.";
    Vector2 "vector2" 2 "Vectors in the plane.";
    Point3 "point3" 3 "Points in space.";
    Vector3 "vector3" 3 "Vectors in space.";
    Normal "normal" 3 "Surface normals.";
    Rgb "rgb" 3 "Colours in the current colour space.";
    Spectrum "spectrum" 1 "Wavelengths in nm and values by turns, or a name, or a file.";
    Blackbody "blackbody" 1 "Temperatures in kelvin.";
    Texture "texture" 1 "Names of textures.";
}

/// The values of a parameter, packed: a mesh has millions of them.
#[derive(Clone, PartialEq, Debug)]
pub enum Values {
    /// Every numeric type but `integer`.
    Floats(Vec<f32>),
    /// `integer`.
    Ints(Vec<i32>),
    /// `string`, `texture`, and `spectrum` by name; without quotes, escapes resolved.
    Strings(Vec<(String, Span)>),
    /// `bool`.
    Bools(Vec<bool>),
}

impl Values {
    /// Number of values.
    pub fn len(&self) -> usize {
        match self {
            Values::Floats(v) => v.len(),
            Values::Ints(v) => v.len(),
            Values::Strings(v) => v.len(),
            Values::Bools(v) => v.len(),
        }
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// One `"type name" values`.
#[derive(Clone, PartialEq, Debug)]
pub struct Param {
    /// The declared type.
    pub ty: ParamType,
    /// The name.
    pub name: String,
    /// The declaration with its quotes.
    pub span: Span,
    /// The value, or the brackets and all that is in them.
    pub values_span: Span,
    /// The values.
    pub values: Values,
}

/// One positional argument.
#[derive(Clone, PartialEq, Debug)]
pub struct Arg {
    /// What it is.
    pub value: ArgValue,
    /// Where.
    pub span: Span,
}

/// The value of a positional argument.
#[derive(Clone, PartialEq, Debug)]
pub enum ArgValue {
    /// A number.
    Number(f32),
    /// A quoted string, without quotes, escapes resolved.
    String(String),
    /// A bare word as written.
    Word(String),
}

/// One directive. Its arguments agree with [`Kind::signature`] in number and in kind.
#[derive(Clone, PartialEq, Debug)]
pub struct Directive {
    /// Which.
    pub kind: Kind,
    /// The keyword.
    pub span: Span,
    /// What stands before the parameters.
    pub args: Vec<Arg>,
    /// The parameters in the order in which they are written.
    pub params: Vec<Param>,
}

impl Directive {
    /// The text of argument `i`, quoted or bare; "" when it is a number or not there.
    pub fn text(&self, i: usize) -> &str {
        match self.args.get(i).map(|a| &a.value) {
            Some(ArgValue::String(s) | ArgValue::Word(s)) => s,
            _ => "",
        }
    }

    /// Where argument `i` stands; the keyword when it is not there.
    pub fn arg_span(&self, i: usize) -> Span {
        self.args.get(i).map_or(self.span, |a| a.span)
    }

    /// The numeric arguments in order.
    pub fn numbers<const N: usize>(&self) -> Option<[f32; N]> {
        let mut out = [0.0; N];
        if self.args.len() != N {
            return None;
        }
        for (o, a) in out.iter_mut().zip(&self.args) {
            let ArgValue::Number(v) = a.value else { return None };
            *o = v;
        }
        Some(out)
    }
}
