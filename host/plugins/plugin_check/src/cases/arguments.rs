//! Arguments that break the header's rules: null, misaligned, short, unknown.

use busbar_plugin_abi as abi;

use super::optimizer::{Output, raw_mesh};
use super::overlay::Buffers;
use super::plugin_instance::required;
use super::telemetry::TagSpecs;
use super::{optimizer, overlay};
use crate::finding::Outcome;
use crate::meshes;
use crate::probe::Probe;
use crate::text;

const OK: abi::BusbarStatusNumber = abi::BUSBAR_OK;
const ARGUMENT: abi::BusbarStatusNumber = abi::BUSBAR_INVALID_ARGUMENT;
const SETTINGS: abi::BusbarStatusNumber = abi::BUSBAR_INVALID_SETTINGS;
/// Bytes that a plugin must leave as they are.
const CANARY: u8 = 0xa5;

/// A copy of a struct at an odd address, with canaries around it.
pub(super) struct MisalignedCopy {
    bytes: Vec<u64>,
    len: usize,
}

impl MisalignedCopy {
    pub(super) fn from_value<T: Copy>(value: &T) -> Self {
        let len = size_of::<T>();
        let mut copy = Self { bytes: vec![u64::from_ne_bytes([CANARY; 8]); len / 8 + 3], len };
        // SAFETY: there is room for the copy and more behind the odd address.
        unsafe {
            let from = std::ptr::from_ref(value).cast::<u8>();
            std::ptr::copy_nonoverlapping(from, copy.as_mut_ptr::<u8>(), len);
        }
        copy
    }

    pub(super) fn as_mut_ptr<T>(&mut self) -> *mut T {
        self.bytes.as_mut_ptr().cast::<u8>().wrapping_add(1).cast()
    }

    pub(super) fn as_ptr<T>(&mut self) -> *const T {
        self.as_mut_ptr()
    }

    fn as_bytes(&mut self) -> &[u8] {
        // SAFETY: within the buffer, whose bytes are all initialised.
        unsafe { std::slice::from_raw_parts(self.as_mut_ptr(), self.len) }
    }
}

/// Returns a copy of a struct whose size field is too small.
pub(super) fn short<T: Copy>(value: &T, bytes: u32) -> T {
    let mut copy = *value;
    // SAFETY: every struct of the ABI that is passed alone starts with its size.
    unsafe { (&raw mut copy).cast::<u32>().write(bytes) };
    copy
}

pub(crate) fn create(probe: &Probe) -> Outcome {
    let subject = probe.subject()?;
    let create = required(subject.factory.create, "create")?;
    let id = abi::BusbarStr::from_borrowed(&subject.id);
    let settings = abi::BusbarStr::from_borrowed(&subject.settings);
    let none = abi::BusbarStr { ptr: std::ptr::null(), len: 0 };
    let host = probe.host.as_ptr();
    // SAFETY: the table lives for ever.
    let table = unsafe { *host };
    let mut odd = MisalignedCopy::from_value(&table);
    let small = short(&table, 8);
    let longer = format!("{}.", subject.id);
    for (what, id, settings, host) in [
        ("an id that is null", none, settings, host),
        ("an unknown id", abi::BusbarStr::from_static("no.such.plugin"), settings, host),
        ("a longer id", abi::BusbarStr::from_borrowed(&longer), settings, host),
        ("an id that is not UTF-8", text::of_bytes(&[0xff; 3]), settings, host),
        ("a host table that is null", id, settings, std::ptr::null()),
        ("a host table that is misaligned", id, settings, odd.as_ptr()),
        ("a host table that is too small", id, settings, &raw const small),
    ] {
        let mut error = abi::BusbarError::empty();
        let made = probe.create(create, id, settings, host, &mut error);
        if made.is_null() {
            let case = format!("create with {what}");
            probe.expect_refused(&case, error.status, &error, &[ARGUMENT]);
        } else {
            let remedy = "refuse it with BUSBAR_INVALID_ARGUMENT";
            probe.expect(false, format!("`create` makes an instance with {what}"), remedy);
        }
    }
    let unknown = abi::BusbarStr::from_static("no.such.plugin");
    probe.create(create, unknown, settings, host, std::ptr::null_mut());
    let untouched = "check the error's address and struct_size before writing into it";
    let mut odd = MisalignedCopy::from_value(&abi::BusbarError::empty());
    let before = odd.as_bytes().to_vec();
    probe.create(create, unknown, settings, host, odd.as_mut_ptr());
    let fault = "`create` writes into an error that is misaligned";
    probe.expect(odd.as_bytes() == before, fault, untouched);
    let mut small = short(&abi::BusbarError::empty(), 12);
    small.message = [CANARY; 1024];
    probe.create(create, unknown, settings, host, &mut small);
    let fault = "`create` writes beyond the end of an error that is too small";
    probe.expect(small.message == [CANARY; 1024], fault, untouched);
    // Success needs no place for a reason.
    let mut error = abi::BusbarError::empty();
    probe.host.open();
    let made = probe.create(create, id, settings, host, std::ptr::null_mut());
    probe.expect(!made.is_null(), "`create` fails without an error struct", untouched);
    if let Some(plugin) = std::ptr::NonNull::new(made) {
        // SAFETY: `create` just made it.
        if let Some(destroy) = unsafe { plugin.as_ref() }.destroy {
            probe.destroy(destroy, std::ptr::null_mut());
            probe.destroy(destroy, made);
        }
    }
    probe.host.close();
    probe.create(create, unknown, none, host, &mut error);
    Ok(())
}

