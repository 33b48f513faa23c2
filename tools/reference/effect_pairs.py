"""What an effect costs scenes that do without it: instructions a sample, beside a build that lacks the effect.

    effect_pairs.py [--effects "curvature,textures"] [--samples 48] [--target-dir target] [--limit 0.02]

    needs cargo and valgrind

For every effect that the renderer's plan decides on there is a pair of small scenes, with and without it
(`crates/render/tests/support/pairs.rs`). `crates/render/examples/effect_pairs.rs` renders one of them on one thread. It is built as it is, and once for every effect with
`OSCULATE_WITHOUT` naming the effect: that build has none of its code (`crates/render/src/present.rs`). The last row is a build that lacks all effects but
directional lights, for the least scene that shows anything.

Instructions are counted by valgrind's cachegrind, of two runs with different numbers of samples: their difference has no start and no
preparation in it, nor the waiting of idle threads, which makes up to two million instructions of difference between runs. Valgrind has no AVX-512 and says so to programs, so what is counted is the code for AVX2; counts of a build
repeat but for the addresses that hashing draws. `without / lacking` is what having the effect costs a scene that does without it. `forced` is that scene
with the effect simulated although the plan does without, and `saving` the share of that which the plan saves. The pictures of both builds must have the same bits, and the build that lacks the
effect must refuse the scene with it. Exit code 1 if that does not hold, or a row is over the limit. About half an hour on two processors.
"""

import argparse
import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
ALL_BUT_A_SUN = "all but directional lights"


def build(target, lacking, to):
    """The example without these effects."""
    environment = {k: v for k, v in os.environ.items() if k != "OSCULATE_WITHOUT"}
    if lacking:
        environment["OSCULATE_WITHOUT"] = ",".join(lacking)
    command = ["cargo", "build", "--release", "--quiet", "-p", "osculate-render", "--example", "effect_pairs"]
    subprocess.run([*command, "--target-dir", str(target)], cwd=ROOT, env=environment, check=True)
    shutil.copy(target / "release/examples/effect_pairs", to)
    return to


def lacks(effect, known):
    """Which effects the build that a row is held against lacks."""
    if effect != ALL_BUT_A_SUN:
        return [effect]
    return [e for e in known if e not in (ALL_BUT_A_SUN, "directional lights")]


def picture(program, effect, side, samples):
    """What the program prints: a hash of the picture and the number of samples."""
    done = subprocess.run([program, effect, side, str(samples)], capture_output=True, text=True, check=True)
    image, count = done.stdout.split()
    return image, int(count)


def instructions(program, effect, side, samples, work):
    """Instructions of a whole run."""
    log = work / "log"
    tool = ["valgrind", "--tool=cachegrind", "--cache-sim=no", f"--cachegrind-out-file={work / 'out'}", f"--log-file={log}"]
    subprocess.run([*tool, program, effect, side, str(samples)], stdout=subprocess.DEVNULL, check=True)
    return int(re.search(r"I\s+refs:\s+([\d,]+)", log.read_text())[1].replace(",", ""))


def a_sample(program, effect, side, samples, work):
    """Instructions a sample, and the picture's hash at twice the samples."""
    ends = [instructions(program, effect, side, n, work) for n in (samples, 2 * samples)]
    image, count = picture(program, effect, side, 2 * samples)
    return 2 * (ends[1] - ends[0]) / count, image


def refuses(program, effect):
    """Whether a program refuses the scene with an effect, and says which it lacks."""
    done = subprocess.run([program, effect, "with", "1"], capture_output=True, text=True)
    named = "lacks" in done.stderr and (effect in done.stderr or effect == ALL_BUT_A_SUN)
    return done.returncode == 2 and named


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--effects", help="names of effects, separated by commas; all by default")
    parser.add_argument("--samples", type=int, default=48, help="a pixel, in the shorter run")
    parser.add_argument("--target-dir", type=Path, default=ROOT / "target")
    parser.add_argument("--limit", type=float, default=0.02, help="of what a build may cost beside one that lacks the effect")
    arguments = parser.parse_args()
    target = arguments.target_dir.resolve()
    fine = True
    with tempfile.TemporaryDirectory() as work:
        work = Path(work)
        plain = build(target, [], work / "plain")
        known = subprocess.run([plain, "list"], capture_output=True, text=True, check=True).stdout.splitlines()
        chosen = arguments.effects.split(",") if arguments.effects else known
        if unknown := set(chosen) - set(known):
            parser.error(f"no effect is called {unknown.pop()!r}; there are {', '.join(known)}")
        lacking = [build(target, lacks(effect, known), work / f"bare{k}") for k, effect in enumerate(chosen)]
        print("built", file=sys.stderr, flush=True)
        print("| effect | with | without | build that lacks it | without / lacking - 1 | without, forced | saving | same bits |")
        print("|---|---|---|---|---|---|---|---|")
        for effect, bare in zip(chosen, lacking):
            there, _ = a_sample(plain, effect, "with", arguments.samples, work)
            without, image = a_sample(plain, effect, "without", arguments.samples, work)
            never, never_image = a_sample(bare, effect, "without", arguments.samples, work)
            forced, _ = a_sample(plain, effect, "forced", arguments.samples, work)
            over = without / never - 1
            same = image == never_image and refuses(bare, effect)
            fine = fine and same and over <= arguments.limit
            print(
                f"| {effect} | {there:.0f} | {without:.0f} | {never:.0f} | {100 * over:+.2f} % | "
                f"{forced:.0f} | {100 * (1 - without / forced):.1f} % | {'yes' if same else 'NO'} |",
                flush=True,
            )
    return 0 if fine else 1


if __name__ == "__main__":
    sys.exit(main())
