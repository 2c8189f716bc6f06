//! Two-pass occlusion culling on software rasterizers: near instances are drawn first, the rest is
//! tested against their depth.
//!
//! Most of a frame is hidden by many nearer things rather than by large ones: rows of equipment,
//! one behind the other.

use busbar_culling::DepthTiles;
use glam::Vec3;

use crate::batch::DrawPhase;
use crate::index_cache::IndexCache;
use crate::instance_culling::{VisibleInstances, mesh_at};
use crate::instance_transform::world_from_mesh;
use crate::model::GpuModel;

/// Share of a frame's triangles that the first pass draws.
const NEAR_SHARE: f32 = 0.2;
/// Least number of other triangles for which two passes pay: reading depth back takes as long as
/// drawing some ten thousand.
const LEAST_REST: u64 = 50_000;
/// The shortest and the longest distances that are told apart, metres, and in how many steps
/// they double.
const SHORTEST: f32 = 0.0625;
const LONGEST: f32 = 65_536.0;
const STEPS_A_DOUBLING: u32 = 4;
const STEPS: usize = (step_of(LONGEST) + 1) as usize;

/// Returns the step of a distance: the first bits of a float are its exponent and the leading
/// digits.
const fn step_of(metres: f32) -> u32 {
    const DROPPED: u32 = f32::MANTISSA_DIGITS - 1 - STEPS_A_DOUBLING.ilog2();
    // What is no number is near.
    let told_apart = match metres {
        LONGEST.. => LONGEST,
        SHORTEST.. => metres,
        _ => SHORTEST,
    };
    (told_apart.to_bits() - SHORTEST.to_bits()) >> DROPPED
}

impl VisibleInstances {
    /// Puts those instances first in each batch that are near an eye, if it pays to draw them
    /// before the rest.
    pub(super) fn sort_near_first(
        &mut self,
        (models, cache): (&[Option<GpuModel>], &IndexCache),
        eye: Vec3,
    ) {
        let mut steps: Vec<u32> = Vec::with_capacity(self.instances.len());
        let mut triangles = [0_u64; STEPS];
        for batch in self.seen() {
            let sphere = mesh_at(models, batch.key).map(|mesh| mesh.sphere);
            let live = cache.get(batch.key).map_or(0, |resolved| resolved.triangles);
            for instance in &self.instances[batch.range()] {
                let sphere = sphere.map(|sphere| sphere.transformed(&world_from_mesh(instance)));
                let metres =
                    sphere.map_or(0.0, |sphere| sphere.center.distance(eye) - sphere.radius);
                let step = step_of(metres);
                steps.push(step);
                triangles[step as usize] += u64::from(live);
            }
        }
        if let Some(first_far) = first_far(&triangles) {
            self.has_first_phase = true;
            self.order(steps.into_iter().map(|step| step < first_far));
        }
    }

    /// Puts those instances first in each batch that are near, as they are told batch by batch.
    fn order(&mut self, mut are_near: impl Iterator<Item = bool>) {
        let Self { instances, ordered, batches, .. } = self;
        ordered.clear();
        // Parts share an instance where each is the only one of its batch: where it was, and is.
        let mut shared: Option<[u32; 2]> = None;
        let mut far = Vec::new();
        for batch in batches.iter_mut().filter(|batch| !batch.instances.is_empty()) {
            let (was, start) = (batch.instances.start, ordered.len() as u32);
            let members = &instances[batch.range()];
            let shares = shared.filter(|[before, _]| *before == was && members.len() == 1);
            if let Some([_, is]) = shares {
                batch.first_count = are_near.next().unwrap_or_default().into();
                batch.instances = is..is + 1;
                continue;
            }
            for member in members {
                let is_near = are_near.next().unwrap_or_default();
                if is_near { &mut *ordered } else { &mut far }.push(*member);
            }
            batch.first_count = ordered.len() as u32 - start;
            ordered.append(&mut far);
            batch.instances = start..ordered.len() as u32;
            shared = (members.len() == 1).then_some([was, start]);
        }
        std::mem::swap(instances, ordered);
    }

    /// Queues an occlusion query for each instance of the second phase.
    pub(super) fn add_occlusion_queries(
        &self,
        models: &[Option<GpuModel>],
        drawn: &mut DepthTiles,
    ) {
        for batch in self.visible_in(DrawPhase::Second) {
            if let Some(mesh) = mesh_at(models, batch.key) {
                let rest = &self.instances[batch.range()];
                for instance in rest {
                    let clip_from_mesh = *drawn.clip_from_world() * world_from_mesh(instance);
                    drawn.add_query(&clip_from_mesh, &mesh.bounds);
                }
            }
        }
    }

    /// Removes occluded instances, once the depth was read back.
    pub(super) fn remove_occluded(&mut self, models: &[Option<GpuModel>], drawn: &DepthTiles) {
        let Self { instances, batches, .. } = self;
        let mut answers = drawn.query_results();
        for batch in batches.iter_mut().filter(|batch| mesh_at(models, batch.key).is_some()) {
            let rest = batch.in_phase(DrawPhase::Second).range();
            let mut end = rest.start;
            for index in rest {
                if answers.next().unwrap_or(true) {
                    instances[end] = instances[index];
                    end += 1;
                }
            }
            batch.instances.end = end as u32;
        }
    }
}

/// Finds the first step of the second phase: the nearest steps with the share of all triangles come
/// first. `None` where the rest is not worth it.
fn first_far(triangles: &[u64; STEPS]) -> Option<u32> {
    let all: u64 = triangles.iter().sum();
    let mut near = 0;
    let last_near = triangles.iter().position(|of_step| {
        near += of_step;
        near as f32 >= all as f32 * NEAR_SHARE
    })?;
    (all - near >= LEAST_REST).then_some(last_near as u32 + 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn four_steps_double_a_distance() {
        assert_eq!([0.0, 0.0625, f32::NAN].map(step_of), [0; 3]);
        for metres in [0.125_f32, 1.0, 3.7, 300.0] {
            assert_eq!(step_of(2.0 * metres), step_of(metres) + STEPS_A_DOUBLING);
            assert!(step_of(1.26 * metres) > step_of(metres));
        }
        assert_eq!([1e6, f32::INFINITY].map(|far| step_of(far) as usize), [STEPS - 1; 2]);
    }

    #[test]
    fn a_fifth_is_near_where_the_rest_is_worth_it() {
        let triangles = |of: &[(usize, u64)]| {
            let mut triangles = [0; STEPS];
            of.iter().for_each(|&(step, count)| triangles[step] = count);
            first_far(&triangles)
        };
        assert_eq!(triangles(&[]), None);
        assert_eq!(triangles(&[(5, 9_000), (9, 49_999)]), None);
        assert_eq!(triangles(&[(5, 15_000), (9, 60_000)]), Some(6));
        assert_eq!(triangles(&[(5, 14_000), (9, 60_000)]), None, "all is near");
        assert_eq!(triangles(&[(5, 14_000), (9, 9_000), (20, 60_000)]), Some(10));
    }
}
