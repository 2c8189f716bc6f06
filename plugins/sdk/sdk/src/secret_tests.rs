use std::os::unix::fs::PermissionsExt;

use serde_json::{Value, json};

use super::*;

/// Credential that no message may show.
const CREDENTIAL: &str = "pa55word!";

fn parse(json: &Value) -> Result<Secret, String> {
    // Through text, as a plugin gets its settings.
    serde_json::from_str(&json.to_string()).map_err(|error| error.to_string())
}

/// A file with a credential, in a folder of its own.
fn file(content: &[u8], mode: u32) -> (std::path::PathBuf, Folder) {
    let folder = Folder::new();
    let path = folder.0.join("password");
    std::fs::write(&path, content).unwrap();
    std::fs::set_permissions(&path, std::fs::Permissions::from_mode(mode)).unwrap();
    (path, folder)
}

/// A folder that goes when it is dropped: this crate has no crate for that.
struct Folder(std::path::PathBuf);

impl Folder {
    fn new() -> Self {
        use std::sync::atomic::{AtomicU32, Ordering};
        static NEXT: AtomicU32 = AtomicU32::new(0);
        let number = NEXT.fetch_add(1, Ordering::Relaxed);
        let name = format!("busbar_secret_{}_{number}", std::process::id());
        let path = std::env::temp_dir().join(name);
        std::fs::create_dir(&path).unwrap();
        Self(path)
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

fn read(content: &[u8], mode: u32) -> Result<String, String> {
    let (path, _folder) = file(content, mode);
    let secret = parse(&json!({ "file": path })).unwrap();
    secret.read().map(|text| text.reveal().to_owned()).map_err(|error| error.message().to_owned())
}

#[test]
fn a_reference_is_read_and_written_back() {
    for json in [json!({"env": "PG_PASSWORD"}), json!({"file": "/run/secrets/pg"})] {
        let secret = parse(&json).unwrap();
        assert_eq!(serde_json::to_value(&secret).unwrap(), json);
    }
}

#[test]
fn whatever_else_is_written_is_refused_and_not_repeated() {
    let numbers = 5_550_123;
    let values = [
        json!(CREDENTIAL),
        json!(numbers),
        json!(-numbers),
        json!(f64::from(numbers) + 0.5),
        json!([CREDENTIAL]),
        json!({"value": CREDENTIAL}),
        json!({"env": [CREDENTIAL]}),
        json!({"env": numbers}),
        json!({"env": CREDENTIAL}),
        json!({"env": ""}),
        json!({"env": format!("1{CREDENTIAL}")}),
        json!({"file": CREDENTIAL}),
        json!({"file": {"path": CREDENTIAL}}),
        json!({"env": "A", "file": "/a", "password": CREDENTIAL}),
        json!({}),
        json!(true),
        json!(null),
    ];
    for value in values {
        let fault = parse(&value).unwrap_err();
        assert!(!fault.contains("pa55") && !fault.contains("5550123"), "{value}: {fault}");
        let helps = ["{\"env\": \"NAME\"}", "letters, digits", "absolute path"];
        assert!(helps.iter().any(|help| fault.contains(help)), "{value}: {fault}");
    }
}

#[test]
fn the_schema_agrees() {
    let schema = schemars::schema_for!(Secret);
    assert_eq!(schema.get("type"), Some(&json!("object")));
    assert!(schema.get(REMEDY_KEYWORD).is_some_and(|text| text.as_str() == Some(REMEDY)));
}

#[test]
fn a_file_is_read_without_its_line_break() {
    for end in ["", "\n", "\r\n"] {
        assert_eq!(read(format!("{CREDENTIAL}{end}").as_bytes(), 0o600).unwrap(), CREDENTIAL);
    }
    assert_eq!(read(b" a \n\n", 0o400).unwrap(), " a \n", "only one line break goes");
    let longest = "x".repeat(MAX_SECRET_BYTES);
    assert_eq!(read(format!("{longest}\r\n").as_bytes(), 0o600).unwrap(), longest);
}

#[test]
fn a_file_that_is_none_for_a_secret_is_refused() {
    let long = vec![b'x'; MAX_SECRET_BYTES + 1];
    let cases: [(&[u8], u32, &str); 7] = [
        (CREDENTIAL.as_bytes(), 0o604, "chmod 600"),
        (CREDENTIAL.as_bytes(), 0o602, "mode 0602"),
        (CREDENTIAL.as_bytes(), 0o620, "chmod 600"),
        (b"\n", 0o600, "empty"),
        (&long, 0o600, "4096 bytes"),
        (b"pa55\xff", 0o600, "UTF-8"),
        (b"pa55\0word", 0o600, "zero byte"),
    ];
    for (content, mode, expected) in cases {
        let fault = read(content, mode).unwrap_err();
        assert!(fault.contains(expected) && fault.starts_with("secret file '"), "{fault}");
        assert!(!fault.contains("pa55"), "{fault}");
    }
    let folder = parse(&json!({"file": "/"})).unwrap().read().unwrap_err();
    assert!(folder.message().contains("no plain file"), "{folder}");
    let missing = parse(&json!({"file": "/no/such/file"})).unwrap().read().unwrap_err();
    assert!(missing.message().contains("/no/such/file"), "{missing}");
}

#[test]
fn only_roots_group_may_read_besides() {
    use std::os::unix::fs::MetadataExt;
    let (path, _folder) = file(CREDENTIAL.as_bytes(), 0o440);
    let is_roots = std::fs::metadata(&path).unwrap().uid() == 0;
    assert_eq!(parse(&json!({ "file": path })).unwrap().read().is_ok(), is_roots);
}

#[test]
fn a_variable_is_read() {
    // Set for every test by Cargo.
    let name = "CARGO_PKG_NAME";
    let text = parse(&json!({ "env": name })).unwrap().read().unwrap();
    assert_eq!(text.reveal(), env!("CARGO_PKG_NAME"));
    assert!(!format!("{text:?}").contains(text.reveal()));
    let unset = parse(&json!({"env": "BUSBAR_NO_SUCH_VARIABLE"})).unwrap().read().unwrap_err();
    assert!(unset.message().contains("BUSBAR_NO_SUCH_VARIABLE: it is not set"), "{unset}");
}
