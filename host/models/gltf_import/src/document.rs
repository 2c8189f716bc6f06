//! JSON text to the document: lists of elements that are parsed when somebody uses them.
//!
//! `{},` takes three bytes in the file and some hundred once parsed. So an element is kept as its
//! text, and nothing that is not shown can be at fault.

use std::borrow::Cow;
use std::fmt;

use serde::de::{DeserializeSeed, Deserializer, Error, IgnoredAny, MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, de};
use serde_json::value::RawValue;
use serde_path_to_error::Segment;

use crate::ImportLimits;
use crate::error::{ImportError, ImportFault};
use crate::json_text;
use crate::limits::{MAX_JSON_BYTES, MAX_JSON_MEMORY, MAX_NAME_BYTES};
use crate::report::Notes;
use crate::required_extensions;
use crate::scalars::{Text, Whole};

/// Elements of a top-level list, as text.
#[derive(Default)]
pub(crate) struct Elements<'a> {
    /// Name of the list in the file.
    name: &'static str,
    /// Kind of one element, for messages.
    what: &'static str,
    items: Vec<&'a RawValue>,
    text: &'a str,
}

/// Lists of a glTF file whose elements may be shown.
pub(crate) struct Document<'a> {
    pub(crate) accessors: Elements<'a>,
    pub(crate) buffer_views: Elements<'a>,
    pub(crate) buffers: Elements<'a>,
    pub(crate) images: Elements<'a>,
    pub(crate) materials: Elements<'a>,
    pub(crate) meshes: Elements<'a>,
    pub(crate) nodes: Elements<'a>,
    pub(crate) samplers: Elements<'a>,
    pub(crate) scenes: Elements<'a>,
    pub(crate) skins: Elements<'a>,
    pub(crate) textures: Elements<'a>,
    /// Index of the scene that is shown by default.
    pub(crate) scene: Option<Whole>,
    extensions: Option<&'a RawValue>,
    text: &'a str,
}

impl<'a> Elements<'a> {
    pub(crate) fn len(&self) -> usize {
        self.items.len()
    }

    /// Checks that an element exists; `named_by` is the place that names it.
    pub(crate) fn require(
        &self,
        index: usize,
        named_by: impl FnOnce() -> String,
    ) -> Result<&'a RawValue, ImportError> {
        let count = self.items.len();
        let what = self.what;
        let beyond = || ImportFault::Index { what, index, count }.at(named_by());
        self.items.get(index).copied().ok_or_else(beyond)
    }

    /// Parses an element; `named_by` is the place that names it.
    pub(crate) fn parse<T: Deserialize<'a>>(
        &self,
        index: usize,
        named_by: impl FnOnce() -> String,
    ) -> Result<T, ImportError> {
        let element = self.require(index, named_by)?;
        parse_part(element, self.text, || format!("/{}/{index}", self.name))
    }
}

impl<'a> Document<'a> {
    /// Parses the root's extensions; `None` without any.
    pub(crate) fn extensions<T: Deserialize<'a>>(&self) -> Result<Option<T>, ImportError> {
        let parse = |raw| parse_part(raw, self.text, || "/extensions".into());
        self.extensions.map(parse).transpose()
    }

    /// Parses a part of the document, such as a primitive of a mesh.
    pub(crate) fn parse<T: Deserialize<'a>>(
        &self,
        part: &'a RawValue,
        place: impl FnOnce() -> String,
    ) -> Result<T, ImportError> {
        parse_part(part, self.text, place)
    }

    /// Returns the document's text.
    pub(crate) fn text(&self) -> &'a str {
        self.text
    }
}

/// Parses a part of the text, at a place.
fn parse_part<'a, T: Deserialize<'a>>(
    part: &'a RawValue,
    text: &str,
    place: impl FnOnce() -> String,
) -> Result<T, ImportError> {
    // Paths are followed where there is a fault to name alone: that takes as long again.
    if let Ok(parsed) = serde_json::from_str(part.get()) {
        return Ok(parsed);
    }
    let parser = &mut serde_json::Deserializer::from_str(part.get());
    serde_path_to_error::deserialize(parser).map_err(|error: serde_path_to_error::Error<_>| {
        let offset = (part.get().as_ptr() as usize).saturating_sub(text.as_ptr() as usize);
        let before = text.as_bytes().get(..offset).unwrap_or_default();
        json_fault(error.inner(), before).at(place() + &pointer(error.path()))
    })
}

