//! Against serial devices that break the protocol in every way we know.

use std::fs::File;
use std::io::{Read, Write};

use super::line::Line;
use super::*;

/// Bytes of a request that reads.
const REQUEST_BYTES: usize = 8;

/// CRC-16 of Modbus over Serial Line V1.02, 6.2.2, appended.
fn with_crc(mut bytes: Vec<u8>) -> Vec<u8> {
    let step = |crc: u16, _| if crc & 1 == 1 { crc >> 1 ^ 0xA001 } else { crc >> 1 };
    let crc = bytes.iter().fold(0xFFFF, |crc, byte| (0..8).fold(crc ^ u16::from(*byte), step));
    bytes.extend(crc.to_le_bytes());
    bytes
}

/// Builds the right answer, in which every register is 0xDEAD.
fn right(request: &[u8]) -> Vec<u8> {
    let count = request[5];
    let head = vec![request[0], request[1], 2 * count];
    with_crc([head, [0xDE, 0xAD].repeat(count.into())].concat())
}

/// Runs a device at the other end that gives these answers, until the test's process ends.
fn serve(line: &Line, answer: impl Fn(&[u8]) -> Vec<u8> + Send + 'static) {
    let mut device = File::options().read(true).write(true).open(line.theirs()).unwrap();
    std::thread::spawn(move || {
        let mut request = [0; REQUEST_BYTES];
        while device.read_exact(&mut request).is_ok() {
            if device.write_all(&answer(&request)).is_err() {
                return;
            }
        }
    });
}

/// No value may come of it, and the link says why.
#[track_caller]
fn check(answer: fn(&[u8]) -> Vec<u8>, message: &str) {
    let Some(line) = Line::lay() else { return };
    serve(&line, answer);
    let running = line.start(json!({"timeout_seconds": 0.1}), vec![holding(1, 0), holding(2, 1)]);
    running.wait_for_bad(1, Reason::Communication);
    running.wait_for_bad(2, Reason::Communication);
    running.wait_for_link(LinkState::Down, message);
    assert!(!running.has_good_samples());
}

#[test]
fn never_answers() {
    check(|_| Vec::new(), "no answer within 100 ms");
}

#[test]
fn answers_for_another_unit() {
    check(|r| right(&[&[r[0] + 1], &r[1..]].concat()), "another request or unit");
}

#[test]
fn answers_another_function() {
    check(|r| right(&[&[r[0], 4], &r[2..]].concat()), "another function");
}

#[test]
fn answers_with_another_checksum() {
    let garbled = |r: &[u8]| {
        let mut answer = right(r);
        answer[4] ^= 1;
        answer
    };
    check(garbled, "no answer within 100 ms");
}

#[test]
fn answers_too_few_or_too_many_registers() {
    check(|r| right(&[&r[..5], &[r[5] - 1], &r[6..]].concat()), "where 2 were asked for");
    check(|r| right(&[&r[..5], &[r[5] + 1], &r[6..]].concat()), "where 2 were asked for");
}

#[test]
fn answers_garbage() {
    check(|_| vec![0xA5; 300], "");
    check(|_| vec![0; 300], "");
    check(|r| right(r)[..6].to_vec(), "no answer within 100 ms");
}

#[test]
fn sends_exceptions_of_another_function() {
    check(|r| with_crc(vec![r[0], 0x84, 2]), "another function");
}

#[test]
fn a_proper_answer_is_taken() {
    // Shows that the cases above fail for their fault, not for the device.
    let Some(line) = Line::lay() else { return };
    serve(&line, right);
    let running = line.start(json!({}), vec![holding(1, 0)]);
    running.wait_for(1, Value::F64(f64::from(0xDEAD)));
}

#[test]
fn a_refused_address_is_singled_out_on_a_line_too() {
    let Some(line) = Line::lay() else { return };
    let refuse_third = |r: &[u8]| {
        let (first, count) = (u16::from(r[3]), u16::from(r[5]));
        if (first..first + count).contains(&2) { with_crc(vec![r[0], 0x83, 2]) } else { right(r) }
    };
    serve(&line, refuse_third);
    let tags = [0, 1, 2, 3].map(|register| holding(register.into(), register)).into();
    let running = line.start(json!({}), tags);
    running.wait_for_bad(2, Reason::Configuration);
    for tag in [0, 1, 3] {
        running.wait_for(tag, Value::F64(f64::from(0xDEAD)));
    }
}
