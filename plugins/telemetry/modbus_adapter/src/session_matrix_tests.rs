//! Message matrix: answers that are lost, cut, oversized, unknown, misassigned, doubled and
//! out of order, over TCP and over a serial line, judged after every poll.
//!
//! Connections of the long test lie in memory, and its clock is simulated: a deadline that
//! passes takes no time. `BUSBAR_MATRIX_STEPS` sets the count of its polls.

use std::fs::File;
use std::io::{Read, Write};
use std::sync::{Arc, Mutex};

use busbar_link::{Dial, DialFuture, Endpoint, TcpDial};
use busbar_plugin_sdk::testing::{
    FaultGenerator, MessageFault, TruthOracle, host, matrix_steps, tag_spec,
};
use busbar_plugin_sdk::{TagSpec, Text, Value, ValueKind};
use serde_json::json;
use tokio::io::{AsyncReadExt, AsyncWriteExt, DuplexStream, duplex};

use super::*;
use crate::Settings;
use crate::tests::line::Line;
use crate::tests::server::{Pieces, Server, at_once};

/// Polls of one seed in memory, and over sockets and lines, where a deadline takes its time.
const MEMORY_POLLS: u16 = 3000;
const REAL_POLLS: u16 = 300;
/// Polls in memory of all seeds where the environment says nothing.
const SAMPLE: u64 = 10 * MEMORY_POLLS as u64;
/// Most bytes that are on their way at once in memory: answers come in pieces.
const MAX_PIECE: usize = 400;
/// Registers with a tag each: two requests.
const REGISTERS: [u16; 6] = [0, 1, 2, 100, 101, 102];
/// First register of a text, in the second request, and its bytes.
const TEXT: u16 = 104;
const TEXT_BYTES: u8 = 12;
/// Number of registers of each device.
const ALL_REGISTERS: usize = 128;

/// A device whose answers get faults.
struct Device {
    registers: [u16; ALL_REGISTERS],
    faults: FaultGenerator,
    /// True while faults are injected.
    is_faulty: bool,
    /// The answer before, or one that is late.
    former: Vec<u8>,
}

impl Device {
    fn new(seed: u64) -> Arc<Mutex<Self>> {
        let faults = FaultGenerator::new(seed).with_rarity(3);
        Arc::new(Mutex::new(Self {
            registers: [0; ALL_REGISTERS],
            faults,
            is_faulty: true,
            former: Vec::new(),
        }))
    }

    /// Values that no other register and no other step has.
    fn set(&mut self, step: u16) {
        for (value, register) in self.registers.iter_mut().zip(0_u16..) {
            *value = step.wrapping_mul(17).wrapping_add(register.wrapping_mul(509));
        }
        let text = format!("{:<width$}", text_of(step), width = usize::from(TEXT_BYTES));
        for (register, bytes) in (usize::from(TEXT)..).zip(text.as_bytes().as_chunks().0) {
            self.registers[register] = u16::from_be_bytes(*bytes);
        }
    }

    /// Data of a right answer: its count of bytes, and registers.
    fn data(&self, first: u16, count: u16) -> Vec<u8> {
        let mut data = vec![(2 * count) as u8];
        for register in first..first + count {
            data.extend(self.registers[usize::from(register) % ALL_REGISTERS].to_be_bytes());
        }
        data
    }

    fn next_fault(&mut self) -> Option<MessageFault> {
        let fault = self.faults.next_fault();
        fault.filter(|_| self.is_faulty)
    }

