//! The language as written: what is read, what is refused and with which words, and that printing loses nothing.

use proptest::prelude::*;
use steradian_syntax::{
    Arg, ArgValue, Directive, FileId, Kind, Param, ParamType, Parser, Severity, Signature, SourceMap, Span, Values,
    parse, print,
};

/// The tree without the places, which printing changes.
fn bare(directives: &[Directive]) -> Vec<Directive> {
    let mut out = directives.to_vec();
    for d in &mut out {
        d.span = Span::default();
        d.args.iter_mut().for_each(|a| a.span = Span::default());
        for p in &mut d.params {
            p.span = Span::default();
            p.values_span = Span::default();
            if let Values::Strings(v) = &mut p.values {
                v.iter_mut().for_each(|s| s.1 = Span::default());
            }
        }
    }
    out
}

/// `line:column severity message | hint` for each problem.
fn problems(text: &str) -> Vec<String> {
    let mut map = SourceMap::new();
    let id = map.add("t", text);
    parse(id, text)
        .diagnostics
        .iter()
        .map(|d| {
            let at = map.get(id).unwrap().location(d.span.unwrap().start);
            let hint = d.hint.as_ref().map_or(String::new(), |h| format!(" | {h}"));
            format!("{}:{} {} {}{hint}", at.line, at.column, d.severity.word(), d.message)
        })
        .collect()
}

#[test]
fn every_form_of_argument_is_read() {
    let text = r#"
# a comment with "quotes" and [brackets
LookAt 3 4 1.5  .5 .5 0  0 0 1
Transform [1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1]
ActiveTransform EndTime
Option "seed" 16777217
Option "rendercoordsys" "world"
MediumInterface "in" "out" MediumInterface "in"
Texture "t" "spectrum" "imagemap" "string filename" "a b.png" "bool invert" true
Shape "trianglemesh" "integer indices" [0 1 -2] "point3 P" [0 0 0 1e0 0. 0 -.5 +1 0]
  "spectrum L" [400 1 500 2.5] "spectrum eta" "metal-Cu-eta" "bool b" [ true false ] "blackbody T" 6500
"#;
    let parsed = parse(FileId(0), text);
    assert_eq!(parsed.diagnostics, []);
    let d = &parsed.directives;
    assert_eq!(d.len(), 9);
    assert_eq!(d[0].numbers::<9>(), Some([3.0, 4.0, 1.5, 0.5, 0.5, 0.0, 0.0, 0.0, 1.0]));
    assert_eq!(d[2].text(0), "EndTime");
    assert_eq!(d[3].text(1), "16777217", "a seed keeps all its digits");
    assert_eq!((d[5].args.len(), d[6].args.len()), (2, 1));
    assert_eq!(d[7].params[1].values, Values::Bools(vec![true]));
    let p = &d[8].params;
    assert_eq!(p[0].values, Values::Ints(vec![0, 1, -2]));
    assert_eq!(p[1].values, Values::Floats(vec![0.0, 0.0, 0.0, 1.0, 0.0, 0.0, -0.5, 1.0, 0.0]));
    assert_eq!(p[1].ty, ParamType::Point3);
    let slice = |s: Span| &text[s.start as usize..s.end as usize];
    assert_eq!(slice(p[0].span), "\"integer indices\"");
    assert_eq!(slice(p[0].values_span), "[0 1 -2]");
    assert_eq!(p[2].values, Values::Floats(vec![400.0, 1.0, 500.0, 2.5]));
    let Values::Strings(s) = &p[3].values else { panic!("a spectrum by name is a string") };
    assert_eq!((s[0].0.as_str(), slice(s[0].1)), ("metal-Cu-eta", "\"metal-Cu-eta\""));
    assert_eq!(p[4].values, Values::Bools(vec![true, false]));
}

