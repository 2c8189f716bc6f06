//! Real recordings of a folder beside PyPI's `comtrade`: every value of every channel.
//!
//! ```text
//! BUSBAR_COMTRADE_FOLDER=/path BUSBAR_PYTHON=/path/to/python \
//!     cargo test -p replay recordings_of_a_folder -- --ignored --nocapture
//! ```

use std::collections::BTreeMap;
use std::process::Command;
use std::time::UNIX_EPOCH;

use super::*;
use crate::probe::{Bytes, play};

/// Least number of recordings of the folder that both readers have read.
const LEAST_COMPARED: usize = 40;
/// Largest configuration or data file that is compared, bytes.
const MAX_BYTES: u64 = 64 << 20;
/// Largest deviation of a value, as a share of the largest value of its channel: of rounding.
const MAX_DEVIATION: f64 = 1e-12;

/// A channel as it is played: times from the start in nanoseconds, where a skew does not put them
/// before it, and values.
type Channel = Vec<(Option<i64>, Option<f64>)>;

/// A recording as it is played.
struct Recording {
    analogs: Vec<Channel>,
    digitals: Vec<Channel>,
    /// Analogue channels that have no values, since their lines say nothing finite.
    is_faulty: Vec<bool>,
    /// Samples that the configuration says.
    said: u64,
}

/// Outcome of comparing a recording.
enum Outcome {
    /// Values, the worst deviation of a value and of a time in nanoseconds.
    Same {
        values: usize,
        value: f64,
        time: i64,
    },
    /// Only one of the readers reads it.
    OursAlone(String),
    TheirsAlone(String),
    NobodyReads(String),
    Differs(String),
}

#[test]
#[ignore = "it needs a folder of recordings, BUSBAR_COMTRADE_FOLDER, and the package comtrade"]
fn recordings_of_a_folder_have_the_values_that_the_package_reads() {
    let folder = std::env::var_os("BUSBAR_COMTRADE_FOLDER").expect("BUSBAR_COMTRADE_FOLDER is set");
    let mut files = Vec::new();
    collect(Path::new(&folder), &mut files);
    files.sort();
    let (mut same, mut values, mut worst, mut worst_time) = (0, 0, 0.0_f64, 0);
    let mut others: BTreeMap<&str, Vec<String>> = BTreeMap::new();
    for file in &files {
        let name = file.strip_prefix(&folder).unwrap_or(file).display().to_string();
        match compare(file) {
            Outcome::Same { values: count, value, time } => {
                (same, values) = (same + 1, values + count);
                worst = worst.max(value);
                worst_time = worst_time.max(time);
                if time > 1000 {
                    others.entry("times differ").or_default().push(format!("{name}: {time} ns"));
                }
            }
            Outcome::OursAlone(what) => {
                others.entry("read here alone").or_default().push(format!("{name}: {what}"));
            }
            Outcome::TheirsAlone(what) => {
                others.entry("read there alone").or_default().push(format!("{name}: {what}"));
            }
            Outcome::NobodyReads(what) => {
                others.entry("read by neither").or_default().push(format!("{name}: {what}"));
            }
            Outcome::Differs(what) => {
                others.entry("differ").or_default().push(format!("{name}: {what}"));
            }
        }
    }
    for (outcome, names) in &others {
        eprintln!("{outcome}: {}", names.len());
        names.iter().for_each(|name| eprintln!("    {name}"));
    }
    eprintln!(
        "{} recordings; {same} with the same {values} values, worst deviation {worst:e} of the \
         channel's largest value, {worst_time} ns of time",
        files.len()
    );
    assert!(!others.contains_key("differ") && !others.contains_key("read there alone"));
    assert!(same >= LEAST_COMPARED && worst <= MAX_DEVIATION);
}

fn collect(folder: &Path, files: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).expect("it is a folder").flatten() {
        let path = entry.path();
        let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
        match extension.as_deref() {
            _ if path.is_dir() => collect(&path, files),
            // A file without data is one that did not come along.
            Some("cfg") if data_of(&path).is_some_and(|data| has_bytes(&data)) => files.push(path),
            Some("cff") => files.push(path),
            _ => {}
        }
    }
}

fn has_bytes(path: &Path) -> bool {
    std::fs::metadata(path).is_ok_and(|metadata| metadata.len() > 0)
}

fn data_of(cfg: &Path) -> Option<PathBuf> {
    ["dat", "DAT", "Dat"].map(|e| cfg.with_extension(e)).into_iter().find(|path| path.is_file())
}

