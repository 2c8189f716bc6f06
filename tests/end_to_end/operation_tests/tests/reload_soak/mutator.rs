//! Seeded edits of configurations as people and programs make them, good and bad.

use serde_json::{Map, Value, json};

/// Greatest number of bytes of a text that are cut or overwritten at once.
const MAX_DAMAGE: usize = 64;

/// Random number generator (SplitMix64).
pub(crate) struct Random(u64);

impl Random {
    pub(crate) fn new(seed: u64) -> Self {
        Self(seed)
    }

    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut mixed = self.0;
        mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        mixed ^ (mixed >> 31)
    }

    /// Returns a random number below a limit.
    fn below(&mut self, limit: usize) -> usize {
        (self.next() % limit.max(1) as u64) as usize
    }

    fn among<'a, T>(&mut self, all: &'a [T]) -> &'a T {
        &all[self.below(all.len())]
    }
}

/// Returns the text of a configuration after an edit of this one.
pub(crate) fn mutated(config: &Value, random: &mut Random) -> String {
    let mut config = config.clone();
    match random.below(10) {
        // Often what has a meaning.
        0..4 => edit(&mut config, random),
        4..8 => (0..=random.below(3)).for_each(|_| break_a_value(&mut config, random)),
        _ => {
            edit(&mut config, random);
            return damaged(&config.to_string(), random);
        }
    }
    match random.below(2) {
        0 => config.to_string(),
        _ => serde_json::to_string_pretty(&config).expect("values are JSON"),
    }
}

/// Edits the configuration as an integrator would.
fn edit(config: &mut Value, random: &mut Random) {
    let number = random.below(1000);
    let tag = name_in(config, "tags", random);
    match random.below(14) {
        0 => config["theme"]["background"] = json!(format!("#{:06x}", random.below(1 << 24))),
        1 => config["tags"][&tag]["name"] = json!(format!("Name {number}")),
        2 => config["tags"][&tag]["limits"] = json!({ "high": number }),
        3 => config["tags"][&tag]["freshness_seconds"] = json!(3 + number),
        4 => {
            let formula = json!({ "type": "f64", "expression": format!("{{{tag}}} + {number}") });
            config["tags"][format!("{number} derived")] = formula;
        }
        5 => config["alarms"]["Oil"]["condition"]["high"] = json!(number as f64 / 10.0),
        6 => {
            let alarm =
                json!({ "tag": tag, "condition": { "bad_quality": true }, "message": "Bad" });
            config["alarms"][format!("Alarm {number}")] = alarm;
        }
        7 => drop(remove_one(config, "bindings", random)),
        8 => drop(remove_one(config, "overlays", random)),
        9 => {
            let at = json!({ "translation": [number % 40, 0, number / 40] });
            let node = json!({ "id": format!("=N{number}"), "model": "breaker", "transform": at });
            config["scene"].as_array_mut().expect("a list").insert(0, node);
        }
        10 => config["models"]["breaker"]["theta"] = json!(number as f64 / 1000.0),
        11 => {
            config["plugins"]["bay"]["settings"]["poll_seconds"] =
                json!((100 + number) as f64 / 1_000.0)
        }
        12 => config["theme"]["colors"] = json!(*random.among(&["light", "dark"])),
        _ => {
            let camera = json!({ "eye": [number % 30 + 5, 5, 12], "target": [0, 1, 0] });
            config["cameras"]["bay"] = camera;
        }
    }
}

fn name_in(config: &Value, section: &str, random: &mut Random) -> String {
    let names: Vec<&String> = config[section].as_object().expect("an object").keys().collect();
    (*random.among(&names)).clone()
}

fn remove_one(config: &mut Value, section: &str, random: &mut Random) -> Value {
    let list = config[section].as_array_mut().expect("a list");
    let index = random.below(list.len());
    list.remove(index)
}

/// Changes a value so that a schema, a rule or a plugin mostly refuses it.
fn break_a_value(config: &mut Value, random: &mut Random) {
    let mut pointers = Vec::new();
    collect(config, String::new(), &mut pointers);
    let pointer = random.among(&pointers).clone();
    let elsewhere = random.among(&pointers).clone();
    let other = config.pointer(&elsewhere).cloned().unwrap_or_default();
    let Some(value) = config.pointer_mut(&pointer) else { return };
    match (random.below(7), value) {
        // Of an object or a list something goes, comes twice, or is called otherwise.
        (0 | 1, Value::Object(map)) if !map.is_empty() => {
            let key = nth_key(map, random);
            map.remove(&key);
        }
        (2 | 3, Value::Object(map)) if !map.is_empty() => {
            let key = nth_key(map, random);
            let value = map.remove(&key).unwrap_or_default();
            map.insert(format!("{key}x"), value);
        }
        (0..2, Value::Array(list)) if !list.is_empty() => {
            let index = random.below(list.len());
            list.remove(index);
        }
        (2..4, Value::Array(list)) if !list.is_empty() => {
            let twice = random.among(list).clone();
            list.push(twice);
        }
        (0, Value::String(text)) => text.push('x'),
        (1, Value::String(text)) => *text = "x".repeat(random.below(5000)),
        (0..4, value @ Value::Number(_)) => {
            let odd =
                [json!(-1), json!(0), json!(1e300), json!(u64::MAX), json!(0.5), json!(1e-300)];
            *value = random.among(&odd).clone();
        }
        (4, value) => *value = Value::Null,
        (5, value) => *value = other,
        (_, value) => {
            let odd = [json!(true), json!([]), json!({}), json!("x"), json!(7), json!([[[]]])];
            *value = random.among(&odd).clone();
        }
    }
}

fn nth_key(map: &Map<String, Value>, random: &mut Random) -> String {
    map.keys().nth(random.below(map.len())).cloned().unwrap_or_default()
}

/// Collects the pointers of all values below the root.
fn collect(value: &Value, pointer: String, pointers: &mut Vec<String>) {
    if !pointer.is_empty() {
        pointers.push(pointer.clone());
    }
    match value {
        Value::Object(map) => map.iter().for_each(|(key, value)| {
            let key = key.replace('~', "~0").replace('/', "~1");
            collect(value, format!("{pointer}/{key}"), pointers);
        }),
        Value::Array(list) => list.iter().enumerate().for_each(|(index, value)| {
            collect(value, format!("{pointer}/{index}"), pointers);
        }),
        _ => {}
    }
}

/// Damages a text: cut off, or overwritten in a place.
fn damaged(text: &str, random: &mut Random) -> String {
    let mut bytes = text.as_bytes().to_vec();
    let at = random.below(bytes.len());
    match random.below(4) {
        0 => bytes.truncate(at),
        1 => drop(bytes.drain(at..(at + random.below(MAX_DAMAGE)).min(text.len()))),
        2 => bytes.insert(at, *random.among(b"{}[]\",:0e-\\\0\x7f")),
        _ => bytes[at] ^= 1 << random.below(7),
    }
    String::from_utf8_lossy(&bytes).into_owned()
}
