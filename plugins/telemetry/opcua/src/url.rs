//! `opc.tcp://host:port/path` (OPC 10000-6, 7.2).

use std::fmt;

use busbar_link::{Endpoint, SettingsFaults};

/// Port of a server whose URL names none (IANA: opcua-tcp).
const DEFAULT_PORT: u16 = 4840;
const SCHEME: &str = "opc.tcp://";
/// Longest URL that is accepted, bytes.
const MAX_URL_BYTES: usize = 1024;

/// URL of a server that listens for OPC UA over TCP.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Url {
    pub(crate) endpoint: Endpoint,
    /// Text of the URL as it is sent to servers.
    pub(crate) text: String,
}

impl Url {
    /// Parses a URL of OPC UA over TCP.
    ///
    /// # Errors
    /// The fault of the text, and the right format.
    pub(crate) fn parse(text: &str) -> Result<Self, String> {
        let fault = |what: &str| Err(format!("'{text}' {what}: write opc.tcp://host:port/path"));
        if text.len() > MAX_URL_BYTES || text.contains(|c: char| c.is_control() || c == ' ') {
            return Err(format!("a URL has at most {MAX_URL_BYTES} bytes and no blanks"));
        }
        let Some(rest) = text.strip_prefix(SCHEME) else {
            return fault("is no URL of OPC UA over TCP");
        };
        let (authority, path) = rest.split_at(rest.find(['/', '?']).unwrap_or(rest.len()));
        let (host, port) = if let Some(rest) = authority.strip_prefix('[') {
            let Some((host, port)) = rest.split_once(']') else {
                return fault("has an address without its closing bracket");
            };
            (host, port.strip_prefix(':'))
        } else {
            match authority.split_once(':') {
                Some((host, port)) => (host, Some(port)),
                None => (authority, None),
            }
        };
        let port = match port.map(str::parse) {
            None => DEFAULT_PORT,
            Some(Ok(port)) => port,
            Some(Err(_)) => return fault("has no port from 1 to 65535"),
        };
        let mut faults = SettingsFaults::default();
        let endpoint = Endpoint::parse("", host, port, &mut faults);
        faults.into_result()?;
        let text = format!("{SCHEME}{endpoint}{path}");
        Ok(Self { endpoint, text })
    }
}

impl fmt::Display for Url {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn host_port_and_path_are_read() {
        for (text, shown) in [
            ("opc.tcp://plc", "opc.tcp://plc:4840"),
            ("opc.tcp://plc:4841/a/b", "opc.tcp://plc:4841/a/b"),
            ("opc.tcp://[::1]:1/x", "opc.tcp://[::1]:1/x"),
            ("opc.tcp://[::1]", "opc.tcp://[::1]:4840"),
        ] {
            assert_eq!(Url::parse(text).unwrap().to_string(), shown);
        }
    }

    #[test]
    fn faults_say_how_it_is_written() {
        for (text, fault) in [
            ("http://plc", "is no URL of OPC UA over TCP"),
            ("opc.tcp://plc:x", "no port from 1 to 65535"),
            ("opc.tcp://plc:70000", "no port from 1 to 65535"),
            ("opc.tcp://plc:0", "port: 0 is not within 1 to 65535"),
            ("opc.tcp://", "host: give a name"),
            ("opc.tcp://[::1", "closing bracket"),
            ("opc.tcp://a b", "no blanks"),
        ] {
            let found = Url::parse(text).unwrap_err();
            assert!(found.contains(fault), "{text}: {found}");
        }
    }
}
