#!/usr/bin/env python3
"""Applies one-line mutants to a copy of the project and shows which of them the tests detect.

The lists are tests/mutation/NAME.json, one per folder of the library. Each entry is an object:
  file      path of the mutated file
  from      text that occurs exactly once in that file
  to        the text that replaces it
  tests     regular expression (ctest -R) of the tests that should fail
  survives  optional: why no test can or need detect this mutant; it then counts as explained

For each mutant the script changes the copy, builds the tests that the expression names, and runs them until one fails: the
quick ones together, then the slow ones one by one, the quickest first. It then restores the file. The exit code is 0 if at least 95 % of all mutants die and every survivor is explained, 1 if not, and 2
if an entry is wrong (the text is absent or occurs twice, or the mutant does not compile).

The copy is built with -O1, without the real meshes of FACETREE_DATA, so that generated meshes must do. It stays in --copy for
the next run, which then builds only what changed.
"""
import argparse
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from queue import Queue

ROOT = pathlib.Path(__file__).resolve().parents[2]
LISTS = ROOT / "tests" / "mutation"
GOAL = 0.95
QUICK = 1.0  # seconds of a test that runs together with others


def parse_arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("lists", nargs="*", help="names of lists (default: all)")
    parser.add_argument("--only", type=int, nargs="+", metavar="N", help="numbers of single mutants, as printed")
    parser.add_argument("--workers", type=int, default=1, help="copies that work at the same time (default 1)")
    parser.add_argument("--copy", default=os.path.join(tempfile.gettempdir(), "facetree-mutation-" + ROOT.name),
                        help="folder of the copies (default: %(default)s)")
    parser.add_argument("--timeout", type=int, default=120, help="seconds that one test may run (default 120)")
    parser.add_argument("--report", metavar="FILE", help="also write the results as JSON")
    return parser.parse_args()


def load_mutants(names):
    paths = [LISTS / (name + ".json") for name in names] if names else sorted(LISTS.glob("*.json"))
    mutants = []
    for path in paths:
        for number, mutant in enumerate(json.loads(path.read_text())):
            mutants.append(dict(mutant, list=path.stem, number=number))
    return mutants


def write_if_changed(path, text):
    if not path.exists() or path.read_bytes() != text:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(text)


class Copy:
    """One copy of the project with its build folder."""

    def __init__(self, folder, jobs, timeout):
        self.root, self.build = pathlib.Path(folder), pathlib.Path(folder) / "build" / "mutation"
        self.jobs, self.timeout = str(jobs), str(timeout)
        self.synchronize()
        self.configure()

    def synchronize(self):
        """Makes the copy equal to the work tree. Unchanged files keep their time, so that nothing is built twice."""
        listed = subprocess.run(["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"], cwd=ROOT, check=True,
                                capture_output=True).stdout.decode().split("\0")
        listed = {name for name in listed if name and (ROOT / name).is_file()}
        for name in listed:
            write_if_changed(self.root / name, (ROOT / name).read_bytes())
            shutil.copymode(ROOT / name, self.root / name)
        for path in self.root.rglob("*"):
            name = path.relative_to(self.root).as_posix()
            if path.is_file() and not name.startswith("build/") and name not in listed:
                path.unlink()

    def run(self, *command):
        environment = dict(os.environ, CTEST_OUTPUT_ON_FAILURE="0")
        return subprocess.run(command, cwd=self.root, capture_output=True, text=True, errors="replace", env=environment)

    def configure(self):
        launcher = ["-DCMAKE_%s_COMPILER_LAUNCHER=ccache" % l for l in ("C", "CXX")] if shutil.which("ccache") else []
        done = self.run("cmake", "-S", ".", "-B", str(self.build), "-G", "Ninja", "-DCMAKE_BUILD_TYPE=Mutation",
                        "-DCMAKE_C_FLAGS_MUTATION=-O1 -DNDEBUG", "-DCMAKE_CXX_FLAGS_MUTATION=-O1 -DNDEBUG",
                        "-DFACETREE_TESTS=ON", "-DFACETREE_DATA=" + str(self.build / "no-data"), *launcher)
        if done.returncode:
            sys.exit("the copy cannot be configured:\n" + done.stdout + done.stderr)

    def name_tests(self, expression):
        listed = self.run("ctest", "--test-dir", str(self.build), "-N", "-R", expression).stdout
        return re.findall(r"Test +#\d+: (\S+)", listed)

    def build_tests(self, tests):
        """Builds the programs behind tests: FOLDER.NAME is test_FOLDER_NAME, tests of scripts need the program."""
        targets = subprocess.run(["ninja", "-C", str(self.build), "-t", "targets", "all"], capture_output=True, text=True).stdout
        wanted = set()
        for test in tests:
            target = "test_" + test.replace(".", "_")
            wanted.add(target if re.search(r"^(bin/)?%s: " % target, targets, re.M) else "facetree_program")
        return self.run("ninja", "-C", str(self.build), "-j", self.jobs, *sorted(wanted))

    def run_tests(self, tests):
        return self.run("ctest", "--test-dir", str(self.build), "-R", "^(%s)$" % "|".join(map(re.escape, tests)), "-j", self.jobs,
                        "--stop-on-failure", "--timeout", self.timeout)

    def try_mutant(self, mutant, seconds):
        """Returns killed, survived or wrong, and a note. seconds: of each test without a mutant."""
        path = self.root / mutant["file"]
        if not path.exists():
            return "wrong", "no such file"
        text = path.read_text()
        if text.count(mutant["from"]) != 1:
            return "wrong", "the text occurs %d times" % text.count(mutant["from"])
        tests = self.name_tests(mutant["tests"])
        if not tests:
            return "wrong", "no test matches"
        try:
            path.write_text(text.replace(mutant["from"], mutant["to"]))
            for group in group_tests(tests, seconds):
                built = self.build_tests(group)
                if built.returncode:
                    errors = [line for line in built.stdout.split("\n") if "error:" in line]
                    return "wrong", "does not compile: " + (errors[0] if errors else built.stdout[-300:])
                done = self.run_tests(group)
                if done.returncode:
                    return "killed", ", ".join(re.findall(r"(\S+) +\.+\**(?:Failed|\*+Failed|.*Timeout|.*Exception)", done.stdout))
        finally:
            path.write_text(text)
        return "survived", ""


