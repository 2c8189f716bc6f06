//! Overlay plugins: capability `busbar.overlay/2-draft`.

use std::ops::Range;
use std::sync::Arc;
use std::time::{SystemTime, UNIX_EPOCH};

use busbar_overlay_picture::{
    LegendEntry, MAX_BASIS, MAX_FINDINGS, MAX_LEGEND_ENTRIES, MAX_MECHANISMS,
    MAX_OVERLAY_EQUIPMENT, MAX_PART_BYTES, OverlayBinding, OverlayDescription, OverlayLine,
    OverlayPicture, OverlayState, OverlayTint, PictureRules, max_primitives, max_quantities,
    max_verdicts,
};
use busbar_plugin_abi as abi;
use busbar_tags::TagState;
use busbar_types::{Pattern, Quality, Reason, Severity};

use crate::{Instance, PluginError, overlay_quantity, overlay_verdict, text};

/// Bytes of text that one overlay may draw in a frame, a primitive.
const MAX_TEXT_A_PRIMITIVE: usize = 256;

/// Configured instance of an overlay plugin.
pub struct Overlay {
    instance: Arc<Instance>,
    table: &'static abi::BusbarOverlay,
    bindings: Vec<OverlayBinding>,
    description: Arc<OverlayDescription>,
    rules: PictureRules,
    primitives: Vec<abi::BusbarOverlayPrimitive>,
    text: Vec<u8>,
    quantities: Vec<abi::BusbarOverlayQuantity>,
    verdicts: Vec<abi::BusbarOverlayVerdict>,
    basis: Vec<u32>,
}

impl Overlay {
    /// Configures an instance with its bindings.
    ///
    /// # Errors
    /// [`PluginError::WrongCapability`], or what the plugin says.
    pub fn configure(
        instance: Arc<Instance>,
        bindings: Vec<OverlayBinding>,
    ) -> Result<Self, PluginError> {
        let table: &abi::BusbarOverlay = instance.capability(abi::OVERLAY_ID)?;
        let (Some(configure), Some(_)) = (table.configure, table.draw) else {
            return Err(instance.violation("`configure` or `draw` is null"));
        };
        let raw: Vec<_> = bindings.iter().map(binding_to_abi).collect();
        let mut error = abi::BusbarError::empty();
        let serial = instance.serialize_calls();
        // SAFETY: bindings, their texts and the error live for the call.
        let status = unsafe { configure(instance.as_ptr(), raw.as_ptr(), raw.len(), &mut error) };
        drop(serial);
        instance.outcome(status, &error)?;
        let description = describe(&instance, table)?;
        let room = bindings.len() * 2 + description.equipment.len() + 1;
        let primitives = vec![NO_PRIMITIVE; room];
        let text = vec![0; primitives.len() * 32];
        let quantities = vec![NO_QUANTITY; max_quantities(bindings.len(), &description)];
        let verdicts = vec![NO_VERDICT; max_verdicts(description.equipment.len())];
        let basis = vec![0; bindings.len() + description.equipment.len() * 4];
        let rules = PictureRules::new(&bindings, &description);
        let description = Arc::new(description);
        Ok(Self {
            instance,
            table,
            bindings,
            description,
            rules,
            primitives,
            text,
            quantities,
            verdicts,
            basis,
        })
    }

    /// Returns the plugin instance behind the overlay.
    pub fn instance(&self) -> &Instance {
        &self.instance
    }

    /// The bindings, in the plugin's order.
    pub fn bindings(&self) -> &[OverlayBinding] {
        &self.bindings
    }

    /// Returns the legend and other content besides values.
    pub fn description(&self) -> &Arc<OverlayDescription> {
        &self.description
    }

