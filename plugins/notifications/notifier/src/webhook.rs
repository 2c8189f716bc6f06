//! Webhooks: messages posted as JSON over HTTP/1.1.

use std::time::Duration;

use busbar_link::{Dial, Endpoint, SettingsFaults, TcpDial, TlsClient};
use busbar_plugin_sdk::{AlarmNotification, Error};
use bytes::Bytes;
use http_body_util::Full;
use hyper::client::conn::http1;
use hyper::header::{AUTHORIZATION, CONNECTION, CONTENT_TYPE, HOST, LOCATION, USER_AGENT};
use hyper::{Request, StatusCode, Uri};
use hyper_util::rt::TokioIo;
use serde::Serialize;
use tokio::time::timeout;

use crate::dispatcher::Message;
use crate::outcome::{Outcome, shown};
use crate::settings::{MAX_URL_BYTES, UrlSource, WebhookConfig};

/// Headers of an answer, and bytes of them.
const MAX_HEADERS: usize = 64;
const MAX_HEADER_BYTES: usize = 64 << 10;
/// Name of this client in requests.
const AGENT: &str = concat!("busbar-notifier/", env!("CARGO_PKG_VERSION"));

/// URL of a webhook in parts.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct ParsedUrl {
    pub(crate) endpoint: Endpoint,
    pub(crate) is_encrypted: bool,
    /// Host and port as the `Host` header has them.
    authority: String,
    /// Path and query; may be a credential.
    target: String,
}

/// Sender to one webhook.
pub(crate) struct WebhookSender {
    name: String,
    config: WebhookConfig,
    limit: Duration,
}

/// Body of a request.
#[derive(Serialize)]
struct Body<'a> {
    id: &'a str,
    kind: &'a str,
    recipient: &'a str,
    subject: &'a str,
    text: &'a str,
    /// Origins of the alarms that are not live.
    not_live: Vec<&'static str>,
    alarms: &'a [AlarmNotification],
}

/// Parses the URL of a webhook.
///
/// # Errors
/// In words that do not repeat the URL, which may be a credential.
pub(crate) fn parse_url(text: &str) -> Result<ParsedUrl, String> {
    let fault = || "give a URL such as https://example.com/alarms".to_owned();
    if text.len() > MAX_URL_BYTES {
        return Err(format!("it has more than {MAX_URL_BYTES} bytes"));
    }
    let uri: Uri = text.parse().map_err(|_| fault())?;
    let is_encrypted = match uri.scheme_str() {
        Some("https") => true,
        Some("http") => false,
        _ => return Err(fault()),
    };
    let authority = uri.authority().ok_or_else(fault)?;
    if authority.as_str().contains('@') {
        return Err(
            "a name or password is not written here: use \"token\" or \"secret_url\"".to_owned()
        );
    }
    let port = authority.port_u16().unwrap_or(if is_encrypted { 443 } else { 80 });
    let mut faults = SettingsFaults::default();
    let host = authority.host().trim_start_matches('[').trim_end_matches(']');
    let endpoint = Endpoint::parse("", host, port, &mut faults);
    faults.into_result()?;
    let target = uri.path_and_query().map_or("/", |target| target.as_str()).to_owned();
    Ok(ParsedUrl { endpoint, is_encrypted, authority: authority.as_str().to_owned(), target })
}

impl WebhookSender {
    /// Creates a sender. Certificates are loaded at each message: a URL by reference may change.
    ///
    /// # Errors
    /// [`Error::settings`] with the file at fault.
    pub(crate) fn new(name: &str, config: &WebhookConfig, limit: Duration) -> Result<Self, Error> {
        if let Some(files) = &config.tls {
            TlsClient::load(files, [])
                .map_err(|error| Error::settings(format!("webhooks.{name}.{error}")))?;
        }
        Ok(Self { name: name.to_owned(), config: config.clone(), limit })
    }

    /// Posts a message, within the limit.
    pub(crate) async fn send(&self, message: &Message) -> Outcome {
        let name = &self.name;
        match timeout(self.limit, self.try_send(message)).await {
            Ok(Outcome::Failed(words)) => Outcome::Failed(format!("webhook {name}: {words}")),
            Ok(Outcome::Refused(words)) => Outcome::Refused(format!("webhook {name}: {words}")),
            Ok(Outcome::Delivered) => Outcome::Delivered,
            Err(_) => Outcome::Failed(format!(
                "webhook {name}: no answer within {} s; is it a web server, and does the URL's \
                 scheme fit its port?",
                self.limit.as_secs()
            )),
        }
    }

    async fn try_send(&self, message: &Message) -> Outcome {
        self.post(message).await.unwrap_or_else(Outcome::Failed)
    }

