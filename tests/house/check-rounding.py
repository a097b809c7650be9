#!/usr/bin/env python3
"""Prints each place where gcc drops a rounding to float: a double that is stored as a float and read back.

gcc 12 replaces (vector double)(vector float)x by x after vectorisation, for every instruction set. The program compiles
each C file of a build as its compile command says, once more for AVX-512 if asked, and searches the dump of the
vectorisers for such pairs. base/math/round.h rounds in a way that gcc keeps.
usage: check-rounding.py BUILD_FOLDER [GCC-OPTION...]
"""
import json, os, re, shlex, subprocess, sys, tempfile
from concurrent.futures import ThreadPoolExecutor


def dropped(entry, options):
    words = shlex.split(entry["command"])
    words = [w for w in words if not w.endswith("ccache")]
    words[words.index("-o") + 1] = "/dev/null"
    if "-MF" in words:
        words[words.index("-MF") + 1] = "/dev/null"
    found = set()
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run(words + options + ["-fdump-tree-slp-lineno", "-fdump-tree-vect-lineno", "-dumpdir", folder + "/"],
                       cwd=entry["directory"], check=True, stderr=subprocess.DEVNULL)
        for name in os.listdir(folder):
            narrowed, function = set(), ""
            for line in open(os.path.join(folder, name), errors="replace"):
                if line.startswith(";; Function"):
                    narrowed, function = set(), line.split()[2]
                match = re.search(r"(\S+) = \(vector\(\d+\) (float|double)\) ([\w.]+);", line)
                if match and match.group(2) == "float":
                    narrowed.add(match.group(1))
                elif match and match.group(3) in narrowed:
                    place = re.search(r"\[(\S+?):(\d+):\d+", line)
                    found.add((function, os.path.relpath(place.group(1)) + ":" + place.group(2) if place else ""))
    return [f"{os.path.relpath(entry['file'])}: {function}: {place}" for function, place in sorted(found)]


def main():
    build, options = sys.argv[1], sys.argv[2:]
    entries = [e for e in json.load(open(os.path.join(build, "compile_commands.json"))) if e["file"].endswith(".c")
               and "CMakeFiles/fct_" in e["command"]]
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        lines = [line for lines in pool.map(lambda e: dropped(e, options), entries) for line in lines]
    print("\n".join(lines))
    return 1 if lines else 0


sys.exit(main())
