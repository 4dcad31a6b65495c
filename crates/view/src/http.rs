//! Requests: read within limits of size and time, and let in only where they belong.

use std::io::{self, Read, Write};
use std::net::{IpAddr, TcpStream};
use std::time::{Duration, Instant};

/// A head longer than this is refused.
const MOST_HEAD: usize = 8 << 10;
/// Whoever has not said what they want by then, never will.
const PATIENCE: Duration = Duration::from_secs(5);

/// What is asked, as far as it matters here.
#[derive(Clone, Debug, Default)]
pub(crate) struct Request {
    pub method: String,
    pub path: String,
    pub query: String,
    pub host: Option<String>,
    pub origin: Option<String>,
    /// The key of a WebSocket's handshake, if this is one.
    pub key: Option<String>,
}

impl Request {
    /// A value of the query.
    pub fn value(&self, name: &str) -> Option<&str> {
        self.query.split('&').find_map(|pair| pair.strip_prefix(name)?.strip_prefix('='))
    }
}

/// Reads the head of a request. What comes after it is not read.
///
/// # Errors
/// The status to answer with; none where there is nobody to answer.
pub(crate) fn read(stream: &mut TcpStream) -> Result<Request, Option<u16>> {
    let start = Instant::now();
    let mut bytes = Vec::new();
    let mut buffer = [0; 1024];
    loop {
        let left = PATIENCE.checked_sub(start.elapsed()).filter(|d| !d.is_zero()).ok_or(Some(408u16))?;
        stream.set_read_timeout(Some(left)).map_err(|_| None)?;
        let n = match stream.read(&mut buffer) {
            Ok(0) => return Err(None),
            Ok(n) => n,
            Err(e) if matches!(e.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut) => return Err(Some(408)),
            Err(_) => return Err(None),
        };
        bytes.extend_from_slice(&buffer[..n]);
        if let Some(request) = parse(&bytes)? {
            return Ok(request);
        }
        if bytes.len() > MOST_HEAD {
            return Err(Some(431));
        }
    }
}

/// A request, once its head is complete.
fn parse(bytes: &[u8]) -> Result<Option<Request>, Option<u16>> {
    let mut headers = [httparse::EMPTY_HEADER; 64];
    let mut parsed = httparse::Request::new(&mut headers);
    match parsed.parse(bytes) {
        Ok(httparse::Status::Complete(_)) => {}
        Ok(httparse::Status::Partial) => return Ok(None),
        Err(httparse::Error::TooManyHeaders) => return Err(Some(431)),
        Err(_) => return Err(Some(400)),
    }
    let (path, query) = parsed.path.unwrap_or("/").split_once('?').unwrap_or((parsed.path.unwrap_or("/"), ""));
    let mut request = Request {
        method: parsed.method.unwrap_or_default().into(),
        path: path.into(),
        query: query.into(),
        ..Request::default()
    };
    let mut websocket = false;
    for header in parsed.headers.iter() {
        let value = || String::from_utf8_lossy(header.value).trim().to_owned();
        let slot = match header.name.to_ascii_lowercase().as_str() {
            "host" => &mut request.host,
            "origin" => &mut request.origin,
            "sec-websocket-key" => &mut request.key,
            "upgrade" => {
                websocket |= value().eq_ignore_ascii_case("websocket");
                continue;
            }
            _ => continue,
        };
        // Two of these are a disguise.
        if slot.replace(value()).is_some() {
            return Err(Some(400));
        }
    }
    request.key = request.key.filter(|_| websocket);
    Ok(Some(request))
}

/// The name in a `Host`, without its port.
fn name_of(host: &str) -> &str {
    match host.rsplit_once(':') {
        Some((name, port)) if port.bytes().all(|b| b.is_ascii_digit()) => name,
        _ => host,
    }
}

/// Stands, among the names that are known, for every address that is written in numbers: those cannot be made to point elsewhere.
pub(crate) const ANY_ADDRESS: &str = "*";

/// Whether a request comes from a page of ours, under a name of ours: another page that a browser shows may not talk to this
/// server, nor may a name that somebody makes point at this machine. `known` are names besides those of the loopback; the port may be
/// any, because a tunnel changes it.
pub(crate) fn belongs(request: &Request, known: &[String]) -> bool {
    let Some(host) = &request.host else { return false };
    let name = name_of(host).to_ascii_lowercase();
    let number = name.trim_matches(['[', ']']).parse::<IpAddr>().is_ok();
    let ours = ["localhost", "127.0.0.1", "[::1]"].contains(&name.as_str())
        || known.contains(&name)
        || number && known.iter().any(|k| k == ANY_ADDRESS);
    let same = |origin: &str| {
        let rest = origin.strip_prefix("http://").or_else(|| origin.strip_prefix("https://"));
        rest.is_some_and(|rest| rest.eq_ignore_ascii_case(host))
    };
    ours && request.origin.as_deref().is_none_or(same)
}

