//! Fuzzing of the protocol between a program and its viewer: messages that pass the check have
//! texts, counts and sizes within their limits, and are written and read the same again.

use busbar_protocol::framing::{Decoder, LENGTH_BYTES, decode, encode};
use busbar_protocol::message::{
    Command, HostMessage, KeyEvent, MAX_MESSAGE_BYTES, MAX_TAGS_A_MESSAGE, MAX_TEXT_BYTES,
    MAX_TYPED_BYTES, ViewerMessage,
};
use busbar_protocol::pictures::picture_bytes;

/// Runs one input. Its first byte selects the side that reads, and the pieces.
pub fn fuzz_one(bytes: &[u8]) -> bool {
    let Some((&kind, rest)) = bytes.split_first() else { return false };
    let piece = 1 + usize::from(kind >> 1);
    match kind & 1 {
        0 => read(rest, piece, |message: HostMessage| {
            if message.check().is_ok() {
                is_within_limits(&message);
                is_the_same_again(&message);
            }
        }),
        _ => read(rest, piece, |message: ViewerMessage| is_the_same_again(&message)),
    }
}

fn read<T: serde::de::DeserializeOwned>(bytes: &[u8], piece: usize, check: impl Fn(T)) -> bool {
    let mut decoder = Decoder::new(MAX_MESSAGE_BYTES);
    let mut count = 0;
    for piece in bytes.chunks(piece) {
        decoder.push(piece);
        loop {
            match decoder.message() {
                Ok(Some(message)) => check(message),
                Ok(None) => break,
                Err(_) => return false,
            }
            count += 1;
        }
    }
    count > 0
}

fn is_within_limits(message: &HostMessage) {
    match message {
        HostMessage::Start(begin) => {
            assert!(begin.config.len() <= MAX_TEXT_BYTES && picture_bytes(begin.size).is_some());
        }
        HostMessage::Command(Command::Resize(size)) => assert!(picture_bytes(*size).is_some()),
        HostMessage::Command(Command::SetTags(tags)) => {
            assert!(tags.len() <= MAX_TAGS_A_MESSAGE);
            assert!(tags.iter().all(|tag| tag.tag.len() <= MAX_TEXT_BYTES));
        }
        HostMessage::Command(Command::SetCamera(pose)) => {
            assert!(pose.eye.iter().chain(&pose.target).all(|number| number.is_finite()));
        }
        HostMessage::Command(Command::SetTheta(Some(theta))) => {
            assert!((0.0..=1.0).contains(theta))
        }
        HostMessage::Command(Command::Key(
            KeyEvent::Key { key: typed, .. } | KeyEvent::Text(typed),
        )) => {
            assert!(typed.len() <= MAX_TYPED_BYTES);
        }
        HostMessage::Command(_) => {}
    }
}

fn is_the_same_again<T: serde::Serialize + serde::de::DeserializeOwned>(message: &T) {
    let written = encode(message, usize::MAX).expect("what was read can be written");
    let again: T = decode(&written[LENGTH_BYTES..]).expect("and read");
    // By bytes: a number that is none equals nothing.
    assert_eq!(encode(&again, usize::MAX).expect("once more"), written);
}

#[test]
fn kept_inputs_and_mutations_of_them() {
    fuzz_corpus::check("protocol", fuzz_one);
}
