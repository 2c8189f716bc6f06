//! Entry, factory, plugin, and what the host offers.

use core::ffi::{CStr, c_void};

/// Major version: host and plugin must have the same.
pub const BUSBAR_ABI_MAJOR: u32 = 1;
/// Minor version: a host runs plugins of its own minor version and older ones.
pub const BUSBAR_ABI_MINOR: u32 = 0;

/// The symbol a plugin library exports: a [`BusbarPluginEntry`].
pub const ENTRY_SYMBOL: &CStr = c"busbar_plugin_entry";
/// Factory id for [`BusbarPluginEntry::get_factory`].
pub const PLUGIN_FACTORY_ID: &str = "busbar.plugin-factory/1";

/// Result of a call: [`BUSBAR_OK`] or one of the codes below it.
pub type BusbarStatus = i32;
/// Done.
pub const BUSBAR_OK: BusbarStatus = 0;
/// The arguments break a rule of this header: the caller is at fault.
pub const BUSBAR_INVALID_ARGUMENT: BusbarStatus = 1;
/// The settings or an address are at fault: the user must change them.
pub const BUSBAR_INVALID_SETTINGS: BusbarStatus = 2;
/// A buffer of the caller is too small for the result.
pub const BUSBAR_BUFFER_TOO_SMALL: BusbarStatus = 3;
/// The caller asked to stop, and the call stopped.
pub const BUSBAR_CANCELLED: BusbarStatus = 4;
/// Something outside failed: a file, a device, memory.
pub const BUSBAR_FAILED: BusbarStatus = 5;
/// The plugin has a fault of its own; a caught panic is one.
pub const BUSBAR_INTERNAL: BusbarStatus = 6;

/// Bytes of text that a [`BusbarError`] holds.
pub const BUSBAR_ERROR_CAPACITY: u32 = 1024;

/// UTF-8 text with a length in bytes, not terminated. `ptr` may be null only
/// if `len` is 0.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct BusbarStr {
    /// First byte.
    pub ptr: *const u8,
    /// Length in bytes.
    pub len: usize,
}

/// Why a call failed. The caller owns it and fills in `struct_size`.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct BusbarError {
    /// Size of this struct as the caller knows it, bytes.
    pub struct_size: u32,
    /// Bytes used of `message`, at most its size.
    pub message_len: u32,
    /// The code that goes with it, for calls that return no status.
    pub status: BusbarStatus,
    /// UTF-8: fault, place and remedy in one or two sentences.
    pub message: [u8; 1024],
}

/// Log level: what a user must act on.
pub const BUSBAR_LOG_ERROR: u32 = 1;
/// Log level: what may become a fault.
pub const BUSBAR_LOG_WARNING: u32 = 2;
/// Log level: what happened.
pub const BUSBAR_LOG_INFO: u32 = 3;
/// Log level: for the plugin's author.
pub const BUSBAR_LOG_DEBUG: u32 = 4;

/// What the host offers to one plugin instance. Valid from `create` until
/// `destroy` returns.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct BusbarHost {
    /// Size of this struct, bytes.
    pub struct_size: u32,
    /// The host's ABI major version.
    pub abi_major: u32,
    /// The host's ABI minor version.
    pub abi_minor: u32,
    /// Zero.
    pub reserved: u32,
    /// Passed back in every call to the host.
    pub context: *mut c_void,
    /// `[any-thread]` Writes one line to the host's log. Messages beyond the
    /// host's rate limit are dropped and counted. Cannot fail.
    pub log: Option<unsafe extern "C" fn(context: *mut c_void, level: u32, message: BusbarStr)>,
}

