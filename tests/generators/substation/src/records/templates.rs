//! Templates of work orders and assets by the class of equipment (IEC 81346-2).

/// Template of work on a class of equipment.
pub(super) struct WorkTemplate {
    pub(super) code: &'static str,
    pub(super) kind: &'static str,
    pub(super) text: &'static str,
    /// Next step as long as the work is open.
    pub(super) next: &'static str,
    pub(super) priority: &'static str,
}

/// Template of a class of equipment.
pub(super) struct AssetTemplate {
    pub(super) code: &'static str,
    /// Fictitious makers and their types.
    pub(super) made: [(&'static str, &'static str); 2],
    pub(super) rating: &'static str,
    pub(super) criticality: &'static str,
}

macro_rules! work {
    ($($code:literal $kind:literal $priority:literal, $next:literal: $text:literal;)*) => {
        &[$(WorkTemplate {
            code: $code, kind: $kind, text: $text, next: $next, priority: $priority,
        }),*]
    };
}

#[rustfmt::skip]
pub(super) const WORK: &[WorkTemplate] = work! {
    "QA" "Defect" "2", "planned": "SF6 falls by 0.02 MPa a month, leak at the flange of pole L2";
    "QA" "Defect" "1", "in progress": "Closing coil open, the breaker cannot be closed from remote";
    "QA" "Defect" "3", "planned": "Spring takes 19 s to charge instead of 15 s";
    "QA" "Work order" "", "planned": "Overhaul of the operating mechanism after 2,000 operations";
    "QA" "Inspection" "", "planned": "Timing, travel and contact resistance";
    "QB" "Defect" "2", "planned": "Contact 22 K above the other poles in thermography";
    "QB" "Defect" "3", "planned": "Motor drive stiff, took 14 s instead of 9 s";
    "QB" "Work order" "", "planned": "Clean and grease the contacts";
    "QB" "Inspection" "", "planned": "Thermography under load";
    "BC" "Defect" "2", "planned": "Oil below the mark, pole L1";
    "BC" "Inspection" "", "planned": "Loss factor and insulation resistance";
    "BV" "Defect" "3", "planned": "Terminal box without its seal";
    "BV" "Inspection" "", "planned": "Loss factor and ratio";
    "FA" "Defect" "2", "planned": "Resistive leakage current 0.35 mA, twice that of last year";
    "FA" "Inspection" "", "planned": "Leakage current under voltage";
    "TA" "Defect" "2", "planned": "Oil seeps at the valve of radiator 3, two drops a minute";
    "TA" "Defect" "1", "in progress": "Acetylene 3.2 uL/L where there was none, sample again";
    "TA" "Defect" "3", "planned": "Silica gel of the breather spent to two thirds";
    "TA" "Work order" "", "planned": "Replace the pump of cooler 2";
    "TA" "Inspection" "", "planned": "Oil sample, gases and moisture";
    "CA" "Defect" "3", "planned": "Unit 14 of bank swollen";
    "CA" "Inspection" "", "planned": "Capacitance of all units";
};

pub(super) const ASSETS: &[AssetTemplate] = &[
    AssetTemplate {
        code: "QA",
        made: [("Nordwind Switchgear", "NS-B 50"), ("Hexi Electric", "HE-B 4")],
        rating: "4000 A, 50 kA",
        criticality: "A",
    },
    AssetTemplate {
        code: "QB",
        made: [("Alpina Apparate", "AA-D 31"), ("Hexi Electric", "HE-D 3")],
        rating: "3150 A, 50 kA 3 s",
        criticality: "B",
    },
    AssetTemplate {
        code: "BC",
        made: [("Delta Instrument", "DI-C 1250"), ("Hexi Electric", "HE-C 2")],
        rating: "2 x 1250/1 A, 5P30",
        criticality: "B",
    },
    AssetTemplate {
        code: "BV",
        made: [("Delta Instrument", "DI-V 10"), ("Alpina Apparate", "AA-V 10")],
        rating: "10 nF, 0.2/3P",
        criticality: "C",
    },
    AssetTemplate {
        code: "FA",
        made: [("Nordwind Switchgear", "NS-A 10"), ("Alpina Apparate", "AA-A 10")],
        rating: "10 kA, class SM",
        criticality: "C",
    },
    AssetTemplate {
        code: "TA",
        made: [("Ostsee Transformers", "OT-180"), ("Hexi Electric", "HE-T 180")],
        rating: "180 MVA, ONAF, YNyn0d11",
        criticality: "A",
    },
    AssetTemplate {
        code: "CA",
        made: [("Delta Instrument", "DI-K 10"), ("Hexi Electric", "HE-K 10")],
        rating: "10 Mvar",
        criticality: "C",
    },
];
