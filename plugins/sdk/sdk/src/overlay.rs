//! Capability `busbar.overlay/2-draft`: values, states and verdicts at equipment.

use std::time::Duration;

use busbar_plugin_abi as abi;

use crate::boundary::{checked_mut, checked_ref, copy_out};
use busbar_types::{Origin, Verdict};

use crate::judgment::{Basis, Judgment, severity_flag};
use crate::overlay_description::Description;
use crate::value::{read_quality, read_value};
use crate::{Error, Plugin, Quality, Severity, Value, ValueKind};

/// Bytes of a caption, and of a value, at most; the canvas cuts longer ones.
pub const MAX_LINE_TEXT: usize = 256;

/// Overlay that shows values and states at equipment, and judges it.
pub trait Overlay: Plugin {
    /// Describes the equipment judged, the legend, and what the bindings lack: asked for
    /// after each `configure`.
    fn describe(&self) -> Description {
        Description::default()
    }

    /// Takes the tags that are bound to nodes, before the first `draw`. To try the
    /// settings it may come without any before. What is missing there is a finding of
    /// [`Description`] and an unknown verdict, not an error.
    ///
    /// # Errors
    /// Faults of the settings that no binding could mend.
    fn configure(&mut self, bindings: Vec<Binding>) -> Result<(), Error>;

    /// Draws a frame and judges every piece of equipment described, within a few
    /// milliseconds. It is called also while nobody has the overlay drawn.
    ///
    /// # Errors
    /// That of [`Canvas`]: hand it on.
    fn draw(&mut self, frame: &OverlayFrame<'_>, canvas: &mut Canvas<'_>) -> Result<(), Error>;
}

/// Binding of a tag to a node.
#[derive(Clone, Debug, PartialEq)]
pub struct Binding {
    /// Handle that names the node on the canvas.
    pub node: u32,
    /// Type of the tag's values.
    pub kind: ValueKind,
    /// Lower end of the normal band.
    pub limit_low: Option<f64>,
    /// Upper end of the normal band.
    pub limit_high: Option<f64>,
    /// Id of the tag.
    pub tag_id: String,
    /// Display name of the tag.
    pub tag_name: String,
    /// Unit of the value; empty for none.
    pub unit: String,
    /// Equipment id of the node.
    pub node_id: String,
    /// Role of the value for the node, as the configuration words it.
    pub role: String,
}

/// State of a bound tag in this frame.
#[derive(Clone, Debug, PartialEq)]
pub struct TagValue {
    /// Last value; `None` if none came yet.
    pub value: Option<Value>,
    /// Quality of the value, freshness included.
    pub quality: Quality,
    /// Time since the value came.
    pub age: Duration,
    /// Origins of the value; empty for a live one.
    pub origin: Origin,
}

impl TagValue {
    /// Returns the value as a number, if it is good.
    pub fn good_number(&self) -> Option<f64> {
        self.number().filter(|_| self.quality == Quality::Good)
    }

    /// Returns the last value as a number, whatever its quality.
    pub fn number(&self) -> Option<f64> {
        let number = self.value.as_ref()?.as_number()?;
        number.is_finite().then_some(number)
    }
}

/// Values of all bound tags at one instant.
pub struct OverlayFrame<'a> {
    unix_nanos: i64,
    values: &'a [abi::BusbarTagValue],
}

impl OverlayFrame<'_> {
    /// Returns the scene clock, nanoseconds since 1970-01-01 UTC: the time of the values, a
    /// recording's where they are replayed. It may stand still, run fast, or be set back.
    pub fn unix_nanos(&self) -> i64 {
        self.unix_nanos
    }

    /// Returns the values in the order of the bindings.
    pub fn values(&self) -> impl ExactSizeIterator<Item = TagValue> + '_ {
        self.values.iter().map(|raw| TagValue {
            value: read_frame_value(raw),
            quality: read_quality(raw.quality, raw.reason),
            age: Duration::from_millis(raw.age_millis),
            origin: abi::origin_of_flags(raw.origin),
        })
    }
}

fn read_frame_value(raw: &abi::BusbarTagValue) -> Option<Value> {
    let &abi::BusbarTagValue { kind, number, integer, text, .. } = raw;
    // SAFETY: `run` makes frames of values whose texts the host keeps for the call.
    unsafe { read_value(abi::ValueFields { kind, number, integer, text }) }
}

