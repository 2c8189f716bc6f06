//! Names as parts of equipment ids: readable, and unique where they must be.

use std::collections::HashMap;

use crate::limits::MAX_NAME_BYTES;

/// Names given so far, and the last number appended to each.
#[derive(Default)]
pub(crate) struct UniqueNames(HashMap<String, u32>);

impl UniqueNames {
    /// Returns the name, numbered if it was given before.
    pub(crate) fn unique(&mut self, name: String) -> String {
        if !self.0.contains_key(&name) {
            self.0.insert(name.clone(), 1);
            return name;
        }
        let mut number = self.0[&name];
        loop {
            number += 1;
            let numbered = format!("{name}#{number}");
            if !self.0.contains_key(&numbered) {
                self.0.insert(name, number);
                self.0.insert(numbered.clone(), 1);
                return numbered;
            }
        }
    }
}

/// Ids are paths, and are read by people: no '/' and no control character.
pub(crate) fn clean_name(name: &str) -> String {
    let shown = name.trim().chars().map(|c| if c == '/' || c.is_control() { '_' } else { c });
    let mut clean: String = shown.collect();
    clean.truncate(clean.floor_char_boundary(MAX_NAME_BYTES));
    clean
}
