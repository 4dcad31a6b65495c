//! The page, as it was built from `page/` and is kept beside it: whoever builds Steradian needs no other tools than Rust's.

/// The file of this path and its type.
pub(crate) fn asset(path: &str) -> Option<(&'static str, &'static [u8])> {
    Some(match path {
        "/" => ("text/html; charset=utf-8", include_bytes!("../page/dist/index.html")),
        "/page.js" => ("text/javascript; charset=utf-8", include_bytes!("../page/dist/page.js")),
        "/page.css" => ("text/css; charset=utf-8", include_bytes!("../page/dist/page.css")),
        "/icon.svg" | "/favicon.ico" => ("image/svg+xml", include_bytes!("../page/dist/icon.svg")),
        _ => return None,
    })
}
