//! Runner for overlays: draws a frame through the C ABI and reads it as the host does.

use std::ops::Range;

use busbar_plugin_abi as abi;

use crate::overlay::run;
use crate::{Binding, Error, Overlay, Severity, TagValue, Verdict, VerdictSeverity};

/// Capacity of each output buffer, elements.
const CAPACITY: usize = 1 << 16;

/// Output of an overlay in one frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Drawing {
    /// Lines of labels, in order.
    pub lines: Vec<DrawnLine>,
    /// Tinted nodes with their severity.
    pub tints: Vec<(u32, Severity)>,
    /// Equipment with the entry of the legend and the binding that it rests on.
    pub states: Vec<DrawnState>,
    /// Positions, flows and levels.
    pub quantities: Vec<DrawnQuantity>,
    /// Verdicts on equipment, in order.
    pub verdicts: Vec<DrawnVerdict>,
}

impl Drawing {
    /// Finds the judgment on a piece of equipment by its index.
    pub fn verdict(&self, equipment: usize) -> Option<&DrawnVerdict> {
        self.verdicts.iter().find(|verdict| verdict.equipment == equipment)
    }
}

/// A judgment, by the indices of what was described and of the bindings.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DrawnVerdict {
    /// Index of the equipment.
    pub equipment: usize,
    /// Verdict on the equipment.
    pub verdict: Verdict,
    /// Severity of an abnormal verdict; says nothing of any other.
    pub severity: VerdictSeverity,
    /// Reason, with what is assumed.
    pub reason: String,
    /// Reports whether it rests on a default of the plugin.
    pub is_assumed: bool,
    /// Bindings that it rests on.
    pub basis: Vec<usize>,
}

/// Position, flow or level, by the indices of what was described and of the binding.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DrawnQuantity {
    /// Position of a switch: binding, equipment, mechanism, share travelled.
    Position([usize; 3], Option<f64>),
    /// Flow between two pieces of equipment: binding, from, to, share of the rating.
    Flow([usize; 3], f64),
    /// Level of a contour: binding, equipment, value.
    Level([usize; 2], f64),
}

/// State of equipment, by the indices of what was described and of the binding.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DrawnState {
    /// Index of the equipment.
    pub equipment: usize,
    /// Index of the legend's entry.
    pub entry: usize,
    /// Index of the binding that the state rests on.
    pub binding: usize,
}

/// Line of a label.
#[derive(Clone, Debug, PartialEq)]
pub struct DrawnLine {
    /// Handle of the node.
    pub node: u32,
    /// Severity of the line.
    pub severity: Severity,
    /// Caption of the line.
    pub caption: String,
    /// Value of the line as text.
    pub text: String,
}

/// Configures an overlay and lets it draw these values, through the C ABI.
///
/// # Errors
/// What the overlay says.
pub fn draw<P: Overlay>(
    overlay: &mut P,
    bindings: Vec<Binding>,
    values: &[TagValue],
) -> Result<Drawing, Error> {
    draw_at(overlay, Some(bindings), values, 0)
}

/// Draws one frame of an overlay with these values at an instant, nanoseconds since 1970-01-01 UTC;
/// configures it first where there are bindings.
///
/// # Errors
/// What the overlay says.
pub fn draw_at<P: Overlay>(
    overlay: &mut P,
    bindings: Option<Vec<Binding>>,
    values: &[TagValue],
    unix_nanos: i64,
) -> Result<Drawing, Error> {
    if let Some(bindings) = bindings {
        overlay.configure(bindings)?;
    }
    let values: Vec<_> = values.iter().map(value_to_abi).collect();
    let frame = abi::BusbarOverlayFrame {
        struct_size: size_of::<abi::BusbarOverlayFrame>() as u32,
        value_count: values.len() as u32,
        time_unix_nanos: unix_nanos,
        values: values.as_ptr(),
    };
    let mut primitives = Vec::with_capacity(CAPACITY);
    let mut text = vec![0; CAPACITY];
    let mut quantities = Vec::with_capacity(CAPACITY);
    let mut verdicts = Vec::with_capacity(CAPACITY);
    let mut basis = vec![0; CAPACITY];
    let mut output = abi::BusbarOverlayOutput {
        struct_size: size_of::<abi::BusbarOverlayOutput>() as u32,
        primitive_capacity: CAPACITY as u32,
        primitive_count: 0,
        text_capacity: CAPACITY as u32,
        text_len: 0,
        reserved: 0,
        primitives: primitives.as_mut_ptr(),
        text: text.as_mut_ptr(),
        quantity_capacity: CAPACITY as u32,
        quantity_count: 0,
        quantities: quantities.as_mut_ptr(),
        verdict_capacity: CAPACITY as u32,
        verdict_count: 0,
        verdicts: verdicts.as_mut_ptr(),
        basis_capacity: CAPACITY as u32,
        basis_count: 0,
        basis: basis.as_mut_ptr(),
    };
    // SAFETY: frame and buffers live for the call and are as long as they say.
    unsafe { run(overlay, values.len(), &raw const frame, &raw mut output)? };
    // SAFETY: the canvas wrote each primitive that it counts.
    unsafe { primitives.set_len(output.primitive_count as usize) };
    // SAFETY: likewise each quantity.
    unsafe { quantities.set_len(output.quantity_count as usize) };
    // SAFETY: likewise each verdict.
    unsafe { verdicts.set_len(output.verdict_count as usize) };
    let mut drawing = Drawing::default();
    for primitive in &primitives {
        read(primitive, &text, &mut drawing);
    }
    drawing.quantities = quantities.iter().map(read_quantity).collect();
    drawing.verdicts =
        verdicts.iter().map(|verdict| read_verdict(verdict, &text, &basis)).collect();
    Ok(drawing)
}

