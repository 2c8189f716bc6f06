use std::ptr::{null, null_mut};

use super::*;
use crate::Host;

const POSITIONS: [[f32; 3]; 3] = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
const TRIANGLES: [[u32; 3]; 1] = [[0, 1, 2]];
/// Positions of the wedges; the middle position has two.
const WEDGE_POSITIONS: [u32; 4] = [0, 1, 1, 2];
const CORNERS: [[u32; 3]; 1] = [[0, 2, 3]];
const NORMALS: [[f32; 3]; 4] = [[0.0, 0.0, 1.0]; 4];
const UVS: [[f32; 2]; 4] = [[0.5; 2]; 4];
const SECTIONS: [u32; 4] = [0, 0, 1, 1];

fn raw() -> abi::BusbarMesh {
    abi::BusbarMesh {
        struct_size: size_of::<abi::BusbarMesh>() as u32,
        position_count: 3,
        triangle_count: 1,
        reserved: 0,
        positions: POSITIONS.as_ptr().cast(),
        triangles: TRIANGLES.as_ptr().cast(),
        wedge_count: 4,
        wedge_reserved: 0,
        corners: CORNERS.as_ptr().cast(),
        wedge_positions: WEDGE_POSITIONS.as_ptr(),
        wedge_normals: NORMALS.as_ptr().cast(),
        wedge_uvs: UVS.as_ptr().cast(),
        wedge_sections: SECTIONS.as_ptr(),
    }
}

fn fault(mesh: &abi::BusbarMesh) -> String {
    // SAFETY: the pointers are null or lead to the constants above.
    unsafe { read_mesh(mesh) }.unwrap_err().message().to_owned()
}

#[test]
fn wedges_are_read() {
    let raw = raw();
    // SAFETY: the pointers lead to the constants above.
    let mesh = unsafe { read_mesh(&raw) }.unwrap();
    assert_eq!((mesh.positions, mesh.triangles), (&POSITIONS[..], &TRIANGLES[..]));
    let wedges = mesh.wedges.unwrap();
    assert_eq!((wedges.corners, wedges.positions), (&CORNERS[..], &WEDGE_POSITIONS[..]));
    assert_eq!((wedges.normals, wedges.uvs), (&NORMALS[..], &UVS[..]));
    assert_eq!(wedges.sections, SECTIONS);
}

/// The struct as it was before wedges came.
#[repr(C)]
struct OldMesh {
    struct_size: u32,
    position_count: u32,
    triangle_count: u32,
    reserved: u32,
    positions: *const f32,
    triangles: *const u32,
}

#[test]
fn an_old_host_gives_a_mesh_without_wedges() {
    let old = OldMesh {
        struct_size: size_of::<OldMesh>() as u32,
        position_count: 3,
        triangle_count: 1,
        reserved: 0,
        positions: POSITIONS.as_ptr().cast(),
        triangles: TRIANGLES.as_ptr().cast(),
    };
    // SAFETY: the struct has as many bytes as it states.
    let mesh = unsafe { read_mesh((&raw const old).cast()) }.unwrap();
    assert_eq!((mesh.positions, mesh.triangles), (&POSITIONS[..], &TRIANGLES[..]));
    assert!(mesh.wedges.is_none());
}

/// A plugin binary of then reads a mesh of now through its own struct.
#[test]
fn an_old_plugin_reads_what_it_knows() {
    let new = raw();
    // SAFETY: the new struct is larger and of the same alignment.
    let old = unsafe { &*(&raw const new).cast::<OldMesh>() };
    assert!(old.struct_size as usize > size_of::<OldMesh>());
    assert_eq!((old.position_count, old.triangle_count, old.reserved), (3, 1, 0));
    assert_eq!((old.positions, old.triangles), (new.positions, new.triangles));
}

#[test]
fn a_host_may_give_no_wedges() {
    let bare = abi::BusbarMesh { wedge_count: 0, corners: null(), ..raw() };
    // SAFETY: as above.
    assert!(unsafe { read_mesh(&bare) }.unwrap().wedges.is_none());
}

#[test]
fn faults_are_named() {
    let check = |mesh: abi::BusbarMesh, words: &str| {
        let message = fault(&mesh);
        assert!(message.contains(words), "{message}");
    };
    check(abi::BusbarMesh { struct_size: 8, ..raw() }, "too small");
    check(abi::BusbarMesh { wedge_uvs: null(), ..raw() }, "null");
    let corners = [[0, 2, 4]];
    check(abi::BusbarMesh { corners: corners.as_ptr().cast(), ..raw() }, "not at its position");
    let swapped = [[2, 0, 3]];
    check(abi::BusbarMesh { corners: swapped.as_ptr().cast(), ..raw() }, "not at its position");
    let apart = [1, 0, 1, 2];
    check(abi::BusbarMesh { wedge_positions: apart.as_ptr(), ..raw() }, "not together");
    let missing = [0, 1, 1, 1];
    check(abi::BusbarMesh { wedge_positions: missing.as_ptr(), ..raw() }, "has no wedge");
    let beyond = [0, 1, 1, 3];
    check(abi::BusbarMesh { wedge_positions: beyond.as_ptr(), ..raw() }, "does not exist");
    let twice = [[0, 1, 1]];
    check(abi::BusbarMesh { triangles: twice.as_ptr().cast(), ..raw() }, "twice");
    let outside = [[0, 1, 3]];
    check(abi::BusbarMesh { triangles: outside.as_ptr().cast(), ..raw() }, "does not exist");
    // SAFETY: null is allowed.
    assert!(unsafe { read_mesh(null()) }.is_err());
}

/// Optimizer that records whether there are wedges.
struct Looking<const READS: bool>;

impl<const READS: bool> Plugin for Looking<READS> {
    const ID: &'static str = "test.looking";
    const NAME: &'static str = "Looking";
    const VERSION: &'static str = "1";
    const DESCRIPTION: &'static str = "Looks whether there are wedges.";
    type Settings = ();

    fn create((): (), _: Host) -> Result<Self, Error> {
        Ok(Self)
    }
}

impl<const READS: bool> MeshOptimizer for Looking<READS> {
    const READS_WEDGES: bool = READS;

    fn optimize(&self, mesh: Mesh<'_>, _: &mut Progress<'_>) -> Result<CollapseList, Error> {
        assert_eq!(mesh.wedges.is_some(), READS);
        Ok(CollapseList::default())
    }
}

#[test]
fn who_reads_no_wedges_sees_none_of_a_host_that_knows_no_flags() {
    let mut output = abi::BusbarCollapseOutput {
        struct_size: size_of::<abi::BusbarCollapseOutput>() as u32,
        collapse_capacity: 0,
        collapse_count: 0,
        stage_capacity: 0,
        stage_count: 0,
        flags: 0,
        collapses: null_mut(),
        stages: null_mut(),
    };
    // SAFETY: the pointers lead to what is here, or are null as they may be.
    unsafe {
        run(&Looking::<true>, &raw(), null(), &raw mut output).unwrap();
        run(&Looking::<false>, &raw(), null(), &raw mut output).unwrap();
    }
}
