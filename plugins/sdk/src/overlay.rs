//! Capability `busbar.overlay/1-draft`.

use std::time::Duration;

use busbar_plugin_abi as abi;

use crate::border::{copy_out, given, given_mut};
use crate::{Error, Plugin, Quality, Value, ValueKind};

/// Bytes of a caption, and of a value; the canvas cuts what is longer.
pub const MAX_LINE_TEXT: usize = 256;

/// Bindings that one state may rest on.
pub const MAX_BINDINGS_A_STATE: usize = abi::BUSBAR_MAX_BINDINGS_A_STATE as usize;

/// Shows values and states at equipment.
pub trait Overlay: Plugin {
    /// Says what it shows besides values: asked for once, before `configure`.
    fn describe(&self) -> Description {
        Description::default()
    }

    /// Says which tags are bound to which nodes, before the first `draw`. To try the
    /// settings it may come without any before.
    ///
    /// # Errors
    /// What makes the bindings unusable.
    fn configure(&mut self, bindings: Vec<Binding>) -> Result<(), Error>;

    /// Works out what to draw in a frame, within a few milliseconds.
    ///
    /// # Errors
    /// That of [`Canvas`]: hand it on.
    fn draw(&mut self, frame: &OverlayFrame<'_>, canvas: &mut Canvas<'_>) -> Result<(), Error>;
}

/// What an overlay shows besides values.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Description {
    /// The states that it shows equipment in; at most 64.
    pub legend: Vec<LegendEntry>,
    /// Ids of the equipment that it shows states and quantities at; at most 100,000.
    pub equipment: Vec<String>,
    /// Mechanisms, as models name them, that it gives positions of; at most 16.
    pub mechanisms: Vec<String>,
    /// What its levels are of.
    pub contour: Option<Contour>,
    /// Whether it is drawn only once an operator switches it on.
    pub starts_hidden: bool,
}

/// A quantity whose course over the ground is worked out of levels at equipment.
#[derive(Clone, Debug, PartialEq)]
pub struct Contour {
    /// What it is called; at most 64 bytes.
    pub name: String,
    /// Its unit; empty for none; at most 16 bytes.
    pub unit: String,
    /// How far around a piece of equipment its level counts, metres; 0.1 to 1000.
    pub reach_metres: f64,
    /// Lower end of the normal band: only what lies outside of it is coloured.
    pub low: Option<f64>,
    /// Upper end of the normal band.
    pub high: Option<f64>,
    /// From one line of equal level to the next, in the unit; above 0.
    pub step: f64,
}

/// A state of the legend.
#[derive(Clone, Debug, PartialEq)]
pub struct LegendEntry {
    /// What it says, for people; at most 64 bytes.
    pub name: String,
    /// sRGB.
    pub color: [u8; 3],
    /// Tells states apart where colours do not.
    pub pattern: Pattern,
}

/// What a state looks like besides its colour.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pattern {
    /// Plain.
    Solid = abi::BUSBAR_PATTERN_SOLID as isize,
    /// Stripes.
    Striped = abi::BUSBAR_PATTERN_STRIPED as isize,
    /// Stripes that cross.
    Crossed = abi::BUSBAR_PATTERN_CROSSED as isize,
    /// Dots.
    Dotted = abi::BUSBAR_PATTERN_DOTTED as isize,
}

/// A description as the host reads it, with what its pointers lead to.
pub(crate) struct RawDescription {
    legend: Vec<abi::BusbarLegendEntry>,
    equipment: Vec<abi::BusbarStr>,
    mechanisms: Vec<abi::BusbarStr>,
    contour: Option<abi::BusbarContour>,
    kept: Description,
}

