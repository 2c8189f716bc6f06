//! Variants of the method that the report compares: readings of the equations, and orders.

use anyhow::{Result, anyhow};
use busbar_geometry::{Collapse, CollapseSequence, Mesh, Topology};
use weighted_collapse::{
    BorderFlag, BorderWeight, Curvature, Interpretation, MAX_THREADS, Order, Progress as Unwatched,
};

use crate::peer;

/// Variant of the simplification.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Variant {
    pub(crate) id: &'static str,
    pub(crate) name: &'static str,
    maker: VariantMethod,
}

#[derive(Clone, Copy, Debug)]
enum VariantMethod {
    /// Order by the paper's weights in some reading.
    Weighted(Interpretation, Order),
    /// Simplification by meshoptimizer to as many vertices.
    Peer,
}

const UNPROTECTED_FLAG: Interpretation =
    Interpretation { border_curvature: 0.0, ..Interpretation::BUSBAR };
const UNWEIGHTED_FLAG: Interpretation =
    Interpretation { border_weight: BorderWeight::Zero, ..Interpretation::BUSBAR };
const PRINTED_CURVATURE: Interpretation =
    Interpretation { curvature: Curvature::AsPrinted, ..Interpretation::BUSBAR };
const PRINTED_FLAG: Interpretation =
    Interpretation { border_flag: BorderFlag::Equation2, ..Interpretation::BUSBAR };
const LITERAL: Interpretation = Interpretation {
    curvature: Curvature::AsPrinted,
    border_flag: BorderFlag::Equation2,
    border_curvature: 0.0,
    border_weight: BorderWeight::Alpha,
};

/// Returns the variant with the paper's order and one reading.
const fn paper(id: &'static str, name: &'static str, reading: Interpretation) -> Variant {
    Variant { id, name, maker: VariantMethod::Weighted(reading, Order::Paper) }
}

const BUSBAR: Variant = paper("busbar", "paper, as Busbar reads it", Interpretation::BUSBAR);
const UNPROTECTED: Variant = paper(
    "unprotected",
    "no border protection (border C = 0, w2 = 0)",
    Interpretation::UNPROTECTED,
);
const PRINTED_EQ4: Variant = paper("eq4_printed", "Eq. 4 as printed", PRINTED_CURVATURE);

/// Variants compared on shells with borders, the reference reading first.
pub(crate) const READINGS: [Variant; 7] = [
    BUSBAR,
    paper("c0_alpha", "border C = 0, w2 = alpha", UNPROTECTED_FLAG),
    paper("cpi_zero", "border C = pi, w2 = 0", UNWEIGHTED_FLAG),
    UNPROTECTED,
    PRINTED_EQ4,
    paper("eq2_printed", "Eq. 2 as printed", PRINTED_FLAG),
    paper("literal", "Eq. 2 and 4 as printed, border C = 0", LITERAL),
];
/// Variants compared on closed shells.
pub(crate) const CLOSED: [Variant; 3] = [BUSBAR, UNPROTECTED, PRINTED_EQ4];
/// Variants compared on split vertices.
pub(crate) const SPLIT: [Variant; 2] = [BUSBAR, UNPROTECTED];
/// Variants with other orders of the same weights, and the peer.
pub(crate) const ORDERS: [Variant; 3] = [
    Variant {
        id: "guarded",
        name: "paper's order, collapses that fold put off",
        maker: VariantMethod::Weighted(Interpretation::BUSBAR, Order::Guarded),
    },
    Variant {
        id: "reweighted",
        name: "W anew after each collapse, none that folds",
        maker: VariantMethod::Weighted(Interpretation::BUSBAR, Order::Reweighted),
    },
    Variant { id: "meshoptimizer", name: "meshoptimizer", maker: VariantMethod::Peer },
];
/// Output of a variant for a mesh.
pub(crate) enum VariantOutput<const N: usize> {
    /// Sequence of collapses that reaches every theta.
    Sequence(CollapseSequence),
    /// Mesh of its own for each theta.
    Levels([Mesh; N]),
}

impl Variant {
    /// Simplifies a mesh by this variant.
    pub(crate) fn make<const N: usize>(
        &self,
        mesh: &Topology,
        thetas: [f64; N],
    ) -> Result<VariantOutput<N>> {
        match self.maker {
            VariantMethod::Weighted(reading, order) => {
                Ok(VariantOutput::Sequence(sequence(mesh, &reading, order)?))
            }
            VariantMethod::Peer => Ok(VariantOutput::Levels(peer::levels(mesh, thetas)?)),
        }
    }
}

/// Computes the collapse sequence of a mesh in some reading and order.
fn sequence(mesh: &Topology, reading: &Interpretation, order: Order) -> Result<CollapseSequence> {
    let mut progress = Unwatched::detached();
    let list = weighted_collapse::collapse_list(
        plugin_mesh(mesh),
        reading,
        order,
        MAX_THREADS,
        &mut progress,
    )
    .map_err(|error| anyhow!("{}", error.message()))?;
    let collapse = |c: &weighted_collapse::Collapse| Collapse {
        removed: c.removed,
        kept: c.kept,
        error: c.error,
    };
    let entries = list.collapses.iter().map(collapse).collect();
    Ok(CollapseSequence::new(entries, mesh.positions.len() as u32)?)
}

fn plugin_mesh(mesh: &Topology) -> weighted_collapse::Mesh<'_> {
    weighted_collapse::Mesh {
        positions: bytemuck::cast_slice(&mesh.positions),
        triangles: &mesh.triangles,
        wedges: None,
    }
}

/// Computes the shares of length, flag, area and curvature in the variance of W, as Busbar reads
/// the paper.
pub(crate) fn variance_shares(mesh: &Topology) -> Result<[f64; 4]> {
    let shares = weighted_collapse::variance_shares(plugin_mesh(mesh), &Interpretation::BUSBAR)
        .map_err(|error| anyhow!("{}", error.message()))?;
    Ok([shares.length, shares.flag, shares.area, shares.curvature])
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;

    #[test]
    fn readings_differ_in_what_their_names_say() {
        assert_eq!(UNPROTECTED_FLAG.border_curvature, 0.0);
        assert_eq!(UNWEIGHTED_FLAG.border_curvature, PI);
        assert_eq!(UNPROTECTED_FLAG.border_weight, BorderWeight::Alpha);
        assert_eq!(
            Interpretation { border_weight: BorderWeight::Zero, ..UNPROTECTED_FLAG },
            Interpretation::UNPROTECTED
        );
        let mut ids: Vec<_> = READINGS.iter().chain(&ORDERS).map(|variant| variant.id).collect();
        ids.sort_unstable();
        ids.dedup();
        assert_eq!(ids.len(), READINGS.len() + ORDERS.len());
    }
}