    /// Draws the overlay for one state a binding, in the order of the bindings.
    ///
    /// # Errors
    /// Returns what the plugin says, or the rule that its result breaks.
    pub fn draw_states(
        &mut self,
        states: &[Option<TagState>],
        now: SystemTime,
    ) -> Result<OverlayPicture, PluginError> {
        let state = |index: usize| states.get(index).and_then(Option::as_ref);
        let values: Vec<_> = (0..self.bindings.len()).map(|i| value_to_abi(state(i))).collect();
        let since = now.duration_since(UNIX_EPOCH).unwrap_or_default();
        let frame = abi::BusbarOverlayFrame {
            struct_size: size_of::<abi::BusbarOverlayFrame>() as u32,
            value_count: values.len() as u32,
            time_unix_nanos: since.as_nanos() as i64,
            values: values.as_ptr(),
        };
        loop {
            let mut output = self.empty_output();
            let mut error = abi::BusbarError::empty();
            let draw = self.table.draw.ok_or_else(|| self.instance.violation("`draw` is null"))?;
            let serial = self.instance.serialize_calls();
            // SAFETY: frame, buffers and error live for the call.
            let status = unsafe { draw(self.instance.as_ptr(), &frame, &mut output, &mut error) };
            drop(serial);
            if status == abi::BUSBAR_BUFFER_TOO_SMALL && self.grow() {
                continue;
            }
            self.instance.outcome(status, &error)?;
            let picture = self.read(&output);
            return picture.map_err(|what| self.instance.violation(what));
        }
    }

    fn empty_output(&mut self) -> abi::BusbarOverlayOutput {
        abi::BusbarOverlayOutput {
            struct_size: size_of::<abi::BusbarOverlayOutput>() as u32,
            primitive_capacity: self.primitives.len() as u32,
            primitive_count: 0,
            text_capacity: self.text.len() as u32,
            text_len: 0,
            reserved: 0,
            primitives: self.primitives.as_mut_ptr(),
            text: self.text.as_mut_ptr(),
            quantity_capacity: self.quantities.len() as u32,
            quantity_count: 0,
            quantities: self.quantities.as_mut_ptr(),
            verdict_capacity: self.verdicts.len() as u32,
            verdict_count: 0,
            verdicts: self.verdicts.as_mut_ptr(),
            basis_capacity: self.basis.len() as u32,
            basis_count: 0,
            basis: self.basis.as_mut_ptr(),
        }
    }

    /// Doubles the buffers up to their limits; false if all are there.
    fn grow(&mut self) -> bool {
        let sizes = |of: &Self| [of.primitives.len(), of.text.len(), of.basis.len()];
        let before = sizes(self);
        let most = max_primitives(self.bindings.len(), &self.description);
        let most_text = most
            .saturating_add(self.description.equipment.len())
            .saturating_mul(MAX_TEXT_A_PRIMITIVE)
            .min(u32::MAX as usize);
        self.primitives.resize((before[0] * 2).min(most), NO_PRIMITIVE);
        self.text.resize((before[1] * 2).min(most_text), 0);
        self.basis.resize((before[2] * 2).min(MAX_BASIS), 0);
        before != sizes(self)
    }

    fn read(&self, output: &abi::BusbarOverlayOutput) -> Result<OverlayPicture, String> {
        let [count, text_len, quantities] =
            [output.primitive_count, output.text_len, output.quantity_count].map(|n| n as usize);
        let primitives = self.primitives.get(..count).ok_or("it claims too many primitives")?;
        let text = self.text.get(..text_len).ok_or("it claims too much text")?;
        let quantities =
            self.quantities.get(..quantities).ok_or("it claims too many quantities")?;
        let text = std::str::from_utf8(text).map_err(|_| "its text is not UTF-8")?;
        let part = |offset: u32, len: u32| {
            if len as usize > MAX_PART_BYTES {
                return Err("a caption or value is too long");
            }
            let range: Range<usize> = offset as usize..offset as usize + len as usize;
            text.get(range).map(str::to_owned).ok_or("a primitive names text that is not there")
        };
        let mut picture = OverlayPicture::default();
        for primitive in primitives {
            let binding = self
                .bindings
                .get(primitive.binding as usize)
                .ok_or("a primitive names a binding that does not exist")?;
            let (node, tag) = (primitive.node, binding.tag);
            if primitive.kind == abi::BUSBAR_PRIMITIVE_KIND_STATE {
                let &abi::BusbarOverlayPrimitive { equipment, entry, .. } = primitive;
                picture.states.push(OverlayState { equipment, entry, tag });
                continue;
            }
            let severity = Severity::from_code(primitive.severity).ok_or_else(|| {
                format!("a primitive has the unknown severity {}", primitive.severity)
            })?;
            match primitive.kind {
                abi::BUSBAR_PRIMITIVE_KIND_LINE => picture.lines.push(OverlayLine {
                    node,
                    tag,
                    severity,
                    caption: part(primitive.caption_offset, primitive.caption_len)?,
                    text: part(primitive.text_offset, primitive.text_len)?,
                }),
                abi::BUSBAR_PRIMITIVE_KIND_TINT => {
                    picture.tints.push(OverlayTint { node, tag, severity });
                }
                other => return Err(format!("a primitive has the unknown kind {other}")),
            }
        }
        for quantity in quantities {
            let binding = self.bindings.get(quantity.binding as usize);
            let binding = binding.ok_or("a quantity names a binding that does not exist")?;
            picture.quantities.push(overlay_quantity::read(quantity, binding.tag)?);
        }
        let [verdicts, basis] =
            [output.verdict_count, output.basis_count].map(|count| count as usize);
        let verdicts = self.verdicts.get(..verdicts).ok_or("it claims too many verdicts")?;
        let basis = self.basis.get(..basis).ok_or("it claims too many bindings of verdicts")?;
        picture.verdicts = overlay_verdict::read(verdicts, basis, text, &self.bindings)?;
        self.rules.check(&picture)?;
        Ok(picture)
    }
}