/// Whether two texts are equal, in a time that does not tell where they differ.
pub(crate) fn same_secret(a: &str, b: &str) -> bool {
    a.len() == b.len() && a.bytes().zip(b.bytes()).fold(0, |sum, (a, b)| sum | (a ^ b)) == 0
}

fn reason(status: u16) -> &'static str {
    match status {
        200 => "OK",
        400 => "Bad Request",
        403 => "Forbidden",
        404 => "Not Found",
        405 => "Method Not Allowed",
        408 => "Request Timeout",
        431 => "Request Header Fields Too Large",
        503 => "Service Unavailable",
        _ => "Error",
    }
}

/// Nothing but what comes with the page may run in it, and nobody may put it into a frame.
const POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; connect-src 'self'; \
                      base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

/// Answers and says good-bye. `file` is the name to save the body under.
pub(crate) fn respond(stream: &mut TcpStream, status: u16, kind: &str, body: &[u8], file: Option<&str>, head: bool) {
    let saved = file.map_or(String::new(), |f| format!("Content-Disposition: attachment; filename=\"{f}\"\r\n"));
    let text = format!(
        "HTTP/1.1 {status} {}\r\nContent-Type: {kind}\r\nContent-Length: {}\r\nConnection: close\r\nCache-Control: no-store\r\n\
         Content-Security-Policy: {POLICY}\r\nX-Content-Type-Options: nosniff\r\nReferrer-Policy: no-referrer\r\n\
         Cross-Origin-Opener-Policy: same-origin\r\n{saved}\r\n",
        reason(status),
        body.len(),
    );
    // Whoever has left needs no answer.
    let _ = stream.set_write_timeout(Some(Duration::from_secs(20)));
    let _ = stream.write_all(text.as_bytes()).and_then(|()| if head { Ok(()) } else { stream.write_all(body) });
    let _ = stream.flush();
    let _ = stream.shutdown(std::net::Shutdown::Write);
}

/// Says what went wrong.
pub(crate) fn refuse(stream: &mut TcpStream, status: u16) {
    respond(
        stream,
        status,
        "text/plain; charset=utf-8",
        format!("{status} {}\n", reason(status)).as_bytes(),
        None,
        false,
    );
}

#[cfg(test)]
mod tests {
    use super::*;

    fn request(head: &str) -> Request {
        parse(head.as_bytes()).unwrap().unwrap()
    }

    #[test]
    fn only_our_own_pages_under_our_own_names_belong() {
        let known = ["render7.example".to_owned()];
        let says = |host: &str, origin: &str| {
            let origin = if origin.is_empty() { String::new() } else { format!("Origin: {origin}\r\n") };
            belongs(&request(&format!("GET /ws HTTP/1.1\r\nHost: {host}\r\n{origin}\r\n")), &known)
        };
        assert!(says("127.0.0.1:7700", "http://127.0.0.1:7700") && says("localhost:9000", "http://localhost:9000"));
        assert!(says("[::1]:7700", "http://[::1]:7700") && says("localhost", "") && says("Render7.Example:80", ""));
        for (host, origin) in [
            ("evil.example:7700", ""),
            ("localhost.evil.example:7700", ""),
            ("localhost:7700", "http://localhost:3000"),
            ("localhost:7700", "http://evil.example"),
            ("localhost:7700", "null"),
            ("127.0.0.1:7700", "http://localhost:7700"),
            ("", ""),
        ] {
            assert!(!says(host, origin), "{host} {origin}");
        }
        assert!(!belongs(&request("GET / HTTP/1.0\r\n\r\n"), &known));
        let number = request("GET / HTTP/1.1\r\nHost: 10.1.2.3:7700\r\n\r\n");
        assert!(!belongs(&number, &known) && belongs(&number, &[ANY_ADDRESS.to_owned()]));
        let name = request("GET / HTTP/1.1\r\nHost: evil.example:7700\r\n\r\n");
        assert!(!belongs(&name, &[ANY_ADDRESS.to_owned()]));
    }

    #[test]
    fn heads_are_read_with_care() {
        let r =
            request("GET /ws?a=1&token=xyz HTTP/1.1\r\nHost: h\r\nUpgrade: WebSocket\r\nSec-WebSocket-Key: k\r\n\r\n");
        assert_eq!(
            (r.path.as_str(), r.value("token"), r.value("tok"), r.key.as_deref()),
            ("/ws", Some("xyz"), None, Some("k"))
        );
        assert_eq!(parse(b"GET / HTTP/1.1\r\nHost: a\r\nHost: b\r\n\r\n").unwrap_err(), Some(400));
        assert_eq!(parse(b"\x16\x03\x01\x02\x00\x01").unwrap_err(), Some(400));
        assert!(parse(b"GET / HTTP/1.1\r\n").unwrap().is_none());
        assert!(same_secret("abc", "abc") && !same_secret("abc", "abd") && !same_secret("abc", "ab"));
    }
}
