//! Export of plugin types through the C ABI: function tables, entry point, panics caught at the
//! boundary.
//!
//! Authors use [`crate::export_plugin!`]; the rest is for that macro.

use std::ffi::c_void;
use std::marker::PhantomData;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::AtomicUsize;
use std::sync::{Mutex, OnceLock, PoisonError, RwLock};

use busbar_plugin_abi as abi;

use crate::boundary::{checked_ref, guard, text};
use crate::overlay_description::RawDescription;
use crate::{Error, Host, Plugin, SampleSink};

mod tables;

pub use tables::{
    alarms, chart, command, mesh_optimizer, notify, overlay, records, simulator, telemetry,
};

/// Exports one plugin type with its capabilities:
/// `export_plugin!(Type: telemetry, command);`, with the names of modules and traits of the SDK.
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

        /// Entry point of this plugin library.
        #[allow(unsafe_code)]
        // SAFETY: no other symbol of this name is in a plugin library.
        #[unsafe(no_mangle)]
        pub static busbar_plugin_entry: $crate::abi::BusbarPluginEntry =
            $crate::export::entry::<$plugin>();
    };
}

/// Plugin type that [`crate::export_plugin!`] has completed.
pub trait Exported: Plugin {
    /// Capabilities with their function tables.
    const CAPABILITIES: &'static [Capability];
    /// Returns the one descriptor of this type.
    fn descriptor() -> &'static Descriptor;
}

/// Capability id with its function table.
pub struct Capability {
    id: &'static str,
    /// Table of functions, static and of the type that the ABI has for the id.
    table: *const c_void,
}

impl Capability {
    const fn new<T>(id: &'static str, table: &'static T) -> Self {
        Self { id, table: std::ptr::from_ref(table).cast() }
    }
}

/// C descriptor and the memory behind its pointers.
pub struct Descriptor {
    raw: abi::BusbarPluginDescriptor,
}

// SAFETY: all pointers lead to leaked or static memory that never changes.
unsafe impl Send for Descriptor {}
// SAFETY: as above.
unsafe impl Sync for Descriptor {}

/// Builds the descriptor of a plugin type; called once for each type.
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

/// Creates the entry point of a library with one plugin type.
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

/// Instance of a plugin, which `BusbarPlugin::data` points to.
struct Instance<P> {
    plugin: RwLock<P>,
    host: Host,
    /// Sample sink, open while telemetry runs.
    sink: Mutex<Option<SampleSink>>,
    /// Reports whether a simulation runs.
    is_simulating: Mutex<bool>,
    /// Bindings that an overlay was configured with last.
    binding_count: AtomicUsize,
    /// Description of an overlay, as it gave it last.
    description: Mutex<Option<RawDescription>>,
    /// Commands for `describe`, made at its first call.
    commands: OnceLock<Vec<crate::command::Info>>,
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
    let table = host;
    let host = Host::closed();
    let work = || {
        // SAFETY: the host keeps its table until `destroy` returned, which closes
        // this; after a failure it is closed below.
        unsafe { host.open(checked_ref(table, "create: the host's table")?) };
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
            is_simulating: Mutex::new(false),
            binding_count: AtomicUsize::new(0),
            description: Mutex::new(None),
            commands: OnceLock::new(),
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
        // SAFETY: the host's pointer is null or what `create` made.
        if unsafe { checked_ref(plugin.cast_const(), "the plugin") }.is_err() {
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
    found.map_or(std::ptr::null(), |capability| capability.table)
}

/// # Safety
/// `plugin` is null or was made by `create` of the same type and not destroyed.
unsafe fn instance<'a, P>(plugin: *const abi::BusbarPlugin) -> Result<&'a Instance<P>, Error> {
    // SAFETY: the caller vouches for the pointer.
    let plugin = unsafe { checked_ref(plugin, "the plugin")? };
    // SAFETY: `create` put an `Instance<P>` there.
    unsafe { plugin.data.cast::<Instance<P>>().as_ref() }
        .ok_or_else(|| Error::argument("plugin has no data"))
}
