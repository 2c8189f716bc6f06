//! Entry point, factory and instance of plugins, and the host's services for them.

use core::ffi::{CStr, c_void};

/// Major version of the ABI: host and plugin must have the same.
pub const BUSBAR_ABI_MAJOR: u32 = 1;
/// Minor version of the ABI: a host runs plugins of its own minor version and older ones.
pub const BUSBAR_ABI_MINOR: u32 = 0;

/// Name of the symbol that a plugin library exports: a [`BusbarPluginEntry`].
pub const ENTRY_SYMBOL: &CStr = c"busbar_plugin_entry";
/// Factory id for [`BusbarPluginEntry::get_factory`].
pub const PLUGIN_FACTORY_ID: &str = "busbar.plugin-factory/1";

/// Result of a call: success, or the kind of failure.
///
/// cbindgen:rename-all=ScreamingSnakeCase
#[repr(i32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
// Each value has its whole name in C, which is frozen.
pub enum BusbarStatus {
    /// Status of a call that succeeded.
    BusbarOk = 0,
    /// Status of a call whose arguments break a rule of this header: the caller is at fault.
    BusbarInvalidArgument = 1,
    /// Status of a call whose settings or address are at fault: the user must change them.
    BusbarInvalidSettings = 2,
    /// Status of a call whose buffer is too small for the result.
    BusbarBufferTooSmall = 3,
    /// Status of a call that stopped because the caller asked to.
    BusbarCancelled = 4,
    /// Status of a call that failed outside the plugin: a file, a device, memory.
    BusbarFailed = 5,
    /// Status of a call that met a fault of the plugin; a caught panic is one.
    BusbarInternal = 6,
}

enum_numbers! {
    /// Number of a [`BusbarStatus`] that the other side wrote.
    BusbarStatusNumber: i32 = BusbarStatus {
        BUSBAR_OK = BusbarOk,
        BUSBAR_INVALID_ARGUMENT = BusbarInvalidArgument,
        BUSBAR_INVALID_SETTINGS = BusbarInvalidSettings,
        BUSBAR_BUFFER_TOO_SMALL = BusbarBufferTooSmall,
        BUSBAR_CANCELLED = BusbarCancelled,
        BUSBAR_FAILED = BusbarFailed,
        BUSBAR_INTERNAL = BusbarInternal,
    }
}

/// Bytes of text that a [`BusbarError`] holds.
pub const BUSBAR_ERROR_CAPACITY: u32 = 1024;

/// UTF-8 text with a length in bytes, not terminated. `ptr` may be null only
/// if `len` is 0.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct BusbarStr {
    /// First byte of the text.
    pub ptr: *const u8,
    /// Length of the text, bytes.
    pub len: usize,
}

/// Error of a call. The caller owns it and fills in `struct_size`.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct BusbarError {
    /// Size of this struct as the caller knows it, bytes.
    pub struct_size: u32,
    /// Bytes used of `message`, at most its capacity.
    pub message_len: u32,
    /// Status of the error, for calls that return no status.
    pub status: BusbarStatusNumber,
    /// Message in UTF-8: fault, place and remedy in one or two sentences.
    pub message: [u8; 1024],
}

/// Level of a line in the host's log, and of a command's diagnostic.
///
/// cbindgen:rename-all=ScreamingSnakeCase
#[repr(u32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
// Each value has its whole name in C, which is frozen.
pub enum BusbarLogLevel {
    /// Log level of faults that a user must act on.
    BusbarLogError = 1,
    /// Log level of conditions that may become a fault.
    BusbarLogWarning = 2,
    /// Log level of ordinary events.
    BusbarLogInfo = 3,
    /// Log level of details for the plugin's author.
    BusbarLogDebug = 4,
}

enum_numbers! {
    /// Number of a [`BusbarLogLevel`] that the other side wrote.
    BusbarLogLevelNumber: u32 = BusbarLogLevel {
        BUSBAR_LOG_ERROR = BusbarLogError,
        BUSBAR_LOG_WARNING = BusbarLogWarning,
        BUSBAR_LOG_INFO = BusbarLogInfo,
        BUSBAR_LOG_DEBUG = BusbarLogDebug,
    }
}

