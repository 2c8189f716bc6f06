//! Capability `busbar.overlay/2-draft`: values of tags to things drawn at equipment.
//!
//! The plugin says what to show; the host decides how it looks, and marks
//! whatever rests on a value that is not good, whatever the plugin says.

use crate::{
    BusbarError, BusbarPlugin, BusbarQualityNumber, BusbarReasonNumber, BusbarStatusNumber,
    BusbarStr, BusbarValueKindNumber,
};

/// Id of the capability.
pub const OVERLAY_ID: &str = "busbar.overlay/2-draft";

/// A tag bound to a node. Array element.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct BusbarBinding {
    /// Names the node in primitives.
    pub node: u32,
    /// Kind of the tag's values.
    pub kind: BusbarValueKindNumber,
    /// Reserved; must be zero.
    pub reserved: [u8; 3],
    /// Normal band, lower end; NaN for none.
    pub limit_low: f64,
    /// Normal band, upper end; NaN for none.
    pub limit_high: f64,
    /// Id of the tag.
    pub tag_id: BusbarStr,
    /// Tag name for people.
    pub tag_name: BusbarStr,
    /// Unit, such as `kV`; empty for none.
    pub unit: BusbarStr,
    /// Equipment id of the node.
    pub node_id: BusbarStr,
    /// Role of the value for the node, as the configuration words it.
    pub role: BusbarStr,
}

/// The state of one bound tag in this frame. Array element.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct BusbarTagValue {
    /// Kind of the last value; `BUSBAR_VALUE_KIND_NONE` if no value came yet.
    pub kind: BusbarValueKindNumber,
    /// Quality of the value, freshness included.
    pub quality: BusbarQualityNumber,
    /// Reason of the quality.
    pub reason: BusbarReasonNumber,
    /// Origin of the value, `BUSBAR_ORIGIN_*` or'ed; 0 for a live one. The host gives what is drawn
    /// on the value, and verdicts that rest on it, this origin. A plugin with a history begins it
    /// anew where the origin changes.
    pub origin: u8,
    /// Reserved; must be zero.
    pub reserved: [u8; 4],
    /// Last value of kind `BUSBAR_VALUE_KIND_F64`; 0 for others.
    pub number: f64,
    /// Last value of kind `BUSBAR_VALUE_KIND_I64`, `BUSBAR_VALUE_KIND_BOOL` or
    /// `BUSBAR_VALUE_KIND_DOUBLE_POINT`; 0 for others.
    pub integer: i64,
    /// Time since that value came, milliseconds.
    pub age_millis: u64,
    /// Last value of kind `BUSBAR_VALUE_KIND_TEXT`, valid during the call; empty for others.
    pub text: BusbarStr,
}

/// Frame with all bound tags at one instant.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct BusbarOverlayFrame {
    /// Size of this struct, bytes.
    pub struct_size: u32,
    /// Number of values: that of the bindings.
    pub value_count: u32,
    /// Scene clock, nanoseconds since 1970-01-01 UTC: the time that the values
    /// are of. It is the wall clock's for live values and the recording's for
    /// replayed ones. It may stand still, run fast, or be set back.
    pub time_unix_nanos: i64,
    /// `values[i]` belongs to the `i`-th binding of `configure`.
    pub values: *const BusbarTagValue,
}

/// Kind of a primitive.
#[repr(u32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BusbarPrimitiveKind {
    /// Line of the label at a node: caption and value.
    Line = 1,
    /// Tint: the node and all under it, drawn in the colour of the severity.
    Tint = 2,
    /// State of the legend of a piece of equipment, and of all under it. A state that rests on
    /// several bindings is named once for each, one after the other.
    State = 3,
}

enum_numbers! {
    /// Number of a [`BusbarPrimitiveKind`] that the other side wrote.
    BusbarPrimitiveKindNumber: u32 = BusbarPrimitiveKind {
        BUSBAR_PRIMITIVE_KIND_LINE = Line,
        BUSBAR_PRIMITIVE_KIND_TINT = Tint,
        BUSBAR_PRIMITIVE_KIND_STATE = State,
    }
}

