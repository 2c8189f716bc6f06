//! Credentials by reference to an environment variable or a file.

use std::borrow::Cow;
use std::fmt;
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::{self, Deserializer, IgnoredAny, MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Serialize, Serializer};

use crate::Error;

/// Longest credential, in bytes.
pub const MAX_SECRET_BYTES: usize = 4096;
/// Longest name of a variable, and longest path, bytes.
const MAX_NAME_BYTES: usize = 128;
const MAX_PATH_BYTES: usize = 4096;
/// Bytes of a file that are read: one too many tells of more, two may be a line break.
const MAX_FILE_BYTES: u64 = MAX_SECRET_BYTES as u64 + 3;
/// Remedy for a credential that is written into the settings.
const REMEDY: &str = "a credential is not written here: write {\"env\": \"NAME\"} for an \
                      environment variable, or {\"file\": \"/absolute/path\"} for a file that only \
                      its owner can read";
/// Keyword of a schema with words that the host adds to a fault at that place.
const REMEDY_KEYWORD: &str = "x-busbar-remedy";

/// Reference to a credential, never the credential itself. A configuration with references can be
/// shown, copied and kept under version control.
///
/// In JSON it is `{"env": "NAME"}` or `{"file": "/absolute/path"}`. The host hands the
/// variable on to the process of the plugin whose settings name it, and to no other.
///
/// ```
/// use busbar_plugin_sdk::Secret;
///
/// #[derive(serde::Deserialize, schemars::JsonSchema)]
/// #[serde(deny_unknown_fields)]
/// struct Settings {
///     user: String,
///     /// The user's password.
///     password: Secret,
/// }
///
/// let text = r#"{"user": "viewer", "password": {"env": "NO_SUCH_VARIABLE"}}"#;
/// let settings: Settings = serde_json::from_str(text)?;
/// assert!(settings.password.read().unwrap_err().message().contains("NO_SUCH_VARIABLE"));
/// let text = r#"{"user": "viewer", "password": "pa55word"}"#;
/// let fault = serde_json::from_str::<Settings>(text).err().unwrap().to_string();
/// assert!(!fault.contains("pa55word") && fault.contains("\"env\""));
/// # Ok::<(), serde_json::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Secret(Source);

#[derive(Clone, Debug, PartialEq, Eq)]
enum Source {
    Variable(String),
    File(PathBuf),
}

/// Credential that only [`SecretText::reveal`] shows.
#[derive(Clone, PartialEq, Eq)]
pub struct SecretText(String);

impl SecretText {
    /// Returns the credential itself.
    pub fn reveal(&self) -> &str {
        &self.0
    }
}

impl fmt::Debug for SecretText {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("SecretText(..)")
    }
}

impl Secret {
    /// Reads the credential now, so that a replaced one is found. One line break at its end is left
    /// out.
    ///
    /// A file must be a plain file that nobody but its owner can read or write; one of
    /// root's may be readable by its group (the rule of libpq for private keys,
    /// PostgreSQL 17, 32.19.1).
    ///
    /// # Errors
    /// [`Error::settings`] that names the variable or the file and what to do, never
    /// what is in it.
    pub fn read(&self) -> Result<SecretText, Error> {
        let fault = |what: String| Error::settings(format!("{self}: {what}"));
        let bytes = match &self.0 {
            Source::Variable(name) => std::env::var_os(name)
                .ok_or_else(|| fault("it is not set: set it where the viewer is started".into()))?
                .into_encoded_bytes(),
            Source::File(path) => read_file(path).map_err(fault)?,
        };
        text_of(bytes).map(SecretText).map_err(fault)
    }

    fn parse_variable(name: String) -> Result<Self, String> {
        // What breaks the rule may be the credential itself, so it is not repeated.
        if is_variable_name(&name) {
            return Ok(Self(Source::Variable(name)));
        }
        Err(format!(
            "env: this is no name of a variable: use letters, digits and _, no digit first, at \
             most {MAX_NAME_BYTES} bytes"
        ))
    }

    fn parse_path(path: String) -> Result<Self, String> {
        if Path::new(&path).is_absolute() && path.len() <= MAX_PATH_BYTES {
            return Ok(Self(Source::File(path.into())));
        }
        Err("file: give an absolute path".into())
    }
}

impl fmt::Display for Secret {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.0 {
            Source::Variable(name) => write!(f, "environment variable {name}"),
            Source::File(path) => write!(f, "secret file '{}'", path.display()),
        }
    }
}

fn is_variable_name(name: &str) -> bool {
    name.len() <= MAX_NAME_BYTES
        && name.starts_with(|first: char| first.is_ascii_alphabetic() || first == '_')
        && name.bytes().all(|byte| byte.is_ascii_alphanumeric() || byte == b'_')
}

