//! Samples as a plugin published them, copied out of its memory.

use busbar_plugin_abi as abi;
use busbar_types::{MAX_TEXT_BYTES, Text, Value};

/// Sample of a plugin that nothing has judged yet: numbers as they came, in memory of the host's.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PublishedSample {
    /// Handle of the tag.
    pub tag: u32,
    /// Kind of the value, one of `BUSBAR_VALUE_KIND_*`.
    pub kind: u8,
    /// Quality, one of `BUSBAR_QUALITY_*`.
    pub quality: u8,
    /// Reason of the quality, one of `BUSBAR_REASON_*`.
    pub reason: u8,
    /// Flags, `BUSBAR_SAMPLE_*` and `BUSBAR_ORIGIN_*` or'ed.
    pub flags: u8,
    /// Bits of a value of any kind but text; see [`Value::bits`].
    pub bits: u64,
    /// Source timestamp, nanoseconds since 1970-01-01 UTC, or `BUSBAR_NO_TIME`.
    pub source_time_unix_nanos: i64,
    /// Value of kind text; none for every other.
    pub text: Option<Text>,
}

/// Copies a text out of a plugin's memory, as far as it goes. A null one with a length is a mark of
/// what cannot be understood.
///
/// # Safety
/// If `text.ptr` is not null, `text.len` bytes behind it are readable.
unsafe fn read_text(text: abi::BusbarStr) -> Text {
    if text.ptr.is_null() {
        return Text::cut(if text.len == 0 { "" } else { "\u{fffd}" });
    }
    // One byte more than fits tells that there are more.
    let len = text.len.min(MAX_TEXT_BYTES + 1);
    // SAFETY: not null; the caller vouches for `text.len` bytes.
    Text::from_utf8_lossy(unsafe { std::slice::from_raw_parts(text.ptr, len) })
}

impl PublishedSample {
    /// # Safety
    /// If the kind is text and its pointer is not null, the bytes of its length are readable.
    #[inline]
    unsafe fn read(raw: &abi::BusbarSample) -> Self {
        let &abi::BusbarSample { tag, kind, quality, reason, flags, .. } = raw;
        let (bits, text) = match kind {
            abi::BUSBAR_VALUE_KIND_F64 => (raw.number.to_bits(), None),
            // SAFETY: as the caller vouches.
            abi::BUSBAR_VALUE_KIND_TEXT => (0, Some(unsafe { read_text(raw.text) })),
            _ => (raw.integer.cast_unsigned(), None),
        };
        let source_time_unix_nanos = raw.source_time_unix_nanos;
        Self { tag, kind, quality, reason, flags, bits, source_time_unix_nanos, text }
    }

    /// Lays out the fields of a value, or that there is none.
    pub(crate) fn value_fields(value: Option<&Value>) -> (u8, u64, Option<Text>) {
        let Some(value) = value else { return (abi::BUSBAR_VALUE_KIND_NONE, 0, None) };
        let text = match value {
            Value::Text(text) => Some(text.clone()),
            _ => None,
        };
        (value.kind().code(), value.bits().unwrap_or_default(), text)
    }
}

/// Batch of samples in a plugin's memory, from which each is copied as it is needed.
#[derive(Clone, Copy, Debug)]
pub struct PublishedBatch<'a>(&'a [abi::BusbarSample]);

impl<'a> PublishedBatch<'a> {
    /// Wraps samples of a plugin.
    ///
    /// # Safety
    /// The texts of samples of kind text are null or readable for their lengths, during `'a`.
    pub unsafe fn new(samples: &'a [abi::BusbarSample]) -> Self {
        Self(samples)
    }

    /// Returns the number of samples.
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// Reports whether there are no samples.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Copies the samples, in order.
    pub fn samples(self) -> impl ExactSizeIterator<Item = PublishedSample> + 'a {
        // SAFETY: whoever made the batch vouches for the texts.
        self.0.iter().map(|raw| unsafe { PublishedSample::read(raw) })
    }
}
