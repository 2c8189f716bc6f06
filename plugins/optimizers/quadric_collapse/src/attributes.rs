//! Attribute error: wedge of the kept position that each wedge becomes, and the cost of the misfit.

use busbar_plugin_sdk::{Mesh, Wedges};
use glam::{Vec2, Vec3};

use crate::surface::Spoke;

/// Wedges of the kept position that are looked at, as the host does.
const MAX_PARENT_CANDIDATES: usize = 64;
/// Weight of torn texture or material: as a normal turned by 90 degrees.
const TEAR: f64 = 2.0;

/// The wedges of a mesh by position.
pub(crate) struct Attributes<'a> {
    wedges: Wedges<'a>,
    /// First wedge of each position.
    starts: Vec<u32>,
}

impl<'a> Attributes<'a> {
    /// Reads the attributes; `None` for a mesh without any.
    pub(crate) fn new(mesh: &Mesh<'a>) -> Option<Self> {
        let wedges = mesh.wedges?;
        let mut starts = vec![0; mesh.positions.len()];
        let mut last = None;
        for (wedge, &position) in (0_u32..).zip(wedges.positions) {
            if last.replace(position) != Some(position) {
                starts[position as usize] = wedge;
            }
        }
        Some(Self { wedges, starts })
    }

    /// Returns the wedge that represents `wedge` once its position moves onto `kept`: of the same
    /// section, then of the nearest normal and coordinate, then the first. The host chooses by the
    /// same rule.
    #[inline]
    pub(crate) fn parent(&self, wedge: u32, kept: u32) -> u32 {
        let start = self.starts[kept as usize];
        let after = &self.wedges.positions[start as usize + 1..];
        if after.first() != Some(&kept) {
            return start;
        }
        let others = after.iter().take(MAX_PARENT_CANDIDATES - 1).take_while(|&&p| p == kept);
        let candidates = start..start + 1 + others.count() as u32;
        let misfit = |candidate: u32| {
            let bend = 1.0 - self.normal(wedge).dot(self.normal(candidate));
            let stretch = self.uv(wedge).distance(self.uv(candidate));
            (self.section(wedge) != self.section(candidate), bend + stretch)
        };
        let by_misfit = candidates.map(|candidate| (misfit(candidate), candidate));
        by_misfit
            .min_by(|(a, _), (b, _)| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)))
            .map_or(start, |(_, candidate)| candidate)
    }

    /// Reports whether texture or material break between two wedges.
    #[inline]
    pub(crate) fn is_seam(&self, a: u32, b: u32) -> bool {
        a != b && (self.section(a) != self.section(b) || self.uv(a) != self.uv(b))
    }

    /// Returns the squared distance of two unit normals: 0 to 4.
    #[inline]
    pub(crate) fn turn(&self, a: u32, b: u32) -> f64 {
        if a == b {
            return 0.0;
        }
        let (a, b) = (self.normal(a), self.normal(b));
        let scale = a.length_squared() * b.length_squared();
        if scale > 0.0 { f64::from((2.0 - 2.0 * a.dot(b) / scale.sqrt()).max(0.0)) } else { 0.0 }
    }

    fn normal(&self, wedge: u32) -> Vec3 {
        self.wedges.normals[wedge as usize].into()
    }

    fn uv(&self, wedge: u32) -> Vec2 {
        self.wedges.uvs[wedge as usize].into()
    }

    fn section(&self, wedge: u32) -> u32 {
        self.wedges.sections[wedge as usize]
    }
}

/// The triangles at a vertex by the wedge that they have there.
#[derive(Default)]
pub(crate) struct WedgeAreas {
    /// Wedges with their areas.
    list: Vec<(u32, f64)>,
}

impl WedgeAreas {
    /// Adds up the area of each wedge, square metres.
    pub(crate) fn gather(&mut self, wedges: impl Iterator<Item = (u32, f64)>) {
        self.list.clear();
        for (wedge, area) in wedges {
            match self.list.iter_mut().find(|passage| passage.0 == wedge) {
                Some(passage) => passage.1 += area,
                None => self.list.push((wedge, area)),
            }
        }
    }

    /// Computes the attribute misfit of moving the wedges onto `onto` (vertices of the mesh), times
    /// their area and the squared distance at which it counts for that area. The misfit is the
    /// squared distance of the normals, and [`TEAR`] if texture or material does not lead there
    /// along an edge.
    pub(crate) fn misfit(
        &self,
        attributes: &Attributes<'_>,
        ring: &[Spoke],
        kept: u32,
        onto: u32,
        reach_squared: impl Fn(f64) -> f64,
    ) -> f64 {
        let mut sum = 0.0;
        for &(wedge, area) in &self.list {
            let parent = attributes.parent(wedge, onto);
            let leads = |spoke: &Spoke| {
                let end = if spoke.ahead == kept {
                    spoke.wedges[1]
                } else if spoke.behind == kept {
                    spoke.wedges[2]
                } else {
                    return false;
                };
                !attributes.is_seam(spoke.wedges[0], wedge) && !attributes.is_seam(end, parent)
            };
            let tear = if ring.iter().any(leads) { 0.0 } else { TEAR };
            sum += area * (attributes.turn(wedge, parent) + tear) * reach_squared(area);
        }
        sum
    }
}
