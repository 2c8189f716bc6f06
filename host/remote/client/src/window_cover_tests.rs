use super::*;

/// Masks of a visual; the rest of it does not matter.
fn visual([red_mask, green_mask, blue_mask]: [u32; 3]) -> Visualtype {
    Visualtype { red_mask, green_mask, blue_mask, ..Visualtype::default() }
}

#[test]
fn shades_are_grey_and_opaque_in_any_visual() {
    for (masks, depth, white, dark) in [
        ([0xff_0000, 0xff00, 0xff], 24, 0xff_ffff, 0x48_4848),
        ([0xff_0000, 0xff00, 0xff], 32, 0xffff_ffff, 0xff48_4848),
        ([0xff, 0xff00, 0xff_0000], 32, 0xffff_ffff, 0xff48_4848),
        ([0xf800, 0x7e0, 0x1f], 16, 0xffff, 0x4a49),
        ([0x3ff0_0000, 0xf_fc00, 0x3ff], 30, 0x3fff_ffff, 0x1214_8521),
    ] {
        let shades = Shades::new(Some(&visual(masks)), depth);
        assert_eq!(shades.pixel(0xff), white, "{masks:x?} {depth}");
        assert_eq!(shades.pixel(GROUND), dark, "{masks:x?} {depth}");
    }
    let palette = Shades::new(None, 8);
    assert_eq!([GROUND, LIGHT].map(|shade| palette.pixel(shade)), [0, 1]);
}

#[test]
fn stripes_fit_at_the_edges_of_tiles() {
    let stripes = stripes();
    assert_eq!(stripes.len(), usize::from(PERIOD * STRIPE));
    let is_light =
        |x: u16, y: u16| stripes.iter().any(|pixel| (pixel.x, pixel.y) == (x as i16, y as i16));
    for at in 0..PERIOD {
        let (last, next) = (PERIOD - 1, (at + 1) % PERIOD);
        assert_eq!(is_light(last, next), is_light(0, at), "one pixel right and one up");
    }
}

#[test]
fn a_text_stands_in_the_middle_and_within_its_box() {
    let text = "NO LIVE PICTURE SINCE 12:34:56";
    for size in [[640_u16, 360], [300, 200], [1920, 1080], [40, 30], [1, 1], [8192, 8192]] {
        let (ground, glyphs) = text_rectangles(text, size);
        assert!(glyphs.len() > 200, "each letter has some pixels");
        for pixel in &glyphs {
            let is_within = pixel.x >= ground.x
                && pixel.y >= ground.y
                && i32::from(pixel.x) + i32::from(pixel.width)
                    <= i32::from(ground.x) + i32::from(ground.width)
                && i32::from(pixel.y) + i32::from(pixel.height)
                    <= i32::from(ground.y) + i32::from(ground.height);
            assert!(is_within, "{size:?}: {pixel:?} {ground:?}");
        }
        if size[0] >= 300 {
            assert!(ground.x > 0 && ground.width < size[0], "{size:?}: {ground:?}");
        }
    }
    let (small, _) = text_rectangles(text, [640, 360]);
    let (large, _) = text_rectangles(text, [1920, 1080]);
    assert!(small.width > 300 && large.width > 700, "{small:?} {large:?}");
}
