"""Writes the seed corpora, one small valid file per feature, to corpus/<target>/. Python 3, standard library only."""

import io
import json
import math
import pathlib
import struct
import zipfile
import zlib

HERE = pathlib.Path(__file__).parent
QUAD = [(0, 0, 0), (1, 0, 0), (1, 1, 0.5), (0, 1, 0)]


def write(target, name, data):
    directory = HERE / "corpus" / target
    directory.mkdir(parents=True, exist_ok=True)
    (directory / name).write_bytes(data if isinstance(data, bytes) else data.encode())


def obj():
    v = "".join(f"v {x} {y} {z}\n" for x, y, z in QUAD)
    write("obj", "triangle", v + "f 1 2 3\n")
    write("obj", "all", "mtllib a.mtl\no part\n" + v + "vt 0 0\nvt 1 1\nvn 0 0 1\nusemtl m\nf 1/1/1 2/2/1 3//1 4\n"
          "g two\ns off\nf -4 -3 -2\nl 1 2\n# end\\\nmore\n\0newmtl m\nKd 1 .5 0\nNs 9\nPr .1\nPm 1\nmap_Kd -s 1 1 t.png\n")
    concave = [(0, 0), (2, 0), (4, 0), (4, 4), (2, 1), (0, 4)]
    write("obj", "concave", "".join(f"v {x} {y} 0\n" for x, y in concave) + "f 1 2 3 4 5 6\n")
    ring = [(0, 0), (4, 0), (4, 4), (0, 4), (1, 1), (1, 3), (3, 3), (3, 1)]
    write("obj", "keyhole", "".join(f"v {x} {y} 0\n" for x, y in ring) + "f 1 2 3 4 1 5 6 7 8 5\n")
    write("obj", "crossing", "".join(f"v {x} {y} 0\n" for x, y in ring) + "f 1 3 2 4 8 6 7\nf 1 2 2 1\n")


def ply():
    head = ("ply\nformat {} 1.0\ncomment TextureFile a.png\nelement vertex 4\nproperty float x\nproperty float y\n"
            "property double z\nproperty uchar red\nproperty float s\nproperty float t\nelement face 2\n"
            "property list uchar int vertex_indices\nproperty list uchar float texcoord\nelement other 1\n"
            "property list int short q\nend_header\n")
    rows = "".join(f"{x} {y} {z} 255 0 1\n" for x, y, z in QUAD)
    write("ply", "ascii", head.format("ascii") + rows + "3 0 1 2 6 0 0 1 0 1 1\n4 0 1 2 3 0\n2 7 8\n")
    for name, e in (("little", "<"), ("big", ">")):
        body = b"".join(struct.pack(e + "ffdBff", x, y, z, 1, 0, 1) for x, y, z in QUAD)
        body += struct.pack(e + "B3iB6f", 3, 0, 1, 2, 6, 0, 0, 1, 0, 1, 1) + struct.pack(e + "B4iB", 4, 0, 1, 2, 3, 0)
        write("ply", name, head.format(f"binary_{name}_endian").encode() + body + struct.pack(e + "ihh", 2, 7, 8))
    strips = ("ply\r\nformat ascii 1.0\r\nelement vertex 4\r\nproperty float x\r\nproperty float y\r\nproperty float z\r\n"
              "element tristrips 1\r\nproperty list int int vertex_indices\r\nend_header\r\n")
    write("ply", "strips", strips + "0 0 0\n1 0 0\n0 1 0\n1 1 1\n8 0 1 2 3 -1 2 1 3\n")


def stl():
    facet = (0,) * 3 + QUAD[0] + QUAD[1] + QUAD[2]
    write("stl", "binary", b"solid".ljust(80) + struct.pack("<I", 2) + 2 * struct.pack("<12fH", *facet, 0))
    text = "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1e0 0\nendloop\nendfacet\n"
    write("stl", "ascii", f"solid a\n{text}{text}endsolid a\nsolid b\n{text}endsolid\n")


