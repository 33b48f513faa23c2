//! Material libraries of OBJ files.

use std::collections::HashSet;

use super::lines::{logical_lines, number, split_keyword, words};
use crate::Material;
use crate::io::files::{Resolver, Textures};
use crate::io::warnings::Warnings;

/// The libraries that a file names, read once each. Nothing in them makes the mesh unreadable: what is missing or makes no
/// sense is a warning.
pub(super) struct Libraries<'a> {
    pub resolver: &'a Resolver<'a>,
    pub warnings: Warnings,
    pub read: HashSet<String>,
}

impl Libraries<'_> {
    /// The materials of an `mtllib` line, which may name one file with spaces in its name or several files.
    pub fn load(&mut self, names: &str) -> tobj::MTLLoadResult {
        let names = names.replace('\\', "/");
        if names.is_empty() || !self.read.insert(names.clone()) {
            return tobj::load_mtl_buf(&mut &b""[..]);
        }
        let mut text = String::new();
        match (self.resolver)(&names) {
            Ok(bytes) => prepare(&bytes, &names, &mut text, &mut self.warnings),
            Err(error) => self.load_each(&names, &error, &mut text),
        }
        tobj::load_mtl_buf(&mut text.as_bytes())
    }

    fn load_each(&mut self, names: &str, error: &std::io::Error, text: &mut String) {
        let pieces: Vec<&str> = names.split_whitespace().collect();
        let found: Vec<_> = pieces.iter().map(|name| (self.resolver)(name)).collect();
        let any = pieces.len() > 1 && found.iter().any(Result::is_ok);
        if !any {
            self.warnings.add("mtl", || format!("material library {names:?} is left out: {error}"));
            return;
        }
        for (name, bytes) in pieces.iter().zip(found) {
            match bytes {
                Ok(bytes) => prepare(&bytes, name, text, &mut self.warnings),
                Err(e) => self.warnings.add("mtl", || format!("material library {name:?} is left out: {e}")),
            }
        }
    }
}

/// Copies the statements that are used, in a form that `tobj` accepts: it refuses a whole library for one bad value, and
/// panics on a colour of fewer than three numbers.
fn prepare(bytes: &[u8], library: &str, text: &mut String, warnings: &mut Warnings) {
    for (line, statement) in logical_lines(bytes) {
        let (keyword, rest) = split_keyword(&statement);
        let name = String::from_utf8_lossy(rest).replace(['\r', '\n'], " ");
        let prepared = match keyword {
            b"newmtl" if !rest.is_empty() => Some(format!("newmtl {name}\n")),
            b"Kd" => color(rest).map(|[r, g, b]| format!("Kd {r} {g} {b}\n")),
            b"Ns" => finite(rest).map(|x| format!("Ns {x}\n")),
            b"Pr" => finite(rest).map(|x| format!("Pr {x}\n")),
            b"Pm" => finite(rest).map(|x| format!("Pm {x}\n")),
            b"map_Kd" => texture_name(&name).map(|file| format!("map_Kd {file}\n")),
            b"newmtl" => None,
            _ => continue,
        };
        match prepared {
            Some(statement) => text.push_str(&statement),
            None => warnings.add("mtl statement", || {
                format!("{library}: line {line}: {:?} is left out", String::from_utf8_lossy(&statement))
            }),
        }
    }
    text.push('\n');
}

fn finite(rest: &[u8]) -> Option<f64> {
    words(rest).next().and_then(number).filter(|x: &f64| x.is_finite())
}

/// One number stands for grey.
fn color(rest: &[u8]) -> Option<[f64; 3]> {
    let numbers: Option<Vec<f64>> =
        words(rest).take(3).map(|w| number(w).filter(|x: &f64| x.is_finite())).collect();
    match numbers?[..] {
        [grey] => Some([grey; 3]),
        [r, g, b] => Some([r, g, b]),
        _ => None,
    }
}

