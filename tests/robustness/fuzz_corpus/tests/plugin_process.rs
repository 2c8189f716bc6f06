//! Fuzzing of the plugin's process boundary: socket, sample ring and shared collapse list. Samples
//! are of the plugin's own tags and not from the future, pictures name bound nodes, texts are short
//! and printable, and collapses are a forest.

use std::time::Duration;

use busbar_geometry::Mesh;
use busbar_plugin_host::{MAX_LINK_MESSAGE_BYTES, OverlayBinding, TelemetryTag};
use busbar_plugin_process::probe::{DecodedMessage, HostSide, read_collapses};
use busbar_tags::{Moment, Sample, TagHandle};
use busbar_types::ValueKind;
use glam::Vec3;

/// Tags of the plugin, with odd numbers; nodes follow.
const TAGS: [u32; 3] = [1, 3, 5];
const NODES: [u32; 2] = [7, 9];
/// Size far above that of any text message, bytes.
const MANY_BYTES: usize = 1 << 21;
/// Byte offsets of the counters of a ring; samples come after the last, in order.
const RING_COUNTERS: [u64; 4] = [0, 64, 128, 192];
const RING_HEADER_BYTES: u64 = 256;
const RING_SAMPLES: u64 = 1 << 18;
const SAMPLE_BYTES: usize = 32;
const POSITIONS: usize = 16;

/// Runs one input. Its first byte selects the form of the rest: bytes of the socket, in pieces,
/// words of the ring, or collapses.
pub fn fuzz_one(bytes: &[u8]) -> bool {
    let Some((&kind, rest)) = bytes.split_first() else { return false };
    match kind & 3 {
        0 | 1 => are_messages(rest, 1 + usize::from(kind >> 2)),
        2 => are_samples(rest),
        _ => is_sequence(rest, u32::from(kind >> 2)),
    }
}

fn are_messages(bytes: &[u8], piece: usize) -> bool {
    let mut host = host_side();
    let mut count = 0;
    for piece in bytes.chunks(piece) {
        let handle = |heard| {
            count += 1;
            check_message(heard);
        };
        if let Err(fault) = host.receive(piece, handle) {
            assert!(!fault.contains("another one"), "{fault}");
            return false;
        }
    }
    let link = host.drain(&mut |_: &Sample| panic!("nothing is in the ring"));
    assert!(link.message.len() <= 3 * MAX_LINK_MESSAGE_BYTES, "{}", link.message);
    assert!(!link.message.chars().any(char::is_control));
    count > 0
}

fn check_message(heard: DecodedMessage) {
    match heard {
        DecodedMessage::Picture(picture) => {
            let lines = picture.lines.iter().map(|line| (line.node, line.tag));
            for (node, TagHandle(tag)) in lines.chain(picture.tints.iter().map(|t| (t.node, t.tag)))
            {
                assert!(NODES.contains(&node) && TAGS.contains(&tag), "{picture:?}");
            }
        }
        DecodedMessage::Failed(error) => {
            let words = error.to_string();
            assert!(words.len() <= MANY_BYTES);
            assert!(!words.chars().any(|c| c.is_control() && c != '\n'), "{words:?}");
        }
        DecodedMessage::Broken(rule) => assert!(!rule.is_empty()),
        DecodedMessage::Optimized(_) | DecodedMessage::Other => {}
    }
}

/// Checks a ring: eight bytes each of the numbers written, read, rejected and dropped, then the
/// samples before the number written.
fn are_samples(bytes: &[u8]) -> bool {
    let Some((header, samples)) = bytes.split_first_chunk::<32>() else { return false };
    let mut header = *header;
    // A ring that claims to be full takes long to read: tests beside it do that.
    header[1..8].fill(0);
    let mut host = host_side();
    for (word, place) in header.chunks_exact(8).zip(RING_COUNTERS) {
        host.write_ring(word, place).expect("it is in the header");
    }
    let [a, b, c, d, e, f, g, h, ..] = header;
    let written = u64::from_le_bytes([a, b, c, d, e, f, g, h]);
    for (number, sample) in (1_u64..).zip(samples.chunks_exact(SAMPLE_BYTES)) {
        let slot = written.wrapping_sub(number) % RING_SAMPLES;
        let place = RING_HEADER_BYTES + slot * SAMPLE_BYTES as u64;
        host.write_ring(sample, place).expect("it is in the ring");
    }
    let mut taken = 0;
    let first = host.drain(&mut |sample: &Sample| {
        taken += 1;
        check_sample(sample);
    });
    assert!(taken <= RING_SAMPLES);
    let second = host.drain(&mut |_: &Sample| panic!("they are there once"));
    assert_eq!(first.rejected, second.rejected);
    taken > 0
}

fn check_sample(sample: &Sample) {
    assert!(TAGS.contains(&sample.tag.0), "{sample:?}");
    assert!(sample.received <= Moment::now(), "{sample:?}");
    assert!(sample.valid_from <= sample.received, "{sample:?}");
}

fn is_sequence(bytes: &[u8], count: u32) -> bool {
    let mesh = Mesh { positions: vec![Vec3::ZERO; POSITIONS], ..Mesh::default() };
    let Ok(sequence) = read_collapses(bytes, count, &mesh) else { return false };
    assert_eq!(sequence.len(), count);
    let mut removed = [false; POSITIONS];
    let mut error = 0.0;
    for collapse in sequence.entries() {
        let [from, to] = [collapse.removed, collapse.kept].map(|position| position as usize);
        assert!(from != to && !removed[from] && !removed[to], "{collapse:?}");
        assert!(collapse.error.is_finite() && collapse.error >= error, "{collapse:?}");
        (removed[from], error) = (true, collapse.error);
    }
    count > 0
}

/// Returns the type of a tag; the last one is a text.
fn kind_of(tag: u32) -> ValueKind {
    if tag == TAGS[2] { ValueKind::Text } else { ValueKind::F64 }
}

fn host_side() -> HostSide {
    let tags = TAGS.map(|tag| TelemetryTag {
        tag: TagHandle(tag),
        kind: kind_of(tag),
        freshness: Duration::from_secs(3),
        id: format!("tag{tag}"),
        address_json: "{}".into(),
        unit: String::new(),
    });
    let bindings = TAGS.map(|tag| OverlayBinding {
        tag: TagHandle(tag),
        node: NODES[tag as usize % NODES.len()],
        kind: kind_of(tag),
        limit_low: None,
        limit_high: None,
        tag_id: format!("tag{tag}"),
        tag_name: String::new(),
        unit: String::new(),
        node_id: String::new(),
        role: String::new(),
    });
    HostSide::new(&tags, &bindings).expect("there is memory")
}

#[test]
fn kept_inputs_and_mutations_of_them() {
    fuzz_corpus::check("plugin_process", fuzz_one);
}
