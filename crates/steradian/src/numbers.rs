//! Numbers as people write and read them: sizes, crops, pixels, exposures in; bytes, counts and durations out.

use std::fmt;
use std::str::FromStr;
use std::time::Duration;

use steradian_render::Part;

/// Width and height, written `640x360`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Size(pub [u32; 2]);

impl FromStr for Size {
    type Err = String;
    fn from_str(s: &str) -> Result<Size, String> {
        let parts: Vec<&str> = s.split(['x', 'X', ',']).collect();
        let [w, h] = parts[..] else { return Err("write it as WIDTHxHEIGHT, as in 640x360".into()) };
        let side = |s: &str| match s.trim().parse::<u32>() {
            Ok(0) => Err("a picture needs at least one pixel each way".to_owned()),
            Ok(n) if n <= i32::MAX as u32 => Ok(n),
            _ => Err(format!("`{s}` is not a number of pixels; write it as WIDTHxHEIGHT, as in 640x360")),
        };
        Ok(Size([side(w)?, side(h)?]))
    }
}

impl fmt::Display for Size {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}x{}", self.0[0], self.0[1])
    }
}

/// A part of the picture in fractions of width and height: x0, x1, y0, y1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Crop(pub [f32; 4]);

impl FromStr for Crop {
    type Err = String;
    fn from_str(s: &str) -> Result<Crop, String> {
        let hint = "write it as x0,x1,y0,y1 with numbers from 0 to 1, as in 0.25,0.75,0,1";
        let numbers: Result<Vec<f32>, _> = s.split([',', ' ']).filter(|p| !p.is_empty()).map(str::parse).collect();
        let Ok([x0, x1, y0, y1]) = numbers.as_deref().map(|n| <[f32; 4]>::try_from(n).unwrap_or([f32::NAN; 4])) else {
            return Err(hint.into());
        };
        if [x0, x1, y0, y1].iter().any(|v| !(0.0..=1.0).contains(v)) {
            return Err(hint.into());
        }
        if x0 >= x1 || y0 >= y1 {
            return Err("nothing is left of the picture: x0 must be less than x1, and y0 less than y1".into());
        }
        Ok(Crop([x0, x1, y0, y1]))
    }
}

impl fmt::Display for Crop {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [x0, x1, y0, y1] = self.0;
        write!(f, "{x0},{x1},{y0},{y1}")
    }
}

/// A pixel, written `x,y`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Pixel(pub [u32; 2]);

impl FromStr for Pixel {
    type Err = String;
    fn from_str(s: &str) -> Result<Pixel, String> {
        let xy = s.split_once(',').and_then(|(x, y)| Some([x.trim().parse().ok()?, y.trim().parse().ok()?]));
        xy.map(Pixel).ok_or_else(|| "write it as x,y, as in 12,34".into())
    }
}

/// The exposure of a tone-mapped picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum ExposureArg {
    /// So many stops.
    Stops(f32),
    /// As the picture needs.
    Auto,
}

impl FromStr for ExposureArg {
    type Err = String;
    fn from_str(s: &str) -> Result<ExposureArg, String> {
        if s == "auto" {
            return Ok(ExposureArg::Auto);
        }
        match s.parse::<f32>() {
            Ok(v) if v.abs() <= 64.0 => Ok(ExposureArg::Stops(v)),
            _ => Err("write a number of stops from -64 to 64, or auto".into()),
        }
    }
}

/// A number above zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Positive(pub f32);

impl FromStr for Positive {
    type Err = String;
    fn from_str(s: &str) -> Result<Positive, String> {
        match s.trim().parse::<f32>() {
            Ok(v) if v > 0.0 && v.is_finite() => Ok(Positive(v)),
            _ => Err("write a number above zero".into()),
        }
    }
}

impl fmt::Display for Positive {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.0)
    }
}

/// A share: of 1 inside, in percent outside: `1%`, `0.5 %`, `1`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Percent(pub f64);

impl FromStr for Percent {
    type Err = String;
    fn from_str(s: &str) -> Result<Percent, String> {
        match s.trim().trim_end_matches('%').trim().parse::<f64>() {
            Ok(v) if v > 0.0 && v < 100.0 => Ok(Percent(v / 100.0)),
            _ => Err("write a percentage between 0 and 100, as in 1%".into()),
        }
    }
}

