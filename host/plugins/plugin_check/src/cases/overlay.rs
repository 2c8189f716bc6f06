//! Cases of overlays: pictures name existing bindings, nodes and texts.

use std::ops::Range;
use std::time::{Duration, Instant};

use busbar_plugin_abi as abi;

use super::plugin_instance::{Instance, required};
use crate::finding::{Finding, Outcome, Stop};
use crate::probe::Probe;
use crate::text;

type Configure = unsafe extern "C" fn(
    *const abi::BusbarPlugin,
    *const abi::BusbarBinding,
    usize,
    *mut abi::BusbarError,
) -> abi::BusbarStatusNumber;
type Draw = unsafe extern "C" fn(
    *const abi::BusbarPlugin,
    *const abi::BusbarOverlayFrame,
    *mut abi::BusbarOverlayOutput,
    *mut abi::BusbarError,
) -> abi::BusbarStatusNumber;

/// Primitives of one binding, bytes of text of one primitive, and of one part of it,
/// that the host takes.
const MAX_PRIMITIVES_A_BINDING: usize = 8;
const MAX_TEXT_A_PRIMITIVE: usize = 256;
const MAX_PART_BYTES: u32 = 256;
/// Bindings of a large scene, and how long a frame of them may take on a slow machine.
const MANY: usize = 5000;
const MAX_DRAW: Duration = Duration::from_millis(250);
/// Elements behind the end of a buffer that must stay as they are.
const CANARIES: usize = 64;
const CANARY: u8 = 0xa5;
const NO_PRIMITIVE: abi::BusbarOverlayPrimitive = abi::BusbarOverlayPrimitive {
    kind: 0xa5a5_a5a5,
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
const NO_QUANTITY: abi::BusbarOverlayQuantity = abi::BusbarOverlayQuantity {
    kind: 0xa5a5_a5a5,
    binding: 0,
    equipment: 0,
    mechanism: 0,
    to_equipment: 0,
    reserved: 0,
    value: 0.0,
};
const NO_VERDICT: abi::BusbarOverlayVerdict = abi::BusbarOverlayVerdict {
    equipment: 0,
    verdict: 0xa5a5_a5a5,
    flags: 0,
    reason_offset: 0,
    reason_len: 0,
    basis_offset: 0,
    basis_count: 0,
};
const NO_BASIS: u32 = 0xa5a5_a5a5;
/// Room for bindings under verdicts, for each primitive.
const BASIS_A_PRIMITIVE: usize = 16;
const VERDICTS: [u32; 3] =
    [abi::BUSBAR_VERDICT_NORMAL, abi::BUSBAR_VERDICT_ABNORMAL, abi::BUSBAR_VERDICT_UNKNOWN];
/// Flags that tell the severity of an abnormal verdict, at most one of them at once.
const SEVERITY_FLAGS: u32 =
    abi::BUSBAR_VERDICT_FLAG_WARNING | abi::BUSBAR_VERDICT_FLAG_PERHAPS_ALARM;
const VERDICT_FLAGS: u32 = abi::BUSBAR_VERDICT_FLAG_ASSUMED | SEVERITY_FLAGS;
const QUANTITIES: [u32; 3] = [
    abi::BUSBAR_QUANTITY_KIND_POSITION,
    abi::BUSBAR_QUANTITY_KIND_FLOW,
    abi::BUSBAR_QUANTITY_KIND_LEVEL,
];
const TEXTS: [&str; 4] = ["Top oil", "Öl °C µV – ×", "", LONG_NAME];
/// Longer than a caption may be, with a character of two bytes at the very limit.
const LONG_NAME: &str = concat!(
    "x",
    "öööööööööööööööööööööööööööööööööööööööööööööööööööööööööööööööö",
    "öööööööööööööööööööööööööööööööööööööööööööööööööööööööööööööööö",
    "öööööööööööööööööööööööööööööööööööööööööööööööööööööööööööööööö",
);
/// Origins of values: live, simulated, recorded, and several at once.
const ORIGINS: [u8; 5] = [
    0,
    0,
    abi::BUSBAR_ORIGIN_SIMULATED,
    abi::BUSBAR_ORIGIN_RECORDED,
    abi::BUSBAR_ORIGIN_TEST | abi::BUSBAR_ORIGIN_SUBSTITUTED,
];
const KINDS: [u8; 5] = [
    abi::BUSBAR_VALUE_KIND_F64,
    abi::BUSBAR_VALUE_KIND_I64,
    abi::BUSBAR_VALUE_KIND_BOOL,
    abi::BUSBAR_VALUE_KIND_DOUBLE_POINT,
    abi::BUSBAR_VALUE_KIND_TEXT,
];

pub(crate) fn functions(instance: &Instance<'_>) -> Result<(Configure, Draw), Stop> {
    let table: &abi::BusbarOverlay = instance.capability(abi::OVERLAY_ID)?;
    Ok((required(table.configure, "configure")?, required(table.draw, "draw")?))
}

/// Bindings with values of every kind, quality and size.
pub(crate) struct Scene {
    pub(crate) bindings: Vec<abi::BusbarBinding>,
    values: Vec<abi::BusbarTagValue>,
}

impl Scene {
    pub(crate) fn new(count: usize) -> Self {
        let limit = |index: usize, at: f64| if index.is_multiple_of(3) { f64::NAN } else { at };
        let bindings = (0..count).map(|index| abi::BusbarBinding {
            node: 5 + (index / 2) as u32 * 3,
            kind: KINDS[index % KINDS.len()],
            reserved: [0; 3],
            limit_low: limit(index, -10.0),
            limit_high: limit(index, 10.0),
            tag_id: abi::BusbarStr::from_static("T1.TopOil"),
            tag_name: abi::BusbarStr::from_static(TEXTS[index % TEXTS.len()]),
            unit: abi::BusbarStr::from_static(["kV", "°C", ""][index % 3]),
            node_id: abi::BusbarStr::from_static("=S12D1T1-TA1/bushing 1U"),
            role: abi::BusbarStr::from_static(["value", "alarm", ""][index % 3]),
        });
        let mut scene = Self { bindings: bindings.collect(), values: Vec::new() };
        scene.set_values(0);
        scene
    }

    /// Other values for each round: none yet, normal, extreme, not finite.
    fn set_values(&mut self, round: usize) {
        let floats = [0.0, -0.0, 231.449, -1e300, f64::MAX, f64::NAN, f64::INFINITY, 5e-324];
        let whole = [0, 1, -1, i64::MAX, i64::MIN];
        self.values.clear();
        for index in 0..self.bindings.len() {
            let turn = index / KINDS.len() + round;
            let kind = KINDS[index % KINDS.len()];
            let none = (index + round).is_multiple_of(7);
            let kind = if none { abi::BUSBAR_VALUE_KIND_NONE } else { kind };
            let (mut number, mut integer, mut text) = (0.0, 0, "");
            match kind {
                abi::BUSBAR_VALUE_KIND_F64 => number = floats[turn % floats.len()],
                abi::BUSBAR_VALUE_KIND_I64 => integer = whole[turn % whole.len()],
                abi::BUSBAR_VALUE_KIND_BOOL => integer = (turn % 2) as i64,
                abi::BUSBAR_VALUE_KIND_DOUBLE_POINT => integer = (turn % 4) as i64,
                abi::BUSBAR_VALUE_KIND_TEXT => text = ["AUTO", "gestört: Öl", ""][turn % 3],
                _ => {}
            }
            let quality = ((index + round) % 3) as u8;
            self.values.push(abi::BusbarTagValue {
                kind,
                quality,
                reason: if quality == 0 { 0 } else { ((index + round) % 8) as u8 },
                origin: ORIGINS[(index + round) % ORIGINS.len()],
                reserved: [0; 4],
                number,
                integer,
                age_millis: [0, 1500, u64::MAX][(index + round) % 3],
                text: abi::BusbarStr::from_static(text),
            });
        }
    }

    pub(crate) fn frame(&self) -> abi::BusbarOverlayFrame {
        abi::BusbarOverlayFrame {
            struct_size: size_of::<abi::BusbarOverlayFrame>() as u32,
            value_count: self.values.len() as u32,
            time_unix_nanos: 1_700_000_000_000_000_000,
            values: self.values.as_ptr(),
        }
    }
}

/// Buffers for a result, with canaries behind their ends.
pub(crate) struct Buffers {
    pub(crate) raw: abi::BusbarOverlayOutput,
    primitives: Vec<abi::BusbarOverlayPrimitive>,
    text: Vec<u8>,
    quantities: Vec<abi::BusbarOverlayQuantity>,
    verdicts: Vec<abi::BusbarOverlayVerdict>,
    basis: Vec<u32>,
}

impl Buffers {
    pub(crate) fn new(primitives: usize, bytes: usize) -> Self {
        let mut list = vec![NO_PRIMITIVE; primitives + CANARIES];
        let mut text = vec![CANARY; bytes + CANARIES];
        let mut quantities = vec![NO_QUANTITY; primitives + CANARIES];
        let mut verdicts = vec![NO_VERDICT; primitives + CANARIES];
        let mut basis = vec![NO_BASIS; primitives * BASIS_A_PRIMITIVE + CANARIES];
        let raw = abi::BusbarOverlayOutput {
            struct_size: size_of::<abi::BusbarOverlayOutput>() as u32,
            primitive_capacity: primitives as u32,
            primitive_count: 0,
            text_capacity: bytes as u32,
            text_len: 0,
            reserved: 0,
            primitives: list.as_mut_ptr(),
            text: text.as_mut_ptr(),
            quantity_capacity: primitives as u32,
            quantity_count: 0,
            quantities: quantities.as_mut_ptr(),
            verdict_capacity: primitives as u32,
            verdict_count: 0,
            verdicts: verdicts.as_mut_ptr(),
            basis_capacity: (primitives * BASIS_A_PRIMITIVE) as u32,
            basis_count: 0,
            basis: basis.as_mut_ptr(),
        };
        Self { raw, primitives: list, text, quantities, verdicts, basis }
    }

    /// The largest buffers that the host would offer for so many bindings and pieces of
    /// equipment.
    fn for_bindings(count: usize, equipment: usize) -> Self {
        let primitives = (count + 1) * MAX_PRIMITIVES_A_BINDING + equipment;
        Self::new(primitives, primitives * MAX_TEXT_A_PRIMITIVE)
    }

    pub(crate) fn expect_canaries(&self, probe: &Probe, what: &str) {
        let room = self.primitives.len() - CANARIES;
        let bytes = self.text.len() - CANARIES;
        let whole = self.primitives[room..].iter().all(|p| p.kind == NO_PRIMITIVE.kind)
            && self.text[bytes..].iter().all(|&byte| byte == CANARY)
            && self.quantities[room..].iter().all(|q| q.kind == NO_QUANTITY.kind)
            && self.verdicts[room..].iter().all(|v| v.verdict == NO_VERDICT.verdict)
            && self.basis[room * BASIS_A_PRIMITIVE..].iter().all(|&index| index == NO_BASIS);
        let fault = format!("`draw` writes beyond the end of its buffers, given {what}");
        probe.expect(whole, fault, "write at most `primitive_capacity` and `text_capacity`");
    }

    /// Validates a picture as the host does.
    fn validate(&self, probe: &Probe, scene: &Scene, what: &str) {
        self.expect_canaries(probe, what);
        if let Err(fault) = self.fault(scene) {
            let remedy = "see BusbarOverlayPrimitive and BusbarOverlayOutput in the header";
            probe.find(Finding::new(format!("{fault}, given {what}"), remedy));
        }
    }

    fn fault(&self, scene: &Scene) -> Result<(), String> {
        let (count, len) = (self.raw.primitive_count, self.raw.text_len);
        let quantities = self.raw.quantity_count;
        if quantities > self.raw.quantity_capacity {
            return Err(format!("it claims {quantities} quantities, more than fit"));
        }
        for (index, quantity) in self.quantities[..quantities as usize].iter().enumerate() {
            if quantity.binding as usize >= scene.bindings.len() {
                let binding = quantity.binding;
                return Err(format!(
                    "quantity {index} names binding {binding}, which is not there"
                ));
            }
            if !QUANTITIES.contains(&quantity.kind) {
                return Err(format!("quantity {index} has the unknown kind {}", quantity.kind));
            }
        }
        if count > self.raw.primitive_capacity || len > self.raw.text_capacity {
            return Err(format!("it claims {count} primitives and {len} bytes, more than fit"));
        }
        let text = std::str::from_utf8(&self.text[..len as usize])
            .map_err(|_| "the text it drew is not UTF-8".to_owned())?;
        self.verdict_fault(scene, text)?;
        for (index, primitive) in self.primitives[..count as usize].iter().enumerate() {
            let at = |what: &str| Err(format!("primitive {index} {what}"));
            if primitive.binding as usize >= scene.bindings.len() {
                return at(&format!("names binding {}, which is not there", primitive.binding));
            }
            if primitive.kind == abi::BUSBAR_PRIMITIVE_KIND_STATE {
                continue;
            }
            if !scene.bindings.iter().any(|b| b.node == primitive.node) {
                return at(&format!("names node {}, to which nothing is bound", primitive.node));
            }
            if primitive.severity > abi::BUSBAR_SEVERITY_ALARM {
                return at(&format!("has the unknown severity {}", primitive.severity));
            }
            match primitive.kind {
                abi::BUSBAR_PRIMITIVE_KIND_TINT => continue,
                abi::BUSBAR_PRIMITIVE_KIND_LINE => {}
                other => return at(&format!("has the unknown kind {other}")),
            }
            for (offset, len) in [
                (primitive.caption_offset, primitive.caption_len),
                (primitive.text_offset, primitive.text_len),
            ] {
                let range: Range<usize> = offset as usize..offset as usize + len as usize;
                if len > MAX_PART_BYTES {
                    return at(&format!("has a text of {len} bytes; at most {MAX_PART_BYTES}"));
                }
                if text.get(range).is_none() {
                    return at("names text that is not there, or a part of a character");
                }
            }
        }
        Ok(())
    }
}

impl Buffers {
    /// Validates the verdicts by the host's rules.
    fn verdict_fault(&self, scene: &Scene, text: &str) -> Result<(), String> {
        let (count, basis_count) = (self.raw.verdict_count, self.raw.basis_count);
        if count > self.raw.verdict_capacity || basis_count > self.raw.basis_capacity {
            return Err(format!(
                "it claims {count} verdicts on {basis_count} bindings, more than fit"
            ));
        }
        let basis = &self.basis[..basis_count as usize];
        if let Some(binding) = basis.iter().find(|&&index| index as usize >= scene.bindings.len()) {
            return Err(format!("a verdict rests on binding {binding}, which is not there"));
        }
        for (index, verdict) in self.verdicts[..count as usize].iter().enumerate() {
            let at = |what: &str| Err(format!("verdict {index} {what}"));
            if !VERDICTS.contains(&verdict.verdict) {
                return at(&format!("is the unknown one {}", verdict.verdict));
            }
            let from = verdict.reason_offset as usize;
            if verdict.reason_len > MAX_PART_BYTES {
                return at("has a reason that is too long");
            }
            let Some(reason) = text.get(from..from + verdict.reason_len as usize) else {
                return at("names text that is not there");
            };
            if verdict.flags & !VERDICT_FLAGS != 0 {
                return at(&format!("has the unknown flags {:#x}", verdict.flags & !VERDICT_FLAGS));
            }
            match verdict.flags & SEVERITY_FLAGS {
                0 => {}
                SEVERITY_FLAGS => {
                    return at("is a warning, and perhaps an alarm: set one of these flags");
                }
                _ if verdict.verdict != abi::BUSBAR_VERDICT_ABNORMAL => {
                    return at("has the severity of an abnormal verdict, and is none");
                }
                _ => {}
            }
            let is_assumed = verdict.flags & abi::BUSBAR_VERDICT_FLAG_ASSUMED != 0;
            let needs_reason = is_assumed || verdict.verdict == abi::BUSBAR_VERDICT_UNKNOWN;
            if needs_reason && reason.trim().is_empty() {
                return at("is unknown or assumed and has no reason");
            }
            let end = u64::from(verdict.basis_offset) + u64::from(verdict.basis_count);
            if end > u64::from(basis_count) {
                return at("names a basis that is not there");
            }
        }
        Ok(())
    }
}

/// Expects a verdict on every piece of equipment described, and none on others.
fn expect_verdicts(
    probe: &Probe,
    instance: &Instance<'_>,
    buffers: &Buffers,
    what: &str,
) -> Outcome {
    let count = described_equipment(probe, instance)?;
    let mut is_judged = vec![false; count];
    for verdict in &buffers.verdicts[..buffers.raw.verdict_count as usize] {
        match is_judged.get_mut(verdict.equipment as usize) {
            Some(judged) => *judged = true,
            None => probe.find(Finding::new(
                format!("a verdict is on equipment {}, which was not described", verdict.equipment),
                "see BusbarOverlayVerdict in the header",
            )),
        }
    }
    let silent = is_judged.iter().filter(|judged| !**judged).count();
    let fault = format!("{silent} of {count} pieces of equipment have no verdict, given {what}");
    let remedy = "give every piece that is described a verdict in every frame; silence would \
                  mean \"judged healthy\"";
    probe.expect(silent == 0, fault, remedy);
    Ok(())
}

/// Number of pieces of equipment that an overlay describes by now.
fn described_equipment(probe: &Probe, instance: &Instance<'_>) -> Result<usize, Stop> {
    let table: &abi::BusbarOverlay = instance.capability(abi::OVERLAY_ID)?;
    let Some(describe) = table.describe else { return Ok(0) };
    let mut description = empty_description();
    let mut error = abi::BusbarError::empty();
    // SAFETY: description and error live for the call.
    let status = unsafe { describe(instance.as_ptr(), &raw mut description, &raw mut error) };
    probe.expect_ok("describe", status, &error)?;
    Ok(description.equipment_count as usize)
}

fn empty_description() -> abi::BusbarOverlayDescription {
    abi::BusbarOverlayDescription {
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
    }
}

/// Configures with the scene's bindings.
fn configured(probe: &Probe, instance: &Instance<'_>, scene: &Scene) -> Result<Draw, Stop> {
    let (configure, draw) = functions(instance)?;
    let mut error = abi::BusbarError::empty();
    let (bindings, count) = (scene.bindings.as_ptr(), scene.bindings.len());
    let status = probe.configure(configure, instance.as_ptr(), bindings, count, &mut error);
    probe.expect_ok("configure", status, &error)?;
    Ok(draw)
}

/// Draws into large buffers, which must succeed, and validates the picture.
fn drawn(
    probe: &Probe,
    instance: &Instance<'_>,
    draw: Draw,
    scene: &Scene,
    what: &str,
) -> Result<Buffers, Stop> {
    let equipment = described_equipment(probe, instance)?;
    let mut buffers = Buffers::for_bindings(scene.bindings.len(), equipment);
    let (mut error, frame) = (abi::BusbarError::empty(), scene.frame());
    let status = probe.draw(draw, instance.as_ptr(), &frame, &mut buffers.raw, &mut error);
    probe.expect_ok(&format!("draw, given {what}"), status, &error)?;
    buffers.validate(probe, scene, what);
    expect_verdicts(probe, instance, &buffers, what)?;
    Ok(buffers)
}

pub(crate) fn use_briefly(probe: &Probe, instance: &Instance<'_>) -> Outcome {
    let scene = Scene::new(4);
    let draw = configured(probe, instance, &scene)?;
    drawn(probe, instance, draw, &scene, "four bindings").map(drop)
}

pub(crate) fn draw(probe: &Probe) -> Outcome {
    let subject = probe.subject_with(abi::OVERLAY_ID)?;
    let instance = subject.make(probe)?;
    let mut scene = Scene::new(40);
    let draw = configured(probe, &instance, &scene)?;
    for round in 0..24 {
        scene.set_values(round);
        drawn(probe, &instance, draw, &scene, "values of every kind and quality")?;
    }
    instance.destroy()
}

pub(crate) fn limits(probe: &Probe) -> Outcome {
    let subject = probe.subject_with(abi::OVERLAY_ID)?;
    let instance = subject.make(probe)?;
    let none = Scene::new(0);
    let draw = configured(probe, &instance, &none)?;
    drawn(probe, &instance, draw, &none, "no bindings")?;

    let scene = Scene::new(12);
    let draw = configured(probe, &instance, &scene)?;
    for (primitives, bytes) in [(0, 0), (1, 0), (0, 4096), (3, 7), (100, 1), (1, 4096)] {
        let mut buffers = Buffers::new(primitives, bytes);
        let (mut error, frame) = (abi::BusbarError::empty(), scene.frame());
        let status = probe.draw(draw, instance.as_ptr(), &frame, &mut buffers.raw, &mut error);
        let what = format!("room for {primitives} primitives and {bytes} bytes");
        let allowed = [abi::BUSBAR_OK, abi::BUSBAR_BUFFER_TOO_SMALL];
        probe.expect_refused(&format!("draw with {what}"), status, &error, &allowed);
        if status == abi::BUSBAR_OK {
            buffers.validate(probe, &scene, &what);
        } else {
            buffers.expect_canaries(probe, &what);
        }
    }

    let many = Scene::new(MANY);
    let draw = configured(probe, &instance, &many)?;
    drawn(probe, &instance, draw, &many, "many bindings")?;
    let mut buffers = Buffers::for_bindings(MANY, described_equipment(probe, &instance)?);
    let (mut error, frame) = (abi::BusbarError::empty(), many.frame());
    let begun = Instant::now();
    let status = probe.draw(draw, instance.as_ptr(), &frame, &mut buffers.raw, &mut error);
    let took = begun.elapsed();
    probe.expect_ok("draw", status, &error)?;
    let fault = format!("a frame of {MANY} bindings took {} ms", took.as_millis());
    probe.expect(took <= MAX_DRAW, fault, "prepare in `configure` what does not change");
    instance.destroy()
}

pub(crate) fn order(probe: &Probe) -> Outcome {
    let subject = probe.subject_with(abi::OVERLAY_ID)?;
    let instance = subject.make(probe)?;
    let (_, draw) = functions(&instance)?;
    let (mut scene, mut buffers) = (Scene::new(8), Buffers::for_bindings(8, 0));
    let (mut error, frame) = (abi::BusbarError::empty(), scene.frame());
    let status = probe.draw(draw, instance.as_ptr(), &frame, &mut buffers.raw, &mut error);
    let allowed = [abi::BUSBAR_OK, abi::BUSBAR_INVALID_ARGUMENT];
    probe.expect_refused("draw before configure", status, &error, &allowed);
    if status == abi::BUSBAR_OK {
        buffers.validate(probe, &scene, "a draw before configure");
    } else if text::message_of(&error).is_err() {
        probe.expect_message("draw before configure", &error);
    }
    configured(probe, &instance, &scene)?;
    // Fewer bindings than before: what was kept of the others must not be drawn.
    scene = Scene::new(2);
    let draw = configured(probe, &instance, &scene)?;
    drawn(probe, &instance, draw, &scene, "other bindings than before")?;
    instance.destroy()
}
