//! Comparison with a second implementation, in Python, written independently from the rules.

mod common;

use std::io::Write;
use std::process::{Command, Stdio};

use common::{Random, sample};
use dga::c57_104::{self, Age};
use dga::iec60599::{self, Equipment};
use dga::pentagon::{self, PENTAGON_1, PENTAGON_2};
use dga::{Sample, Zone, dlt722, doernenburg, key_gas, rogers, triangle_1, triangle_4, triangle_5};

const SEED: u64 = 20_261_123;
/// Number of samples of each kind.
const COUNT: usize = 3_000;
/// Range of distances to a border in which rounding decides, where symmetry does not.
const UNDECIDED: std::ops::Range<f64> = 1e-11..1e-7;

type Gases = [Option<f64>; 9];

/// Returns arbitrary gases, with many digits.
fn anything(random: &mut Random) -> Gases {
    let mut gases = [None; 9];
    for gas in &mut gases[..5] {
        *gas = Some(if random.below(12) == 0 { 0.0 } else { random.log(0.05, 50_000.0) });
    }
    for gas in &mut gases[5..7] {
        *gas = (random.below(4) > 0).then(|| random.log(10.0, 30_000.0));
    }
    for gas in &mut gases[7..] {
        *gas = (random.below(6) > 0).then(|| random.log(100.0, 80_000.0));
    }
    gases
}

/// Returns small whole numbers: ties, zeros, single gases and borders are frequent.
fn small(random: &mut Random) -> Gases {
    let end = random.pick(&[2, 4, 12, 101]);
    std::array::from_fn(|_| Some(random.below(end) as f64))
}

/// Returns gases on borders of ratios, of concentrations, and one whole ppm beside them.
fn on_limits(random: &mut Random) -> Gases {
    const RATIOS: [u64; 13] = [7, 10, 20, 30, 40, 50, 60, 75, 100, 200, 250, 300, 400];
    const LIMITS: [u64; 24] = [
        1, 2, 7, 15, 20, 40, 50, 65, 80, 90, 100, 120, 130, 150, 175, 200, 240, 350, 500, 600, 900,
        1100, 5000, 9000,
    ];
    let mut ppm = [0_u64; 9].map(|_| random.pick(&LIMITS) + random.below(3) - 1);
    for (above, below) in [(1, 0), (4, 3), (4, 1), (2, 4), (3, 2)] {
        if random.below(3) == 0 {
            ppm[below] = ppm[below].min(9000) * 20 + random.pick(&[0, 0, 0, 1]);
            ppm[above] = ppm[below] * random.pick(&RATIOS) / 100 + random.pick(&[0, 0, 0, 1]);
        }
    }
    ppm.map(|ppm| Some(ppm as f64))
}

/// Returns gases on and beside borders of one triangle: shares in eighths of a percent.
fn on_triangles(random: &mut Random) -> Gases {
    const SHARES: [u64; 24] =
        [0, 1, 2, 4, 9, 10, 12, 13, 14, 15, 20, 23, 24, 29, 30, 35, 36, 40, 46, 50, 54, 70, 85, 98];
    let mut gases: Gases = std::array::from_fn(|_| Some(random.below(300) as f64));
    let corners = random.pick(&[[1, 3, 4], [0, 1, 2], [1, 3, 2]]);
    let turn = random.below(3) as usize;
    let eighths = |random: &mut Random| 8 * random.pick(&SHARES) + random.pick(&[0, 0, 1, 7]);
    let first = eighths(random).min(800);
    let second = eighths(random).min(800 - first);
    let factor = 1 + random.below(9);
    for (i, share) in [first, second, 800 - first - second].into_iter().enumerate() {
        gases[corners[(i + turn) % 3]] = Some((share * factor) as f64);
    }
    gases
}

fn columns(sample: &Sample) -> [String; 13] {
    let iec: Vec<_> =
        iec60599::zones(sample, Equipment::Transformer).map(|zone| zone.name()).collect();
    let status = c57_104::status(sample, Age::Unknown);
    let yes = |is: bool| if is { "yes" } else { "no" };
    let zones: [Zone; 7] = [
        rogers::zone(sample),
        doernenburg::zone(sample),
        key_gas::zone(sample),
        dlt722::zone(sample),
        triangle_1::zone(sample),
        triangle_4::zone(sample),
        triangle_5::zone(sample),
    ];
    let [rogers, doernenburg, key_gas, dlt722, one, four, five] = zones.map(Zone::name);
    [
        &iec.join("|"),
        rogers,
        doernenburg,
        key_gas,
        dlt722,
        one,
        four,
        five,
        yes(triangle_4::is_applicable(sample)),
        yes(triangle_5::is_applicable(sample)),
        PENTAGON_1.zone(sample).name(),
        PENTAGON_2.zone(sample).name(),
        &status.map_or("NA".to_owned(), |status| status.to_string()),
    ]
    .map(str::to_owned)
}

