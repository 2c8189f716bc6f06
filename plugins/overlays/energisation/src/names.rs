//! Indices of names, in the order in which they come.

use std::collections::HashMap;

use crate::topology_error::TopologyError;

/// Indices by names, and back.
#[derive(Clone, Debug, Default)]
pub(crate) struct Names {
    numbers: HashMap<String, usize>,
    names: Vec<String>,
}

impl Names {
    /// Gives the index of a name, which may be new.
    pub(crate) fn number(&mut self, name: &str) -> usize {
        if let Some(&number) = self.numbers.get(name) {
            return number;
        }
        let number = self.names.len();
        self.numbers.insert(name.to_owned(), number);
        self.names.push(name.to_owned());
        number
    }

    /// Finds the index of a name.
    pub(crate) fn get(&self, name: &str) -> Option<usize> {
        self.numbers.get(name).copied()
    }

    /// Finds the index of a name that a place in the settings has.
    pub(crate) fn find(
        &self,
        what: &'static str,
        name: &str,
        place: &str,
    ) -> Result<usize, TopologyError> {
        let unknown =
            || TopologyError::Unknown { place: place.to_owned(), what, name: name.to_owned() };
        self.get(name).ok_or_else(unknown)
    }

    /// Gives the index of a name that must be new.
    pub(crate) fn once(&mut self, what: &'static str, name: &str) -> Result<usize, TopologyError> {
        if self.numbers.contains_key(name) {
            return Err(TopologyError::Twice { what, name: name.to_owned() });
        }
        Ok(self.number(name))
    }

    /// Gives the names in their order.
    pub(crate) fn into_names(self) -> Vec<String> {
        self.names
    }
}