#[test]
fn problems_name_their_place_and_a_way_out() {
    let cases: &[(&str, &[&str])] = &[
        ("Shpae \"sphere\"", &["1:1 error unknown directive `Shpae` | did you mean `Shape`?"]),
        ("WorldBegin\n 3 4 Identity", &["2:2 error expected a directive, found `3`"]),
        ("Shape sphere", &["1:7 error expected a string in quotes after `Shape`, found `sphere`"]),
        ("Shape", &["1:1 error expected a string in quotes after `Shape`, found the end of the file"]),
        (
            "LookAt 1 2 3\nIdentity",
            &["2:1 error expected 9 numbers (this is number 4) after `LookAt`, found `Identity`"],
        ),
        ("Scale 1 nan 1", &["1:9 error expected 3 numbers (this is number 2) after `Scale`, found `nan`"]),
        ("Transform 1 0 0", &["1:11 error expected `[` and 16 numbers after `Transform`, found `1`"]),
        ("Shape \"sphere\n\"", &["1:7 error this string is not closed before the end of its line"]),
        (
            "Shape \"sphere\" \"float radius\" [ 1\nWorldBegin",
            &["1:31 error the `[` of parameter `radius` is not closed"],
        ),
        ("Shape \"sphere\" \"float radius\" \nWorldBegin", &["1:16 error parameter `radius` has no value"]),
        (
            "Shape \"sphere\" \"radius\" 2 \"float zmin\" 1",
            &[
                "1:16 error expected a parameter `\"type name\"`, found \"radius\" | a parameter is written as `\"float radius\" 2`",
            ],
        ),
        (
            "Shape \"sphere\" \"flaot radius\" [2]",
            &["1:16 error unknown parameter type `flaot` | did you mean `float`?"],
        ),
        (
            "Material \"diffuse\" \"color r\" [1 1 1]",
            &["1:20 error unknown parameter type `color` | pbrt-v4 calls it `rgb`"],
        ),
        ("Film \"rgb\" \"integer x\" [1.0 2.0]", &["1:25 error expected an integer for `\"integer x\"`, found `1.0`"]),
        (
            "Film \"rgb\" \"integer x\" 3000000000",
            &["1:24 error `3000000000` in parameter `x` does not fit in a 32-bit integer"],
        ),
        (
            "Film \"rgb\" \"float x\" 1e99",
            &["1:22 error `1e99` in parameter `x` does not fit in a 32-bit floating-point number"],
        ),
        ("Film \"rgb\" \"float x\" inf", &["1:22 error expected a number for `\"float x\"`, found `inf`"]),
        ("Film \"rgb\" \"float x\" \"2\"", &["1:22 error expected a number for `\"float x\"`, found `\"2\"`"]),
        (
            "Film \"rgb\" \"bool x\" \"true\"",
            &[
                "1:21 error expected `true` or `false` for `\"bool x\"`, found `\"true\"` | pbrt-v4 writes `true` and `false` without quotes",
            ],
        ),
        (
            "Film \"rgb\" \"string x\" \"C:\\dir\"",
            &[
                "1:26 error unknown escape `\\d` in a string | write a backslash as `\\\\`, or `/` in the path of a file",
            ],
        ),
    ];
    for (text, expected) in cases {
        assert_eq!(problems(text), *expected, "{text}");
    }
}

#[test]
fn reading_goes_on_after_a_problem() {
    let text =
        "Camera 3\nShape \"sphere\" \"integer n\" x \"float radius\" 2\nFoo [ 1 2\n\"x\"\nFilm \"rgb\"\n] WorldBegin";
    let parsed = parse(FileId(0), text);
    assert_eq!(parsed.diagnostics.len(), 4, "{:?}", parsed.diagnostics);
    let kinds: Vec<Kind> = parsed.directives.iter().map(|d| d.kind).collect();
    assert_eq!(kinds, [Kind::Shape, Kind::Film, Kind::WorldBegin]);
    assert_eq!(parsed.directives[0].params.len(), 1);
    assert_eq!(parsed.directives[0].params[0].name, "radius");
}

#[test]
fn a_text_that_is_all_wrong_gives_a_bounded_report() {
    let parsed = parse(FileId(0), &"Shpae Identity ".repeat(10_000));
    assert_eq!(parsed.directives.len(), 10_000);
    assert_eq!(parsed.diagnostics.len(), 101);
    assert_eq!(parsed.diagnostics[100].severity, Severity::Note);
}

#[test]
fn one_directive_at_a_time_is_the_same_as_all_at_once() {
    let text = "Identity Oops 1 Scale 1 2 3 Shape \"a\"";
    let mut parser = Parser::new(FileId(3), text);
    let first = parser.next_directive().unwrap();
    assert_eq!((first.kind, parser.take_diagnostics().len()), (Kind::Identity, 0));
    assert_eq!(parser.next_directive().unwrap().kind, Kind::Scale);
    assert_eq!(parser.take_diagnostics().len(), 1);
    assert_eq!(parser.next_directive().unwrap().kind, Kind::Shape);
    assert!(parser.next_directive().is_none() && parser.next_directive().is_none());
}

