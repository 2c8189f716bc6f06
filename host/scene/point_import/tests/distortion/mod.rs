//! Equipment ids as people write them in point lists: other words, other separators,
//! parts left out where the rest still says which one it is.

use std::collections::BTreeMap;

use fastrand::Rng;

/// A name in a list.
#[derive(Clone, Debug, Default)]
pub(crate) struct Name {
    pub(crate) id: String,
    pub(crate) description: String,
    pub(crate) unit: &'static str,
    pub(crate) is_position: bool,
}

/// Namespace for tests on parts of models.
pub(crate) struct Part;

/// Parts of an equipment id by their meaning: `=S12 D1 Q3 -QB 9 -L 1`.
#[derive(Clone, Debug)]
struct Id {
    station: String,
    level: Option<String>,
    /// Letter and number; a second one in `=S12H1C1`.
    bay: Option<(char, u32)>,
    device: String,
    number: u32,
    phase: Option<usize>,
}

/// Distorts the ids of a station.
pub(crate) struct Distorter {
    /// Number of devices of a kind in a bay.
    of_kind: BTreeMap<(String, String), usize>,
    /// Number of levels that have a bay.
    levels_of_bay: BTreeMap<String, usize>,
}

const SEPARATORS: [&str; 8] = [".", "_", "-", "/", " ", ":", "__", " - "];
const PHASES: [[&str; 3]; 9] = [
    ["L1", "L2", "L3"],
    ["A", "B", "C"],
    ["R", "S", "T"],
    ["U", "V", "W"],
    ["phsA", "phsB", "phsC"],
    ["PhA", "PhB", "PhC"],
    ["Phase A", "Phase B", "Phase C"],
    ["L1", "L2", "L3"],
    ["ph_R", "ph_S", "ph_T"],
];

impl Part {
    pub(crate) fn is_root(name: &str) -> bool {
        ["transformer", "breaker pole", "disconnector pole"].contains(&name)
    }
}

fn pick<'a>(rng: &mut Rng, of: &[&'a str]) -> &'a str {
    of[rng.usize(..of.len())]
}

fn parse(id: &str) -> Id {
    let mut aspects = id.trim_start_matches('=').split('-');
    let function = aspects.next().expect("there is one");
    let mut chunks: Vec<(char, u32)> = Vec::new();
    for part in function.split_inclusive(|c: char| c.is_ascii_digit()) {
        let letter = part.chars().next().expect("it is not empty");
        match letter.to_digit(10) {
            Some(digit) => {
                let last = chunks.last_mut().expect("a letter came before");
                last.1 = last.1 * 10 + digit;
            }
            None => chunks.push((letter, part[1..].parse().expect("a digit"))),
        }
    }
    let is_level = |(letter, _): &&(char, u32)| "CDEH".contains(*letter);
    let level = chunks.get(1).filter(is_level).copied();
    let bay = chunks.get(if level.is_some() { 2 } else { 1 }).copied();
    let device = aspects.next().expect("each has a device");
    let digits = device.find(|c: char| c.is_ascii_digit()).expect("it has a number");
    let phase = aspects.next().map(|phase| usize::from(phase.as_bytes()[1] - b'1'));
    Id {
        station: format!("S{}", chunks[0].1),
        level: level.map(|(letter, number)| format!("{letter}{number}")),
        bay,
        device: device[..digits].to_owned(),
        number: device[digits..].parse().expect("a number"),
        phase,
    }
}

/// A number with or without leading zeros.
fn numbered(rng: &mut Rng, word: &str, number: u32) -> String {
    let gap = if word.len() > 2 { pick(rng, &["", "", " ", "_", "-"]) } else { "" };
    match rng.u8(..4) {
        0 => format!("{word}{gap}{number:02}"),
        _ => format!("{word}{gap}{number}"),
    }
}

fn device_words(device: &str) -> &'static [&'static str] {
    match device {
        "QA" => &["QA", "CB", "BRK", "Breaker", "XCBR", "QF", "BKR"],
        "QB" => &["QB", "DS", "DIS", "ISO", "Isolator", "XSWI", "Disconnector", "QS"],
        "BC" => &["BC", "CT", "CurrentTransformer"],
        "BV" => &["BV", "VT", "PT", "CVT"],
        "FA" => &["FA", "SA", "MOA", "Arrester", "SurgeArrester"],
        "CA" => &["CA", "Cap", "CapacitorBank"],
        "WA" => &["WA"],
        _ => &[],
    }
}