def gltf():
    binary = b"".join(struct.pack("<3f", *p) for p in QUAD) + struct.pack("<6H", 0, 1, 2, 0, 2, 3)
    binary += bytes([0, 0, 255, 0, 255, 255, 0, 255]) + struct.pack("<12b", *([0, 0, 127] * 4))
    doc = {
        "asset": {"version": "2.0"},
        "extensionsUsed": ["KHR_mesh_quantization"],
        "scene": 0,
        "scenes": [{"nodes": [0, 2]}],
        "nodes": [{"children": [1], "rotation": [0, 0, 0.6, 0.8], "scale": [1, -2, 1]}, {"mesh": 0, "name": "n"},
                  {"mesh": 0, "matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 5, 5, 5, 1]}],
        "meshes": [{"name": "m", "primitives": [
            {"attributes": {"POSITION": 0, "NORMAL": 3, "TEXCOORD_0": 2}, "indices": 1, "material": 0},
            {"attributes": {"POSITION": 4}, "mode": 5}, {"attributes": {"POSITION": 0}, "mode": 6}]}],
        "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
        "textures": [{"source": 0}],
        "images": [{"bufferView": 2}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5123, "count": 6, "type": "SCALAR"},
            {"bufferView": 2, "componentType": 5121, "count": 4, "type": "VEC2", "normalized": True},
            {"bufferView": 3, "componentType": 5120, "count": 4, "type": "VEC3", "normalized": True},
            {"componentType": 5126, "count": 4, "type": "VEC3", "sparse": {
                "count": 2, "indices": {"bufferView": 1, "byteOffset": 2, "componentType": 5123},
                "values": {"bufferView": 0, "byteOffset": 12}}}],
        "bufferViews": [{"buffer": 0, "byteLength": 48}, {"buffer": 0, "byteOffset": 48, "byteLength": 12},
                        {"buffer": 0, "byteOffset": 60, "byteLength": 8},
                        {"buffer": 0, "byteOffset": 68, "byteLength": 12, "byteStride": 3}],
        "buffers": [{"byteLength": len(binary)}],
    }
    text = json.dumps(doc, separators=(",", ":")).encode()
    write("glb", "split", text + b"\0" + binary)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(binary), b"BIN\0") + binary
    write("glb", "whole", b"glTF" + struct.pack("<II", 2, 12 + len(chunks)) + chunks)
    doc["buffers"] = [{"byteLength": len(binary), "uri": "a%20b.bin"}]
    doc["images"] = [{"uri": "c.png"}]
    write("gltf", "external", json.dumps(doc, separators=(",", ":")).encode() + b"\0" + binary)
    doc["buffers"] = [{"byteLength": 3, "uri": "data:;base64,AAAA"}]
    doc["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = 4
    write("gltf", "data_uri", json.dumps(doc, indent=1))


def npy(values, descr, code, shape):
    """One array in numpy's own format, version 1.0."""
    head = f"{{'descr': '{descr}', 'fortran_order': False, 'shape': {shape}, }}"
    head += " " * (-(len(head) + 11) % 64) + "\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(head)) + head.encode() + struct.pack(f"<{len(values)}{code}", *values)


def npz():
    meta = json.dumps({"libigl": "2.6.3", "source": "quad", "command": ""}).encode()
    flat = [float(x) for row in QUAD for x in row]
    arrays = {"V": (flat, "<f8", "d", "(4, 3)"), "F": ([0, 1, 2, 0, 2, 3], "<i4", "i", "(2, 3)"),
              "meta": (list(meta), "|u1", "B", f"({len(meta)},)")}
    for setting in ("r2", "s5"):
        arrays |= {f"{setting}_{k}": ([1.0, 2.0, 3.0, 4.0], "<f8", "d", "(4,)") for k in ("kmax", "kmin", "cond")}
        arrays |= {f"{setting}_{d}": (flat, "<f8", "d", "(4, 3)") for d in ("d1", "d2")}
        arrays[f"{setting}_bad"] = ([3], "<i4", "i", "(1,)")
    for name, method in (("stored", zipfile.ZIP_STORED), ("deflated", zipfile.ZIP_DEFLATED)):
        archive = io.BytesIO()
        with zipfile.ZipFile(archive, "w", method) as file:
            for array, values in arrays.items():
                file.writestr(zipfile.ZipInfo(array + ".npy"), npy(*values), compress_type=method)
        write("npz", name, archive.getvalue())


PROVENANCE = {"format_version": 1, "tool": "osculate 0.1.0", "source": {"file": "q.obj", "sha256": "0"},
              "curvature": {"method": "quadric", "neighbourhood": {"rings": 2}}, "weld": "exact", "facing": "kept",
              "normals": "computed", "units": {"length": "source file units", "curvature": "1/length"}}


def baked():
    names = "x y z nx ny nz k1 k2 d1x d1y d1z d2x d2y d2z curvature_error".split()
    row = (0, 0, 1, 2, 1, 1, 0, 0, 0, 1, 0)  # normal, k1, k2, d1, d2
    faces = b"".join(struct.pack("<B3i", 3, *f) for f in ((0, 1, 2), (0, 2, 3)))
    for name, kind, code, uv in (("f32", "float", "f", []), ("f64_uv", "double", "d", ["s", "t"])):
        columns = names + uv
        head = ("ply\nformat binary_little_endian 1.0\n" + f"comment osculate {json.dumps(PROVENANCE)}\n"
                + "element vertex 4\n" + "".join(f"property {kind} {n}\n" for n in columns)
                + "property uchar curvature_status\nelement face 2\nproperty list uchar int vertex_indices\nend_header\n")
        rows = b"".join(struct.pack(f"<{len(columns)}{code}B", *p, *row, 0.1, *[0.5] * len(uv), k)
                        for k, p in enumerate(QUAD))
        for target in ("baked", "baked_ply"):
            write(target, name, head.encode() + rows + faces)
    blocks = [struct.pack("<12f", *[x for p in QUAD for x in p]), struct.pack("<12f", *[0, 0, 1] * 4),
              struct.pack("<8f", *[2, 1] * 4), struct.pack("<12f", *[1, 0, 0] * 4), struct.pack("<4f", *[0.1] * 4),
              bytes([0, 1, 2, 3]), struct.pack("<6H", 0, 1, 2, 0, 2, 3)]
    kinds = [(5126, "VEC3", 4), (5126, "VEC3", 4), (5126, "VEC2", 4), (5126, "VEC3", 4), (5126, "SCALAR", 4),
             (5121, "SCALAR", 4), (5123, "SCALAR", 6)]
    semantics = ["POSITION", "NORMAL", "_CURVATURE", "_CURVATURE_DIR", "_CURVATURE_ERROR", "_CURVATURE_STATUS"]
    starts = [sum(len(b) for b in blocks[:k]) for k in range(len(blocks))]
    views = [{"buffer": 0, "byteOffset": o, "byteLength": len(b)} for o, b in zip(starts, blocks)]
    accessors = [{"bufferView": k, "componentType": c, "type": t, "count": n} for k, (c, t, n) in enumerate(kinds)]
    accessors[0] |= {"min": [0, 0, 0], "max": [1, 1, 0.5]}
    primitive = {"attributes": {s: k for k, s in enumerate(semantics)}, "indices": 6, "mode": 4}
    binary = b"".join(blocks)
    doc = {"asset": {"version": "2.0", "extras": {"osculate": PROVENANCE}}, "scene": 0, "scenes": [{"nodes": [0]}],
           "nodes": [{"mesh": 0}], "meshes": [{"primitives": [primitive]}], "accessors": accessors,
           "bufferViews": views, "buffers": [{"byteLength": len(binary)}]}
    text = json.dumps(doc, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(binary), b"BIN\0") + binary
    write("baked", "glb", b"glTF" + struct.pack("<II", 2, 12 + len(chunks)) + chunks)


def scene():
    write("scene", "lamp", "[image]\nwidth = 32\nheight = 16\nexposure = 1.5\n[camera]\nposition = [1.0, 2.0, 3.0]\n"
          "target = [0.0, 0.0, 0.0]\nup = [0.0, 0.0, 1.0]\nfov_y = 50.0\nlens_radius = 0.1\nfocus_distance = 3.0\n"
          "[[mesh]]\nfile = \"a.obj\"\nmaterial = \"m\"\nrotate = [10.0, 20.0, 30.0]\nscale = 2.0\n"
          "translate = [1.0, 0.0, -1.0]\nbackdrop = true\n[material.m]\nbase_color = [0.5, 0.2, 0.1]\n"
          "metallic = 1.0\nroughness = 0.2\nspecular = 0.0\nopacity = 0.5\n[[light]]\ntype = \"rectangle\"\n"
          "center = [-2.0, 3.0, -2.0]\ntarget = [0.0, 0.0, 0.0]\nwidth = 2.0\nheight = 2.0\nradiance = [8.0, 8.0, 8.0]\n"
          "[environment]\nradiance = [0.3, 0.3, 0.3]\n")
    write("scene", "framed", "[camera]\ntowards_viewer = [0.5, 0.45, 1.0]\n[[mesh]]\nfile = \"a.obj\"\n"
          "[[light]]\ntype = \"directional\"\ndirection = [0.0, -1.0, 0.5]\nirradiance = [1.0, 1.0, 1.0]\n[environment]\nfile = \"a.exr\"\n")
    write("scene", "empty", "")


def sbtf():
    """The recorded models, and small ones of each precision."""
    for path in sorted((HERE.parent / "tests/data/models").glob("*.sbtf")):
        write("sbtf", path.stem, path.read_bytes())
    for dtype, size in (("F32", 4), ("F16", 2), ("U8", 1)):
        texture = {"width": 2, "height": 1, "channels": 2}
        form = {"depth": 0.1, "kappa_range": [-1.0, 1.0], "opacity": "silhouette", "offset": "free", "curvature": "given",
                "opacity_taps": [0.0, 1.0], "offset_taps": [0.0], "opacity_texture": texture, "offset_texture": texture,
                "colour_texture": texture, "width": 1, "hidden_layers": 1}
        meta = {"format": "osculate-sbtf", "version": 1, "architecture": form, "provenance": {}, "sampler": {
            "lobes": ["uniform", {"cosine": {"tilt": 0.5}}, {"mirror": {"sharpness": 9.0}}], "bands": 1, "cells": [1, 1],
            "weights": [0.25, 0.25, 0.5]}}
        header, offset = {"__metadata__": {"osculate": json.dumps(meta)}}, 0
        for module, inputs, outputs in (("opacity", 7, 1), ("offset", 5, 2), ("colour", 8, 3)):
            tensors = [("texture", dtype, [1, 2, 2], size)]
            tensors += [(f"texture.{n}", "F32", [2], 4) for n in ("scale", "offset")] if dtype == "U8" else []
            for layer, shape in enumerate(([1, inputs], [outputs, 1])):
                tensors += [(f"layers.{layer}.weight", "F32", shape, 4), (f"layers.{layer}.bias", "F32", shape[:1], 4)]
            for name, kind, shape, width in tensors:
                end = offset + width * math.prod(shape)
                header[f"{module}.{name}"] = {"dtype": kind, "shape": shape, "data_offsets": [offset, end]}
                offset = end
        text = json.dumps(header, separators=(",", ":")).encode()
        write("sbtf", f"small_{dtype}", struct.pack("<Q", len(text)) + text + bytes(offset))


def material():
    write("material", "field", "height = \"h.png\"\ndepth = 0.1\nheight_range = [0, 1]\ninvert = true\ntiling = \"mirror\"\n"
          "albedo = \"a.png\"\nalbedo_encoding = \"linear\"\nroughness = 0.5\nmetalness = \"m.png\"\nnormal = \"n.png\"\nnormal_y = \"down\"\n")
    write("material", "mesh", "name = \"m\"\nmesh = \"m.obj\"\nperiod = [2, 2]\nup = \"y\"\ndepth = 0.1\nalbedo = [0.5, 0.4, 0.3]\n")
    write("material", "builtin", "builtin = \"cave\"\nresolution = 64\n")
    image = "[[image]]\nfile = \"0.png\"\ndirection = [0, 0.5, 1]\nintensity = 2\n"
    write("material", "lights", "encoding = \"srgb\"\nroughness = 0.5\n" + 3 * image)
    write("material", "plain", "encoding linear\na.png 1 0 1\nb.png 0 1 1 2 # two\nc.png 0 0 1\n")


def png(bits, colour, row):
    def chunk(name, data):
        return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))
    header = struct.pack(">IIBBBBB", 2, 2, bits, colour, 0, 0, 0)
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(2 * (b"\0" + row))) + chunk(b"IEND", b""))


