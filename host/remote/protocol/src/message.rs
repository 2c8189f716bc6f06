//! Messages between a host program's library and its viewer.
//!
//! Both are of the same release, or the viewer says that they are not and ends. A pane
//! is one viewer's view, seen from the host program.

use busbar_types::{AlarmState, Origin, QualityLevel, Value};
use serde::{Deserialize, Serialize};

/// Version of these messages.
pub const PROTOCOL_VERSION: u32 = 9;
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

/// Message of the host program's library to its viewer.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum HostMessage {
    /// The first message; the descriptor of the pictures' memory comes along.
    Start(StartParameters),
    /// A command for the running viewer.
    Command(Command),
}

/// Parameters that start a viewer.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StartParameters {
    /// Protocol version of the library, [`PROTOCOL_VERSION`].
    pub version: u32,
    /// Path of the configuration, absolute.
    pub config: String,
    /// Destination of the pictures.
    pub target: Target,
    /// Size of the pictures, pixels.
    pub size: [u32; 2],
    /// Reports whether panels are shown beside the scene.
    pub panels: bool,
    /// Operator who acts on alarms, as the audit log records the name; may be empty.
    pub operator: String,
    /// Alarms of the previous viewer; those of an audit log take precedence.
    pub alarms: Vec<AlarmSnapshot>,
}

/// Destination of rendered pictures.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Target {
    /// Shared memory of the host program.
    Offscreen,
    /// Into a child of this X11 window.
    Window(u32),
}

/// Pose of the camera, world space in metres.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct CameraPose {
    /// Position of the camera.
    pub eye: [f64; 3],
    /// Point that the camera looks at.
    pub target: [f64; 3],
    /// Reports whether the projection is orthographic.
    pub is_orthographic: bool,
}

/// Command of a host program to its viewer.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Command {
    /// Draw pictures of this size, pixels.
    Resize([u32; 2]),
    /// Sets whether anybody can see the picture; few frames are rendered otherwise.
    SetVisible(bool),
    /// Go to a camera of the configuration.
    UseCamera(String),
    /// Stand somewhere at once.
    SetCamera(CameraPose),
    /// Select and frame a piece of equipment, by its id or an alias.
    Focus(String),
    /// Set theta of every model, 0 to 1; none lets their policies choose.
    SetTheta(Option<f64>),
    /// Draw an overlay, by the name of its plugin instance, or leave it out.
    SetLayer {
        /// Name of the overlay's plugin instance.
        layer: String,
        /// Reports whether the overlay is drawn.
        shown: bool,
    },
    /// Values of tags that the host program sets.
    SetTags(Vec<TagUpdate>),
    /// Applies an operator's action to an alarm.
    ActOnAlarm {
        /// Id of the alarm.
        alarm: String,
        /// Action of the operator.
        action: AlarmRequest,
        /// Name of the operator; empty for the operator of [`StartParameters`].
        operator: String,
    },
    /// Sets an alarm that the host program decides on.
    MirrorAlarm {
        /// Id of the alarm.
        alarm: String,
        /// State by IEC 62682; on the wire 0 for A to 8 for I.
        state: AlarmState,
    },
    /// Sets the instant that a chart shows, nanoseconds since 1970-01-01 UTC; none for all.
    SetTime(Option<i64>),
    /// Load a configuration, absolute, in place of the one shown. Where it has a fault the
    /// one before stays.
    Reload(String),
    /// Select what is at a pixel, and name it.
    Pick([u32; 2]),
    /// Pointer input over the picture.
    Pointer(PointerEvent),
    /// Keyboard input over the picture.
    Key(KeyEvent),
}

/// Operator action on an alarm that a host program may ask for, or be asked for. Nobody takes an
/// alarm out of service from afar.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum AlarmRequest {
    /// Say that it was seen.
    Acknowledge,
    /// Put it on the shelf for so many seconds.
    Shelve(u32),
    /// Take it off the shelf.
    Unshelve,
    /// Let go of a latch.
    Reset,
}

/// Pointer input; positions are in pixels from the top left.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum PointerEvent {
    /// Movement of the pointer to a position.
    Moved([f32; 2]),
    /// A button went down or up: 1 the left, 2 the middle, 3 the right one.
    Button {
        /// Position of the pointer.
        at: [f32; 2],
        /// Number of the button.
        button: u8,
        /// Reports whether the button went down.
        pressed: bool,
    },
    /// The wheel turned by so many steps, away from the hand above 0.
    Scrolled(f32),
    /// Pointer leaves the picture.
    Left,
}