/// Converts an error of the JSON parser to a fault; `before` is the text before the parsed part.
fn json_fault(error: &serde_json::Error, before: &[u8]) -> ImportFault {
    let (mut line, mut column) = (error.line(), error.column());
    if line <= 1 {
        column += before.iter().rev().take_while(|&&byte| byte != b'\n').count();
    }
    line += before.iter().filter(|&&byte| byte == b'\n').count();
    let mut reason = error.to_string();
    // The position is said once, by the fault.
    if let Some(at) = reason.rfind(" at line ") {
        reason.truncate(at);
    }
    ImportFault::Json { line, column, reason: shortened(&reason) }
}

/// Escapes one step of a JSON pointer (RFC 6901) and shortens it.
pub(crate) fn pointer_step(step: &str) -> String {
    let end = step.floor_char_boundary(MAX_NAME_BYTES);
    step[..end].replace('~', "~0").replace('/', "~1")
}

/// Shortens a text from the file for a message; it has no line ends.
pub(crate) fn shortened(text: &str) -> String {
    let end = text.floor_char_boundary(MAX_NAME_BYTES);
    let dots = if end < text.len() { "..." } else { "" };
    let line = text[..end].replace(char::is_control, " ");
    format!("{line}{dots}")
}

/// Returns the place where a parser stopped, as a JSON pointer.
fn pointer(path: &serde_path_to_error::Path) -> String {
    let steps = path.iter().filter_map(|segment| match segment {
        Segment::Seq { index } => Some(format!("/{index}")),
        Segment::Map { key } => Some(format!("/{}", pointer_step(key))),
        Segment::Enum { .. } | Segment::Unknown => None,
    });
    steps.collect()
}

const TOP: &str = "the top of the JSON";

/// Decodes the text of the JSON. `parse` borrows from it.
pub(crate) fn text<'a>(json: &'a [u8], notes: &mut Notes) -> Result<Cow<'a, str>, ImportError> {
    let count = json.len() as u64;
    if count > MAX_JSON_BYTES {
        let limit = MAX_JSON_BYTES;
        let fault = ImportFault::TooMany { what: "bytes of JSON", count, limit };
        return Err(fault.at("the whole file"));
    }
    let text = json_text::decode(json, notes);
    // Syntax alone, without building anything.
    if serde_json::from_str::<IgnoredAny>(&text).is_ok() {
        return Ok(text);
    }
    match json_text::relaxed(&text) {
        Some(strict) if serde_json::from_str::<IgnoredAny>(&strict).is_ok() => {
            notes.add("JSON with comments, trailing commas or NaN: read without them");
            Ok(Cow::Owned(strict))
        }
        _ => Ok(text),
    }
}

