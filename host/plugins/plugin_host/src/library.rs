//! One plugin library: entry, version check, factory, descriptors.

use std::collections::BTreeMap;
use std::os::fd::AsRawFd;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::ptr::NonNull;
use std::sync::{Arc, Mutex, PoisonError, Weak};

use busbar_plugin_abi as abi;
use serde::{Deserialize, Serialize};

use crate::log::HostTable;
use crate::text;
use crate::trust::LibraryFile;

/// Plugins that one library may hold, and capabilities that one may have.
const MAX_ITEMS: u32 = 64;

/// Description that a plugin gives of itself.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PluginInfo {
    /// Unique id of the plugin.
    pub id: String,
    /// Display name of the plugin.
    pub name: String,
    /// Version of the plugin.
    pub version: String,
    /// Description in one sentence.
    pub description: String,
    /// Ids of its capabilities.
    pub capabilities: Vec<String>,
    /// JSON Schema of its settings, if it has one.
    #[serde(with = "crate::text::as_json")]
    pub settings_schema: Option<serde_json::Value>,
    /// Path of the library file.
    pub path: PathBuf,
}

/// A library that passed the checks. It stays mapped for ever: unloading is
/// never safe once a library used a thread-local or a thread.
pub(crate) struct PluginLibrary {
    factory: &'static abi::BusbarPluginFactory,
    pub(crate) plugins: Vec<PluginInfo>,
    // Last: `deinit` follows everything else.
    _initialised: Initialised,
}

impl PluginLibrary {
    /// Opens a library and checks its ABI version. A library that is open already, under any
    /// path, is shared and not initialised twice.
    pub(crate) fn open(file: &LibraryFile) -> Result<Arc<Self>, String> {
        static OPEN: Mutex<BTreeMap<usize, Weak<PluginLibrary>>> = Mutex::new(BTreeMap::new());
        let entry = load(file)?;
        let mut open = OPEN.lock().unwrap_or_else(PoisonError::into_inner);
        let address = std::ptr::from_ref(entry).addr();
        if let Some(library) = open.get(&address).and_then(Weak::upgrade) {
            return Ok(library);
        }
        let initialised = Initialised::new(entry)?;
        let factory = factory_of(entry)?;
        let plugins = describe(factory, file.path())?;
        let library = Arc::new(Self { factory, plugins, _initialised: initialised });
        open.insert(address, Arc::downgrade(&library));
        Ok(library)
    }

    /// Creates an instance; on failure the error has the plugin's status and message.
    pub(crate) fn create(
        &self,
        id: &str,
        settings_json: &str,
        host: &HostTable,
    ) -> Result<NonNull<abi::BusbarPlugin>, (abi::BusbarStatusNumber, String)> {
        let internal = |what: &str| (abi::BUSBAR_INTERNAL, what.to_owned());
        let create = self.factory.create.ok_or_else(|| internal("its factory has no `create`"))?;
        let mut error = abi::BusbarError::empty();
        let (id, settings) =
            (abi::BusbarStr::from_borrowed(id), abi::BusbarStr::from_borrowed(settings_json));
        // SAFETY: texts and error live for the call, the table as long as the instance.
        let plugin = unsafe { create(id, settings, host.as_ptr(), &mut error) };
        NonNull::new(plugin).ok_or_else(|| match text::message_of(&error) {
            message if message.is_empty() => internal("it gave no instance and no reason"),
            message => (error.status, message),
        })
    }
}

