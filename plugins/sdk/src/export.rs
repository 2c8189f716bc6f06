//! From traits to the C ABI: tables, entry, and panics caught at the border.
//!
//! Authors use [`crate::export_plugin!`]; the rest is for that macro.

use std::ffi::c_void;
use std::marker::PhantomData;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Mutex, PoisonError, RwLock};

use busbar_plugin_abi as abi;

use crate::{Error, Host, MeshOptimizer, Overlay, Plugin, SampleSink, Telemetry};

/// Exports one plugin type with its capabilities:
/// `export_plugin!(Type: mesh_optimizer, telemetry, overlay);`
#[macro_export]
macro_rules! export_plugin {
    ($plugin:ty: $($capability:ident),+ $(,)?) => {
        impl $crate::export::Exported for $plugin {
            const CAPABILITIES: &'static [$crate::export::Capability] =
                &[$($crate::export::$capability::<$plugin>()),+];

            fn descriptor() -> &'static $crate::export::Descriptor {
                static DESCRIPTOR: ::std::sync::OnceLock<$crate::export::Descriptor> =
                    ::std::sync::OnceLock::new();
                DESCRIPTOR.get_or_init($crate::export::describe::<$plugin>)
            }
        }

        /// The entry of this plugin library.
        #[allow(unsafe_code)]
        // SAFETY: no other symbol of this name is in a plugin library.
        #[unsafe(no_mangle)]
        pub static busbar_plugin_entry: $crate::abi::BusbarPluginEntry =
            $crate::export::entry::<$plugin>();
    };
}

/// A plugin type as [`crate::export_plugin!`] completes it.
pub trait Exported: Plugin {
    /// Capabilities and their tables.
    const CAPABILITIES: &'static [Capability];
    /// The one descriptor of this type.
    fn descriptor() -> &'static Descriptor;
}

/// A capability id with its table of functions.
pub struct Capability {
    id: &'static str,
    table: Table,
}

enum Table {
    MeshOptimizer(abi::BusbarMeshOptimizer),
    Telemetry(abi::BusbarTelemetry),
    Overlay(abi::BusbarOverlay),
}

impl Table {
    fn as_ptr(&'static self) -> *const c_void {
        match self {
            Self::MeshOptimizer(table) => std::ptr::from_ref(table).cast(),
            Self::Telemetry(table) => std::ptr::from_ref(table).cast(),
            Self::Overlay(table) => std::ptr::from_ref(table).cast(),
        }
    }
}

/// The C descriptor and the memory behind its pointers.
pub struct Descriptor {
    raw: abi::BusbarPluginDescriptor,
}

// SAFETY: all pointers lead to leaked or static memory that never changes.
unsafe impl Send for Descriptor {}
// SAFETY: as above.
unsafe impl Sync for Descriptor {}

/// Builds the descriptor of a plugin type; called once a type.
pub fn describe<P: Exported>() -> Descriptor {
    let ids: Vec<_> = P::CAPABILITIES.iter().map(|c| abi::BusbarStr::from_static(c.id)).collect();
    let schema = serde_json::to_string(&schemars::schema_for!(P::Settings)).unwrap_or_default();
    let ids: &'static [abi::BusbarStr] = Box::leak(ids.into_boxed_slice());
    Descriptor {
        raw: abi::BusbarPluginDescriptor {
            struct_size: size_of::<abi::BusbarPluginDescriptor>() as u32,
            capability_count: ids.len() as u32,
            id: abi::BusbarStr::from_static(P::ID),
            name: abi::BusbarStr::from_static(P::NAME),
            version: abi::BusbarStr::from_static(P::VERSION),
            description: abi::BusbarStr::from_static(P::DESCRIPTION),
            settings_schema: abi::BusbarStr::from_static(Box::leak(schema.into_boxed_str())),
            capabilities: ids.as_ptr(),
        },
    }
}

/// The entry of a library with one plugin type.
pub const fn entry<P: Exported>() -> abi::BusbarPluginEntry {
    abi::BusbarPluginEntry {
        struct_size: size_of::<abi::BusbarPluginEntry>() as u32,
        abi_major: abi::BUSBAR_ABI_MAJOR,
        abi_minor: abi::BUSBAR_ABI_MINOR,
        reserved: 0,
        init: None,
        deinit: None,
        get_factory: Some(get_factory::<P>),
    }
}

struct Statics<P>(PhantomData<P>);