    fn answer_tcp(&mut self, request: &[u8]) -> Option<Pieces> {
        let (first, count) = asked(&request[8..]);
        let body = [&request[6..8], &self.data(first, count)[..]].concat();
        let right = mbap(request, &body);
        let former = std::mem::replace(&mut self.former, right.clone());
        let fault = self.next_fault();
        let random = &mut self.faults;
        let bytes = match fault {
            None => right,
            Some(MessageFault::Lost) if random.one_in(2) => return None,
            Some(MessageFault::Lost) => return Some(Vec::new()),
            Some(MessageFault::Cut) => {
                // The bytes stop, or the frame is whole and holds less.
                let mut cut = right;
                random.cut(&mut cut);
                match cut.get(6..) {
                    Some(body) if random.one_in(2) && !body.is_empty() => mbap(request, body),
                    _ => cut,
                }
            }
            Some(MessageFault::Oversized) => match random.below(3) {
                0 => {
                    let more = self.data(first, count + 1);
                    mbap(request, &[&request[6..8], &more[..]].concat())
                }
                1 => mbap(request, &[&body[..], &[0xA5; 300]].concat()),
                _ => [&right[..4], &[0xFF, 0xFF], &right[6..]].concat(),
            },
            Some(MessageFault::Unknown) => match random.below(3) {
                0 => mbap(request, &[&[request[6], 4], &body[2..]].concat()),
                1 => {
                    let code = [1, 4, 5, 6, 10, 11, 99][random.below(7)];
                    mbap(request, &[request[6], request[7] | 0x80, code])
                }
                _ => [&[0xDE, 0xAD, 0xBE, 0xEF, 0x00][..], &right].concat(),
            },
            Some(MessageFault::Misassigned) => {
                let mut other = right;
                match random.below(3) {
                    0 => other[1] ^= 0x11,
                    1 => other[6] ^= 0x05,
                    _ if former.len() == other.len() => other = former,
                    _ => other[3] = 1,
                }
                other
            }
            Some(MessageFault::Duplicated) => right.repeat(2),
            Some(MessageFault::Reordered) => [former, right].concat(),
        };
        at_once(bytes)
    }

    fn answer_serial(&mut self, request: &[u8]) -> Vec<u8> {
        let (first, count) = asked(&request[2..]);
        let body = [&request[..2], &self.data(first, count)[..]].concat();
        let right = with_crc(body.clone());
        let fault = self.next_fault();
        let random = &mut self.faults;
        match fault {
            None => right,
            Some(MessageFault::Lost) => Vec::new(),
            Some(MessageFault::Cut) => {
                let mut cut = right;
                random.cut(&mut cut);
                cut
            }
            Some(MessageFault::Oversized) => {
                with_crc([&request[..2], &self.data(first, count + 1)[..]].concat())
            }
            Some(MessageFault::Unknown) => match random.below(3) {
                0 => with_crc([&[request[0], 4], &body[2..]].concat()),
                1 => with_crc(vec![request[0], request[1] | 0x80, [4, 5, 6, 11][random.below(4)]]),
                _ => {
                    let mut garbled = right;
                    random.flip_bit(&mut garbled);
                    garbled
                }
            },
            Some(MessageFault::Misassigned) => with_crc([&[request[0] ^ 5], &body[1..]].concat()),
            Some(MessageFault::Duplicated) => right.repeat(2),
            // Late: it comes with the answer to the next request, before that.
            Some(MessageFault::Reordered) => {
                self.former = right;
                Vec::new()
            }
        }
    }
}

/// Connections in memory to a device.
struct MemoryDial(Arc<Mutex<Device>>);

impl Dial for MemoryDial {
    fn dial<'a>(&'a self, _: &'a Endpoint, _: std::time::Duration) -> DialFuture<'a> {
        let piece = {
            let random = &mut self.0.lock().unwrap().faults;
            let max_piece = [1, 12, MAX_PIECE][random.below(3)];
            1 + random.below(max_piece)
        };
        let (ours, theirs) = duplex(piece);
        tokio::spawn(serve(theirs, Arc::clone(&self.0)));
        Box::pin(async { Ok(Box::new(ours) as _) })
    }
}

/// Serves one connection until either side closes it.
async fn serve(mut stream: DuplexStream, device: Arc<Mutex<Device>>) {
    let mut request = [0; 12];
    while stream.read_exact(&mut request).await.is_ok() {
        let answer = device.lock().unwrap().answer_tcp(&request);
        let Some(pieces) = answer else { return };
        for (_, bytes) in pieces {
            if stream.write_all(&bytes).await.is_err() {
                return;
            }
        }
    }
}