impl RawDescription {
    pub(crate) fn of(description: Description) -> Self {
        let entry = |entry: &LegendEntry| {
            let [red, green, blue] = entry.color;
            abi::BusbarLegendEntry {
                name: abi::BusbarStr::from_borrowed(&entry.name),
                pattern: entry.pattern as u32,
                color: u32::from_be_bytes([0, red, green, blue]),
            }
        };
        let texts = |texts: &[String]| {
            texts.iter().map(|text| abi::BusbarStr::from_borrowed(text)).collect()
        };
        let contour = |contour: &Contour| abi::BusbarContour {
            name: abi::BusbarStr::from_borrowed(&contour.name),
            unit: abi::BusbarStr::from_borrowed(&contour.unit),
            reach_metres: contour.reach_metres,
            low: contour.low.unwrap_or(f64::NAN),
            high: contour.high.unwrap_or(f64::NAN),
            step: contour.step,
        };
        // Strings stay where they are when the vectors that hold them move.
        Self {
            legend: description.legend.iter().map(entry).collect(),
            equipment: texts(&description.equipment),
            mechanisms: texts(&description.mechanisms),
            contour: description.contour.as_ref().map(contour),
            kept: description,
        }
    }

    pub(crate) fn write(&self, into: &mut abi::BusbarOverlayDescription) {
        into.legend_count = self.legend.len() as u32;
        into.equipment_count = self.equipment.len() as u32;
        into.reserved = 0;
        into.legend = self.legend.as_ptr();
        into.equipment = self.equipment.as_ptr();
        into.mechanism_count = self.mechanisms.len() as u32;
        into.starts_hidden = self.kept.starts_hidden.into();
        into.mechanisms = self.mechanisms.as_ptr();
        into.contour = self.contour.as_ref().map_or(std::ptr::null(), std::ptr::from_ref);
    }
}

/// A tag bound to a node.
#[derive(Clone, Debug, PartialEq)]
pub struct Binding {
    /// Names the node on the canvas.
    pub node: u32,
    /// The type of value that the tag has.
    pub kind: ValueKind,
    /// Lower end of the normal band.
    pub limit_low: Option<f64>,
    /// Upper end of the normal band.
    pub limit_high: Option<f64>,
    /// Tag id.
    pub tag_id: String,
    /// Tag name for people.
    pub tag_name: String,
    /// Unit; empty for none.
    pub unit: String,
    /// Equipment id of the node.
    pub node_id: String,
    /// What the value means to the node.
    pub role: String,
}

/// State of a bound tag in this frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TagValue {
    /// The last value; `None` if none came yet.
    pub value: Option<Value>,
    /// Quality, freshness included.
    pub quality: Quality,
    /// Time since the value came.
    pub age: Duration,
}

impl TagValue {
    /// The number that the tag has, if it is good.
    pub fn good_number(&self) -> Option<f64> {
        self.number().filter(|_| self.quality == Quality::Good)
    }

    /// The last number that the tag had, whatever its quality.
    pub fn number(&self) -> Option<f64> {
        let number = match self.value? {
            Value::F64(value) => value,
            Value::I64(value) => value as f64,
            Value::Bool(_) | Value::DoublePoint(_) => return None,
        };
        number.is_finite().then_some(number)
    }
}

/// All bound tags at one instant.
pub struct OverlayFrame<'a> {
    unix_nanos: i64,
    values: &'a [abi::BusbarTagValue],
}

impl OverlayFrame<'_> {
    /// The frame's instant, nanoseconds since 1970-01-01 UTC. The clock may be set back.
    pub fn unix_nanos(&self) -> i64 {
        self.unix_nanos
    }

    /// Values in the order of the bindings.
    pub fn values(&self) -> impl ExactSizeIterator<Item = TagValue> + '_ {
        self.values.iter().map(|raw| TagValue {
            value: Value::from_abi(raw.kind, raw.value),
            quality: Quality::from_abi(raw.quality, raw.reason),
            age: Duration::from_millis(raw.age_millis),
        })
    }
}

/// How much something needs an operator.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// Grey.
    Normal,
    /// Outside the normal band.
    Warning,
    /// Needs action now.
    Alarm,
}

/// What to draw, written straight into the host's buffers.
pub struct Canvas<'a> {
    output: &'a mut abi::BusbarOverlayOutput,
}

