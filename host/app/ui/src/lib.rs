//! egui panels, labels and viewport input: a view model in, commands out.
//!
//! Invariant: no code here knows Vulkan, plugins or the source of a value. Panels never change
//! state; they return [`Command`]s.
#![doc = include_str!("../DESIGN.md")]

mod age;
mod alarm_banner;
mod alarm_detail;
mod alarm_keys;
mod alarm_markers;
mod alarm_model;
mod alarm_panel;
mod alarm_source_status;
mod alarm_symbol;
mod camera_panel;
mod chart_axes;
mod chart_model;
mod chart_panel;
mod command;
mod equipment_model;
mod equipment_panel;
mod faceplate;
mod faceplate_model;
mod faceplate_records;
mod faceplate_verdict;
#[cfg(test)]
mod greyscale_tests;
mod help;
mod hover_tooltip;
mod labels;
mod layer_model;
mod layers;
mod measure;
mod model_panel;
mod origin_band;
mod origin_mark;
#[cfg(test)]
mod origin_tests;
mod panel_memo;
mod plugin_panel;
mod quality_hatching;
mod record_model;
mod search_field;
mod section_panel;
mod shortcuts;
mod side_panel;
mod status_bar;
mod switch_symbols;
mod tag_panel;
#[cfg(test)]
mod test_lists;
mod theme;
mod trend;
mod value_mark;
mod view_model;
mod viewport;

pub use age::{Age, age_text};
pub use alarm_model::{
    AlarmDetail, AlarmList, AlarmMarker, AlarmModel, AlarmRow, AlarmRows, AlarmSourceStatus,
};
pub use chart_model::{
    ChartAxisRow, ChartCommand, ChartModel, ChartOverlay, DensityLegend, EquipmentExplanation,
    ProjectedChartAxis,
};
pub use command::{AxisSection, CameraMode, Command, MAX_BOOKMARKS, StandardView};
pub use equipment_model::{EquipmentRow, EquipmentRows};
pub use faceplate_model::{
    Faceplate, FaceplateState, FaceplateValue, Trend, TrendOrigin, TrendPoint, TrendState,
};
pub use layer_model::{ContourRow, LayerRow, LegendRow};
pub use measure::{MeasuredPoint, Measurement};
pub use record_model::{RecordRow, RecordSection};
pub use switch_symbols::{SwitchState, SwitchSymbol};
pub use value_mark::ValueMark;
pub use view_model::{
    Bookmark, FrameTimes, Label, LabelLine, LinkIndicator, ModelRow, Navigation, PluginRow,
    StatusBarModel, TagRow, TagRows, ViewModel,
};

use std::num::NonZeroUsize;
use std::time::{Duration, Instant};

use faceplate::FaceplatePanel;
use labels::LabelPlacement;
use panel_memo::{PanelMemo, RowRecorder, WindowInput};
use side_panel::SidePanel;

use egui::{CentralPanel, Context, Frame, FullOutput, Key, Panel, RawInput, Rect};

/// Width of the side panel, points.
const SIDE_PANEL_WIDTH: f32 = 360.0;
/// Width of the faceplate, points.
const FACEPLATE_WIDTH: f32 = 320.0;
/// Height of the alarm list, points, and the share of the window that it may take.
const ALARM_LIST_HEIGHT: f32 = 176.0;
const MAX_PART_OF_WINDOW: f32 = 0.4;

/// The panels and their egui context.
pub struct Panels {
    context: Context,
    shown: bool,
    helps: bool,
    lists_alarms: bool,
    side: SidePanel,
    face: FaceplatePanel,
    /// Label slots of the last frame.
    placement: LabelPlacement,
    /// Inputs of the last pass; none where the next one may have another result in any case.
    memo: Option<PanelMemo>,
    /// Instant from which egui wants another pass.
    due: Option<Instant>,
    /// True if the last two passes had the same result.
    is_settled: bool,
}

/// Appearance of panels and labels.
#[derive(Clone, Debug)]
pub struct Appearance {
    /// Dark, for night shifts, or light.
    pub is_dark: bool,
    /// Factor on their size.
    pub scale: f32,
    /// The bytes of a TrueType or OpenType font that goes before the one built in.
    pub font: Option<Vec<u8>>,
}

/// Models of long lists; only visible rows are requested.
pub struct ListModels<'a> {
    /// Rows of the tag table.
    pub tags: &'a dyn TagRows,
    /// Rows of the alarm list.
    pub alarms: &'a dyn AlarmRows,
    /// Rows of the equipment tree.
    pub equipment: &'a dyn EquipmentRows,
}

/// Content painted over the 3D scene.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SceneOverlay<'a> {
    /// Labels at the equipment.
    pub labels: Vec<Label<'a>>,
    /// Marks at equipment in alarm.
    pub alarm_markers: Vec<AlarmMarker>,
    /// Symbols of switch positions.
    pub switch_symbols: Vec<SwitchSymbol>,
    /// Chain of measured points.
    pub measurement: Option<Measurement>,
    /// True if the camera has just arrived at another position; label slots are reset then.
    pub arrived: bool,
    /// Equipment id under the pointer.
    pub hovered: Option<String>,
    /// Texts and axes of the chart in the scene.
    pub chart: Option<ChartOverlay>,
}