/// Output of a frame, written straight into the host's buffers.
pub struct Canvas<'a> {
    output: &'a mut abi::BusbarOverlayOutput,
}

impl Canvas<'_> {
    /// Adds a line to the label of a node. `binding` is the index of the binding that the text
    /// rests on. The host hatches the line when the value of that binding is not good. Caption and
    /// text are cut at [`MAX_LINE_TEXT`] bytes.
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
            kind: abi::BUSBAR_PRIMITIVE_KIND_LINE,
            binding: binding as u32,
            node,
            severity: severity as u32,
            equipment: 0,
            entry: 0,
            caption_offset,
            caption_len,
            text_offset,
            text_len,
        })
    }

    /// Draws the node and all under it in the colour of a severity.
    ///
    /// # Errors
    /// When the host's buffers are full.
    pub fn tint(&mut self, binding: usize, node: u32, severity: Severity) -> Result<(), Error> {
        self.push(abi::BusbarOverlayPrimitive {
            kind: abi::BUSBAR_PRIMITIVE_KIND_TINT,
            binding: binding as u32,
            node,
            severity: severity as u32,
            equipment: 0,
            entry: 0,
            caption_offset: 0,
            caption_len: 0,
            text_offset: 0,
            text_len: 0,
        })
    }

    /// Sets a piece of the equipment described to a state of the legend, by their indices. The host
    /// shows it as unknown when the value of `binding`, which it rests on, is not good. A state
    /// that rests on several bindings is named once for each, one after the other. The host then
    /// marks it in the very frame in which any of them is not good, before the overlay receives
    /// that.
    ///
    /// # Errors
    /// When the host's buffers are full.
    pub fn state(&mut self, binding: usize, equipment: usize, entry: usize) -> Result<(), Error> {
        self.push(abi::BusbarOverlayPrimitive {
            kind: abi::BUSBAR_PRIMITIVE_KIND_STATE,
            binding: binding as u32,
            node: 0,
            severity: 0,
            equipment: equipment as u32,
            entry: entry as u32,
            caption_offset: 0,
            caption_len: 0,
            text_offset: 0,
            text_len: 0,
        })
    }

    /// Sets a state that rests on several bindings.
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

    /// Lists the bindings that verdicts rest on; several verdicts may share the list.
    ///
    /// # Errors
    /// When the host's buffers are full.
    pub fn basis(&mut self, bindings: impl IntoIterator<Item = usize>) -> Result<Basis, Error> {
        let offset = self.output.basis_count;
        for binding in bindings {
            if self.output.basis_count >= self.output.basis_capacity {
                let room = self.output.basis_capacity;
                return Err(Error::buffer(format!("more than {room} bindings under verdicts")));
            }
            let end = self.output.basis.wrapping_add(self.output.basis_count as usize);
            // SAFETY: the host gives room for `basis_capacity` elements.
            unsafe { copy_out(&[binding as u32], end)? };
            self.output.basis_count += 1;
        }
        Ok(Basis { offset, count: self.output.basis_count - offset })
    }

    /// Judges a piece of the equipment described, by its index. Every piece needs a judgment in
    /// every frame: silence would mean "judged healthy". The host draws an unknown one as it draws
    /// bad data, with the reason. It withdraws a verdict in the very frame in which a value that it
    /// rests on is not good. The reason is cut at [`MAX_LINE_TEXT`] bytes.
    ///
    /// # Errors
    /// When the host's buffers are full.
    pub fn judge(
        &mut self,
        equipment: usize,
        basis: Basis,
        judgment: &Judgment<'_>,
    ) -> Result<(), Error> {
        let Judgment { verdict, severity, reason, assumption } = *judgment;
        let (reason_offset, reason_len) = match (reason, assumption) {
            (reason, "") => self.text(reason)?,
            ("", assumption) => self.text(&format!("assumed: {assumption}"))?,
            (reason, assumption) => self.text(&format!("{reason}; assumed: {assumption}"))?,
        };
        if self.output.verdict_count >= self.output.verdict_capacity {
            let room = self.output.verdict_capacity;
            return Err(Error::buffer(format!("more than {room} verdicts")));
        }
        let assumed = if assumption.is_empty() { 0 } else { abi::BUSBAR_VERDICT_FLAG_ASSUMED };
        let severity = if verdict == Verdict::Abnormal { severity_flag(severity) } else { 0 };
        let verdict = abi::BusbarOverlayVerdict {
            equipment: equipment as u32,
            verdict: verdict as u32,
            flags: assumed | severity,
            reason_offset,
            reason_len,
            basis_offset: basis.offset,
            basis_count: basis.count,
        };
        let end = self.output.verdicts.wrapping_add(self.output.verdict_count as usize);
        // SAFETY: the host gives room for `verdict_capacity` elements.
        unsafe { copy_out(&[verdict], end)? };
        self.output.verdict_count += 1;
        Ok(())
    }

    /// Sets the position of a switch of the equipment described: the share of the travel of a
    /// mechanism from open, 0, to closed, 1. `None` stands for contradictory reports. The host
    /// moves the parts of that mechanism; a switch without any has a flag.
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
        self.quantity(abi::BusbarOverlayQuantity {
            kind: abi::BUSBAR_QUANTITY_KIND_POSITION,
            binding: binding as u32,
            equipment: equipment as u32,
            mechanism: mechanism as u32,
            to_equipment: 0,
            reserved: 0,
            value,
        })
    }

    /// Sets the power that flows from one piece of the equipment described to another, as a share
    /// of the rating. A negative share flows against that direction.
    ///
    /// # Errors
    /// When the host's buffers are full.
    pub fn flow(
        &mut self,
        binding: usize,
        [from, to]: [usize; 2],
        share: f64,
    ) -> Result<(), Error> {
        self.quantity(abi::BusbarOverlayQuantity {
            kind: abi::BUSBAR_QUANTITY_KIND_FLOW,
            binding: binding as u32,
            equipment: from as u32,
            mechanism: 0,
            to_equipment: to as u32,
            reserved: 0,
            value: share,
        })
    }

    /// Sets a level of the contour at a piece of the equipment described, in the contour's unit.
    ///
    /// # Errors
    /// When the host's buffers are full.
    pub fn level(&mut self, binding: usize, equipment: usize, value: f64) -> Result<(), Error> {
        self.quantity(abi::BusbarOverlayQuantity {
            kind: abi::BUSBAR_QUANTITY_KIND_LEVEL,
            binding: binding as u32,
            equipment: equipment as u32,
            mechanism: 0,
            to_equipment: 0,
            reserved: 0,
            value,
        })
    }

    fn quantity(&mut self, quantity: abi::BusbarOverlayQuantity) -> Result<(), Error> {
        if self.output.quantity_count >= self.output.quantity_capacity {
            let room = self.output.quantity_capacity;
            return Err(Error::buffer(format!("more than {room} overlay quantities")));
        }
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
    bindings: usize,
    frame: *const abi::BusbarOverlayFrame,
    output: *mut abi::BusbarOverlayOutput,
) -> Result<(), Error> {
    // SAFETY: the caller vouches for the pointers.
    let (frame, output) = unsafe {
        (checked_ref(frame, "draw: the frame")?, checked_mut(output, "draw: the output")?)
    };
    if frame.value_count as usize != bindings {
        let count = frame.value_count;
        return Err(Error::argument(format!("draw: {count} values for {bindings} bindings")));
    }
    if output.primitives.is_null() || output.text.is_null() {
        return Err(Error::argument("draw: a buffer is null"));
    }
    output.primitive_count = 0;
    output.text_len = 0;
    output.quantity_count = 0;
    output.verdict_count = 0;
    output.basis_count = 0;
    // SAFETY: the host gives `value_count` elements.
    let values = unsafe { crate::boundary::slice(frame.values, frame.value_count as usize)? };
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
    let bindings = unsafe { crate::boundary::slice(bindings, count)? };
    let owned = |text| {
        // SAFETY: the host's texts are valid for the call.
        unsafe { crate::boundary::text(text) }.map(str::to_owned)
    };
    let limit = |value: f64| (!value.is_nan()).then_some(value);
    bindings
        .iter()
        .map(|raw| {
            Ok(Binding {
                node: raw.node,
                kind: ValueKind::from_code(raw.kind)
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
