//! One plugin library: entry, version check, factory, descriptors.

use std::ffi::c_void;
use std::path::{Path, PathBuf};
use std::ptr::NonNull;

use busbar_plugin_abi as abi;

use crate::log::HostTable;
use crate::text;

/// Plugins that one library may hold, and capabilities that one may have.
const MAX_ITEMS: u32 = 64;

/// What a plugin says of itself.
#[derive(Clone, Debug, PartialEq)]
pub struct PluginInfo {
    /// Unique id.
    pub id: String,
    /// Name for people.
    pub name: String,
    /// Version.
    pub version: String,
    /// One sentence.
    pub description: String,
    /// Capability ids.
    pub capabilities: Vec<String>,
    /// JSON Schema of its settings, if it has one.
    pub settings_schema: Option<serde_json::Value>,
    /// The library's file.
    pub path: PathBuf,
}

/// A library that passed the checks. It stays mapped for ever: unloading is
/// never safe once a library used a thread-local or a thread.
pub(crate) struct PluginLibrary {
    entry: &'static abi::BusbarPluginEntry,
    factory: &'static abi::BusbarPluginFactory,
    pub(crate) plugins: Vec<PluginInfo>,
}

impl PluginLibrary {
    /// Opens a library and checks that it speaks this ABI.
    pub(crate) fn open(path: &Path) -> Result<Self, String> {
        // SAFETY: running the library's initialisers is what loading a plugin
        // from a configured directory means.
        let library = unsafe { libloading::Library::new(path) }
            .map_err(|e| format!("cannot load it: {e}"))?;
        // SAFETY: the ABI gives this symbol this type; its version is checked
        // before more than the version is read.
        let entry = unsafe {
            library.get::<*const abi::BusbarPluginEntry>(abi::ENTRY_SYMBOL.to_bytes_with_nul())
        };
        let entry = entry.map(|symbol| *symbol).map_err(|_| {
            let symbol = abi::ENTRY_SYMBOL.to_string_lossy();
            format!("it is no Busbar plugin: it has no symbol '{symbol}'")
        })?;
        // Leaked on purpose: see the type.
        std::mem::forget(library);
        // SAFETY: the symbol leads to an entry, in a library that stays mapped.
        let entry = unsafe { check_entry(entry) }?;
        let factory = init(entry)?;
        let plugins = describe(factory, path)?;
        Ok(Self { entry, factory, plugins })
    }

    /// Makes an instance; the plugin's words on failure.
    pub(crate) fn create(
        &self,
        id: &str,
        settings_json: &str,
        host: &HostTable,
    ) -> Result<NonNull<abi::BusbarPlugin>, String> {
        let create = self.factory.create.ok_or("its factory has no `create`")?;
        let mut error = abi::BusbarError::empty();
        let (id, settings) =
            (abi::BusbarStr::from_borrowed(id), abi::BusbarStr::from_borrowed(settings_json));
        // SAFETY: texts and error live for the call, the table as long as the instance.
        let plugin = unsafe { create(id, settings, host.as_ptr(), &mut error) };
        NonNull::new(plugin).ok_or_else(|| match text::message_of(&error) {
            message if message.is_empty() => "it gave no instance and no reason".into(),
            message => message,
        })
    }
}

impl Drop for PluginLibrary {
    fn drop(&mut self) {
        if let Some(deinit) = self.entry.deinit {
            // SAFETY: every instance holds its library, so none is left.
            unsafe { deinit() }
        }
    }
}

/// # Safety
/// `entry` leads to the start of an entry of some version that lives for ever.
unsafe fn check_entry(
    entry: *const abi::BusbarPluginEntry,
) -> Result<&'static abi::BusbarPluginEntry, String> {
    if entry.is_null() || !entry.is_aligned() {
        return Err("its entry is null or misaligned".into());
    }
    // SAFETY: the first three words are in every version of the entry.
    let [size, major, minor] = unsafe { entry.cast::<[u32; 3]>().read() };
    if major != abi::BUSBAR_ABI_MAJOR || minor > abi::BUSBAR_ABI_MINOR {
        return Err(format!(
            "it speaks plugin ABI {major}.{minor}, this host {}.{}: rebuild it with the SDK of \
             this host",
            abi::BUSBAR_ABI_MAJOR,
            abi::BUSBAR_ABI_MINOR,
        ));
    }
    if (size as usize) < size_of::<abi::BusbarPluginEntry>() {
        return Err(format!("its entry is {size} bytes long, too short for its version"));
    }
    // SAFETY: version and size say that the whole entry is there.
    Ok(unsafe { &*entry })
}