/// Asks the peer for its results on each sample: rows of cells.
fn ask_peer(python: &str, samples: &[Gases]) -> Vec<Vec<String>> {
    let script =
        concat!(env!("CARGO_MANIFEST_DIR"), "/../../../tests/end_to_end/peers/dga_reference.py");
    let mut child = Command::new(python)
        .arg(script)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("the peer runs");
    let mut text = String::from("h2,ch4,c2h6,c2h4,c2h2,co,co2,o2,n2\n");
    for gases in samples {
        let cells = gases.map(|ppm| ppm.map_or(String::new(), |ppm| ppm.to_string()));
        text += &(cells.join(",") + "\n");
    }
    let mut stdin = child.stdin.take().expect("the peer runs");
    let writer =
        std::thread::spawn(move || stdin.write_all(text.as_bytes()).expect("the peer runs"));
    let output = child.wait_with_output().expect("the peer runs");
    writer.join().expect("the peer runs");
    assert!(output.status.success(), "the peer failed");
    let text = String::from_utf8(output.stdout).expect("the peer runs");
    text.lines().skip(1).map(|line| line.split(',').map(str::to_owned).collect()).collect()
}

#[test]
fn results_are_those_of_the_second_implementation() {
    let python = match std::env::var("BUSBAR_PYTHON") {
        Ok(python) => python,
        Err(_) if std::env::var_os("BUSBAR_REQUIRE_PEERS").is_some() => {
            panic!("no Python: run `cargo xtask test`, or set BUSBAR_PYTHON")
        }
        // Any Python does: the peer needs nothing but its own library.
        Err(_) => "python3".to_owned(),
    };
    let mut random = Random(SEED);
    let kinds: [fn(&mut Random) -> Gases; 4] = [anything, small, on_limits, on_triangles];
    let samples: Vec<_> =
        kinds.into_iter().flat_map(|kind| [kind; COUNT]).map(|kind| kind(&mut random)).collect();
    let answers = ask_peer(&python, &samples);
    assert_eq!(answers.len(), samples.len());
    let (mut undecided, mut seen) = (0, std::collections::BTreeSet::new());
    for (gases, answer) in samples.iter().zip(&answers) {
        let sample = sample(gases);
        let mut ours = columns(&sample).to_vec();
        let (point, edge) = (&answer[12..14], &answer[15]);
        let mut theirs: Vec<_> = [&answer[..12], &answer[14..15]].concat();
        if let Some(place) = pentagon::point(&sample) {
            for (ours, theirs) in place.iter().zip(point) {
                assert!(
                    (ours - theirs.parse::<f64>().expect("the peer runs")).abs() < 1e-7,
                    "{gases:?}"
                );
            }
            if UNDECIDED.contains(&edge.parse().expect("the peer runs")) {
                undecided += 1;
                (ours[10], ours[11]) = (String::new(), String::new());
                (theirs[10], theirs[11]) = (String::new(), String::new());
            }
        } else {
            assert_eq!(point, ["NA", "NA"]);
        }
        assert_eq!(ours, theirs, "{gases:?}");
        seen.extend(theirs.into_iter().enumerate());
    }
    assert!(undecided < samples.len() / 1000, "{undecided} undecided");
    // Every zone of every method was among them.
    for (column, zones) in [
        (0, "PD D1 D2 T1 T2 T3 D1|D2 ND"),
        (1, "N PD D2 T1 T2 T3 ND"),
        (2, "NF NA T PD D ND"),
        (3, "PD T1 T3 D2 C NA"),
        (4, "T0 T1 T2 T3 PD D1 D1T D2 D2T ND"),
        (5, "PD T1 T2 T3 DT D1 D2 NA"),
        (6, "PD S ND C O NA"),
        (7, "PD O S ND T2 T3 C NA"),
        (10, "PD D1 D2 T1 T2 T3 S NA"),
        (11, "PD D1 D2 T3H C O S NA"),
        (12, "1 2 3 NA"),
    ] {
        for zone in zones.split(' ') {
            assert!(seen.contains(&(column, zone.to_owned())), "column {column}: no {zone}");
        }
    }
}
