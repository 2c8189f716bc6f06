//! A server as pages meet it: by HTTP and by WebSocket, byte for byte.
#![allow(dead_code)]

use std::collections::HashMap;
use std::io::{Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::time::{Duration, Instant};

use busbar_web::{Options, Server, Token};
use e2e::{Scene, built, built_folder};
use futures_util::{SinkExt, StreamExt};
use serde_json::{Value, json};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpListener;
use tokio_tungstenite::tungstenite::client::IntoClientRequest;
use tokio_tungstenite::tungstenite::handshake::client::Request;
use tokio_tungstenite::tungstenite::{Error, Message};
use tokio_tungstenite::{WebSocketStream, client_async};

pub(crate) const SECRET: &str = "0123456789abcdef0123456789abcdef";
/// The longest that anything is waited for: this machine may be busy.
pub(crate) const PATIENCE: Duration = Duration::from_secs(60);
const PROTOCOL: &str = "busbar.2";

/// Options of a server without a viewer: what refuses needs none.
pub(crate) fn bare() -> Options {
    Options {
        program: "/no/such/program".into(),
        config: "/no/such/scene.json".into(),
        listen: "127.0.0.1:0".parse().expect("an address"),
        insecure_remote: false,
        token: Token::parse(SECRET).expect("it is long enough"),
        allowed_origins: Vec::new(),
        max_clients: 2,
        panels: false,
        operator: String::new(),
    }
}

/// Options of a server that shows a scene.
pub(crate) fn showing(scene: &Scene) -> Options {
    let path = |path: std::path::PathBuf| path.into_os_string();
    Options {
        program: path(built(built_folder().join("busbar"))),
        config: path(scene.write()).into_string().expect("UTF-8"),
        ..bare()
    }
}

pub(crate) fn start(options: &Options) -> Server {
    Server::start(options).expect("it starts")
}

/// Response of an HTTP request.
#[derive(Debug)]
pub(crate) struct Answer {
    pub(crate) status: u16,
    pub(crate) headers: HashMap<String, String>,
    pub(crate) body: String,
}

/// Asks for a path with these headers; `Host` is the server's own where none is given.
pub(crate) fn ask(server: &Server, path: &str, headers: &[(&str, &str)]) -> Answer {
    ask_by("GET", server, path, headers)
}

pub(crate) fn ask_by(
    method: &str,
    server: &Server,
    path: &str,
    headers: &[(&str, &str)],
) -> Answer {
    let mut text = format!("{method} {path} HTTP/1.1\r\n");
    if !headers.iter().any(|(name, _)| *name == "Host") {
        text += &format!("Host: {}\r\n", server.address());
    }
    headers.iter().for_each(|(name, value)| text += &format!("{name}: {value}\r\n"));
    let answer = send(server, &(text + "\r\n"));
    let (head, body) = answer.split_once("\r\n\r\n").expect("an answer has a head");
    let mut lines = head.lines();
    let status = lines.next().and_then(|line| line.split(' ').nth(1)?.parse().ok());
    let header = |line: &str| {
        let (name, value) = line.split_once(": ")?;
        Some((name.to_lowercase(), value.to_owned()))
    };
    Answer {
        status: status.expect("a status"),
        headers: lines.filter_map(header).collect(),
        body: body.to_owned(),
    }
}

/// Sends bytes as they are; all that comes until the server closes.
pub(crate) fn send(server: &Server, text: &str) -> String {
    let mut stream = TcpStream::connect(server.address()).expect("it listens");
    stream.set_read_timeout(Some(PATIENCE)).expect("it is a socket");
    stream.write_all(text.as_bytes()).expect("it reads");
    let mut answer = Vec::new();
    // A reset is an end, too.
    let _ = stream.read_to_end(&mut answer);
    String::from_utf8_lossy(&answer).into_owned()
}

/// A page, without its browser.
pub(crate) struct Page {
    socket: WebSocketStream<tokio::net::TcpStream>,
    pub(crate) size: [u32; 2],
    /// Red, green and blue, as shown.
    pub(crate) pixels: Vec<u8>,
    /// Number of the last picture, and count of those received.
    pub(crate) number: u32,
    pub(crate) pictures: usize,
    pub(crate) kinds: Vec<u8>,
    /// Bytes received so far.
    pub(crate) bytes: usize,
    /// Reports whether the page acknowledges the pictures that it shows.
    pub(crate) answers: bool,
    pub(crate) heard: Vec<Value>,
    /// Code and reason, once it is closed.
    pub(crate) closed: Option<(u16, String)>,
    last: Instant,
    /// The longest time without a message.
    pub(crate) longest_gap: Duration,
}

/// A request for the socket, as a page of the server itself makes it.
pub(crate) fn request(server: &Server) -> Request {
    request_at(server.address())
}

fn request_at(address: SocketAddr) -> Request {
    let mut request =
        format!("ws://{address}/socket").into_client_request().expect("it is an address");
    let headers = request.headers_mut();
    let protocols = format!("{PROTOCOL}, busbar.token.{SECRET}");
    headers.insert("Origin", format!("http://{address}").parse().expect("text"));
    headers.insert("Sec-WebSocket-Protocol", protocols.parse().expect("text"));
    request
}

/// Opens a socket; the status where it is refused.
pub(crate) async fn open(server: &Server, request: Request) -> Result<Page, u16> {
    open_at(server.address(), request).await
}

async fn open_at(address: SocketAddr, request: Request) -> Result<Page, u16> {
    let stream = tokio::net::TcpStream::connect(address).await.expect("it listens");
    match client_async(request, stream).await {
        Ok((socket, _)) => Ok(Page {
            socket,
            size: [0; 2],
            pixels: Vec::new(),
            number: 0,
            pictures: 0,
            kinds: Vec::new(),
            bytes: 0,
            answers: true,
            heard: Vec::new(),
            closed: None,
            last: Instant::now(),
            longest_gap: Duration::ZERO,
        }),
        Err(Error::Http(response)) => Err(response.status().as_u16()),
        Err(error) => panic!("{error}"),
    }
}

impl Page {
    pub(crate) async fn open(server: &Server) -> Self {
        open(server, request(server)).await.expect("it may")
    }

    /// A page at the end of a line that carries so many bytes a second, whatever its
    /// buffers take.
    pub(crate) async fn open_slowly(server: &Server, rate: usize) -> Self {
        let (to, line) = (server.address(), TcpListener::bind("127.0.0.1:0").await);
        let line = line.expect("a free port");
        let address = line.local_addr().expect("it has one");
        tokio::spawn(async move {
            let (page, _) = line.accept().await.expect("the page comes");
            let server = tokio::net::TcpStream::connect(to).await.expect("it listens");
            let ((mut from_page, mut to_page), (mut from_server, mut to_server)) =
                (page.into_split(), server.into_split());
            tokio::spawn(async move { tokio::io::copy(&mut from_page, &mut to_server).await });
            let mut piece = vec![0; rate / 50];
            while let Ok(count @ 1..) = from_server.read(&mut piece).await {
                tokio::time::sleep(Duration::from_secs_f64(count as f64 / rate as f64)).await;
                if to_page.write_all(&piece[..count]).await.is_err() {
                    return;
                }
            }
        });
        open_at(address, request_at(address)).await.expect("it may")
    }

    pub(crate) async fn say(&mut self, message: Value) {
        self.send(Message::text(message.to_string())).await;
    }

    pub(crate) async fn send(&mut self, message: Message) {
        // One that is closed hears nothing; the test sees that it is.
        let _ = self.socket.send(message).await;
    }

    pub(crate) async fn view(&mut self, size: [u32; 2], visible: bool) {
        self.say(json!({"view": {"size": size, "visible": visible}})).await;
    }

    /// Drags from one place to another, in steps that the viewer sees.
    pub(crate) async fn drag(&mut self, from: [f32; 2], by: [f32; 2]) {
        self.say(json!({"moved": from})).await;
        self.say(json!({"button": {"at": from, "button": 1, "pressed": true}})).await;
        let mut at = from;
        for step in 1..=5_u8 {
            let share = f32::from(step) / 5.0;
            at = [from[0] + by[0] * share, from[1] + by[1] * share];
            self.say(json!({"moved": at})).await;
            self.listen_for(Duration::from_millis(100)).await;
        }
        self.say(json!({"button": {"at": at, "button": 1, "pressed": false}})).await;
    }

    /// Listens until something holds.
    pub(crate) async fn until(&mut self, what: &str, holds: impl Fn(&Self) -> bool) {
        let start = Instant::now();
        while !holds(self) {
            assert!(start.elapsed() < PATIENCE, "no {what}; heard {:?}", self.heard);
            self.listen_for(Duration::from_millis(20)).await;
        }
    }

    /// Listens for so long.
    pub(crate) async fn listen_for(&mut self, time: Duration) {
        let end = tokio::time::Instant::now() + time;
        while self.closed.is_none() {
            let Ok(next) = tokio::time::timeout_at(end, self.socket.next()).await else { return };
            self.longest_gap = self.longest_gap.max(self.last.elapsed());
            self.last = Instant::now();
            match next {
                Some(Ok(Message::Text(text))) => {
                    self.bytes += text.len();
                    self.heard.push(serde_json::from_str(&text).expect("it is JSON"));
                }
                Some(Ok(Message::Binary(bytes))) => {
                    self.bytes += bytes.len();
                    self.show(&bytes);
                    if self.answers {
                        self.say(json!({"shown": self.number})).await;
                    }
                }
                Some(Ok(Message::Close(frame))) => {
                    let told = frame.map(|f| (f.code.into(), f.reason.to_string()));
                    self.closed = Some(told.unwrap_or_default());
                }
                Some(Ok(_)) => {}
                Some(Err(_)) | None => self.closed = Some((0, "it went".into())),
            }
        }
        tokio::time::sleep_until(end).await;
    }

    fn show(&mut self, bytes: &[u8]) {
        let short = |at: usize| u32::from(u16::from_le_bytes([bytes[at], bytes[at + 1]]));
        let long = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().expect("four"));
        let (count, size) = (short(2) as usize, [short(8), short(10)]);
        if self.size != size {
            self.size = size;
            self.pixels = vec![0; (size[0] * size[1] * 3) as usize];
        }
        let mut from = 12 + count * 12;
        for place in (0..count).map(|i| 12 + i * 12) {
            let [x, y, width, height] = [0, 2, 4, 6].map(|offset| short(place + offset) as usize);
            let length = long(place + 8) as usize;
            let decoded = image::load_from_memory(&bytes[from..from + length]).expect("a picture");
            let decoded = decoded.to_rgb8();
            assert_eq!(decoded.dimensions(), (width as u32, height as u32));
            for (row, line) in decoded.as_raw().chunks(width * 3).enumerate() {
                let to = ((y + row) * size[0] as usize + x) * 3;
                self.pixels[to..to + line.len()].copy_from_slice(line);
            }
            from += length;
        }
        assert_eq!(from, bytes.len());
        (self.number, self.pictures) = (long(4), self.pictures + 1);
        self.kinds.push(bytes[0]);
    }

    /// Listens until the picture is live and rests without loss.
    pub(crate) async fn until_calm(&mut self) {
        let start = Instant::now();
        loop {
            let before = self.pictures;
            self.listen_for(Duration::from_millis(2500)).await;
            if self.pictures == before && before > 0 && self.condition() == "live" {
                return;
            }
            assert!(start.elapsed() < PATIENCE, "it never rests; {:?}", self.heard.last());
        }
    }

    /// Returns the last beat received.
    pub(crate) fn beat(&self) -> Option<&Value> {
        self.was_told("beat")
    }

    /// Returns the condition in the last beat.
    pub(crate) fn condition(&self) -> &str {
        let beats = self.heard.iter().rev().find_map(|message| message["beat"][0].as_str());
        beats.unwrap_or("none")
    }

    /// Returns the last message of a kind, if one was received.
    pub(crate) fn was_told(&self, key: &str) -> Option<&Value> {
        self.heard.iter().rev().find_map(|message| message.get(key))
    }
}
