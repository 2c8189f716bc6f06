//! Messages between a host program's library and its viewer.
//!
//! Both are of the same release, or the viewer says that they are not and ends. A pane
//! is one viewer's view, seen from the host program.

use serde::{Deserialize, Serialize};

/// Version of these messages.
pub const PROTOCOL_VERSION: u32 = 5;
/// The longest message, either way.
pub const MAX_MESSAGE_BYTES: usize = 4 << 20;
/// The longest id, name or path in a message, bytes.
pub const MAX_TEXT_BYTES: usize = 4096;
/// Tags that one message sets at most.
pub const MAX_TAGS_A_MESSAGE: usize = 4096;
/// The longest name of a key, and the longest text typed at once, bytes.
pub const MAX_TYPED_BYTES: usize = 256;
/// The longest side of a picture, pixels.
pub const MAX_SIDE: u32 = 8192;

/// From the host program's library.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum ToViewer {
    /// The first message; the descriptor of the pictures' memory comes along.
    Begin(Begin),
    /// Something to do.
    Do(Command),
}

/// What a viewer is to show.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Begin {
    /// [`PROTOCOL_VERSION`].
    pub version: u32,
    /// Path of the configuration, absolute.
    pub config: String,
    /// Where the picture goes.
    pub target: Target,
    /// Its size, pixels.
    pub size: [u32; 2],
    /// Whether panels are shown beside the scene.
    pub panels: bool,
    /// Who acts on alarms, as the audit log has it; may be empty.
    pub operator: String,
    /// How alarms stood in the viewer before; an audit log goes before them.
    pub alarms: Vec<AlarmStanding>,
}

/// Where a picture goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Target {
    /// Into shared memory.
    Offscreen,
    /// Into a child of this X11 window.
    Window(u32),
}

/// Where the camera is, world space in metres.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct CameraPose {
    /// Where it stands.
    pub eye: [f32; 3],
    /// What it looks at.
    pub target: [f32; 3],
    /// Whether it looks without perspective.
    pub is_orthographic: bool,
}

/// What a host program can ask for.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Command {
    /// Draw pictures of this size, pixels.
    Resize([u32; 2]),
    /// Whether anybody can see the picture: if not, few are drawn.
    SetVisible(bool),
    /// Go to a camera of the configuration.
    UseCamera(String),
    /// Stand somewhere at once.
    Look(CameraPose),
    /// Select and frame a piece of equipment, by its id or an alias.
    Focus(String),
    /// Set theta of every model, 0 to 1; none lets their policies choose.
    SetTheta(Option<f64>),
    /// Draw an overlay, by the name of its plugin instance, or leave it out.
    SetLayer {
        /// Its name.
        layer: String,
        /// Whether it is drawn.
        shown: bool,
    },
    /// Values of tags that the host program sets.
    SetTags(Vec<TagUpdate>),
    /// What an operator does to an alarm.
    ActOnAlarm {
        /// Its id.
        alarm: String,
        /// What.
        action: AlarmAction,
        /// Who; empty for the operator of the beginning.
        operator: String,
    },
    /// Sets an alarm that the host program decides on.
    MirrorAlarm {
        /// Its id.
        alarm: String,
        /// By the letter of IEC 62682, 0 for A to 8 for I.
        state: u8,
    },
    /// What instant a chart shows, nanoseconds since 1970-01-01 UTC; none for all.
    SetTime(Option<i64>),
    /// Load a configuration, absolute, in place of the one shown. Where it has a fault the
    /// one before stays.
    Reload(String),
    /// Select what is at a pixel, and name it.
    Pick([u32; 2]),
    /// What the pointer did over the picture.
    Point(Pointing),
    /// What was done on the keyboard over the picture.
    Type(Typing),
}

/// What an operator does to an alarm.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum AlarmAction {
    /// Say that it was seen.
    Acknowledge,
    /// Put it on the shelf for so many seconds.
    Shelve(u32),
    /// Take it off the shelf.
    Unshelve,
    /// Let go of a latch.
    Reset,
}

/// What a pointer did; places are in pixels from the top left.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Pointing {
    /// It moved there.
    Moved([f32; 2]),
    /// A button went down or up: 1 the left, 2 the middle, 3 the right one.
    Button {
        /// Where.
        at: [f32; 2],
        /// Which.
        button: u8,
        /// Whether it went down.
        pressed: bool,
    },
    /// The wheel turned by so many steps, away from the hand above 0.
    Scrolled(f32),
    /// It left the picture.
    Left,
}