/// Severity of a primitive.
#[repr(u32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BusbarSeverity {
    /// Severity of the normal state; grey.
    Normal = 0,
    /// Severity outside the normal band.
    Warning = 1,
    /// Severity that needs action now.
    Alarm = 2,
}

enum_numbers! {
    /// Number of a [`BusbarSeverity`] that the other side wrote.
    BusbarSeverityNumber: u32 = BusbarSeverity {
        BUSBAR_SEVERITY_NORMAL = Normal,
        BUSBAR_SEVERITY_WARNING = Warning,
        BUSBAR_SEVERITY_ALARM = Alarm,
    }
}

/// Pattern of a state, which those see who see no colour.
#[repr(u32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BusbarPattern {
    /// Pattern of a plain colour.
    Solid = 0,
    /// Pattern of diagonal stripes.
    Striped = 1,
    /// Pattern of stripes that cross.
    Crossed = 2,
    /// Pattern of regular dots.
    Dotted = 3,
}

enum_numbers! {
    /// Number of a [`BusbarPattern`] that the other side wrote.
    BusbarPatternNumber: u32 = BusbarPattern {
        BUSBAR_PATTERN_SOLID = Solid,
        BUSBAR_PATTERN_STRIPED = Striped,
        BUSBAR_PATTERN_CROSSED = Crossed,
        BUSBAR_PATTERN_DOTTED = Dotted,
    }
}

/// A state that an overlay shows equipment in, as the legend has it. Array element.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct BusbarLegendEntry {
    /// Display name of the state; at most 64 bytes.
    pub name: BusbarStr,
    /// Pattern of the state: no two entries that differ in colour alone may mean different
    /// things to who sees none.
    pub pattern: BusbarPatternNumber,
    /// Colour in sRGB, `0xRRGGBB`.
    pub color: u32,
}

/// A quantity whose course over the ground an overlay shows, worked out of levels at
/// equipment. Array element.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct BusbarContour {
    /// Display name of the quantity; at most 64 bytes.
    pub name: BusbarStr,
    /// Unit such as `°C`; empty for none; at most 16 bytes.
    pub unit: BusbarStr,
    /// Radius around a piece of equipment within which its level counts, metres; 0.1 to 1000.
    pub reach_metres: f64,
    /// Normal band, lower end; NaN for none. Only what lies outside the band is coloured.
    pub low: f64,
    /// Normal band, upper end; NaN for none.
    pub high: f64,
    /// Distance from one line of equal level to the next, in the unit; above 0.
    pub step: f64,
}

/// Contents of an overlay besides values. The caller sets the size; the plugin fills in
/// the rest, all of which stays as it is until the next `configure`, or until the plugin is
/// destroyed.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct BusbarOverlayDescription {
    /// Size of this struct, bytes.
    pub struct_size: u32,
    /// Number of legend entries; at most 64.
    pub legend_count: u32,
    /// Number of equipment ids; at most 100,000.
    pub equipment_count: u32,
    /// Reserved; must be zero.
    pub reserved: u32,
    /// Legend entries of the overlay.
    pub legend: *const BusbarLegendEntry,
    /// Ids, by any alias, of the equipment that is judged: every piece that the settings or
    /// the bindings name. `draw` gives each of them a verdict.
    pub equipment: *const BusbarStr,
    /// Number of mechanisms; at most 16. This and what follows is there where the size
    /// says so.
    pub mechanism_count: u32,
    /// Flag, 0 or 1: the overlay is drawn only once an operator switches it on.
    pub starts_hidden: u32,
    /// Names of mechanisms, as models have them, that positions are given of.
    pub mechanisms: *const BusbarStr,
    /// The contour that levels are of; null for none.
    pub contour: *const BusbarContour,
    /// Number of findings; at most 256. This and what follows is there where the size
    /// says so.
    pub finding_count: u32,
    /// Reserved; must be zero.
    pub reserved_2: u32,
    /// Faults of the bindings given, each as cause and remedy with `; ` between: a role
    /// that no tag has, a unit that cannot be converted. `busbar check` refuses them; a
    /// view shows the equipment as unknown.
    pub findings: *const BusbarStr,
}

