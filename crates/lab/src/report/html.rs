//! The page.

use super::plot::{self, COLOURS};
use super::{Report, Section, files};
use crate::experiment::{Block, Experiment, Figure, Mark, Picture, Setting, Table};
use crate::slides::{QUESTIONS, SLIDES};
use crate::{Claim, Error, Verdict};
use std::fmt::Write as _;
use steradian_image::Format;

const STYLE: &str = include_str!("style.css");
const SCRIPT: &str = include_str!("script.js");

/// The whole page.
pub fn page(report: &Report) -> Result<String, Error> {
    let mut out = String::new();
    let title = "Anti-aliasing and Monte Carlo path tracing, measured";
    let _ = write!(
        out,
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>{title}</title>\
         <meta name=\"viewport\" content=\"width=device-width,initial-scale=1\"><style>{STYLE}</style></head><body>\
         <header><h1>{title}</h1>{}</header><main>",
        introduction(report)
    );
    for section in &report.sections {
        out.push_str(&chapter(section, &report.setting)?);
    }
    out.push_str(&questions(report));
    out.push_str(&slides(report));
    out.push_str(&errata(report));
    let _ = write!(out, "</main><footer><p class=\"soft\">Written by <code>steradian lab</code>.</p></footer>");
    let _ = writeln!(out, "<script>{SCRIPT}</script></body></html>");
    Ok(out)
}

fn introduction(report: &Report) -> String {
    let (all, held) = (report.claims().count(), report.claims().filter(|c| c.holds()).count());
    let seconds: f64 = report.sections.iter().map(|s| s.seconds).sum();
    let class = if held == all { "holds" } else { "fails" };
    let mut out = format!(
        "<p>Every idea of Brian Curless’s lecture <em>Anti-aliasing and Monte Carlo Path Tracing</em> (CSE 557, 2017) as an \
         experiment, and every claim as a number. A claim holds if the measured value lies in the stated interval, which is \
         drawn around the prediction so that a true claim fails once in ten million runs; where the claim is “at least” or “at \
         most”, the prediction is that bound. The numbers are in \
         <code>csv/</code> and <code>report.json</code>, the pictures in <code>images/</code>.</p>\
         <p class=\"summary\"><span class=\"{class}\">{held} of {all} claims hold</span><span class=\"soft\">effort: {}</span>\
         <span class=\"soft\">seed {}</span><span class=\"soft\">{seconds:.0} s</span></p><nav><ol>",
        format!("{:?}", report.setting.effort).to_lowercase(),
        report.setting.seed
    );
    for s in &report.sections {
        let e = &s.experiment;
        let failing = e.claims.iter().filter(|c| !c.holds()).count();
        let mark = if failing > 0 { format!(" <span class=\"fails\">{failing} fail</span>") } else { String::new() };
        let _ = write!(
            out,
            "<li value=\"{}\"><a href=\"#{}\">{}</a>{mark}</li>",
            e.topic.number(),
            e.topic,
            escape(e.title)
        );
    }
    out + "</ol><p><a href=\"#questions\">The questions of the slides</a> · <a href=\"#slides\">Slide by slide</a> · \
           <a href=\"#errata\">Errata</a></p></nav>"
}

fn chapter(section: &Section, setting: &Setting) -> Result<String, Error> {
    let e = &section.experiment;
    let mut out = format!(
        "<section id=\"{}\"><h2>{}. {}</h2><blockquote>{}</blockquote><p><strong>Experiment.</strong> {}</p>\
         <div class=\"answer\"><p><strong>Measured.</strong> {}</p><p class=\"soft\"><code>{}</code> ({:.1} s)</p></div>",
        e.topic,
        e.topic.number(),
        escape(e.title),
        escape(e.lecture),
        escape(&e.method),
        escape(&e.result),
        escape(&setting.command(e.topic)),
        section.seconds
    );
    let mut figures_open = false;
    for block in &e.blocks {
        // Neighbouring plots share a grid.
        let is_plot = matches!(block, Block::Figure(_));
        if is_plot != figures_open {
            out.push_str(if is_plot { "<div class=\"figures\">" } else { "</div>" });
            figures_open = is_plot;
        }
        match block {
            Block::Text(text) => {
                let _ = write!(out, "<p>{}</p>", escape(text));
            }
            Block::Figure(f) => out.push_str(&figure(f)?),
            Block::Table(t) => out.push_str(&table(t)),
            Block::Pictures(all) => out.push_str(&pictures(all)?),
            Block::Slider { left, right, caption } => out.push_str(&slider(e, left, right, caption)?),
        }
    }
    if figures_open {
        out.push_str("</div>");
    }
    out.push_str("<h3>Claims</h3>");
    out.push_str(&claims(&e.claims));
    if !e.answers.is_empty() {
        out.push_str("<h3>Questions of the slides</h3>");
        let mut answers: Vec<_> = e.answers.iter().collect();
        answers.sort_by_key(|a| a.question);
        for a in answers {
            let question = QUESTIONS.iter().find(|q| q.number == a.question).map_or("", |q| q.text);
            let _ = write!(out, "<p><strong>{}. {}</strong> {}</p>", a.question, escape(question), escape(&a.text));
        }
    }
    Ok(out + "</section>")
}

