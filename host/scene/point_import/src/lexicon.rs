//! Lexicon: words of power engineering, with their concepts.
//!
//! Letter codes are those of IEC 81346-2 (objects) and IEC 81346-10 (voltage
//! levels), names of logical nodes those of IEC 61850-7-4; the others are usual in
//! point lists. `qa#` is the word with a number behind it.

/// Aspect that a word describes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(crate) enum Axis {
    /// Substation of the equipment.
    Station,
    /// Voltage level of the equipment.
    Level,
    /// A bay or feeder.
    Bay,
    /// A piece of equipment.
    Device,
    /// A part of one.
    Part,
    /// A phase: 1, 2, 3, or 4 for the neutral.
    Phase,
    /// A winding of a transformer: 1 the highest voltage.
    Winding,
    /// Quantity that is measured or reported; it names no place.
    Quantity,
    /// A word without meaning here.
    Neutral,
    /// Word outside the lexicon: a name, perhaps.
    Word,
}

/// Entry of the lexicon: axis, concept, words.
type Entry = (Axis, &'static str, &'static [&'static str]);

pub(crate) const BREAKER: &str = "breaker";
pub(crate) const DISCONNECTOR: &str = "disconnector";
pub(crate) const EARTHING_SWITCH: &str = "earthing switch";
pub(crate) const TRANSFORMER: &str = "transformer";
pub(crate) const ARRESTER: &str = "arrester";
pub(crate) const BUSHING: &str = "bushing";
pub(crate) const PHASE: &str = "phase";
pub(crate) const WINDING: &str = "winding";
pub(crate) const BAY: &str = "bay";
pub(crate) const STATION: &str = "station";
pub(crate) const POSITION: &str = "position";

use Axis::{Bay, Device, Neutral, Part, Quantity, Station, Winding};

#[rustfmt::skip]
pub(crate) const LEXICON: &[Entry] = &[
    (Station, STATION, &["s#", "substation", "station", "ss#", "sub#"]),
    (Bay, BAY, &["q#", "bay", "feeder", "fdr", "feld", "field#"]),
    (Device, BREAKER, &["qa#", "cb", "brk", "bkr", "brkr", "breaker", "circuit breaker", "xcbr", "qf", "leistungsschalter"]),
    (Device, DISCONNECTOR, &["qb#", "ds", "dis", "disc", "iso", "isol", "isolator", "disconnector", "disconnect", "disconnect switch", "disconnecting switch", "trenner", "qs", "xswi"]),
    (Device, EARTHING_SWITCH, &["qc#", "es", "esw", "earth switch", "earthing switch", "grounding switch", "ground switch", "erder", "xswi"]),
    (Device, "current transformer", &["bc#", "ct", "current transformer", "tctr", "stromwandler"]),
    (Device, "voltage transformer", &["bv#", "bu#", "vt", "pt", "cvt", "voltage transformer", "potential transformer", "tvtr", "spannungswandler"]),
    (Device, ARRESTER, &["fa#", "sa", "moa", "arrester", "arrestor", "surge arrester", "surge arrestor", "lightning arrester", "zsar", "sarc"]),
    (Device, TRANSFORMER, &["t#", "ta#", "tr", "tf", "tx", "trf", "xfmr", "xfrmr", "xfr", "trafo", "transformer", "power transformer", "yptr", "ptr"]),
    (Device, "busbar", &["w#", "wa#", "bb", "bus", "busbar", "bus bar", "bbar", "sammelschiene"]),
    (Device, "capacitor", &["ca#", "cap", "capacitor", "capacitor bank", "zcap"]),
    (Device, "conductor", &["wb#", "conductor", "wires"]),
    (Device, "mast", &["fe#", "mast", "lightning mast"]),
    (Part, BUSHING, &["bushing", "bsh", "bshg", "bush", "bushg"]),
    (Part, "tap changer", &["tap changer", "tapchanger", "oltc", "ltc", "yltc"]),
    (Part, "buchholz relay", &["buchholz relay", "buchholz", "gas relay", "buchh"]),
    (Part, "conservator", &["conservator", "conserv", "cons", "oil conservator"]),
    (Part, "tank", &["tank", "main tank"]),
    (Part, "radiator", &["radiator", "rad", "radiators"]),
    (Part, "fan frame", &["fan frame", "fan bank"]),
    (Part, "gas density monitor", &["gas density monitor", "density monitor", "gdm"]),
    (Part, "mechanism box", &["mechanism box", "mech box", "drive box"]),
    (Part, "breather", &["silica gel breather", "breather"]),
    (Part, "position indicator", &["position indicator"]),
    (Part, "foundation", &["foundation", "fdn", "plinth"]),
    (Part, "support insulator", &["support insulator"]),
    (Part, "support", &["support", "supp"]),
    (Part, "base frame", &["base frame"]),
    (Part, "base", &["base", "skid", "skids", "base skids"]),
    (Part, "frame", &["frame"]),
    (Part, "box", &["box", "kiosk"]),
    (Part, "cabinet", &["cabinet", "cab"]),
    (Part, "mechanism", &["mechanism", "mech"]),
    (Part, "drive", &["drive"]),
    (Part, "terminal", &["terminal", "term"]),
    (Part, "insulator", &["insulator", "insul"]),
    (Part, "column", &["column", "col"]),
    (Part, "pipe", &["pipe"]),
    (Part, "valve", &["valve", "vlv"]),
    (Part, "interrupter", &["interrupter", "intr"]),
    (Part, "cover", &["cover", "lid"]),
    (Part, "housing", &["housing"]),
    (Part, "chamber", &["chamber"]),
    (Part, "rod", &["rod"]),
    (Part, "pump", &["pump", "pmp"]),
    (Winding, "1", &["hv", "hvs"]),
    (Winding, "2", &["mv", "mvs"]),
    (Winding, "3", &["lv", "lvs"]),
    (Quantity, POSITION, &["pos", "position", "stellung", "open", "closed", "opn", "cls", "posn"]),
    (Quantity, "current", &["cur", "curr", "current", "amp", "amps", "ampere", "i", "strom"]),
    (Quantity, "voltage", &["volt", "volts", "voltage", "phv", "ppv", "vol", "spannung", "u", "v"]),
    (Quantity, "power", &["p", "power", "pwr", "totw", "active power", "reactive power", "totvar", "var", "mvar", "mw", "watt", "q", "load", "totpf", "mva"]),
    (Quantity, "frequency", &["freq", "frequency", "hz", "f"]),
    (Quantity, "temperature", &["temp", "tmp", "temperature"]),
    (Quantity, "top oil", &["top oil", "topoil", "tot", "oil temp", "oil tmp", "oil temperature", "oti", "top oil temp", "top oil temperature", "toptmp", "oiltemp"]),
    (Quantity, "hot spot", &["hot spot", "hotspot", "hst", "winding temp", "winding temperature", "wti", "hptmp", "winding hot spot", "wdg temp"]),
    (Quantity, "oil level", &["oil level", "oil lev", "oillevel", "oil lvl", "oillvl"]),
    (Quantity, "tap", &["tap", "tap pos", "tap position", "tappos", "tap posn"]),
    (Quantity, "gas in oil", &["dga", "h2", "ch4", "c2h2", "c2h4", "c2h6", "co2", "h2o", "co", "hydrogen", "moisture", "siml", "methane", "acetylene"]),
    (Quantity, "fan", &["fan", "fans", "fan stage", "fan stages", "fan stages running", "cooler", "coolers"]),
    (Quantity, "SF6", &["sf", "simg", "gas pressure", "density", "gas density"]),
    (Quantity, "leakage", &["leakage", "leak", "surge count", "surges", "leakage current", "resistive current"]),
    (Quantity, "pressure", &["press", "pressure", "pres"]),
    (Quantity, "energy", &["energy", "mwh", "wh", "supwh", "dmdwh"]),
    (Quantity, "state", &["alarm", "alm", "trip", "status", "state", "tripped", "warning", "blocked", "healthy", "fault", "level", "lev", "count", "counter", "vibration", "tilt", "ready", "spring", "charged"]),
    (Neutral, "", &[
        "st", "stval", "mx", "mag", "instmag", "cval", "val", "value", "meas", "measurement", "mmxu", "msqi",
        "mmtr", "stmp", "ggio", "cswi", "cilo", "csw", "ctrl", "prot", "mon", "ied", "rtu", "plc", "bcu", "bcm", "ai",
        "di", "do", "ao", "dp", "sp", "dpi", "spi", "pv", "signal", "sig", "tag", "point", "live", "scada",
        "ld", "lln", "lphd", "indication", "ind", "total", "of", "the", "and", "in", "at", "no", "nr", "kv",
        "kva", "kw", "ka", "ma", "phs", "ph", "phase", "pole", "actual", "act", "avg", "rms", "bar", "celsius", "deg",
    ]),
];

/// Words of nodes that name nothing: they come from modelling programs.
pub(crate) const NOISE: [&str; 20] = [
    "mesh",
    "node",
    "group",
    "grp",
    "object",
    "obj",
    "geo",
    "geometry",
    "primitive",
    "prim",
    "lod",
    "instance",
    "root",
    "scene",
    "model",
    "shape",
    "solid",
    "empty",
    "default",
    "the",
];

/// Nominal and highest voltages in kilovolts to the letters of IEC 81346-10.
pub(crate) const LEVELS: [(&str, &[u32]); 7] = [
    ("level C", &[380, 400, 420]),
    ("level D", &[220, 225, 230, 245, 252]),
    ("level E", &[110, 115, 123, 126, 132, 138, 145]),
    ("level F", &[60, 63, 66, 69, 72]),
    ("level H", &[30, 33, 35, 36]),
    ("level J", &[20, 22, 24]),
    ("level K", &[10, 11, 12]),
];

/// Letters of phases: all schemes in use.
pub(crate) const PHASES: [(&str, u32); 10] = [
    ("a", 1),
    ("b", 2),
    ("c", 3),
    ("r", 1),
    ("s", 2),
    ("t", 3),
    ("u", 1),
    ("v", 2),
    ("w", 3),
    ("n", 4),
];

/// Letters of phases that are also quantities, with the units that these have.
pub(crate) const ALSO_QUANTITIES: [(&str, &[&str]); 6] = [
    ("a", &["a", "ka", "ma"]),
    ("u", &["v", "kv", "mv"]),
    ("v", &["v", "kv", "mv"]),
    ("w", &["w", "kw", "mw"]),
    ("s", &["va", "kva", "mva"]),
    ("t", &["°c", "c", "k", "°f", "s"]),
];

/// Current or voltage with the phase, in one word.
pub(crate) const PHASE_QUANTITIES: [(&str, u32); 9] = [
    ("ia", 1),
    ("ib", 2),
    ("ic", 3),
    ("ua", 1),
    ("ub", 2),
    ("uc", 3),
    ("va", 1),
    ("vb", 2),
    ("vc", 3),
];

/// Words for "between two phases".
pub(crate) const BETWEEN_PHASES: [&str; 12] =
    ["ab", "bc", "ca", "uab", "ubc", "uca", "vab", "vbc", "vca", "phab", "phbc", "phca"];

/// Returns the equipment at which a quantity is found, if the name does not say it: the device,
/// then its part.
pub(crate) fn implied_by(quantity: &str) -> &'static [&'static str] {
    match quantity {
        "top oil" | "hot spot" | "gas in oil" => &[TRANSFORMER, "tank"],
        "oil level" => &[TRANSFORMER, "conservator"],
        "tap" => &[TRANSFORMER, "tap changer"],
        "fan" => &[TRANSFORMER],
        _ => &[],
    }
}

/// Reports whether a kind of equipment can have a quantity; true for unknown ones.
pub(crate) fn fits(quantity: &str, device: &str) -> bool {
    let is_switch = [BREAKER, DISCONNECTOR, EARTHING_SWITCH].contains(&device);
    match quantity {
        POSITION => is_switch,
        "top oil" | "hot spot" | "oil level" | "tap" | "gas in oil" | "fan" => {
            device == TRANSFORMER
        }
        "leakage" => device == ARRESTER || device == BUSHING || device == TRANSFORMER,
        "SF6" => device != ARRESTER && device != TRANSFORMER && device != "busbar",
        _ => true,
    }
}