impl fmt::Display for Percent {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // Three digits, and no more zeros than needed.
        let v = self.0 * 100.0;
        let digits = if v >= 100.0 {
            0
        } else if v >= 10.0 {
            1
        } else if v >= 1.0 {
            2
        } else {
            3
        };
        let text = format!("{v:.digits$}");
        let text = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
        write!(f, "{text}%")
    }
}

/// A length of time: `90`, `90s`, `10m`, `1h30m`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Span(pub Duration);

impl FromStr for Span {
    type Err = String;
    fn from_str(s: &str) -> Result<Span, String> {
        let hint = || "write a time as in 90s, 10m or 1h30m".to_owned();
        let (mut total, mut rest) = (0.0, s.trim());
        if rest.is_empty() {
            return Err(hint());
        }
        while !rest.is_empty() {
            let end = rest.find(|c: char| !c.is_ascii_digit() && c != '.').unwrap_or(rest.len());
            let number: f64 = rest[..end].parse().map_err(|_| hint())?;
            let unit_end = rest[end..].find(|c: char| c.is_ascii_digit()).map_or(rest.len(), |i| end + i);
            total += number
                * match rest[end..unit_end].trim() {
                    "" | "s" | "sec" => 1.0,
                    "m" | "min" => 60.0,
                    "h" => 3600.0,
                    "d" => 86_400.0,
                    "ms" => 0.001,
                    _ => return Err(hint()),
                };
            rest = &rest[unit_end..];
        }
        Duration::try_from_secs_f64(total).map(Span).map_err(|_| hint())
    }
}

/// One part of several, written `2/8`, counted from 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct ShardArg(pub Part);

impl FromStr for ShardArg {
    type Err = String;
    fn from_str(s: &str) -> Result<ShardArg, String> {
        const MOST: u32 = 1 << 20;
        let number = |s: &str| s.trim().parse::<u32>().ok();
        match s.split_once('/').and_then(|(i, n)| Some((number(i)?, number(n)?))) {
            Some((i, n)) if i >= 1 && i <= n && n <= MOST => Ok(ShardArg(Part { index: i - 1, count: n })),
            Some((_, n)) if (1..=MOST).contains(&n) => Err(format!("parts are numbered from 1 to {n}")),
            _ => Err("write it as I/N, as in 2/8 for the second of eight parts".into()),
        }
    }
}

/// An amount of memory, written `512M`, `8G`, `1.5GiB`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Memory(pub u64);

impl FromStr for Memory {
    type Err = String;
    fn from_str(s: &str) -> Result<Memory, String> {
        let end = s.find(|c: char| !c.is_ascii_digit() && c != '.').unwrap_or(s.len());
        let shift = match s[end..].trim().trim_end_matches("iB").trim_end_matches('B') {
            "K" | "k" => 10,
            "M" => 20,
            "G" => 30,
            "T" => 40,
            _ => return Err("write an amount of memory as in 512M or 8G".into()),
        };
        match s[..end].parse::<f64>() {
            Ok(v) if v > 0.0 && v < 1e6 => Ok(Memory((v * (1_u64 << shift) as f64) as u64)),
            _ => Err("write an amount of memory as in 512M or 8G".into()),
        }
    }
}

/// A count with its digits in groups: `1,234,567`.
pub(crate) fn count(n: u64) -> String {
    let digits = n.to_string();
    let mut out = String::new();
    for (i, c) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            out.push(',');
        }
        out.push(c);
    }
    out
}

/// A count with its noun: `1 light`, `2 lights`.
pub(crate) fn counted(n: u64, noun: &str) -> String {
    format!("{} {noun}{}", count(n), if n == 1 { "" } else { "s" })
}

/// A size in memory: `1.5 GiB`.
pub(crate) fn bytes(n: u64) -> String {
    const UNITS: [&str; 7] = ["B", "KiB", "MiB", "GiB", "TiB", "PiB", "EiB"];
    let mut value = n as f64;
    let mut unit = 0;
    while value >= 1024.0 && unit + 1 < UNITS.len() {
        value /= 1024.0;
        unit += 1;
    }
    if unit == 0 { format!("{n} B") } else { format!("{value:.1} {}", UNITS[unit]) }
}

