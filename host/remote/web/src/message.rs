//! JSON messages between a page and its server, apart from pictures.

use busbar_protocol::message::{Command, KeyEvent, Modifiers, PointerEvent};
use busbar_types::AlarmState;
use serde::{Deserialize, Serialize};

/// The longest message of a page, bytes.
pub const MAX_MESSAGE_BYTES: usize = 8 << 10;
/// Steps that the wheel turns at once, at most.
const MAX_STEPS: f32 = 100.0;
/// The least and the most pixels of a picture's side, and the most in all: what a page asks
/// for is kept within.
const MIN_SIDE: u32 = 64;
const MAX_SIDE: u32 = 3840;
const MAX_PIXELS: u32 = 2560 * 1600;

/// Message of a page to the server.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub(crate) enum FromPage {
    /// The picture of this number is shown.
    Shown(u32),
    /// A numbered probe: the next beat echoes its number, so that the page knows how old that
    /// beat is at most.
    Probe(u32),
    /// Size of the page, pixels, and its visibility.
    View {
        size: [u32; 2],
        visible: bool,
    },
    /// Request to steer the view.
    Steer,
    /// Pointer, keyboard and text input.
    Moved([f32; 2]),
    Button {
        at: [f32; 2],
        button: u8,
        pressed: bool,
    },
    Scrolled(f32),
    Left,
    Key {
        key: String,
        pressed: bool,
        #[serde(default)]
        repeated: bool,
        #[serde(default)]
        modifiers: ModifierKeys,
    },
    Holds(ModifierKeys),
    Text(String),
    /// Commands of the program that embeds the page.
    Focus(String),
    Camera(String),
    Theta(Option<f64>),
    Pick([u32; 2]),
}

/// Keys that change what others mean.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub(crate) struct ModifierKeys {
    shift: bool,
    ctrl: bool,
    alt: bool,
}

/// Message of the server to a page.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum ToPage {
    /// State of the page's picture; its age, milliseconds since the viewer last confirmed what
    /// the page shows; how often the page said [`FromPage::View`]; the number of the newest
    /// [`FromPage::Probe`] that came before this was written, 0 for none.
    Beat(PictureCondition, u64, u32, u32),
    /// Reports whether the page steers the view.
    Steers(bool),
    /// The viewer is silent or gone, and how.
    Lost(String),
    /// A piece of equipment was picked; empty for nothing.
    Picked(String),
    /// Number of alarms by state.
    Alarms(AlarmCounts),
    /// Refused command, with a remedy.
    Refused(String),
}

/// Liveness of a page's picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum PictureCondition {
    /// No picture exists yet.
    Starting,
    /// Picture of current values.
    Live,
    /// Picture of older values: the viewer is too slow.
    Late,
    /// The viewer is silent or gone.
    Lost,
    /// The page does not keep up.
    Behind,
}

/// Alarms by their state of IEC 62682; those that are normal are not counted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub(crate) struct AlarmCounts {
    /// Alarms in state B.
    pub(crate) unacknowledged: u32,
    /// Alarms in state C.
    pub(crate) acknowledged: u32,
    /// Alarms in state D.
    pub(crate) returned_unacknowledged: u32,
    /// Alarms in state E.
    pub(crate) latched_unacknowledged: u32,
    /// Alarms in state F.
    pub(crate) latched_acknowledged: u32,
    /// Alarms in state G.
    pub(crate) shelved: u32,
    /// Alarms in state H.
    pub(crate) suppressed: u32,
    /// Alarms in state I.
    pub(crate) out_of_service: u32,
}

impl AlarmCounts {
    /// Counts alarms, each by its state.
    pub(crate) fn count(states: impl Iterator<Item = AlarmState>) -> Self {
        let mut counts = Self::default();
        for state in states {
            let count = match state {
                AlarmState::Normal => continue,
                AlarmState::Unacknowledged => &mut counts.unacknowledged,
                AlarmState::Acknowledged => &mut counts.acknowledged,
                AlarmState::ReturnedUnacknowledged => &mut counts.returned_unacknowledged,
                AlarmState::LatchedUnacknowledged => &mut counts.latched_unacknowledged,
                AlarmState::LatchedAcknowledged => &mut counts.latched_acknowledged,
                AlarmState::Shelved => &mut counts.shelved,
                AlarmState::SuppressedByDesign => &mut counts.suppressed,
                AlarmState::OutOfService => &mut counts.out_of_service,
            };
            *count += 1;
        }
        counts
    }
}

impl FromPage {
    /// Parses and checks a page's message.
    ///
    /// # Errors
    /// In words, what is wrong.
    pub(crate) fn parse(text: &str) -> Result<Self, String> {
        let said: Self = serde_json::from_str(text).map_err(|error| error.to_string())?;
        if let Self::Button { button, .. } = said
            && !(1..=3).contains(&button)
        {
            return Err(format!("button {button}; give 1 to 3"));
        }
        if let Some(command) = said.clone().into_command() {
            command.check()?;
        }
        Ok(said)
    }

