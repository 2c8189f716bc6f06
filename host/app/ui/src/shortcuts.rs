//! Keyboard shortcuts of the side panel's tabs, and their hints.

use egui::{Event, Key};

/// Tab of the side panel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Tab {
    #[default]
    Equipment,
    Tags,
    Display,
    Plugins,
}

impl Tab {
    pub(crate) const ALL: [Self; 4] = [Self::Equipment, Self::Tags, Self::Display, Self::Plugins];

    /// Returns the name for people.
    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::Equipment => "Equipment",
            Self::Tags => "Tags",
            Self::Display => "Display",
            Self::Plugins => "Plugins",
        }
    }

    /// Returns the key that opens the tab, with Ctrl.
    const fn key(self) -> Key {
        match self {
            Self::Equipment => Key::F,
            Self::Tags => Key::T,
            Self::Display => Key::D,
            Self::Plugins => Key::P,
        }
    }

    /// Returns the shortcut as it is written, such as `Ctrl+F`.
    pub(crate) fn shortcut(self) -> String {
        format!("Ctrl+{}", self.key().name())
    }

    /// Finds the tab whose shortcut was pressed last since the previous frame.
    pub(crate) fn pressed(context: &egui::Context) -> Option<Self> {
        let of_event = |event: &Event| match event {
            Event::Key { key, pressed: true, repeat: false, modifiers, .. }
                if modifiers.command =>
            {
                Self::ALL.into_iter().find(|tab| tab.key() == *key)
            }
            _ => None,
        };
        context.input(|input| input.events.iter().filter_map(of_event).next_back())
    }
}
