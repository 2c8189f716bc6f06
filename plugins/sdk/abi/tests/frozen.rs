//! Layout test of ABI 1.0: frozen sizes, offsets, codes and names never change again. A field that
//! is added at an end changes a size here, and nothing else.
#![cfg(target_pointer_width = "64")]

use std::mem::{offset_of, size_of};

use busbar_plugin_abi::*;

#[test]
fn frozen_structs_keep_their_layout() {
    macro_rules! frozen {
        ($($name:ident: $size:literal { $($field:ident @ $offset:literal),* $(,)? })*) => {$(
            assert_eq!(size_of::<$name>(), $size, stringify!($name));
            $(assert_eq!(
                offset_of!($name, $field), $offset, concat!(stringify!($name), ".", stringify!($field))
            );)*
        )*};
    }
    frozen! {
        BusbarStr: 16 { ptr @ 0, len @ 8 }
        BusbarError: 1036 { struct_size @ 0, message_len @ 4, status @ 8, message @ 12 }
        BusbarPluginEntry: 40 {
            struct_size @ 0, abi_major @ 4, abi_minor @ 8, reserved @ 12,
            init @ 16, deinit @ 24, get_factory @ 32,
        }
        BusbarPluginFactory: 32 {
            struct_size @ 0, reserved @ 4, count @ 8, descriptor @ 16, create @ 24,
        }
        BusbarPluginDescriptor: 96 {
            struct_size @ 0, capability_count @ 4, id @ 8, name @ 24, version @ 40,
            description @ 56, settings_schema @ 72, capabilities @ 88,
        }
        BusbarPlugin: 32 {
            struct_size @ 0, reserved @ 4, data @ 8, destroy @ 16, get_capability @ 24,
        }
        BusbarHost: 32 {
            struct_size @ 0, abi_major @ 4, abi_minor @ 8, reserved @ 12, context @ 16, log @ 24,
        }
    }
}

#[test]
fn frozen_codes_and_names_keep_their_values() {
    assert_eq!(ENTRY_SYMBOL, c"busbar_plugin_entry");
    assert_eq!(PLUGIN_FACTORY_ID, "busbar.plugin-factory/1");
    assert_eq!(BUSBAR_ABI_MAJOR, 1);
    let statuses = [
        BUSBAR_OK,
        BUSBAR_INVALID_ARGUMENT,
        BUSBAR_INVALID_SETTINGS,
        BUSBAR_BUFFER_TOO_SMALL,
        BUSBAR_CANCELLED,
        BUSBAR_FAILED,
        BUSBAR_INTERNAL,
    ];
    assert_eq!(statuses, [0, 1, 2, 3, 4, 5, 6]);
    let levels = [BUSBAR_LOG_ERROR, BUSBAR_LOG_WARNING, BUSBAR_LOG_INFO, BUSBAR_LOG_DEBUG];
    assert_eq!(levels, [1, 2, 3, 4]);
    assert_eq!(BUSBAR_ERROR_CAPACITY as usize, BusbarError::empty().message.len());
}

/// A capability is a draft until its layout is listed in this file.
#[test]
fn capabilities_are_drafts() {
    for id in [MESH_OPTIMIZER_ID, TELEMETRY_ID, OVERLAY_ID, SIMULATOR_ID, COMMAND_ID] {
        assert!(id.ends_with("-draft"), "{id}");
    }
}