/// Words, unit, whether it is a position.
type Signal = (&'static [&'static str], &'static str, bool);

fn signals(device: &str) -> &'static [Signal] {
    match device {
        "QA" => &[
            (&["Pos", "Position", "POS.stVal", "Status", "State"], "", true),
            (&["SF6Press", "SF6 pressure", "GasDensity"], "bar", false),
            (&["SpringCharged", "Trip", "Alarm"], "", false),
        ],
        "QB" => &[(&["Pos", "Position", "Pos.stVal", "Status"], "", true)],
        "BC" => &[(&["Cur", "Current", "I", "Amp"], "A", false)],
        "BV" => &[(&["Volt", "Voltage", "PhV"], "kV", false)],
        "FA" => &[(&["LeakageCurrent", "SurgeCount", "Leak"], "mA", false)],
        "TA" => &[
            (&["TopOil", "TOT", "OilTemp", "TopOilTemp", "top_oil_temperature"], "°C", false),
            (&["H2", "C2H2", "DGA_CH4"], "ppm", false),
            (&["OilLevel", "Oil_Lvl"], "%", false),
            (&["TapPos", "Tap"], "", false),
            (&["HotSpot", "WindingTemp"], "°C", false),
        ],
        _ => &[(&["Temp", "Alarm", "Status"], "", false)],
    }
}

impl Distorter {
    /// For the whole station, with what the model misses.
    pub(crate) fn new(ids: &[String]) -> Self {
        let mut of_kind: BTreeMap<_, std::collections::BTreeSet<u32>> = BTreeMap::new();
        let mut levels: BTreeMap<_, std::collections::BTreeSet<Option<String>>> = BTreeMap::new();
        for id in ids.iter().map(|id| parse(id)) {
            of_kind.entry((id.device.clone(), "any".to_owned())).or_default().insert(id.number);
            let bay = id.bay.map(|(letter, number)| format!("{letter}{number}"));
            levels.entry(bay.unwrap_or_default()).or_default().insert(id.level);
        }
        Self {
            of_kind: of_kind.into_iter().map(|(key, numbers)| (key, numbers.len())).collect(),
            levels_of_bay: levels.into_iter().map(|(key, levels)| (key, levels.len())).collect(),
        }
    }

    /// A name of a piece of equipment.
    pub(crate) fn equipment(&self, id: &str, rng: &mut Rng) -> Name {
        let id = parse(id);
        let signals = signals(&id.device);
        let (words, unit, is_position) = signals[rng.usize(..signals.len())];
        let signal = pick(rng, words);
        let place = self.place(&id, rng);
        self.written(place, signal, unit, is_position, rng)
    }

    /// A name of a part of placed equipment; of the equipment for an empty part.
    pub(crate) fn part(&self, placement: &str, part: &str, rng: &mut Rng) -> Name {
        if part.is_empty() {
            return self.equipment_of_model(placement, rng);
        }
        let mut place = self.place(&parse(placement), rng);
        place.push(part_words(part, rng));
        let signal = pick(rng, &["Temp", "Status", "Alarm", "Value", "Vibration"]);
        self.written(place, signal, "", false, rng)
    }

    /// Returns a name about the whole of a model whose parts have nodes of their own.
    fn equipment_of_model(&self, placement: &str, rng: &mut Rng) -> Name {
        let id = parse(placement);
        let (signal, unit) = match id.device.as_str() {
            "TA" => (pick(rng, &["P", "Load", "TotW", "Trip"]), "MW"),
            _ => (pick(rng, &["Pos", "Position"]), ""),
        };
        let place = self.place(&id, rng);
        self.written(place, signal, unit, id.device != "TA", rng)
    }