fn read_file(path: &Path) -> Result<Vec<u8>, String> {
    let words = |error: std::io::Error| error.to_string();
    // Looked at before it is opened: opening a pipe would wait for its writer.
    check_file(&std::fs::metadata(path).map_err(words)?)?;
    let file = File::open(path).map_err(words)?;
    check_file(&file.metadata().map_err(words)?)?;
    let mut bytes = Vec::new();
    file.take(MAX_FILE_BYTES).read_to_end(&mut bytes).map_err(words)?;
    Ok(bytes)
}

fn check_file(metadata: &std::fs::Metadata) -> Result<(), String> {
    if !metadata.is_file() {
        return Err("it is no plain file".into());
    }
    #[cfg(unix)]
    {
        use std::os::unix::fs::MetadataExt;
        const BY_GROUP_OR_OTHERS: u32 = 0o077;
        const READ_BY_GROUP: u32 = 0o040;
        let allowed = if metadata.uid() == 0 { READ_BY_GROUP } else { 0 };
        if metadata.mode() & BY_GROUP_OR_OTHERS & !allowed != 0 {
            let mode = metadata.mode() & 0o777;
            return Err(format!(
                "others may read or change it (mode {mode:04o}): run chmod 600 on it, and \
                 replace the credential if others could have read it"
            ));
        }
    }
    Ok(())
}

fn text_of(bytes: Vec<u8>) -> Result<String, String> {
    let mut text = String::from_utf8(bytes).map_err(|_| "it is not UTF-8".to_owned())?;
    if text.ends_with('\n') {
        text.pop();
        if text.ends_with('\r') {
            text.pop();
        }
    }
    if text.is_empty() {
        return Err("it is empty".into());
    }
    if text.len() > MAX_SECRET_BYTES {
        return Err(format!("it has more than {MAX_SECRET_BYTES} bytes"));
    }
    if text.contains('\0') {
        return Err("it has a zero byte".into());
    }
    Ok(text)
}

impl Serialize for Secret {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let (name, value) = match &self.0 {
            Source::Variable(name) => ("env", Cow::from(name)),
            Source::File(path) => ("file", path.to_string_lossy()),
        };
        serializer.collect_map([(name, value)])
    }
}

impl<'de> Deserialize<'de> for Secret {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(Reference)
    }
}

/// Reads `{"env": ...}` or `{"file": ...}`. Serde's own words for anything else would
/// repeat the value, so each is refused here.
struct Reference;

impl<'de> Visitor<'de> for Reference {
    type Value = Secret;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("{\"env\": ...} or {\"file\": ...}")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Secret, A::Error> {
        let refused = || de::Error::custom(REMEDY);
        let kind: String = map.next_key()?.ok_or_else(refused)?;
        let Hidden(value) = map.next_value()?;
        let secret = match (kind.as_str(), value) {
            ("env", Some(name)) => Secret::parse_variable(name),
            ("file", Some(path)) => Secret::parse_path(path),
            _ => return Err(refused()),
        };
        if map.next_key::<IgnoredAny>()?.is_some() {
            return Err(refused());
        }
        secret.map_err(de::Error::custom)
    }

    fn visit_str<E: de::Error>(self, _: &str) -> Result<Secret, E> {
        Err(E::custom(REMEDY))
    }

    fn visit_bool<E: de::Error>(self, _: bool) -> Result<Secret, E> {
        Err(E::custom(REMEDY))
    }

    fn visit_i64<E: de::Error>(self, _: i64) -> Result<Secret, E> {
        Err(E::custom(REMEDY))
    }

    fn visit_u64<E: de::Error>(self, _: u64) -> Result<Secret, E> {
        Err(E::custom(REMEDY))
    }

    fn visit_f64<E: de::Error>(self, _: f64) -> Result<Secret, E> {
        Err(E::custom(REMEDY))
    }

    fn visit_unit<E: de::Error>(self) -> Result<Secret, E> {
        Err(E::custom(REMEDY))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, _: A) -> Result<Secret, A::Error> {
        Err(de::Error::custom(REMEDY))
    }
}

/// Text value, or none for any other value; its contents are not repeated.
struct Hidden(Option<String>);

impl<'de> Deserialize<'de> for Hidden {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let value = serde_json::Value::deserialize(deserializer)?;
        Ok(Self(value.as_str().map(str::to_owned)))
    }
}

impl JsonSchema for Secret {
    fn schema_name() -> Cow<'static, str> {
        "Secret".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({
            "description": "Where a credential is, never the credential itself.",
            "type": "object",
            "properties": {
                "env": {
                    "description": "Name of an environment variable that has it.",
                    "type": "string",
                    "pattern": "^[A-Za-z_][A-Za-z0-9_]*$",
                    "maxLength": MAX_NAME_BYTES
                },
                "file": {
                    "description": "Absolute path of a file that has it, which only its owner \
                                    can read.",
                    "type": "string",
                    "minLength": 1,
                    "maxLength": MAX_PATH_BYTES
                }
            },
            "additionalProperties": false,
            "minProperties": 1,
            "maxProperties": 1,
            (REMEDY_KEYWORD): REMEDY
        })
    }
}

#[cfg(test)]
#[path = "secret_tests.rs"]
mod tests;
