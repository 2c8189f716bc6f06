//! Columns of a table, found by their names.

use dga::Gas;

use crate::row::Cells;

/// Columns that say which sample it is; they come first in results.
pub(crate) const IDENTIFYING: [&str; 2] = ["equipment", "time"];
/// Names shown of columns that are not used.
const MAX_SHOWN: usize = 8;

/// Columns of a file by its header.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct Columns {
    /// Number of all columns.
    pub(crate) count: usize,
    /// [`IDENTIFYING`] columns that are there, and where.
    pub(crate) identifying: Vec<(&'static str, usize)>,
    /// Gases that are there, and where, in the order of [`Gas::ALL`].
    pub(crate) gases: Vec<(Gas, usize)>,
    /// Warning about columns without use, in words.
    pub(crate) warning: Option<String>,
}

impl Columns {
    /// Finds the columns of a header.
    ///
    /// # Errors
    /// Why it is none, in words with a remedy.
    pub(crate) fn from_cells(cells: &Cells) -> Result<Self, String> {
        let names: Vec<_> = (0..cells.len()).map(|index| cells.get(index)).collect();
        let find = |wanted: &str| -> Result<Option<usize>, String> {
            let is_it = |name: &&str| name.eq_ignore_ascii_case(wanted);
            let mut found = (0..names.len()).filter(|&index| is_it(&names[index]));
            let first = found.next();
            match found.next() {
                Some(_) => Err(format!("column {wanted} is there twice; remove or rename one")),
                None => Ok(first),
            }
        };
        let (mut gases, mut missing) = (Vec::new(), Vec::new());
        for gas in Gas::ALL {
            match find(gas.formula())? {
                Some(index) => gases.push((gas, index)),
                None if Gas::FIVE.contains(&gas) => missing.push(gas.formula()),
                None => {}
            }
        }
        if !missing.is_empty() {
            return Err(fault(&names, &missing));
        }
        let mut identifying = Vec::new();
        for name in IDENTIFYING {
            identifying.extend(find(name)?.map(|index| (name, index)));
        }
        let is_used = |index| {
            gases.iter().any(|(_, used)| *used == index)
                || identifying.iter().any(|(_, used)| *used == index)
        };
        let unused: Vec<_> =
            (0..names.len()).filter(|&index| !is_used(index)).map(|index| names[index]).collect();
        let warning = (!unused.is_empty()).then(|| {
            let shown = unused[..unused.len().min(MAX_SHOWN)].join("', '");
            format!("columns not used: '{shown}'{}", more(unused.len()))
        });
        Ok(Self { count: names.len(), identifying, gases, warning })
    }
}

fn more(count: usize) -> String {
    match count.saturating_sub(MAX_SHOWN) {
        0 => String::new(),
        more => format!(" and {more} more"),
    }
}

fn fault(names: &[&str], missing: &[&str]) -> String {
    for (separator, name) in [(';', "semicolons"), ('\t', "tabs")] {
        let is_cut = |name: &&str| {
            name.split(separator).any(|part| part.trim().eq_ignore_ascii_case(missing[0]))
        };
        if names.iter().any(|name| name.contains(separator) && is_cut(name)) {
            return format!(
                "columns are separated by {name}; export with commas between columns and points \
                 in numbers"
            );
        }
    }
    format!(
        "the header lacks {}; it must name H2, CH4, C2H6, C2H4 and C2H2, and may name CO, CO2, O2, \
         N2, equipment and time",
        missing.join(", ")
    )
}