fn figure(f: &Figure) -> Result<String, Error> {
    let mut legend = String::new();
    for (i, s) in f.series.iter().enumerate() {
        let colour = i % COLOURS;
        let (class, property) = match s.mark {
            Mark::Dots => ("dots", "background"),
            Mark::Dashed => ("dashed", "border-color"),
            Mark::Line | Mark::LineDots => ("", "border-color"),
        };
        let _ = write!(
            legend,
            "<li><i class=\"{class}\" style=\"{property}:var(--c{colour})\"></i>{}</li>",
            escape(&s.name)
        );
    }
    let svg = plot::svg(f)?;
    Ok(format!(
        "<figure class=\"plot\">{svg}<ul class=\"legend\">{legend}</ul><figcaption>{}</figcaption></figure>",
        escape(&f.caption)
    ))
}

fn table(t: &Table) -> String {
    let head: String = t.columns.iter().map(|c| format!("<th>{}</th>", escape(c))).collect();
    let body: String = t
        .rows
        .iter()
        .map(|row| {
            let cell = |c: &String| {
                // Numbers stay on one line.
                let class = if c.parse::<f64>().is_ok() { " class=\"number\"" } else { "" };
                format!("<td{class}>{}</td>", escape(c))
            };
            let cells: String = row.iter().map(cell).collect();
            format!("<tr>{cells}</tr>")
        })
        .collect();
    format!(
        "<figure><figcaption>{}</figcaption><div class=\"scroll\"><table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table></div></figure>",
        escape(&t.caption)
    )
}

fn pictures(all: &[Picture]) -> Result<String, Error> {
    let mut out = format!("<div class=\"pictures{}\">", if all.len() < 3 { " wide" } else { "" });
    for p in all {
        let _ = write!(
            out,
            "<figure><img loading=\"lazy\" alt=\"{}\" width=\"{}\" height=\"{}\" src=\"{}\"><figcaption>{}</figcaption></figure>",
            escape(&p.caption),
            p.image.width(),
            p.image.height(),
            data_uri(p)?,
            escape(&p.caption)
        );
    }
    Ok(out + "</div>")
}

fn slider(e: &Experiment, left: &str, right: &str, caption: &str) -> Result<String, Error> {
    let (Some(l), Some(r)) = (e.picture(left), e.picture(right)) else { return Ok(String::new()) };
    Ok(format!(
        "<figure class=\"slider\"><div class=\"stack\"><img alt=\"{}\" src=\"{}\"><img alt=\"{}\" src=\"{}\"></div>\
         <input type=\"range\" min=\"0\" max=\"100\" value=\"50\" aria-label=\"Where the two pictures meet\">\
         <div class=\"ends\"><span>{}</span><span>{}</span></div><figcaption>{}</figcaption></figure>",
        escape(&l.caption),
        data_uri(l)?,
        escape(&r.caption),
        data_uri(r)?,
        escape(&l.caption),
        escape(&r.caption),
        escape(caption)
    ))
}

fn claims(claims: &[Claim]) -> String {
    let mut out = String::from(
        "<table class=\"claims\"><thead><tr><th>Claim</th><th>Predicted</th><th>Measured</th><th>Agrees if in</th><th></th></tr>\
         </thead><tbody>",
    );
    for c in claims {
        let verdict = match c.verdict {
            Verdict::Holds => "<span class=\"holds\">✓ holds</span>",
            Verdict::Fails => "<span class=\"fails\">✗ fails</span>",
        };
        let _ = write!(
            out,
            "<tr><td>{}</td><td class=\"number\" data-label=\"Predicted\">{}</td>\
             <td class=\"number\" data-label=\"Measured\">{}</td><td class=\"number\" data-label=\"Agrees if in\">{}</td>\
             <td>{verdict}</td></tr>",
            escape(&c.claim),
            short(c.predicted),
            short(c.measured),
            interval(c.interval)
        );
    }
    out + "</tbody></table>"
}

