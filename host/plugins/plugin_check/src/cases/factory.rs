//! The factory and its descriptors.

use busbar_plugin_abi as abi;

use crate::finding::{Finding, Outcome};
use crate::journal::{Entry, PluginFacts};
use crate::library::sized;
use crate::probe::Probe;
use crate::text;

/// Plugins of one library, and capabilities of one plugin.
const MAX_ITEMS: u32 = 64;

pub(crate) fn factory(probe: &Probe) -> Outcome {
    let factory = probe.initialised()?;
    for (there, name) in [
        (factory.count.is_some(), "count"),
        (factory.descriptor.is_some(), "descriptor"),
        (factory.create.is_some(), "create"),
    ] {
        probe.expect(there, format!("the factory lacks `{name}`"), "set it");
    }
    let Some(get_factory) = probe.entry()?.get_factory else { return Ok(()) };
    let none = abi::BusbarStr { ptr: std::ptr::null(), len: 0 };
    let longer = format!("{}0", abi::PLUGIN_FACTORY_ID);
    for (what, id) in [
        ("an unknown id", abi::BusbarStr::from_static("busbar.no-such-factory/1")),
        ("an empty id", none),
        ("an id that only begins like its own", abi::BusbarStr::from_borrowed(&longer)),
        ("an id that is not UTF-8", text::of_bytes(&[0xff, 0xfe])),
    ] {
        let given = probe.get_factory(get_factory, id);
        let fault = format!("`get_factory` gives something for {what}");
        probe.expect(given.is_null(), fault, "compare the whole id, and return null otherwise");
    }
    Ok(())
}

pub(crate) fn descriptors(probe: &Probe) -> Outcome {
    let factory = probe.initialised()?;
    let (Some(count), Some(descriptor)) = (factory.count, factory.descriptor) else {
        return Err(Finding::new("the factory lacks functions", "set them").into());
    };
    let found = probe.count(count);
    if !(1..=MAX_ITEMS).contains(&found) {
        let fault = format!("`count` says {found} plugins; 1 to {MAX_ITEMS} are possible");
        return Err(Finding::new(fault, "return the number of plugins in the library").into());
    }
    for index in [found, u32::MAX] {
        let beyond = probe.descriptor(descriptor, index);
        let fault = format!("`descriptor({index})` gives something, but there are {found}");
        probe.expect(beyond.is_null(), fault, "return null for an index that is too large");
    }
    let mut ids = Vec::new();
    for index in 0..found {
        let pointer = probe.descriptor(descriptor, index);
        let raw = sized(pointer, "BusbarPluginDescriptor")?;
        let again = probe.descriptor(descriptor, index);
        let fault = format!("`descriptor({index})` gives another address each time");
        probe.expect(again == pointer, fault, "make it static");
        let facts = describe(probe, raw)?;
        let fault = format!("two plugins have the id '{}'", facts.id);
        probe.expect(!ids.contains(&facts.id), fault, "give each plugin an id of its own");
        ids.push(facts.id.clone());
        probe.journal.note(Entry::Plugin(facts));
    }
    Ok(())
}

fn describe(
    probe: &Probe,
    raw: &abi::BusbarPluginDescriptor,
) -> Result<PluginFacts, crate::finding::Stop> {
    let mut texts = Vec::new();
    for (name, text) in [
        ("id", raw.id),
        ("name", raw.name),
        ("version", raw.version),
        ("description", raw.description),
        ("settings_schema", raw.settings_schema),
    ] {
        let read = text::read(text).unwrap_or_else(|what| {
            let fault = format!("the descriptor's {name} {what}");
            probe.find(Finding::new(fault, "give static UTF-8 text and its length in bytes"));
            String::new()
        });
        let may_be_empty = name == "settings_schema" || probe.has_findings();
        let fault = format!("the descriptor's {name} is empty");
        probe.expect(may_be_empty || !read.trim().is_empty(), fault, "fill it in");
        texts.push(read);
    }
    let id = texts.swap_remove(0);
    let plain = |c: char| c.is_ascii_alphanumeric() || "._-".contains(c);
    probe.expect(
        id.chars().all(plain) && id.len() <= 128,
        format!("the id '{}' is more than letters, digits, '.', '_' and '-'", id.escape_debug()),
        "use reverse notation, such as com.example.mine, of at most 128 characters",
    );
    let missing = raw.capabilities.is_null() || !raw.capabilities.is_aligned();
    if raw.capability_count > MAX_ITEMS || (raw.capability_count > 0 && missing) {
        let fault = format!("'{id}' lists {} capabilities, or none where", raw.capability_count);
        let remedy = format!("point to an array of capability_count ids, at most {MAX_ITEMS}");
        return Err(Finding::new(fault, remedy).into());
    }
    let mut capabilities = Vec::new();
    for index in 0..raw.capability_count as usize {
        // SAFETY: within the list that the descriptor gives.
        let text = text::read(unsafe { raw.capabilities.add(index).read() });
        let capability = text.map_err(|what| {
            Finding::new(format!("capability {index} of '{id}' {what}"), "use the header's ids")
        })?;
        let known = abi::CAPABILITIES.iter().any(|known| known.id == capability);
        let ours = capability.starts_with("busbar.");
        probe.expect(
            known || !ours,
            format!("'{id}' names {capability}, which this host does not have"),
            "rebuild it with this host's SDK or header; drafts change between releases",
        );
        let fault = format!("'{id}' names {capability} twice");
        probe.expect(!capabilities.contains(&capability), fault, "name it once");
        capabilities.push(capability);
    }
    Ok(PluginFacts { id, capabilities })
}