impl SceneOverlay<'_> {
    /// Returns the content with texts of its own.
    fn into_owned(self) -> SceneOverlay<'static> {
        let Self { labels, alarm_markers, switch_symbols, measurement, arrived, hovered, chart } =
            self;
        let labels = labels.into_iter().map(Label::into_owned).collect();
        SceneOverlay { labels, alarm_markers, switch_symbols, measurement, arrived, hovered, chart }
    }
}

/// Result of one pass over the panels.
pub struct PanelsOutput {
    /// Operator commands in order of occurrence.
    pub commands: Vec<Command>,
    /// Area of the 3D scene that panels leave free, points.
    pub viewport: Rect,
    /// Shapes and platform requests of egui.
    pub egui: FullOutput,
}

impl Panels {
    /// Panels, shown or, for a bare picture, with labels only.
    pub fn new(shown: bool, appearance: Appearance) -> Self {
        let Appearance { is_dark, scale, font } = appearance;
        let context = Context::default();
        theme::apply(&context, is_dark, font);
        if shown {
            context.set_zoom_factor(scale);
        }
        // One pass a frame: commands must not count twice.
        context.options_mut(|options| options.max_passes = NonZeroUsize::MIN);
        Self {
            context,
            shown,
            helps: false,
            lists_alarms: true,
            side: SidePanel::default(),
            face: FaceplatePanel::default(),
            placement: LabelPlacement::default(),
            memo: None,
            due: None,
            is_settled: false,
        }
    }

    /// Shows the panels, or labels alone; the origin band stays in both cases.
    pub fn set_shown(&mut self, shown: bool) {
        self.memo = None;
        self.shown = shown;
    }

    /// Changes how panels and labels look.
    pub fn set_appearance(&mut self, appearance: Appearance) {
        self.memo = None;
        let Appearance { is_dark, scale, font } = appearance;
        theme::apply(&self.context, is_dark, font);
        if self.shown {
            self.context.set_zoom_factor(scale);
        }
    }

    /// Changes to the dark theme, or the light one.
    pub fn set_dark(&mut self, is_dark: bool) {
        self.memo = None;
        theme::set_dark(&self.context, is_dark);
    }

    /// Reports whether the dark theme is active.
    pub fn is_dark(&self) -> bool {
        self.context.theme() == egui::Theme::Dark
    }

    /// The egui context, for the platform glue and for tessellation.
    pub fn context(&self) -> &Context {
        &self.context
    }

    /// Forgets the last pass: the next one is run whatever its inputs.
    pub fn forget_pass(&mut self) {
        self.memo = None;
    }

    /// Copies a text to the clipboard with the next pass.
    pub fn copy_text(&mut self, text: String) {
        self.memo = None;
        self.context.copy_text(text);
    }

    /// Reports whether a pass with these inputs would have the result of the last one, as long as
    /// [`Panels::keeps_overlay`] says so as well. It takes two passes alike until panels and labels
    /// have settled.
    pub fn keeps_panels(
        &self,
        input: &RawInput,
        model: &ViewModel,
        lists: &ListModels<'_>,
    ) -> bool {
        self.is_settled
            && self.due.is_none_or(|due| Instant::now() < due)
            && self.memo.as_ref().is_some_and(|memo| memo.agrees(input, model, lists))
    }

    /// Reports whether the last pass had the same content over the scene.
    pub fn keeps_overlay(&self, overlay: &SceneOverlay<'_>) -> bool {
        self.memo.as_ref().is_some_and(|memo| memo.agrees_over_scene(overlay))
    }

    /// Notes whether the last pass had the result of the one before.
    pub fn note_result(&mut self, is_same: bool) {
        self.is_settled = is_same;
    }

    /// Reports whether the last two passes had the same result.
    pub fn is_settled(&self) -> bool {
        self.is_settled
    }

    /// Returns the time until egui wants another pass; the greatest there is where it wants none.
    pub fn repaint_after(&self) -> Duration {
        let until = |due: Instant| due.saturating_duration_since(Instant::now());
        self.due.map_or(Duration::MAX, until)
    }