def exr():
    """Two by two texels of one float channel, not compressed."""
    def attribute(name, kind, data):
        return name + b"\0" + kind + b"\0" + struct.pack("<i", len(data)) + data
    box = struct.pack("<4i", 0, 0, 1, 1)
    channels = b"Y\0" + struct.pack("<iB3xii", 2, 0, 1, 1) + b"\0"
    header = b"".join([
        attribute(b"channels", b"chlist", channels), attribute(b"compression", b"compression", b"\0"),
        attribute(b"dataWindow", b"box2i", box), attribute(b"displayWindow", b"box2i", box),
        attribute(b"lineOrder", b"lineOrder", b"\0"), attribute(b"pixelAspectRatio", b"float", struct.pack("<f", 1)),
        attribute(b"screenWindowCenter", b"v2f", struct.pack("<2f", 0, 0)),
        attribute(b"screenWindowWidth", b"float", struct.pack("<f", 1))]) + b"\0"
    start = struct.pack("<ii", 20000630, 2) + header
    lines = [struct.pack("<ii2f", y, 8, 0.25, y) for y in range(2)]
    offsets = [len(start) + 16 + 16 * y for y in range(2)]
    return start + struct.pack("<2Q", *offsets) + b"".join(lines)


def maps():
    write("map", "grey8", png(8, 0, b"\x10\x20"))
    write("map", "grey16", png(16, 0, b"\x10\x20\x30\x40"))
    write("map", "bits", png(1, 0, b"\x80"))
    write("map", "rgba", png(8, 6, bytes(range(8))))
    write("map", "floats", exr())


for make in (obj, ply, stl, gltf, npz, baked, scene, sbtf, material, maps):
    make()
