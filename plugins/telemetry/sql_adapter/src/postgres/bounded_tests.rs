use proptest::prelude::*;

use super::*;

fn message(kind: u8, body: &[u8]) -> Vec<u8> {
    [&[kind][..], &(body.len() as u32 + 4).to_be_bytes(), body].concat()
}

fn advance(bytes: &[u8], piece: usize, is_encrypted: bool) -> Result<(), OversizedMessage> {
    let mut messages = Messages { is_encrypted, ..Messages::default() };
    bytes.chunks(piece).try_for_each(|piece| messages.advance(piece))
}

#[test]
fn messages_are_followed_however_they_are_cut() {
    let clear_text = message(AUTHENTICATION, &CLEARTEXT_PASSWORD);
    let long = [&[b'D'][..], &(MAX_MESSAGE_BYTES + 1).to_be_bytes(), b"x"].concat();
    let before = [message(b'N', b""), message(b'D', &[0; 3000]), message(b'Z', b"I")].concat();
    for piece in 1..20 {
        assert_eq!(advance(&before, piece, false), Ok(()));
        let stream = [&before[..], &clear_text].concat();
        assert_eq!(
            advance(&stream, piece, false),
            Err(OversizedMessage::ClearTextPassword),
            "{piece}"
        );
        assert_eq!(advance(&stream, piece, true), Ok(()));
        let stream = [&before[..], &long].concat();
        assert_eq!(
            advance(&stream, piece, true),
            Err(OversizedMessage::Long(MAX_MESSAGE_BYTES + 1))
        );
    }
}

#[test]
fn only_a_request_for_a_clear_text_password_is_refused() {
    // A challenge of SCRAM (10), an MD5 salt that looks like it, a row that does.
    let scram = message(AUTHENTICATION, b"\0\0\0\x0aSCRAM-SHA-256\0\0");
    let md5 = message(AUTHENTICATION, &[0, 0, 0, 5, 0, 0, 0, 3]);
    let row = message(b'D', &CLEARTEXT_PASSWORD);
    for messages in [&scram, &md5, &row, &[scram.clone(), md5.clone(), row.clone()].concat()] {
        for piece in 1..12 {
            assert_eq!(advance(messages, piece, false), Ok(()), "{messages:?}");
        }
    }
}

proptest! {
    #[test]
    fn nothing_panics(bytes in proptest::collection::vec(any::<u8>(), 0..300), piece in 1..9_usize) {
        let whole = advance(&bytes, bytes.len().max(1), false);
        prop_assert_eq!(advance(&bytes, piece, false), whole, "pieces change nothing");
    }
}
