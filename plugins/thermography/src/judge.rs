//! How a contact is judged by the others of its device.

/// A rise below this is no ground to judge, K.
pub const LEAST_RISE: f64 = 10.0;
/// Temperatures of clamps at which a defect is serious and critical whatever the others
/// have, °C.
const HOT: [f64; 2] = [90.0, 130.0];
/// Relative differences at which a defect is general, serious and critical, %.
const DIFFERENCES: [f64; 3] = [35.0, 80.0, 95.0];

/// How bad a contact is (DL/T 664).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Defect {
    /// To be watched, and mended at the next occasion.
    General,
    /// To be mended soon.
    Serious,
    /// To be mended at once.
    Critical,
}

/// A judged contact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Verdict {
    /// None where all is well, or too little rises to judge.
    pub defect: Option<Defect>,
    /// Relative temperature difference, %; none where the rise is too small.
    pub difference: Option<f64>,
}

/// Judges a contact of `hot` °C by the coolest of its like, `normal`, in surroundings of
/// `ambient`: relative difference (hot - normal) / (hot - ambient), and the temperature
/// itself.
pub fn judge(hot: f64, normal: f64, ambient: f64) -> Verdict {
    let rise = hot - ambient;
    let difference = (rise >= LEAST_RISE).then(|| (hot - normal) / rise * 100.0);
    let all = [Defect::General, Defect::Serious, Defect::Critical];
    let by_difference = difference.and_then(|difference| {
        let reached = |(_, from): &(Defect, f64)| difference >= *from;
        all.into_iter().zip(DIFFERENCES).filter(reached).map(|(defect, _)| defect).max()
    });
    let [serious, critical] = HOT;
    let by_heat = match hot {
        hot if hot > critical => Some(Defect::Critical),
        hot if hot > serious => Some(Defect::Serious),
        _ => None,
    };
    Verdict { defect: by_difference.max(by_heat), difference }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn classes_are_those_of_the_rule() {
        let check = |[hot, normal, ambient]: [f64; 3], defect, difference: Option<f64>| {
            let found = judge(hot, normal, ambient);
            assert_eq!(found.defect, defect, "{hot} {normal} {ambient}");
            let close = found.difference.zip(difference).map(|(a, b)| (a - b).abs() < 0.05);
            assert!(close.unwrap_or(true), "{found:?}");
            assert_eq!(found.difference.is_some(), difference.is_some());
        };
        let [general, serious, critical] =
            [Defect::General, Defect::Serious, Defect::Critical].map(Some);
        // (40 - 33) / (40 - 20) = 35 %, just below it 34.5 %.
        check([40.0, 33.0, 20.0], general, Some(35.0));
        check([40.0, 33.1, 20.0], None, Some(34.5));
        // (60 - 28) / (60 - 20) = 80 %, (60 - 22) / 40 = 95 %.
        check([60.0, 28.0, 20.0], serious, Some(80.0));
        check([60.0, 22.0, 20.0], critical, Some(95.0));
        // 9.9 K are too little to judge by, even beside what is cold.
        check([29.9, 20.0, 20.0], None, None);
        check([30.0, 20.0, 20.0], critical, Some(100.0));
        // All three hot alike: heat itself is judged.
        check([90.0, 90.0, 20.0], None, Some(0.0));
        check([91.0, 90.0, 20.0], serious, Some(1.408));
        check([131.0, 130.0, 20.0], critical, Some(0.9));
    }
}
