//! Feature ids (EXT_mesh_features): vertices of each feature, and the features' names.

use std::collections::HashMap;

use busbar_geometry::{NO_FEATURE, RawPrimitive};

use crate::ImportLimits;
use crate::accessor::Accessor;
use crate::error::{ImportError, ImportFault};
use crate::name_table::NameTable;
use crate::names::{UniqueNames, clean_name};

/// Feature ids of a primitive's vertices.
#[derive(Clone, Copy)]
pub(crate) struct FeatureIds<'a> {
    pub(crate) ids: Accessor<'a>,
    /// The id that stands for none.
    pub(crate) null: Option<u64>,
    /// The property table whose rows the ids are.
    pub(crate) table: Option<usize>,
}

impl FeatureIds<'_> {
    /// Returns the id of a checked vertex, or [`NO_FEATURE`].
    pub(crate) fn at(&self, vertex: usize) -> u32 {
        self.feature(self.ids.id_at(vertex).unwrap_or(NO_FEATURE))
    }

    /// Checks that every id stored is a whole number and a row of the table.
    pub(crate) fn check(&self, rows: Option<u64>) -> Result<(), ImportError> {
        let limit = rows.unwrap_or(NO_FEATURE.into());
        let accept = |id: Option<u32>| {
            id.is_some_and(|id| u64::from(id) < limit || self.feature(id) == NO_FEATURE)
        };
        match self.ids.find_refused_id(accept) {
            None => Ok(()),
            Some(element) => {
                let what = format!("element {element} is no whole number below {limit}");
                Err(ImportFault::Invalid(what).at(format!("/accessors/{}", self.ids.index)))
            }
        }
    }

    fn feature(&self, id: u32) -> u32 {
        if self.null == Some(id.into()) { NO_FEATURE } else { id }
    }
}

/// The names of property tables' rows; `None` where a table has no names.
pub(crate) type NameTables<'a> = HashMap<usize, Option<NameTable<'a>>>;

/// Gives names to the features of meshes, as many as the limits allow.
pub(crate) struct FeatureNamer<'a> {
    tables: NameTables<'a>,
    left: u32,
    limit: u32,
}

/// Key of a feature: features of different tables are never the same.
type Key = (Option<usize>, u32);

impl<'a> FeatureNamer<'a> {
    pub(crate) fn new(tables: NameTables<'a>, limits: &ImportLimits) -> Self {
        let limit = limits.max_features;
        Self { tables, left: limit, limit }
    }

    /// Numbers the features that one mesh shows from 0, in the order of their
    /// tables and ids, and gives their names. `tables` has one a primitive.
    pub(crate) fn name(
        &mut self,
        primitives: &mut [RawPrimitive],
        tables: &[Option<usize>],
    ) -> Result<Vec<String>, ImportFault> {
        let mut numbers = self.collect(primitives, tables)?;
        let mut keys: Vec<Key> = numbers.keys().copied().collect();
        keys.sort_unstable();
        for (number, key) in (0..).zip(&keys) {
            numbers.insert(*key, number);
        }
        for (primitive, &table) in primitives.iter_mut().zip(tables) {
            // Vertices of one feature mostly follow each other.
            let (mut last, mut its_number) = (NO_FEATURE, NO_FEATURE);
            for feature in &mut primitive.features {
                if *feature != last {
                    last = *feature;
                    // Those that no triangle has are none.
                    its_number = numbers.get(&(table, last)).copied().unwrap_or(NO_FEATURE);
                }
                *feature = its_number;
            }
        }
        let mut names = UniqueNames::default();
        Ok(keys.into_iter().map(|key| names.unique(self.own_name(key))).collect())
    }

    /// Counts the features of a mesh that has its names already.
    pub(crate) fn count(&mut self, features: usize) -> Result<(), ImportFault> {
        let left =
            u32::try_from(features).ok().and_then(|features| self.left.checked_sub(features));
        self.left = left.ok_or_else(|| self.too_many())?;
        Ok(())
    }

    fn too_many(&self) -> ImportFault {
        let (count, limit) = (u64::from(self.limit) + 1, self.limit.into());
        ImportFault::TooMany { what: "features", count, limit }
    }

    /// Collects the features that triangles have.
    fn collect(
        &mut self,
        primitives: &[RawPrimitive],
        tables: &[Option<usize>],
    ) -> Result<HashMap<Key, u32>, ImportFault> {
        let mut found = HashMap::new();
        for (primitive, &table) in primitives.iter().zip(tables) {
            // Triangles of one feature mostly follow each other.
            let mut last = NO_FEATURE;
            for corners in &primitive.triangles {
                let Some(&feature) = primitive.features.get(corners[0] as usize) else { break };
                if feature == last || feature == NO_FEATURE {
                    continue;
                }
                last = feature;
                if found.insert((table, feature), 0).is_none() {
                    self.count(1)?;
                }
            }
        }
        Ok(found)
    }

    fn own_name(&self, (table, id): Key) -> String {
        let table = table.and_then(|table| self.tables.get(&table)?.as_ref());
        let name = table.and_then(|table| table.get(id)).map(clean_name);
        name.filter(|name| !name.is_empty()).unwrap_or_else(|| format!("feature {id}"))
    }
}
