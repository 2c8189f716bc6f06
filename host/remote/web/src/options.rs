//! Options of the server: content, address, access.

use std::ffi::OsString;
use std::fmt;
use std::net::SocketAddr;
use std::str::FromStr;

use crate::token::Token;

/// Pages that look at one view at most; each costs a picture and its own encoding.
pub const MAX_CLIENTS: usize = 16;

/// Options of the server: content, address, access.
#[derive(Clone, Debug)]
pub struct Options {
    /// Path of the program `busbar`.
    pub program: OsString,
    /// Path of the configuration, absolute.
    pub config: String,
    /// Address and port to listen at.
    pub listen: SocketAddr,
    /// Reports whether other machines may connect, though nothing here is encrypted.
    pub insecure_remote: bool,
    /// Token that grants access to the view.
    pub token: Token,
    /// Pages of these origins may embed the view, and speak to it.
    pub allowed_origins: Vec<Origin>,
    /// Pages that look at the same time, at most [`MAX_CLIENTS`].
    pub max_clients: usize,
    /// Reports whether Busbar's own panels are shown beside the scene.
    pub panels: bool,
    /// Operator who acts on alarms, for the audit log; may be empty.
    pub operator: String,
}

/// An origin of the web (RFC 6454): scheme, host and port, as browsers write it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Origin {
    text: String,
    /// Byte range of the host within the text.
    host: (usize, usize),
}

/// Text that is no origin.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("write it as browsers do, such as https://hmi.example or http://10.0.0.5:8080")]
pub struct OriginError;

impl Origin {
    /// Returns the host, without the port.
    pub(crate) fn host(&self) -> &str {
        &self.text[self.host.0..self.host.1]
    }

    /// Returns the origin in the form of browsers.
    pub(crate) fn as_str(&self) -> &str {
        &self.text
    }
}

impl FromStr for Origin {
    type Err = OriginError;

    /// Only what needs no escape in headers and pages gets through.
    fn from_str(text: &str) -> Result<Self, OriginError> {
        let text = text.to_ascii_lowercase();
        let (scheme, rest) = text.split_once("://").ok_or(OriginError)?;
        let usual = match scheme {
            "http" => ":80",
            "https" => ":443",
            _ => return Err(OriginError),
        };
        let rest = rest.strip_suffix('/').unwrap_or(rest);
        let rest = rest.strip_suffix(usual).unwrap_or(rest);
        let (host, port) = split_port(rest).ok_or(OriginError)?;
        if port.is_some_and(|port| port.parse::<u16>().is_err()) || !is_host(host) {
            return Err(OriginError);
        }
        let begin = scheme.len() + "://".len();
        Ok(Self { text: format!("{scheme}://{rest}"), host: (begin, begin + host.len()) })
    }
}

impl fmt::Display for Origin {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

/// Host and port of an authority; an address of IPv6 is in brackets.
pub(crate) fn split_port(authority: &str) -> Option<(&str, Option<&str>)> {
    let colon =
        authority.rfind(':').filter(|colon| authority.rfind(']').is_none_or(|b| b < *colon));
    Some(match colon {
        Some(colon) => (&authority[..colon], Some(&authority[colon + 1..])),
        None => (authority, None),
    })
    .filter(|(host, _)| !host.is_empty())
}

fn is_host(host: &str) -> bool {
    match host.strip_prefix('[') {
        Some(rest) => {
            rest.strip_suffix(']').is_some_and(|ip| ip.parse::<std::net::Ipv6Addr>().is_ok())
        }
        None => host.bytes().all(|byte| byte.is_ascii_alphanumeric() || b"-.".contains(&byte)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn origins_are_written_as_browsers_do() {
        for (text, origin, host) in [
            ("https://HMI.example/", "https://hmi.example", "hmi.example"),
            ("https://hmi.example:443", "https://hmi.example", "hmi.example"),
            ("http://10.0.0.5:8080", "http://10.0.0.5:8080", "10.0.0.5"),
            ("http://[::1]:80", "http://[::1]", "[::1]"),
            ("http://[::1]:81", "http://[::1]:81", "[::1]"),
        ] {
            let parsed: Origin = text.parse().unwrap();
            assert_eq!((parsed.as_str(), parsed.host()), (origin, host));
        }
    }

    #[test]
    fn what_is_no_origin_is_refused() {
        for text in [
            "",
            "hmi.example",
            "ftp://hmi.example",
            "https://",
            "https://a/b",
            "https://a b",
            "https://a;b",
            "https://*",
            "https://a:99999",
            "https://a:",
            "https://'\"<",
            "null",
            "https://u@a",
            "http://[::1",
            "http://[x]",
        ] {
            assert!(text.parse::<Origin>().is_err(), "{text}");
        }
    }
}
