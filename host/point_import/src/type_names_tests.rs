use super::*;
use PointType::{Bool, DoublePoint, F64, I64};

#[track_caller]
fn check(names: &[&str], expected: TypeMeaning) {
    for name in names {
        assert_eq!(meaning_of(name, false), expected, "{name}");
    }
}

#[test]
fn numbers_of_every_tool_are_numbers() {
    check(
        &[
            "f64",
            "f32",
            "float",
            "Float32",
            "FLOAT64",
            "Float4",
            "Float8",
            "Real",
            "REAL",
            "LReal",
            "LREAL",
            "Long Real",
            "VT_R4",
            "VT_R8",
            "R4",
            "R8",
            "F32BE",
            "float32_abcd",
            "Float CD AB",
            "FLOAT32 swapped",
            "SwappedFloat",
            "Float Inverse",
            "32-bit float",
            "Float (32 bit)",
            "64 bit floating point",
            "Floating-point number 32-bit IEEE 754",
            "Gleitkommazahl 64-Bit IEEE 754",
            "double precision",
            "Double Float",
            "Double-precision floating point",
            "single precision",
            "Single Float",
            "Double 64",
            "System.Double",
            "System.Single",
            "xs:double",
            "java.lang.Double",
            "OPC UA Double",
            "i=10",
            "i=11",
            "ns=0;i=11",
            "decimal(10,2)",
            "NUMERIC(8, 3)",
            "Number",
            "analog",
            "AI",
            "Analog Input",
            "Analogue value",
            "measurement",
            "monitoring",
            "MV",
            "CMV",
            "Messwert",
            "Measured value",
            "Measured value, short floating point",
            "Measured value, scaled",
            "M_ME_NC_1",
            "M_ME_TF_1 (36)",
            "TI 36",
            "<13> M_ME_NC_1",
            "IOReal",
            "I/O Real",
            "MemoryReal",
            "Duration",
            "遥测",
            "浮点型",
            "VT_CY",
        ],
        Kind(F64),
    );
}

#[test]
fn integers_of_every_tool_are_integers() {
    check(
        &[
            "i32",
            "i16",
            "u16",
            "U32",
            "int",
            "INT",
            "SInt",
            "USInt",
            "UInt",
            "DInt",
            "DINT",
            "UDInt",
            "LInt",
            "ULInt",
            "Byte",
            "SByte",
            "Word",
            "DWord",
            "LWord",
            "QWord",
            "Short",
            "UShort",
            "Long",
            "ULong",
            "LLong",
            "LongLong",
            "BCD",
            "LBCD",
            "Int1",
            "Int2",
            "Int4",
            "Int8",
            "int16",
            "Int64",
            "UInt16",
            "UINT32",
            "VT_I1",
            "VT_I2",
            "VT_I4",
            "VT_I8",
            "VT_UI1",
            "VT_UI2",
            "VT_UI4",
            "VT_INT",
            "VT_UINT",
            "I2",
            "UI4",
            "S16",
            "U16BE",
            "INT32 CDAB",
            "INT8U",
            "INT16U",
            "INT24U",
            "INT32U",
            "INT64",
            "Double Word",
            "Double integer",
            "unsigned int",
            "UnsignedInt16",
            "signed 16-bit value",
            "Unsigned 32-bit value",
            "16 bit unsigned integer",
            "long int",
            "xs:unsignedInt",
            "counter",
            "step",
            "Step position",
            "M_ST_NA_1",
            "M_IT_TB_1",
            "M_BO_NA_1",
            "TI 37",
            "enum",
            "Enumeration",
            "INS",
            "ENS",
            "BCR",
            "bigint",
            "int(11)",
            "i=6",
            "Vorzeichenloser 16-Bit Wert",
            "IOInteger",
            "整型",
            "双字",
            "I64",
        ],
        Integer,
    );
    check(&["i64"], Kind(I64));
}

#[test]
fn points_of_every_tool_are_points() {
    check(
        &[
            "bool",
            "Boolean",
            "BOOL",
            "bit",
            "DI",
            "BI",
            "binary",
            "digital",
            "Digital Input",
            "single_point",
            "SinglePoint",
            "Single point information",
            "Single Indication",
            "Single bit",
            "SP",
            "SPI",
            "SPS",
            "SPC",
            "status",
            "coil",
            "Discrete Input",
            "VT_BOOL",
            "i=1",
            "M_SP_NA_1",
            "M_SP_TB_1",
            "TI 30",
            "Binary Input",
            "IODisc",
            "Discrete",
            "Einzelmeldung",
            "遥信",
            "xs:boolean",
            "Binary tag",
        ],
        Kind(Bool),
    );
    check(
        &[
            "double_point",
            "DoublePoint",
            "double point",
            "Double-point information",
            "Double Point Value",
            "Double Indication",
            "Double Status",
            "double-bit",
            "Double-bit Binary Input",
            "double input",
            "DP",
            "DPI",
            "DPS",
            "DPC",
            "Dbpos",
            "DBI",
            "position",
            "M_DP_NA_1",
            "M_DP_TB_1",
            "31 M_DP_TB_1",
            "TI 31",
            "ASDU 31",
            "Doppelmeldung",
            "双点遥信",
            "M_EP_TD_1",
        ],
        Kind(DoublePoint),
    );
}

#[test]
fn names_with_two_readings_and_without_values_are_told_apart() {
    check(&["Double", "DOUBLE", "dbl", " double "], NumberOrPoint(DoublePoint));
    check(&["Single", "single", "Sgl"], NumberOrPoint(Bool));
    for name in ["Char", "BO", "state"] {
        assert!(matches!(meaning_of(name, false), TypeMeaning::Unclear(_)), "{name}");
    }
    check(&["Single Command", "double command", "C_SC_NA_1", "TI 45", "setpoint"], COMMAND);
    check(
        &[
            "String",
            "STRING[20]",
            "WString",
            "varchar(20)",
            "VisString255",
            "VT_BSTR",
            "i=12",
            "Text tag, 8-bit character set",
        ],
        TEXT,
    );
    check(&["Date", "DateTime", "DT", "Time", "S5Time", "VT_DATE", "Timestamp", "i=13"], TIME);
    check(
        &["REAL[10]", "Word[]", "ARRAY [0..9] OF INT", "VT_ARRAY|VT_R4", "Struct", "Float ("],
        STRUCTURE,
    );
    for name in
        ["", "?", "8", "31", "u", "frob", "Float frob", "bool float", "16", "F_32_BE_X", "Word.3"]
    {
        assert_eq!(meaning_of(name, false), Unknown, "{name}");
    }
    assert_eq!(meaning_of("31", true), Kind(DoublePoint));
    assert_eq!(meaning_of("13", true), Kind(F64));
    assert_eq!(meaning_of(&"float ".repeat(100), false), Unknown);
}