/// First register and count of a request, from its data on.
fn asked(data: &[u8]) -> (u16, u16) {
    (u16::from_be_bytes([data[0], data[1]]), u16::from_be_bytes([data[2], data[3]]))
}

/// Builds a frame of the request's transaction.
fn mbap(request: &[u8], body: &[u8]) -> Vec<u8> {
    [&request[..4], &(body.len() as u16).to_be_bytes(), body].concat()
}

/// CRC-16 of Modbus over Serial Line V1.02, 6.2.2, appended.
fn with_crc(mut bytes: Vec<u8>) -> Vec<u8> {
    let step = |crc: u16, _| if crc & 1 == 1 { crc >> 1 ^ 0xA001 } else { crc >> 1 };
    let crc = bytes.iter().fold(0xFFFF, |crc, byte| (0..8).fold(crc ^ u16::from(*byte), step));
    bytes.extend(crc.to_le_bytes());
    bytes
}

/// Text that no other step has.
fn text_of(step: u16) -> String {
    format!("step {step}")
}

fn tags() -> Vec<TagSpec> {
    let address = json!({"table": "holding", "register": TEXT, "length": TEXT_BYTES});
    let text = tag_spec(TEXT.into(), "text", ValueKind::Text, address);
    let tag = |register: &u16| {
        let address = json!({"table": "holding", "register": register, "type": "u16"});
        tag_spec((*register).into(), &format!("tag{register}"), ValueKind::I64, address)
    };
    REGISTERS.iter().map(tag).chain([text]).collect()
}

/// Settings and dialer by which a test reaches its device.
struct Path {
    settings: serde_json::Value,
    dial: Arc<dyn Dial>,
    /// True where no time passes but that which is waited for.
    has_simulated_clock: bool,
}

/// Polls a device by hand, as the session's own loop does, without its delays.
fn run(path: Path, device: &Mutex<Device>, seed: u64, polls: u16) {
    let Path { settings, dial, has_simulated_clock } = path;
    // Transaction numbers, too, are those of the seed.
    fastrand::seed(seed);
    let config = serde_json::from_value::<Settings>(settings).unwrap().parse().unwrap();
    let tags = tags();
    let points = crate::address::parse(&tags, &config).unwrap();
    let mut builder = tokio::runtime::Builder::new_current_thread();
    let runtime = builder.enable_all().start_paused(has_simulated_clock).build().unwrap();
    let mut oracle = TruthOracle::new(seed, std::time::Duration::ZERO, &tags);
    let mut session = Session::new(config, dial, points, oracle.sink(), host());
    let mut link = None;
    for step in 1..=polls {
        oracle.advance(std::time::Duration::from_millis(100));
        let registers = {
            let mut device = device.lock().unwrap();
            device.set(step);
            device.is_faulty = step + 20 < polls;
            device.registers
        };
        for register in REGISTERS {
            let value = i64::from(registers[usize::from(register)]);
            oracle.set_truth(register.into(), Some(Value::I64(value)));
            // This poll tells it, or cannot be understood.
            oracle.note_message(register.into());
        }
        let text = Text::cut(&text_of(step));
        oracle.set_truth(TEXT.into(), Some(Value::Text(text)));
        oracle.note_message(TEXT.into());
        let polled = runtime.block_on(async {
            let (connection, group) = match &mut link {
                Some(link) => link,
                None => {
                    let connection = session.connect().await?;
                    let group = session.groups().pop().unwrap();
                    link.insert((connection, group))
                }
            };
            for refused in &mut group.refused {
                refused.retry_at = Instant::now();
            }
            session.poll(connection, group).await
        });
        if polled.is_err() {
            link = None;
            session.publish_all(Reason::Communication);
        }
        oracle.check();
    }
    oracle.check_recovered();
    let counts = oracle.counts();
    assert!(counts.good > counts.judged / 10 && counts.good < counts.judged * 9 / 10, "{counts:?}");
}