/// The file name behind the options of a texture statement; it may hold spaces.
fn texture_name(rest: &str) -> Option<String> {
    let mut rest = rest.trim();
    while rest.starts_with('-') {
        let (option, after) = rest.split_once(char::is_whitespace)?;
        let (least, most) = match option {
            "-o" | "-s" | "-t" => (1, 3),
            "-mm" => (2, 2),
            _ => (1, 1),
        };
        rest = after.trim_start();
        for i in 0..most {
            let (word, after) = rest.split_once(char::is_whitespace).unwrap_or((rest, ""));
            if i >= least && word.parse::<f64>().is_err() {
                break;
            }
            rest = after.trim_start();
        }
    }
    (!rest.is_empty()).then(|| rest.replace('\\', "/"))
}

/// What a `tobj` material means to a renderer.
pub(super) fn convert(
    material: &tobj::Material,
    resolver: &Resolver<'_>,
    textures: &mut Textures,
    warnings: &mut Warnings,
) -> Material {
    let default = Material::default();
    let parameter = |name: &str| material.unknown_param.get(name).and_then(|x| x.parse::<f64>().ok());
    let texture = material.diffuse_texture.as_deref().and_then(|name| match resolver(name) {
        Ok(bytes) => textures.accept(name, bytes, warnings),
        Err(error) => {
            warnings.add("texture", || format!("texture {name:?} is left out: {error}"));
            None
        }
    });
    // A texture without colour is not to be darkened by the default grey.
    let plain = if texture.is_some() { [1.0; 3] } else { default.base_color };
    Material {
        name: material.name.clone(),
        base_color: material.diffuse.map_or(plain, |c| c.map(unit)),
        metallic: parameter("Pm").map_or(default.metallic, unit),
        roughness: parameter("Pr")
            .or(material.shininess.map(roughness_from_exponent))
            .map_or(default.roughness, unit),
        base_color_texture: texture,
    }
}

#[expect(clippy::cast_possible_truncation, reason = "materials are f32 and the value is in [0, 1]")]
fn unit(x: f64) -> f32 {
    x.clamp(0.0, 1.0) as f32
}

/// The roughness whose highlight is as wide as that of a Phong lobe: `alpha^2 = 2 / (Ns + 2)`, `alpha = roughness^2`
/// (Walter, Marschner, Li, Torrance: Microfacet Models for Refraction, EGSR 2007).
fn roughness_from_exponent(exponent: f64) -> f64 {
    (2.0 / (exponent.max(0.0) + 2.0)).sqrt().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texture_options_are_passed_over() {
        assert_eq!(texture_name("a b.png").unwrap(), "a b.png");
        assert_eq!(texture_name("-s 1 2 3 -clamp on -o 0.5 tex\\a.png").unwrap(), "tex/a.png");
        assert_eq!(texture_name("-mm 0 1 x.jpg").unwrap(), "x.jpg");
        assert!(texture_name("-s 1 1 1").is_none());
        assert!(texture_name("").is_none());
    }

    #[test]
    fn bad_statements_do_not_spoil_the_library() {
        let mtl = b"newmtl a\nKd 0.5\nKd 1 x 0\nNs nan\nnewmtl\nPm 1\nmap_Kd none.png\nillum x\nnewmtl b c\nKd .1 .2 .3\nNs 0\n";
        let files = |name: &str| if name == "x.mtl" { Ok(mtl.to_vec()) } else { crate::io::no_files(name) };
        let mut libraries =
            Libraries { resolver: &files, warnings: Warnings::default(), read: HashSet::new() };
        let (materials, _) = libraries.load("x.mtl").unwrap();
        assert_eq!(materials.len(), 2);
        let mut warnings = Warnings::default();
        let convert = |m, w: &mut Warnings| convert(m, &files, &mut Textures::default(), w);
        let a = convert(&materials[0], &mut warnings);
        assert_eq!((a.base_color, a.metallic, a.roughness), ([0.5; 3], 1.0, 0.6));
        let b = convert(&materials[1], &mut warnings);
        assert_eq!((b.name.as_str(), b.base_color, b.roughness), ("b c", [0.1, 0.2, 0.3], 1.0));
        assert!(warnings.into_lines()[0].starts_with("texture \"none.png\" is left out"));
        let lines = libraries.warnings.into_lines();
        assert_eq!(lines, ["x.mtl: line 3: \"Kd 1 x 0\" is left out (and 2 more like it)"]);
    }
}