pub(crate) fn telemetry(probe: &Probe) -> Outcome {
    let subject = probe.subject_with(abi::TELEMETRY_ID)?;
    let instance = subject.make(probe)?;
    let table: &abi::BusbarTelemetry = instance.capability(abi::TELEMETRY_ID)?;
    let (start, stop) = (required(table.start, "start")?, required(table.stop, "stop")?);
    let plugin = instance.as_ptr();
    // SAFETY: the instance lives.
    let mut odd_plugin = MisalignedCopy::from_value(unsafe { &*plugin });
    let odd_plugin = odd_plugin.as_mut_ptr::<abi::BusbarPlugin>().cast_const();
    let good = TagSpecs::from_samples(&probe.request.sample.tags);
    let one = TagSpecs::new([(abi::BUSBAR_VALUE_KIND_F64, "{}".to_owned())]);
    let mut odd_tag = MisalignedCopy::from_value(&one.raw[0]);
    let mut kind = TagSpecs::new([(abi::BUSBAR_VALUE_KIND_F64, "{}".to_owned())]);
    kind.raw[0].kind = 99;
    let mut id = TagSpecs::new([(abi::BUSBAR_VALUE_KIND_F64, "{}".to_owned())]);
    id.raw[0].id = text::of_bytes(&[0xff; 4]);
    let no_json = TagSpecs::new([(abi::BUSBAR_VALUE_KIND_F64, "{\"a\":".to_owned())]);
    let refused = [ARGUMENT];
    let kinds = [ARGUMENT, SETTINGS];
    // What never looks at these texts need not refuse them.
    let texts = [ARGUMENT, SETTINGS, OK];
    let sink = good.sink();
    sink.set_open(true);
    // SAFETY: the sink lives for ever.
    let raw_sink = unsafe { *sink.as_ptr() };
    let small = short(&raw_sink, 8);
    let mut odd_sink = MisalignedCopy::from_value(&raw_sink);
    let odd_sink = odd_sink.as_mut_ptr::<abi::BusbarSampleSink>().cast_const();
    let (tags, odd_tags) = (good.as_parts(), (odd_tag.as_ptr(), 1));
    let no_tags = (std::ptr::null(), 2);
    let none = std::ptr::null();
    let good_sink = sink.as_ptr();
    for (what, plugin, tags, sink, allowed) in [
        ("a plugin that is null", std::ptr::null(), tags, good_sink, &refused[..]),
        ("a plugin that is misaligned", odd_plugin, tags, good_sink, &refused),
        ("tags that are null", plugin, no_tags, good_sink, &refused),
        ("tags that are misaligned", plugin, odd_tags, good_sink, &refused),
        ("a sink that is null", plugin, tags, none, &refused),
        ("a sink that is misaligned", plugin, tags, odd_sink, &refused),
        ("a sink that is too small", plugin, tags, &raw const small, &refused),
        ("an unknown value kind", plugin, kind.as_parts(), good_sink, &kinds),
        ("a tag id that is not UTF-8", plugin, id.as_parts(), good_sink, &texts),
        ("an address that is no JSON", plugin, no_json.as_parts(), good_sink, &texts),
    ] {
        let mut error = abi::BusbarError::empty();
        let status = probe.start(start, plugin, tags, sink, &mut error);
        // Words that repeat a text that is none are the caller's fault.
        probe.expect_status(&format!("start with {what}"), status, &error, allowed);
        if status == OK {
            probe.stop(stop, plugin);
        }
        if let (Some(check), false) = (table.check, what.contains("sink")) {
            let mut error = abi::BusbarError::empty();
            let status = probe.check(check, plugin, tags.0, tags.1, &mut error);
            probe.expect_status(&format!("check with {what}"), status, &error, allowed);
        }
    }
    probe.stop(stop, std::ptr::null());
    probe.stop(stop, odd_plugin);
    instance.destroy()
}

