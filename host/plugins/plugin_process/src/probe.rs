//! Entry points for fuzzing: messages and rings of a plugin's process, without a process.

use std::fs::File;
use std::os::unix::fs::FileExt;

use busbar_geometry::{CollapseSequence, Mesh};
use busbar_plugin_host::{
    LinkReport, MAX_DIAGNOSTICS, OverlayBinding, OverlayDescription, OverlayPicture, PictureRules,
    PluginError, SampleSink, SourcePolicy, TelemetryTag, check_commands, check_stages,
};

use crate::framing::{self, Decoder};
use crate::loaded::check_infos;
use crate::memory;
use crate::message::{Answer, FromPlugin};
use crate::ring::{RING_BYTES, RingReader};
use crate::sample_feed::SampleFeed;

/// Results of decoding a message.
#[derive(Debug)]
pub enum DecodedMessage {
    /// A picture that may be drawn.
    Picture(OverlayPicture),
    /// Result of a failed call.
    Failed(PluginError),
    /// Number of collapses in the shared buffer.
    Optimized(u32),
    /// A rule that it breaks.
    Broken(String),
    /// Message of another kind.
    Other,
}

/// The host's side of an isolated plugin.
pub struct HostSide {
    decoder: Decoder,
    feed: SampleFeed,
    ring: File,
    rules: PictureRules,
}

impl HostSide {
    /// Creates the host's side for a plugin with these tags and bindings.
    ///
    /// # Errors
    /// When the system has no memory to share.
    pub fn new(tags: &[TelemetryTag], bindings: &[OverlayBinding]) -> Result<Self, String> {
        let ring =
            memory::zeroed("ring", RING_BYTES).map_err(|error| format!("no ring: {error}"))?;
        let mut feed = SampleFeed::new(tags, SourcePolicy::default());
        feed.attach(RingReader::new(&ring)?);
        Ok(Self {
            decoder: framing::decoder(),
            feed,
            ring,
            rules: PictureRules::new(bindings, &OverlayDescription::default()),
        })
    }

    /// Decodes bytes of the socket.
    ///
    /// # Errors
    /// Why the process would be ended.
    pub fn receive(
        &mut self,
        bytes: &[u8],
        mut handle: impl FnMut(DecodedMessage),
    ) -> Result<(), String> {
        self.decoder.push(bytes);
        while let Some(message) = self.decoder.message::<FromPlugin>()? {
            // What was read can be written, and then is read as the same.
            let written = framing::encode(&message)?;
            let again: FromPlugin = framing::decode(&written[framing::LENGTH_BYTES..])?;
            if framing::encode(&again)? != written {
                return Err("a message that is another one when written again".into());
            }
            handle(self.decode(message));
        }
        Ok(())
    }

    fn decode(&mut self, message: FromPlugin) -> DecodedMessage {
        let result = match message {
            FromPlugin::Pong | FromPlugin::Progress { .. } => return DecodedMessage::Other,
            FromPlugin::Link { state, message } => {
                self.feed.note_link(state, &message);
                return DecodedMessage::Other;
            }
            FromPlugin::Done { result, .. } => result,
        };
        let checked = match result {
            Err(fault) => return DecodedMessage::Failed(fault.into_error("plugin")),
            Ok(Answer::Done | Answer::Simulating(_) | Answer::OptimizerDescribed { .. }) => {
                return DecodedMessage::Other;
            }
            Ok(Answer::Capability(answer)) => {
                answer.check_for_any_request().map(|()| DecodedMessage::Other)
            }
            Ok(Answer::Commands(commands)) => {
                check_commands(&commands).map(|()| DecodedMessage::Other)
            }
            Ok(Answer::Ran(report)) => {
                let kept = report.bounded().diagnostics.len();
                let rule = (kept <= MAX_DIAGNOSTICS).then_some(DecodedMessage::Other);
                rule.ok_or_else(|| format!("{kept} diagnostics are kept"))
            }
            Ok(Answer::Loaded { plugins, .. }) => {
                check_infos(&plugins).map(|()| DecodedMessage::Other)
            }
            Ok(Answer::Configured(description)) => {
                let checked = description.check().map(|()| DecodedMessage::Other);
                checked.map_err(str::to_owned)
            }
            Ok(Answer::Drawn(picture)) => self
                .rules
                .check(&picture)
                .map(|()| DecodedMessage::Picture(picture))
                .map_err(str::to_owned),
            Ok(Answer::Optimized { collapses, stages, .. }) => {
                let stages = check_stages(&stages).map_err(str::to_owned);
                stages.map(|()| DecodedMessage::Optimized(collapses))
            }
        };
        checked.unwrap_or_else(DecodedMessage::Broken)
    }

    /// Writes into the ring as its process can: anywhere.
    ///
    /// # Errors
    /// When that is beyond its end, which never changes.
    pub fn write_ring(&self, bytes: &[u8], at: u64) -> Result<(), String> {
        let inside = at.checked_add(bytes.len() as u64).is_some_and(|end| end <= RING_BYTES);
        let end = || "beyond the end of the ring".to_owned();
        inside.then_some(()).ok_or_else(end)?;
        self.ring.write_all_at(bytes, at).map_err(|error| error.to_string())
    }

    /// Delivers the received samples, and returns the state of the link.
    pub fn drain(&mut self, sink: &mut impl SampleSink) -> LinkReport {
        self.feed.drain(sink);
        self.feed.link()
    }
}

/// Reads `count` collapses that a process wrote into the buffer for those of a mesh.
///
/// # Errors
/// The rule that they break, in words.
pub fn read_collapses(bytes: &[u8], count: u32, mesh: &Mesh) -> Result<CollapseSequence, String> {
    let in_words = |error: std::io::Error| error.to_string();
    let room = memory::room_for_collapses(mesh).map_err(in_words)?;
    room.write_all_at(bytes, 0).map_err(in_words)?;
    let entries = memory::read_collapses(count, &room).map_err(in_words)?;
    let positions = mesh.positions.len() as u32;
    CollapseSequence::new(entries, positions).map_err(|error| error.to_string())
}