/// Reads and validates the legend and other content besides values.
fn describe(
    instance: &Instance,
    table: &abi::BusbarOverlay,
) -> Result<OverlayDescription, PluginError> {
    let Some(describe) = table.describe else {
        return Ok(OverlayDescription::default());
    };
    let mut raw = abi::BusbarOverlayDescription {
        struct_size: size_of::<abi::BusbarOverlayDescription>() as u32,
        legend_count: 0,
        equipment_count: 0,
        reserved: 0,
        legend: std::ptr::null(),
        equipment: std::ptr::null(),
        mechanism_count: 0,
        starts_hidden: 0,
        mechanisms: std::ptr::null(),
        contour: std::ptr::null(),
        finding_count: 0,
        reserved_2: 0,
        findings: std::ptr::null(),
    };
    let mut error = abi::BusbarError::empty();
    let serial = instance.serialize_calls();
    // SAFETY: description and error live for the call.
    let status = unsafe { describe(instance.as_ptr(), &mut raw, &mut error) };
    drop(serial);
    instance.outcome(status, &error)?;
    let description = read_description(&raw).map_err(|what| instance.violation(what))?;
    description.check().map_err(|what| instance.violation(what))?;
    Ok(description)
}

fn read_description(raw: &abi::BusbarOverlayDescription) -> Result<OverlayDescription, String> {
    let (entries, ids) = (raw.legend_count as usize, raw.equipment_count as usize);
    let mechanism_count = raw.mechanism_count as usize;
    let is_too_much = entries > MAX_LEGEND_ENTRIES
        || mechanism_count > MAX_MECHANISMS
        || raw.finding_count as usize > MAX_FINDINGS;
    if is_too_much || ids > MAX_OVERLAY_EQUIPMENT {
        return Err("it describes more than an overlay may show".into());
    }
    if (entries > 0 && raw.legend.is_null())
        || (ids > 0 && raw.equipment.is_null())
        || (mechanism_count > 0 && raw.mechanisms.is_null())
        || (raw.finding_count > 0 && raw.findings.is_null())
    {
        return Err("it describes what is null".into());
    }
    let (mut legend, mut equipment) = (Vec::with_capacity(entries), Vec::with_capacity(ids));
    for at in 0..entries {
        // SAFETY: not null; the plugin vouches for so many elements, and their texts.
        let (entry, name) = unsafe {
            let entry = raw.legend.add(at).read_unaligned();
            (entry, text::read(entry.name)?)
        };
        let pattern = Pattern::from_code(entry.pattern)
            .ok_or_else(|| format!("its legend has the unknown pattern {}", entry.pattern))?;
        let [_, red, green, blue] = entry.color.to_be_bytes();
        legend.push(LegendEntry { name, color: [red, green, blue], pattern });
    }
    for at in 0..ids {
        // SAFETY: as above.
        equipment.push(unsafe { text::read(raw.equipment.add(at).read_unaligned())? });
    }
    let mut mechanisms = Vec::with_capacity(mechanism_count);
    for at in 0..mechanism_count {
        // SAFETY: as above.
        mechanisms.push(unsafe { text::read(raw.mechanisms.add(at).read_unaligned())? });
    }
    let contour = (!raw.contour.is_null()).then(|| {
        // SAFETY: not null; the plugin vouches for it and its texts.
        unsafe { overlay_quantity::read_contour(&raw.contour.read_unaligned()) }
    });
    let mut findings = Vec::with_capacity(raw.finding_count as usize);
    for at in 0..raw.finding_count as usize {
        // SAFETY: not null; the plugin vouches for so many elements, and their texts.
        findings.push(unsafe { text::read(raw.findings.add(at).read_unaligned())? });
    }
    let starts_hidden = raw.starts_hidden != 0;
    Ok(OverlayDescription {
        legend,
        equipment,
        mechanisms,
        contour: contour.transpose()?,
        starts_hidden,
        findings,
    })
}