pub(crate) fn optimizer(probe: &Probe) -> Outcome {
    let subject = probe.subject_with(abi::MESH_OPTIMIZER_ID)?;
    let instance = subject.make(probe)?;
    let optimize = optimizer::function(&instance)?;
    let plugin = instance.as_ptr();
    // SAFETY: the instance lives.
    let mut odd_plugin = MisalignedCopy::from_value(unsafe { &*plugin });
    let odd_plugin = odd_plugin.as_mut_ptr::<abi::BusbarPlugin>().cast_const();
    let grid = meshes::hilly(6, 6);
    let good = raw_mesh(&grid);
    let mut odd = MisalignedCopy::from_value(&good.raw);
    let small = short(&good.raw, 16);
    let mut no_positions = good.raw;
    no_positions.positions = std::ptr::null();
    let mut no_triangles = good.raw;
    no_triangles.triangles = std::ptr::null();
    let outside = [0, 1, good.raw.position_count];
    let mut bad_index = good.raw;
    (bad_index.triangles, bad_index.triangle_count) = (outside.as_ptr(), 1);
    (bad_index.wedge_count, bad_index.corners) = (0, std::ptr::null());
    let twice = [0, 1, 1];
    let mut bad_triangle = bad_index;
    bad_triangle.triangles = twice.as_ptr();
    let mut no_wedges = good.raw;
    no_wedges.wedge_positions = std::ptr::null();
    let refused = [ARGUMENT];
    let ignored = [ARGUMENT, OK];
    for (what, plugin, mesh, allowed) in [
        ("a plugin that is null", std::ptr::null(), &raw const good.raw, &refused[..]),
        ("a plugin that is misaligned", odd_plugin, &good.raw, &refused),
        ("a mesh that is null", plugin, std::ptr::null(), &refused),
        ("a mesh that is misaligned", plugin, odd.as_ptr(), &refused),
        ("a mesh that is too small", plugin, &small, &refused),
        ("positions that are null", plugin, &no_positions, &refused),
        ("triangles that are null", plugin, &no_triangles, &refused),
        ("a triangle of a position that is not there", plugin, &bad_index, &refused),
        ("a triangle that names a position twice", plugin, &bad_triangle, &refused),
        ("attributes of which some are null", plugin, &no_wedges, &ignored),
    ] {
        let (mut error, mut output) = (abi::BusbarError::empty(), Output::for_mesh(&good));
        let status =
            probe.optimize(optimize, plugin, mesh, std::ptr::null(), &mut output.raw, &mut error);
        probe.expect_refused(&format!("optimize with {what}"), status, &error, allowed);
        output.expect_canaries(probe, what);
    }
    let mut usual = Output::for_mesh(&good);
    let mut odd = MisalignedCopy::from_value(&usual.raw);
    let mut small = short(&usual.raw, 8);
    let mut no_room = Output::for_mesh(&good);
    no_room.raw.collapse_capacity = 0;
    let mut no_buffer = Output::for_mesh(&good);
    no_buffer.raw.collapses = std::ptr::null_mut();
    let too_small = [abi::BUSBAR_BUFFER_TOO_SMALL];
    for (what, output, allowed) in [
        ("an output that is null", std::ptr::null_mut(), &refused[..]),
        ("an output that is misaligned", odd.as_mut_ptr(), &refused),
        ("an output that is too small", &raw mut small, &refused),
        ("a buffer that is null", &raw mut no_buffer.raw, &refused),
        ("no room for collapses", &raw mut no_room.raw, &too_small),
    ] {
        let mut error = abi::BusbarError::empty();
        let status =
            probe.optimize(optimize, plugin, &good.raw, std::ptr::null(), output, &mut error);
        probe.expect_refused(&format!("optimize with {what}"), status, &error, allowed);
    }
    no_room.expect_canaries(probe, "no room for collapses");
    usual.expect_canaries(probe, "an output that is too small");
    probe.optimize(
        optimize,
        plugin,
        &good.raw,
        std::ptr::null(),
        &mut usual.raw,
        std::ptr::null_mut(),
    );
    instance.destroy()
}

