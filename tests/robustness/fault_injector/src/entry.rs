//! Entry point, factory and function tables of the SDK, with injected faults.

use std::ffi::c_void;
use std::sync::OnceLock;

use busbar_plugin_sdk::abi;

use crate::armed_fault::{self, PLUGIN_ID};
use crate::fault::{CallSite, Misbehavior};
use crate::injection::inject;
use crate::plugin::FaultInjector;
use crate::sdk_tables::{SDK_GET_CAPABILITY, SHORT};
use crate::{corrupted_tables, corruption};

const SDK_ENTRY: abi::BusbarPluginEntry = busbar_plugin_sdk::export::entry::<FaultInjector>();
/// Number of plugins, and of capabilities, above the limit of a library.
const TOO_MANY: u32 = 1000;

/// Entry point of this plugin library.
// SAFETY: no other symbol of this name is in a plugin library.
#[unsafe(no_mangle)]
pub static busbar_plugin_entry: abi::BusbarPluginEntry = abi::BusbarPluginEntry {
    init: Some(init),
    deinit: Some(deinit),
    get_factory: Some(get_factory),
    ..SDK_ENTRY
};

const fn factory(struct_size: u32) -> abi::BusbarPluginFactory {
    abi::BusbarPluginFactory {
        struct_size,
        reserved: 0,
        count: Some(count),
        descriptor: Some(descriptor),
        create: Some(create),
    }
}

static FACTORY: abi::BusbarPluginFactory = factory(size_of::<abi::BusbarPluginFactory>() as u32);
static SHORT_FACTORY: abi::BusbarPluginFactory = factory(SHORT);

unsafe extern "C" fn init(_error: *mut abi::BusbarError) -> abi::BusbarStatusNumber {
    inject(CallSite::Init);
    abi::BUSBAR_OK
}

unsafe extern "C" fn deinit() {
    inject(CallSite::Deinit);
}

unsafe extern "C" fn get_factory(id: abi::BusbarStr) -> *const c_void {
    let kind = inject(CallSite::GetFactory);
    // SAFETY: handed on as it came.
    let original = SDK_ENTRY.get_factory.map_or(std::ptr::null(), |get| unsafe { get(id) });
    match kind {
        _ if original.is_null() => original,
        Some(Misbehavior::NullResult) => std::ptr::null(),
        Some(Misbehavior::WrongStructSize) => std::ptr::from_ref(&SHORT_FACTORY).cast(),
        _ => std::ptr::from_ref(&FACTORY).cast(),
    }
}

fn sdk_factory() -> Option<&'static abi::BusbarPluginFactory> {
    let id = abi::BusbarStr::from_static(abi::PLUGIN_FACTORY_ID);
    // SAFETY: the SDK gives its static factory for this id.
    unsafe { SDK_ENTRY.get_factory?(id).cast::<abi::BusbarPluginFactory>().as_ref() }
}

/// Descriptor of the SDK with the id of this copy of the library.
struct Own(abi::BusbarPluginDescriptor);
static OWN: OnceLock<Own> = OnceLock::new();
// SAFETY: all its pointers lead to static or leaked memory that never changes.
unsafe impl Send for Own {}
// SAFETY: as above.
unsafe impl Sync for Own {}

unsafe extern "C" fn count() -> u32 {
    if inject(CallSite::Count) == Some(Misbehavior::OutOfRange) { TOO_MANY } else { 1 }
}

unsafe extern "C" fn descriptor(index: u32) -> *const abi::BusbarPluginDescriptor {
    let kind = inject(CallSite::Descriptor);
    let original = sdk_factory().and_then(|factory| factory.descriptor);
    // SAFETY: handed on as it came.
    let original = original.map_or(std::ptr::null(), |descriptor| unsafe { descriptor(index) });
    // SAFETY: the SDK's descriptor is static.
    let Some(mut copy) = (unsafe { original.as_ref() }).copied() else { return original };
    copy.id = abi::BusbarStr::from_static(armed_fault::plugin_id());
    let corrupted = match kind {
        Some(Misbehavior::NullResult) => return std::ptr::null(),
        Some(Misbehavior::WrongStructSize) => {
            abi::BusbarPluginDescriptor { struct_size: SHORT, ..copy }
        }
        Some(Misbehavior::NotUtf8) => {
            abi::BusbarPluginDescriptor { name: corruption::NOT_UTF8, ..copy }
        }
        Some(Misbehavior::OutOfRange) => {
            abi::BusbarPluginDescriptor { capability_count: TOO_MANY, ..copy }
        }
        _ => return std::ptr::from_ref(&OWN.get_or_init(|| Own(copy)).0),
    };
    Box::leak(Box::new(corrupted))
}

unsafe extern "C" fn create(
    id: abi::BusbarStr,
    settings: abi::BusbarStr,
    host: *const abi::BusbarHost,
    error: *mut abi::BusbarError,
) -> *mut abi::BusbarPlugin {
    let Some(create) = sdk_factory().and_then(|factory| factory.create) else {
        return std::ptr::null_mut();
    };
    let id = if is_own(id) { abi::BusbarStr::from_static(PLUGIN_ID) } else { id };
    // SAFETY: handed on as it came, but for the id, which the SDK knows by another name.
    let made = unsafe { create(id, settings, host, error) };
    // SAFETY: null, or what the SDK just made and nobody else knows.
    let Some(plugin) = (unsafe { made.as_mut() }) else { return made };
    if let Some(get) = plugin.get_capability {
        SDK_GET_CAPABILITY.get_or_init(|| get);
    }
    plugin.get_capability = Some(get_capability);
    // The call was counted within the SDK's `create`.
    match corruption::active_corruption(CallSite::Create) {
        Some(Misbehavior::WrongStructSize) => plugin.struct_size = SHORT,
        Some(kind @ (Misbehavior::NullResult | Misbehavior::NotUtf8)) => {
            if let Some(destroy) = plugin.destroy {
                // SAFETY: made above and given to nobody.
                unsafe { destroy(made) };
            }
            if kind == Misbehavior::NotUtf8 {
                // SAFETY: the host's error is null or valid.
                unsafe { corruption::error(error) };
            }
            return std::ptr::null_mut();
        }
        _ => {}
    }
    made
}

/// Reports whether an id is that of this library's plugin.
fn is_own(id: abi::BusbarStr) -> bool {
    let own = armed_fault::plugin_id();
    if id.len != own.len() || id.ptr.is_null() {
        return false;
    }
    // SAFETY: the host's text is as long as it says.
    unsafe { std::slice::from_raw_parts(id.ptr, id.len) == own.as_bytes() }
}

unsafe extern "C" fn get_capability(
    plugin: *const abi::BusbarPlugin,
    id: abi::BusbarStr,
) -> *const c_void {
    let kind = inject(CallSite::GetCapability);
    let Some(get) = SDK_GET_CAPABILITY.get() else { return std::ptr::null() };
    // SAFETY: handed on as it came.
    let original = unsafe { get(plugin, id) };
    if original.is_null() || kind == Some(Misbehavior::NullResult) {
        return std::ptr::null();
    }
    corrupted_tables::table(id, kind == Some(Misbehavior::WrongStructSize))
}
