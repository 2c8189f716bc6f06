//! Mail by SMTP (RFC 5321), one connection a message.

use std::io;
use std::net::SocketAddr;
use std::pin::Pin;
use std::task::{Context, Poll};
use std::time::Duration;

use busbar_link::{TlsClient, describe_io_error};
use busbar_plugin_sdk::Error;
use lettre::address::Envelope;
use lettre::message::header::{ContentType, HeaderName, HeaderValue};
use lettre::message::{Mailbox, MessageBuilder};
use lettre::transport::smtp::Error as SmtpError;
use lettre::transport::smtp::authentication::{Credentials, Mechanism};
use lettre::transport::smtp::client::{
    AsyncSmtpConnection, AsyncTokioStream, Certificate, CertificateStore, Identity, TlsParameters,
};
use lettre::transport::smtp::commands::{Data, Mail, Rcpt};
use lettre::transport::smtp::extension::ClientId;
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::net::TcpStream;
use tokio::time::timeout;

use crate::dispatcher::Message;
use crate::outcome::{Outcome, shown};
use crate::settings::{MailConfig, Security};

/// Bytes that a server may send over one connection: replies are some hundred.
const MAX_REPLY_BYTES: usize = 256 << 10;

/// Sender of mail through one server.
pub(crate) struct MailSender {
    config: MailConfig,
    /// TLS from the first byte.
    tls: Option<TlsClient>,
    /// TLS parameters after the command STARTTLS.
    starttls: Option<TlsParameters>,
    limit: Duration,
}

impl MailSender {
    /// Loads the certificates of the settings.
    ///
    /// # Errors
    /// [`Error::settings`] with the file at fault.
    pub(crate) fn new(config: &MailConfig, limit: Duration) -> Result<Self, Error> {
        let fault = |words: String| Error::settings(format!("mail.{words}"));
        let (mut tls, mut starttls) = (None, None);
        if let Some(files) = &config.tls {
            // Also for STARTTLS: its files are checked the same way.
            let client = TlsClient::load(files, [&config.endpoint])
                .map_err(|error| fault(error.to_string()))?;
            match config.security {
                Security::Starttls => {
                    let parameters = starttls_parameters(config);
                    starttls = Some(parameters.map_err(|words| fault(format!("tls: {words}")))?);
                }
                Security::Tls => tls = Some(client),
                Security::None => {}
            }
        }
        Ok(Self { config: config.clone(), tls, starttls, limit })
    }

    /// Hands over a message to one address, within the limit.
    pub(crate) async fn send(&self, message: &Message, address: &str) -> Outcome {
        let server = &self.config.endpoint;
        let outcome = timeout(self.limit, self.try_send(message, address)).await;
        match outcome {
            Ok(Ok(())) => Outcome::Delivered,
            Ok(Err(Fault::Refused(words))) => {
                Outcome::Refused(format!("mail server {server}: {words}"))
            }
            Ok(Err(Fault::Failed(words))) => {
                Outcome::Failed(format!("mail server {server}: {words}"))
            }
            Err(_) => Outcome::Failed(format!(
                "mail server {server}: it has not taken the message within {} s; is it a mail \
                 server, and does \"security\" fit its port?",
                self.limit.as_secs()
            )),
        }
    }

    async fn try_send(&self, message: &Message, address: &str) -> Result<(), Fault> {
        let to =
            address.parse().map_err(|_| Fault::Refused(format!("'{address}' is no address")))?;
        let from = &self.config.from;
        let mail = compose(from, &Mailbox::new(None, to), message)
            .map_err(|words| Fault::Refused(format!("the message cannot be composed: {words}")))?;
        let envelope: &Envelope = mail.envelope();
        let mut connection = self.connect().await?;
        if let Some((username, password)) = &self.config.login {
            let read = |secret: &busbar_plugin_sdk::Secret| {
                secret.read().map_err(|error| Fault::Failed(error.message().to_owned()))
            };
            let (username, password) = (read(username)?, read(password)?);
            let credentials =
                Credentials::new(username.reveal().to_owned(), password.reveal().to_owned());
            let mechanisms = [Mechanism::Plain, Mechanism::Login];
            connection
                .auth(&mechanisms, &credentials)
                .await
                .map_err(|error| later("it refuses the login", "check \"mail.login\"", &error))?;
        }
        let sender = Mail::new(envelope.from().cloned(), Vec::new());
        connection.command(sender).await.map_err(|error| {
            later(
                "it refuses the sender",
                "check \"mail.from\", and whether it needs a login",
                &error,
            )
        })?;
        for to in envelope.to() {
            connection.command(Rcpt::new(to.clone(), Vec::new())).await.map_err(|error| {
                by_code(
                    &format!("it refuses the recipient {to}"),
                    "correct the address in \"recipients\"",
                    &error,
                )
            })?;
        }
        let data = "ask its administrator";
        connection
            .command(Data)
            .await
            .map_err(|error| by_code("it refuses the message", data, &error))?;
        let done = connection.message(&mail.formatted()).await;
        done.map_err(|error| by_code("it refuses the message", data, &error))?;
        // The message is taken: an error in parting changes nothing.
        let _ = connection.quit().await;
        Ok(())
    }

