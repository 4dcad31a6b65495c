//! Plots as SVG, drawn by plotters in placeholder colours that are then exchanged for style-sheet classes, so that one
//! drawing is readable on light and on dark pages.

use crate::Error;
use crate::experiment::{Axis, Figure, Mark, Series};
use plotters::coord::ranged1d::{AsRangedCoord, Ranged, ValueFormatter};
use plotters::prelude::*;

/// Drawn large and scaled by the page, so that whole pixels are fine enough.
const SIZE: (u32, u32) = (1040, 640);
/// Series colours of the style sheet.
pub const COLOURS: usize = 12;

/// The plot as an `svg` element.
///
/// # Errors
/// `Error::Plot` if the library refuses.
pub fn svg(figure: &Figure) -> Result<String, Error> {
    let failed = |reason: String| Error::Plot { name: figure.id.clone(), reason };
    let x = range(&figure.x, figure.series.iter().flat_map(|s| s.points.iter().map(|p| p.0)));
    let y = range(&figure.y, figure.series.iter().flat_map(|s| s.points.iter().map(|p| p.1)));
    let (x, y) = (x.ok_or_else(|| failed("no points".into()))?, y.ok_or_else(|| failed("no points".into()))?);
    let mut text = String::new();
    {
        let area = SVGBackend::with_string(&mut text, SIZE).into_drawing_area();
        match (figure.x.log, figure.y.log) {
            (false, false) => draw(figure, &area, x.0..x.1, y.0..y.1),
            (true, false) => draw(figure, &area, (x.0..x.1).log_scale(), y.0..y.1),
            (false, true) => draw(figure, &area, x.0..x.1, (y.0..y.1).log_scale()),
            (true, true) => draw(figure, &area, (x.0..x.1).log_scale(), (y.0..y.1).log_scale()),
        }
        .map_err(failed)?;
        area.present().map_err(|e| failed(e.to_string()))?;
    }
    Ok(restyle(&text))
}

/// The ends of an axis, with some air around the data.
fn range(axis: &Axis, values: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
    if let Some([low, high]) = axis.range {
        return Some((low, high));
    }
    let usable = values.filter(|v| v.is_finite() && (!axis.log || *v > 0.0));
    let (low, high) = usable.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
    if low > high {
        return None;
    }
    if axis.log {
        return Some((low * 0.8, high * 1.25));
    }
    let air = if high > low { 0.04 * (high - low) } else { 0.5 + 0.1 * high.abs() };
    Some((low - air, high + air))
}

fn draw<'a, X, Y>(
    figure: &Figure,
    area: &DrawingArea<SVGBackend<'a>, plotters::coord::Shift>,
    x: X,
    y: Y,
) -> Result<(), String>
where
    X: AsRangedCoord<Value = f64>,
    Y: AsRangedCoord<Value = f64>,
    X::CoordDescType: Ranged<ValueType = f64> + ValueFormatter<f64>,
    Y::CoordDescType: Ranged<ValueType = f64> + ValueFormatter<f64>,
{
    let font = |size: i32| ("sans-serif", size).into_font().color(&BLACK);
    let mut chart = ChartBuilder::on(area)
        .margin(14)
        .margin_right(30)
        .x_label_area_size(78)
        .y_label_area_size(120)
        .build_cartesian_2d(x, y)
        .map_err(|e| e.to_string())?;
    chart
        .configure_mesh()
        .x_desc(&figure.x.label)
        .y_desc(&figure.y.label)
        .x_labels(8)
        .y_labels(7)
        .label_style(font(30))
        .axis_desc_style(font(32))
        .light_line_style(WHITE.mix(0.0))
        .bold_line_style(BLACK.mix(0.12).stroke_width(2))
        .axis_style(BLACK.stroke_width(2))
        .x_label_formatter(&number)
        .y_label_formatter(&number)
        .draw()
        .map_err(|e| e.to_string())?;
    for (i, series) in figure.series.iter().enumerate() {
        let points = usable(figure, series);
        let i = (i % COLOURS) as u8;
        // Red says which series, green which dash; `restyle` reads it.
        let colour = RGBColor(i + 1, u8::from(series.mark == Mark::Dashed), 9);
        if series.mark != Mark::Dots {
            let line = LineSeries::new(points.iter().copied(), colour.stroke_width(4));
            chart.draw_series(line).map_err(|e| e.to_string())?;
        }
        if matches!(series.mark, Mark::Dots | Mark::LineDots) {
            // Clouds of points get small dots.
            let size = if points.len() > 300 { 3 } else { 7 };
            let dots = points.iter().map(|&p| Circle::new(p, size, colour.filled()));
            chart.draw_series(dots).map_err(|e| e.to_string())?;
        }
    }
    Ok(())
}

