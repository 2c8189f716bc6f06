//! Images that lie, and little text or few bytes that would become much.

use serde_json::json;

use super::super::ktx2::{RGBA8_UNORM, zstandard};
use super::super::{Builder, data_uri, png_claiming, shorts, square_with_image};
use super::{Cases, add};

/// Images that cannot be shown: checkers stand in for them.
pub fn broken_images(c: &mut Cases) {
    add(
        c,
        "pixels from nothing",
        square_with_image(&png_claiming(8000, 8000)).bytes(),
        &["/images/0", "an image of its size needs 248063 bytes"],
    );
    add(
        c,
        "60000 pixels a side",
        square_with_image(&png_claiming(60_000, 60_000)).bytes(),
        &["/images/0", "an image of its size needs 13953489 bytes"],
    );
    add(
        c,
        "cut image",
        square_with_image(&png_claiming(100, 100)).bytes(),
        &["/images/0", "save the image as PNG or JPEG again"],
    );
    add(c, "no pixels", square_with_image(&png_claiming(0, 10)).bytes(), &["/images/0"]);
    add(c, "no image", square_with_image(b"GIF89a\x01\0\x01\0\0\0\0").bytes(), &["/images/0"]);
    add(c, "nothing", square_with_image(b"").bytes(), &["/images/0"]);
    let mut without = square_with_image(b"");
    without.json["images"] = json!([{}]);
    add(c, "an image from nowhere", without.bytes(), &["/images/0", "neither a URI nor"]);
    let mut text = square_with_image(b"");
    text.json["images"] = json!([{ "uri": data_uri(b"hello") }]);
    add(c, "text for an image", text.bytes(), &["/images/0"]);
    // Large, and whole but for its last bytes.
    let side = 8192;
    let mut png = Vec::new();
    let pixels = image::GrayImage::new(side, side);
    pixels.write_to(&mut std::io::Cursor::new(&mut png), image::ImageFormat::Png).unwrap();
    png.truncate(png.len() - 64);
    add(c, "67 million pixels less a few", square_with_image(&png).bytes(), &["/images/0", "PNG"]);
    let size = [8192, 2048];
    let mut ktx2 = zstandard(RGBA8_UNORM, size, &vec![0; 4 * 8192 * 2048 - 4]);
    add(c, "64 MB less a pixel", square_with_image(&ktx2).bytes(), &["/images/0", "Zstandard"]);
    // Its level index says how long it is; the rest is noise.
    let noise = ktx2.len() / 2;
    ktx2[noise..].fill(0xA5);
    add(c, "64 MB of noise", square_with_image(&ktx2).bytes(), &["/images/0", "Zstandard"]);
}

pub fn floods(c: &mut Cases) {
    let list = |key: &str, element: &str, count: usize| {
        let elements = vec![element; count].join(",");
        format!(r#"{{"asset":{{"version":"2.0"}},"{key}":[{elements}]}}"#).into_bytes()
    };
    add(
        c,
        "nodes",
        list("nodes", r#"{"name":"a bushing of a bank of transformers"}"#, 1_000_001),
        &["/nodes/1000000", "1000001 nodes"],
    );
    for key in ["buffers", "materials", "textures", "samplers", "meshes", "scenes", "skins"] {
        add(c, "a list", list(key, "{}", 2_000_000), &["bytes of parsed JSON"]);
    }
    add(
        c,
        "names of extensions",
        list("extensionsUsed", r#""""#, 3_000_000),
        &["/extensionsUsed/", "bytes of parsed JSON"],
    );
    let primitives = vec![r#"{"attributes":{"POSITION":0}}"#; 500_000].join(",");
    let mesh = format!(r#"{{"primitives":[{primitives}]}}"#);
    let crowd =
        format!(r#"{{"asset":{{"version":"2.0"}},"nodes":[{{"mesh":0}}],"meshes":[{mesh}]}}"#);
    let expected = &["/meshes/0/primitives", "262145 items in one place, and the limit is 262144"];
    add(c, "primitives", crowd.into_bytes(), expected);

    let mut again = Builder::square();
    let primitive = again.primitive().clone();
    again.json["meshes"][0]["primitives"] = json!(vec![primitive; 40_000]);
    add(
        c,
        "one primitive 40000 times",
        again.bytes(),
        &["/meshes/0/primitives/32768", "65538 triangles for the bytes there are"],
    );

    // 800 accessors of 100,000 vertices, over the same bytes.
    let mut aliases = Builder::new();
    let view = aliases.view(&vec![0; 1_200_000]);
    let accessor = |i: usize| json!({ "bufferView": view, "componentType": 5126, "type": "VEC3", "count": 100_000 - i });
    aliases.json["accessors"] = (0..800).map(accessor).collect();
    let indices = aliases.accessor(&shorts(&[0, 1, 2]), 5123, "SCALAR", 3);
    let primitive = |i| json!({ "attributes": { "POSITION": i }, "indices": indices });
    aliases.json["meshes"][0]["primitives"] = (0..800).map(primitive).collect();
    add(
        c,
        "accessors over the same bytes",
        aliases.bytes(),
        &["/accessors/12", "elements for the bytes there are, and the limit is 1200006"],
    );

    // As much as the scan lets through, and the fault at the very end.
    let mut crowd = vec![r#"{"name":"bushing"}"#; 60_000];
    crowd.push(r#"{"children":[0,70000]}"#);
    add(
        c,
        "60000 nodes, the last at fault",
        list("nodes", &crowd.join(","), 1),
        &["/nodes/60000/children/1"],
    );
    let mut crowd = Builder::square();
    let mut materials = vec![json!({}); 40_000];
    materials.push(json!({ "alphaMode": "GLASS" }));
    crowd.json["materials"] = json!(materials);
    crowd.primitive()["material"] = json!(40_000);
    add(c, "40000 materials, the last at fault", crowd.bytes(), &["/materials/40000/alphaMode"]);
    let long = "x".repeat(20_000_000);
    let name = format!(r#"{{"name":"\u0041{long}"}}"#);
    add(
        c,
        "a name of 20 MB, and nothing else",
        list("nodes", &name, 2)[..40_000_000].to_vec(),
        &["/nodes", "EOF"],
    );
    let mut large = Builder::square();
    large.view(&vec![0; 20_000_000]);
    large.json["accessors"][1]["count"] = json!(7);
    add(c, "20 MB of data, and a fault", large.bytes(), &["/accessors/1", "14 bytes"]);
}