/// Parses the text of the JSON, and checks version and extensions.
pub(crate) fn parse<'a>(
    text: &'a str,
    limits: &ImportLimits,
    notes: &mut Notes,
) -> Result<Document<'a>, ImportError> {
    let parser = &mut serde_json::Deserializer::from_str(text);
    let root: Root<'a> = serde_path_to_error::deserialize(&mut *parser).map_err(
        |error: serde_path_to_error::Error<_>| {
            let place = pointer(error.path());
            json_fault(error.inner(), b"").at(if place.is_empty() { TOP.into() } else { place })
        },
    )?;
    parser.end().map_err(|error| json_fault(&error, b"").at(TOP))?;
    check_version(&root, text, notes)?;
    let mut budget =
        Budget { used: 0, limit: MAX_JSON_MEMORY + 2 * text.len() as u64, fault: None };
    let max_nodes = u64::from(limits.max_nodes);
    let mut elements = |name, what| root.elements(name, what, text, &mut budget, max_nodes);
    let mut document = Document {
        accessors: elements("accessors", "accessor")?,
        buffer_views: elements("bufferViews", "buffer view")?,
        buffers: elements("buffers", "buffer")?,
        images: elements("images", "image")?,
        materials: elements("materials", "material")?,
        meshes: elements("meshes", "mesh")?,
        nodes: elements("nodes", "node")?,
        samplers: elements("samplers", "sampler")?,
        scenes: elements("scenes", "scene")?,
        skins: Elements::default(),
        textures: elements("textures", "texture")?,
        scene: match root.get("scene") {
            None => None,
            Some(raw) => parse_part(raw, text, || "/scene".into())?,
        },
        extensions: root.get("extensions"),
        text,
    };
    let mut names = |name| root.elements(name, "extension", text, &mut budget, max_nodes);
    let (used, required) = (names("extensionsUsed")?, names("extensionsRequired")?);
    required_extensions::check(&required, &used, notes)?;
    for (name, what) in [("animations", "animation"), ("cameras", "camera"), ("skins", "skin")] {
        // Shapes can be shown without them: a list that is none is no fault.
        match root.elements(name, what, text, &mut budget, max_nodes) {
            Ok(skins) if name == "skins" => document.skins = skins,
            Ok(skipped) => notes.add_many(format!("{what} skipped"), skipped.len()),
            Err(error) if matches!(error.fault, ImportFault::TooMany { .. }) => return Err(error),
            Err(_) => notes.add(format!("list '{name}' skipped: it cannot be read")),
        }
    }
    Ok(document)
}

/// Members of the root that are read, as text.
struct Root<'a>(Vec<(&'static str, &'a RawValue)>);

const MEMBERS: [&str; 18] = [
    "accessors",
    "animations",
    "asset",
    "bufferViews",
    "buffers",
    "cameras",
    "extensions",
    "extensionsRequired",
    "extensionsUsed",
    "images",
    "materials",
    "meshes",
    "nodes",
    "samplers",
    "scene",
    "scenes",
    "skins",
    "textures",
];

struct RootVisitor;

impl<'de> Visitor<'de> for RootVisitor {
    type Value = Root<'de>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("an object")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Root<'de>, A::Error> {
        let mut root = Root(Vec::with_capacity(MEMBERS.len()));
        while let Some(key) = map.next_key::<Cow<'de, str>>()? {
            let Some(&name) = MEMBERS.iter().find(|&&name| name == key) else {
                map.next_value::<IgnoredAny>()?;
                continue;
            };
            if root.get(name).is_some() {
                return Err(A::Error::duplicate_field(name));
            }
            root.0.push((name, map.next_value()?));
        }
        Ok(root)
    }
}

impl<'de> Deserialize<'de> for Root<'de> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_map(RootVisitor)
    }
}

impl<'a> Root<'a> {
    fn get(&self, name: &str) -> Option<&'a RawValue> {
        let member = self.0.iter().find(|(known, _)| *known == name)?;
        Some(member.1)
    }

    /// Splits a list into its elements. A list that is missing or `null` is empty.
    fn elements(
        &self,
        name: &'static str,
        what: &'static str,
        text: &'a str,
        budget: &mut Budget,
        max_nodes: u64,
    ) -> Result<Elements<'a>, ImportError> {
        let mut elements = Elements { name, what, items: Vec::new(), text };
        let Some(raw) = self.get(name).filter(|raw| raw.get() != "null") else {
            return Ok(elements);
        };
        let limit = if name == "nodes" { max_nodes } else { u64::MAX };
        let parser = &mut serde_json::Deserializer::from_str(raw.get());
        let seed = Split { items: &mut elements.items, budget: &mut *budget, limit };
        let split = seed.deserialize(parser);
        let index = elements.items.len();
        match (split, budget.fault.take()) {
            (Ok(()), _) => Ok(elements),
            (Err(_), Some(fault)) => Err(fault.at(format!("/{name}/{index}"))),
            (Err(error), None) => {
                let offset = raw.get().as_ptr() as usize - text.as_ptr() as usize;
                Err(json_fault(&error, &text.as_bytes()[..offset]).at(format!("/{name}")))
            }
        }
    }
}