    /// The words that say which one it is, outermost first.
    fn place(&self, id: &Id, rng: &mut Rng) -> Vec<String> {
        let mut words = Vec::new();
        match rng.u8(..4) {
            0 => words.push(id.station.clone()),
            1 => words.push(format!("SUB{}", &id.station[1..])),
            _ => {}
        }
        let bay = id.bay.map(|(letter, number)| format!("{letter}{number}")).unwrap_or_default();
        let needs_level = self.levels_of_bay[&bay] > 1 || bay.is_empty() || rng.bool();
        if let Some(level) = id.level.as_ref().filter(|_| needs_level) {
            let voltage = match &level[..1] {
                "D" => pick(rng, &["220kV", "220 kV", "220KV"]),
                "E" => pick(rng, &["110kV", "110 kV", "110"]),
                _ => "35kV",
            };
            words.push(if rng.bool() { level.clone() } else { voltage.to_owned() });
        }
        if let Some((letter, number)) = id.bay {
            let word = match letter {
                'Q' => pick(rng, &["Q", "Q", "Bay", "BAY", "Feeder", "Fdr"]),
                'T' => pick(rng, &["T", "TR", "TF", "Trafo", "XFMR", "Transformer"]),
                'W' => pick(rng, &["W", "BB", "Busbar"]),
                'C' => "C",
                'Z' => "Z",
                other => unreachable!("bay {other}"),
            };
            words.push(numbered(rng, word, number));
        }
        // T1 is a transformer's bay and the transformer.
        if id.device != "TA" || rng.u8(..3) == 0 {
            words.push(self.device(id, rng));
        }
        if let Some(phase) = id.phase {
            words.push(pick(rng, &PHASES.map(|scheme| scheme[phase])).to_owned());
        }
        words
    }

    fn device(&self, id: &Id, rng: &mut Rng) -> String {
        let word = match device_words(&id.device) {
            [] => &id.device,
            words => pick(rng, words),
        };
        let is_only = self.of_kind[&(id.device.clone(), "any".to_owned())] == 1;
        let may_leave_out = is_only && word != id.device && rng.u8(..3) == 0;
        if may_leave_out { word.to_owned() } else { numbered(rng, word, id.number) }
    }

    /// Puts words together in one of the styles of the field.
    fn written(
        &self,
        mut place: Vec<String>,
        signal: &str,
        unit: &'static str,
        is_position: bool,
        rng: &mut Rng,
    ) -> Name {
        let separator = pick(rng, &SEPARATORS);
        let name = match rng.u8(..10) {
            // Camel case, nothing between: words begin with capitals.
            0 => {
                let capital = |word: &String| {
                    let mut chars = word.chars().filter(|c| c.is_alphanumeric());
                    let first = chars.next().map(|c| c.to_ascii_uppercase());
                    first.into_iter().chain(chars).collect::<String>()
                };
                let separate = if rng.bool() { "_" } else { "." };
                let words: Vec<_> = place.iter().map(capital).collect();
                format!("{}{separate}{signal}", words.join(separate))
            }
            // The signal first.
            1 => format!("{signal}{separator}{}", place.join(separator)),
            2 if place.len() > 2 => {
                // The device before its bay.
                let last = place.len() - 1;
                place.swap(last - 1, last);
                format!("{}{separator}{signal}", place.join(separator))
            }
            _ => format!("{}{separator}{signal}", place.join(separator)),
        };
        let name = match rng.u8(..4) {
            0 => name.to_uppercase(),
            1 if !name.contains("phs") && !name.contains("Ph") => name.to_lowercase(),
            _ => name,
        };
        // An id that says nothing, and a description that does.
        if rng.u8(..10) == 0 {
            let id = format!("P{:06}", rng.u32(..1_000_000));
            return Name { id, description: place.join(" ") + " " + signal, unit, is_position };
        }
        Name { id: name, description: String::new(), unit, is_position }
    }
}

fn part_words(part: &str, rng: &mut Rng) -> String {
    let (name, number) = match part.rsplit_once(' ') {
        Some((name, number)) if number.starts_with(|c: char| c.is_ascii_digit()) => {
            (name, Some(number))
        }
        _ => (part, None),
    };
    let synonyms: &[&str] = match name {
        "bushing" => &["bushing", "Bsh", "BUSHING"],
        "conservator" => &["conservator", "Conserv"],
        "buchholz relay" => &["buchholz relay", "Buchholz", "BuchholzRelay", "gas relay"],
        "tap changer" => &["tap changer", "OLTC", "TapChanger", "LTC"],
        "radiator" => &["radiator", "Rad", "Radiator"],
        "cabinet" => &["cabinet", "Cab"],
        "mechanism box" => &["mechanism box", "MechBox", "mech_box"],
        _ => &[],
    };
    let word = if synonyms.is_empty() { name } else { pick(rng, synonyms) };
    let word = if rng.bool() { word.replace(' ', "_") } else { word.to_owned() };
    match number {
        Some(number) => format!("{word}{}{number}", pick(rng, &[" ", "_", "-"])),
        None => word,
    }
}
