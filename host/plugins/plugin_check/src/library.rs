//! A library, from its file to its factory, one step at a time.

use std::path::Path;

use busbar_plugin_abi as abi;

use crate::finding::Finding;

/// Largest plausible size of an ABI struct, bytes.
const MAX_STRUCT_BYTES: u32 = 1 << 16;

/// Maps a library and finds its entry. It stays mapped, as in a host.
pub(crate) fn load(path: &Path) -> Result<*const abi::BusbarPluginEntry, Finding> {
    // SAFETY: running the library's initialisers is what this process is for.
    let library = unsafe { libloading::Library::new(path) }.map_err(|error| {
        Finding::new(
            format!("the library cannot be loaded: {error}"),
            "build it as a shared library (in Rust crate-type cdylib, in C -shared -fPIC) whose \
             own libraries are found on this machine",
        )
    })?;
    // SAFETY: the ABI gives this symbol this type; nothing is read through it yet.
    let entry = unsafe {
        library.get::<*const abi::BusbarPluginEntry>(abi::ENTRY_SYMBOL.to_bytes_with_nul())
    };
    let entry = entry.map(|symbol| *symbol).map_err(|_| {
        Finding::new(
            format!("the library exports no '{}'", abi::ENTRY_SYMBOL.to_string_lossy()),
            "export it: `export_plugin!` in Rust, BUSBAR_EXPORT in C",
        )
    })?;
    std::mem::forget(library);
    Ok(entry)
}

/// The entry, if its version and size are those of this ABI.
pub(crate) fn entry(
    pointer: *const abi::BusbarPluginEntry,
) -> Result<&'static abi::BusbarPluginEntry, Finding> {
    if pointer.is_null() || !pointer.is_aligned() {
        return Err(Finding::new(
            "the entry is null or misaligned",
            "export a static BusbarPluginEntry, not a pointer to one",
        ));
    }
    // SAFETY: the first words are in every version of the entry.
    let [_, major, minor] = unsafe { pointer.cast::<[u32; 3]>().read() };
    if major != abi::BUSBAR_ABI_MAJOR || minor > abi::BUSBAR_ABI_MINOR {
        let (host_major, host_minor) = (abi::BUSBAR_ABI_MAJOR, abi::BUSBAR_ABI_MINOR);
        return Err(Finding::new(
            format!("it speaks ABI {major}.{minor}, this host {host_major}.{host_minor}"),
            "rebuild it with the SDK or the header of this host",
        ));
    }
    sized(pointer, "BusbarPluginEntry")
}

/// A struct that the plugin gave: not null, aligned, and of a credible size.
pub(crate) fn sized<T>(pointer: *const T, name: &str) -> Result<&'static T, Finding> {
    if pointer.is_null() || !pointer.is_aligned() {
        return Err(Finding::new(
            format!("its {name} is null or misaligned"),
            format!("return the address of a {name} that lives as long as the header says"),
        ));
    }
    // SAFETY: every struct of the ABI starts with its size.
    let size = unsafe { pointer.cast::<u32>().read() };
    if (size as usize) < size_of::<T>() || size > MAX_STRUCT_BYTES {
        let least = size_of::<T>();
        return Err(Finding::new(
            format!("its {name} says that it has {size} bytes; this version has {least}"),
            format!("set struct_size to sizeof({name})"),
        ));
    }
    // SAFETY: as long as it must be; it lives as long as its owner, which the cases keep.
    Ok(unsafe { &*pointer })
}
