//! Execution of host commands on the view.

use busbar_protocol::message::Command;

use busbar_viewer::Viewer;

use crate::wire_types::{alarm_action, camera_pose, host_tag_value};

/// Does one thing, except for what the loop around the view does.
///
/// # Errors
/// A text with the reason and the remedy.
pub(super) fn perform(viewer: &mut Viewer, command: Command) -> Result<(), String> {
    match command {
        Command::UseCamera(name) => viewer.use_camera(&name).map_err(|error| error.to_string()),
        Command::SetCamera(pose) => {
            viewer.set_camera_pose(&camera_pose(&pose));
            Ok(())
        }
        Command::Focus(id) if viewer.focus(&id) => Ok(()),
        Command::Focus(id) => Err(format!("there is no equipment '{id}' in the scene")),
        Command::SetTheta(theta) => {
            match theta {
                Some(theta) => viewer.set_theta(theta),
                None => viewer.use_policies(),
            }
            Ok(())
        }
        Command::SetLayer { layer, shown } if viewer.set_layer_shown(&layer, shown) => Ok(()),
        Command::SetLayer { layer, .. } => Err(format!("there is no overlay '{layer}'")),
        Command::SetTags(tags) => {
            let set = tags.into_iter().map(|mut update| {
                let tag = std::mem::take(&mut update.tag);
                viewer.set_tag(&tag, host_tag_value(update))
            });
            let refused: Vec<_> = set.filter_map(Result::err).collect();
            match refused.as_slice() {
                [] => Ok(()),
                [one] => Err(one.clone()),
                [first, rest @ ..] => Err(format!("{first}, and {} more", rest.len())),
            }
        }
        Command::ActOnAlarm { alarm, action, operator } => {
            viewer.act_on_alarm(&alarm, alarm_action(action), &operator)
        }
        Command::MirrorAlarm { alarm, state } => {
            let mirrored = viewer.mirror_alarm(&alarm, state, None, None);
            mirrored.map_err(|error| error.to_string())
        }
        Command::SetTime(unix_nanos) => {
            viewer.set_playhead(unix_nanos);
            Ok(())
        }
        Command::Pick(pixel) => {
            viewer.pick(pixel).map(drop).map_err(|error| format!("nothing is picked: {error}"))
        }
        // The loop's.
        Command::Resize(_)
        | Command::SetVisible(_)
        | Command::Reload(_)
        | Command::Pointer(_)
        | Command::Key(_) => Ok(()),
    }
}
