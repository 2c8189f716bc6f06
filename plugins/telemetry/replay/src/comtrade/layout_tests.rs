use crate::comtrade::writer::Recipe;
use crate::comtrade::{Cfg, DataType, Revision, Side};

/// The configuration with its first analogue and digital lines replaced.
fn read(revision: Revision, analog: &str, digital: &str) -> Cfg {
    let text = Recipe::new(revision, DataType::Ascii).cfg();
    let lines: Vec<&str> = text.split("\r\n").collect();
    let replaced = text.replacen(lines[2], analog, 1).replacen(lines[4], digital, 1);
    Cfg::parse(replaced.as_bytes()).unwrap()
}

#[test]
fn lines_of_recorders_are_read_with_a_remark() {
    use Revision::{Of1991, Of1999, Of2013};
    let other = "analogue channel 1 has the layout of another edition";
    let comma = "analogue channel 1 has a name with commas";
    let trailing = "analogue channel 1 has commas at its end";
    for (revision, line, id, unit, side, remark) in [
        (Of1999, "1,IA,A,L1,A,0.5,-3,0,-9,9,600,5,P", "IA", "A", Some(Side::Primary), None),
        (
            Of1999,
            "1,IA,A,L1,A,0.5,-3,0,-9,9,600,5,P,",
            "IA",
            "A",
            Some(Side::Primary),
            Some(trailing),
        ),
        (
            Of1999,
            "1,IA,A,L1,A,0.5,-3,0,-9,9,600,5,P,,,",
            "IA",
            "A",
            Some(Side::Primary),
            Some(trailing),
        ),
        (Of1999, "1,IA,A,L1,A,0.5,-3,0,-9,9", "IA", "A", None, Some(other)),
        (Of2013, "1,IA,A,L1,A,0.5,-3,0,-9,9", "IA", "A", None, Some(other)),
        (Of1999, "1,IA,A,L1,A,0.5,-3,0,-9,9,600,5", "IA", "A", None, Some(other)),
        (
            Of1999,
            "1,I, A, B,A,L1,A,0.5,-3,0,-9,9,600,5,S",
            "I,A,B",
            "A",
            Some(Side::Secondary),
            Some(comma),
        ),
        (Of1999, "1,IA,A,L1,A,0.5,-3,,-9,9,,,", "IA", "A", None, None),
        (Of1991, "1,IA,A,L1,A,0.5,-3,0,-9,9", "IA", "A", None, None),
        (Of1991, "1,IA,A,L1,A,0.5,-3,0,-9,9,", "IA", "A", None, Some(trailing)),
        (Of1991, "1,IA,A,L1,A,0.5,-3,0,-9,9,600,5,P", "IA", "A", Some(Side::Primary), Some(other)),
        (Of1991, "1,I,1,A,L1,A,0.5,-3,0,-9,9", "I,1", "A", None, Some(comma)),
    ] {
        let digital = if revision == Of1991 { "1,D1,0" } else { "1,D1,,,0" };
        let cfg = read(revision, line, digital);
        let channel = &cfg.analogs[0];
        assert_eq!((channel.id.as_str(), channel.unit.as_str()), (id, unit), "{line}");
        assert_eq!((channel.a, channel.b, channel.side), (0.5, -3.0, side), "{line}");
        assert_eq!(channel.range, Some(-9.0..=9.0), "{line}");
        assert_eq!(cfg.remarks.first().map(String::as_str), remark, "{line}: {:?}", cfg.remarks);
    }
    for (revision, line, id, normal) in [
        (Of1999, "1,D1,,,1", "D1", Some(true)),
        (Of1999, "1,D1,,,1,", "D1", Some(true)),
        (Of1999, "1,D1,1", "D1", Some(true)),
        (Of1999, "1,D1,,", "D1", None),
        (Of1999, "1,D1", "D1", None),
        (Of1999, "1,CB off, pole 1,,,0", "CB off,pole 1", Some(false)),
        (Of1991, "1,D1,1", "D1", Some(true)),
        (Of1991, "1,D1,,,1", "D1", Some(true)),
        (Of1991, "1,a,b,c,d,1", "a,b,c,d", Some(true)),
    ] {
        let analog = "1,IA,A,L1,A,0.5,-3,0,-9,9,600,5,P";
        let cfg = read(revision, analog, line);
        assert_eq!((cfg.digitals[0].id.as_str(), cfg.digitals[0].normal), (id, normal), "{line}");
    }
}

#[test]
fn a_name_with_commas_is_kept_by_any_numbers_behind_it() {
    let mut random = fastrand::Rng::with_seed(61);
    for _ in 0..5000 {
        let pieces: Vec<String> = (0..random.usize(1..6))
            .map(|_| ["I", "L1", "12", "-3.5", "x y"][random.usize(0..5)].into())
            .collect();
        let id = pieces.join(",");
        let (a, b) = (random.i32(1..1000), random.i32(-9..9));
        let trailing = ",".repeat(random.usize(0..3));
        let line = format!("1,{id},A,L1,kV,{a},{b},0,-32767,32767,600,5,P{trailing}");
        let cfg = read(Revision::Of1999, &line, "1,D1,,,0");
        let channel = &cfg.analogs[0];
        assert_eq!(channel.id, id, "{line}");
        assert_eq!((channel.a, channel.b), (f64::from(a), f64::from(b)), "{line}");
        assert_eq!(channel.unit, "kV", "{line}");
    }
}