impl<P: Exported> Statics<P> {
    const FACTORY: abi::BusbarPluginFactory = abi::BusbarPluginFactory {
        struct_size: size_of::<abi::BusbarPluginFactory>() as u32,
        reserved: 0,
        count: Some(count),
        descriptor: Some(descriptor::<P>),
        create: Some(create::<P>),
    };
}

/// What `BusbarPlugin::data` leads to.
struct Instance<P> {
    plugin: RwLock<P>,
    host: Host,
    /// Open while telemetry runs.
    sink: Mutex<Option<SampleSink>>,
}

impl<P> Instance<P> {
    fn close_sink(&self) {
        if let Some(sink) = self.sink.lock().unwrap_or_else(PoisonError::into_inner).take() {
            sink.close();
        }
    }
}

unsafe extern "C" fn get_factory<P: Exported>(id: abi::BusbarStr) -> *const c_void {
    // SAFETY: the host's text is valid for the call.
    match unsafe { text(id) } {
        Ok(abi::PLUGIN_FACTORY_ID) => std::ptr::from_ref(&Statics::<P>::FACTORY).cast(),
        _ => std::ptr::null(),
    }
}

unsafe extern "C" fn count() -> u32 {
    1
}

unsafe extern "C" fn descriptor<P: Exported>(index: u32) -> *const abi::BusbarPluginDescriptor {
    if index > 0 {
        return std::ptr::null();
    }
    catch_unwind(|| std::ptr::from_ref(&P::descriptor().raw)).unwrap_or(std::ptr::null())
}

unsafe extern "C" fn create<P: Exported>(
    plugin_id: abi::BusbarStr,
    settings_json: abi::BusbarStr,
    host: *const abi::BusbarHost,
    error: *mut abi::BusbarError,
) -> *mut abi::BusbarPlugin {
    let mut made = std::ptr::null_mut();
    // SAFETY: the host keeps its table until `destroy` returned, which closes
    // this; after a failure it is closed below.
    let host = unsafe { Host::from_raw(host) };
    let work = || {
        // SAFETY: the host's texts are valid for the call.
        let (id, settings) = unsafe { (text(plugin_id)?, text(settings_json)?) };
        if id != P::ID {
            return Err(Error::argument(format!("this library has '{}', not '{id}'", P::ID)));
        }
        let mut json = serde_json::Deserializer::from_str(settings);
        let settings = serde_path_to_error::deserialize(&mut json).map_err(|error| {
            Error::settings(format!("settings, {}: {}", error.path(), error.inner()))
        })?;
        let instance = Instance {
            plugin: RwLock::new(P::create(settings, host.clone())?),
            host: host.clone(),
            sink: Mutex::new(None),
        };
        made = Box::into_raw(Box::new(abi::BusbarPlugin {
            struct_size: size_of::<abi::BusbarPlugin>() as u32,
            reserved: 0,
            data: Box::into_raw(Box::new(instance)).cast(),
            destroy: Some(destroy::<P>),
            get_capability: Some(get_capability::<P>),
        }));
        Ok(())
    };
    // SAFETY: the host's `error` is null or valid.
    if unsafe { guard(error, work) } != abi::BUSBAR_OK {
        host.close();
    }
    made
}

unsafe extern "C" fn destroy<P: Exported>(plugin: *mut abi::BusbarPlugin) {
    let _ = catch_unwind(AssertUnwindSafe(|| {
        if plugin.is_null() {
            return;
        }
        // SAFETY: `create` made both boxes, and the host gives them back once.
        let instance = unsafe { Box::from_raw(Box::from_raw(plugin).data.cast::<Instance<P>>()) };
        instance.close_sink();
        let host = instance.host.clone();
        // A panic in the plugin's drop must not leave the log open.
        let _ = catch_unwind(AssertUnwindSafe(|| drop(instance)));
        host.close();
    }));
}

unsafe extern "C" fn get_capability<P: Exported>(
    _plugin: *const abi::BusbarPlugin,
    id: abi::BusbarStr,
) -> *const c_void {
    // SAFETY: the host's text is valid for the call.
    let Ok(id) = (unsafe { text(id) }) else {
        return std::ptr::null();
    };
    let found = P::CAPABILITIES.iter().find(|capability| capability.id == id);
    found.map_or(std::ptr::null(), |capability| capability.table.as_ptr())
}