def group_tests(tests, seconds):
    """Quick tests in one group, then each slow one alone, the quickest first."""
    quick = [test for test in tests if seconds.get(test, QUICK) < QUICK]
    slow = sorted((test for test in tests if test not in quick), key=lambda test: seconds.get(test, QUICK))
    return ([quick] if quick else []) + [[test] for test in slow]


def describe_line(mutant):
    path = ROOT / mutant["file"]
    text = path.read_text() if path.exists() else ""
    at = text.find(mutant["from"])
    place = "%s:%d" % (mutant["file"], text.count("\n", 0, at) + 1 if at >= 0 else 0)
    return "%s %d  %s  %s -> %s" % (mutant["list"], mutant["number"], place, " ".join(mutant["from"].split())[:70],
                                    " ".join(mutant["to"].split())[:70] or "(nothing)")


def time_originals(copy, mutants):
    """Returns the seconds of each test without a mutant. All must pass, or a failure says nothing."""
    tests = copy.name_tests("|".join(sorted({"(%s)" % mutant["tests"] for mutant in mutants})))
    built = copy.build_tests(tests)
    if built.returncode:
        sys.exit("the unchanged copy does not build:\n" + built.stdout[-2000:])
    done = copy.run_tests(tests)
    if done.returncode:
        sys.exit("tests fail without any mutant:\n" + done.stdout[-2000:])
    return {test: float(time) for test, time in re.findall(r"(\S+) +\.+ +Passed +([\d.]+) sec", done.stdout)}


def main():
    arguments = parse_arguments()
    mutants = load_mutants(arguments.lists)
    if arguments.only is not None:
        mutants = [mutant for mutant in mutants if mutant["number"] in arguments.only]
    if not mutants:
        sys.exit("no mutants")
    jobs = max(1, (os.cpu_count() or 1) // arguments.workers)
    copies = Queue()
    for worker in range(arguments.workers):
        copies.put(Copy(os.path.join(arguments.copy, str(worker)), jobs, arguments.timeout))
    first = copies.get()
    seconds = time_originals(first, mutants)
    copies.put(first)

    def work(mutant):
        copy = copies.get()
        begin = time.time()
        try:
            result, detail = copy.try_mutant(mutant, seconds)
        finally:
            copies.put(copy)
        note = detail or mutant.get("survives", "")
        print("%-8s %5.1f s  %s%s" % (result, time.time() - begin, describe_line(mutant), "  [%s]" % note if note else ""), flush=True)
        return dict(mutant, result=result, detail=detail)

    with ThreadPoolExecutor(arguments.workers) as pool:
        results = list(pool.map(work, mutants))
    if arguments.report:
        pathlib.Path(arguments.report).write_text(json.dumps(results, indent=1))

    count = {kind: [r for r in results if r["result"] == kind] for kind in ("killed", "survived", "wrong")}
    unexplained = [r for r in count["survived"] if not r.get("survives")]
    tried = len(count["killed"]) + len(count["survived"])
    rate = len(count["killed"]) / tried if tried else 0
    print("\n%d mutants: %d killed (%.1f %%), %d survived, %d of them unexplained; %d entries wrong" %
          (len(results), len(count["killed"]), 100 * rate, len(count["survived"]), len(unexplained), len(count["wrong"])))
    for kind, rows in (("survivor", count["survived"]), ("wrong", count["wrong"])):
        for row in rows:
            print("  %s: %s  (%s)" % (kind, describe_line(row), row["detail"] or row.get("survives") or "unexplained"))
    sys.exit(2 if count["wrong"] else 0 if rate >= GOAL and not unexplained else 1)


main()
