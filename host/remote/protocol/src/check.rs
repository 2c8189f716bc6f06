//! Validation of received messages: text lengths, picture sizes, finite numbers.

use crate::message::{
    Command, HostMessage, KeyEvent, MAX_SIDE, MAX_TAGS_A_MESSAGE, MAX_TEXT_BYTES, MAX_TYPED_BYTES,
    PointerEvent,
};
use crate::pictures::{MAX_PICTURE_BYTES, picture_bytes};

impl HostMessage {
    /// Checks what its form leaves open: lengths, sizes, numbers that are finite.
    ///
    /// # Errors
    /// In words, what is wrong.
    pub fn check(&self) -> Result<(), String> {
        match self {
            Self::Start(start) => {
                text(&start.config)?;
                text(&start.operator)?;
                size(start.size)
            }
            Self::Command(command) => command.check(),
        }
    }
}

impl Command {
    /// Checks lengths, sizes and numbers as [`HostMessage::check`] does.
    ///
    /// # Errors
    /// In words, what is wrong.
    pub fn check(&self) -> Result<(), String> {
        match self {
            Self::Resize(wanted) => size(*wanted),
            Self::UseCamera(name) | Self::Focus(name) | Self::Reload(name) => text(name),
            Self::SetLayer { layer, .. } => text(layer),
            Self::SetCamera(pose) => finite(pose.eye.iter().chain(&pose.target)),
            Self::SetTheta(Some(theta)) if !(0.0..=1.0).contains(theta) => {
                Err(format!("theta is {theta}; give 0 to 1"))
            }
            Self::SetTags(tags) if tags.len() > MAX_TAGS_A_MESSAGE => {
                Err(format!("{} tags at once; at most {MAX_TAGS_A_MESSAGE}", tags.len()))
            }
            Self::SetTags(tags) => tags.iter().try_for_each(|tag| text(&tag.tag)),
            Self::ActOnAlarm { alarm, operator, .. } => text(alarm).and_then(|()| text(operator)),
            Self::MirrorAlarm { alarm, .. } => text(alarm),
            Self::Pointer(PointerEvent::Moved(at) | PointerEvent::Button { at, .. }) => finite(at),
            Self::Pointer(PointerEvent::Scrolled(steps)) => finite([steps]),
            Self::Key(KeyEvent::Key { key: typed, .. } | KeyEvent::Text(typed))
                if typed.len() > MAX_TYPED_BYTES =>
            {
                Err(format!("{} bytes typed at once; at most {MAX_TYPED_BYTES}", typed.len()))
            }
            Self::Key(_)
            | Self::SetVisible(_)
            | Self::SetTheta(_)
            | Self::SetTime(_)
            | Self::Pick(_)
            | Self::Pointer(PointerEvent::Left) => Ok(()),
        }
    }
}

fn text(text: &str) -> Result<(), String> {
    if text.len() > MAX_TEXT_BYTES {
        return Err(format!("a text of {} bytes; at most {MAX_TEXT_BYTES}", text.len()));
    }
    Ok(())
}

fn size(size: [u32; 2]) -> Result<(), String> {
    if picture_bytes(size).is_none() {
        let [width, height] = size;
        return Err(format!(
            "a picture of {width} x {height} pixels; each side from 1 to {MAX_SIDE}, and at most \
             {} pixels in all",
            MAX_PICTURE_BYTES / 4
        ));
    }
    Ok(())
}

fn finite<'a, N: Copy + Into<f64> + 'a>(
    numbers: impl IntoIterator<Item = &'a N>,
) -> Result<(), String> {
    match numbers
        .into_iter()
        .map(|number| (*number).into())
        .find(|number: &f64| !number.is_finite())
    {
        Some(number) => Err(format!("a coordinate is {number}")),
        None => Ok(()),
    }
}