/// `busbar.mesh-optimizer/1-draft` of a type.
pub const fn mesh_optimizer<P: MeshOptimizer>() -> Capability {
    unsafe extern "C" fn optimize<P: MeshOptimizer>(
        plugin: *const abi::BusbarPlugin,
        mesh: *const abi::BusbarMesh,
        progress: *const abi::BusbarProgress,
        output: *mut abi::BusbarCollapseOutput,
        error: *mut abi::BusbarError,
    ) -> abi::BusbarStatus {
        // SAFETY: the host passes what `create` made, and valid pointers.
        unsafe {
            guard(error, || {
                let plugin = instance::<P>(plugin)?.plugin.read();
                let plugin = plugin.unwrap_or_else(PoisonError::into_inner);
                crate::mesh_optimizer::run(&*plugin, mesh, progress, output)
            })
        }
    }
    Capability {
        id: abi::MESH_OPTIMIZER_ID,
        table: Table::MeshOptimizer(abi::BusbarMeshOptimizer {
            struct_size: size_of::<abi::BusbarMeshOptimizer>() as u32,
            reserved: 0,
            optimize: Some(optimize::<P>),
        }),
    }
}

/// `busbar.telemetry/1-draft` of a type.
pub const fn telemetry<P: Telemetry>() -> Capability {
    unsafe extern "C" fn check<P: Telemetry>(
        plugin: *const abi::BusbarPlugin,
        tags: *const abi::BusbarTagSpec,
        tag_count: usize,
        error: *mut abi::BusbarError,
    ) -> abi::BusbarStatus {
        // SAFETY: the host passes what `create` made, and valid pointers.
        unsafe {
            guard(error, || {
                let tags = crate::telemetry::read_specs(tags, tag_count)?;
                let plugin = instance::<P>(plugin)?.plugin.read();
                plugin.unwrap_or_else(PoisonError::into_inner).check(&tags)
            })
        }
    }
    unsafe extern "C" fn start<P: Telemetry>(
        plugin: *const abi::BusbarPlugin,
        tags: *const abi::BusbarTagSpec,
        tag_count: usize,
        sink: *const abi::BusbarSampleSink,
        error: *mut abi::BusbarError,
    ) -> abi::BusbarStatus {
        let mut opened = None;
        // SAFETY: the host passes what `create` made, and valid pointers; the
        // sink stays valid until `stop` returns, which closes it first.
        let status = unsafe {
            guard(error, || {
                let instance = instance::<P>(plugin)?;
                if sink.is_null() {
                    return Err(Error::argument("start: sink is null"));
                }
                let tags = crate::telemetry::read_specs(tags, tag_count)?;
                let sink = SampleSink::open(sink);
                let mut open = instance.sink.lock().unwrap_or_else(PoisonError::into_inner);
                if open.is_some() {
                    return Err(Error::argument("start: already started"));
                }
                *open = Some(sink.clone());
                opened = Some(instance);
                drop(open);
                let mut plugin = instance.plugin.write().unwrap_or_else(PoisonError::into_inner);
                plugin.start(tags, sink)
            })
        };
        if let (Some(instance), true) = (opened, status != abi::BUSBAR_OK) {
            end(instance);
        }
        status
    }
    unsafe extern "C" fn stop<P: Telemetry>(plugin: *const abi::BusbarPlugin) {
        // SAFETY: the host passes what `create` made.
        unsafe {
            guard(std::ptr::null_mut(), || {
                end(instance::<P>(plugin)?);
                Ok(())
            })
        };
    }
    /// Closes the sink first, so that what a straggling thread sends goes
    /// nowhere: after a failed `start`, a panic too, the host frees it at once.
    fn end<P: Telemetry>(instance: &Instance<P>) {
        instance.close_sink();
        let _ = catch_unwind(AssertUnwindSafe(|| {
            instance.plugin.write().unwrap_or_else(PoisonError::into_inner).stop();
        }));
    }
    Capability {
        id: abi::TELEMETRY_ID,
        table: Table::Telemetry(abi::BusbarTelemetry {
            struct_size: size_of::<abi::BusbarTelemetry>() as u32,
            reserved: 0,
            check: Some(check::<P>),
            start: Some(start::<P>),
            stop: Some(stop::<P>),
        }),
    }
}

