//! Vulkan loader, instance and debug messenger.

use std::ffi::{CStr, c_char};
use std::sync::Arc;

use ash::{ext, vk};
use raw_window_handle::HasDisplayHandle;

use crate::error::vulkan_error;
use crate::{GpuError, ValidationLog, WindowHandles};

const VALIDATION_LAYER: &CStr = c"VK_LAYER_KHRONOS_validation";
const VALIDATION_LAYER_NAME: &str = "VK_LAYER_KHRONOS_validation";

/// A Vulkan instance, its loader and its messenger.
pub(crate) struct Instance {
    pub(crate) entry: ash::Entry,
    pub(crate) raw: ash::Instance,
    messenger: Option<(ext::debug_utils::Instance, vk::DebugUtilsMessengerEXT)>,
    pub(crate) log: ValidationLog,
    /// Debug names: whether objects and passes can be named for debuggers.
    pub(crate) can_name: bool,
}

impl Instance {
    /// Opens the loader and makes an instance, with the extensions that surfaces on the window's
    /// display need.
    pub(crate) fn open(
        validation: bool,
        log: ValidationLog,
        window: Option<&dyn WindowHandles>,
    ) -> Result<Arc<Self>, GpuError> {
        // SAFETY: loading the system's Vulkan loader runs its initialisers; it
        // is trusted as any system library is.
        let entry =
            unsafe { ash::Entry::load() }.map_err(|error| GpuError::NoLoader(error.to_string()))?;
        if validation && !has_layer(&entry, VALIDATION_LAYER)? {
            return Err(GpuError::NoValidationLayer(VALIDATION_LAYER_NAME));
        }
        let can_name = validation || has_extension(&entry, ext::debug_utils::NAME)?;
        let extensions = extensions(validation, can_name, window)?;
        let raw = create(&entry, &log, validation, &extensions)?;
        let mut instance = Self { entry, raw, messenger: None, log, can_name };
        if validation {
            instance.attach_messenger()?;
        }
        Ok(Arc::new(instance))
    }

    fn attach_messenger(&mut self) -> Result<(), GpuError> {
        let functions = ext::debug_utils::Instance::new(&self.entry, &self.raw);
        // SAFETY: the instance lives, and owns the log the messenger points to.
        let messenger =
            unsafe { functions.create_debug_utils_messenger(&self.log.messenger(), None) }
                .map_err(vulkan_error("listening to the validation layer"))?;
        self.messenger = Some((functions, messenger));
        Ok(())
    }
}

impl Drop for Instance {
    fn drop(&mut self) {
        // SAFETY: everything made from the instance holds an Arc of it, so
        // nothing of it is left but the messenger, destroyed first.
        unsafe {
            if let Some((functions, messenger)) = &self.messenger {
                functions.destroy_debug_utils_messenger(*messenger, None);
            }
            self.raw.destroy_instance(None);
        }
    }
}

fn has_layer(entry: &ash::Entry, wanted: &CStr) -> Result<bool, GpuError> {
    // SAFETY: the loader is loaded.
    let layers = unsafe { entry.enumerate_instance_layer_properties() }
        .map_err(vulkan_error("listing layers"))?;
    Ok(layers.iter().any(|layer| layer.layer_name_as_c_str() == Ok(wanted)))
}

fn has_extension(entry: &ash::Entry, wanted: &CStr) -> Result<bool, GpuError> {
    // SAFETY: the loader is loaded.
    let extensions = unsafe { entry.enumerate_instance_extension_properties(None) }
        .map_err(vulkan_error("listing extensions"))?;
    Ok(extensions.iter().any(|extension| extension.extension_name_as_c_str() == Ok(wanted)))
}

fn extensions(
    validation: bool,
    can_name: bool,
    window: Option<&dyn WindowHandles>,
) -> Result<Vec<*const c_char>, GpuError> {
    let mut extensions = Vec::new();
    if can_name {
        extensions.push(ext::debug_utils::NAME.as_ptr());
    }
    if validation {
        extensions.push(ext::validation_features::NAME.as_ptr());
    }
    if let Some(window) = window {
        let display = HasDisplayHandle::display_handle(window)
            .map_err(|error| GpuError::Window(error.to_string()))?;
        let needed = ash_window::enumerate_required_extensions(display.as_raw())
            .map_err(|_| GpuError::Window("no Vulkan on this kind of display".to_owned()))?;
        extensions.extend_from_slice(needed);
    }
    Ok(extensions)
}

fn create(
    entry: &ash::Entry,
    log: &ValidationLog,
    validation: bool,
    extensions: &[*const c_char],
) -> Result<ash::Instance, GpuError> {
    let application = vk::ApplicationInfo::default()
        .application_name(c"busbar")
        .engine_name(c"busbar")
        .api_version(vk::API_VERSION_1_3);
    let layers = [VALIDATION_LAYER.as_ptr()];
    let enabled = [vk::ValidationFeatureEnableEXT::SYNCHRONIZATION_VALIDATION];
    let mut features = vk::ValidationFeaturesEXT::default().enabled_validation_features(&enabled);
    // Chained too, so that creation and destruction of the instance are heard.
    let mut messenger = log.messenger();
    let mut info = vk::InstanceCreateInfo::default()
        .application_info(&application)
        .enabled_extension_names(extensions);
    if validation {
        info = info.enabled_layer_names(&layers).push_next(&mut features).push_next(&mut messenger);
    }
    // SAFETY: all that `info` points to lives until the call returns, and the
    // log outlives the instance, which owns a clone of it.
    unsafe { entry.create_instance(&info, None) }.map_err(|code| match code {
        vk::Result::ERROR_INCOMPATIBLE_DRIVER | vk::Result::ERROR_INITIALIZATION_FAILED => {
            GpuError::NoDriver(code.to_string())
        }
        vk::Result::ERROR_EXTENSION_NOT_PRESENT => GpuError::NoDriver(
            "the drivers there are cannot draw into this kind of window".to_owned(),
        ),
        code => vulkan_error("creating the instance")(code),
    })
}