impl Canvas<'_> {
    /// A line of the label at a node. `binding` is the index of the binding
    /// that the text rests on; the host hatches the line when its value is not
    /// good. Caption and text are cut at [`MAX_LINE_TEXT`] bytes.
    ///
    /// # Errors
    /// When the host's buffers are full.
    pub fn line(
        &mut self,
        binding: usize,
        node: u32,
        severity: Severity,
        caption: &str,
        text: &str,
    ) -> Result<(), Error> {
        let (caption_offset, caption_len) = self.text(caption)?;
        let (text_offset, text_len) = self.text(text)?;
        self.push(abi::BusbarOverlayPrimitive {
            kind: abi::BUSBAR_OVERLAY_LINE,
            binding: binding as u32,
            node,
            severity: severity as u32,
            caption_offset,
            caption_len,
            text_offset,
            text_len,
        })
    }

    /// The node and all under it in the colour of a severity.
    ///
    /// # Errors
    /// When the host's buffers are full.
    pub fn tint(&mut self, binding: usize, node: u32, severity: Severity) -> Result<(), Error> {
        self.push(abi::BusbarOverlayPrimitive {
            kind: abi::BUSBAR_OVERLAY_TINT,
            binding: binding as u32,
            node,
            severity: severity as u32,
            caption_offset: 0,
            caption_len: 0,
            text_offset: 0,
            text_len: 0,
        })
    }

    /// A piece of the equipment described in a state of the legend, by their indices. The
    /// host shows it as unknown when the value of `binding`, which it rests on, is not
    /// good. What rests on several is named once for each, one after the other, at most
    /// [`MAX_BINDINGS_A_STATE`] times: the host marks it in the very frame in which any of
    /// them is not good, and does not wait for the overlay to hear of it.
    ///
    /// # Errors
    /// When the host's buffers are full.
    pub fn state(&mut self, binding: usize, equipment: usize, entry: usize) -> Result<(), Error> {
        self.push(abi::BusbarOverlayPrimitive {
            kind: abi::BUSBAR_OVERLAY_STATE,
            binding: binding as u32,
            node: equipment as u32,
            severity: entry as u32,
            caption_offset: 0,
            caption_len: 0,
            text_offset: 0,
            text_len: 0,
        })
    }

    /// A state that rests on several bindings, at most [`MAX_BINDINGS_A_STATE`].
    ///
    /// # Errors
    /// When the host's buffers are full.
    pub fn state_on(
        &mut self,
        bindings: impl IntoIterator<Item = usize>,
        equipment: usize,
        entry: usize,
    ) -> Result<(), Error> {
        bindings.into_iter().try_for_each(|binding| self.state(binding, equipment, entry))
    }

    /// Where a switch of the equipment described stands: the share of its way that a
    /// mechanism has travelled from open, 0, to closed, 1; `None` where what is reported
    /// contradicts itself. The host moves the parts of that mechanism; a switch without any
    /// has a flag.
    ///
    /// # Errors
    /// When the host's buffers are full.
    pub fn position(
        &mut self,
        binding: usize,
        equipment: usize,
        mechanism: usize,
        travelled: Option<f64>,
    ) -> Result<(), Error> {
        let value = travelled.map_or(f64::NAN, |share| share.clamp(0.0, 1.0));
        self.quantity(abi::BUSBAR_QUANTITY_POSITION, binding, [equipment, mechanism], value)
    }

    /// Power that flows from one piece of the equipment described to another, as a share of
    /// the rating; against that direction where it is negative.
    ///
    /// # Errors
    /// When the host's buffers are full.
    pub fn flow(
        &mut self,
        binding: usize,
        [from, to]: [usize; 2],
        share: f64,
    ) -> Result<(), Error> {
        self.quantity(abi::BUSBAR_QUANTITY_FLOW, binding, [from, to], share)
    }

    /// A level of the contour at a piece of the equipment described, in its unit.
    ///
    /// # Errors
    /// When the host's buffers are full.
    pub fn level(&mut self, binding: usize, equipment: usize, value: f64) -> Result<(), Error> {
        self.quantity(abi::BUSBAR_QUANTITY_LEVEL, binding, [equipment, 0], value)
    }

    fn quantity(
        &mut self,
        kind: u32,
        binding: usize,
        [equipment, other]: [usize; 2],
        value: f64,
    ) -> Result<(), Error> {
        if self.output.quantity_count >= self.output.quantity_capacity {
            let room = self.output.quantity_capacity;
            return Err(Error::buffer(format!("more than {room} overlay quantities")));
        }
        let quantity = abi::BusbarOverlayQuantity {
            kind,
            binding: binding as u32,
            equipment: equipment as u32,
            other: other as u32,
            value,
        };
        let end = self.output.quantities.wrapping_add(self.output.quantity_count as usize);
        // SAFETY: the host gives room for `quantity_capacity` elements.
        unsafe { copy_out(&[quantity], end)? };
        self.output.quantity_count += 1;
        Ok(())
    }

    fn push(&mut self, primitive: abi::BusbarOverlayPrimitive) -> Result<(), Error> {
        if self.output.primitive_count >= self.output.primitive_capacity {
            let room = self.output.primitive_capacity;
            return Err(Error::buffer(format!("more than {room} overlay primitives")));
        }
        let end = self.output.primitives.wrapping_add(self.output.primitive_count as usize);
        // SAFETY: the host gives room for `primitive_capacity` elements.
        unsafe { copy_out(&[primitive], end)? };
        self.output.primitive_count += 1;
        Ok(())
    }

    fn text(&mut self, text: &str) -> Result<(u32, u32), Error> {
        let text = &text[..text.floor_char_boundary(MAX_LINE_TEXT)];
        let offset = self.output.text_len;
        let room = self.output.text_capacity.saturating_sub(offset) as usize;
        if text.len() > room {
            return Err(Error::buffer("the overlay's text does not fit the host's buffer"));
        }
        let end = self.output.text.wrapping_add(offset as usize);
        // SAFETY: the host gives `text_capacity` bytes.
        unsafe { copy_out(text.as_bytes(), end)? };
        self.output.text_len += text.len() as u32;
        Ok((offset, text.len() as u32))
    }
}

