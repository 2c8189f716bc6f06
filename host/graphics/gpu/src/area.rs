//! Rectangular parts of images, in pixels.

use ash::vk;

use crate::Image;

/// A part of an image, pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ImageArea {
    /// Upper left pixel of the part.
    pub origin: [u32; 2],
    /// Width and height of the part.
    pub size: [u32; 2],
}

impl ImageArea {
    /// Returns the area of a whole image.
    pub fn whole(image: &Image) -> Self {
        Self { origin: [0; 2], size: image.size() }
    }

    /// Reports whether the area is not empty and lies within an image of a size.
    pub fn is_within(self, size: [u32; 2]) -> bool {
        let ends = [0, 1].map(|axis| self.origin[axis].checked_add(self.size[axis]));
        let fits = |(end, most): (Option<u32>, u32)| end.is_some_and(|end| end <= most);
        !self.size.contains(&0) && ends.into_iter().zip(size).all(fits)
    }

    pub(crate) fn to_rect(self) -> vk::Rect2D {
        let ([x, y], [width, height]) = (self.origin.map(u32::cast_signed), self.size);
        vk::Rect2D { offset: vk::Offset2D { x, y }, extent: vk::Extent2D { width, height } }
    }
}
