//! Cost scan of the JSON: a first pass that builds nothing and bounds what the second one will
//! build.
//!
//! `{},` takes three bytes in the file and some three hundred as a node of
//! `gltf::json`, and that crate reads indices modulo 2^32. So before it parses,
//! every element is charged with what it will become, and every number is
//! checked.

use std::borrow::Cow;
use std::fmt;

use gltf::json;
use serde::de::{DeserializeSeed, Deserializer, Error, IgnoredAny, MapAccess, SeqAccess, Visitor};

use crate::ImportLimits;
use crate::error::{ImportError, ImportFault};
use crate::extensions;
use crate::limits::{MAX_JSON_DEPTH, MAX_JSON_MEMORY, MAX_NAME_BYTES};

/// Memory cost of the parsed elements of a top-level array, bytes.
struct ParseCost {
    name: &'static str,
    element: usize,
    nested_object: usize,
    nested_scalar: usize,
}

const fn section(
    name: &'static str,
    element: usize,
    nested_object: usize,
    nested_scalar: usize,
) -> ParseCost {
    ParseCost { name, element, nested_object, nested_scalar }
}

/// Returns the greatest memory of a growing vector, which holds up to twice its elements.
const fn vec_bytes<T>() -> usize {
    2 * size_of::<T>()
}

/// A B-tree leaf, allocated whole for a primitive's first attribute.
const ATTRIBUTES_BYTES: usize = 400;

const SECTIONS: &[ParseCost] = &[
    section("accessors", vec_bytes::<json::Accessor>(), 0, vec_bytes::<json::Value>()),
    section(
        "animations",
        vec_bytes::<json::Animation>(),
        vec_bytes::<json::animation::Sampler>(),
        8,
    ),
    section("bufferViews", vec_bytes::<json::buffer::View>(), 0, 0),
    section("buffers", vec_bytes::<json::Buffer>(), 0, 0),
    section("cameras", vec_bytes::<json::Camera>(), 0, 0),
    section("extensionsRequired", vec_bytes::<String>(), 0, 0),
    section("extensionsUsed", vec_bytes::<String>(), 0, 0),
    section("images", vec_bytes::<json::Image>(), 0, 0),
    section("materials", vec_bytes::<json::Material>(), 0, 0),
    section(
        "meshes",
        vec_bytes::<json::Mesh>() + vec_bytes::<extensions::Mesh>(),
        // An object below a mesh is a primitive, its attributes, or a morph target.
        max(vec_bytes::<json::mesh::Primitive>(), ATTRIBUTES_BYTES)
            + vec_bytes::<extensions::Primitive>(),
        16,
    ),
    section("nodes", vec_bytes::<json::Node>(), 0, 8),
    section("samplers", vec_bytes::<json::texture::Sampler>(), 0, 0),
    section("scenes", vec_bytes::<json::Scene>(), 0, 8),
    section("skins", vec_bytes::<json::Skin>(), 0, 8),
    section("textures", vec_bytes::<json::Texture>(), 0, 0),
];

const fn max(a: usize, b: usize) -> usize {
    if a > b { a } else { b }
}

/// Bytes charged for each string beside its text.
const STRING_BYTES: usize = 16;

/// Refuses JSON that nests too deeply, holds too many nodes, would take too
/// much memory, or holds integers beyond 32 bits.
pub(crate) fn scan(json: &[u8], limits: &ImportLimits) -> Result<(), ImportError> {
    let mut scanner = Scanner {
        path: Vec::new(),
        section: None,
        memory: 0,
        memory_limit: MAX_JSON_MEMORY + 2 * json.len() as u64,
        max_nodes: limits.max_nodes.into(),
        fault: None,
    };
    let mut parser = serde_json::Deserializer::from_slice(json);
    let result = ValueSeed(&mut scanner).deserialize(&mut parser).and_then(|()| parser.end());
    match (result, scanner.fault.take()) {
        (Ok(()), _) => Ok(()),
        (Err(_), Some(fault)) => Err(fault.at(scanner.pointer())),
        (Err(error), None) => Err(json_fault(&error).at(scanner.pointer())),
    }
}

/// Converts an error of the JSON parser to a fault.
pub(crate) fn json_fault(error: &serde_json::Error) -> ImportFault {
    let (line, column) = (error.line(), error.column());
    let mut reason = error.to_string();
    // The position is said once, by the fault.
    if let Some(at) = reason.rfind(" at line ") {
        reason.truncate(at);
    }
    ImportFault::Json { line, column, reason }
}

/// Escapes one step of a JSON pointer (RFC 6901) and shortens it.
pub(crate) fn pointer_step(step: &str) -> String {
    let end = step.floor_char_boundary(MAX_NAME_BYTES);
    step[..end].replace('~', "~0").replace('/', "~1")
}

enum Step<'a> {
    Key(Cow<'a, str>),
    Index(usize),
}

struct Scanner<'a> {
    path: Vec<Step<'a>>,
    section: Option<&'static ParseCost>,
    memory: u64,
    memory_limit: u64,
    max_nodes: u64,
    fault: Option<ImportFault>,
}

impl<'a> Scanner<'a> {
    fn pointer(&self) -> String {
        if self.path.is_empty() {
            return "the top of the JSON".into();
        }
        let steps = self.path.iter().map(|step| match step {
            Step::Key(key) => format!("/{}", pointer_step(key)),
            Step::Index(index) => format!("/{index}"),
        });
        steps.collect()
    }

    fn refuse<E: Error>(&mut self, fault: ImportFault) -> E {
        self.fault = Some(fault);
        E::custom("refused")
    }

