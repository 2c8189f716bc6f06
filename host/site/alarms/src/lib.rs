//! Alarms: the state model of IEC 62682 (ANSI/ISA-18.2) on tags and on verdicts of overlays.
//!
//! An [`AlarmTable`] is told what tags change ([`AlarmTable::note`]) and what overlays judge
//! ([`AlarmTable::note_verdict`]), is stepped once a frame ([`AlarmTable::step`]) and takes what
//! operators do ([`AlarmTable::perform`]).
//! Whatever happens is a [`AlarmRecord`], for an audit log. Its cost follows what changes and
//! what is due, not how many alarms there are.
//!
//! A tag of bad quality, stale ones included, neither raises nor clears an alarm: the
//! alarm stays as it is, is marked as uncertain, and its delays begin anew once values are
//! usable again. Values of uncertain quality count, and mark the alarm too. Only a
//! condition on bad quality itself ([`Condition::BadQuality`]) looks at quality alone.
//!
//! An unknown verdict neither raises nor clears an alarm either. An on-delay that has begun goes
//! on meanwhile: equipment stays abnormal until it is judged normal. An off-delay begins anew.
//!
//! Invariant: no clock is read, nothing is drawn and nothing is written here; the same
//! steps give the same records.
#![doc = include_str!("../DESIGN.md")]

mod action;
mod chatter;
mod condition;
mod first_out;
mod notification;
mod record;
mod set;
mod source;
mod spec;
mod state_transitions;
mod step;
mod table;
mod template;
mod timers;
mod verdict_input;

pub use action::{ActionError, MAX_OPERATOR_BYTES};
pub use chatter::{CHATTER_OCCURRENCES, CHATTER_WINDOW};
pub use condition::Condition;
pub use notification::{
    AlarmChange, AlarmNotification, DeliveryState, MAX_BATCH_CHANGES, MAX_DELIVERY_MESSAGE_BYTES,
    MAX_STANDING_ALARMS, NotificationBatch, NotificationReport, NotificationReportError,
    StandingAlarms,
};
pub use record::{AlarmEvent, AlarmRecord};
pub use set::{AlarmSet, AlarmSpecError};
pub use source::{
    MAX_SEVERITY, MAX_SOURCE_ALARM_TEXT, MAX_SOURCE_ALARMS, SourceAlarm, SourceReport,
    SourceReportError,
};
pub use spec::{
    AlarmHandle, AlarmSource, AlarmSpec, MAX_ALARMS, MAX_DELAY, TagCondition, VerdictCondition,
};
pub use state_transitions::AlarmFlags;
pub use table::{AlarmStatus, AlarmTable, StateCounts};
pub use template::AlarmTemplate;
pub use verdict_input::VerdictInput;
