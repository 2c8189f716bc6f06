//! Every hostile file gives one clear error.

#![allow(clippy::unwrap_used)]

mod common;

use busbar_gltf_import::{ImportFault, ImportLimits, import_bytes, import_file};
use common::{Builder, data_uri};
use serde_json::json;

#[test]
fn each_hostile_file_is_refused_with_what_where_and_remedy() {
    for case in common::hostile::cases() {
        let error = match common::import(&case.bytes) {
            Err(error) => error,
            Ok(_) => panic!("{}: accepted", case.name),
        };
        let message = error.to_string();
        for expected in case.expected {
            assert!(message.contains(expected), "{}: '{expected}' not in: {message}", case.name);
        }
        assert!(!matches!(error.fault, ImportFault::Panicked(_)), "{}: {message}", case.name);
        assert!(message.contains(error.fault.remedy()) && message.contains(&error.place));
        assert!(message.len() < 600, "{}: too long: {message}", case.name);
        assert!(!message.contains('\n'), "{}: {message}", case.name);
    }
}

#[test]
fn each_broken_image_is_remarked_on_with_what_where_and_remedy() {
    for case in common::hostile::broken_images() {
        let notes = common::import(&case.bytes).unwrap().report.notes;
        let [note] = notes.as_slice() else { panic!("{}: {notes:?}", case.name) };
        for expected in case.expected {
            assert!(note.contains(expected), "{}: '{expected}' not in: {note}", case.name);
        }
        assert!(note.starts_with("1 x texture shown as a checker: ") && note.len() < 600, "{note}");
    }
}

/// Imports a square whose buffer is at `uri`, from a file in `folder`.
fn import_with_uri(folder: &std::path::Path, uri: &str) -> Result<(), String> {
    let mut document = Builder::square().document();
    document["buffers"][0]["uri"] = json!(uri);
    let path = folder.join("model.gltf");
    std::fs::write(&path, document.to_string()).unwrap();
    match import_file(&path, &ImportLimits::default()) {
        Ok(imported) => {
            assert_eq!(imported.model.meshes[0].triangles.len(), 2);
            Ok(())
        }
        Err(error) => {
            assert_eq!(error.file, path);
            assert_eq!(error.place, "/buffers/0/uri");
            Err(error.to_string())
        }
    }
}

#[test]
fn only_regular_files_below_the_model_are_read() {
    let outside = tempfile::tempdir().unwrap();
    let folder = outside.path().join("models");
    std::fs::create_dir_all(folder.join("sub folder")).unwrap();
    let document = Builder::square().document();
    let data = document["buffers"][0]["uri"].as_str().unwrap();
    let mut bytes = common::floats(&common::SQUARE);
    bytes.extend(common::shorts(&[0, 1, 2, 0, 2, 3]));
    assert_eq!(data, data_uri(&bytes));
    std::fs::write(folder.join("sub folder/data.bin"), &bytes).unwrap();
    std::fs::write(outside.path().join("secret.bin"), &bytes).unwrap();

    import_with_uri(&folder, "sub%20folder/data.bin").unwrap();
    import_with_uri(&folder, "./sub folder/data.bin").unwrap();

    let absolute = outside.path().join("secret.bin").display().to_string();
    let file_uri = format!("file://{absolute}");
    for (uri, expected) in [
        ("../secret.bin", "leads up"),
        ("%2e%2e/secret.bin", "leads up"),
        ("sub folder/../../secret.bin", "leads up"),
        ("../../../../../../../../etc/passwd", "leads up"),
        (&absolute, "absolute"),
        (&file_uri, "scheme"),
        ("https://example.org/a.bin", "scheme"),
        ("sub%20folder", "not a regular file"),
        ("missing.bin", "No such file"),
    ] {
        let message = import_with_uri(&folder, uri).unwrap_err();
        assert!(message.contains(expected), "{uri}: {message}");
    }
}

#[cfg(unix)]
#[test]
fn links_out_pipes_and_devices_are_refused_at_once() {
    use std::os::unix::fs::symlink;

    let outside = tempfile::tempdir().unwrap();
    let folder = outside.path().join("models");
    std::fs::create_dir(&folder).unwrap();
    std::fs::write(outside.path().join("secret.bin"), [0; 60]).unwrap();
    std::fs::write(folder.join("inside.bin"), [0; 60]).unwrap();
    symlink("../secret.bin", folder.join("out.bin")).unwrap();
    symlink("..", folder.join("up")).unwrap();
    symlink("/dev/zero", folder.join("zero.bin")).unwrap();
    symlink("loop.bin", folder.join("loop.bin")).unwrap();
    rustix::fs::mkfifoat(rustix::fs::CWD, folder.join("pipe.bin"), 0o600.into()).unwrap();
    for (uri, expected) in [
        ("out.bin", "leads out"),
        ("up/secret.bin", "leads out"),
        ("zero.bin", "leads out"),
        ("pipe.bin", "not a regular file"),
        ("loop.bin", "symbolic links"),
    ] {
        let message = import_with_uri(&folder, uri).unwrap_err();
        assert!(message.contains(expected), "{uri}: {message}");
    }
    // The model itself may be none of these either.
    for path in [folder.join("pipe.bin"), "/dev/zero".into(), folder.clone()] {
        let error = import_file(&path, &ImportLimits::default()).unwrap_err();
        assert!(matches!(error.fault, ImportFault::NotAFile(_)), "{error}");
    }
    let error = import_file(&folder.join("none.glb"), &ImportLimits::default()).unwrap_err();
    assert!(matches!(error.fault, ImportFault::Read { .. }), "{error}");
}

#[test]
fn limits_are_kept() {
    let check = |bytes: &[u8], limits: ImportLimits, expected: &str| {
        let message = import_bytes(bytes, None, &limits).unwrap_err().to_string();
        assert!(message.contains(expected), "{message}");
    };
    let square = Builder::square().bytes();
    let limits = ImportLimits::default;
    check(&square, ImportLimits { max_file_bytes: 99, ..limits() }, "bytes, and the limit is 99");
    check(&square, ImportLimits { max_nodes: 0, ..limits() }, "1 nodes, and the limit is 0");
    check(&square, ImportLimits { max_depth: 0, ..limits() }, "1 levels of nodes");
    check(&square, ImportLimits { max_triangles: 1, ..limits() }, "2 triangles, and the limit");
}

#[test]
fn external_files_count_towards_the_file_limit() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("data.bin"), vec![0; 100_000]).unwrap();
    let mut document = Builder::square().document();
    document["buffers"][0]["uri"] = json!("data.bin");
    let bytes = document.to_string().into_bytes();
    let limits = ImportLimits { max_file_bytes: 100_000, ..Default::default() };
    let error = import_bytes(&bytes, Some(folder.path()), &limits).unwrap_err();
    assert!(matches!(error.fault, ImportFault::TooMany { what: "bytes", .. }), "{error}");
}

#[test]
fn buffers_that_share_a_file_share_its_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let path = common::hostile::write_one_file_named_often(folder.path());
    let error = import_file(&path, &ImportLimits::default()).unwrap_err();
    assert_eq!((&error.file, error.place.as_str()), (&path, "/accessors/2"));
    let message = error.to_string();
    let expected = "3000003 elements for the bytes there are, and the limit is 3000000";
    assert!(message.contains(expected), "{message}");
}
