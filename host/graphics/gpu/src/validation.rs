//! Validation log: messages of the Vulkan validation layer.

use std::borrow::Cow;
use std::ffi::{CStr, c_void};
use std::sync::{Arc, Mutex, PoisonError};

use ash::vk;

/// Greatest number of messages kept; later ones are only counted.
const MAX_MESSAGES: usize = 256;

/// Log of the validation layer's messages. Clones share one list, so that a clone still reads it
/// after the device is gone.
#[derive(Clone, Debug, Default)]
pub struct ValidationLog(Arc<Mutex<Messages>>);

#[derive(Debug, Default)]
struct Messages {
    kept: Vec<String>,
    dropped: usize,
}

impl ValidationLog {
    /// Returns every message of warning level or above.
    pub fn messages(&self) -> Vec<String> {
        let messages = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let mut all = messages.kept.clone();
        if messages.dropped > 0 {
            all.push(format!("and {} more messages", messages.dropped));
        }
        all
    }

    fn push(&self, message: String) {
        let mut messages = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if messages.kept.len() < MAX_MESSAGES {
            messages.kept.push(message);
        } else {
            messages.dropped += 1;
        }
    }

    /// Describes the messenger. The log must outlive the messenger created with it.
    pub(crate) fn messenger(&self) -> vk::DebugUtilsMessengerCreateInfoEXT<'static> {
        vk::DebugUtilsMessengerCreateInfoEXT::default()
            .message_severity(
                vk::DebugUtilsMessageSeverityFlagsEXT::WARNING
                    | vk::DebugUtilsMessageSeverityFlagsEXT::ERROR,
            )
            // GENERAL is the loader speaking, about drivers that are not ours.
            .message_type(
                vk::DebugUtilsMessageTypeFlagsEXT::VALIDATION
                    | vk::DebugUtilsMessageTypeFlagsEXT::PERFORMANCE,
            )
            .pfn_user_callback(Some(on_message))
            .user_data(Arc::as_ptr(&self.0).cast_mut().cast())
    }
}

/// Receives a message from the layer, on the thread that made the Vulkan call.
unsafe extern "system" fn on_message(
    severity: vk::DebugUtilsMessageSeverityFlagsEXT,
    _kind: vk::DebugUtilsMessageTypeFlagsEXT,
    data: *const vk::DebugUtilsMessengerCallbackDataEXT<'_>,
    user: *mut c_void,
) -> vk::Bool32 {
    if user.is_null() || data.is_null() {
        return vk::FALSE;
    }
    let messages = user.cast::<Mutex<Messages>>().cast_const();
    // SAFETY: `user` is the log's Arc pointer, which the instance keeps alive
    // for as long as the messenger exists; the count goes up for our clone.
    let log = unsafe {
        Arc::increment_strong_count(messages);
        ValidationLog(Arc::from_raw(messages))
    };
    // SAFETY: the layer passes valid data with a null or terminated message.
    let text = unsafe {
        let data = &*data;
        if data.p_message.is_null() {
            Cow::Borrowed("(no text)")
        } else {
            CStr::from_ptr(data.p_message).to_string_lossy()
        }
    };
    tracing::warn!(?severity, "validation layer: {text}");
    log.push(format!("{severity:?}: {text}"));
    vk::FALSE
}