fn read_verdict(raw: &abi::BusbarOverlayVerdict, text: &[u8], basis: &[u32]) -> DrawnVerdict {
    let range = |offset: u32, len: u32| offset as usize..offset as usize + len as usize;
    DrawnVerdict {
        equipment: raw.equipment as usize,
        verdict: Verdict::from_code(raw.verdict).unwrap_or(Verdict::Unknown),
        reason: String::from_utf8_lossy(&text[range(raw.reason_offset, raw.reason_len)])
            .into_owned(),
        severity: VerdictSeverity::from_bounds(
            raw.flags & (abi::BUSBAR_VERDICT_FLAG_WARNING | abi::BUSBAR_VERDICT_FLAG_PERHAPS_ALARM)
                == 0,
            raw.flags & abi::BUSBAR_VERDICT_FLAG_WARNING == 0,
        ),
        is_assumed: raw.flags & abi::BUSBAR_VERDICT_FLAG_ASSUMED != 0,
        basis: basis[range(raw.basis_offset, raw.basis_count)]
            .iter()
            .map(|binding| *binding as usize)
            .collect(),
    }
}

fn read_quantity(quantity: &abi::BusbarOverlayQuantity) -> DrawnQuantity {
    let &abi::BusbarOverlayQuantity { kind, binding, equipment, value, .. } = quantity;
    let [binding, equipment, mechanism, to] =
        [binding, equipment, quantity.mechanism, quantity.to_equipment].map(|index| index as usize);
    match kind {
        abi::BUSBAR_QUANTITY_KIND_POSITION => {
            let travelled = (!value.is_nan()).then_some(value);
            DrawnQuantity::Position([binding, equipment, mechanism], travelled)
        }
        abi::BUSBAR_QUANTITY_KIND_FLOW => DrawnQuantity::Flow([binding, equipment, to], value),
        _ => DrawnQuantity::Level([binding, equipment], value),
    }
}

fn read(primitive: &abi::BusbarOverlayPrimitive, text: &[u8], into: &mut Drawing) {
    if primitive.kind == abi::BUSBAR_PRIMITIVE_KIND_STATE {
        let [equipment, entry, binding] =
            [primitive.equipment, primitive.entry, primitive.binding].map(|index| index as usize);
        into.states.push(DrawnState { equipment, entry, binding });
        return;
    }
    let severity = Severity::from_code(primitive.severity).unwrap_or(Severity::Alarm);
    if primitive.kind == abi::BUSBAR_PRIMITIVE_KIND_TINT {
        into.tints.push((primitive.node, severity));
        return;
    }
    let part = |offset: u32, len: u32| {
        let range: Range<usize> = offset as usize..offset as usize + len as usize;
        String::from_utf8_lossy(&text[range]).into_owned()
    };
    into.lines.push(DrawnLine {
        node: primitive.node,
        severity,
        caption: part(primitive.caption_offset, primitive.caption_len),
        text: part(primitive.text_offset, primitive.text_len),
    });
}

fn value_to_abi(value: &TagValue) -> abi::BusbarTagValue {
    let abi::ValueFields { kind, number, integer, text } =
        abi::ValueFields::new(value.value.as_ref());
    let (quality, reason) = value.quality.codes();
    let age_millis = value.age.as_millis() as u64;
    let origin = abi::flags_of_origin(value.origin);
    let reserved = [0; 4];
    abi::BusbarTagValue {
        kind,
        quality,
        reason,
        origin,
        reserved,
        number,
        integer,
        age_millis,
        text,
    }
}