/// What was done on a keyboard.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Typing {
    /// A key went down or up. One that the viewer does not know does nothing.
    Key {
        /// Its name, as `KeyboardEvent.key` of UI Events (W3C) has it: `A`, `F9`, `ArrowUp`.
        key: String,
        /// Whether it went down.
        pressed: bool,
        /// Whether it was down already, and the keyboard repeats it.
        repeated: bool,
        /// What is held meanwhile.
        modifiers: Modifiers,
    },
    /// What is held, where no key tells.
    Holds(Modifiers),
    /// Text, for a field that takes it.
    Text(String),
}

/// Keys that change what others mean.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Modifiers {
    /// Shift.
    pub shift: bool,
    /// Ctrl.
    pub ctrl: bool,
    /// Alt.
    pub alt: bool,
}

/// A value of a tag as the host program has it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TagUpdate {
    /// Its id.
    pub tag: String,
    /// Its value; none says something of quality alone.
    pub value: Option<TagValue>,
    /// What it is worth.
    pub quality: TagQuality,
    /// When it was so, nanoseconds since 1970-01-01 UTC, if that is known.
    pub source_time: Option<i64>,
    /// When the host program said so, nanoseconds of the clock since boot: waiting for a
    /// viewer makes no value younger.
    pub said_at: u64,
}

/// A value.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum TagValue {
    /// A measurement.
    F64(f64),
    /// A counter or code.
    I64(i64),
    /// A single point.
    Bool(bool),
    /// A switch position: 0 travelling, 1 open, 2 closed, 3 invalid (IEC 60870-5-101, 7.2.6.2).
    DoublePoint(u8),
}

/// What a value is worth.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum TagQuality {
    /// Usable.
    Good,
    /// Doubtful.
    Uncertain,
    /// Not usable.
    Bad,
}

/// Source of a value that was not measured just now by the process itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum TagOrigin {
    /// Put in place of the measured value by a person or program.
    Substituted,
    /// Sent by a device under test.
    Test,
    /// Made by a simulator.
    Simulated,
    /// Replayed from a recording.
    Recorded,
    /// Out of the past, as the source says.
    Historical,
}

/// Quality and origins of a tag's value.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct TagStanding {
    /// Id of the tag.
    pub tag: String,
    /// Quality of the value, freshness included.
    pub quality: TagQuality,
    /// Origins besides the live process; none for a live value.
    pub origins: Vec<TagOrigin>,
    /// Reason in words for a quality that is not good; else empty.
    pub reason: String,
}

/// Verdict of an overlay on a piece of equipment, with its reason.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct VerdictStanding {
    /// Equipment id, as the overlay describes it.
    pub equipment: String,
    /// Name of the overlay's plugin instance.
    pub overlay: String,
    /// Verdict on the equipment.
    pub verdict: EquipmentVerdict,
    /// Marks a verdict that rests on a default, which the reason names.
    pub is_assumed: bool,
    /// Reason in words; empty for none.
    pub reason: String,
}

/// Judgment of an overlay on a piece of equipment.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum EquipmentVerdict {
    /// Within its limits.
    Normal,
    /// Outside its limits, or in a state that needs attention.
    Abnormal,
    /// Not to be judged.
    Unknown,
    /// Not to be judged, and abnormal when it was last known.
    UnknownAfterAbnormal,
}

/// How an alarm stands.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct AlarmStanding {
    /// Its id.
    pub alarm: String,
    /// By the letter of IEC 62682, 0 for A to 8 for I.
    pub state: u8,
    /// Since when, nanoseconds since 1970-01-01 UTC.
    pub since: i64,
    /// All that the state rests on, as JSON; for the viewer after this one.
    pub standing: String,
}

/// From a viewer.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum FromViewer {
    /// The first picture is there.
    Ready {
        /// The graphics device.
        device: String,
    },
    /// A configuration is shown in place of the one before.
    Reloaded {
        /// Its path.
        config: String,
    },
    /// A new picture lies in shared memory.
    Pictured,
    /// What was picked: an equipment id, none for nothing.
    Picked(Option<String>),
    /// What is under the pointer.
    Hovered(Option<String>),
    /// Where the camera is.
    Looks(CameraPose),
    /// How an alarm stands by now.
    Alarm(AlarmStanding),
    /// An operator wants this of an alarm that the host program decides on.
    Asked {
        /// Its id.
        alarm: String,
        /// What.
        action: AlarmAction,
    },
    /// Quality and origins of a tag's value by now.
    Quality(TagStanding),
    /// Verdict of an overlay on a piece of equipment by now.
    Verdict(VerdictStanding),
    /// How a plugin instance goes.
    Plugin {
        /// Its name.
        plugin: String,
        /// In words.
        state: String,
    },
    /// What could not be done, with a remedy.
    Refused(String),
    /// Why no scene can be shown at all, with a remedy; the viewer ends.
    Failed(String),
}
