//! Light grey, calm; saturated colour only for the abnormal.

use egui::{Color32, Context, FontFamily, FontId, Stroke, TextStyle, Theme, Visuals};

use crate::Mark;

/// Text of values.
pub(crate) const INK: Color32 = Color32::from_gray(28);
/// Text beside values.
pub(crate) const FAINT_INK: Color32 = Color32::from_gray(78);
/// Panels and labels.
pub(crate) const PAPER: Color32 = Color32::from_gray(240);
/// Lines and borders.
pub(crate) const LINE: Color32 = Color32::from_gray(150);
/// The stripes of what is not to be relied on.
pub(crate) const HATCH: Color32 = Color32::from_gray(140);
/// What is selected.
pub(crate) const SELECTION: Color32 = Color32::from_rgb(30, 90, 170);

/// A value outside its normal band; an alarm of medium priority.
pub(crate) const WARNING: Color32 = Color32::from_rgb(250, 190, 40);
/// What needs action at once.
pub(crate) const ALARM: Color32 = Color32::from_rgb(196, 22, 28);

/// Ground and ink of a value by its mark. Colour is never the only cue: the
/// symbol of [`symbol`] and the hatching tell marks apart in grey as well.
pub(crate) fn ground_and_ink(mark: &Mark) -> (Color32, Color32) {
    match mark {
        Mark::Normal | Mark::Uncertain { .. } => (Color32::TRANSPARENT, INK),
        Mark::Bad { .. } => (Color32::from_gray(214), INK),
        Mark::Warning => (WARNING, INK),
        Mark::Alarm => (ALARM, Color32::WHITE),
    }
}

/// What stands before a marked value.
pub(crate) fn symbol(mark: &Mark) -> &'static str {
    match mark {
        Mark::Normal => "",
        Mark::Uncertain { .. } => "?",
        Mark::Bad { .. } => "×",
        Mark::Warning => "!",
        Mark::Alarm => "!!",
    }
}

pub(crate) fn value_font() -> FontId {
    FontId::new(13.0, FontFamily::Proportional)
}

pub(crate) fn small_font() -> FontId {
    FontId::new(12.0, FontFamily::Proportional)
}

/// Sets the style of a context.
pub(crate) fn apply(context: &Context) {
    context.set_theme(Theme::Light);
    let mut visuals = Visuals::light();
    visuals.panel_fill = PAPER;
    visuals.window_fill = PAPER;
    visuals.override_text_color = Some(INK);
    visuals.selection.bg_fill = Color32::from_gray(200);
    visuals.selection.stroke = Stroke::new(1.0, INK);
    visuals.widgets.noninteractive.bg_stroke = Stroke::new(1.0, Color32::from_gray(200));
    visuals.slider_trailing_fill = true;
    for widget in
        [&mut visuals.widgets.inactive, &mut visuals.widgets.hovered, &mut visuals.widgets.active]
    {
        widget.bg_fill = Color32::from_gray(212);
        widget.weak_bg_fill = Color32::from_gray(224);
        widget.bg_stroke = Stroke::new(1.0, LINE);
    }
    context.set_visuals_of(Theme::Light, visuals);
    context.all_styles_mut(|style| {
        style.animation_time = 0.0;
        style.spacing.slider_width = 200.0;
        style.spacing.item_spacing.y = 2.0;
        // A faded row could pass for a doubtful value.
        style.spacing.scroll.fade.strength = 0.0;
        for (text_style, size) in
            [(TextStyle::Body, 13.0), (TextStyle::Button, 13.0), (TextStyle::Heading, 15.0)]
        {
            style.text_styles.insert(text_style, FontId::new(size, FontFamily::Proportional));
        }
    });
}
