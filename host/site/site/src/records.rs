//! Records of business and asset management systems, read from plugins.

mod poller;

use std::time::Duration;

use busbar_plugin_host::PluginError;
use busbar_records::List;

use crate::definition::SiteDefinition;
use crate::equipment::EquipmentDirectory;
use crate::plugin_poller::PluginPoller;
use poller::{PolledRecords, fault_of, take_lists};

/// The longest that a site which settles waits for the first records.
const FIRST_READ_TIMEOUT: Duration = Duration::from_secs(20);
/// Different ids of a list that are looked for in the directory, to say which it has not.
const MAX_CHECKED_IDS: usize = 2_000;

/// Records of the plugins that are configured as sources of records.
#[derive(Default)]
pub struct RecordStore {
    sources: Vec<RecordSource>,
    revision: u64,
}

/// Records of one plugin.
struct RecordSource {
    poller: PluginPoller<PolledRecords>,
    lists: Vec<List>,
    /// Fault that keeps the records from being read.
    fault: Option<String>,
}

impl RecordStore {
    /// Starts reading the records of all configured plugins.
    pub(crate) fn start(site: &SiteDefinition, settles: bool) -> Result<Self, PluginError> {
        let mut store = Self::default();
        let plugins = site.config.records.iter();
        for plugin in plugins.filter_map(|records| site.plugins.get(&records.plugin)) {
            let poller = PluginPoller::start(plugin)?;
            store.sources.push(RecordSource { poller, lists: Vec::new(), fault: None });
        }
        if settles {
            store
                .sources
                .iter()
                .for_each(|source| source.poller.wait_for_first(FIRST_READ_TIMEOUT));
        }
        Ok(store)
    }

    /// Takes the lists that the pollers have read.
    pub(crate) fn step(&mut self, directory: &dyn EquipmentDirectory) {
        for source in &mut self.sources {
            let (is_new, fault) =
                (take_lists(&source.poller, &mut source.lists), fault_of(&source.poller));
            self.revision += u64::from(is_new || fault != source.fault);
            source.fault = fault;
            if is_new {
                source.lists.iter().for_each(|list| warn_unknown_equipment(directory, list));
            }
        }
    }

    /// Returns the revision, which grows with each change of lists or faults.
    pub fn revision(&self) -> u64 {
        self.revision
    }

    /// Returns all lists, each with the fault that keeps it from being read.
    pub fn lists(&self) -> impl Iterator<Item = (&List, Option<&str>)> {
        self.sources
            .iter()
            .flat_map(|source| source.lists.iter().map(move |list| (list, source.fault.as_deref())))
    }
}

/// Warns of rows whose equipment is not in the directory.
fn warn_unknown_equipment(directory: &dyn EquipmentDirectory, list: &List) {
    let is_absent = |id: &&str| directory.find(id).is_none();
    let mut absent = list.equipment().take(MAX_CHECKED_IDS).filter(is_absent);
    if let Some(first) = absent.next() {
        let (count, title) = (1 + absent.count(), &list.info().title);
        tracing::warn!(
            "'{title}' names {count} pieces of equipment that are not in the scene, such as \
             '{first}': mend the ids there, or add aliases to \"equipment\""
        );
    }
}