/// The one exported entry. Static in the library, for its whole life.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct BusbarPluginEntry {
    /// Size of this struct, bytes.
    pub struct_size: u32,
    /// [`BUSBAR_ABI_MAJOR`] that the plugin was built with.
    pub abi_major: u32,
    /// [`BUSBAR_ABI_MINOR`] that the plugin was built with.
    pub abi_minor: u32,
    /// Zero.
    pub reserved: u32,
    /// `[main-thread]` Called before anything else. May be null.
    pub init: Option<unsafe extern "C" fn(error: *mut BusbarError) -> BusbarStatus>,
    /// `[main-thread]` Called once for every `init`, after every plugin is
    /// destroyed. The library stays mapped, and `init` may follow again. May be
    /// null.
    pub deinit: Option<unsafe extern "C" fn()>,
    /// `[main-thread]` A factory by id, static, or null if there is none.
    /// `busbar.plugin-factory/1` gives a [`BusbarPluginFactory`].
    pub get_factory: Option<unsafe extern "C" fn(factory_id: BusbarStr) -> *const c_void>,
}

/// Makes plugins.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct BusbarPluginFactory {
    /// Size of this struct, bytes.
    pub struct_size: u32,
    /// Zero.
    pub reserved: u32,
    /// `[main-thread]` Number of plugins in this library, at most 64.
    pub count: Option<unsafe extern "C" fn() -> u32>,
    /// `[main-thread]` Descriptor of one of them, static, or null if `index`
    /// is too large.
    pub descriptor: Option<unsafe extern "C" fn(index: u32) -> *const BusbarPluginDescriptor>,
    /// `[main-thread]` Makes an instance with settings (a JSON object that
    /// fits the descriptor's schema). Returns null and fills `error` on
    /// failure. `host` stays valid until `destroy` returns.
    pub create: Option<
        unsafe extern "C" fn(
            plugin_id: BusbarStr,
            settings_json: BusbarStr,
            host: *const BusbarHost,
            error: *mut BusbarError,
        ) -> *mut BusbarPlugin,
    >,
}

/// What a plugin is. Static.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct BusbarPluginDescriptor {
    /// Size of this struct, bytes.
    pub struct_size: u32,
    /// Number of capabilities, at most 64.
    pub capability_count: u32,
    /// Unique id in reverse notation, such as `com.example.mine`: letters, digits,
    /// `.`, `_` and `-`, at most 128.
    pub id: BusbarStr,
    /// Name for people.
    pub name: BusbarStr,
    /// Version of the plugin.
    pub version: BusbarStr,
    /// One sentence.
    pub description: BusbarStr,
    /// JSON Schema of the settings; empty accepts any object.
    pub settings_schema: BusbarStr,
    /// Ids of its capabilities, `capability_count` of them.
    pub capabilities: *const BusbarStr,
}

/// One instance. Owned by the library; the host gives it back by `destroy`.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct BusbarPlugin {
    /// Size of this struct, bytes.
    pub struct_size: u32,
    /// Zero.
    pub reserved: u32,
    /// The library's own.
    pub data: *mut c_void,
    /// `[main-thread & idle]` Ends the instance and frees it. No call to the
    /// host may follow.
    pub destroy: Option<unsafe extern "C" fn(plugin: *mut BusbarPlugin)>,
    /// `[main-thread]` The table of a capability by id, valid until `destroy`,
    /// or null if the plugin does not have it.
    pub get_capability: Option<
        unsafe extern "C" fn(
            plugin: *const BusbarPlugin,
            capability_id: BusbarStr,
        ) -> *const c_void,
    >,
}

impl BusbarStr {
    /// Text that lives for ever.
    pub const fn from_static(text: &'static str) -> Self {
        Self { ptr: text.as_ptr(), len: text.len() }
    }

    /// A view of text, valid as long as it is.
    pub const fn from_borrowed(text: &str) -> Self {
        Self { ptr: text.as_ptr(), len: text.len() }
    }
}

impl BusbarError {
    /// An error with no message yet.
    pub const fn empty() -> Self {
        Self {
            struct_size: size_of::<Self>() as u32,
            message_len: 0,
            status: BUSBAR_OK,
            message: [0; 1024],
        }
    }
}
