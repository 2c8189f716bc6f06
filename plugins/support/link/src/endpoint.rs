//! Endpoint of a device: host and port.

use std::fmt;

use crate::SettingsFaults;

/// Longest host name (RFC 1035, 2.3.4), bytes.
pub const MAX_HOST_BYTES: usize = 253;

/// Host and port of a device. Displayed as `host:port`, an IPv6 address in brackets.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Endpoint {
    /// Host name or IP address.
    pub host: String,
    /// Port of TCP, not 0.
    pub port: u16,
}

impl Endpoint {
    /// Checks settings; `place` comes before the names in faults, such as
    /// `redundancy[0].`.
    pub fn parse(place: &str, host: &str, port: u16, faults: &mut SettingsFaults) -> Self {
        let host = host.trim().to_owned();
        if host.is_empty() || host.len() > MAX_HOST_BYTES {
            faults.add(format!(
                "{place}host: give a name or an address of 1 to {MAX_HOST_BYTES} bytes"
            ));
        }
        Self { host, port: faults.check(&format!("{place}port"), port, 1..=u16::MAX) }
    }
}

impl fmt::Display for Endpoint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { host, port } = self;
        if host.contains(':') { write!(f, "[{host}]:{port}") } else { write!(f, "{host}:{port}") }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_address_of_version_6_has_brackets() {
        let mut faults = SettingsFaults::default();
        let endpoint = Endpoint::parse("", " ::1 ", 502, &mut faults);
        assert_eq!(endpoint.to_string(), "[::1]:502");
        assert_eq!(faults, SettingsFaults::default());
    }

    #[test]
    fn faults_name_their_place() {
        let mut faults = SettingsFaults::default();
        Endpoint::parse("redundancy[1].", " ", 0, &mut faults);
        let text = faults.into_result().unwrap_err();
        assert!(text.starts_with("redundancy[1].host: give a name"), "{text}");
        assert!(text.contains("; redundancy[1].port: 0 is not within"), "{text}");
    }
}