fn questions(report: &Report) -> String {
    let mut out = String::from("<section id=\"questions\"><h2>The questions of the slides</h2><ol>");
    for q in QUESTIONS {
        let answer = report.sections.iter().find_map(|s| {
            s.experiment.answers.iter().find(|a| a.question == q.number).map(|a| (s.experiment.topic, a))
        });
        let text = match answer {
            Some((topic, a)) => format!("{} <a href=\"#{topic}\">{topic}</a>", escape(&a.text)),
            None => {
                format!("<span class=\"soft\">Run <code>{}</code>.</span>", escape(&report.setting.command(q.topic)))
            }
        };
        let _ = write!(
            out,
            "<li value=\"{}\"><strong>{}</strong> <span class=\"soft\">({})</span><br>{text}</li>",
            q.number,
            escape(q.text),
            escape(q.slide)
        );
    }
    out + "</ol></section>"
}

fn slides(report: &Report) -> String {
    let mut out = String::from(
        "<section id=\"slides\"><h2>Slide by slide</h2><div class=\"scroll\"><table><thead><tr><th>Slide</th><th>Section</th>\
         <th>Command</th></tr></thead><tbody>",
    );
    for (slide, topic) in SLIDES {
        let there = report.sections.iter().any(|s| s.experiment.topic == *topic);
        let name = if there { format!("<a href=\"#{topic}\">{topic}</a>") } else { topic.to_string() };
        let _ = write!(
            out,
            "<tr><td>{}</td><td>{name}</td><td><code>{}</code></td></tr>",
            escape(slide),
            escape(&report.setting.command(*topic))
        );
    }
    out + "</tbody></table></div></section>"
}

fn errata(report: &Report) -> String {
    let mut out = String::from(
        "<section id=\"errata\"><h2>Errata</h2><p>Slips of the slides, with the number that shows each.</p><div class=\"scroll\">\
         <table><thead><tr><th>The slide says</th><th>Correct and measured</th></tr></thead><tbody>",
    );
    for x in report.sections.iter().flat_map(|s| &s.experiment.errata) {
        let _ = write!(out, "<tr><td>{}</td><td>{}</td></tr>", escape(&x.slide), escape(&x.correction));
    }
    out + "</tbody></table></div></section>"
}

fn data_uri(p: &Picture) -> Result<String, Error> {
    Ok(format!("data:image/png;base64,{}", base64(&files::bytes(p, Format::Png)?)))
}

/// Four digits, and not more characters than needed.
fn short(v: f64) -> String {
    let magnitude = v.abs();
    if v == f64::INFINITY {
        "∞".into()
    } else if v == f64::NEG_INFINITY {
        "−∞".into()
    } else if magnitude == 0.0 || (1e-3..1e6).contains(&magnitude) {
        let digits = (3 - magnitude.max(1e-3).log10().floor() as i32).clamp(0, 6) as usize;
        let text = format!("{v:.digits$}");
        let text = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
        text.replace('-', "−")
    } else {
        format!("{v:.3e}").replace('-', "−")
    }
}

fn interval([low, high]: [f64; 2]) -> String {
    match (low.is_finite(), high.is_finite()) {
        (false, true) => format!("≤ {}", short(high)),
        (true, false) => format!("≥ {}", short(low)),
        _ => format!("{} … {}", short(low), short(high)),
    }
}

/// Text that HTML does not read as markup.
fn escape(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            c => out.push(c),
        }
    }
    out
}

/// RFC 4648.
fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut out = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for chunk in bytes.chunks(3) {
        let word = chunk.iter().fold(0u32, |w, &b| w << 8 | u32::from(b)) << (8 * (3 - chunk.len()));
        for i in 0..4 {
            let digit = DIGITS[(word >> (18 - 6 * i) & 63) as usize];
            out.push(if i <= chunk.len() { char::from(digit) } else { '=' });
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_of_the_standard() {
        let cases =
            [("", ""), ("f", "Zg=="), ("fo", "Zm8="), ("foo", "Zm9v"), ("foob", "Zm9vYg=="), ("foobar", "Zm9vYmFy")];
        for (plain, coded) in cases {
            assert_eq!(base64(plain.as_bytes()), coded);
        }
    }

    #[test]
    fn numbers_and_text_for_people() {
        assert_eq!(short(0.5), "0.5");
        assert_eq!(short(1234.56), "1235");
        assert_eq!(short(-0.000_012), "−1.200e−5");
        assert_eq!(interval([f64::NEG_INFINITY, 2.0]), "≤ 2");
        assert_eq!(escape("a<b & \"c\""), "a&lt;b &amp; &quot;c&quot;");
    }
}