/// `busbar.overlay/1-draft` of a type.
pub const fn overlay<P: Overlay>() -> Capability {
    unsafe extern "C" fn configure<P: Overlay>(
        plugin: *const abi::BusbarPlugin,
        bindings: *const abi::BusbarBinding,
        binding_count: usize,
        error: *mut abi::BusbarError,
    ) -> abi::BusbarStatus {
        // SAFETY: the host passes what `create` made, and valid pointers.
        unsafe {
            guard(error, || {
                let bindings = crate::overlay::read_bindings(bindings, binding_count)?;
                let plugin = instance::<P>(plugin)?.plugin.write();
                plugin.unwrap_or_else(PoisonError::into_inner).configure(bindings)
            })
        }
    }
    unsafe extern "C" fn draw<P: Overlay>(
        plugin: *const abi::BusbarPlugin,
        frame: *const abi::BusbarOverlayFrame,
        output: *mut abi::BusbarOverlayOutput,
        error: *mut abi::BusbarError,
    ) -> abi::BusbarStatus {
        // SAFETY: the host passes what `create` made, and valid pointers.
        unsafe {
            guard(error, || {
                let plugin = instance::<P>(plugin)?.plugin.write();
                let mut plugin = plugin.unwrap_or_else(PoisonError::into_inner);
                crate::overlay::run(&mut *plugin, frame, output)
            })
        }
    }
    Capability {
        id: abi::OVERLAY_ID,
        table: Table::Overlay(abi::BusbarOverlay {
            struct_size: size_of::<abi::BusbarOverlay>() as u32,
            reserved: 0,
            configure: Some(configure::<P>),
            draw: Some(draw::<P>),
        }),
    }
}

/// Runs the body of a call: no panic leaves, and errors become a status.
///
/// # Safety
/// `error` is null or may be written.
unsafe fn guard(
    error: *mut abi::BusbarError,
    work: impl FnOnce() -> Result<(), Error>,
) -> abi::BusbarStatus {
    let result = catch_unwind(AssertUnwindSafe(work)).unwrap_or_else(|payload| {
        let what = payload
            .downcast_ref::<&str>()
            .map(|text| (*text).to_owned())
            .or_else(|| payload.downcast_ref::<String>().cloned())
            .unwrap_or_else(|| "no message".into());
        Err(Error::internal(format!("the plugin panicked: {what}")))
    });
    match result {
        Ok(()) => abi::BUSBAR_OK,
        // SAFETY: the caller vouches for `error`.
        Err(reason) => unsafe { reason.write(error) },
    }
}

/// # Safety
/// `plugin` is null or was made by `create` of the same type and not destroyed.
unsafe fn instance<'a, P>(plugin: *const abi::BusbarPlugin) -> Result<&'a Instance<P>, Error> {
    // SAFETY: the caller vouches for the pointer.
    let plugin = unsafe { plugin.as_ref() }.ok_or_else(|| Error::argument("plugin is null"))?;
    // SAFETY: `create` put an `Instance<P>` there.
    unsafe { plugin.data.cast::<Instance<P>>().as_ref() }
        .ok_or_else(|| Error::argument("plugin has no data"))
}

/// # Safety
/// `ptr` leads to `count` elements that live for `'a`, or `count` is 0.
pub(crate) unsafe fn slice<'a, T>(ptr: *const T, count: usize) -> Result<&'a [T], Error> {
    if count == 0 {
        return Ok(&[]);
    }
    if ptr.is_null() || !ptr.is_aligned() {
        return Err(Error::argument("an array is null or misaligned"));
    }
    // SAFETY: checked as far as can be; the caller vouches for the rest.
    Ok(unsafe { std::slice::from_raw_parts(ptr, count) })
}

/// # Safety
/// `text` leads to `len` bytes that live for `'a`.
pub(crate) unsafe fn text<'a>(text: abi::BusbarStr) -> Result<&'a str, Error> {
    // SAFETY: the caller vouches for the bytes.
    let bytes = unsafe { slice(text.ptr, text.len)? };
    std::str::from_utf8(bytes).map_err(|_| Error::argument("a text is not UTF-8"))
}

/// # Safety
/// `into` has room for all of `from`.
pub(crate) unsafe fn copy_out<T: Copy>(from: &[T], into: *mut T) -> Result<(), Error> {
    if from.is_empty() {
        return Ok(());
    }
    if into.is_null() || !into.is_aligned() {
        return Err(Error::argument("an output buffer is null or misaligned"));
    }
    // SAFETY: the caller vouches for the room; the host's buffer is not ours.
    unsafe { std::ptr::copy_nonoverlapping(from.as_ptr(), into, from.len()) };
    Ok(())
}
