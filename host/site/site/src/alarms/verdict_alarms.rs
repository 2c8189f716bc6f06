//! Alarms that follow the verdicts of overlays: one configured for a piece of equipment, or one
//! for each piece that an overlay judges.

use std::collections::BTreeSet;
use std::sync::Arc;

use busbar_alarms::{
    AlarmHandle, AlarmSource, AlarmTable, AlarmTemplate, MAX_ALARMS, VerdictInput,
};
use busbar_overlay_picture::OverlayDescription;
use busbar_tags::{Snapshot, TagSet};
use busbar_types::{Origin, Severity};

use crate::equipment::{EquipmentDirectory, EquipmentNumber};
use crate::overlay_instance::OverlayInstance;
use crate::verdicts::{PieceVerdict, urgency};

/// Values of a step that verdicts rest on.
#[derive(Clone, Copy)]
pub(crate) struct VerdictValues<'a> {
    pub(crate) tags: &'a TagSet,
    pub(crate) snapshot: Snapshot<'a>,
}

/// Alarms of a table that follow verdicts.
#[derive(Default)]
pub(super) struct VerdictAlarms {
    templates: Arc<[AlarmTemplate]>,
    /// Alarms by overlay, of each overlay that any alarm follows.
    overlays: Vec<OverlayAlarms>,
    /// Pieces of equipment that have no alarm, for want of room.
    left_out: usize,
}

/// Alarms that follow one overlay.
struct OverlayAlarms {
    /// Plugin instance of the overlay.
    name: String,
    /// Origin that the configuration declares of the overlay's verdicts.
    origin: Origin,
    /// Description that the pieces of the alarms are of; none before the first one.
    description: Option<Arc<OverlayDescription>>,
    alarms: Vec<FollowedVerdict>,
}

/// Alarm with the pieces of equipment whose verdicts it follows.
struct FollowedVerdict {
    alarm: AlarmHandle,
    severity: Severity,
    /// True for an alarm of a template: it follows a piece under the very id that is described.
    is_of_template: bool,
    /// Indices of the equipment in the description; several under different aliases.
    pieces: Vec<usize>,
    /// Verdict that the alarm table was told last.
    told: Option<PieceVerdict>,
}

impl VerdictAlarms {
    /// Creates the list of the alarms of a table that follow verdicts. `declared` tells the origin
    /// that the configuration declares of an overlay.
    pub(super) fn new(
        templates: &Arc<[AlarmTemplate]>,
        table: &AlarmTable,
        declared: impl Fn(&str) -> Origin,
    ) -> Self {
        let mut alarms = Self { templates: Arc::clone(templates), ..Self::default() };
        let own = table.set().specs().iter().filter_map(|spec| match &spec.source {
            AlarmSource::Verdict { trigger, .. } => Some(trigger.overlay.as_str()),
            AlarmSource::Tag { .. } | AlarmSource::Mirrored => None,
        });
        let names: BTreeSet<&str> =
            own.chain(templates.iter().map(AlarmTemplate::overlay)).collect();
        alarms.overlays.extend(names.into_iter().map(|name| OverlayAlarms {
            name: name.to_owned(),
            origin: declared(name),
            description: None,
            alarms: Vec::new(),
        }));
        alarms.follow_new(table, 0);
        alarms
    }

    /// Returns the template of an alarm's id and the equipment that the id names.
    pub(super) fn template_of<'a>(&self, id: &'a str) -> Option<(&AlarmTemplate, &'a str)> {
        let of = |template| Some((template, AlarmTemplate::equipment_of(template, id)?));
        self.templates.iter().find_map(of)
    }

    /// Adds the alarms of templates that have these ids to a table, as far as it has room. So an
    /// alarm of the time before a restart or reload is there before its overlay judges anything.
    pub(super) fn add_known<'a>(
        &mut self,
        ids: impl Iterator<Item = &'a str>,
        table: &mut AlarmTable,
        tags: &TagSet,
    ) {
        let known = ids.filter_map(|id| self.template_of(id));
        let wanted: Vec<_> =
            known.map(|(template, equipment)| template.alarm_on(equipment)).collect();
        self.add(wanted, table, tags);
    }

    /// Adds alarms that a table does not have yet.
    fn add(
        &mut self,
        wanted: Vec<busbar_alarms::AlarmSpec>,
        table: &mut AlarmTable,
        tags: &TagSet,
    ) {
        let set = table.set();
        let mut seen = BTreeSet::new();
        let mut new: Vec<_> = wanted
            .into_iter()
            .filter(|spec| set.find(&spec.id).is_none() && seen.insert(spec.id.clone()))
            .collect();
        let first = set.specs().len();
        let room = MAX_ALARMS.saturating_sub(first);
        if new.len() > room {
            self.left_out += new.len() - room;
            tracing::error!(
                "{} pieces of equipment that an overlay judges have no alarm: there would be more \
                 than {MAX_ALARMS}; name the \"equipment\" of the alarms that matter",
                new.len() - room
            );
            new.truncate(room);
        }
        if new.is_empty() {
            return;
        }
        match set.extended(new, tags) {
            Ok(extended) => table.extend(Arc::new(extended)),
            Err(faults) => {
                // What the configuration was checked for cannot be at fault here.
                faults.iter().for_each(|fault| tracing::error!("{fault}"));
                self.left_out += faults.len();
            }
        }
        self.follow_new(table, first);
    }

    /// Follows the alarms of a table from a handle on.
    fn follow_new(&mut self, table: &AlarmTable, first: usize) {
        for (spec, handle) in table.set().specs().iter().zip(0..).skip(first) {
            let AlarmSource::Verdict { trigger, .. } = &spec.source else { continue };
            let is_of_template = self.template_of(&spec.id).is_some();
            let own = self.overlays.iter_mut().find(|of| of.name == trigger.overlay);
            if let Some(own) = own {
                own.alarms.push(FollowedVerdict {
                    alarm: AlarmHandle(handle),
                    severity: trigger.severity,
                    is_of_template,
                    pieces: Vec::new(),
                    told: None,
                });
                // Their pieces are still to be found.
                own.description = None;
            }
        }
    }

    /// Tells a table the verdicts of the last pictures. Returns true if alarms came to it.
    pub(super) fn judge(
        &mut self,
        table: &mut AlarmTable,
        overlays: &[OverlayInstance],
        values: VerdictValues<'_>,
        directory: &dyn EquipmentDirectory,
    ) -> bool {
        let before = table.set().specs().len();
        for index in 0..self.overlays.len() {
            let name = &self.overlays[index].name;
            let overlay = overlays.iter().find(|overlay| overlay.name() == name);
            if let Some(overlay) = overlay {
                self.take_description(index, overlay, table, values.tags, directory);
            }
            self.overlays[index].tell(table, overlay, values);
        }
        table.set().specs().len() > before
    }

    /// Finds the pieces of the alarms in a description that is new.
    fn take_description(
        &mut self,
        index: usize,
        overlay: &OverlayInstance,
        table: &mut AlarmTable,
        tags: &TagSet,
        directory: &dyn EquipmentDirectory,
    ) {
        let description = overlay.description();
        let is_known = |of: &OverlayAlarms| {
            of.description.as_ref().is_some_and(|known| Arc::ptr_eq(known, description))
        };
        if is_known(&self.overlays[index]) {
            return;
        }
        let own = self.templates.iter().filter(|of| of.overlay() == overlay.name());
        let wanted: Vec<_> = own
            .flat_map(|template| description.equipment.iter().map(move |id| template.alarm_on(id)))
            .collect();
        self.add(wanted, table, tags);
        self.overlays[index].find_pieces(description, table, directory);
    }

    /// Returns the number of pieces that have no alarm, for want of room.
    pub(super) fn left_out(&self) -> usize {
        self.left_out
    }
}