/// Keyboard input or text input.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum KeyEvent {
    /// A key went down or up. One that the viewer does not know does nothing.
    Key {
        /// Key name as `KeyboardEvent.key` of UI Events (W3C): `A`, `F9`, `ArrowUp`.
        key: String,
        /// Reports whether the key went down.
        pressed: bool,
        /// Reports whether the key was down already, and the keyboard repeats it.
        repeated: bool,
        /// Modifier keys held down meanwhile.
        modifiers: Modifiers,
    },
    /// Modifier keys held down, sent without another key.
    Modifiers(Modifiers),
    /// Text, for a field that takes it.
    Text(String),
}

/// Keys that change what others mean.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Modifiers {
    /// Shift key held down.
    pub shift: bool,
    /// Ctrl key held down.
    pub ctrl: bool,
    /// Alt key held down.
    pub alt: bool,
}

/// A value of a tag as the host program has it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TagUpdate {
    /// Id of the tag.
    pub tag: String,
    /// Value of the tag; none changes the quality alone.
    pub value: Option<Value>,
    /// Quality of the value.
    pub quality: QualityLevel,
    /// Source timestamp, nanoseconds since 1970-01-01 UTC, if known.
    pub source_time: Option<i64>,
    /// Instant at which the host program set the value, nanoseconds of the clock since boot. The
    /// time that an update waits for a viewer counts as age.
    pub sent_at: u64,
}

/// Quality and origins of a tag's value.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct TagSnapshot {
    /// Id of the tag.
    pub tag: String,
    /// Quality of the value, freshness included.
    pub quality: QualityLevel,
    /// Origins of the value; on the wire a list of their places in [`Origin::ALL`].
    #[serde(with = "crate::origin_list")]
    pub origin: Origin,
    /// Reason in words for a quality that is not good; else empty.
    pub reason: String,
}

/// Verdict of an overlay on a piece of equipment, with its reason.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct VerdictSnapshot {
    /// Equipment id, as the overlay describes it.
    pub equipment: String,
    /// Name of the overlay's plugin instance.
    pub overlay: String,
    /// Verdict on the equipment.
    pub verdict: EquipmentVerdict,
    /// Marks a verdict that rests on a default, which the reason names.
    pub is_assumed: bool,
    /// Origins of the values that it rests on; on the wire a list of their places in
    /// [`Origin::ALL`].
    #[serde(with = "crate::origin_list")]
    pub origin: Origin,
    /// Reason in words; empty for none.
    pub reason: String,
}

/// Judgment of an overlay on a piece of equipment.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum EquipmentVerdict {
    /// Equipment within its limits.
    Normal,
    /// Outside its limits, or in a state that needs attention.
    Abnormal,
    /// Equipment that cannot be judged.
    Unknown,
    /// Equipment that cannot be judged, and was abnormal at the last judgment.
    UnknownAfterAbnormal,
}

/// State of an alarm.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct AlarmSnapshot {
    /// Id of the alarm.
    pub alarm: String,
    /// State by IEC 62682; on the wire 0 for A to 8 for I.
    pub state: AlarmState,
    /// Since when, nanoseconds since 1970-01-01 UTC.
    pub since: i64,
    /// Complete state of the alarm as JSON, for the next viewer.
    pub standing: String,
    /// Origins of the value or verdict by which it came or went last; on the wire a list of their
    /// places in [`Origin::ALL`].
    #[serde(with = "crate::origin_list")]
    pub origin: Origin,
    /// Reason of the verdict by which it came or went last, with what is assumed; empty of an
    /// alarm on a tag.
    pub reason: String,
}

/// Message of a viewer to the library of the host program.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum ViewerMessage {
    /// The first picture is there.
    Ready {
        /// Name of the graphics device.
        device: String,
    },
    /// A configuration is shown in place of the one before.
    Reloaded {
        /// Absolute path of the configuration.
        config: String,
    },
    /// A new picture lies in shared memory.
    PictureReady,
    /// Equipment that was picked, by id; none for nothing.
    Picked(Option<String>),
    /// Equipment under the pointer, by id; none for nothing.
    Hovered(Option<String>),
    /// Pose of the camera after a change.
    CameraMoved(CameraPose),
    /// State of an alarm after a change.
    Alarm(AlarmSnapshot),
    /// An operator wants this of an alarm that the host program decides on.
    AlarmRequested {
        /// Id of the alarm.
        alarm: String,
        /// Requested action of the operator.
        action: AlarmRequest,
    },
    /// Quality and origins of a tag's value after a change.
    Quality(TagSnapshot),
    /// Verdict of an overlay on a piece of equipment after a change.
    Verdict(VerdictSnapshot),
    /// State of a plugin instance after a change.
    Plugin {
        /// Name of the plugin instance.
        plugin: String,
        /// State of the instance, in words.
        state: String,
    },
    /// Command that could not be executed, with a remedy.
    Refused(String),
    /// Reason for which no scene can be shown at all, with a remedy; the viewer ends.
    Failed(String),
}
