//! Names of both ends below MMS (IEC 61850-8-1, 6.2; SCL `ConnectedAP/Address`).

use busbar_link::SettingsFaults;
use iec61850_rs::proto::mms::association;
use schemars::JsonSchema;
use serde::Deserialize;

/// Longest selector of each layer (IEC 61850-6, `P` types of `Address`), bytes.
const MAX_T_BYTES: usize = 4;
const MAX_S_BYTES: usize = 8;
const MAX_P_BYTES: usize = 8;
/// Arcs of an AP title.
const MAX_ARCS: usize = 16;

/// OSI addresses of the server's and this client's access points.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub(crate) struct RawOsi {
    /// Selectors of the server.
    remote: RawSelectors,
    /// Selectors of this client.
    local: RawSelectors,
}

/// Selectors of one end, as an SCL file has them: hexadecimal.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
struct RawSelectors {
    /// Transport selector, OSI-TSEL, hexadecimal.
    t_selector: String,
    /// Session selector, OSI-SSEL, hexadecimal.
    s_selector: String,
    /// Presentation selector, OSI-PSEL, hexadecimal.
    p_selector: String,
    /// OSI-AP-Title, such as `1.1.1.999.1`.
    ap_title: Option<String>,
    /// Application entity qualifier, OSI-AE-Qualifier.
    ae_qualifier: Option<u16>,
}

impl Default for RawSelectors {
    fn default() -> Self {
        Self {
            t_selector: "0001".into(),
            s_selector: "0001".into(),
            p_selector: "00000001".into(),
            ap_title: None,
            ae_qualifier: None,
        }
    }
}

/// The names of both ends.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Selectors {
    pub(crate) remote: association::Selectors,
    pub(crate) local: association::Selectors,
}

impl RawOsi {
    /// Checks the setting `osi`.
    pub(crate) fn parse(&self, faults: &mut SettingsFaults) -> Selectors {
        Selectors {
            remote: self.remote.parse("osi.remote", faults),
            local: self.local.parse("osi.local", faults),
        }
    }
}

impl RawSelectors {
    fn parse(&self, place: &str, faults: &mut SettingsFaults) -> association::Selectors {
        let mut selector = |name: &str, text: &str, max: usize| {
            bytes_of(text).filter(|bytes| bytes.len() <= max).unwrap_or_else(|| {
                faults.add(format!(
                    "{place}.{name}: '{text}' is not hexadecimal of at most {max} bytes, such as \
                     \"0001\""
                ));
                Vec::new()
            })
        };
        let t_sel = selector("t_selector", &self.t_selector, MAX_T_BYTES);
        let s_sel = selector("s_selector", &self.s_selector, MAX_S_BYTES);
        let p_sel = selector("p_selector", &self.p_selector, MAX_P_BYTES);
        let ap_title = self.ap_title.as_ref().map(|text| {
            arcs_of(text).unwrap_or_else(|| {
                faults.add(format!(
                    "{place}.ap_title: '{text}' is no object identifier, such as \"1.1.1.999.1\""
                ));
                Vec::new()
            })
        });
        let ae_qualifier = self.ae_qualifier.map(i64::from);
        association::Selectors { t_sel, s_sel, p_sel, ap_title, ae_qualifier }
    }
}

fn bytes_of(text: &str) -> Option<Vec<u8>> {
    let digits: Vec<u8> =
        text.chars().map(|c| c.to_digit(16).map(|d| d as u8)).collect::<Option<_>>()?;
    let (pairs, rest) = digits.as_chunks::<2>();
    rest.is_empty().then(|| pairs.iter().map(|[high, low]| high << 4 | low).collect())
}

/// Numbers of an object identifier that can be encoded (ITU-T X.660: the first arc is at
/// most 2, the second below 40 where the first is not 2).
fn arcs_of(text: &str) -> Option<Vec<u32>> {
    let arcs: Vec<u32> = text.split('.').map(|arc| arc.parse().ok()).collect::<Option<_>>()?;
    let is_sound = match arcs[..] {
        [0 | 1, second, ..] => second < 40,
        [2, second, ..] => second < 1 << 16,
        _ => false,
    };
    (is_sound && arcs.len() <= MAX_ARCS).then_some(arcs)
}