/// Kind of a quantity.
#[repr(u32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BusbarQuantityKind {
    /// Position of a switch. `value` is the share of its way that it has travelled from open (0) to
    /// closed (1), in between while it travels; NaN where what is reported contradicts itself.
    Position = 1,
    /// Power that flows. `value` is its share of the rating, positive from `equipment` to
    /// `to_equipment`.
    Flow = 2,
    /// Level of the contour, in its unit.
    Level = 3,
}

enum_numbers! {
    /// Number of a [`BusbarQuantityKind`] that the other side wrote.
    BusbarQuantityKindNumber: u32 = BusbarQuantityKind {
        BUSBAR_QUANTITY_KIND_POSITION = Position,
        BUSBAR_QUANTITY_KIND_FLOW = Flow,
        BUSBAR_QUANTITY_KIND_LEVEL = Level,
    }
}

/// A number at equipment that the host gives a shape. Array element.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct BusbarOverlayQuantity {
    /// Kind of the quantity.
    pub kind: BusbarQuantityKindNumber,
    /// Index of the binding whose value this rests on: what is not good is drawn as not known.
    pub binding: u32,
    /// Index of the equipment described.
    pub equipment: u32,
    /// Index of the mechanism of a position; 0 for others.
    pub mechanism: u32,
    /// Index of the equipment that power flows to; 0 for others.
    pub to_equipment: u32,
    /// Reserved; must be zero.
    pub reserved: u32,
    /// Number of the quantity, in the unit of its kind; finite unless the kind says otherwise.
    pub value: f64,
}

/// Primitive to draw. Array element.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct BusbarOverlayPrimitive {
    /// Kind of the primitive.
    pub kind: BusbarPrimitiveKindNumber,
    /// Index of the binding whose value this rests on. The host hatches the
    /// primitive, with the age, when that value is not good.
    pub binding: u32,
    /// Node at which a line or tint is drawn; 0 for a state.
    pub node: u32,
    /// Severity of a line or tint; 0 for a state.
    pub severity: BusbarSeverityNumber,
    /// Index of the equipment described that is in a state; 0 for others.
    pub equipment: u32,
    /// Index of the legend's entry of a state; 0 for others.
    pub entry: u32,
    /// Caption: offset into the text buffer, bytes.
    pub caption_offset: u32,
    /// Caption: length, at most 256 bytes.
    pub caption_len: u32,
    /// Value text: offset into the text buffer, bytes.
    pub text_offset: u32,
    /// Value text: length, at most 256 bytes.
    pub text_len: u32,
}

/// Verdict of an overlay on a piece of equipment.
#[repr(u32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BusbarVerdict {
    /// Equipment within its limits.
    Normal = 1,
    /// Equipment outside its limits, or in a state that needs attention.
    Abnormal = 2,
    /// Equipment that cannot be judged, for the reason given.
    Unknown = 3,
}

enum_numbers! {
    /// Number of a [`BusbarVerdict`] that the other side wrote.
    BusbarVerdictNumber: u32 = BusbarVerdict {
        BUSBAR_VERDICT_NORMAL = Normal,
        BUSBAR_VERDICT_ABNORMAL = Abnormal,
        BUSBAR_VERDICT_UNKNOWN = Unknown,
    }
}

/// Flag of a verdict: it rests on a default of the plugin, which the reason names.
pub const BUSBAR_VERDICT_FLAG_ASSUMED: u32 = 1;
/// Flag of an abnormal verdict: it is surely no alarm, so that it needs attention and no action
/// now. Without this flag and the next one an abnormal verdict is an alarm: it needs action now.
pub const BUSBAR_VERDICT_FLAG_WARNING: u32 = 2;
/// Flag of an abnormal verdict: it needs attention, and the inputs do not decide whether it is an
/// alarm.
pub const BUSBAR_VERDICT_FLAG_PERHAPS_ALARM: u32 = 4;

