//! Places at which a node shows its mesh (EXT_mesh_gpu_instancing).

use glam::{DMat4, DQuat, DVec3, Quat, Vec3};

use crate::accessor::Accessor;
use crate::buffers::Buffers;
use crate::error::{ImportError, ImportFault};
use crate::limits::MIN_ALLOWANCE;
use crate::schema::{Instancing, Shape};
use crate::transforms::unit_rotation;

/// Reports whether a node names places of instances at all.
pub(crate) fn has_places(instancing: &Instancing) -> bool {
    let mut names = instancing.attributes.0.iter().map(|(name, _)| name.as_str());
    names.any(|name| ["TRANSLATION", "ROTATION", "SCALE"].contains(&name))
}

/// Reads the transforms of a node's instances, in the file's order; `node` is the node's place.
pub(crate) fn read(
    instancing: &Instancing,
    buffers: &Buffers<'_>,
    node: &str,
) -> Result<Vec<DMat4>, ImportError> {
    let place = |name: &str| format!("{node}/extensions/EXT_mesh_gpu_instancing/attributes/{name}");
    let attribute = |name: &str, shape: Shape| {
        let named = instancing.attributes.0.iter().find(|(known, _)| known == name);
        let Some((_, index)) = named else { return Ok(None) };
        let accessor = Accessor::new(buffers, index.index(), || place(name))?;
        if accessor.shape != shape {
            let what = format!("{} instead of {}", accessor.shape.name(), shape.name());
            return Err(ImportFault::Invalid(what).at(place(name)));
        }
        accessor.check_sparse()?;
        Ok(Some(accessor))
    };
    let translations = attribute("TRANSLATION", Shape::Vec3)?;
    let rotations = attribute("ROTATION", Shape::Vec4)?;
    let scales = attribute("SCALE", Shape::Vec3)?;
    let counts = [&translations, &rotations, &scales].into_iter().flatten().map(|a| a.count);
    let count = counts.clone().min().unwrap_or(0);
    if counts.max() > Some(count) {
        let fault = ImportFault::Invalid("attributes of unequal numbers of instances".into());
        return Err(fault.at(place("TRANSLATION")));
    }
    // Accessors without data are of any length.
    let limit = buffers.total_bytes().max(MIN_ALLOWANCE);
    if count as u64 > limit {
        let what = "instances for the bytes there are";
        return Err(
            ImportFault::TooMany { what, count: count as u64, limit }.at(place("TRANSLATION"))
        );
    }
    let transform = |instance: usize| {
        let vector = |accessor: &Option<Accessor<'_>>, default| {
            accessor.map_or(default, |of| Vec3::from_array(of.floats_at(instance)).as_dvec3())
        };
        let rotation = rotations
            .map_or(DQuat::IDENTITY, |of| Quat::from_array(of.floats_at(instance)).as_dquat());
        DMat4::from_scale_rotation_translation(
            vector(&scales, DVec3::ONE),
            unit_rotation(rotation),
            vector(&translations, DVec3::ZERO),
        )
    };
    Ok((0..count).map(transform).collect())
}