/// A duration: `0.4 s`, `12 s`, `3 min 20 s`, `2 h 5 min`.
pub(crate) fn duration(d: Duration) -> String {
    let s = d.as_secs_f64();
    let whole = s.round() as u64;
    match whole {
        0..10 => format!("{s:.1} s"),
        10..60 => format!("{whole} s"),
        60..3600 => format!("{} min {} s", whole / 60, whole % 60),
        _ => format!("{} h {} min", whole / 3600, whole % 3600 / 60),
    }
}

/// Millions a second.
pub(crate) fn mega_rate(n: u64, d: Duration) -> f64 {
    n as f64 / 1e6 / d.as_secs_f64().max(1e-9)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_read() {
        assert_eq!("640x360".parse(), Ok(Size([640, 360])));
        assert_eq!("0x360".parse::<Size>(), Err("a picture needs at least one pixel each way".into()));
        assert!("640".parse::<Size>().is_err() && "-1x5".parse::<Size>().is_err());
        assert!("9999999999x5".parse::<Size>().is_err());
        assert_eq!("0,.5,0.25,1".parse(), Ok(Crop([0.0, 0.5, 0.25, 1.0])));
        for bad in ["0,1", "0,1,0,nan", "0,2,0,1", "0.5,0.5,0,1", "a,b,c,d", ""] {
            assert!(bad.parse::<Crop>().is_err(), "{bad}");
        }
        assert_eq!("3, 4".parse(), Ok(Pixel([3, 4])));
        assert!("3".parse::<Pixel>().is_err() && "-1,2".parse::<Pixel>().is_err());
        assert_eq!("-1.5".parse(), Ok(ExposureArg::Stops(-1.5)));
        assert_eq!("auto".parse(), Ok(ExposureArg::Auto));
        assert!("inf".parse::<ExposureArg>().is_err() && "NaN".parse::<ExposureArg>().is_err());
    }

    #[test]
    fn shares_times_and_amounts() {
        let percent = |s: &str| s.parse::<Percent>().map(|p| p.to_string());
        assert_eq!(["1%", "0.5 %", "95", "12.5%"].map(|s| percent(s).unwrap()), ["1%", "0.5%", "95%", "12.5%"]);
        assert!(["0", "100%", "-1", "x", "NaN", ""].iter().all(|s| percent(s).is_err()));
        let span = |s: &str| s.parse::<Span>().map(|t| t.0.as_secs_f64());
        assert_eq!(
            ["90", "90s", "1.5m", "1h30m", "1h 2m 3s", "200ms"].map(|s| span(s).unwrap()),
            [90.0, 90.0, 90.0, 5400.0, 3723.0, 0.2]
        );
        assert!(["", "m", "1x", "-5s", "1e9h", "9999999999999999999999h"].iter().all(|s| span(s).is_err()));
        let shard = |s: &str| s.parse::<ShardArg>().map(|s| (s.0.index, s.0.count));
        assert_eq!((shard("1/1"), shard("2/8")), (Ok((0, 1)), Ok((1, 8))));
        assert_eq!(shard("9/8"), Err("parts are numbered from 1 to 8".into()));
        assert!(["0/8", "1", "1/0", "a/b", "1/99999999"].iter().all(|s| shard(s).is_err()));
        assert_eq!(["512M", "8G", "1.5GiB"].map(|s| s.parse::<Memory>().unwrap().0), [512 << 20, 8 << 30, 3 << 29]);
        assert!(["8", "G", "-1G", "1X"].iter().all(|s| s.parse::<Memory>().is_err()));
    }

    #[test]
    fn numbers_are_written() {
        assert_eq!([count(0), count(999), count(1000), count(1234567)], ["0", "999", "1,000", "1,234,567"]);
        assert_eq!([bytes(0), bytes(1023), bytes(1536), bytes(u64::MAX)], ["0 B", "1023 B", "1.5 KiB", "16.0 EiB"]);
        let d = |s: f64| duration(Duration::from_secs_f64(s));
        assert_eq!(
            [d(0.42), d(9.42), d(59.4), d(200.0), d(7500.0)],
            ["0.4 s", "9.4 s", "59 s", "3 min 20 s", "2 h 5 min"]
        );
        assert_eq!([counted(1, "light"), counted(2, "light")], ["1 light", "2 lights"]);
    }
}