pub(crate) fn overlay(probe: &Probe) -> Outcome {
    let subject = probe.subject_with(abi::OVERLAY_ID)?;
    let instance = subject.make(probe)?;
    let (configure, draw) = overlay::functions(&instance)?;
    let plugin = instance.as_ptr();
    // SAFETY: the instance lives.
    let mut odd_plugin = MisalignedCopy::from_value(unsafe { &*plugin });
    let odd_plugin = odd_plugin.as_mut_ptr::<abi::BusbarPlugin>().cast_const();
    let scene = overlay::Scene::new(4);
    let good = (scene.bindings.as_ptr(), scene.bindings.len());
    let mut odd = MisalignedCopy::from_value(&scene.bindings[0]);
    let mut unknown = [scene.bindings[0]];
    unknown[0].kind = 77;
    let mut not_utf8 = [scene.bindings[0]];
    not_utf8[0].unit = text::of_bytes(&[0xff; 2]);
    let refused = [ARGUMENT];
    let ignored = [ARGUMENT, OK];
    for (what, plugin, bindings, allowed) in [
        ("a plugin that is null", std::ptr::null(), good, &refused[..]),
        ("a plugin that is misaligned", odd_plugin, good, &refused),
        ("bindings that are null", plugin, (std::ptr::null(), 2), &refused),
        ("bindings that are misaligned", plugin, (odd.as_ptr(), 1), &refused),
        ("an unknown value kind", plugin, (unknown.as_ptr(), 1), &ignored),
        ("a unit that is not UTF-8", plugin, (not_utf8.as_ptr(), 1), &ignored),
    ] {
        let mut error = abi::BusbarError::empty();
        let status = probe.configure(configure, plugin, bindings.0, bindings.1, &mut error);
        probe.expect_refused(&format!("configure with {what}"), status, &error, allowed);
    }
    let mut error = abi::BusbarError::empty();
    let status = probe.configure(configure, plugin, good.0, good.1, &mut error);
    probe.expect_ok("configure", status, &error)?;
    let frame = scene.frame();
    let mut odd_frame = MisalignedCopy::from_value(&frame);
    let odd_frame = odd_frame.as_mut_ptr::<abi::BusbarOverlayFrame>().cast_const();
    let small_frame = short(&frame, 8);
    let mut no_values = frame;
    no_values.values = std::ptr::null();
    let mut few_values = frame;
    few_values.value_count = 1;
    let mut buffers = Buffers::new(64, 4096);
    let mut odd_output = MisalignedCopy::from_value(&buffers.raw);
    let mut small_output = short(&buffers.raw, 8);
    let mut no_buffers = buffers.raw;
    (no_buffers.primitives, no_buffers.text) = (std::ptr::null_mut(), std::ptr::null_mut());
    let output = &raw mut buffers.raw;
    for (what, plugin, frame, output, allowed) in [
        ("a plugin that is null", std::ptr::null(), &raw const frame, output, &refused[..]),
        ("a plugin that is misaligned", odd_plugin, &frame, output, &refused),
        ("a frame that is null", plugin, std::ptr::null(), output, &refused),
        ("a frame that is misaligned", plugin, odd_frame, output, &refused),
        ("a frame that is too small", plugin, &small_frame, output, &refused),
        ("values that are null", plugin, &no_values, output, &refused),
        ("fewer values than bindings", plugin, &few_values, output, &ignored),
        ("an output that is null", plugin, &frame, std::ptr::null_mut(), &refused),
        ("an output that is misaligned", plugin, &frame, odd_output.as_mut_ptr(), &refused),
        ("an output that is too small", plugin, &frame, &raw mut small_output, &refused),
        ("buffers that are null", plugin, &frame, &raw mut no_buffers, &refused),
    ] {
        let mut error = abi::BusbarError::empty();
        let status = probe.draw(draw, plugin, frame, output, &mut error);
        probe.expect_refused(&format!("draw with {what}"), status, &error, allowed);
    }
    buffers.expect_canaries(probe, "refused arguments");
    instance.destroy()
}
