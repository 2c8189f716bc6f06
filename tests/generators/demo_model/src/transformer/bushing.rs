//! Bushings and the turrets that they stand on.

use crate::fittings::{bolt_circle, flange_pair, terminal_palm};
use crate::shapes::{cuboid, cylinder, lathe, torus};
use crate::{Finish, Part, Sheds, at, insulator_profile};
use glam::Vec3;

/// Dimensions that distinguish one bushing from another; metres.
pub(super) struct BushingKind {
    pub(super) sleeve: f32,
    pub(super) porcelain: f32,
    pub(super) core_radii: [f32; 2],
    pub(super) sheds: Sheds,
    pub(super) cap: f32,
    pub(super) terminal: Finish,
    pub(super) ring: bool,
    pub(super) segments: usize,
}

/// 252 kV oil-paper bushing: 3.5 m above its flange.
pub(super) const KV_220: BushingKind = BushingKind {
    sleeve: 0.3,
    porcelain: 2.6,
    core_radii: [0.185, 0.145],
    sheds: Sheds { count: 40, large_overhang: 0.075, small_overhang: 0.05 },
    cap: 0.38,
    terminal: Finish::Aluminium,
    ring: true,
    segments: 14,
};

/// 126 kV oil-paper bushing.
pub(super) const KV_110: BushingKind = BushingKind {
    sleeve: 0.22,
    porcelain: 1.3,
    core_radii: [0.13, 0.105],
    sheds: Sheds { count: 22, large_overhang: 0.062, small_overhang: 0.042 },
    cap: 0.26,
    terminal: Finish::Aluminium,
    ring: false,
    segments: 12,
};

/// Bushing of either neutral, graded insulation.
pub(super) const NEUTRAL: BushingKind = BushingKind {
    sleeve: 0.16,
    porcelain: 0.8,
    core_radii: [0.11, 0.095],
    sheds: Sheds { count: 14, large_overhang: 0.055, small_overhang: 0.04 },
    cap: 0.18,
    terminal: Finish::Aluminium,
    ring: false,
    segments: 12,
};

/// 40.5 kV porcelain bushing with a copper stud.
pub(super) const KV_35: BushingKind = BushingKind {
    sleeve: 0.06,
    porcelain: 0.55,
    core_radii: [0.075, 0.065],
    sheds: Sheds { count: 7, large_overhang: 0.055, small_overhang: 0.055 },
    cap: 0.07,
    terminal: Finish::Copper,
    ring: false,
    segments: 12,
};

/// Builds a bushing standing on its flange at y = 0.
pub(super) fn bushing(kind: &BushingKind) -> Part {
    let [foot, head] = kind.core_radii;
    let n = kind.segments;
    let mut part = Part::new();
    let flange_radius = foot + 0.16;
    part.add(Finish::Aluminium, cylinder(flange_radius, 0.035, 20));
    let bolts = bolt_circle(bolts_on(flange_radius), flange_radius - 0.045, 0.036, 0.05);
    part.add_all(Finish::Galvanised, bolts.into_iter().map(|b| b.moved(0.0, 0.04, 0.0)));
    let sleeve_top = 0.03 + kind.sleeve;
    let sleeve = [
        (foot + 0.06, 0.03),
        (foot + 0.035, 0.06),
        (foot + 0.035, sleeve_top - 0.02),
        (foot + 0.05, sleeve_top - 0.02),
        (foot + 0.05, sleeve_top + 0.03),
    ];
    part.add(Finish::Aluminium, lathe(&sleeve, n));
    let porcelain = insulator_profile(sleeve_top, kind.porcelain, kind.core_radii, kind.sheds);
    part.add(Finish::BrownPorcelain, lathe(&porcelain, n));
    let cap_base = sleeve_top + kind.porcelain;
    let cap_top = cap_base + kind.cap;
    let cap = [
        (head + 0.035, cap_base - 0.02),
        (head + 0.035, cap_base + 0.02),
        (head + 0.02, cap_base + 0.03),
        (head + 0.02, cap_top - 0.06),
        (head - 0.01, cap_top - 0.02),
        (0.05, cap_top),
    ];
    part.add(Finish::Aluminium, lathe(&cap, n));
    if kind.cap > 0.2 {
        // The sight glass of the oil in the head.
        let glass = cuboid(Vec3::new(0.05, kind.cap * 0.45, 0.03));
        part.add(Finish::Glass, glass.moved(0.0, cap_base + 0.5 * kind.cap, head + 0.02));
    }
    if kind.ring {
        part.add(
            Finish::Aluminium,
            torus(head + 0.14, 0.035, 20, 6).moved(0.0, cap_base + 0.06, 0.0),
        );
        for x in [-1.0, 1.0] {
            let spoke = cuboid(Vec3::new(0.12, 0.012, 0.05));
            part.add(Finish::Aluminium, spoke.moved(x * (head + 0.075), cap_base + 0.06, 0.0));
        }
    }
    part.add(kind.terminal, cylinder(0.028, 0.12, 12).moved(0.0, cap_top - 0.02, 0.0));
    let palm_width = if kind.ring { 0.13 } else { 0.1 };
    part.add_part(
        terminal_palm(kind.terminal, palm_width, palm_width * 1.4),
        at(0.0, cap_top + 0.08, 0.0),
    );
    part
}

/// Builds a turret with current transformers, from below the cover (y = 0) up to the bushing's
/// flange at `height`.
pub(super) fn turret(radius: f32, height: f32, below: f32) -> Part {
    let mut part = Part::new();
    part.add(
        Finish::GreyPaint,
        cylinder(radius, height + below - 0.05, 24).moved(0.0, -below, 0.0),
    );
    let flanges = flange_pair(radius + 0.09, 0.035, bolts_on(radius), Finish::GreyPaint);
    part.add_part(flanges, at(0.0, height - 0.035, 0.0));
    // The terminal box of the current transformers.
    let terminal_box = crate::shapes::block(Vec3::new(0.3, 0.24, 0.16), 0.015);
    part.add(Finish::GreyPaint, terminal_box.moved(0.0, 0.5 * height + 0.02, radius + 0.06));
    part
}

/// Returns the number of bolts of a flange of this radius, some 0.13 m apart.
fn bolts_on(radius: f32) -> usize {
    ((radius * 48.0) as usize).clamp(6, 18)
}
