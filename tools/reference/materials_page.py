"""Writes docs/materials.md: how the shipped materials were trained, and how good they are.

    cargo build --release
    python tools/reference/materials_page.py [--keep DIR] [--forms DIR] [--deep DIR] [--tables patches,holes,torus,torus-deep,torus-pictures,neumip,paper]

Needs nothing but Python's standard library. Takes a minute or two per material; with --keep it goes on where it stopped. Models of other
forms to set beside ours, which do not ship, are `DIR/neumip/NAME.sbtf` and `DIR/paper/NAME.sbtf`; without --forms their table is left as it is.
So it is with `DIR/NAME.sbtf`, trained with `--depth 0.2`, and --deep.
"""

import argparse
import json
import struct
import subprocess
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
OSCULATE = ROOT / "target" / "release" / "osculate"
# Share of the base error left that the paper's table 1 states for materials of these names: 1 - (IoU - base) / (1 - base).
PAPER = {
    "cave": 0.25, "foam": 0.21, "leather": 0.22, "oyster": 0.32, "shell": 0.32, "stone-1": 0.29, "stone-2": 0.23,
    "terracotta": 0.28, "wall": 0.26, "wool-1": 0.41, "wool-2": 0.28,
}

SEE_THROUGH = ("basket-weave", "perforated-leather")


def metadata(path):
    data = path.read_bytes()
    header = json.loads(data[8 : 8 + struct.unpack("<Q", data[:8])[0]])
    return json.loads(header["__metadata__"]["osculate"])


def report(keep, name, *arguments):
    """The report of a command, from the folder `keep` if it is there."""
    kept = keep / f"{name}.json" if keep else None
    if kept and kept.exists():
        return json.loads(kept.read_text())
    done = subprocess.run([OSCULATE, *arguments, "--quiet", "--json", "-"], capture_output=True, text=True, check=True, cwd=ROOT)
    if kept:
        kept.write_text(done.stdout)
    return json.loads(done.stdout)


def left(scores):
    return sum(s["excess"] + s["missing"] for s in scores) / sum(s["base"] for s in scores)


def row(path, keep):
    provenance = metadata(path)["provenance"]
    training, scores = provenance["training"], provenance["scores"]
    name, relative = path.stem, str(path.relative_to(ROOT))
    model = report(keep, name, "eval", relative, "--spp", "16", "--pairs", "32")["models"][0]
    small = [s for s in model["silhouettes"] if s["kappa"] < 0.5]
    psnr = " / ".join(f"{a['psnr']:.1f}" for a in model["appearance"])
    flip = " / ".join(f"{a['flip']:.2f}" for a in model["appearance"])
    cells = [name, str(training["appearance_steps"]), f"{scores['seconds']:.0f}"]
    cells += [f"{left(model['silhouettes']):.3f}", f"{left(small):.3f}", psnr, flip]
    return "| " + " | ".join(cells) + " |"


def hole_row(path, keep):
    """A row of the table of see-through materials."""
    provenance = metadata(path)["provenance"]
    model = report(keep, path.stem, "eval", str(path.relative_to(ROOT)), "--spp", "16", "--pairs", "32")["models"][0]
    coverage = [model["coverage"]["all"], *model["coverage"]["by_kappa"]]
    least = min(c["hole_iou"] for c in coverage)
    cells = [path.stem, str(provenance["training"]["opacity_steps"]), f"{provenance['scores']['seconds']:.0f}"]
    cells += [f"{coverage[0]['open']:.3f}", f"{coverage[0]['opaque_iou']:.3f}", f"{coverage[0]['hole_iou']:.3f}", f"{least:.3f}"]
    for key, digits in [("psnr", 1), ("flip", 2)]:
        cells.append(" / ".join(f"{a[key]:.{digits}f}" for a in model["appearance"]))
    return "| " + " | ".join(cells) + " |"


def neumip_row(path, keep, forms):
    """A row of the table of NeuMIP's pictures beside ours; `None` without its model."""
    other = forms / "neumip" / path.name
    if not other.exists():
        return None
    ours = str(path.relative_to(ROOT))
    models = report(keep, f"{path.stem}-neumip", "eval", ours, str(other.absolute()), "--spp", "16", "--pairs", "32")["models"]
    cells = [path.stem]
    for key, digits in [("psnr", 1), ("flip", 2)]:
        cells += [" / ".join(f"{value[key]:.{digits}f}" for value in model["appearance"]) for model in models]
    return "| " + " | ".join(cells) + " |"