fn tcp_settings(port: u16) -> serde_json::Value {
    json!({"host": "127.0.0.1", "port": port, "timeout_seconds": 0.02})
}

#[test]
fn no_answer_over_tcp_leaves_an_old_value_good() {
    for seed in 1..=matrix_steps(SAMPLE).div_ceil(MEMORY_POLLS.into()) {
        let device = Device::new(seed);
        let dial = Arc::new(MemoryDial(Arc::clone(&device)));
        let path = Path { settings: tcp_settings(502), dial, has_simulated_clock: true };
        run(path, &device, seed, MEMORY_POLLS);
    }
}

#[test]
fn no_answer_over_a_socket_leaves_an_old_value_good() {
    let device = Device::new(1);
    let served = Arc::clone(&device);
    let server = Server::start(move |request| served.lock().unwrap().answer_tcp(request));
    let dial = Arc::new(TcpDial { tls: None });
    let settings = tcp_settings(server.port);
    run(Path { settings, dial, has_simulated_clock: false }, &device, 1, REAL_POLLS);
}

#[test]
fn no_answer_over_a_line_leaves_an_old_value_good() {
    let Some(line) = Line::lay() else { return };
    let device = Device::new(7);
    let served = Arc::clone(&device);
    let mut port = File::options().read(true).write(true).open(line.theirs()).unwrap();
    std::thread::spawn(move || {
        let mut request = [0; 8];
        while port.read_exact(&mut request).is_ok() {
            let mut device = served.lock().unwrap();
            let late = std::mem::take(&mut device.former);
            let answer = [late, device.answer_serial(&request)].concat();
            if port.write_all(&answer).is_err() {
                return;
            }
        }
    });
    let mut settings = line.settings();
    settings["timeout_seconds"] = json!(0.02);
    settings["serial"]["baud_rate"] = json!(115_200);
    let dial = Arc::new(TcpDial { tls: None });
    run(Path { settings, dial, has_simulated_clock: false }, &device, 7, REAL_POLLS);
}

/// Exceptions of a gateway that no longer reaches a unit.
#[test]
fn a_unit_that_its_gateway_does_not_reach_is_bad_in_all_poll_groups() {
    let code = Arc::new(Mutex::new(0_u8));
    let said = Arc::clone(&code);
    let server = Server::start(move |request| {
        let code = *said.lock().unwrap();
        if code == 0 || request[6] != 7 {
            return at_once(crate::tests::server::right(request));
        }
        at_once(mbap(request, &[request[6], request[7] | 0x80, code]))
    });
    let tag = |tag: u32, unit: u8, group: Option<&str>| {
        let mut address = json!({"table": "holding", "register": tag, "type": "u16", "unit": unit});
        if let Some(group) = group {
            address["poll_group"] = json!(group);
        }
        tag_spec(tag, &format!("tag{tag}"), ValueKind::F64, address)
    };
    let tags = vec![tag(1, 7, None), tag(2, 7, Some("slow")), tag(3, 8, Some("slow"))];
    let slow = json!({"poll_groups": {"slow": {"poll_seconds": 60}}});
    let running = crate::tests::start(server.port, slow, tags);
    let right = || Value::F64(f64::from(0xDEAD));
    for exception in [10, 11] {
        (1..=3).for_each(|tag| running.wait_for(tag, right()));
        *code.lock().unwrap() = exception;
        running.wait_for_bad(1, Reason::Communication);
        running.wait_for_bad(2, Reason::Communication);
        running.wait_for(3, right());
        running.wait_for_link(LinkState::Up, "the gateway does not reach unit 7");
        *code.lock().unwrap() = 0;
        (1..=3).for_each(|tag| running.wait_for(tag, right()));
    }
    // Another exception is of the block that was asked for.
    *code.lock().unwrap() = 4;
    running.wait_for_bad(1, Reason::Unknown);
    running.wait_for(2, right());
}