fn init(
    entry: &'static abi::BusbarPluginEntry,
) -> Result<&'static abi::BusbarPluginFactory, String> {
    if let Some(init) = entry.init {
        let mut error = abi::BusbarError::empty();
        // SAFETY: called once, before anything else, with an error that lives.
        if unsafe { init(&mut error) } != abi::BUSBAR_OK {
            return Err(format!("it failed to start: {}", text::message_of(&error)));
        }
    }
    let get_factory = entry.get_factory.ok_or("its entry has no `get_factory`")?;
    // SAFETY: a static text; the ABI makes the result a static factory or null.
    let factory = unsafe {
        get_factory(abi::BusbarStr::from_static(abi::PLUGIN_FACTORY_ID))
            .cast::<abi::BusbarPluginFactory>()
            .as_ref()
    };
    let factory = factory.ok_or_else(|| format!("it has no '{}'", abi::PLUGIN_FACTORY_ID))?;
    if (factory.struct_size as usize) < size_of::<abi::BusbarPluginFactory>() {
        return Err("its factory is too short for its version".into());
    }
    Ok(factory)
}

fn describe(factory: &abi::BusbarPluginFactory, path: &Path) -> Result<Vec<PluginInfo>, String> {
    let (count, descriptor) =
        factory.count.zip(factory.descriptor).ok_or("its factory lacks functions")?;
    // SAFETY: called on the loading thread, as the ABI says.
    let count = unsafe { count() };
    if count > MAX_ITEMS {
        return Err(format!("it claims {count} plugins; the limit is {MAX_ITEMS}"));
    }
    (0..count)
        .map(|index| {
            // SAFETY: the ABI makes the result static or null.
            let descriptor = unsafe { descriptor(index).as_ref() };
            let descriptor =
                descriptor.ok_or_else(|| format!("plugin {index} has no descriptor"))?;
            // SAFETY: as the ABI says, the descriptor and its texts are static.
            unsafe { read_descriptor(descriptor, path) }
        })
        .collect()
}

/// # Safety
/// The pointers within are valid as the ABI says.
unsafe fn read_descriptor(
    raw: &abi::BusbarPluginDescriptor,
    path: &Path,
) -> Result<PluginInfo, String> {
    if (raw.struct_size as usize) < size_of::<abi::BusbarPluginDescriptor>() {
        return Err("a descriptor is too short for its version".into());
    }
    if raw.capability_count > MAX_ITEMS || (raw.capability_count > 0 && raw.capabilities.is_null())
    {
        return Err(format!("a descriptor lists no or more than {MAX_ITEMS} capabilities"));
    }
    // SAFETY: the caller vouches for texts and the list.
    let read = |text| unsafe { text::read(text) };
    let capabilities = (0..raw.capability_count as usize)
        // SAFETY: within the list that the descriptor gives.
        .map(|i| read(unsafe { raw.capabilities.add(i).read() }))
        .collect::<Result<_, _>>()?;
    let id = read(raw.id)?;
    if id.is_empty() {
        return Err("a plugin has an empty id".into());
    }
    let schema = read(raw.settings_schema)?;
    let settings_schema = match schema.as_str() {
        "" => None,
        text => Some(
            serde_json::from_str(text)
                .map_err(|e| format!("the settings schema of '{id}' is no JSON: {e}"))?,
        ),
    };
    Ok(PluginInfo {
        id,
        name: read(raw.name)?,
        version: read(raw.version)?,
        description: read(raw.description)?,
        capabilities,
        settings_schema,
        path: path.to_owned(),
    })
}

/// A capability table of an instance, its size checked.
pub(crate) fn table<T>(pointer: *const c_void) -> Option<&'static T> {
    // SAFETY: the ABI makes it a table that lives as long as the instance,
    // which whoever asks for it keeps; its first word is its size.
    let size = unsafe { pointer.cast::<u32>().as_ref() }?;
    if (*size as usize) < size_of::<T>() || !pointer.cast::<T>().is_aligned() {
        return None;
    }
    // SAFETY: as above, and long enough.
    unsafe { pointer.cast::<T>().as_ref() }
}
