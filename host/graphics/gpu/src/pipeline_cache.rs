//! Pipeline cache on disk: compiled pipelines, so that the next start compiles nothing.
//!
//! A file is used only where device, driver and checksum are those that it was
//! written for; anything else is ignored and written anew. Failures cost time,
//! never a picture.

use std::fs::File;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};

use ash::vk;
use twox_hash::XxHash3_128;

use crate::GpuError;
use crate::error::vulkan_error;

/// The most that is read or written.
const MAX_BYTES: usize = 64 << 20;
const MAGIC: [u8; 8] = *b"BUSBARPC";
const VERSION: u32 = 1;
/// Magic, version, who compiled, checksum.
const HEADER_BYTES: usize = 8 + 4 * 4 + 16 + CHECKSUM_BYTES;
const CHECKSUM_BYTES: usize = size_of::<u128>();

/// Identity of device and driver: compiled pipelines are of no use to any other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Compiler {
    vendor: u32,
    device: u32,
    driver: u32,
    uuid: [u8; 16],
}

impl Compiler {
    fn header(&self, checksum: u128) -> Vec<u8> {
        let mut header = Vec::with_capacity(HEADER_BYTES);
        header.extend(MAGIC);
        for number in [VERSION, self.vendor, self.device, self.driver] {
            header.extend(number.to_le_bytes());
        }
        header.extend(self.uuid);
        header.extend(checksum.to_le_bytes());
        header
    }

    fn seal(&self, data: &[u8]) -> Vec<u8> {
        let mut file = self.header(checksum_of(data));
        file.extend_from_slice(data);
        file
    }

    /// Returns the data of a file, or the reason why it is of no use.
    fn open<'a>(&self, file: &'a [u8]) -> Result<&'a [u8], &'static str> {
        let (header, data) = file.split_at_checked(HEADER_BYTES).ok_or("it is cut short")?;
        if header == self.header(checksum_of(data)) {
            return Ok(data);
        }
        let is_ours = header.starts_with(&self.header(0)[..HEADER_BYTES - CHECKSUM_BYTES]);
        Err(if is_ours { "it is damaged" } else { "it is of another device or driver" })
    }
}

/// A device's pipeline cache, and where it is kept.
pub(crate) struct PipelineCache {
    pub(crate) raw: vk::PipelineCache,
    compiler: Compiler,
    file: Option<PathBuf>,
    /// Checksum of the data in the file.
    kept: Option<u128>,
}

impl PipelineCache {
    /// Reads the cache of a folder; without a folder the cache is not persistent.
    pub(crate) fn open(
        device: &ash::Device,
        properties: &vk::PhysicalDeviceProperties,
        folder: Option<&Path>,
    ) -> Self {
        let compiler = Compiler {
            vendor: properties.vendor_id,
            device: properties.device_id,
            driver: properties.driver_version,
            uuid: properties.pipeline_cache_uuid,
        };
        let name = format!("pipelines-{:x}-{:x}.bin", compiler.vendor, compiler.device);
        let mut cache = Self {
            raw: vk::PipelineCache::null(),
            compiler,
            file: folder.map(|folder| folder.join(name)),
            kept: None,
        };
        let Some(path) = &cache.file else { return cache };
        let file = read(path).unwrap_or_default();
        let data = match compiler.open(&file) {
            Ok(data) => data,
            Err(_) if file.is_empty() => &[],
            Err(reason) => {
                tracing::info!("{} is written anew: {reason}", path.display());
                &[]
            }
        };
        cache.kept = Some(checksum_of(data)).filter(|_| !data.is_empty());
        let info = vk::PipelineCacheCreateInfo::default().initial_data(data);
        // SAFETY: the device lives; the data are what this driver gave, which it
        // checks besides. Without a cache, all is compiled.
        cache.raw = unsafe { device.create_pipeline_cache(&info, None) }
            .inspect_err(|error| tracing::info!("no pipeline cache: {error}"))
            .unwrap_or_default();
        cache
    }

    /// Writes pipelines compiled since the last write, if any.
    pub(crate) fn save(&mut self, device: &ash::Device) -> Result<(), GpuError> {
        let Some(path) = self.file.as_ref().filter(|_| self.raw != vk::PipelineCache::null())
        else {
            return Ok(());
        };
        // SAFETY: the cache is this device's.
        let data = unsafe { device.get_pipeline_cache_data(self.raw) }
            .map_err(vulkan_error("reading compiled pipelines"))?;
        let checksum = checksum_of(&data);
        if self.kept == Some(checksum) || data.is_empty() || data.len() > MAX_BYTES - HEADER_BYTES {
            return Ok(());
        }
        match write(path, &self.compiler.seal(&data)) {
            Ok(()) => self.kept = Some(checksum),
            Err(error) => tracing::info!("{} is not kept: {error}", path.display()),
        }
        Ok(())
    }
}

fn read(path: &Path) -> std::io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    File::open(path)?.take(MAX_BYTES as u64).read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// Writes a file whole or not at all.
fn write(path: &Path, bytes: &[u8]) -> std::io::Result<()> {
    let temporary = path.with_extension(format!("{}.tmp", std::process::id()));
    let written = File::create(&temporary)
        .and_then(|mut file| file.write_all(bytes).and_then(|()| file.sync_all()))
        .and_then(|()| std::fs::rename(&temporary, path));
    written.inspect_err(|_| {
        let _ = std::fs::remove_file(&temporary);
    })
}

/// Finds damage, not malice: the folder is the user's alone.
fn checksum_of(bytes: &[u8]) -> u128 {
    XxHash3_128::oneshot(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    const OURS: Compiler = Compiler { vendor: 0x10005, device: 0, driver: 1, uuid: [7; 16] };

    #[test]
    fn only_the_same_driver_gets_what_was_kept() {
        let file = OURS.seal(b"pipelines");
        assert_eq!(OURS.open(&file), Ok(b"pipelines".as_slice()));
        let others = [
            Compiler { vendor: 1, ..OURS },
            Compiler { device: 1, ..OURS },
            Compiler { driver: 2, ..OURS },
            Compiler { uuid: [8; 16], ..OURS },
        ];
        for other in others {
            assert_eq!(other.open(&file), Err("it is of another device or driver"));
        }
    }

    #[test]
    fn every_changed_byte_and_every_cut_is_found() {
        let file = OURS.seal(b"pipelines");
        for index in 0..file.len() {
            let mut damaged = file.clone();
            damaged[index] ^= 0x10;
            assert!(OURS.open(&damaged).is_err(), "byte {index}");
            assert!(OURS.open(&file[..index]).is_err(), "{index} bytes");
        }
    }
}
