//! What a plugin's process may write, without a process: for fuzzing.

use std::fs::File;
use std::os::unix::fs::FileExt;

use busbar_geometry::{CollapseSequence, Mesh};
use busbar_plugin_host::{
    LinkReport, MAX_DIAGNOSTICS, MAX_PAGE_RECORDS, MAX_PAGE_ROWS, OverlayBinding,
    OverlayDescription, OverlayPicture, PictureRules, PluginError, SampleSink, SourcePolicy,
    TelemetryTag, check_commands, check_stages,
};

use crate::feed::Feed;
use crate::framing::{self, Decoder};
use crate::loaded::check_infos;
use crate::memory;
use crate::message::{Answer, FromPlugin};
use crate::ring::{RING_BYTES, RingReader};

/// What a message comes to.
#[derive(Debug)]
pub enum ReceivedMessages {
    /// A picture that may be drawn.
    Picture(OverlayPicture),
    /// A failed call.
    Failed(PluginError),
    /// So many collapses lie in the room for them.
    Optimized(u32),
    /// A rule that it breaks.
    Broken(String),
    /// Anything else.
    Other,
}

/// The host's side of an isolated plugin.
pub struct HostSide {
    decoder: Decoder,
    feed: Feed,
    ring: File,
    rules: PictureRules,
}

impl HostSide {
    /// For a plugin with these tags and bindings.
    ///
    /// # Errors
    /// When the system has no memory to share.
    pub fn new(tags: &[TelemetryTag], bindings: &[OverlayBinding]) -> Result<Self, String> {
        let ring =
            memory::zeroed("ring", RING_BYTES).map_err(|error| format!("no ring: {error}"))?;
        let mut feed = Feed::new(tags, SourcePolicy::default());
        feed.attach(RingReader::new(&ring)?);
        Ok(Self {
            decoder: framing::decoder(),
            feed,
            ring,
            rules: PictureRules::new(bindings, &OverlayDescription::default()),
        })
    }

    /// Takes bytes of the socket.
    ///
    /// # Errors
    /// Why the process would be ended.
    pub fn receive(
        &mut self,
        bytes: &[u8],
        mut heed: impl FnMut(ReceivedMessages),
    ) -> Result<(), String> {
        self.decoder.push(bytes);
        while let Some(message) = self.decoder.message::<FromPlugin>()? {
            // What was read can be written, and then is read as the same.
            let written = framing::encode(&message)?;
            let again: FromPlugin = framing::decode(&written[framing::LENGTH_BYTES..])?;
            if framing::encode(&again)? != written {
                return Err("a message that is another one when written again".into());
            }
            heed(self.take(message));
        }
        Ok(())
    }

    fn take(&mut self, message: FromPlugin) -> ReceivedMessages {
        let result = match message {
            FromPlugin::Pong | FromPlugin::Progress { .. } => return ReceivedMessages::Other,
            FromPlugin::Link { state, message } => {
                self.feed.note_link(state, &message);
                return ReceivedMessages::Other;
            }
            FromPlugin::Done { result, .. } => result,
        };
        let checked = match result {
            Err(fault) => return ReceivedMessages::Failed(fault.into_error("plugin")),
            Ok(Answer::Done | Answer::Simulating(_) | Answer::OptimizerDescribed { .. }) => {
                return ReceivedMessages::Other;
            }
            Ok(Answer::ChartDescribed(description)) => description
                .check()
                .map(|()| ReceivedMessages::Other)
                .map_err(|fault| fault.to_string()),
            Ok(Answer::ChartRead(page)) => {
                let checked = page.check(busbar_chart::MAX_AXES as u32, MAX_PAGE_RECORDS);
                checked.map(|()| ReceivedMessages::Other).map_err(str::to_owned)
            }
            Ok(Answer::Explained(explanation)) => {
                let checked = explanation.check(usize::MAX);
                checked.map(|()| ReceivedMessages::Other).map_err(|fault| fault.to_string())
            }
            Ok(Answer::RecordsDescribed(description)) => description
                .check()
                .map(|()| ReceivedMessages::Other)
                .map_err(|fault| fault.to_string()),
            Ok(Answer::RecordsRead(page)) => {
                let columns = page.rows.first().map_or(0, |row| row.cells.len()) as u32;
                let checked = page.check(columns, MAX_PAGE_ROWS);
                checked.map(|()| ReceivedMessages::Other).map_err(|fault| fault.to_string())
            }
            Ok(Answer::AlarmsRead(report)) => {
                let checked = report.check(report.revision);
                checked.map(|()| ReceivedMessages::Other).map_err(|fault| fault.to_string())
            }
            Ok(Answer::Commands(commands)) => {
                check_commands(&commands).map(|()| ReceivedMessages::Other)
            }
            Ok(Answer::Ran(report)) => {
                let kept = report.bounded().diagnostics.len();
                let rule = (kept <= MAX_DIAGNOSTICS).then_some(ReceivedMessages::Other);
                rule.ok_or_else(|| format!("{kept} diagnostics are kept"))
            }
            Ok(Answer::Loaded { plugins, .. }) => {
                check_infos(&plugins).map(|()| ReceivedMessages::Other)
            }
            Ok(Answer::Configured(description)) => {
                let checked = description.check().map(|()| ReceivedMessages::Other);
                checked.map_err(str::to_owned)
            }
            Ok(Answer::Drawn(picture)) => self
                .rules
                .check(&picture)
                .map(|()| ReceivedMessages::Picture(picture))
                .map_err(str::to_owned),
            Ok(Answer::Optimized { collapses, stages }) => {
                let stages = check_stages(&stages).map_err(str::to_owned);
                stages.map(|()| ReceivedMessages::Optimized(collapses))
            }
        };
        checked.unwrap_or_else(ReceivedMessages::Broken)
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

    /// Hands over the samples that came, and says how the link is.
    pub fn drain(&mut self, sink: &mut impl SampleSink) -> LinkReport {
        self.feed.drain(sink);
        self.feed.link()
    }
}

/// What the host makes of `count` collapses that a process left in the room for those of a
/// mesh.
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