/// A library between `init` and `deinit`.
struct Initialised(&'static abi::BusbarPluginEntry);

impl Initialised {
    fn new(entry: &'static abi::BusbarPluginEntry) -> Result<Self, String> {
        if let Some(init) = entry.init {
            let mut error = abi::BusbarError::empty();
            // SAFETY: called before anything else, with an error that lives.
            if unsafe { init(&mut error) } != abi::BUSBAR_OK {
                return Err(format!("it failed to start: {}", text::message_of(&error)));
            }
        }
        Ok(Self(entry))
    }
}

impl Drop for Initialised {
    fn drop(&mut self) {
        if let Some(deinit) = self.0.deinit {
            // SAFETY: every instance holds its library, so none is left.
            unsafe { deinit() }
        }
    }
}

/// A name under which the loader finds the contents behind a descriptor.
///
/// The loader takes two libraries of one name for the same, and keeps a library
/// of known device and inode. So a file keeps one descriptor, and with it one
/// name, for as long as its library is mapped: for ever.
fn loader_name(library: &LibraryFile) -> Result<PathBuf, String> {
    /// Modified, in seconds and nanoseconds, and length.
    type Version = (i64, i64, u64);
    static LOADED: Mutex<BTreeMap<(u64, u64), (LibraryFile, Version)>> =
        Mutex::new(BTreeMap::new());
    let metadata = library.file().metadata().map_err(|e| format!("cannot look at it: {e}"))?;
    let version = (metadata.mtime(), metadata.mtime_nsec(), metadata.len());
    let mut loaded = LOADED.lock().unwrap_or_else(PoisonError::into_inner);
    let (first, first_version) = loaded
        .entry((metadata.dev(), metadata.ino()))
        .or_insert_with(|| (library.clone(), version));
    if *first_version != version {
        return Err("it was changed in place since this program loaded it; start the program \
                    again, and replace libraries by renaming"
            .into());
    }
    Ok(format!("/proc/self/fd/{}", first.file().as_raw_fd()).into())
}

/// Maps a library and checks its entry.
fn load(file: &LibraryFile) -> Result<&'static abi::BusbarPluginEntry, String> {
    let name = loader_name(file)?;
    // SAFETY: running the library's initialisers is what loading a plugin
    // from a configured directory means.
    let library = unsafe { libloading::Library::new(&name) }.map_err(|error| {
        let words = error.to_string();
        format!("cannot load it: {}", words.replace(&*name.to_string_lossy(), "the file"))
    })?;
    // SAFETY: the ABI gives this symbol this type; its version is checked
    // before more than the version is read.
    let entry = unsafe {
        library.get::<*const abi::BusbarPluginEntry>(abi::ENTRY_SYMBOL.to_bytes_with_nul())
    };
    let entry = entry.map(|symbol| *symbol).map_err(|_| {
        let symbol = abi::ENTRY_SYMBOL.to_string_lossy();
        format!("it is no Busbar plugin: it has no symbol '{symbol}'")
    })?;
    // Leaked on purpose: see `PluginLibrary`.
    std::mem::forget(library);
    if entry.is_null() || !entry.is_aligned() {
        return Err("its entry is null or misaligned".into());
    }
    // SAFETY: the first three words are in every version of the entry.
    let [_, major, minor] = unsafe { entry.cast::<[u32; 3]>().read() };
    if major != abi::BUSBAR_ABI_MAJOR || minor > abi::BUSBAR_ABI_MINOR {
        return Err(format!(
            "it speaks plugin ABI {major}.{minor}, this host {}.{}: rebuild it with the SDK of \
             this host",
            abi::BUSBAR_ABI_MAJOR,
            abi::BUSBAR_ABI_MINOR,
        ));
    }
    checked(entry).ok_or_else(|| "its entry is too short for its version".into())
}

fn factory_of(
    entry: &'static abi::BusbarPluginEntry,
) -> Result<&'static abi::BusbarPluginFactory, String> {
    let get_factory = entry.get_factory.ok_or("its entry has no `get_factory`")?;
    // SAFETY: a static text; the library is initialised.
    let factory = unsafe { get_factory(abi::BusbarStr::from_static(abi::PLUGIN_FACTORY_ID)) };
    checked(factory.cast()).ok_or_else(|| {
        format!("it has no '{}', or one too short for its version", abi::PLUGIN_FACTORY_ID)
    })
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
            // SAFETY: called on the loading thread, with an index below the count.
            let descriptor = checked(unsafe { descriptor(index) });
            let descriptor = descriptor.ok_or_else(|| {
                format!("plugin {index} has no descriptor, or one too short for its version")
            })?;
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
    let list_missing = raw.capabilities.is_null() || !raw.capabilities.is_aligned();
    if raw.capability_count > MAX_ITEMS || (raw.capability_count > 0 && list_missing) {
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

/// Checks a struct of the ABI from a library: not null, aligned, and at least as long as this
/// version needs, by its first word.
pub(crate) fn checked<T>(pointer: *const T) -> Option<&'static T> {
    if pointer.is_null() || !pointer.is_aligned() {
        return None;
    }
    // SAFETY: the ABI makes it a struct that lives as long as the library or
    // the instance, which whoever asks for it keeps; its size comes first.
    let size = unsafe { pointer.cast::<u32>().read() };
    // SAFETY: as above, and long enough.
    (size as usize >= size_of::<T>()).then(|| unsafe { &*pointer })
}