impl OverlayAlarms {
    fn find_pieces(
        &mut self,
        description: &Arc<OverlayDescription>,
        table: &AlarmTable,
        directory: &dyn EquipmentDirectory,
    ) {
        let number = |id: &str| directory.find(id);
        let mut by_number: Vec<(EquipmentNumber, usize)> = Vec::new();
        let mut by_id: Vec<(&str, usize)> = Vec::new();
        for (id, index) in description.equipment.iter().zip(0..) {
            by_id.push((id.as_str(), index));
            by_number.extend(number(id).map(|number| (number, index)));
        }
        by_number.sort_unstable();
        by_id.sort_unstable();
        for followed in &mut self.alarms {
            (followed.pieces, followed.told) = (Vec::new(), None);
            let spec = table.set().spec(followed.alarm);
            let Some(AlarmSource::Verdict { trigger, .. }) = spec.map(|spec| &spec.source) else {
                continue;
            };
            let id = trigger.equipment.as_str();
            let described: Vec<usize> = equal(&by_id, &id).collect();
            followed.pieces = match number(id) {
                Some(number) if described.is_empty() || !followed.is_of_template => {
                    equal(&by_number, &number).collect()
                }
                _ => described,
            };
        }
        self.description = Some(Arc::clone(description));
    }

    /// Tells a table the verdicts that it does not know yet, or whose words are shown.
    fn tell(
        &mut self,
        table: &mut AlarmTable,
        overlay: Option<&OverlayInstance>,
        VerdictValues { tags, snapshot }: VerdictValues<'_>,
    ) {
        for followed in &mut self.alarms {
            let verdicts = overlay.map(OverlayInstance::verdicts);
            let pieces = followed.pieces.iter().filter_map(|piece| Some((*piece, verdicts?)));
            let worst = pieces
                .map(|(piece, verdicts)| (piece, verdicts, verdicts.piece(piece)))
                .max_by_key(|(_, _, verdict)| urgency(verdict));
            let alarm = followed.alarm;
            let piece = worst.as_ref().map(|(_, _, verdict)| *verdict).unwrap_or_default();
            let holds = piece.reaches(followed.severity);
            let is_shown = holds == Some(true) || holds.is_none() && table.is_open(alarm);
            if followed.told.replace(piece) == Some(piece) && !is_shown {
                continue;
            }
            let mut input = VerdictInput {
                alarm,
                holds,
                origin: self.origin,
                source_time: None,
                is_assumed: piece.is_assumed(),
                reason: None,
            };
            if let Some((index, verdicts, piece)) = worst {
                let (origin, source_time) = verdicts.basis_origin(&piece, snapshot);
                (input.origin, input.source_time) = (input.origin | origin, source_time);
                let reason = verdicts.verdict(index, tags, snapshot).reason;
                input.reason = Some(&*reason).filter(|text| !text.is_empty()).map(Arc::from);
            } else {
                let is_late = overlay.is_none_or(OverlayInstance::is_late);
                let reason = if is_late { "display late" } else { "the overlay does not judge it" };
                input.reason = Some(reason.into());
            }
            table.note_verdict(input);
        }
    }
}

/// Returns the indices of all entries with a key, in a sorted list.
fn equal<'a, K: Ord>(sorted: &'a [(K, usize)], key: &'a K) -> impl Iterator<Item = usize> + 'a {
    let first = sorted.partition_point(|(other, _)| other < key);
    sorted[first..].iter().take_while(move |(other, _)| other == key).map(|(_, index)| *index)
}
