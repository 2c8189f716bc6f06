use std::net::{Ipv4Addr, TcpListener};

use tokio::time::timeout;

use super::*;

const LIMIT: Duration = Duration::from_secs(2);

fn run<T>(future: impl Future<Output = T>) -> T {
    tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap().block_on(future)
}

fn loopback(port: u16) -> SocketAddr {
    (Ipv4Addr::LOCALHOST, port).into()
}

/// Returns an address where nobody listens any more.
fn closed() -> SocketAddr {
    TcpListener::bind(loopback(0)).unwrap().local_addr().unwrap()
}

/// Returns an address that drops all packets: the queue of its listener is full.
#[cfg(target_os = "linux")]
async fn black_hole() -> (SocketAddr, impl Sized) {
    let socket = tokio::net::TcpSocket::new_v4().unwrap();
    socket.bind(loopback(0)).unwrap();
    let listener = socket.listen(1).unwrap();
    let address = listener.local_addr().unwrap();
    let mut queued = Vec::new();
    while let Ok(Ok(stream)) =
        timeout(Duration::from_millis(200), TcpStream::connect(address)).await
    {
        queued.push(stream);
    }
    (address, (listener, queued))
}

#[test]
#[cfg(target_os = "linux")]
fn a_silent_address_does_not_hide_the_next() {
    run(async {
        let (silent, _open) = black_hole().await;
        let good = TcpListener::bind(loopback(0)).unwrap();
        let good = good.local_addr().map(|address| (address, good)).unwrap();
        let stream = connect_any(vec![silent, good.0], Instant::now() + LIMIT).await.unwrap();
        assert_eq!(stream.peer_addr().unwrap(), good.0);
    });
}

#[test]
#[cfg(target_os = "linux")]
fn the_fault_of_each_address_is_named_in_time() {
    run(async {
        let (silent, _open) = black_hole().await;
        let refusing = closed();
        let started = Instant::now();
        // A third each, less what the test takes on the way.
        let limit = Duration::from_millis(417);
        let fault = connect_any(vec![silent, refusing, silent], started + limit).await.unwrap_err();
        assert!(started.elapsed() < LIMIT, "{:?}", started.elapsed());
        let text = fault.to_string();
        assert!(text.starts_with(&format!("{silent}: no connection within 13")), "{text}");
        assert!(
            text.contains(&format!("; {refusing}: connection refused; {silent}: no")),
            "{text}"
        );
    });
}

#[test]
fn the_fault_of_a_lone_address_is_the_cause_alone() {
    run(async {
        let fault = connect_any(vec![closed()], Instant::now() + LIMIT).await.unwrap_err();
        assert_eq!(fault.to_string(), "connection refused");
        let fault = connect_any(Vec::new(), Instant::now() + LIMIT).await.unwrap_err();
        assert_eq!(fault.to_string(), "the name has no address");
    });
}
