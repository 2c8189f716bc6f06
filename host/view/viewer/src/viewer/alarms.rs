//! Alarms: what an embedding host says and asks of them.

use busbar_alarms::State;
use busbar_tags::SourceTime;

use super::*;

impl Viewer {
    /// Sets the operator for later alarm actions, as the audit log names them.
    pub fn set_operator(&mut self, name: &str) {
        name.clone_into(&mut self.operator);
    }

    /// Sets a mirrored alarm to the state that the host's alarm system has it in, by the
    /// letter of IEC 62682: `A` to `I`. `until` is the end of its time on the shelf.
    ///
    /// # Errors
    /// An alarm that does not exist or is not mirrored.
    pub fn mirror_alarm(
        &mut self,
        id: &str,
        state: State,
        until: Option<SourceTime>,
        operator: Option<&str>,
    ) -> Result<(), ViewError> {
        self.site.mirror_alarm(id, state, until, operator).map_err(ViewError::Alarm)
    }

    /// Draws equipment in unacknowledged alarm in full detail, and all equipment in alarm
    /// individually, since a proxy may omit it.
    pub(super) fn apply_alarm_detail(&mut self) {
        let changed = self.alarms.changed_detail(&self.site, &self.scene.graph);
        if let Some([unacknowledged, all]) = changed {
            self.lod_cursors.set_full_detail(unacknowledged);
            self.lod_cursors.set_individual(all);
        }
    }
}