/// Memory of the elements' places, bytes.
struct Budget {
    used: u64,
    limit: u64,
    fault: Option<ImportFault>,
}

/// Bytes of an element's place, in a vector that holds up to twice its elements.
const ELEMENT_BYTES: u64 = 2 * size_of::<&RawValue>() as u64;

/// Splits a list into the texts of its elements.
struct Split<'s, 'a> {
    items: &'s mut Vec<&'a RawValue>,
    budget: &'s mut Budget,
    limit: u64,
}

impl<'de> DeserializeSeed<'de> for Split<'_, 'de> {
    type Value = ();

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<(), D::Error> {
        deserializer.deserialize_seq(self)
    }
}

impl<'de> Visitor<'de> for Split<'_, 'de> {
    type Value = ();

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a list")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<(), A::Error> {
        while let Some(item) = seq.next_element()? {
            let budget = &mut *self.budget;
            budget.used += ELEMENT_BYTES;
            let (used, count) = (budget.used, self.items.len() as u64 + 1);
            let fault = if count > self.limit {
                Some(ImportFault::TooMany { what: "nodes", count, limit: self.limit })
            } else if used > budget.limit {
                let what = "bytes of parsed JSON";
                Some(ImportFault::TooMany { what, count: used, limit: budget.limit })
            } else {
                None
            };
            if fault.is_some() {
                budget.fault = fault;
                return Err(A::Error::custom("refused"));
            }
            self.items.push(item);
        }
        Ok(())
    }
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase", expecting = "an object")]
struct Asset<'a> {
    #[serde(borrow, default)]
    version: Option<Version<'a>>,
    #[serde(borrow, default)]
    min_version: Option<Version<'a>>,
}

/// A version as text or, as some exporters have it, as a number.
struct Version<'a>(Cow<'a, str>);

impl<'de: 'a, 'a> Deserialize<'de> for Version<'a> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let raw = <&'de RawValue>::deserialize(deserializer)?;
        match serde_json::from_str::<Text<'a>>(raw.get()) {
            Ok(Text(Some(text))) => Ok(Self(text)),
            _ if raw.get().starts_with(|c: char| c.is_ascii_digit()) => {
                Ok(Self(Cow::Borrowed(raw.get())))
            }
            _ => Err(de::Error::custom("a version such as \"2.0\" is expected")),
        }
    }
}

impl Version<'_> {
    /// Returns major and minor number; `None` where there is no major one.
    fn numbers(&self) -> Option<(u32, u32)> {
        let mut parts = self.0.trim().split('.');
        let major = parts.next()?.parse().ok()?;
        Some((major, parts.next().and_then(|minor| minor.parse().ok()).unwrap_or(0)))
    }
}

/// Major version that is read.
const MAJOR: u32 = 2;

fn check_version(root: &Root<'_>, text: &str, notes: &mut Notes) -> Result<(), ImportError> {
    let Some(asset) = root.get("asset") else {
        let is_list = |name| root.get(name).is_none_or(|raw| raw.get().starts_with('['));
        if !["meshes", "nodes", "buffers"].into_iter().all(is_list) {
            return Err(ImportFault::Version("1.0".into()).at("/meshes"));
        }
        let fault = ImportFault::Invalid("there is no asset, which names the version".into());
        return Err(fault.at(TOP));
    };
    let asset: Asset<'_> = parse_part(asset, text, || "/asset".into())?;
    let place = "/asset/version";
    let Some(version) = &asset.version else {
        return Err(ImportFault::Invalid("no version is given".into()).at(place));
    };
    let major = |version: &Version<'_>| version.numbers().map(|(major, _)| major);
    let required = asset.min_version.as_ref();
    let refused = [required, Some(version)].into_iter().flatten();
    if let Some(refused) = refused.into_iter().find(|version| major(version) != Some(MAJOR)) {
        return Err(ImportFault::Version(shortened(&refused.0)).at(place));
    }
    let newest = version.numbers().max(required.and_then(Version::numbers));
    if newest > Some((MAJOR, 0)) {
        notes.add("glTF version newer than 2.0: what only that one has is not shown");
    }
    Ok(())
}