fn text() -> impl Strategy<Value = String> {
    prop_oneof!["[a-zA-Z0-9 ./_-]{0,12}", any::<String>().prop_map(|s| s.chars().take(12).collect())]
}

fn number() -> impl Strategy<Value = f32> {
    prop_oneof![any::<f32>().prop_filter("finite", |x| x.is_finite()), (-1000i32..1000).prop_map(|x| x as f32)]
}

fn param() -> impl Strategy<Value = Param> {
    let ty = (0..ParamType::ALL.len()).prop_map(|i| ParamType::ALL[i]);
    let floats = proptest::collection::vec(number(), 0..30);
    let strings = proptest::collection::vec(text(), 1..4);
    let ints = proptest::collection::vec(any::<i32>(), 0..30);
    (ty, "[a-zA-Z.][a-zA-Z0-9_.\"\\\\]{0,8}", floats, strings, ints, any::<bool>()).prop_map(
        |(ty, name, floats, strings, ints, b)| {
            let strings = Values::Strings(strings.into_iter().map(|s| (s, Span::default())).collect());
            let values = match ty {
                ParamType::Integer => Values::Ints(ints),
                ParamType::Bool => Values::Bools(ints.iter().map(|i| i % 2 == 0).collect()),
                ParamType::String | ParamType::Texture => strings,
                ParamType::Spectrum if b => strings,
                _ => Values::Floats(floats),
            };
            Param { ty, name, span: Span::default(), values_span: Span::default(), values }
        },
    )
}

fn directive() -> impl Strategy<Value = Directive> {
    let kind = (0..Kind::ALL.len()).prop_map(|i| Kind::ALL[i]);
    let strings = proptest::collection::vec(text(), 3);
    let numbers = proptest::collection::vec(number(), 16);
    let params = proptest::collection::vec(param(), 0..4);
    ((kind, strings, numbers), params, any::<bool>(), "[a-z0-9.]{1,8}").prop_map(
        |((kind, s, n), params, more, word)| {
            let string = |i: usize| ArgValue::String(s[i].clone());
            let word = ArgValue::Word(word);
            let args: Vec<ArgValue> = match kind.signature() {
                Signature::Nothing => vec![],
                Signature::Strings(k) | Signature::Params(k) => (0..k).map(string).collect(),
                Signature::OneOrTwoStrings => (0..1 + usize::from(more)).map(string).collect(),
                Signature::Numbers(k) | Signature::Bracketed(k) => {
                    n[..k].iter().map(|&x| ArgValue::Number(x)).collect()
                }
                Signature::Word => vec![word],
                Signature::Option => vec![string(0), if more { string(1) } else { word }],
            };
            let args = args.into_iter().map(|value| Arg { value, span: Span::default() }).collect();
            let params = if matches!(kind.signature(), Signature::Params(_)) { params } else { vec![] };
            Directive { kind, span: Span::default(), args, params }
        },
    )
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn printing_and_parsing_gives_the_same_tree(tree in proptest::collection::vec(directive(), 0..6)) {
        let text = print(&tree);
        let parsed = parse(FileId(0), &text);
        prop_assert_eq!(&parsed.diagnostics, &vec![], "{}", text);
        prop_assert_eq!(bare(&parsed.directives), tree);
    }

    #[test]
    fn any_text_is_read_without_a_panic_and_reported_with_valid_places(
        pieces in proptest::collection::vec(prop_oneof![
            any::<String>(),
            Just(" Shape ".to_string()), Just("\"float x\"".to_string()), Just("[".to_string()), Just("] ".to_string()),
            Just("\"integer i\" [ 1 2".to_string()), Just("\\".to_string()), Just("\"".to_string()), Just(" 12e".to_string()),
        ], 0..24)
    ) {
        let text = pieces.concat();
        let mut map = SourceMap::new();
        let id = map.add("t", text.as_str());
        let parsed = parse(id, &text);
        for d in &parsed.diagnostics {
            let span = d.span.unwrap();
            prop_assert!(span.start <= span.end && text.get(span.start as usize..span.end as usize).is_some());
            prop_assert!(d.render(&map).contains("t:"));
        }
        let again = parse(id, &print(&parsed.directives));
        prop_assert_eq!(again.diagnostics, vec![]);
        prop_assert_eq!(bare(&again.directives), bare(&parsed.directives));
    }
}