const NO_QUANTITY: abi::BusbarOverlayQuantity = abi::BusbarOverlayQuantity {
    kind: 0,
    binding: 0,
    equipment: 0,
    mechanism: 0,
    to_equipment: 0,
    reserved: 0,
    value: 0.0,
};

const NO_VERDICT: abi::BusbarOverlayVerdict = abi::BusbarOverlayVerdict {
    equipment: 0,
    verdict: 0,
    flags: 0,
    reason_offset: 0,
    reason_len: 0,
    basis_offset: 0,
    basis_count: 0,
};

const NO_PRIMITIVE: abi::BusbarOverlayPrimitive = abi::BusbarOverlayPrimitive {
    kind: 0,
    binding: 0,
    node: 0,
    severity: 0,
    equipment: 0,
    entry: 0,
    caption_offset: 0,
    caption_len: 0,
    text_offset: 0,
    text_len: 0,
};

fn binding_to_abi(binding: &OverlayBinding) -> abi::BusbarBinding {
    abi::BusbarBinding {
        node: binding.node,
        kind: binding.kind.code(),
        reserved: [0; 3],
        limit_low: binding.limit_low.unwrap_or(f64::NAN),
        limit_high: binding.limit_high.unwrap_or(f64::NAN),
        tag_id: abi::BusbarStr::from_borrowed(&binding.tag_id),
        tag_name: abi::BusbarStr::from_borrowed(&binding.tag_name),
        unit: abi::BusbarStr::from_borrowed(&binding.unit),
        node_id: abi::BusbarStr::from_borrowed(&binding.node_id),
        role: abi::BusbarStr::from_borrowed(&binding.role),
    }
}

/// Lays out a tag's state for a plugin. A text is valid as long as the state is.
fn value_to_abi(state: Option<&TagState>) -> abi::BusbarTagValue {
    let quality = state.map_or(Quality::Bad(Reason::NotConnected), |s| s.report_quality);
    let value = abi::ValueFields::new(state.and_then(|s| s.value.as_ref()));
    let (quality, reason) = quality.codes();
    let age = state.and_then(|s| s.age).unwrap_or_default();
    abi::BusbarTagValue {
        kind: value.kind,
        quality,
        reason,
        origin: state.map_or(0, |s| abi::flags_of_origin(s.origin)),
        reserved: [0; 4],
        number: value.number,
        integer: value.integer,
        age_millis: age.as_millis() as u64,
        text: value.text,
    }
}

#[cfg(test)]
mod tests {
    use busbar_types::Origin;

    use super::*;

    #[test]
    fn values_have_the_flags_of_their_origins() {
        let flags = |origin| {
            let state = TagState {
                value: None,
                quality: Quality::Good,
                report_quality: Quality::Good,
                age: None,
                source_time: None,
                origin,
            };
            value_to_abi(Some(&state)).origin
        };
        assert_eq!(flags(Origin::LIVE), 0);
        let simulated = abi::BUSBAR_ORIGIN_SIMULATED;
        assert_eq!(flags(Origin::SIMULATED), simulated);
        assert_eq!(flags(Origin::SIMULATED | Origin::TEST), simulated | abi::BUSBAR_ORIGIN_TEST);
        assert_eq!(flags(Origin::HISTORICAL), abi::BUSBAR_ORIGIN_HISTORICAL);
        for origin in Origin::ALL {
            assert_eq!(abi::origin_of_flags(flags(origin)), origin);
        }
    }
}
