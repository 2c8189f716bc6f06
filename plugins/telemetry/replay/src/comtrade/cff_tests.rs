use std::io::Cursor;

use super::*;
use crate::comtrade::writer::Recipe;
use crate::comtrade::{Cfg, DataType, Revision};

fn find(text: &[u8]) -> Result<Cff, CffError> {
    Cff::find(Cursor::new(text))
}

#[test]
fn parts_are_found() {
    for data in [DataType::Ascii, DataType::Binary, DataType::Binary32, DataType::Float32] {
        let recipe = Recipe::new(Revision::Of2013, data);
        let (file, data_alone) = (recipe.cff(), recipe.dat());
        let cff = find(&file).unwrap();
        assert_eq!(Cfg::parse(&cff.cfg), Cfg::parse(recipe.cfg().as_bytes()));
        assert_eq!(file[cff.data_offset as usize..], data_alone);
        let bytes = (data != DataType::Ascii).then_some(data_alone.len() as u64);
        assert_eq!(cff.data_bytes, bytes);
        let marked = [b"\xEF\xBB\xBF", &file[..]].concat();
        assert_eq!(find(&marked).unwrap().cfg, cff.cfg);
    }
}

#[test]
fn separators_of_recorders_are_read() {
    let recipe = Recipe::new(Revision::Of2013, DataType::Ascii);
    let standard = String::from_utf8(recipe.cff()).unwrap();
    let expected = find(standard.as_bytes()).unwrap();
    for (from, to) in [("file type:", "file type "), ("--- ", "-- "), (" ---", " --")] {
        assert!(standard.contains(from), "{from}");
        let text = standard.replace(from, to);
        let found = find(text.as_bytes()).unwrap();
        assert_eq!(found.cfg, expected.cfg, "{to}");
        assert_eq!(text.as_bytes()[found.data_offset as usize..], recipe.dat(), "{to}");
    }
}

#[test]
fn what_is_wrong_is_named() {
    let said = |text: &[u8]| find(text).unwrap_err().to_string();
    assert!(said(b"").contains("no configuration followed by data"));
    assert!(said(b"--- file type: DAT ASCII ---\n1,1,1\n").contains("no configuration"));
    let text = b"--- file type: CFG ---\na,b\n--- file type: XYZ ---\n";
    assert!(said(text).contains("line 3: '--- file type: XYZ ---' is no separator"));
    let text = b"--- file type: CFG ---\n--- file type: DAT BINARY: many ---\n";
    assert!(said(text).contains("line 2: "));
    let long = [b"--- file type: CFG ---\n".to_vec(), vec![b'x'; MAX_CFG_BYTES + 2]].concat();
    assert!(said(&long).contains("line 2: the configuration is longer than"));
    let lines = b"xxxxxxxx\n".repeat(MAX_CFG_BYTES / 9 + 2);
    assert!(said(&[b"--- file type: CFG ---\n", &lines[..]].concat()).contains("is longer than"));
}