def paper_row(path, keep, forms):
    """A row of the table of the paper's form: the share of the silhouette's error that is left, by ours and by it; `None` without its model."""
    other = forms / "paper" / path.name
    if not other.exists():
        return None
    ours = str(path.relative_to(ROOT))
    models = report(keep, f"{path.stem}-paper", "eval", ours, str(other.absolute()), "--silhouettes-only")["models"]
    return "| " + " | ".join([path.stem, *(f"{left(model['silhouettes']):.3f}" for model in models)]) + " |"


def torus_row(path, keep, key="torus"):
    """A row of the table, and the shares that are left by the model with the paper's query and with the chord's."""
    name = path.stem
    result = report(keep, f"{name}-{key}", "eval", str(path), "--scenes", "torus", "--silhouettes-only")["results"][0]

    def find(form, query):
        rows = result["silhouettes"]
        return next(s for s in rows if s["form"] == form and s.get("query") == query and not s.get("exact_curvature"))

    base = next(s for s in result["silhouettes"] if s["form"] == "base")
    chord, paper = find("model", "chord"), find("model", "paper")
    cells = [name, f"{base['iou']:.4f}", f"{chord['iou']:.4f}", f"{chord['band_iou']:.3f}"]
    cells += [f"{paper['left']:.3f}", f"{find('oracle', 'paper')['left']:.3f}"]
    cells += [f"{chord['left']:.3f}", f"{find('oracle', 'chord')['left']:.3f}", f"{PAPER[name]:.2f}"]
    return "| " + " | ".join(cells) + " |", paper["left"], chord["left"]


def picture_row(path, keep, forms):
    """A row of the table of pictures on the torus: ours and NeuMIP's against displaced truth, and that against itself with other noise."""
    baseline = str(forms.absolute() / "neumip" / path.name)
    options = ["--scenes", "torus", "--baseline", baseline, "--pixels", "96", "--spp", "32", "--samples", "64"]
    pictures = report(keep, f"{path.stem}-pictures", "eval", str(path), *options)["results"][0]["pictures"]
    by_form = {picture["form"]: picture for picture in pictures}
    cells = [path.stem]
    for key, digits in [("psnr", 1), ("ssim", 3), ("flip", 3)]:
        cells += [f"{by_form[form][key]:.{digits}f}" for form in ("neural", "neumip", "displaced")]
    return "| " + " | ".join(cells) + " |"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--keep", type=Path, help="keep the reports in this folder, and take those that are there")
    parser.add_argument("--forms", type=Path, help="folder with models of other forms, as above")
    parser.add_argument("--deep", type=Path, help="folder with models of twice the depth, as above")
    parser.add_argument("--tables", default="patches,holes,torus,torus-deep,torus-pictures,neumip,paper", help="which to write")
    args = parser.parse_args()
    keep = args.keep
    if keep:
        keep.mkdir(parents=True, exist_ok=True)
    wanted = args.tables.split(",")
    folder = ROOT / "assets" / "materials"
    solid, holes = ([folder / f"{name}.sbtf" for name in sorted(names)] for names in (PAPER, SEE_THROUGH))
    tables = {}
    if "patches" in wanted:
        tables["patches"] = [row(path, keep) for path in solid]
    if "holes" in wanted:
        tables["holes"] = [hole_row(path, keep) for path in holes]
    deep = [path for path in (args.deep / path.name for path in solid) if path.exists()] if args.deep else []
    for key, models in [("torus", solid), ("torus-deep", deep)]:
        if key in wanted and models:
            on_torus = [torus_row(path.absolute(), keep, key) for path in models]
            tables[key] = [line[0] for line in on_torus]
            mean = [sum(line[k] for line in on_torus) / len(on_torus) for k in (1, 2)]
            print(f"mean share left, {key}: paper's query {mean[0]:.3f}, chord {mean[1]:.3f}")
    for key, form in [("neumip", neumip_row), ("paper", paper_row)]:
        if key in wanted and args.forms:
            rows = [form(path, keep, args.forms) for path in solid]
            tables[key] = [row for row in rows if row]
    if "torus-pictures" in wanted and args.forms:
        tables["torus-pictures"] = [picture_row(path.absolute(), keep, args.forms) for path in solid]
    text = (ROOT / "docs" / "materials.md").read_text()
    for key, lines in ((key, lines) for key, lines in tables.items() if lines):
        begin, end = f"<!-- {key} -->\n", f"<!-- end of {key} -->"
        head, rest = text.split(begin)
        table, tail = rest.split(end)
        text = head + begin + "\n".join(table.splitlines()[:2] + lines) + "\n" + end + tail
    (ROOT / "docs" / "materials.md").write_text(text)


if __name__ == "__main__":
    main()
