//! The program as a client sees it.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use rustix::process::{Pid, Signal, kill_process};

struct Simulator {
    child: Child,
    address: SocketAddr,
}

impl Simulator {
    fn start(arguments: &[&str]) -> Self {
        let mut child = Command::new(env!("CARGO_BIN_EXE_modbus_simulator"))
            .args(["--listen", "127.0.0.1:0"])
            .args(arguments)
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let mut line = String::new();
        let mut stdout = BufReader::new(child.stdout.take().unwrap());
        stdout.read_line(&mut line).unwrap();
        let address = line.trim().strip_prefix("listening on ").unwrap();
        Self { address: address.parse().unwrap(), child }
    }

    fn connect(&self) -> TcpStream {
        let stream = TcpStream::connect(self.address).unwrap();
        stream.set_read_timeout(Some(Duration::from_secs(5))).unwrap();
        stream
    }
}

impl Drop for Simulator {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Sends a PDU and gives the PDU of the answer; frames are built by hand, so
/// that this test shares no code with the simulator.
fn ask(stream: &mut TcpStream, pdu: &[u8]) -> Vec<u8> {
    let mut frame = vec![0x12, 0x34, 0, 0, 0, pdu.len() as u8 + 1, 1];
    frame.extend(pdu);
    stream.write_all(&frame).unwrap();
    let mut head = [0; 7];
    stream.read_exact(&mut head).unwrap();
    assert_eq!(head[..4], [0x12, 0x34, 0, 0]);
    let mut answer = vec![0; usize::from(head[5]) - 1];
    stream.read_exact(&mut answer).unwrap();
    answer
}

#[test]
fn tables_are_read_and_written() {
    let simulator = Simulator::start(&[]);
    let mut stream = simulator.connect();
    for function in [3, 4] {
        let answer = ask(&mut stream, &[function, 0, 0, 0, 2]);
        assert_eq!(answer[..2], [function, 4]);
        let kilovolts = f32::from_be_bytes(answer[2..6].try_into().unwrap());
        assert!((215.0..235.0).contains(&kilovolts), "{kilovolts}");
    }
    for function in [1, 2] {
        let answer = ask(&mut stream, &[function, 0, 0, 0, 5]);
        assert_eq!(answer, [function, 1, 0b0_1010], "both switches closed");
    }
    // 6 and 16 pin registers, 5 and 15 bits.
    assert_eq!(ask(&mut stream, &[6, 0, 100, 0x03, 0xB6]), [6, 0, 100, 0x03, 0xB6]);
    assert_eq!(ask(&mut stream, &[16, 0, 101, 0, 1, 2, 0x04, 0x00]), [16, 0, 101, 0, 1]);
    assert_eq!(ask(&mut stream, &[5, 0, 4, 0xFF, 0]), [5, 0, 4, 0xFF, 0]);
    assert_eq!(ask(&mut stream, &[15, 0, 0, 0, 2, 1, 0b01]), [15, 0, 0, 0, 2]);
    // Longer than a step: they stay, and the load goes.
    std::thread::sleep(Duration::from_millis(500));
    assert_eq!(ask(&mut stream, &[3, 0, 100, 0, 2]), [3, 4, 0x03, 0xB6, 0x04, 0x00]);
    assert_eq!(ask(&mut stream, &[1, 0, 0, 0, 5]), [1, 1, 0b1_1001]);
    assert_eq!(ask(&mut stream, &[4, 0, 18, 0, 2]), [4, 4, 0, 0, 0, 0]);
}

#[test]
fn what_is_not_there_is_refused() {
    let simulator = Simulator::start(&[]);
    let mut stream = simulator.connect();
    assert_eq!(ask(&mut stream, &[3, 0, 50, 0, 1]), [0x83, 2]);
    assert_eq!(ask(&mut stream, &[3, 0, 0, 0, 126]), [0x83, 3]);
    assert_eq!(ask(&mut stream, &[22, 0, 0, 0, 0, 0, 0]), [0x96, 1]);
}

#[test]
fn clients_beyond_the_limit_are_closed_and_places_come_free() {
    let simulator = Simulator::start(&[]);
    let mut clients: Vec<_> = (0..32).map(|_| simulator.connect()).collect();
    for client in &mut clients {
        assert_eq!(ask(client, &[3, 0, 104, 0, 1])[..2], [3, 2]);
    }
    let mut refused = simulator.connect();
    let end = refused.read(&mut [0; 1]);
    assert!(matches!(end, Ok(0)) || end.is_err_and(|e| e.kind() != std::io::ErrorKind::WouldBlock));
    drop(clients);
    std::thread::sleep(Duration::from_millis(300));
    let mut stream = simulator.connect();
    assert_eq!(ask(&mut stream, &[3, 0, 104, 0, 1])[..2], [3, 2]);
}

#[test]
fn signals_end_it_cleanly() {
    for signal in [Signal::TERM, Signal::INT] {
        let mut simulator = Simulator::start(&[]);
        let _client = simulator.connect();
        kill_process(Pid::from_child(&simulator.child), signal).unwrap();
        assert!(simulator.child.wait().unwrap().success());
    }
}

#[test]
fn a_map_of_ones_own_is_served_and_a_wrong_one_explained() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("points.json");
    let map = r#"{"points": [{"name": "a", "register": 7, "type": "u16",
        "source": {"constant": 513}}]}"#;
    std::fs::write(&path, map).unwrap();
    let simulator = Simulator::start(&["--points", path.to_str().unwrap()]);
    assert_eq!(ask(&mut simulator.connect(), &[3, 0, 7, 0, 1]), [3, 2, 2, 1]);

    std::fs::write(&path, map.replace("513", "\"x\"")).unwrap();
    let output = Command::new(env!("CARGO_BIN_EXE_modbus_simulator"))
        .args(["--listen", "127.0.0.1:0", "--points"])
        .arg(&path)
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(1));
    let message = String::from_utf8(output.stderr).unwrap();
    assert!(message.contains("points.json") && message.contains("line 2"), "{message}");
}
