//! The table of type names, and the words that other names are made of.

use crate::type_names::TypeMeaning;
use crate::type_names::TypeMeaning::{Integer, Kind, NoValue, NumberOrPoint, Unclear};
use busbar_types::ValueKind::{Bool, DoublePoint, F64, Text};

pub(crate) const COMMAND: TypeMeaning = NoValue("a command, which is not for a viewer");
pub(crate) const TEXT: TypeMeaning = Kind(Text);
pub(crate) const BINARY: TypeMeaning = NoValue("a row of bytes");
pub(crate) const TIME: TypeMeaning = NoValue("a time");
pub(crate) const STRUCTURE: TypeMeaning = NoValue("an array or a structure");

/// Whole names, without case and marks; they may be written in one word.
#[rustfmt::skip]
pub(crate) const NAMES: &[(TypeMeaning, &[&str])] = &[
    (Kind(F64), &[
        // Databases and languages.
        "number", "numeric", "decimal", "money", "currency", "cy", "duration",
        // Point lists.
        "analog", "analogue", "ai", "av", "ao", "ana", "measurement", "measured", "measurand",
        "measured value", "monitoring", "normalized", "normalised", "messwert", "analogwert",
        // Common data classes of IEC 61850-7-3.
        "mv", "cmv", "sav", "apc",
        // InTouch.
        "io real", "memory real", "indirect analog",
        // Modbus: the width is the address's.
        "input register", "input registers", "holding register", "holding registers",
        "遥测", "遥测量", "模拟量", "浮点", "浮点型", "浮点数", "双精度", "单精度", "双精度浮点",
        "单精度浮点", "双精度浮点型", "单精度浮点型", "双精度型", "单精度型", "实数",
        "ти", "телеизмерение", "вещественный", "вещественное", "gleitkommazahl",
    ]),
    (Integer, &[
        "counter", "ctr", "count", "counter value", "counter input", "pulse counter",
        "frozen counter", "accumulator", "integrated total", "integrated totals", "bcr",
        "step", "step position", "step position information", "tap", "tap position",
        "ins", "ens", "inc", "enc", "isc", "bsc", "enum", "enumerated", "enumeration",
        "multistate", "multi state", "multi state input", "multi state value", "msi", "msv",
        "bitstring", "bit string", "bitstring of 32 bit", "bitstring of 32 bits",
        "io integer", "memory integer",
        "zählwert", "zählerwert", "stufenstellung", "ganzzahl", "целое", "целый", "счетчик",
        "счётчик", "遥脉", "电度", "整型", "整数", "短整型", "长整型", "字", "双字", "四字",
        "四字型", "双字型", "字型", "字节", "字节型", "档位",
    ]),
    (Kind(Bool), &[
        "bool", "boolean", "bit", "di", "bi", "bv", "do", "binary", "digital", "discrete",
        "coil", "coils", "single bit", "sp", "spi", "sps", "spc", "tss", "act", "acd", "status",
        "logical", "flag", "io discrete", "memory discrete", "io disc", "mem disc",
        "packed single point", "packed single points",
        "einzelmeldung", "тс", "телесигнал", "логический", "遥信", "单点", "单点遥信", "单点信息",
        "布尔", "布尔型", "开关量",
    ]),
    (Kind(DoublePoint), &[
        "double bit", "dp", "dpi", "dps", "dpc", "dbi", "dbbi", "dbpos", "tsd", "position",
        "doppelmeldung", "双点", "双点遥信", "双点信息",
    ]),
    (NumberOrPoint(DoublePoint), &["double", "dbl", "double value"]),
    (NumberOrPoint(Bool), &["single", "sgl", "sng", "single value"]),
    (Unclear("a number of 8 bits (Kepware) or a character (IEC 61131-3)"), &["char", "字符"]),
    (Unclear("a binary output (DNP3) or a bit string (IEC 60870-5-101)"), &["bo", "m bo"]),
    (Unclear("a state of two values or of several"), &["state"]),
    (COMMAND, &[
        "control", "set point", "regulating step", "crob", "befehl", "einzelbefehl",
        "doppelbefehl", "sollwert", "ту", "遥控", "遥调",
    ]),
    (TEXT, &[
        "message", "io message", "memory message", "tx", "vss", "localized text",
        "qualified name", "uuid", "字符串", "строка",
    ]),
    (BINARY, &["xml", "guid", "node id", "objref", "blob"]),
    (TIME, &[
        "date", "time", "ltime", "tod", "ltod", "dt", "ldt", "dtl", "date time", "date and time",
        "time of day", "timestamp", "time stamp", "utc time", "entry time", "s5time", "日期",
    ]),
    (STRUCTURE, &[
        "struct", "structure", "object", "data set", "udt", "timer", "variant", "document",
        "extension object", "quality", "wye", "del", "seq", "byte array", "binary data",
    ]),
];

/// Words of floating-point numbers and of measured values.
pub(crate) const FLOATS: [&str; 16] = [
    "float",
    "floating",
    "real",
    "lreal",
    "flt",
    "precision",
    "gleitkommazahl",
    "analog",
    "analogue",
    "ai",
    "ao",
    "measured",
    "measurement",
    "normalized",
    "normalised",
    "scaled",
];

/// Words that name integers.
#[rustfmt::skip]
pub(crate) const INTEGERS: [&str; 42] = [
    "int", "integer", "uint", "uinteger", "sint", "usint", "dint", "udint", "lint", "ulint",
    "byte", "bytes", "sbyte", "ubyte", "word", "words", "dword", "lword", "qword", "uword",
    "sword", "short", "ushort", "long", "ulong", "llong", "longlong", "ulonglong", "bcd", "lbcd",
    "bigint", "smallint", "tinyint", "mediumint", "signed", "unsigned", "octet", "counter",
    "enum", "enumeration", "vorzeichenloser", "vorzeichenbehafteter",
];

/// Words that name states.
pub(crate) const STATES: [&str; 7] =
    ["bool", "boolean", "binary", "digital", "discrete", "coil", "binäre"];

/// Words that make `double` and `single` points, and tell nothing of other names.
pub(crate) const STATUS_WORDS: [&str; 6] =
    ["status", "state", "indication", "information", "input", "output"];

/// Words that name texts.
pub(crate) const TEXTS: [&str; 11] = [
    "string",
    "wstring",
    "text",
    "varchar",
    "nvarchar",
    "bstr",
    "wchar",
    "visstring",
    "visiblestring",
    "octetstring",
    "unicode",
];

/// Words that tell how a value is stored, and nothing of its kind.
#[rustfmt::skip]
pub(crate) const STORAGE: [&str; 42] = [
    "bit", "bits", "value", "values", "number", "numbers", "point", "points", "ieee", "754", "be",
    "le", "big", "little", "endian", "bigendian", "littleendian", "abcd", "cdab", "badc", "dcba",
    "ab", "cd", "ba", "dc", "swap", "swapped", "inverse", "inverted", "reverse", "reversed",
    "order", "msb", "lsb", "first", "register", "registers", "type", "data", "tag", "wert",
    "variable",
];

/// Name spaces of types: `VT_R8`, `xs:double`, `System.Single`, `Opc.Ua.Float`.
pub(crate) const NAME_SPACES: [&str; 10] =
    ["vt", "xs", "xsd", "system", "opc", "ua", "opcua", "java", "lang", "sql"];

/// Widths of numbers, in bytes or bits.
pub(crate) const WIDTHS: [&str; 10] = ["1", "2", "4", "8", "16", "24", "32", "48", "64", "128"];
