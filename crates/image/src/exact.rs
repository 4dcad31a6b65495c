//! Are two images the same, bit for bit, in everything that does not depend on when and where they were made?

use crate::{Attribute, Image};

/// One thing that differs.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Difference {
    /// Width and height.
    Size {
        /// Of the first image.
        first: [usize; 2],
        /// Of the second image.
        second: [usize; 2],
    },
    /// A channel that only one image has.
    MissingChannel {
        /// Its name.
        name: String,
        /// Whether it is the second image that lacks it.
        in_second: bool,
    },
    /// A channel that is stored in another precision.
    Precision {
        /// Its name.
        name: String,
    },
    /// A channel whose samples have other bits.
    Samples {
        /// Its name.
        name: String,
        /// How many samples differ.
        count: usize,
        /// Column and row of the first that does.
        at: [usize; 2],
        /// Its two values.
        values: [f32; 2],
    },
    /// An attribute that differs or is missing on one side.
    Attribute {
        /// Its name.
        name: String,
        /// Its value in the first image.
        first: Option<Attribute>,
        /// Its value in the second image.
        second: Option<Attribute>,
    },
    /// The primaries differ.
    Chromaticities,
    /// The position in the frame, or the frame, differs.
    Windows,
}

impl std::fmt::Display for Difference {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Difference::Size { first: [a, b], second: [c, d] } => write!(f, "size {a} x {b} and {c} x {d}"),
            Difference::MissingChannel { name, in_second } => {
                write!(f, "channel {name} is missing in the {} image", if *in_second { "second" } else { "first" })
            }
            Difference::Precision { name } => write!(f, "channel {name} is stored in different precision"),
            Difference::Samples { name, count, at: [x, y], values: [a, b] } => {
                write!(f, "channel {name}: {count} samples differ, first at {x}, {y}: {a:e} and {b:e}")
            }
            Difference::Attribute { name, first, second } => {
                let show = |a: &Option<Attribute>| a.as_ref().map_or("absent".to_owned(), |a| format!("{a:?}"));
                write!(f, "attribute {name}: {} and {}", show(first), show(second))
            }
            Difference::Chromaticities => write!(f, "chromaticities"),
            Difference::Windows => write!(f, "data window or display window"),
        }
    }
}

/// Whether an attribute tells of the run (when, how long, on what machine, by which build) rather than of the picture. Such attributes may differ
/// between identical images.
pub fn is_volatile_attribute(name: &str) -> bool {
    let name = name.strip_prefix("steradian.").or(name.strip_prefix("steradian:")).unwrap_or(name);
    const VOLATILE: [&str; 23] = [
        "build",
        "capDate",
        "utcOffset",
        "date",
        "started",
        "finished",
        "duration",
        "seconds",
        "renderTime",
        "renderSeconds",
        "renderTimeSeconds",
        "loadSeconds",
        "buildSeconds",
        "wallSeconds",
        "cpuSeconds",
        "time",
        "host",
        "hostname",
        "threads",
        "threadCount",
        "peakMemory",
        "user",
        "machine",
    ];
    VOLATILE.contains(&name)
}

/// Everything in which two images differ, volatile attributes aside. Empty means identical. NaN equals NaN of the same bits, and
/// 0 differs from -0. The order of channels does not count.
pub fn exact_differences(a: &Image, b: &Image) -> Vec<Difference> {
    let mut out = Vec::new();
    if (a.width(), a.height()) != (b.width(), b.height()) {
        out.push(Difference::Size { first: [a.width(), a.height()], second: [b.width(), b.height()] });
        return out;
    }
    for channel in a.channels() {
        let name = channel.name.clone();
        let Some(other) = b.channels().iter().find(|c| c.name == name) else {
            out.push(Difference::MissingChannel { name, in_second: true });
            continue;
        };
        if channel.precision != other.precision {
            out.push(Difference::Precision { name: name.clone() });
        }
        let pairs = channel.samples.iter().zip(&other.samples).enumerate();
        let mut differing = pairs.filter(|(_, (x, y))| x.to_bits() != y.to_bits());
        if let Some((i, (x, y))) = differing.next() {
            let at = [i % a.width(), i / a.width()];
            out.push(Difference::Samples { name, count: 1 + differing.count(), at, values: [*x, *y] });
        }
    }
    for channel in b.channels().iter().filter(|c| a.channel(&c.name).is_none()) {
        out.push(Difference::MissingChannel { name: channel.name.clone(), in_second: false });
    }
    let (ma, mb) = (&a.metadata, &b.metadata);
    let mut names: Vec<&String> = ma.attributes.keys().chain(mb.attributes.keys()).collect();
    names.sort();
    names.dedup();
    for name in names.into_iter().filter(|n| !is_volatile_attribute(n)) {
        let (first, second) = (ma.attributes.get(name), mb.attributes.get(name));
        if first != second {
            out.push(Difference::Attribute { name: name.clone(), first: first.cloned(), second: second.cloned() });
        }
    }
    if ma.chromaticities != mb.chromaticities {
        out.push(Difference::Chromaticities);
    }
    if ma.origin != mb.origin || a.frame() != b.frame() {
        out.push(Difference::Windows);
    }
    out
}
