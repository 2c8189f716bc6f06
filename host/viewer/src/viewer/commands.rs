//! What the operator asks for.

use glam::Vec3;

use super::*;

impl Viewer {
    /// Does what the panels ask, except for the camera, which is steered already.
    pub(super) fn obey(&mut self, commands: &[Command]) {
        for command in commands {
            match command {
                Command::SetTheta { model, theta } => {
                    self.cursors.set_by_hand(*model, Some(*theta));
                }
                Command::UsePolicy { model } => self.cursors.set_by_hand(*model, None),
                Command::SetThetaScale(scale) => self.set_theta_scale(*scale),
                Command::SetWireframe(wireframe) => self.wireframe = *wireframe,
                Command::Focus(id) => self.select(self.scene.graph.find(id)),
                Command::StartPlugin(name) => self.start_plugin(name),
                Command::Pick(position) => self.ask_at(Purpose::Select, *position),
                Command::PickAll(area) => self.ask_in(Purpose::SelectAll, *area),
                Command::Hover(position) => self.point_at(*position),
                Command::SetMeasuring(measures) => {
                    self.measuring = measures.then(Measuring::default);
                }
                Command::SetSection(section) => self.section = *section,
                Command::Measure(position) => self.ask_at(Purpose::Measure, *position),
                Command::Escape if self.measuring.is_some() => self.measuring = None,
                Command::Escape => self.select(None),
                // The camera's.
                Command::UseCamera(_)
                | Command::StoreBookmark(_)
                | Command::GoToBookmark(_)
                | Command::SetCameraMode(_)
                | Command::SetOrthographic(_)
                | Command::LookFrom(_)
                | Command::FitAll
                | Command::FitSelection
                | Command::Orbit(_)
                | Command::Coast(_)
                | Command::Pan(_)
                | Command::Zoom(_)
                | Command::Move { .. } => {}
            }
        }
    }

    /// The plane that cuts the scene open: its normal, towards what is cut away, and how
    /// far along that it lies from the origin, metres.
    pub(super) fn section_plane(&self) -> Option<(Vec3, f32)> {
        let SectionCut { axis, at, from_below } = self.section?;
        let along = *Vec3::AXES.get(axis)?;
        Some(if from_below { (-along, -at) } else { (along, at) })
    }

    pub(super) fn select(&mut self, nodes: impl IntoIterator<Item = NodeIndex>) {
        self.selection = nodes.into_iter().take(MAX_SELECTED).collect();
    }
}