fn compare(file: &Path) -> Outcome {
    let python = std::env::var_os("BUSBAR_PYTHON").expect("BUSBAR_PYTHON is set");
    let script = include_str!("read_recording.py");
    let output = Command::new(python).arg("-c").arg(script).arg(file).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let theirs: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let ours = read(file);
    let fault = theirs["fault"].as_str();
    let Recording { analogs, digitals, is_faulty, said } = match (ours, fault) {
        (Ok(ours), None) => ours,
        (Ok(_), Some(fault)) => return Outcome::OursAlone(fault.into()),
        (Err(ours), None) => return Outcome::TheirsAlone(ours),
        (Err(ours), Some(fault)) => return Outcome::NobodyReads(format!("{ours} / {fault}")),
    };
    let times: Vec<f64> =
        theirs["time"].as_array().unwrap().iter().map(|t| t.as_f64().unwrap_or(0.0)).collect();
    let (mut count, mut worst, mut worst_time) = (0, 0.0_f64, 0);
    for (kind, channels) in [("analog", &analogs), ("status", &digitals)] {
        let their_channels = theirs[kind].as_array().unwrap();
        if their_channels.len() != channels.len() {
            return Outcome::Differs(format!(
                "{} and {} {kind} channels",
                channels.len(),
                their_channels.len()
            ));
        }
        for (number, (ours, theirs)) in channels.iter().zip(their_channels).enumerate() {
            let theirs: Vec<Option<f64>> =
                theirs.as_array().unwrap().iter().map(serde_json::Value::as_f64).collect();
            let at = |sample: usize| format!("{kind} {} sample {sample}", number + 1);
            // A channel of which the configuration says nothing finite has no values here.
            if is_faulty.get(number).is_some_and(|is| *is && kind == "analog") {
                continue;
            }
            // The package makes as many values of a file as its configuration says.
            let is_as_said = theirs.len() as u64 == said && !ours.is_empty();
            if ours.len() != theirs.len() && !is_as_said {
                return Outcome::Differs(format!(
                    "{}: {} and {} values",
                    at(0),
                    ours.len(),
                    theirs.len()
                ));
            }
            let largest = theirs.iter().flatten().fold(0.0_f64, |most, v| most.max(v.abs()));
            for (sample, ((nanos, ours), theirs)) in ours.iter().zip(&theirs).enumerate() {
                match (ours, theirs) {
                    (Some(a), Some(b)) => worst = worst.max((a - b).abs() / largest.max(1e-300)),
                    (None, None) => {}
                    _ => {
                        return Outcome::Differs(format!(
                            "{}: {ours:?} and {theirs:?}",
                            at(sample)
                        ));
                    }
                }
                if worst > MAX_DEVIATION {
                    return Outcome::Differs(format!("{}: {ours:?} and {theirs:?}", at(sample)));
                }
                // From the first sample on: the package counts it by its number, which may be 0.
                let their_nanos = ((times[sample] - times[0]) * 1e9).round() as i64;
                if let Some(nanos) = nanos {
                    worst_time = worst_time.max((nanos - their_nanos).abs());
                }
                count += 1;
            }
        }
    }
    Outcome::Same { values: count, value: worst, time: worst_time }
}

/// All analogue and digital channels of a recording, as the plugin plays them.
fn read(file: &Path) -> Result<Recording, String> {
    let load = |path: &Path| -> Result<Vec<u8>, String> {
        let bytes = std::fs::metadata(path).map_err(|error| error.to_string())?.len();
        if bytes > MAX_BYTES {
            return Err(format!("{bytes} bytes"));
        }
        std::fs::read(path).map_err(|error| error.to_string())
    };
    let is_single = file.extension().is_some_and(|e| e.eq_ignore_ascii_case("cff"));
    let text = load(file)?;
    let cfg = if is_single {
        crate::comtrade::Cff::find(std::io::Cursor::new(&text)).map_err(|f| f.to_string())?.cfg
    } else {
        text.clone()
    };
    let cfg = crate::comtrade::Cfg::parse(&cfg).map_err(|fault| fault.to_string())?;
    let (analogs, digitals) = (cfg.analogs.len(), cfg.digitals.len());
    let tag = |index: usize| {
        let (kind, number) = match index.checked_sub(analogs) {
            None => (ValueKind::F64, index + 1),
            Some(digital) => (ValueKind::Bool, digital + 1),
        };
        // Skews are not in the package's times.
        tag_spec(index as u32, &format!("{kind:?} {number}"), kind, json!({"channel": number}))
    };
    let is_faulty: Vec<bool> = cfg.analogs.iter().map(|channel| channel.fault.is_some()).collect();
    let has_values = |index: &usize| !is_faulty.get(*index).copied().unwrap_or(false);
    let tags: Vec<TagSpec> = (0..analogs + digitals).filter(has_values).map(tag).collect();
    let bytes = if is_single {
        Bytes::Cff(text)
    } else {
        Bytes::Comtrade(text, load(&data_of(file).ok_or("there is no data file")?)?)
    };
    let mut channels = vec![Channel::new(); analogs + digitals];
    let settings = json!({"file": "/a.cfg", "max_updates_per_second": 0});
    let settings: Settings = serde_json::from_value(settings).unwrap();
    let keep = |samples: &[Sample]| {
        for sample in samples {
            let since = sample.source_time.and_then(|time| time.duration_since(UNIX_EPOCH).ok());
            let nanos = since.map(|since| since.as_nanos() as i64);
            let skew = cfg.analogs.get(sample.tag as usize).map_or(0, |channel| channel.skew_nanos);
            let value = sample.value.as_ref().map(|value| match value {
                Value::F64(value) => *value,
                Value::Bool(value) => f64::from(u8::from(*value)),
                other => panic!("{other:?}"),
            });
            channels[sample.tag as usize].push((nanos.map(|nanos| nanos - skew), value));
        }
    };
    play(settings, &tags, bytes, keep).map_err(|error| error.message().to_owned())?;
    let digitals = channels.split_off(analogs);
    Ok(Recording { analogs: channels, digitals, is_faulty, said: cfg.samples })
}
