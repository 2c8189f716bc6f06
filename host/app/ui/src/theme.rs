//! Themes: light grey for day, dark grey for night shifts; saturated colors only for abnormal states.

use std::sync::Arc;

use egui::{
    Color32, Context, FontData, FontDefinitions, FontFamily, FontId, Stroke, TextStyle, Theme,
    Visuals,
};

use crate::ValueMark;

/// Text color of values in the light theme and on alarm colors.
pub(crate) const DARK_TEXT: Color32 = Color32::from_gray(28);
/// Color of secondary text in the light theme.
pub(crate) const LIGHT_WEAK_TEXT: Color32 = Color32::from_gray(78);
/// Background of panels and labels in the light theme.
pub(crate) const LIGHT_BACKGROUND: Color32 = Color32::from_gray(240);
/// Color of lines and borders in the light theme.
pub(crate) const LIGHT_BORDER: Color32 = Color32::from_gray(150);

/// A value outside its normal band; an alarm of medium priority. Ink on it is dark.
pub(crate) const WARNING: Color32 = Color32::from_rgb(250, 190, 40);
/// Color of values that need immediate action. Text on it is white.
pub(crate) const ALARM: Color32 = Color32::from_rgb(196, 22, 28);

/// Note beside what an overlay drew that is late.
pub(crate) const LATE_DISPLAY: &str = "display late";
/// The name of the configuration's font within the context.
const SITE_FONT: &str = "site";

/// Color palette of a theme; colors of abnormal states are the same in all themes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Palette {
    /// Text color of values.
    pub(crate) text: Color32,
    /// Color of secondary text.
    pub(crate) weak_text: Color32,
    /// Background of panels and labels.
    pub(crate) background: Color32,
    /// Color of lines and borders.
    pub(crate) border: Color32,
    /// Color of hatching stripes.
    pub(crate) hatch: Color32,
    /// Background under the hatching of bad values.
    pub(crate) bad_background: Color32,
    /// Outline color of the selection in the scene.
    pub(crate) selection: Color32,
    /// Background of the selected row in a list.
    pub(crate) list_selection: Color32,
    /// Buttons, at rest and with the pointer on them.
    button: [Color32; 2],
    /// Background of text fields.
    field: Color32,
}

pub(crate) const LIGHT: Palette = Palette {
    text: DARK_TEXT,
    weak_text: LIGHT_WEAK_TEXT,
    background: LIGHT_BACKGROUND,
    border: LIGHT_BORDER,
    hatch: Color32::from_gray(140),
    bad_background: Color32::from_gray(214),
    selection: Color32::from_rgb(30, 90, 170),
    list_selection: Color32::from_gray(200),
    button: [Color32::from_gray(224), Color32::from_gray(212)],
    field: Color32::from_gray(252),
};

pub(crate) const DARK: Palette = Palette {
    text: Color32::from_gray(222),
    weak_text: Color32::from_gray(168),
    background: Color32::from_gray(36),
    border: Color32::from_gray(98),
    hatch: Color32::from_gray(90),
    bad_background: Color32::from_gray(52),
    selection: Color32::from_rgb(110, 165, 235),
    list_selection: Color32::from_gray(72),
    button: [Color32::from_gray(56), Color32::from_gray(72)],
    field: Color32::from_gray(24),
};

/// The palette of a context.
pub(crate) fn palette(context: &Context) -> &'static Palette {
    match context.theme() {
        Theme::Light => &LIGHT,
        Theme::Dark => &DARK,
    }
}

/// Ground and ink of a value by its mark. Colour is never the only cue: the
/// symbol of [`symbol`] and the hatching tell marks apart in grey as well.
pub(crate) fn background_and_text(context: &Context, mark: &ValueMark) -> (Color32, Color32) {
    palette(context).background_and_text(mark)
}

impl Palette {
    fn background_and_text(&self, mark: &ValueMark) -> (Color32, Color32) {
        match mark {
            ValueMark::Normal | ValueMark::Uncertain { .. } => (Color32::TRANSPARENT, self.text),
            ValueMark::Bad { .. } | ValueMark::LateDisplay => (self.bad_background, self.text),
            ValueMark::Warning => (WARNING, DARK_TEXT),
            ValueMark::Alarm => (ALARM, Color32::WHITE),
        }
    }

