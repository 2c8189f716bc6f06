//! Access control: allowed hosts and origins, tokens, security headers.

use std::net::IpAddr;

use axum::http::header::{
    AUTHORIZATION, CACHE_CONTROL, CONTENT_SECURITY_POLICY, COOKIE, HOST, HeaderMap, HeaderName,
    HeaderValue, ORIGIN, REFERRER_POLICY, SEC_WEBSOCKET_PROTOCOL, SET_COOKIE,
    X_CONTENT_TYPE_OPTIONS,
};

use crate::options::{Origin, split_port};
use crate::token::Token;

/// WebSocket subprotocol that a page requests.
pub(crate) const PROTOCOL: &str = "busbar.2";
/// WebSocket subprotocol prefix of the token, for pages whose browser kept no cookie.
const TOKEN_PROTOCOL: &str = "busbar.token.";
/// Prefixes of the token in a query, and in an `Authorization` header.
const QUERY: &str = "token=";
const BEARER: &str = "Bearer ";

/// Access control of a server.
#[derive(Debug)]
pub(crate) struct Access {
    token: Token,
    allowed: Vec<Origin>,
    /// Browsers keep cookies by host alone: each port has a name of its own.
    cookie_name: String,
}

impl Access {
    pub(crate) fn new(token: Token, allowed: Vec<Origin>, port: u16) -> Self {
        Self { token, allowed, cookie_name: format!("busbar_{port}") }
    }

    /// Reports whether the `Host` header names this server: an address, `localhost` or a host of an
    /// allowed origin. A name that an attacker's DNS leads here (DNS rebinding) fails.
    pub(crate) fn is_host_known(&self, headers: &HeaderMap) -> bool {
        let Some((host, _)) = text(headers, &HOST).and_then(split_port) else { return false };
        let bare = host.trim_start_matches('[').trim_end_matches(']');
        host.eq_ignore_ascii_case("localhost")
            || bare.parse::<IpAddr>().is_ok()
            || self.allowed.iter().any(|origin| origin.host().eq_ignore_ascii_case(host))
    }

    /// Reports whether a page of this server sends the request. Pages behind a proxy need an
    /// allowed origin.
    pub(crate) fn is_origin_known(&self, headers: &HeaderMap) -> bool {
        let Some(origin) = text(headers, &ORIGIN) else { return false };
        let own = text(headers, &HOST).and_then(|host| format!("http://{host}").parse().ok());
        origin
            .parse::<Origin>()
            .is_ok_and(|origin| own.as_ref() == Some(&origin) || self.allowed.contains(&origin))
    }

    /// Reports whether the request has the token: in its query, a cookie or a header.
    pub(crate) fn has_token(&self, query: Option<&str>, headers: &HeaderMap) -> bool {
        let queried =
            query.into_iter().flat_map(|q| q.split('&')).filter_map(|q| q.strip_prefix(QUERY));
        let cookies = texts(headers, &COOKIE).flat_map(|cookies| cookies.split(';'));
        let kept = cookies.filter_map(|cookie| {
            cookie.trim().strip_prefix(self.cookie_name.as_str())?.strip_prefix('=')
        });
        let borne = texts(headers, &AUTHORIZATION).filter_map(|text| text.strip_prefix(BEARER));
        let protocols = texts(headers, &SEC_WEBSOCKET_PROTOCOL).flat_map(|list| list.split(','));
        let listed = protocols.filter_map(|protocol| protocol.trim().strip_prefix(TOKEN_PROTOCOL));
        queried.chain(kept).chain(borne).chain(listed).any(|told| self.token.is(told))
    }

    /// Sets a cookie with the token. In the frame of another site, browsers keep it only for that
    /// site alone (partitioned), over TLS or from this machine.
    pub(crate) fn keep_token(&self, headers: &mut HeaderMap) {
        let (name, token) = (&self.cookie_name, self.token.reveal());
        let where_sent = match self.allowed.is_empty() {
            true => "SameSite=Strict",
            false => "SameSite=None; Secure; Partitioned",
        };
        let cookie = format!("{name}={token}; Path=/; HttpOnly; {where_sent}");
        headers.extend(HeaderValue::try_from(cookie).ok().map(|cookie| (SET_COOKIE, cookie)));
    }