/// The judgment of an overlay on one piece of equipment. Array element. Every piece that
/// was described has one in every frame; the host takes a piece without one as unknown, and
/// says that the plugin is at fault.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct BusbarOverlayVerdict {
    /// Index of the equipment described.
    pub equipment: u32,
    /// Verdict on the equipment.
    pub verdict: BusbarVerdictNumber,
    /// Flags: `BUSBAR_VERDICT_FLAG_ASSUMED`, and one of `BUSBAR_VERDICT_FLAG_WARNING` and
    /// `BUSBAR_VERDICT_FLAG_PERHAPS_ALARM` of an abnormal verdict; or 0.
    pub flags: u32,
    /// Reason, for people: offset into the text buffer, bytes.
    pub reason_offset: u32,
    /// Reason: length, at most 256 bytes; more than 0 for what is unknown or assumed.
    pub reason_len: u32,
    /// Bindings that it rests on: offset into `basis`. The host takes the verdict back in the
    /// very frame in which the value of any of them is not good.
    pub basis_offset: u32,
    /// Bindings that it rests on: number. Verdicts may share a range.
    pub basis_count: u32,
}

/// Buffers for what to draw. The caller owns them; the plugin fills in the
/// counts.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct BusbarOverlayOutput {
    /// Size of this struct, bytes.
    pub struct_size: u32,
    /// Capacity of `primitives`, in elements.
    pub primitive_capacity: u32,
    /// Number of primitives written.
    pub primitive_count: u32,
    /// Room in `text`, bytes.
    pub text_capacity: u32,
    /// Bytes of `text` written.
    pub text_len: u32,
    /// Reserved; must be zero.
    pub reserved: u32,
    /// Primitives to draw, in order.
    pub primitives: *mut BusbarOverlayPrimitive,
    /// UTF-8 that the primitives name.
    pub text: *mut u8,
    /// Room in `quantities`. This and what follows is there where the size says so.
    pub quantity_capacity: u32,
    /// Number of quantities written.
    pub quantity_count: u32,
    /// Quantities that the host draws by shapes of its own.
    pub quantities: *mut BusbarOverlayQuantity,
    /// Room in `verdicts`. This and what follows is there where the size says so.
    pub verdict_capacity: u32,
    /// Number of verdicts written.
    pub verdict_count: u32,
    /// Judgments on the equipment described.
    pub verdicts: *mut BusbarOverlayVerdict,
    /// Capacity of `basis`, in elements.
    pub basis_capacity: u32,
    /// Elements of `basis` written.
    pub basis_count: u32,
    /// Indices of bindings that verdicts rest on.
    pub basis: *mut u32,
}

/// Function table of `busbar.overlay/2-draft`.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct BusbarOverlay {
    /// Size of this struct, bytes.
    pub struct_size: u32,
    /// Reserved; must be zero.
    pub reserved: u32,
    /// `[serialized]` Says which tags are bound to which nodes; called before
    /// the first `draw` and after a reload. Everything is borrowed for the
    /// call.
    pub configure: Option<
        unsafe extern "C" fn(
            plugin: *const BusbarPlugin,
            bindings: *const BusbarBinding,
            binding_count: usize,
            error: *mut BusbarError,
        ) -> BusbarStatusNumber,
    >,
    /// `[serialized]` Works out what to draw, and judges the equipment. Called at
    /// most once a frame, also while nobody has the overlay drawn, and must return
    /// within a few milliseconds. Fails with
    /// `BUSBAR_BUFFER_TOO_SMALL` when the buffers do not suffice.
    pub draw: Option<
        unsafe extern "C" fn(
            plugin: *const BusbarPlugin,
            frame: *const BusbarOverlayFrame,
            output: *mut BusbarOverlayOutput,
            error: *mut BusbarError,
        ) -> BusbarStatusNumber,
    >,
    /// `[serialized]` Says what is shown besides values; called after each
    /// `configure`. Null where it is nothing.
    pub describe: Option<
        unsafe extern "C" fn(
            plugin: *const BusbarPlugin,
            description: *mut BusbarOverlayDescription,
            error: *mut BusbarError,
        ) -> BusbarStatusNumber,
    >,
}
