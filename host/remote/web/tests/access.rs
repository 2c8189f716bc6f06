//! Access control over HTTP: tokens, hosts, origins, limits and floods.

mod common;

use std::net::TcpListener;
use std::time::{Duration, Instant};

use busbar_web::{Options, ServeError, Server};
use common::*;
use serde_json::json;
use tokio_tungstenite::tungstenite::Message;

#[test]
fn the_page_is_for_who_has_the_token() {
    let server = start(&bare());
    for path in
        ["/", "/?token=", "/?token=0123456789abcdef", "/?token=0123456789abcdef0123456789abcdeF"]
    {
        let answer = ask(&server, path, &[]);
        assert_eq!(answer.status, 401, "{path}");
        assert!(answer.body.contains("token") && !answer.body.contains("<"), "a plain page");
        assert!(!answer.headers.contains_key("set-cookie"));
    }
    let answer = ask(&server, &format!("/?token={SECRET}"), &[]);
    assert_eq!(answer.status, 200);
    assert!(answer.body.contains("<canvas") && !answer.body.contains("{{"));
    assert!(!answer.body.contains(SECRET), "not in the page");
    let cookie = &answer.headers["set-cookie"];
    assert!(cookie.contains("HttpOnly") && cookie.contains("SameSite=Strict"), "{cookie}");
    let policy = &answer.headers["content-security-policy"];
    assert!(policy.contains("default-src 'none'") && !policy.contains("inline"), "{policy}");
    assert_eq!(answer.headers["cache-control"], "no-store");
    let kept = cookie.split(';').next().expect("a cookie");
    assert_eq!(ask(&server, "/", &[("Cookie", kept)]).status, 200);
    for part in [
        "/view.js",
        "/liveness.js",
        "/picture_age.js",
        "/connection.js",
        "/picture.js",
        "/input.js",
        "/host_page.js",
        "/view.css",
    ] {
        let answer = ask(&server, part, &[]);
        assert_eq!(answer.status, 200, "{part}");
        assert_eq!(answer.headers["x-content-type-options"], "nosniff");
    }
    assert_eq!(ask(&server, "/../Cargo.toml", &[]).status, 404);
    assert_eq!(ask_by("POST", &server, &format!("/?token={SECRET}"), &[]).status, 405);
}

