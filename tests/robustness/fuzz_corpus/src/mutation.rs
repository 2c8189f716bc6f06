//! Seeded mutation of inputs.

use fastrand::Rng;

/// Greatest number of changes of one input; each more is half as likely.
const MAX_CHANGES: u32 = 4;
/// Length limit of a part that is copied, moved or removed, bytes.
const MAX_PART_BYTES: usize = 48;
/// Text fragments that are difficult for parsers.
const HARD_TEXTS: [&[u8]; 22] = [
    b"",
    b"0",
    b"-1",
    b"1",
    b"255",
    b"256",
    b"65536",
    b"2147483648",
    b"4294967295",
    b"9223372036854775808",
    b"18446744073709551616",
    b"1e999",
    b"-1e-999",
    b"NaN",
    b"null",
    b"\"",
    b"{",
    b"]",
    b"\n",
    b"\\u0000",
    b"\xC3\xA9",
    b"\xFF\xFE",
];
/// Boundary values that are difficult for parsers of binary numbers.
const HARD_NUMBERS: [u32; 8] =
    [0, 1, 0x7F, 0xFF, 0x7FFF_FFFF, 0x8000_0000, 0x7F80_0000, 0xFFFF_FFFF];

/// Mutates an input, partly by pieces of another one.
pub(crate) fn mutated(input: &[u8], other: &[u8], max_bytes: usize, random: &mut Rng) -> Vec<u8> {
    let mut bytes = input.to_vec();
    for _ in 0..(1 + random.u32(..).trailing_zeros()).min(MAX_CHANGES) {
        change(&mut bytes, other, random);
    }
    bytes.truncate(max_bytes);
    bytes
}

fn change(bytes: &mut Vec<u8>, other: &[u8], random: &mut Rng) {
    let at = random.usize(..=bytes.len());
    let end = (at + random.usize(..=MAX_PART_BYTES)).min(bytes.len());
    match random.u8(..10) {
        0 => bytes.truncate(at),
        1 => drop(bytes.drain(at..end)),
        2 => {
            let part = bytes[at..end].to_vec();
            let to = random.usize(..=bytes.len());
            bytes.splice(to..to, part);
        }
        3 => {
            let from = random.usize(..=other.len());
            let until = (from + random.usize(..=MAX_PART_BYTES)).min(other.len());
            bytes.splice(at..end, other[from..until].iter().copied());
        }
        4 => {
            let text = HARD_TEXTS[random.usize(..HARD_TEXTS.len())];
            bytes.splice(at..at, text.iter().copied());
        }
        5 => replace_number(bytes, at, random),
        6 => {
            let number = HARD_NUMBERS[random.usize(..HARD_NUMBERS.len())].to_le_bytes();
            let number = &number[..[1, 2, 4][random.usize(..3)]];
            let end = (at + number.len()).min(bytes.len());
            bytes.splice(at..end, number.iter().copied());
        }
        7 => {
            if let Some(byte) = bytes.get_mut(at) {
                *byte ^= 1 << random.u8(..8);
            }
        }
        _ => {
            if let Some(byte) = bytes.get_mut(at) {
                *byte = random.u8(..);
            }
        }
    }
}

/// Replaces the first number after `at` by another text.
fn replace_number(bytes: &mut Vec<u8>, at: usize, random: &mut Rng) {
    let is_digit = |byte: &u8| byte.is_ascii_digit();
    let Some(start) = bytes[at..].iter().position(is_digit).map(|place| at + place) else {
        return;
    };
    let digits = bytes[start..].iter().take_while(|byte| is_digit(byte)).count();
    let text = HARD_TEXTS[random.usize(..HARD_TEXTS.len())];
    bytes.splice(start..start + digits, text.iter().copied());
}
