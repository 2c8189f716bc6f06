//! PLY files of scans: points and triangles, in text or binary; other elements are skipped.

use std::io::{BufRead, Read};
use std::path::Path;

use anyhow::{Context, Result, bail, ensure};
use busbar_geometry::{Mesh, RawPrimitive, weld};
use glam::Vec3;

/// Greatest number of points, or of faces.
const MAX_ELEMENTS: usize = 1 << 26;
/// Greatest number of lines of a header.
const MAX_HEADER_LINES: usize = 256;

/// Encoding of numbers in the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Form {
    Text,
    Big,
    Little,
}

/// Property of an element: its type, and the type of its length if a list.
#[derive(Clone, Debug)]
struct Property {
    kind: Kind,
    length: Option<Kind>,
    name: String,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Signed(usize),
    Unsigned(usize),
    Float,
    Double,
}

#[derive(Clone, Debug)]
struct Element {
    name: String,
    count: usize,
    properties: Vec<Property>,
}

/// Reads a mesh; its normals are smooth.
pub(crate) fn read(path: &Path) -> Result<Mesh> {
    mesh(&std::fs::read(path)?)
}

fn mesh(bytes: &[u8]) -> Result<Mesh> {
    let mut rest = bytes;
    let (form, elements) = header(&mut rest)?;
    let mut primitive = RawPrimitive::default();
    for element in &elements {
        for _ in 0..element.count {
            let values = row(&mut rest, form, element)
                .with_context(|| format!("element {} ends early", element.name))?;
            match element.name.as_str() {
                "vertex" => primitive.positions.push(point(element, &values)?),
                "face" => {
                    let corners = values.first().context("a face without corners")?;
                    let corners: Vec<u32> = corners.iter().map(|&v| v as u32).collect();
                    let fan = corners.windows(2).skip(1).map(|pair| [corners[0], pair[0], pair[1]]);
                    primitive.triangles.extend(fan);
                }
                _ => {}
            }
        }
    }
    primitive.normals = smooth_normals(&primitive)?;
    Ok(weld(&[primitive])?.0)
}

fn header(rest: &mut &[u8]) -> Result<(Form, Vec<Element>)> {
    let mut form = None;
    let mut elements: Vec<Element> = Vec::new();
    for _ in 0..MAX_HEADER_LINES {
        let mut line = String::new();
        rest.read_line(&mut line).context("the header is no text")?;
        let words: Vec<&str> = line.split_whitespace().collect();
        match words.as_slice() {
            ["format", "ascii", _] => form = Some(Form::Text),
            ["format", "binary_big_endian", _] => form = Some(Form::Big),
            ["format", "binary_little_endian", _] => form = Some(Form::Little),
            ["element", name, count] => {
                let count = count.parse().context("an element's count is no number")?;
                ensure!(count <= MAX_ELEMENTS, "{count} of {name}, at most {MAX_ELEMENTS}");
                elements.push(Element { name: (*name).to_owned(), count, properties: Vec::new() });
            }
            ["property", kinds @ .., name] => {
                let (kind, length) = match kinds {
                    ["list", length, kind] => (kind_of(kind)?, Some(kind_of(length)?)),
                    [kind] => (kind_of(kind)?, None),
                    _ => bail!("cannot read the header's line '{}'", line.trim()),
                };
                let element = elements.last_mut().context("a property before any element")?;
                element.properties.push(Property { kind, length, name: (*name).to_owned() });
            }
            ["end_header"] => return Ok((form.context("the header names no format")?, elements)),
            ["ply" | "comment" | "obj_info", ..] => {}
            _ => bail!("cannot read the header's line '{}'", line.trim()),
        }
    }
    bail!("the header does not end within {MAX_HEADER_LINES} lines")
}

fn kind_of(name: &str) -> Result<Kind> {
    Ok(match name {
        "char" | "int8" => Kind::Signed(1),
        "uchar" | "uint8" => Kind::Unsigned(1),
        "short" | "int16" => Kind::Signed(2),
        "ushort" | "uint16" => Kind::Unsigned(2),
        "int" | "int32" => Kind::Signed(4),
        "uint" | "uint32" => Kind::Unsigned(4),
        "float" | "float32" => Kind::Float,
        "double" | "float64" => Kind::Double,
        _ => bail!("unknown type {name}"),
    })
}