/// The points that the axes can show.
fn usable(figure: &Figure, series: &Series) -> Vec<(f64, f64)> {
    let fits = |axis: &Axis, v: f64| {
        v.is_finite() && (!axis.log || v > 0.0) && axis.range.is_none_or(|[low, high]| low <= v && v <= high)
    };
    series.points.iter().copied().filter(|&(x, y)| fits(&figure.x, x) && fits(&figure.y, y)).collect()
}

/// A number as short as it can be read.
pub fn number(v: &f64) -> String {
    let v = *v;
    let magnitude = v.abs();
    if magnitude != 0.0 && !(1e-3..1e5).contains(&magnitude) {
        let exponent = magnitude.log10().floor();
        let mantissa = v / 10f64.powf(exponent);
        return if (mantissa - 1.0).abs() < 1e-6 {
            format!("1e{exponent}")
        } else {
            format!("{mantissa:.1}e{exponent}")
        };
    }
    let text = format!("{v:.3}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".into() } else { text.into() }
}

/// Exchanges placeholder colours for classes and lets the page choose the size.
fn restyle(svg: &str) -> String {
    let mut out = String::with_capacity(svg.len());
    for line in svg.lines() {
        if line.contains("opacity=\"0\"") {
            continue;
        }
        let mut line = line.replace("font-family=\"sans-serif\"", "");
        if line.starts_with("<svg") {
            let (w, h) = SIZE;
            line = format!("<svg viewBox=\"0 0 {w} {h}\" xmlns=\"http://www.w3.org/2000/svg\" role=\"img\">");
        }
        line = line.replace("stroke=\"#000000\"", "class=\"ink-stroke\"").replace("fill=\"#000000\"", "class=\"ink\"");
        for i in 0..COLOURS {
            for (green, dash) in [(0, ""), (1, " dash")] {
                let code = format!("#{:02X}{green:02X}09", i + 1);
                line = line
                    .replace(&format!("stroke=\"{code}\""), &format!("class=\"s{i}{dash}\""))
                    .replace(&format!("fill=\"{code}\""), &format!("class=\"f{i}\""));
            }
        }
        out.push_str(&line);
        out.push('\n');
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plot_has_its_series_and_no_fixed_colours() {
        let figure = Figure::new("a", "", Axis::log("samples"), Axis::log("error"))
            .with("one", Mark::LineDots, vec![(1.0, 1.0), (10.0, 0.1), (100.0, 0.0)])
            .with("two", Mark::Dashed, vec![(1.0, 0.5), (100.0, 0.05)]);
        let text = svg(&figure).unwrap();
        assert!(text.contains("class=\"s0\"") && text.contains("class=\"s1 dash\"") && text.contains("class=\"f0\""));
        assert!(!text.contains('#'), "{text}");
        // The point that is not positive has no place on a logarithmic axis.
        assert_eq!(text.matches("<circle").count(), 2);
    }

    #[test]
    fn empty_plots_are_an_error_and_numbers_are_short() {
        assert!(svg(&Figure::new("a", "", Axis::log(""), Axis::linear(""))).is_err());
        assert_eq!(number(&0.5), "0.5");
        assert_eq!(number(&1e-5), "1e-5");
        assert_eq!(number(&2.5e7), "2.5e7");
        assert_eq!(number(&-0.0), "0");
    }
}
