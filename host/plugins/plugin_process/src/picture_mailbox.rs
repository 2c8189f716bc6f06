//! The pictures of one isolated overlay, on the host's side.
//!
//! The frame leaves what it wants drawn and takes the last whole picture there
//! is; it never waits for the plugin, unless it is told to.

use std::sync::Arc;
use std::time::{Duration, SystemTime};

use busbar_plugin_host::{
    OverlayBinding, OverlayDescription, OverlayPicture, PictureRules, PluginError,
};
use busbar_tags::{Moment, TagState};

use crate::message::CallError;

/// A picture worked out from older values than this is late; a machine's sleep counts.
pub(crate) const MAX_PICTURE_AGE: Duration = Duration::from_millis(500);

/// Request of a frame to draw the overlay.
#[derive(Debug)]
pub(crate) struct DrawRequest {
    /// Sequence number of the request.
    pub(crate) number: u64,
    pub(crate) states: Vec<Option<TagState>>,
    pub(crate) scene_time: SystemTime,
    /// Time at which the values were read.
    pub(crate) since: Moment,
}

/// Last answer of the plugin.
struct DrawAnswer {
    number: u64,
    since: Moment,
    picture: Result<Arc<OverlayPicture>, String>,
}

/// One overlay's wishes and pictures.
pub(crate) struct PictureMailbox {
    bindings: Vec<OverlayBinding>,
    description: Arc<OverlayDescription>,
    rules: PictureRules,
    requested: Option<DrawRequest>,
    /// The frame whose picture is being worked out, and when its values were read.
    in_flight: Option<(u64, Moment)>,
    drawn: Option<DrawAnswer>,
    next: u64,
}

impl PictureMailbox {
    pub(crate) fn new(bindings: Vec<OverlayBinding>) -> Self {
        let description = Arc::<OverlayDescription>::default();
        let rules = PictureRules::new(&bindings, &description);
        Self {
            bindings,
            description,
            rules,
            requested: None,
            in_flight: None,
            drawn: None,
            next: 1,
        }
    }

    /// Stores the plugin's description of the overlay.
    ///
    /// # Errors
    /// The limit that it exceeds, in words.
    pub(crate) fn describe(&mut self, description: OverlayDescription) -> Result<(), &'static str> {
        description.check()?;
        self.rules = PictureRules::new(&self.bindings, &description);
        self.description = Arc::new(description);
        Ok(())
    }

    /// Returns the last description; the default before the first one.
    pub(crate) fn description(&self) -> &Arc<OverlayDescription> {
        &self.description
    }

    pub(crate) fn bindings(&self) -> &[OverlayBinding] {
        &self.bindings
    }

    /// Replaces the pending request; returns the number of the new one.
    pub(crate) fn request(&mut self, states: Vec<Option<TagState>>, scene_time: SystemTime) -> u64 {
        let number = self.next;
        self.next += 1;
        self.requested = Some(DrawRequest { number, states, scene_time, since: Moment::now() });
        number
    }

    /// Takes the pending request, unless one is in flight.
    pub(crate) fn take(&mut self) -> Option<DrawRequest> {
        if self.in_flight.is_some() {
            return None;
        }
        let wanted = self.requested.take()?;
        self.in_flight = Some((wanted.number, wanted.since));
        Some(wanted)
    }

    /// Stores the answer to the request in flight.
    pub(crate) fn answer(&mut self, id: &str, picture: Result<OverlayPicture, CallError>) {
        let Some((number, since)) = self.in_flight.take() else { return };
        let picture = picture.map_err(|fault| fault.into_error(id).to_string());
        let checked = picture.and_then(|picture| match self.rules.check(&picture) {
            Ok(()) => Ok(picture),
            Err(what) => {
                let violation = PluginError::Violation { id: id.to_owned(), what: what.into() };
                Err(violation.to_string())
            }
        });
        self.drawn = Some(DrawAnswer { number, since, picture: checked.map(Arc::new) });
    }

    /// Discards picture and request of a process that ended.
    pub(crate) fn clear(&mut self) {
        (self.in_flight, self.drawn) = (None, None);
    }

    /// Reports whether the answer to this request, or a later one, is there.
    pub(crate) fn has(&self, number: u64) -> bool {
        self.drawn.as_ref().is_some_and(|drawn| drawn.number >= number)
    }

    /// The last whole picture, if it is not too old to be shown.
    pub(crate) fn picture(&self) -> Option<Result<Arc<OverlayPicture>, String>> {
        let drawn = self.drawn.as_ref()?;
        (Moment::now().since(drawn.since) <= MAX_PICTURE_AGE).then(|| drawn.picture.clone())
    }
}

#[cfg(test)]
mod tests {
    use busbar_plugin_host::OverlayTint;
    use busbar_tags::TagHandle;
    use busbar_types::Severity;

    use super::*;

    fn take(mailbox: &mut PictureMailbox) -> u64 {
        mailbox.take().expect("a wish").number
    }

    #[test]
    fn only_the_last_wish_is_worked_on_and_one_at_a_time() {
        let mut mailbox = PictureMailbox::new(Vec::new());
        assert!(mailbox.take().is_none());
        let now = SystemTime::now();
        mailbox.request(Vec::new(), now);
        let second = mailbox.request(Vec::new(), now);
        assert_eq!(take(&mut mailbox), second);
        let third = mailbox.request(Vec::new(), now);
        assert!(mailbox.take().is_none(), "one is under way");
        mailbox.answer("p", Ok(OverlayPicture::default()));
        assert!(mailbox.has(second) && !mailbox.has(third));
        assert!(matches!(mailbox.picture(), Some(Ok(_))));
        assert_eq!(take(&mut mailbox), third);
        mailbox.clear();
        assert!(mailbox.picture().is_none());
        mailbox.answer("p", Ok(OverlayPicture::default()));
        assert!(mailbox.picture().is_none(), "an answer of a process that is gone");
    }

    #[test]
    fn a_picture_of_what_is_not_bound_is_a_fault() {
        let mut mailbox = PictureMailbox::new(Vec::new());
        mailbox.request(Vec::new(), SystemTime::now());
        mailbox.take();
        let tint = OverlayTint { node: 1, tag: TagHandle(1), severity: Severity::Alarm };
        mailbox.answer("p", Ok(OverlayPicture { tints: vec![tint], ..OverlayPicture::default() }));
        let Some(Err(fault)) = mailbox.picture() else { panic!("a fault") };
        assert!(fault.contains("not bound"), "{fault}");
    }

    #[test]
    fn an_old_picture_is_not_shown() {
        let mut mailbox = PictureMailbox::new(Vec::new());
        mailbox.request(Vec::new(), SystemTime::now());
        mailbox.take();
        mailbox.answer("p", Ok(OverlayPicture::default()));
        let old = Moment::now().before(MAX_PICTURE_AGE * 2);
        mailbox.drawn.as_mut().unwrap().since = old;
        assert!(mailbox.picture().is_none());
    }
}