    fn charge<E: Error>(&mut self, bytes: usize) -> Result<(), E> {
        self.memory += bytes as u64;
        if self.memory > self.memory_limit {
            let (count, limit) = (self.memory, self.memory_limit);
            return Err(self.refuse(ImportFault::TooMany {
                what: "bytes of parsed JSON",
                count,
                limit,
            }));
        }
        Ok(())
    }

    /// Visits a number, `true`, `false` or `null`.
    fn scalar<E: Error>(&mut self) -> Result<(), E> {
        let nested = self.path.len() >= 4;
        let bytes = self.section.filter(|_| nested).map_or(0, |s| s.nested_scalar);
        self.charge(bytes)
    }

    fn integer<E: Error>(&mut self, value: u64) -> Result<(), E> {
        if value > u32::MAX.into() && !self.in_bounds() {
            return Err(self.refuse(ImportFault::HugeNumber(value)));
        }
        self.scalar()
    }

    fn text<E: Error>(&mut self, text: &str) -> Result<(), E> {
        self.only_numbers_in_bounds()?;
        self.charge(STRING_BYTES + text.len())
    }

    fn object<E: Error>(&mut self) -> Result<(), E> {
        self.only_numbers_in_bounds()?;
        let nested = self.path.len() >= 3;
        let bytes = self.section.filter(|_| nested).map_or(0, |s| s.nested_object);
        self.charge(bytes)
    }

    /// Reports whether the path is `/accessors/N/min...` or `max`.
    fn in_bounds(&self) -> bool {
        self.section.is_some_and(|s| s.name == "accessors")
            && matches!(self.path.get(2), Some(Step::Key(key)) if key == "min" || key == "max")
    }

    fn only_numbers_in_bounds<E: Error>(&mut self) -> Result<(), E> {
        if self.in_bounds() {
            return Err(self.refuse(ImportFault::Invalid("min and max hold numbers only".into())));
        }
        Ok(())
    }

    /// Visits an array element, before its content is read.
    fn element<E: Error>(&mut self, index: usize) -> Result<(), E> {
        if self.path.len() != 2 {
            return Ok(());
        }
        let Some(section) = self.section else {
            return Ok(());
        };
        let count = index as u64 + 1;
        if section.name == "nodes" && count > self.max_nodes {
            let limit = self.max_nodes;
            return Err(self.refuse(ImportFault::TooMany { what: "nodes", count, limit }));
        }
        self.charge(section.element)
    }
}

struct ValueSeed<'s, 'a>(&'s mut Scanner<'a>);

impl<'de> DeserializeSeed<'de> for ValueSeed<'_, 'de> {
    type Value = ();

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<(), D::Error> {
        if self.0.path.len() > MAX_JSON_DEPTH {
            return Err(self.0.refuse(ImportFault::JsonDepth));
        }
        deserializer.deserialize_any(self)
    }
}

impl<'de> Visitor<'de> for ValueSeed<'_, 'de> {
    type Value = ();

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("JSON")
    }

    fn visit_unit<E: Error>(self) -> Result<(), E> {
        self.0.scalar()
    }

    fn visit_bool<E: Error>(self, _: bool) -> Result<(), E> {
        self.0.scalar()
    }

    fn visit_i64<E: Error>(self, _: i64) -> Result<(), E> {
        self.0.scalar()
    }

    fn visit_f64<E: Error>(self, _: f64) -> Result<(), E> {
        self.0.scalar()
    }

    fn visit_u64<E: Error>(self, value: u64) -> Result<(), E> {
        self.0.integer(value)
    }

    fn visit_str<E: Error>(self, text: &str) -> Result<(), E> {
        self.0.text(text)
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<(), A::Error> {
        let scanner = self.0;
        let mut index = 0;
        loop {
            scanner.path.push(Step::Index(index));
            if seq.next_element_seed(ElementSeed(&mut *scanner, index))?.is_none() {
                scanner.path.pop();
                return Ok(());
            }
            scanner.path.pop();
            index += 1;
        }
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<(), A::Error> {
        let scanner = self.0;
        scanner.object()?;
        while let Some(key) = map.next_key_seed(KeySeed)? {
            let top = scanner.path.is_empty();
            if top {
                scanner.section = SECTIONS.iter().find(|s| s.name == key);
            }
            // The parser drops these without building anything.
            let dropped = key == "extras" || key == "extensions";
            let known = !top || scanner.section.is_some() || key == "asset" || key == "scene";
            scanner.path.push(Step::Key(key));
            if dropped || !known {
                map.next_value::<IgnoredAny>()?;
            } else {
                map.next_value_seed(ValueSeed(&mut *scanner))?;
            }
            scanner.path.pop();
        }
        Ok(())
    }
}

struct ElementSeed<'s, 'a>(&'s mut Scanner<'a>, usize);

impl<'de> DeserializeSeed<'de> for ElementSeed<'_, 'de> {
    type Value = ();

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<(), D::Error> {
        self.0.element(self.1)?;
        ValueSeed(self.0).deserialize(deserializer)
    }
}

/// Borrows a key from the text where it has no escapes.
struct KeySeed;

impl<'de> DeserializeSeed<'de> for KeySeed {
    type Value = Cow<'de, str>;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<Self::Value, D::Error> {
        deserializer.deserialize_str(self)
    }
}

impl<'de> Visitor<'de> for KeySeed {
    type Value = Cow<'de, str>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a key")
    }

    fn visit_borrowed_str<E: Error>(self, key: &'de str) -> Result<Self::Value, E> {
        Ok(Cow::Borrowed(key))
    }

    fn visit_str<E: Error>(self, key: &str) -> Result<Self::Value, E> {
        Ok(Cow::Owned(key.to_owned()))
    }
}
