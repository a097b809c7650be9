"""The runs of bench/simplify/run, grouped by mesh and size, with libraries that are not in Debian by factors; curves of figures."""
import csv
import math
import os
import statistics

# Libraries that are not in Debian, by factors that were measured once, on meshes of 70 thousand, 268 thousand or 1.1 million
# faces. Between two sizes a factor grows with the logarithm of the faces; outside it is constant.
# Time to a tenth: QSlim 2.1, and meshoptimizer 1.2 without and with RGB, over meshoptimizer 0.18.
QSLIM_TIME = [(70e3, .32 / .065), (1.1e6, 7.0 / 1.79)]
NEWEST_TIME = [(70e3, .058 / .065), (1.1e6, 1.13 / 1.79)]
RGB_TIME = [(70e3, .064 / .065), (1.1e6, 1.55 / 1.79)]
# E_avg at a tenth and a hundredth: QSlim over CGAL, and meshoptimizer 1.2 with over without update; E_avg itself where it
# was measured.
QSLIM = {("bunny", .1): 6.4e-8, ("bunny", .01): 3.9e-6}
NEWEST = {("bunny", .1): 7.8e-8, ("bunny", .01): 4.3e-6}
QSLIM_CGAL = {.1: [(70e3, 6.4 / 6.4), (268e3, 5.8 / 5.8)], .01: [(70e3, 3.9 / 3.6), (268e3, 2.95 / 2.89)]}
UPDATE = {.1: [(70e3, 7.8e-8 / 1.6e-7), (268e3, 9.0e-9 / 1.7e-8)], .01: [(70e3, 4.3e-6 / 8.0e-6), (268e3, 4.4e-7 / 7.9e-7)]}

ROUNDING = 1e-7 # of a coordinate that is a float, over the diagonal


def factor(table, faces):
    (low, a), (high, b) = table
    share = min(max(math.log(faces / low) / math.log(high / low), 0), 1)
    return a + share * (b - a)


def over(a, b):
    return a / b if a is not None and b else None


def times(a, b):
    return a * b if a is not None and b is not None else None


def at_least_rounding(error, key):
    return max(error, ROUNDING ** (2 if key == "e_avg" else 1)) if error is not None else None


def read_rows(path):
    if not os.path.exists(path):
        return []
    with open(path, newline="", encoding="ascii") as file:
        return list(csv.DictReader(file))


def number(row, key):
    return float(row[key]) if row and row.get(key) else None


class Case:
    """All runs on one mesh at one size."""

    def __init__(self, rows):
        first = rows[0]
        self.mesh, self.faces, self.share, self.target = first["mesh"], int(first["faces"]), float(first["share"]), int(first["target"])
        self.runs, self.status = {}, {}
        for r in rows:
            key = r["library"], int(r["threads"])
            self.status[key] = r["status"]
            if r["status"] == "ok":
                self.runs.setdefault(key, {})[int(r["run"])] = r

    def median(self, library, key="cpu", threads=1):
        values = [number(r, key) for r in self.runs.get((library, threads), {}).values()]
        return statistics.median(values) if values else None

    def ratio(self, peer, key="cpu", library="facetree", threads=1):
        """The median over the rounds of our time over that of the peer in the same round."""
        ours, theirs = self.runs.get((library, threads), {}), self.runs.get((peer, 1), {})
        values = [over(number(ours[n], key), number(theirs[n], key)) for n in ours if n in theirs]
        values = [v for v in values if v is not None]
        return statistics.median(values) if values else None

    def judged(self, library, key):
        """A figure of the result, if the library came near the target."""
        row = self.runs.get((library, 1), {}).get(0)
        return number(row, key) if row and self.reached(library) else None

    def error(self, library, key):
        """e_avg or e_max for ratios: errors below the rounding of floats are equal."""
        return at_least_rounding(self.judged(library, key), key)

    def shape(self):
        """Our result for geometry alone."""
        return "shape" if ("shape", 1) in self.runs else "facetree"

    def reached(self, library):
        row = self.runs.get((library, 1), {}).get(0)
        return bool(row) and int(row["reached"]) <= 1.02 * self.target + 2

    def count(self, library, key):
        row = self.runs.get((library, 1), {}).get(0)
        return int(row[key]) if row and row.get(key) else None

    def counts(self):
        return "/".join(str(len(self.runs.get(key, {}))) for key in (("facetree", 1), ("facetree", 2), ("meshopt", 1), ("cgal", 1), ("openmesh", 1)))

    def qslim_error(self):
        if (self.mesh, self.share) in QSLIM:
            return QSLIM[self.mesh, self.share]
        if self.share not in QSLIM_CGAL:
            return None
        return at_least_rounding(times(self.judged("cgal", "e_avg"), factor(QSLIM_CGAL[self.share], self.faces)), "e_avg")

    def newest_error(self):
        if (self.mesh, self.share) in NEWEST:
            return NEWEST[self.mesh, self.share]
        if self.share not in UPDATE:
            return None
        return at_least_rounding(times(self.judged("meshopt", "e_avg"), factor(UPDATE[self.share], self.faces)), "e_avg")

    def name(self):
        return [self.mesh, str(self.faces), f"{100 * self.share:g}"]


def make_cases(rows):
    groups = {}
    for r in rows:
        groups.setdefault((int(r["faces"]), r["mesh"], -float(r["share"])), []).append(r)
    return [Case(groups[key]) for key in sorted(groups)]


def figure_points(figures, figure, mesh, library):
    """Faces, E_avg and the median time of each size, by falling faces."""
    groups = {}
    for r in figures:
        if (r["figure"], r["mesh"], r["library"], r["status"]) == (figure, mesh, library, "ok"):
            groups.setdefault(int(r["target"]), []).append(r)
    found = []
    for target in sorted(groups, reverse=True):
        rows = groups[target]
        judged = next((r for r in rows if r["e_avg"]), None)
        if judged:
            found.append((int(judged["reached"]), float(judged["e_avg"]), statistics.median(float(r["cpu"]) for r in rows), target))
    return found


def members(figures, figure, key):
    return list(dict.fromkeys(r[key] for r in figures if r["figure"] == figure))


def fit_power(points):
    """alpha and p of E = alpha m^-p, by least squares of logarithms, without the two largest m as in the dissertation."""
    points = [(math.log(p[0]), math.log(p[1])) for p in points[2:] if p[1] > 0]
    if len(points) < 3:
        return None, None
    x, y = statistics.mean(p[0] for p in points), statistics.mean(p[1] for p in points)
    slope = sum((p[0] - x) * (p[1] - y) for p in points) / sum((p[0] - x) ** 2 for p in points)
    return math.exp(y - slope * x), -slope