    fn visuals(&self, theme: Theme) -> Visuals {
        let mut visuals = theme.default_visuals();
        visuals.panel_fill = self.background;
        visuals.window_fill = self.background;
        visuals.extreme_bg_color = self.field;
        visuals.override_text_color = Some(self.text);
        visuals.weak_text_color = Some(self.weak_text);
        visuals.selection.bg_fill = self.list_selection;
        visuals.selection.stroke = Stroke::new(1.0, self.text);
        visuals.widgets.noninteractive.bg_stroke =
            Stroke::new(1.0, self.background.lerp_to_gamma(self.border, 0.45));
        visuals.slider_trailing_fill = true;
        let widgets = &mut visuals.widgets;
        for widget in [&mut widgets.inactive, &mut widgets.hovered, &mut widgets.active] {
            widget.bg_fill = self.button[1];
            widget.weak_bg_fill = self.button[0];
            widget.bg_stroke = Stroke::new(1.0, self.border);
        }
        widgets.hovered.weak_bg_fill = self.button[1];
        visuals
    }
}

/// Returns the symbol before a marked value.
pub(crate) fn symbol(mark: &ValueMark) -> &'static str {
    match mark {
        ValueMark::Normal => "",
        ValueMark::Uncertain { .. } => "?",
        ValueMark::Bad { .. } => "×",
        ValueMark::LateDisplay => "…",
        ValueMark::Warning => "!",
        ValueMark::Alarm => "!!",
    }
}

pub(crate) fn value_font() -> FontId {
    FontId::new(13.0, FontFamily::Proportional)
}

pub(crate) fn small_font() -> FontId {
    FontId::new(12.0, FontFamily::Proportional)
}

/// Sets the styles of a context, and its font: that of the site first, where there is one.
pub(crate) fn apply(context: &Context, is_dark: bool, font: Option<Vec<u8>>) {
    context.set_visuals_of(Theme::Light, LIGHT.visuals(Theme::Light));
    context.set_visuals_of(Theme::Dark, DARK.visuals(Theme::Dark));
    set_dark(context, is_dark);
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
    if let Some(font) = font {
        let mut fonts = FontDefinitions::default();
        fonts.font_data.insert(SITE_FONT.into(), Arc::new(FontData::from_owned(font)));
        let proportional = fonts.families.entry(FontFamily::Proportional).or_default();
        proportional.insert(0, SITE_FONT.into());
        context.set_fonts(fonts);
    }
}

/// Changes to the dark theme, or the light one.
pub(crate) fn set_dark(context: &Context, is_dark: bool) {
    context.set_theme(if is_dark { Theme::Dark } else { Theme::Light });
}

#[cfg(test)]
mod tests {
    use busbar_types::Priority;

    use super::*;
    use crate::alarm_symbol;

    /// Contrast of text that all can read (WCAG 2.2, 1.4.3 level AA).
    const MIN_CONTRAST: f32 = 4.5;

    /// WCAG 2.2, "contrast ratio" and "relative luminance".
    fn contrast(a: Color32, b: Color32) -> f32 {
        let luminance = |color: Color32| {
            let [red, green, blue] = [color.r(), color.g(), color.b()].map(|part| {
                let part = f32::from(part) / 255.0;
                if part <= 0.04045 { part / 12.92 } else { ((part + 0.055) / 1.055).powf(2.4) }
            });
            0.2126 * red + 0.7152 * green + 0.0722 * blue
        };
        let [a, b] = [luminance(a), luminance(b)];
        (a.max(b) + 0.05) / (a.min(b) + 0.05)
    }

    #[test]
    fn all_text_is_readable_in_both_themes() {
        assert!((contrast(Color32::BLACK, Color32::WHITE) - 21.0).abs() < 0.01);
        for (name, palette) in [("light", LIGHT), ("dark", DARK)] {
            let check = |what: &str, text: Color32, ground: Color32| {
                let contrast = contrast(text, ground);
                assert!(contrast >= MIN_CONTRAST, "{name}, {what}: {contrast:.2}");
            };
            let grounds = [
                ("paper", palette.background),
                ("bad", palette.bad_background),
                ("stripes", palette.hatch),
                ("chosen", palette.list_selection),
                ("field", palette.field),
                ("button", palette.button[0]),
                ("button under the pointer", palette.button[1]),
            ];
            for (what, ground) in grounds {
                check(what, palette.text, ground);
            }
            check("faint", palette.weak_text, palette.background);
            check("faint in a field", palette.weak_text, palette.field);
            check("inverse", palette.background, palette.text);
            for mark in
                [ValueMark::Warning, ValueMark::Alarm, ValueMark::Bad { reason: String::new() }]
            {
                let (ground, ink) = palette.background_and_text(&mark);
                check("a mark", ink, ground);
            }
        }
        for priority in Priority::ALL {
            let (ground, ink) = alarm_symbol::colors(priority);
            assert!(contrast(ground, ink) >= MIN_CONTRAST, "{}", priority.name());
        }
    }
}