    /// Adds security headers: content security policy, allowed frame ancestors, no caching.
    pub(crate) fn protect(&self, headers: &mut HeaderMap) {
        let frames: String = self.allowed.iter().map(|origin| format!(" {origin}")).collect();
        let policy = format!(
            "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; \
             img-src data:;              base-uri 'none'; form-action 'none'; frame-ancestors 'self'{frames}"
        );
        let fixed: [(HeaderName, &str); 3] = [
            (X_CONTENT_TYPE_OPTIONS, "nosniff"),
            (REFERRER_POLICY, "no-referrer"),
            (CACHE_CONTROL, "no-store"),
        ];
        headers.extend(fixed.map(|(name, value)| (name, HeaderValue::from_static(value))));
        let policy = HeaderValue::try_from(policy).ok();
        headers.extend(policy.map(|policy| (CONTENT_SECURITY_POLICY, policy)));
    }

    /// Origins that may speak to the page, for the page: each needs no escape.
    pub(crate) fn allowed(&self) -> String {
        self.allowed.iter().map(Origin::as_str).collect::<Vec<_>>().join(" ")
    }
}

fn text<'a>(headers: &'a HeaderMap, name: &HeaderName) -> Option<&'a str> {
    headers.get(name)?.to_str().ok()
}

fn texts<'a>(headers: &'a HeaderMap, name: &HeaderName) -> impl Iterator<Item = &'a str> {
    headers.get_all(name).iter().filter_map(|value| value.to_str().ok())
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECRET: &str = "0123456789abcdef";

    fn access(allowed: &[&str]) -> Access {
        let allowed = allowed.iter().map(|origin| origin.parse().unwrap()).collect();
        Access::new(Token::parse(SECRET).unwrap(), allowed, 8080)
    }

    fn headers(pairs: &[(HeaderName, &str)]) -> HeaderMap {
        pairs.iter().map(|(name, value)| (name.clone(), value.parse().unwrap())).collect()
    }

    #[test]
    fn a_name_of_somebody_elses_dns_is_no_host_of_ours() {
        let access = access(&["https://hmi.example"]);
        let known = |host: &str| access.is_host_known(&headers(&[(HOST, host)]));
        for host in ["127.0.0.1:8080", "localhost:8080", "[::1]:8080", "10.0.0.5", "HMI.example"] {
            assert!(known(host), "{host}");
        }
        for host in ["evil.example:8080", "", "127.0.0.1.evil.example", "localhost.evil", ":80"] {
            assert!(!known(host), "{host}");
        }
        assert!(!access.is_host_known(&HeaderMap::new()));
    }

    #[test]
    fn pages_of_others_open_no_socket() {
        let access = access(&["https://hmi.example"]);
        let known = |origin: &str| {
            access.is_origin_known(&headers(&[(HOST, "127.0.0.1:8080"), (ORIGIN, origin)]))
        };
        assert!(known("http://127.0.0.1:8080"));
        assert!(known("https://hmi.example"));
        for origin in
            ["http://127.0.0.1:8081", "https://127.0.0.1:8080", "null", "http://evil.example"]
        {
            assert!(!known(origin), "{origin}");
        }
        assert!(!access.is_origin_known(&headers(&[(HOST, "127.0.0.1:8080")])));
    }

    #[test]
    fn the_token_is_found_where_it_may_be_and_nowhere_else() {
        let access = access(&[]);
        let queried = |query: &str| access.has_token(Some(query), &HeaderMap::new());
        let headed = |name, text: &str| access.has_token(None, &headers(&[(name, text)]));
        assert!(queried(&format!("a=b&token={SECRET}")));
        assert!(headed(COOKIE, &format!("x=y; busbar_8080={SECRET}")));
        assert!(headed(AUTHORIZATION, &format!("Bearer {SECRET}")));
        let protocols = format!("{PROTOCOL}, {TOKEN_PROTOCOL}{SECRET}");
        assert!(headed(SEC_WEBSOCKET_PROTOCOL, &protocols));
        for query in ["", "token=", "token=0123456789abcdeX", &format!("xtoken={SECRET}")] {
            assert!(!queried(query), "{query}");
        }
        assert!(!headed(COOKIE, &format!("busbar_8081={SECRET}")), "that of another port");
    }

    #[test]
    fn frames_of_others_are_refused_by_the_browser() {
        let policy = |allowed: &[&str]| {
            let mut headers = HeaderMap::new();
            access(allowed).protect(&mut headers);
            headers[CONTENT_SECURITY_POLICY].to_str().unwrap().to_owned()
        };
        assert!(policy(&[]).ends_with("frame-ancestors 'self'"));
        assert!(
            policy(&["https://a.example", "http://b:1"])
                .ends_with("frame-ancestors 'self' https://a.example http://b:1")
        );
    }
}