    /// Converts the message to a command for the viewer; none where the server itself handles it.
    pub(crate) fn into_command(self) -> Option<Command> {
        Some(match self {
            Self::Shown(_) | Self::Probe(_) | Self::View { .. } | Self::Steer => return None,
            Self::Moved(at) => Command::Pointer(PointerEvent::Moved(at)),
            Self::Button { at, button, pressed } => {
                Command::Pointer(PointerEvent::Button { at, button, pressed })
            }
            Self::Scrolled(steps) => {
                Command::Pointer(PointerEvent::Scrolled(steps.clamp(-MAX_STEPS, MAX_STEPS)))
            }
            Self::Left => Command::Pointer(PointerEvent::Left),
            Self::Key { key, pressed, repeated, modifiers } => {
                let modifiers = modifiers.into();
                Command::Key(KeyEvent::Key { key, pressed, repeated, modifiers })
            }
            Self::Holds(held) => Command::Key(KeyEvent::Modifiers(held.into())),
            Self::Text(text) => Command::Key(KeyEvent::Text(text)),
            Self::Focus(id) => Command::Focus(id),
            Self::Camera(name) => Command::UseCamera(name),
            Self::Theta(theta) => Command::SetTheta(theta),
            Self::Pick(pixel) => Command::Pick(pixel),
        })
    }
}

impl From<ModifierKeys> for Modifiers {
    fn from(ModifierKeys { shift, ctrl, alt }: ModifierKeys) -> Self {
        Self { shift, ctrl, alt }
    }
}

/// The size of a picture for a page of this size: the same form, within the limits.
pub(crate) fn picture_size(asked: [u32; 2]) -> [u32; 2] {
    let [width, height] = asked.map(|side| side.clamp(MIN_SIDE, MAX_SIDE));
    let share = f64::from(MAX_PIXELS) / (f64::from(width) * f64::from(height));
    let scale = share.sqrt().min(1.0);
    [width, height].map(|side| ((f64::from(side) * scale) as u32).max(MIN_SIDE))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_page_says_is_read_and_the_rest_refused() {
        let moved = FromPage::parse(r#"{"moved":[1.5,2]}"#).unwrap();
        assert_eq!(moved, FromPage::Moved([1.5, 2.0]));
        assert_eq!(FromPage::parse(r#""left""#), Ok(FromPage::Left));
        assert_eq!(FromPage::parse(r#"{"theta":null}"#), Ok(FromPage::Theta(None)));
        let key =
            FromPage::parse(r#"{"key":{"key":"a","pressed":true,"modifiers":{"shift":true}}}"#);
        let command = key.unwrap().into_command();
        let modifiers = Modifiers { shift: true, ..Modifiers::default() };
        let typed = KeyEvent::Key { key: "a".into(), pressed: true, repeated: false, modifiers };
        assert_eq!(command, Some(Command::Key(typed)));
        for text in [
            "",
            "{}",
            "nonsense",
            r#"{"moved":[1]}"#,
            r#"{"moved":[1,1e60]}"#,
            r#"{"button":{"at":[0,0],"button":4,"pressed":true}}"#,
            r#"{"theta":1.5}"#,
            r#"{"reload":"/etc/passwd"}"#,
            r#"{"view":{"size":[1,1],"visible":true,"x":1}}"#,
            r#"{"shown":-1}"#,
            r#"{"probe":-1}"#,
            r#"{"probe":4294967296}"#,
            r#"{"shown":1,"left":null}"#,
        ] {
            assert!(FromPage::parse(text).is_err(), "{text}");
        }
        let long = format!(r#"{{"text":"{}"}}"#, "x".repeat(300));
        assert!(FromPage::parse(&long).is_err());
    }

    #[test]
    fn messages_are_as_the_page_reads_them() {
        let text = |message| serde_json::to_string(&message).unwrap();
        let beat = ToPage::Beat(PictureCondition::Live, 90, 2, 17);
        assert_eq!(text(beat), r#"{"beat":["live",90,2,17]}"#);
        assert_eq!(FromPage::parse(r#"{"probe":17}"#), Ok(FromPage::Probe(17)));
        assert_eq!(text(ToPage::Steers(true)), r#"{"steers":true}"#);
        use AlarmState::{Normal, Shelved, Unacknowledged};
        let counts =
            AlarmCounts::count([Normal, Unacknowledged, Unacknowledged, Shelved].into_iter());
        assert!(text(ToPage::Alarms(counts)).starts_with(r#"{"alarms":{"unacknowledged":2,"#));
        assert_eq!(counts.shelved, 1);
    }

    #[test]
    fn pictures_keep_within_limits_and_in_form() {
        assert_eq!(picture_size([1280, 720]), [1280, 720]);
        assert_eq!(picture_size([0, u32::MAX]), [MIN_SIDE, MAX_SIDE]);
        let [width, height] = picture_size([3840, 2160]);
        assert!(width * height <= MAX_PIXELS);
        assert!((f64::from(width) / f64::from(height) - 16.0 / 9.0).abs() < 0.01);
    }
}