/// Services of the host for one plugin instance. Valid from `create` until `destroy` returns.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct BusbarHost {
    /// Size of this struct, bytes.
    pub struct_size: u32,
    /// Major version of the host's ABI.
    pub abi_major: u32,
    /// Minor version of the host's ABI.
    pub abi_minor: u32,
    /// Reserved; must be zero.
    pub reserved: u32,
    /// Context that is passed back in every call to the host.
    pub context: *mut c_void,
    /// `[any-thread]` Writes one line to the host's log. Messages beyond the
    /// host's rate limit are dropped and counted. Cannot fail.
    pub log: Option<
        unsafe extern "C" fn(context: *mut c_void, level: BusbarLogLevelNumber, message: BusbarStr),
    >,
}

/// Entry point that a library exports. Static, for the library's whole life.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct BusbarPluginEntry {
    /// Size of this struct, bytes.
    pub struct_size: u32,
    /// Major version that the plugin was built with, [`BUSBAR_ABI_MAJOR`].
    pub abi_major: u32,
    /// Minor version that the plugin was built with, [`BUSBAR_ABI_MINOR`].
    pub abi_minor: u32,
    /// Reserved; must be zero.
    pub reserved: u32,
    /// `[serialized]` Initializes the library, before any other call. May be null.
    pub init: Option<unsafe extern "C" fn(error: *mut BusbarError) -> BusbarStatusNumber>,
    /// `[serialized]` Called once for every `init`, after every plugin is destroyed. The library
    /// stays mapped, and `init` may follow again. May be null.
    pub deinit: Option<unsafe extern "C" fn()>,
    /// `[serialized]` Returns a static factory by id, or null if there is none.
    /// `busbar.plugin-factory/1` names a [`BusbarPluginFactory`].
    pub get_factory: Option<unsafe extern "C" fn(factory_id: BusbarStr) -> *const c_void>,
}

/// Factory of plugin instances.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct BusbarPluginFactory {
    /// Size of this struct, bytes.
    pub struct_size: u32,
    /// Reserved; must be zero.
    pub reserved: u32,
    /// `[serialized]` Number of plugins in this library, at most 64.
    pub count: Option<unsafe extern "C" fn() -> u32>,
    /// `[serialized]` Returns a plugin's static descriptor, or null if `index` is too large.
    pub descriptor: Option<unsafe extern "C" fn(index: u32) -> *const BusbarPluginDescriptor>,
    /// `[serialized]` Creates an instance with settings, a JSON object that fits the descriptor's
    /// schema. Returns null and fills in `error` on failure. `host` stays valid until `destroy`
    /// returns.
    pub create: Option<
        unsafe extern "C" fn(
            plugin_id: BusbarStr,
            settings_json: BusbarStr,
            host: *const BusbarHost,
            error: *mut BusbarError,
        ) -> *mut BusbarPlugin,
    >,
}

/// Identity and capabilities of a plugin. Static.
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
    /// Display name of the plugin.
    pub name: BusbarStr,
    /// Version of the plugin.
    pub version: BusbarStr,
    /// Description of the plugin in one sentence.
    pub description: BusbarStr,
    /// JSON Schema of the settings; empty accepts any object.
    pub settings_schema: BusbarStr,
    /// Ids of the plugin's capabilities, `capability_count` of them.
    pub capabilities: *const BusbarStr,
}

/// Plugin instance. The library owns it; the host ends it by `destroy`.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct BusbarPlugin {
    /// Size of this struct, bytes.
    pub struct_size: u32,
    /// Reserved; must be zero.
    pub reserved: u32,
    /// Data of the library's own.
    pub data: *mut c_void,
    /// `[serialized & idle]` Ends the instance and frees it. No call to the
    /// host may follow.
    pub destroy: Option<unsafe extern "C" fn(plugin: *mut BusbarPlugin)>,
    /// `[serialized]` Returns the function table of a capability by id, valid until `destroy`, or
    /// null if the plugin lacks the capability.
    pub get_capability: Option<
        unsafe extern "C" fn(
            plugin: *const BusbarPlugin,
            capability_id: BusbarStr,
        ) -> *const c_void,
    >,
}

impl BusbarStr {
    /// Wraps a static text.
    pub const fn from_static(text: &'static str) -> Self {
        Self { ptr: text.as_ptr(), len: text.len() }
    }

    /// Wraps a borrowed text; valid as long as the text is.
    pub const fn from_borrowed(text: &str) -> Self {
        Self { ptr: text.as_ptr(), len: text.len() }
    }
}

impl BusbarError {
    /// Creates an error without a message.
    pub const fn empty() -> Self {
        Self {
            struct_size: size_of::<Self>() as u32,
            message_len: 0,
            status: BUSBAR_OK,
            message: [0; 1024],
        }
    }
}
