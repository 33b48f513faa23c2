//! Mesh files that must be refused, with what the message must say, and odd ones that must be read.

mod gltf;

use gltf::{glb, glb_of, gltf, gltf_geometry, gltf_of};

/// A file that no reader may accept.
#[derive(Debug, Clone)]
pub struct BrokenFile {
    /// With the extension that says the format.
    pub name: &'static str,
    /// Its content.
    pub bytes: Vec<u8>,
    /// What the message must contain besides the file's name: the element and the value.
    pub expect: &'static str,
    /// Further files beside it.
    pub companions: Vec<(&'static str, Vec<u8>)>,
}

/// A file that is strange but holds a mesh.
#[derive(Debug, Clone)]
pub struct OddFile {
    /// With the extension that says the format.
    pub name: &'static str,
    /// Its content.
    pub bytes: Vec<u8>,
    /// Vertices that it has, before welding.
    pub vertices: usize,
    /// Triangles that it has.
    pub triangles: usize,
}

/// All broken files.
#[must_use]
pub fn broken_files() -> Vec<BrokenFile> {
    [general(), obj(), ply(), stl(), gltf(), gltf_geometry(), glb()].concat()
}

fn broken(name: &'static str, bytes: impl Into<Vec<u8>>, expect: &'static str) -> BrokenFile {
    BrokenFile { name, bytes: bytes.into(), expect, companions: Vec::new() }
}

fn general() -> Vec<BrokenFile> {
    vec![
        broken("mesh.fbx", "x", "\"fbx\" is no known extension"),
        broken("mesh", "v 0 0 0", "has no extension"),
        broken("empty.obj", "", "is empty (0 bytes)"),
        broken("empty.ply", "", "is empty (0 bytes)"),
        broken("empty.stl", "", "is empty (0 bytes)"),
        broken("empty.gltf", "", "is empty (0 bytes)"),
        broken("empty.glb", "", "is empty (0 bytes)"),
        broken("really_ply.obj", PLY, "the extension says OBJ, the content is PLY"),
        broken("really_glb.ply", glb_of(&[]), "the extension says PLY, the content is GLB"),
        broken(
            "really_gltf.glb",
            gltf_of(&[]),
            "the extension says GLB (binary glTF), the content is glTF (JSON)",
        ),
        broken("really_glb.gltf", glb_of(&[]), "rename it to end in .glb"),
        broken("really_stl.gltf", binary_stl(1), "the extension says glTF (JSON), the content is STL"),
    ]
}

const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";

fn obj() -> Vec<BrokenFile> {
    let with = |faces: &str| format!("{TRIANGLE}{faces}");
    vec![
        broken("beyond.obj", with("f 1 2 3\nf 1 2 4\n"), "face 2 uses vertex 4 of 3 (line 5)"),
        broken("zero.obj", with("f 0 1 2\n"), "face 1 uses vertex 0 of 3; OBJ counts from 1"),
        broken("before_first.obj", with("f -1 -2 -4\n"), "face 1 uses vertex -4 of 3 before it"),
        broken("texture.obj", with("vt 0 0\nf 1/1 2/2 3/1\n"), "face 1 uses texture coordinate 2 of 1"),
        broken("normal.obj", with("vn 0 0 1\nf 1//1 2//1 3//9\n"), "face 1 uses normal 9 of 1"),
        broken("corner.obj", with("f 1 2 x\n"), "face 1 has the corner \"x\""),
        broken(
            "huge_index.obj",
            with("f 1 2 99999999999999999999\n"),
            "has the corner \"99999999999999999999\"",
        ),
        broken("slashes.obj", with("f 1/1/1/1 2 3\n"), "has the corner \"1/1/1/1\""),
        broken("two_corners.obj", with("f 1 2\n"), "has no triangles (3 vertices)"),
        broken(
            "nan.obj",
            "v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n",
            "line 2: vertex 2 is not finite: [NaN, 0.0, 0.0]",
        ),
        broken(
            "infinite.obj",
            "v 0 0 1e999\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
            "vertex 1 is not finite: [0.0, 0.0, inf]",
        ),
        broken("flat.obj", "v 0 0 0\nv 1 0\n", "line 2: vertex 2 has 2 coordinates; it needs 3"),
        broken("comma.obj", "v 0 0 0\nv 1,5 0 0\n", "vertex 2 has the coordinate \"1,5\""),
        broken("not_utf8.obj", b"v 0 0 0\nv \xff\xfe 0 0\n", "line 2: vertex 2 has the coordinate"),
        broken("binary.obj", b"\x7fELF\x02\x01\x01\x00", "line 1: expected a statement"),
        broken("points.obj", "v 0 0 0\nv 1 0 0\np 1 2\n", "has no triangles (2 vertices)"),
        broken("truncated.obj", with("f 1 2 3\nv 1 "), "line 5: vertex 4 has 1 coordinates"),
    ]
}

const PLY: &str = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";

fn ply() -> Vec<BrokenFile> {
    let edited = |old: &str, new: &str| edit(PLY, old, new);
    let binary = |rows: &str| {
        edit(PLY, "ascii", "binary_little_endian").replace("vertex 3", &format!("vertex {rows}"))
    };
    let header_end = PLY.find("end_header\n").map_or(0, |i| i + 11);
    let mut short_list = binary("0").into_bytes()[..].to_vec();
    short_list.truncate(header_end + "binary_little_endian".len() - "ascii".len());
    short_list.extend([200, 0, 0, 0, 0]);
    vec![
        broken("magic.ply", "plyy\n", "line 1: expected \"ply\""),
        broken("version.ply", edited("1.0", "2.0"), "line 2: expected format"),
        broken("encoding.ply", edited("ascii", "utf8"), "found \"format utf8 1.0\""),
        broken("type.ply", edited("property float y", "property half y"), "line 5: expected property"),
        broken("negative_count.ply", edited("face 1", "face -1"), "line 7: expected element <name> <count>"),
        broken("header.ply", &PLY.as_bytes()[..60], "no \"end_header\" line"),
        broken("huge_count.ply", binary("4000000000"), "claims 4000000000 rows, at least 48000000000 bytes"),
        broken(
            "overflow.ply",
            binary("18446744073709551615"),
            "line 3: element \"vertex\" claims 18446744073709551615 rows",
        ),
        broken(
            "long_list.ply",
            short_list,
            "face 0: list \"vertex_indices\" claims 200 entries; only 4 bytes follow",
        ),
        broken(
            "truncated.ply",
            edited("0 1 0\n3 0 1 2\n", "0     1"),
            "vertex 2: the file ends before property \"z\"",
        ),
        broken("word.ply", edited("1 0 0", "1 a 0"), "line 11: vertex 1: property \"y\" is \"a\""),
        broken("short_row.ply", edited("1 0 0", "1 0"), "line 12: vertex 1: the line has more values"),
        broken("long_row.ply", edited("1 0 0", "1 0 0 0"), "line 11: vertex 1: the line has more values"),
        broken("nan.ply", edited("1 0 0", "1 nan 0"), "vertex 1: property \"y\" is not finite: NaN"),
        broken("beyond.ply", edited("3 0 1 2", "3 0 1 3"), "face 0 uses vertex 3 of 3"),
        broken("negative.ply", edited("3 0 1 2", "3 0 -1 2"), "face 0 uses vertex -1 of 3"),
        broken("two_corners.ply", edited("3 0 1 2", "2 0 1"), "has no triangles (3 vertices)"),
        broken("no_z.ply", edited("float z", "float w"), "element \"vertex\" has no scalar property \"z\""),
        broken("no_list.ply", edited("vertex_indices", "corners"), "has no list property \"vertex_indices\""),
        broken("cloud.ply", edited("face", "edge"), "has no element \"face\": a point cloud"),
        broken(
            "no_faces.ply",
            edited("face 1", "face 0").replace("3 0 1 2\n", ""),
            "has no triangles (3 vertices)",
        ),
    ]
}

fn binary_stl(facets: u32) -> Vec<u8> {
    let mut bytes = vec![b' '; 80];
    bytes.extend(facets.to_le_bytes());
    for _ in 0..facets {
        let numbers = [0.0_f32, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
        bytes.extend(numbers.iter().flat_map(|x| x.to_le_bytes()));
        bytes.extend([0, 0]);
    }
    bytes
}

fn stl() -> Vec<BrokenFile> {
    let ascii = "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid a\n";
    let mut claims = binary_stl(1);
    claims[80..84].copy_from_slice(&u32::MAX.to_le_bytes());
    let mut nan = binary_stl(2);
    nan[84 + 50 + 12..][..4].copy_from_slice(&f32::NAN.to_le_bytes());
    vec![
        broken("short.stl", vec![0; 83], "binary STL (84 bytes of header at least, there are 83)"),
        broken(
            "truncated.stl",
            &binary_stl(3)[..200],
            "claims 3 facets, 234 bytes in all, but the file has 200",
        ),
        broken("huge_count.stl", claims, "claims 4294967295 facets"),
        broken("no_facets.stl", binary_stl(0), "has no triangles"),
        broken("nan.stl", nan, "vertex 1 of facet 2 is not finite: [NaN, 0.0, 0.0]"),
        broken("ascii_truncated.stl", &ascii[..60], "the file ends in facet 1"),
        broken(
            "word.stl",
            edit(ascii, "vertex 1 0", "vertex 1 o"),
            "line 5: facet 1: expected a number, found \"o\"",
        ),
        broken(
            "square.stl",
            edit(ascii, "endloop", "vertex 1 1 0\nendloop"),
            "line 7: facet 1: expected endloop",
        ),
        broken(
            "infinite.stl",
            edit(ascii, "vertex 1 0", "vertex -inf 0"),
            "vertex 2 of facet 1 is not finite",
        ),
        broken("no_facets_ascii.stl", "solid a\nendsolid a\n", "has no triangles (0 vertices)"),
    ]
}

/// The text with one replacement, which must apply.
fn edit(text: &str, old: &str, new: &str) -> String {
    assert!(text.contains(old), "{old:?} is not in the text to edit");
    text.replacen(old, new, 1)
}

/// Files that are not pretty but hold a mesh: they are read, and what is bad in them is for the estimation to flag.
#[must_use]
pub fn odd_files() -> Vec<OddFile> {
    let odd = |name, bytes: &[u8], vertices, triangles| OddFile {
        name,
        bytes: bytes.to_vec(),
        vertices,
        triangles,
    };
    let quad = format!("{TRIANGLE}v 1 1 0\n");
    vec![
        odd("zero_area.obj", format!("{TRIANGLE}v 2 0 0\nf 1 2 4\nf 1 2 3\nf 1 1 2\n").as_bytes(), 4, 3),
        odd("duplicated.obj", format!("{quad}f 1 2 3\nf 1 2 3\nf 3 2 1\n").as_bytes(), 4, 3),
        odd("isolated.obj", format!("v 9 9 9\n{quad}f 2 3 4\n").as_bytes(), 5, 1),
        odd("unwelded.obj", format!("{TRIANGLE}{TRIANGLE}f 1 2 3\nf 4 5 6\n").as_bytes(), 6, 2),
        odd("point.obj", b"v 1 1 1\nf 1 1 1\n", 1, 1),
        odd("missing_mtl.obj", format!("mtllib none.mtl\nusemtl a\n{TRIANGLE}f 1 2 3\n").as_bytes(), 3, 1),
        odd("crossing.obj", b"v 0 0 0\nv 1 1 0\nv 1 0 0\nv 0 1 0\nf 1 2 3 4\n", 4, 2),
        odd("bom_crlf.obj", format!("\u{feff}{TRIANGLE}f 1 2 3\n").replace('\n', "\r\n").as_bytes(), 3, 1),
        odd("latin1.obj", &[b"# caf\xe9\n", TRIANGLE.as_bytes(), b"f 1 2 3"].concat(), 3, 1),
        odd("UPPER.OBJ", format!("{TRIANGLE}f 1 2 3\n").as_bytes(), 3, 1),
        odd("zero_area.ply", edit(PLY, "0 1 0", "2 0 0").as_bytes(), 3, 1),
        odd("solid.stl", &[b"solid ", &binary_stl(2)[6..]].concat(), 6, 2),
        odd("trailing.stl", &[&binary_stl(1)[..], b"\n"].concat(), 3, 1),
        odd("fine.glb", &glb_of(&[]), 3, 1),
        odd("flat_scale.glb", &glb_of(&[("\"mesh\":0", "\"mesh\":0,\"scale\":[1,0,1]")]), 3, 1),
    ]
}