/// # Safety
/// Pointers are null or valid as the ABI's `draw` demands.
pub(crate) unsafe fn run<P: Overlay>(
    plugin: &mut P,
    frame: *const abi::BusbarOverlayFrame,
    output: *mut abi::BusbarOverlayOutput,
) -> Result<(), Error> {
    // SAFETY: the caller vouches for the pointers.
    let (frame, output) =
        unsafe { (given(frame, "draw: the frame")?, given_mut(output, "draw: the output")?) };
    if output.primitives.is_null() || output.text.is_null() {
        return Err(Error::argument("draw: a buffer is null"));
    }
    output.primitive_count = 0;
    output.text_len = 0;
    output.quantity_count = 0;
    // SAFETY: the host gives `value_count` elements.
    let values = unsafe { crate::border::slice(frame.values, frame.value_count as usize)? };
    let unix_nanos = frame.time_unix_nanos;
    plugin.draw(&OverlayFrame { unix_nanos, values }, &mut Canvas { output })
}

/// # Safety
/// Pointers are null or valid as the ABI's `configure` demands.
pub(crate) unsafe fn read_bindings(
    bindings: *const abi::BusbarBinding,
    count: usize,
) -> Result<Vec<Binding>, Error> {
    // SAFETY: the host gives `count` elements.
    let bindings = unsafe { crate::border::slice(bindings, count)? };
    let owned = |text| {
        // SAFETY: the host's texts are valid for the call.
        unsafe { crate::border::text(text) }.map(str::to_owned)
    };
    let limit = |value: f64| (!value.is_nan()).then_some(value);
    bindings
        .iter()
        .map(|raw| {
            Ok(Binding {
                node: raw.node,
                kind: ValueKind::from_abi(raw.kind)
                    .ok_or_else(|| Error::argument(format!("unknown value kind {}", raw.kind)))?,
                limit_low: limit(raw.limit_low),
                limit_high: limit(raw.limit_high),
                tag_id: owned(raw.tag_id)?,
                tag_name: owned(raw.tag_name)?,
                unit: owned(raw.unit)?,
                node_id: owned(raw.node_id)?,
                role: owned(raw.role)?,
            })
        })
        .collect()
}