    async fn post(&self, message: &Message) -> Result<Outcome, String> {
        let url = match &self.config.url {
            UrlSource::Text(text) => text.clone(),
            UrlSource::Secret(secret) => {
                secret.read().map_err(|error| error.message().to_owned())?.reveal().to_owned()
            }
        };
        let ParsedUrl { endpoint, is_encrypted, authority, target } = parse_url(&url)?;
        let tls = match (&self.config.tls, is_encrypted) {
            (Some(files), true) => {
                Some(TlsClient::load(files, [&endpoint]).map_err(|error| error.to_string())?)
            }
            (None, true) => return Err("https needs trusted authorities; add \"tls\"".to_owned()),
            (_, false) => None,
        };
        let check = "check \"url\" and \"tls\"";
        let dial = TcpDial { tls };
        let stream = dial.dial(&endpoint, self.limit).await;
        let stream = stream.map_err(|error| format!("{endpoint}: {error}; {check}"))?;
        let not_http = |error: hyper::Error| {
            format!(
                "{endpoint}: {}; is it a web server, and does the URL's scheme fit its port?",
                shown(&error.to_string())
            )
        };
        let (mut sender, connection) = http1::Builder::new()
            .max_headers(MAX_HEADERS)
            .max_buf_size(MAX_HEADER_BYTES)
            .handshake(TokioIo::new(stream))
            .await
            .map_err(not_http)?;
        let driver = tokio::task::spawn_local(connection);
        let answer = sender.send_request(self.request(&authority, &target, message)?).await;
        // The body of an answer says nothing that is needed.
        driver.abort();
        let answer = answer.map_err(not_http)?;
        let location = answer.headers().get(LOCATION).and_then(|location| location.to_str().ok());
        Ok(judge(answer.status(), &endpoint, location))
    }

    fn request(
        &self,
        authority: &str,
        target: &str,
        message: &Message,
    ) -> Result<Request<Full<Bytes>>, String> {
        let mut not_live: Vec<_> =
            message.alarms.iter().flat_map(|alarm| &alarm.origin).copied().collect();
        not_live.sort_unstable();
        not_live.dedup();
        let body = Body {
            id: &message.key,
            kind: &message.kind,
            recipient: &message.recipient,
            subject: &message.subject,
            text: &message.text,
            not_live: not_live.into_iter().map(|origin| origin.name()).collect(),
            alarms: &message.alarms,
        };
        let body = serde_json::to_vec(&body).map_err(|error| error.to_string())?;
        let mut request = Request::post(target)
            .header(HOST, authority)
            .header(CONTENT_TYPE, "application/json")
            .header(USER_AGENT, AGENT)
            .header(CONNECTION, "close")
            .header("idempotency-key", &message.key);
        if let Some(token) = &self.config.token {
            let token = token.read().map_err(|error| error.message().to_owned())?;
            let mut value =
                hyper::header::HeaderValue::from_str(&format!("Bearer {}", token.reveal()))
                    .map_err(|_| "the token has characters that a header cannot have".to_owned())?;
            value.set_sensitive(true);
            request = request.header(AUTHORIZATION, value);
        }
        request.body(Full::new(Bytes::from(body))).map_err(|error| error.to_string())
    }
}

/// Judges an answer by its status (RFC 9110, 15). What a mended setting can change is tried again.
fn judge(status: StatusCode, endpoint: &Endpoint, location: Option<&str>) -> Outcome {
    let words = |what: &str| format!("{endpoint} answers {status}; {what}");
    match status.as_u16() {
        200..=299 => Outcome::Delivered,
        300..=399 => {
            let place =
                location.and_then(|to| parse_url(to).ok()).map(|to| to.endpoint.to_string());
            let to = place.map(|place| format!(" at {place}")).unwrap_or_default();
            Outcome::Failed(words(&format!("redirects are not followed: write the new URL{to}")))
        }
        401 | 403 | 407 => Outcome::Failed(words("check \"token\" or \"secret_url\"")),
        404 | 405 => Outcome::Failed(words("check the path of the URL")),
        408 | 425 | 429 => Outcome::Failed(words("it is tried again later")),
        400..=499 => Outcome::Refused(words("it does not take messages of this form")),
        _ => Outcome::Failed(words("its administrator must look; it is tried again")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn urls_are_parsed_and_never_repeated_in_faults() {
        let url = parse_url("https://hooks.example.com/T0/secret?x=1").unwrap();
        assert_eq!(
            (url.endpoint.to_string().as_str(), url.is_encrypted),
            ("hooks.example.com:443", true)
        );
        assert_eq!(
            (url.authority.as_str(), url.target.as_str()),
            ("hooks.example.com", "/T0/secret?x=1")
        );
        assert_eq!(parse_url("http://[::1]:8080").unwrap().endpoint.to_string(), "[::1]:8080");
        for wrong in ["ftp://secret.example", "/secret", "https://", "https://u:secret@a.b/"] {
            assert!(!parse_url(wrong).unwrap_err().contains("secret."), "{wrong}");
        }
    }

    #[test]
    fn answers_are_judged_by_what_can_be_done() {
        let endpoint = Endpoint { host: "h".into(), port: 80 };
        let judged = |code: u16| judge(StatusCode::from_u16(code).unwrap(), &endpoint, None);
        assert_eq!(judged(204), Outcome::Delivered);
        assert!(matches!(judged(422), Outcome::Refused(_)));
        for later in [301, 401, 404, 429, 500, 503] {
            assert!(matches!(judged(later), Outcome::Failed(_)), "{later}");
        }
    }
}
