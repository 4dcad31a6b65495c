//! The report as files: self-contained, complete, repeatable, and honest about bad input.

use steradian_lab::{BruteForce, Effort, Error, Options, Quiet, Setting, Topic, run, run_cli_like};

fn options(topics: &[&str], folder: Option<&std::path::Path>) -> Options {
    let topics = topics.iter().map(|&t| t.to_owned()).collect();
    Options {
        topics,
        folder: folder.map(Into::into),
        effort: Effort::Least,
        seed: 3,
        threads: 2,
        brute_force: None,
        insist: false,
    }
}

#[test]
fn a_report_has_its_files_and_asks_for_nothing_else() {
    let folder = tempfile::tempdir().unwrap();
    let report = run_cli_like(&options(&["supersampling", "motion-blur"], Some(folder.path())), &Quiet).unwrap();
    let read = |name: &str| std::fs::read_to_string(folder.path().join(name)).unwrap();
    let page = read("report.html");
    for forbidden in ["http://", "https://", "url(", "@import", "<link", "src=\"images"] {
        // The name of the SVG language is no address that is asked for.
        let rest = page.replace("http://www.w3.org/2000/svg", "");
        assert!(!rest.contains(forbidden), "{forbidden}");
    }
    assert!(page.contains("prefers-color-scheme:dark") && page.contains("width=device-width"));
    assert!(page.contains("<svg") && page.contains("data:image/png;base64,") && page.contains("type=\"range\""));
    // One JSON object on each line, with the promised keys.
    let lines = read("claims.jsonl");
    assert_eq!(lines.lines().count(), report.claims().count());
    for line in lines.lines() {
        let value: serde_json::Value = serde_json::from_str(line).unwrap();
        for key in ["topic", "claim", "predicted", "measured", "interval", "verdict"] {
            assert!(value.get(key).is_some(), "{line}");
        }
    }
    let all: serde_json::Value = serde_json::from_str(&read("report.json")).unwrap();
    assert_eq!(all["sections"].as_array().unwrap().len(), 2);
    for section in all["sections"].as_array().unwrap() {
        for image in section["images"].as_array().unwrap() {
            for kind in ["png", "exr"] {
                let bytes = std::fs::read(folder.path().join(image[kind].as_str().unwrap())).unwrap();
                assert!(steradian_image::read(&bytes, "picture").is_ok());
            }
        }
        for figure in section["figures"].as_array().unwrap() {
            let name = format!("csv/{}-{}.csv", section["topic"].as_str().unwrap(), figure["id"].as_str().unwrap());
            assert!(read(&name).lines().count() > 1, "{name}");
        }
    }
}

#[test]
fn the_numbers_are_a_function_of_the_seed_alone() {
    let claims = |seed: u64, threads: usize| {
        let setting = Setting { effort: Effort::Least, seed, threads, brute_force: None };
        let report = run(&[Topic::MotionBlur, Topic::Roulette], &setting, &Quiet).unwrap();
        report.claims().map(|c| c.to_json()).collect::<Vec<_>>()
    };
    assert_eq!(claims(5, 1), claims(5, 3));
    assert_ne!(claims(5, 2), claims(6, 2));
}

#[test]
fn bad_input_is_named() {
    let message = run_cli_like(&options(&["alaising"], None), &Quiet).unwrap_err().to_string();
    assert!(message.contains("did you mean 'aliasing'?") && message.contains("soft-shadows"), "{message}");
    let message = run_cli_like(&options(&["xyzzy"], None), &Quiet).unwrap_err().to_string();
    assert!(!message.contains("did you mean"), "{message}");
    // What would not end before the lecture does.
    let slide = "m=1000,k=8,a=8,s=8,r=8,d=8,n=1000000,l=4".parse().unwrap();
    let absurd = Options { brute_force: Some(slide), ..options(&["cost"], None) };
    let message = run_cli_like(&absurd, &Quiet).unwrap_err().to_string();
    assert!(message.contains("intersection tests, about") && message.contains("years"), "{message}");
    let elsewhere = Options { brute_force: Some(BruteForce::default()), ..options(&["mis"], None) };
    assert!(matches!(run_cli_like(&elsewhere, &Quiet), Err(Error::NotCost)));
    // A file stands where the folder should be.
    let file = tempfile::NamedTempFile::new().unwrap();
    let error = run_cli_like(&options(&["supersampling"], Some(file.path())), &Quiet).unwrap_err();
    assert!(matches!(error, Error::Write { .. }), "{error}");
}
