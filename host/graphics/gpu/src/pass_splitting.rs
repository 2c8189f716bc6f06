//! Pass splitting: a render pass ends and resumes once it holds a given number of triangles.

use std::num::NonZeroU32;

use crate::draw_command::IndirectCommand;

/// Counter of the triangles that the current part of a pass still takes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PassSplitter {
    limit: NonZeroU32,
    /// Triangles that this round still takes.
    remaining: u32,
}

impl PassSplitter {
    pub(crate) fn new(limit: NonZeroU32) -> Self {
        Self { limit, remaining: limit.get() }
    }

    pub(crate) fn is_full(self) -> bool {
        self.remaining == 0
    }

    pub(crate) fn restart(&mut self) {
        self.remaining = self.limit.get();
    }

    /// Takes commands, the last one first, until the part is full; the rest of a command stays. All
    /// triangles keep their order.
    pub(crate) fn take_commands(
        &mut self,
        left: &mut Vec<IndirectCommand>,
    ) -> Vec<IndirectCommand> {
        let mut taken = Vec::new();
        while self.remaining > 0
            && let Some(call) = left.pop()
        {
            let [indices, instances, first_index, first_vertex, first_instance] = call;
            let each = (indices / 3).max(1);
            let with_instances = |count, first| [indices, count, first_index, first_vertex, first];
            let with_indices =
                |count, first| [count, instances, first, first_vertex, first_instance];
            let fitting = self.remaining / each;
            if instances <= fitting {
                self.remaining -= each * instances;
                taken.push(call);
            } else if instances > 1 {
                // Whole instances, or one that is cut next.
                let now = fitting.max(1);
                left.push(with_instances(instances - now, first_instance + now));
                left.push(with_instances(now, first_instance));
            } else {
                let now = 3 * self.remaining;
                left.push(with_indices(indices - now, first_index + now));
                taken.push(with_indices(now, first_index));
                self.remaining = 0;
            }
        }
        taken
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PASS_LIMIT: NonZeroU32 = NonZeroU32::new(10).unwrap();

    /// Returns first index, first vertex and instance of each triangle, in drawing order.
    fn triangles(calls: &[IndirectCommand]) -> Vec<[u32; 3]> {
        let of_call = |&[indices, instances, index, vertex, instance]: &IndirectCommand| {
            let of_instance = move |instance| {
                (index..index + indices).step_by(3).map(move |at| [at, vertex, instance])
            };
            (instance..instance + instances).flat_map(of_instance)
        };
        calls.iter().flat_map(of_call).collect()
    }

    /// Returns the commands of each part.
    fn split_passes(calls: &[IndirectCommand]) -> Vec<Vec<IndirectCommand>> {
        let mut left: Vec<IndirectCommand> = calls.iter().rev().copied().collect();
        let (mut rounds, mut all) = (PassSplitter::new(PASS_LIMIT), Vec::new());
        while !left.is_empty() {
            rounds.restart();
            all.push(rounds.take_commands(&mut left));
        }
        all
    }

    fn check(calls: &[IndirectCommand]) {
        let (rounds, all) = (split_passes(calls), triangles(calls));
        assert_eq!(triangles(&rounds.concat()), all, "{calls:?}");
        let of_rounds: Vec<usize> = rounds.iter().map(|round| triangles(round).len()).collect();
        let full: Vec<usize> = all.chunks(PASS_LIMIT.get() as usize).map(<[_]>::len).collect();
        assert_eq!(of_rounds, full, "{calls:?}");
    }

    #[test]
    fn rounds_are_full_and_keep_the_order() {
        check(&[]);
        check(&[[30, 1, 6, 7, 2]]);
        check(&[[33, 1, 6, 7, 2]]);
        check(&[[12, 1, 0, 0, 0], [15, 1, 12, 5, 3], [9, 1, 0, 9, 4]]);
        check(&[[300, 1, 3, 0, 0], [3, 1, 0, 0, 0]]);
        // Some instances a round, then one more than a round each.
        check(&[[12, 7, 9, 0, 5]]);
        check(&[[36, 3, 9, 1, 5], [3, 4, 0, 0, 0]]);
    }

    #[test]
    fn calls_that_draw_nothing_go_through() {
        let calls = [[0, 1, 0, 0, 0], [30, 0, 0, 0, 0], [2, 1, 0, 0, 0]];
        assert_eq!(split_passes(&calls), [calls.to_vec()]);
    }

    #[test]
    fn a_round_goes_on_where_the_last_calls_left_it() {
        let mut rounds = PassSplitter::new(PASS_LIMIT);
        assert_eq!(rounds.take_commands(&mut vec![[18, 1, 0, 0, 0]]), [[18, 1, 0, 0, 0]]);
        assert!(!rounds.is_full());
        let mut left = vec![[18, 1, 0, 0, 0]];
        assert_eq!(rounds.take_commands(&mut left), [[12, 1, 0, 0, 0]]);
        assert!(rounds.is_full());
        assert_eq!(left, [[6, 1, 12, 0, 0]]);
    }
}