    async fn connect(&self) -> Result<AsyncSmtpConnection, Fault> {
        let server = &self.config.endpoint;
        let failed = |words: String| Fault::Failed(words);
        let connecting = "check \"mail.host\" and \"mail.port\"";
        let stream = TcpStream::connect((&*server.host, server.port))
            .await
            .map_err(|error| failed(format!("{}; {connecting}", describe_io_error(&error))))?;
        let peer = stream.peer_addr().map_err(|error| failed(describe_io_error(&error)))?;
        let hello = client_id();
        let trust = "check \"mail.tls\" and \"mail.security\"";
        let stream: Box<dyn AsyncTokioStream> = match &self.tls {
            Some(tls) => {
                let stream = tls.handshake(server, stream).await;
                let stream = stream.map_err(|error| failed(format!("{error}; {trust}")))?;
                Box::new(LimitedStream { stream, peer, left: MAX_REPLY_BYTES })
            }
            None => Box::new(LimitedStream { stream, peer, left: MAX_REPLY_BYTES }),
        };
        let greeting = "is it a mail server, and does \"security\" fit its port?";
        let mut connection = AsyncSmtpConnection::connect_with_transport(stream, &hello)
            .await
            .map_err(|error| later("it does not greet as a mail server", greeting, &error))?;
        if let Some(parameters) = &self.starttls {
            if !connection.can_starttls() {
                return Err(failed(
                    "it offers no STARTTLS; make \"security\" \"tls\", or ask its \
                                   administrator"
                        .to_owned(),
                ));
            }
            connection
                .starttls(parameters.clone(), &hello)
                .await
                .map_err(|error| later("no secure connection", trust, &error))?;
        }
        Ok(connection)
    }
}

/// Fault of a try.
enum Fault {
    Refused(String),
    Failed(String),
}

/// Returns a fault after which another try may succeed.
fn later(what: &str, remedy: &str, error: &SmtpError) -> Fault {
    Fault::Failed(format!("{what}: {}; {remedy}", shown(&error.to_string())))
}

/// Returns a fault that is final where the server says so (RFC 5321, 4.2.1).
fn by_code(what: &str, remedy: &str, error: &SmtpError) -> Fault {
    let words = format!("{what}: {}; {remedy}", shown(&error.to_string()));
    if error.is_permanent() { Fault::Refused(words) } else { Fault::Failed(words) }
}

/// Composes the mail of a message to one address.
fn compose(from: &Mailbox, to: &Mailbox, message: &Message) -> Result<lettre::Message, String> {
    let header = |name: &'static str, value: &str| {
        HeaderValue::new(HeaderName::new_from_ascii_str(name), value.to_owned())
    };
    let builder: MessageBuilder = lettre::Message::builder()
        .from(from.clone())
        .to(to.clone())
        .subject(&message.subject)
        .message_id(Some(format!("<{}@{}>", message.key, from.email.domain())))
        .date_now()
        // No reply of an absent person comes back (RFC 3834, 5).
        .raw_header(header("Auto-Submitted", "auto-generated"))
        .raw_header(header("X-Busbar-Kind", &message.kind));
    let mail = builder.header(ContentType::TEXT_PLAIN).body(message.text.clone());
    mail.map_err(|error| error.to_string())
}

/// Returns the name of this machine for the server's greeting.
fn client_id() -> ClientId {
    let name = rustix::system::uname().nodename().to_string_lossy().into_owned();
    let is_name = !name.is_empty()
        && name.bytes().all(|byte| byte.is_ascii_alphanumeric() || b"-.".contains(&byte));
    if is_name { ClientId::Domain(name) } else { ClientId::default() }
}

fn starttls_parameters(config: &MailConfig) -> Result<TlsParameters, String> {
    let Some(files) = &config.tls else { return Err("it is missing".to_owned()) };
    let name = files.server_name().unwrap_or(&config.endpoint.host);
    let read = |path: &std::path::Path| {
        std::fs::read(path).map_err(|error| format!("'{}': {error}", path.display()))
    };
    let words = |error: SmtpError| error.to_string();
    let mut builder = TlsParameters::builder(name.to_owned())
        .certificate_store(CertificateStore::None)
        .add_root_certificate(Certificate::from_pem(&read(files.ca())?).map_err(words)?);
    if let Some((certificate, key)) = files.own() {
        let identity = Identity::from_pem(&read(certificate)?, &read(key)?).map_err(words)?;
        builder = builder.identify_with(identity);
    }
    builder.build_rustls().map_err(words)
}

/// Stream that brings a bounded number of bytes, so that a server that never ends its line takes
/// no memory.
#[derive(Debug)]
struct LimitedStream<S> {
    stream: S,
    peer: SocketAddr,
    left: usize,
}

impl<S: AsyncRead + Unpin> AsyncRead for LimitedStream<S> {
    fn poll_read(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        let before = buffer.filled().len();
        let read = Pin::new(&mut self.stream).poll_read(context, buffer);
        let count = buffer.filled().len() - before;
        match self.left.checked_sub(count) {
            Some(left) => self.left = left,
            None => {
                let words = format!("it sends more than {MAX_REPLY_BYTES} bytes");
                return Poll::Ready(Err(io::Error::other(words)));
            }
        }
        read
    }
}

impl<S: AsyncWrite + Unpin> AsyncWrite for LimitedStream<S> {
    fn poll_write(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        bytes: &[u8],
    ) -> Poll<io::Result<usize>> {
        Pin::new(&mut self.stream).poll_write(context, bytes)
    }

    fn poll_flush(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_flush(context)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_shutdown(context)
    }
}

impl<S> AsyncTokioStream for LimitedStream<S>
where
    S: AsyncRead + AsyncWrite + Send + Sync + Unpin + std::fmt::Debug,
{
    fn peer_addr(&self) -> io::Result<SocketAddr> {
        Ok(self.peer)
    }
}