#[test]
fn an_hmi_of_another_origin_may_embed_it_if_it_is_named() {
    let allowed_origins = vec!["https://hmi.example".parse().expect("an origin")];
    let server = start(&Options { allowed_origins, ..bare() });
    let answer = ask(&server, &format!("/?token={SECRET}"), &[]);
    let policy = &answer.headers["content-security-policy"];
    assert!(policy.ends_with("frame-ancestors 'self' https://hmi.example"), "{policy}");
    assert!(answer.headers["set-cookie"].contains("SameSite=None; Secure; Partitioned"));
    assert!(answer.body.contains(r#"data-origins="https://hmi.example""#));
}

#[test]
fn names_that_lead_here_from_elsewhere_are_refused() {
    let server = start(&bare());
    let path = format!("/?token={SECRET}");
    for host in ["evil.example", "evil.example:8080", "127.0.0.1.evil.example", ""] {
        assert_eq!(ask(&server, &path, &[("Host", host)]).status, 403, "{host}");
    }
    assert_eq!(ask(&server, &path, &[("Host", "localhost:1")]).status, 200);
}

#[tokio::test]
async fn sockets_are_for_pages_of_this_server_with_the_token() {
    let server = start(&bare());
    let mut wrong = request(&server);
    wrong.headers_mut().insert("Sec-WebSocket-Protocol", "busbar.2".parse().expect("text"));
    assert_eq!(open(&server, wrong).await.err(), Some(401));
    for origin in ["http://evil.example", "null", "http://127.0.0.1:1"] {
        let mut wrong = request(&server);
        wrong.headers_mut().insert("Origin", origin.parse().expect("text"));
        assert_eq!(open(&server, wrong).await.err(), Some(403), "{origin}");
    }
    let mut wrong = request(&server);
    wrong.headers_mut().remove("Origin");
    assert_eq!(open(&server, wrong).await.err(), Some(403));
    let mut wrong = request(&server);
    let old = format!("busbar.0, busbar.token.{SECRET}");
    wrong.headers_mut().insert("Sec-WebSocket-Protocol", old.parse().expect("text"));
    assert_eq!(open(&server, wrong).await.err(), Some(400), "a page of another release");
    // As the page asks whether its token is refused.
    let bearer = format!("Bearer {SECRET}");
    assert_eq!(ask(&server, "/socket", &[("Authorization", &bearer)]).status, 426);
    assert_eq!(ask(&server, "/socket", &[("Authorization", "Bearer x")]).status, 401);
}

#[tokio::test]
async fn there_are_so_many_places_and_one_that_is_left_is_free() {
    let server = start(&bare());
    let mut first = Page::open(&server).await;
    // A page that is open need not have its place yet.
    first.until("control", |page| page.was_told("steers") == Some(&json!(true))).await;
    let mut second = Page::open(&server).await;
    second.until("place", |page| page.was_told("steers").is_some()).await;
    let mut third = Page::open(&server).await;
    third.until("refusal", |page| page.closed.is_some()).await;
    let (code, why) = third.closed.expect("it is");
    assert!(code == 4001 && why.contains("all 2 places"), "{code} {why}");
    second.until("beat", |page| page.condition() == "starting").await;
    assert_eq!(second.was_told("steers"), Some(&json!(false)));
    drop(first);
    second.until("control", |page| page.was_told("steers") == Some(&json!(true))).await;
    let mut fourth = Page::open(&server).await;
    fourth.until("beat", |page| page.condition() == "starting").await;
}

#[tokio::test]
async fn what_is_no_message_ends_the_page_that_says_it() {
    let server = start(&bare());
    let long = format!(r#"{{"text":"{}"}}"#, "x".repeat(10_000));
    for (said, code) in [
        (Message::text("nonsense"), 1008),
        (Message::text(r#"{"reload":"/etc/passwd"}"#), 1008),
        (Message::text(r#"{"theta":7}"#), 1008),
        (Message::binary(vec![1, 2, 3]), 1003),
        // The connection is cut off.
        (Message::text(long), 0),
    ] {
        let mut page = Page::open(&server).await;
        page.send(said.clone()).await;
        page.until("end", |page| page.closed.is_some()).await;
        assert_eq!(page.closed.expect("it is").0, code, "{said:?}");
    }
    // A flood: far more than anybody's hands do.
    let mut page = Page::open(&server).await;
    for x in 0..2000 {
        page.say(json!({"moved": [x, 0]})).await;
    }
    page.until("end", |page| page.closed.is_some()).await;
    let (code, why) = page.closed.expect("it is");
    // It may be cut off while it says more.
    assert!(code == 1008 && why.contains("messages a second") || code == 0, "{code} {why}");
}

#[test]
fn requests_that_never_end_are_cut_off_and_do_no_harm() {
    let server = start(&bare());
    let start = Instant::now();
    let slow: Vec<_> = (0..40)
        .map(|_| {
            let mut stream = std::net::TcpStream::connect(server.address()).expect("it listens");
            std::io::Write::write_all(&mut stream, b"GET / HTTP/1.1\r\nHost:").expect("it reads");
            stream
        })
        .collect();
    let answer = ask(&server, &format!("/?token={SECRET}"), &[]);
    assert_eq!(answer.status, 200);
    assert!(start.elapsed() < Duration::from_secs(20), "{:?}", start.elapsed());
    drop(slow);
    let long = format!("/?token={}", "x".repeat(100_000));
    assert!([431, 414, 400].contains(&ask(&server, &long, &[]).status));
    assert_eq!(ask(&server, "/view.css", &[]).status, 200);
}

#[test]
fn faults_of_a_start_are_told_with_a_remedy() {
    let taken = TcpListener::bind("127.0.0.1:0").expect("a free port");
    let listen = taken.local_addr().expect("it has one");
    let fault = |options: Options| Server::start(&options).err().expect("it may not").to_string();
    let words = fault(Options { listen, ..bare() });
    assert!(words.contains(&listen.to_string()) && words.contains("--listen"), "{words}");
    let words = fault(Options { listen: "0.0.0.0:0".parse().expect("an address"), ..bare() });
    assert!(words.contains("--insecure-remote") && words.contains("TLS"), "{words}");
    let result = Server::start(&Options { max_clients: 0, ..bare() });
    assert!(matches!(result, Err(ServeError::Clients(0))));
}

#[tokio::test]
async fn pages_hear_of_the_end() {
    let server = start(&bare());
    let mut page = Page::open(&server).await;
    page.until("beat", |page| page.condition() == "starting").await;
    let ended = tokio::task::spawn_blocking(move || drop(server));
    page.until("end", |page| page.closed.is_some()).await;
    assert_eq!(page.closed.expect("it is").0, 1001);
    ended.await.expect("it ends");
}