/// Reads the values of one element, a list for each property.
fn row(rest: &mut &[u8], form: Form, element: &Element) -> Result<Vec<Vec<f64>>> {
    let mut values = Vec::with_capacity(element.properties.len());
    for property in &element.properties {
        let count = match property.length {
            None => 1,
            Some(kind) => number(rest, form, kind)? as usize,
        };
        ensure!(count <= MAX_ELEMENTS, "a list of {count}, at most {MAX_ELEMENTS}");
        let list = (0..count).map(|_| number(rest, form, property.kind));
        values.push(list.collect::<Result<_>>()?);
    }
    Ok(values)
}

fn number(rest: &mut &[u8], form: Form, kind: Kind) -> Result<f64> {
    if form == Form::Text {
        *rest = rest.trim_ascii_start();
        let end = rest.iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len());
        let (word, after) = rest.split_at(end);
        *rest = after;
        return Ok(std::str::from_utf8(word)?.parse()?);
    }
    let size = match kind {
        Kind::Signed(size) | Kind::Unsigned(size) => size,
        Kind::Float => 4,
        Kind::Double => 8,
    };
    let mut bytes = [0; 8];
    rest.read_exact(&mut bytes[..size])?;
    if form == Form::Big {
        bytes[..size].reverse();
    }
    let bits = u64::from_le_bytes(bytes);
    let shift = 64 - 8 * size;
    Ok(match kind {
        Kind::Unsigned(_) => bits as f64,
        Kind::Signed(_) => ((bits << shift) as i64 >> shift) as f64,
        Kind::Float => f64::from(f32::from_bits(bits as u32)),
        Kind::Double => f64::from_bits(bits),
    })
}

fn point(element: &Element, values: &[Vec<f64>]) -> Result<Vec3> {
    let coordinate = |name: &str| -> Result<f32> {
        let index = element.properties.iter().position(|property| property.name == name);
        let value = index.and_then(|index| values[index].first());
        Ok(*value.with_context(|| format!("vertices have no {name}"))? as f32)
    };
    Ok(Vec3::new(coordinate("x")?, coordinate("y")?, coordinate("z")?))
}

/// Computes the normals of points, weighted by area.
fn smooth_normals(primitive: &RawPrimitive) -> Result<Vec<Vec3>> {
    let mut normals = vec![Vec3::ZERO; primitive.positions.len()];
    for (index, triangle) in primitive.triangles.iter().enumerate() {
        let point = |&v: &u32| primitive.positions.get(v as usize).copied();
        let [Some(a), Some(b), Some(c)] = triangle.each_ref().map(point) else {
            bail!("face {index} names a vertex that does not exist");
        };
        triangle.iter().for_each(|&v| normals[v as usize] += (b - a).cross(c - a));
    }
    Ok(normals.iter().map(|n| n.try_normalize().unwrap_or(Vec3::Y)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEADER: &str = "element vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
        property uchar red\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n";

    fn check(bytes: &[u8]) {
        let mesh = mesh(bytes).unwrap();
        assert_eq!(mesh.positions, [Vec3::ZERO, Vec3::X, Vec3::new(1.0, 1.0, 0.0), Vec3::Y]);
        assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
        assert!(mesh.wedges.normal.iter().all(|&n| n == Vec3::Z));
    }

    #[test]
    fn a_square_is_read_in_every_form() {
        let points = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
        let text = "0 0 0 9\n1 0 0 9\n1 1 0 9\n0 1 0 9\n4 0 1 2 3\n";
        check(format!("ply\nformat ascii 1.0\ncomment a\n{HEADER}{text}").as_bytes());
        for big in [false, true] {
            let name = if big { "big" } else { "little" };
            let mut bytes = format!("ply\nformat binary_{name}_endian 1.0\n{HEADER}").into_bytes();
            let float = |v: f32| if big { v.to_be_bytes() } else { v.to_le_bytes() };
            for point in points {
                point.iter().for_each(|&v| bytes.extend(float(v)));
                bytes.push(9);
            }
            bytes.push(4);
            for v in 0..4_i32 {
                bytes.extend(if big { v.to_be_bytes() } else { v.to_le_bytes() });
            }
            check(&bytes);
            bytes.pop();
            let error = format!("{:#}", mesh(&bytes).unwrap_err());
            assert!(error.contains("face ends early"), "{error}");
        }
    }

    #[test]
    fn what_is_no_ply_is_refused() {
        for bytes in [&b"solid\n"[..], b"ply\n", b"ply\nformat ascii 1.0\nelement vertex x\n"] {
            assert!(mesh(bytes).is_err());
        }
        let bad = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n\
            property float z\nelement face 1\nproperty list uchar int i\nend_header\n0 0 0\n3 0 0 1\n";
        let error = format!("{:#}", mesh(bad.as_bytes()).unwrap_err());
        assert!(error.contains("face 0"), "{error}");
    }
}
