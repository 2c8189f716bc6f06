//! Slender triangles: conductors, wires and rods have draws of their own, so that other geometry
//! does not pay for their widening.

use std::ops::Range;

/// Bit set of the wedges that belong to slender islands.
pub(crate) struct SlenderWedges(Vec<u64>);

/// Range of a section's triangles, or indices: slender ones come last.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct SectionRange {
    pub(crate) all: Range<u32>,
    pub(crate) slender_from: u32,
}

impl SlenderWedges {
    /// Builds a bit set of the wedges that belong to slender islands.
    pub(crate) fn new(count: usize, is_slender: impl Fn(usize) -> bool) -> Self {
        let word = |first: usize| {
            let wedges = (first..count).take(u64::BITS as usize);
            wedges.fold(0, |word, wedge| word | u64::from(is_slender(wedge)) << (wedge - first))
        };
        Self((0..count).step_by(u64::BITS as usize).map(word).collect())
    }

    fn contains(&self, wedge: u32) -> bool {
        let word = self.0[(wedge / u64::BITS) as usize];
        word >> (wedge % u64::BITS) & 1 == 1
    }

    /// Partitions a section's triangles, slender ones last, in stable order. Islands share no
    /// triangle, so one corner decides.
    pub(crate) fn partition(
        &self,
        triangles: &mut [[u32; 3]],
        section: Range<u32>,
    ) -> SectionRange {
        let of_section = &mut triangles[section.start as usize..section.end as usize];
        let mut slender = Vec::new();
        let mut kept = 0;
        for at in 0..of_section.len() {
            let triangle = of_section[at];
            if self.contains(triangle[0]) {
                slender.push(triangle);
            } else {
                of_section[kept] = triangle;
                kept += 1;
            }
        }
        of_section[kept..].copy_from_slice(&slender);
        SectionRange { slender_from: section.start + kept as u32, all: section }
    }
}

impl SectionRange {
    pub(crate) fn without_slender(all: Range<u32>) -> Self {
        Self { slender_from: all.end, all }
    }

    /// Returns the range of indices of these triangles.
    pub(crate) fn indices(&self) -> Self {
        let Self { all, slender_from } = self;
        Self { all: 3 * all.start..3 * all.end, slender_from: 3 * slender_from }
    }

    /// Returns the ranges for the general pipeline and for the slender one; the latter is empty
    /// where there is none.
    pub(crate) fn parts(&self, has_slender: bool) -> [(bool, Range<u32>); 2] {
        let from = if has_slender { self.slender_from } else { self.all.end };
        [(false, self.all.start..from), (true, from..self.all.end)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slender_triangles_come_last_and_all_keep_their_order() {
        let slender = SlenderWedges::new(200, |wedge| wedge % 3 == 0);
        let mut triangles: Vec<[u32; 3]> = (0..200).map(|wedge| [wedge; 3]).collect();
        let range = slender.partition(&mut triangles, 10..190);
        let first = |range: Range<u32>| {
            let range = range.start as usize..range.end as usize;
            triangles[range].iter().map(|triangle| triangle[0]).collect::<Vec<_>>()
        };
        let [(_, plain), (_, thin)] = range.parts(true);
        assert_eq!(first(plain), (10..190).filter(|wedge| wedge % 3 != 0).collect::<Vec<_>>());
        assert_eq!(first(thin), (10..190).filter(|wedge| wedge % 3 == 0).collect::<Vec<_>>());
        assert_eq!(first(0..10), (0..10).collect::<Vec<_>>(), "before the section");
        assert_eq!(first(190..200), (190..200).collect::<Vec<_>>(), "after it");
    }

    #[test]
    fn a_section_is_one_range_where_nothing_tells_slender_things_apart() {
        let range = SectionRange { all: 4..10, slender_from: 7 };
        assert_eq!(range.parts(true), [(false, 4..7), (true, 7..10)]);
        assert_eq!(range.parts(false), [(false, 4..10), (true, 10..10)]);
        assert_eq!(range.indices(), SectionRange { all: 12..30, slender_from: 21 });
        assert_eq!(SectionRange::without_slender(4..10).parts(true)[1], (true, 10..10));
    }
}
