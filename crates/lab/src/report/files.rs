//! The numbers and pictures of a report as files.

use super::Report;
use crate::Error;
use crate::experiment::{Block, Experiment, Figure, Picture, Setting, Table};
use serde_json::{Value, json};
use std::fmt::Write as _;
use std::path::Path;
use steradian_image::{Format, WriteOptions, encode, write_bytes_atomically};

/// Writes all files; makes the folders first, so that an unwritable place is found out before anything is drawn.
pub fn write(report: &Report, folder: &Path) -> Result<(), Error> {
    for name in ["", "csv", "images"] {
        let path = folder.join(name);
        std::fs::create_dir_all(&path).map_err(|source| Error::Write { path, source })?;
    }
    for section in &report.sections {
        let e = &section.experiment;
        for block in &e.blocks {
            match block {
                Block::Figure(f) => put(folder, &format!("csv/{}-{}.csv", e.topic, f.id), figure_csv(f).as_bytes())?,
                Block::Table(t) => put(folder, &format!("csv/{}-{}.csv", e.topic, t.id), table_csv(t).as_bytes())?,
                Block::Pictures(pictures) => {
                    for p in pictures {
                        for (format, extension) in [(Format::Png, "png"), (Format::Exr, "exr")] {
                            let name = format!("images/{}-{}.{extension}", e.topic, p.id);
                            put(folder, &name, &bytes(p, format)?)?;
                        }
                    }
                }
                Block::Text(_) | Block::Slider { .. } => {}
            }
        }
    }
    let claims: String = report.claims().fold(String::new(), |all, c| all + &c.to_json() + "\n");
    put(folder, "claims.jsonl", claims.as_bytes())?;
    let text = serde_json::to_string_pretty(&json(report)).expect("strings and numbers");
    put(folder, "report.json", text.as_bytes())?;
    put(folder, "report.html", report.html()?.as_bytes())
}

/// A picture as a file of some format.
pub fn bytes(picture: &Picture, format: Format) -> Result<Vec<u8>, Error> {
    encode(&picture.image, format, &picture.id, &WriteOptions::default())
        .map_err(|source| Error::Picture { name: picture.id.clone(), source })
}

fn put(folder: &Path, name: &str, bytes: &[u8]) -> Result<(), Error> {
    let path = folder.join(name);
    write_bytes_atomically(&path, bytes).map_err(|source| Error::Picture { name: path.display().to_string(), source })
}

/// One row for each point: series, x, y.
fn figure_csv(f: &Figure) -> String {
    let mut out = format!("series,{},{}\n", quoted(&f.x.label), quoted(&f.y.label));
    for s in &f.series {
        for (x, y) in &s.points {
            let _ = writeln!(out, "{},{x},{y}", quoted(&s.name));
        }
    }
    out
}

fn table_csv(t: &Table) -> String {
    let line = |cells: &[String]| cells.iter().map(|c| quoted(c)).collect::<Vec<_>>().join(",") + "\n";
    t.rows.iter().fold(line(&t.columns), |out, row| out + &line(row))
}

fn quoted(text: &str) -> String {
    if text.contains([',', '"', '\n']) { format!("\"{}\"", text.replace('"', "\"\"")) } else { text.into() }
}

fn json(report: &Report) -> Value {
    json!({
        "effort": format!("{:?}", report.setting.effort).to_lowercase(),
        "seed": report.setting.seed,
        "false_alarm": crate::FALSE_ALARM,
        "sections": report.sections.iter().map(|s| section(&s.experiment, s.seconds, &report.setting)).collect::<Vec<_>>(),
    })
}

fn section(e: &Experiment, seconds: f64, setting: &Setting) -> Value {
    let finite = |v: f64| v.is_finite().then_some(v);
    let mut figures = Vec::new();
    let mut tables = Vec::new();
    let mut images = Vec::new();
    for block in &e.blocks {
        match block {
            Block::Figure(f) => figures.push(json!({
                "id": f.id,
                "caption": f.caption,
                "x": f.x.label,
                "y": f.y.label,
                "series": f.series.iter().map(|s| json!({
                    "name": s.name,
                    "points": s.points.iter().map(|&(x, y)| [finite(x), finite(y)]).collect::<Vec<_>>(),
                })).collect::<Vec<_>>(),
            })),
            Block::Table(t) => {
                tables.push(json!({ "id": t.id, "caption": t.caption, "columns": t.columns, "rows": t.rows }))
            }
            Block::Pictures(all) => images.extend(all.iter().map(|p| {
                let file = |extension: &str| format!("images/{}-{}.{extension}", e.topic, p.id);
                json!({ "id": p.id, "caption": p.caption, "png": file("png"), "exr": file("exr") })
            })),
            Block::Text(_) | Block::Slider { .. } => {}
        }
    }
    json!({
        "topic": e.topic,
        "title": e.title,
        "lecture": e.lecture,
        "method": e.method,
        "result": e.result,
        "command": setting.command(e.topic),
        "seconds": seconds,
        "claims": e.claims,
        "figures": figures,
        "tables": tables,
        "images": images,
        "answers": e.answers.iter().map(|a| json!({ "question": a.question, "text": a.text })).collect::<Vec<_>>(),
        "errata": e.errata.iter().map(|x| json!({ "slide": x.slide, "correction": x.correction })).collect::<Vec<_>>(),
    })
}
