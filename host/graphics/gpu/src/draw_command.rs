//! Layout of one indirect draw command in memory.

/// Indirect draw command (VkDrawIndexedIndirectCommand): indices, instances, first index, first
/// vertex, first instance.
pub(crate) type IndirectCommand = [u32; 5];

/// Bytes from one call to the next.
pub(crate) const COMMAND_BYTES: u32 = size_of::<IndirectCommand>() as u32;