    /// Runs one pass. `overlay` gets the viewport and the commands so far, and
    /// gives what lies over the scene: so it follows a camera that these commands
    /// move without lagging a frame behind.
    pub fn run<'a>(
        &mut self,
        input: RawInput,
        model: &ViewModel,
        lists: &ListModels<'_>,
        mut overlay: impl FnMut(Rect, &[Command]) -> SceneOverlay<'a>,
    ) -> PanelsOutput {
        let mut commands = Vec::new();
        let (mut viewport, mut below) = (Rect::NOTHING, Rect::NOTHING);
        let (mut shown, mut helps) = (self.shown, self.helps);
        let mut lists_alarms = self.lists_alarms;
        let (window, mut kept_overlay) = (WindowInput::from_input(&input), SceneOverlay::default());
        let recorder = RowRecorder::new(lists);
        let recorded = recorder.lists();
        let given = lists;
        let lists = &recorded;
        let Self { placement, side, face, .. } = self;
        let egui = self.context.run_ui(input, |ui| {
            commands.clear();
            if let Some(model) = &model.alarms {
                lists_alarms ^= alarm_keys::handle(ui.ctx(), model, lists.alarms, &mut commands);
            }
            shown |= side.take_keys(ui.ctx());
            let flashes = model.alarms.as_ref().is_some_and(|alarms| alarms.flashes);
            if shown {
                Panel::bottom("status").show(ui, |ui| status_bar::show(ui, model));
                Panel::left("side")
                    .default_size(SIDE_PANEL_WIDTH)
                    .show(ui, |ui| side.show(ui, model, lists, &mut commands));
                // Below the scene: values stay in view beside it.
                if let Some(model) = model.alarms.as_ref().filter(|_| lists_alarms) {
                    let most = ui.max_rect().height() * MAX_PART_OF_WINDOW;
                    Panel::bottom("alarms")
                        .default_size(ALARM_LIST_HEIGHT.min(most))
                        .resizable(true)
                        .show(ui, |ui| alarm_panel::show(ui, model, lists.alarms, &mut commands));
                }
                // Above the alarm list, never over it.
                if let Some(faceplate) = &model.faceplate {
                    Panel::right("faceplate")
                        .default_size(FACEPLATE_WIDTH)
                        .resizable(true)
                        .show(ui, |ui| face.show(ui, faceplate, flashes, &mut commands));
                }
            }
            CentralPanel::default().frame(Frame::NONE).show(ui, |ui| {
                viewport = ui.max_rect();
                let band = origin_band::place(ui.ctx(), viewport, model.origin);
                // What stands over the scene stands below the band.
                below = band.map_or(viewport, |band| {
                    viewport.with_min_y(band.bottom().clamp(viewport.top(), viewport.bottom()))
                });
                viewport::handle(ui, model, &mut commands);
                let banner = model
                    .alarms
                    .as_ref()
                    .and_then(|model| alarm_banner::show(ui, below, model, &mut commands));
                let overlay = overlay(viewport, &commands);
                if overlay.arrived {
                    *placement = LabelPlacement::default();
                }
                let switch_symbols = switch_symbols::placed(ui, &overlay.switch_symbols);
                let layers = layers::last_rect(ui.ctx(), &model.layers).filter(|_| shown);
                let occupied: Vec<Rect> = banner
                    .into_iter()
                    .chain(layers)
                    .chain(alarm_markers::places(below, &overlay.alarm_markers))
                    .chain(band)
                    .chain(switch_symbols.iter().map(|(_, place)| *place))
                    .collect();
                switch_symbols::paint(ui, &switch_symbols);
                labels::paint(ui, &overlay.labels, placement, &occupied);
                alarm_markers::paint(ui, below, &overlay.alarm_markers, flashes);
                if let Some(measurement) = &overlay.measurement {
                    measure::paint(ui, measurement);
                }
                if let Some(chart) = &overlay.chart {
                    chart_axes::show(ui, chart, &mut commands);
                }
                if let Some(hovered) = &overlay.hovered {
                    hover_tooltip::paint(ui, hovered);
                }
                if !shown {
                    status_bar::paint_clock(ui, viewport, model);
                }
                if let Some(band) = band {
                    origin_band::paint(ui.ctx(), band, model.origin);
                }
                kept_overlay = overlay;
            });
            if shown {
                layers::show(ui.ctx(), below, &model.layers, &mut commands);
            }
            if let Some(chart) = model.chart.as_ref().filter(|_| shown) {
                chart_panel::show(ui.ctx(), below, chart, &mut commands);
                commands.extend(chart_panel::take_reveal(ui.ctx()).map(Command::Reveal));
            }
            help::show(ui.ctx(), &mut helps);
            if !ui.ctx().egui_wants_keyboard_input() {
                let pressed = |key| ui.input(|input| input.key_pressed(key));
                shown ^= pressed(Key::F2);
                if pressed(Key::N) {
                    commands.push(Command::SetDark(ui.ctx().theme() == egui::Theme::Light));
                }
            }
        });
        // A pass after one that changed what is shown has another result.
        let is_same = (self.shown, self.helps, self.lists_alarms) == (shown, helps, lists_alarms);
        (self.shown, self.helps, self.lists_alarms) = (shown, helps, lists_alarms);
        let requested = recorder.into_requested();
        self.memo = (is_same && commands.iter().all(Command::is_idle))
            .then(|| PanelMemo::new(window, model.clone(), kept_overlay, requested, given));
        let delay =
            egui.viewport_output.get(&egui::ViewportId::ROOT).map(|root| root.repaint_delay);
        self.due = delay.and_then(|delay| Instant::now().checked_add(delay));
        PanelsOutput { commands, viewport, egui }
    }
}
