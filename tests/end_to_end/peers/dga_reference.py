"""Methods of dissolved gas analysis, written a second time: a peer for the crate `dga`.

Written from the rules as published, by other means than the crate: decimal fractions
without rounding for ratios and triangles, 40 digits and winding numbers for pentagons.
Only Python's own library is used.

Reads CSV with a header from stdin (h2,ch4,c2h6,c2h4,c2h2,co,co2,o2,n2; an empty cell is
a gas that was not measured) and writes CSV with the columns of RESULTS to stdout. The
last column, `edge`, is how far the pentagon's point is from the nearest border, so that
whoever compares can leave out what rounding decides.
"""

import csv
import sys
from decimal import Decimal, getcontext
from fractions import Fraction as F

getcontext().prec = 40

RESULTS = [
    "iec", "rogers", "doernenburg", "keygas", "dlt722", "tri1", "tri4", "tri5",
    "tri4_applicable", "tri5_applicable", "pent1", "pent2", "pent_x", "pent_y",
    "c57_status", "edge",
]

INFINITE = "infinite"


class Ratio:
    """Returns a/b, infinite where b alone is 0, and None where both are."""

    def __init__(self, a, b):
        self.value = a / b if b else (INFINITE if a else None)

    def within(self, low, high, low_in=True, high_in=True):
        """Reports whether it is known and between two bounds; None is no bound."""
        if self.value is None:
            return False
        if self.value == INFINITE:
            return high is None
        over = low is None or (self.value >= low if low_in else self.value > low)
        under = high is None or (self.value <= high if high_in else self.value < high)
        return over and under

    def less(self, high):
        return self.within(None, high, high_in=False)

    def more(self, low):
        return self.within(low, None, low_in=False)

    def digit(self, digits):
        """Returns the code of DL/T 722, table 6."""
        if self.value is None:
            return None
        if self.value == INFINITE or self.value >= 3:
            return digits[3]
        if self.value >= 1:
            return digits[2]
        return digits[1] if self.value >= F(1, 10) else digits[0]


def iec(g):
    r1, r2, r5 = Ratio(g["ch4"], g["h2"]), Ratio(g["c2h2"], g["c2h4"]), Ratio(g["c2h4"], g["c2h6"])
    tenth = F(1, 10)
    cases = {
        "PD": r1.less(tenth) and r5.less(F(1, 5)),
        "D1": r2.more(1) and r1.within(tenth, F(1, 2)) and r5.more(1),
        "D2": r2.within(F(3, 5), F(5, 2)) and r1.within(tenth, 1) and r5.more(2),
        "T1": r1.more(1) and r5.less(1),
        "T2": r2.less(tenth) and r1.more(1) and r5.within(1, 4),
        "T3": r2.less(F(1, 5)) and r1.more(1) and r5.more(4),
    }
    return "|".join(name for name, holds in cases.items() if holds) or "ND"


def rogers(g):
    r1, r2, r5 = Ratio(g["ch4"], g["h2"]), Ratio(g["c2h2"], g["c2h4"]), Ratio(g["c2h4"], g["c2h6"])
    tenth = F(1, 10)
    little, middle = r2.less(tenth), r1.within(tenth, 1)
    cases = {
        "N": little and middle and r5.less(1),
        "PD": little and r1.less(tenth) and r5.less(1),
        "D2": r2.within(tenth, 3) and middle and r5.more(3),
        "T1": little and middle and r5.within(1, 3),
        "T2": little and r1.more(1) and r5.within(1, 3),
        "T3": little and r1.more(1) and r5.more(3),
    }
    return next((name for name, holds in cases.items() if holds), "ND")


LEVEL_1 = {"h2": 100, "ch4": 120, "co": 350, "c2h2": 1, "c2h4": 50, "c2h6": 65}


def doernenburg(g):
    over = {gas for gas, limit in LEVEL_1.items() if g[gas] is not None and g[gas] > limit}
    twice = [gas for gas in ("h2", "ch4", "c2h2", "c2h4") if g[gas] > 2 * LEVEL_1[gas]]
    if not twice or not over & {"c2h6", "co"}:
        return "NF"
    pairs = [("ch4", "h2"), ("c2h2", "c2h4"), ("c2h2", "ch4"), ("c2h6", "c2h2")]
    if any(not over & set(pair) for pair in pairs):
        return "NA"
    r1, r2, r3, r4 = (Ratio(g[a], g[b]) for a, b in pairs)
    if r1.more(1) and r2.less(F(3, 4)) and r3.less(F(3, 10)) and r4.more(F(2, 5)):
        return "T"
    if r1.less(F(1, 10)) and r3.less(F(3, 10)) and r4.more(F(2, 5)):
        return "PD"
    between = r1.within(F(1, 10), 1, low_in=False, high_in=False)
    if between and r2.more(F(3, 4)) and r3.more(F(3, 10)) and r4.less(F(2, 5)):
        return "D"
    return "ND"


def keygas(g):
    zones = {"h2": "PD", "ch4": "T1", "c2h6": "T1", "c2h4": "T3", "c2h2": "D2", "co": "C"}
    known = [gas for gas in zones if g[gas]]
    return zones[max(known, key=lambda gas: g[gas])] if known else "NA"


def dlt722(g):
    """Handles ratios 0/0: C2H2/C2H4 is coded 0, CH4/H2 fits where any digit does."""
    c2 = Ratio(g["c2h2"], g["c2h4"]).digit((0, 1, 1, 2))
    c1 = Ratio(g["ch4"], g["h2"]).digit((1, 0, 2, 2))
    c5 = Ratio(g["c2h4"], g["c2h6"]).digit((0, 0, 1, 2))
    if c2:
        return {1: "D2", 2: "D1"}[c2] + ("T" if c1 == 2 else "")
    if c5 == 2:
        return "T3"
    table = {(0, 0): "T0", (2, 0): "T1", (2, 1): "T2", (1, 0): "PD", (0, 1): "T1"}
    return table.get((c1, c5), "ND")


def shares(*gases):
    total = sum(gases)
    return [100 * gas / total for gas in gases] if total else None


def triangle_1(g):
    parts = shares(g["ch4"], g["c2h4"], g["c2h2"])
    if parts is None:
        return "NA"
    m, e, a = parts
    if m >= 98:
        return "PD"
    if a < 4:
        return "T1" if e < 20 else "T2" if e < 50 else "T3"
    if a < 15 and e >= 50:
        return "T3"
    if a >= 13 and e < 23:
        return "D1"
    if (13 <= a < 29 and 23 <= e < 40) or (a >= 29 and e >= 23):
        return "D2"
    return "DT"


def triangle_4(g):
    parts = shares(g["h2"], g["ch4"], g["c2h6"])
    if parts is None:
        return "NA"
    h, m, e = parts
    if 2 <= m < 15 and e < 1:
        return "PD"
    if h >= 9 and e >= 46:
        return "ND"
    if h < 9:
        return "C" if e < 30 else "O"
    if (m >= 36 and e < 24) or (h < 15 and 24 <= e < 30):
        return "C"
    return "S"


def triangle_5(g):
    parts = shares(g["ch4"], g["c2h4"], g["c2h6"])
    if parts is None:
        return "NA"
    _, y, e = parts
    if y < 1 and 2 <= e < 15:
        return "PD"
    if y < 10:
        return "S" if 15 <= e < 54 else "O"
    if e >= 30:
        return "ND" if y < 35 else "T3"
    if y < 50:
        return "C" if e >= 12 else "T2" if y < 35 else "T3"
    if y < 70:
        return "T3" if e < 14 else "C"
    return "T3"


PD = [(0, 33), (-1, 33), (-1, 24.5), (0, 24.5)]
D1 = [(0, 40), (38, 12.4), (32, -6.1), (4, 16), (0, 1.5)]
D2 = [(4, 16), (32, -6.1), (24.3, -30), (0, -3), (0, 1.5)]
S = [(0, 1.5), (-35, 3.1), (-38, 12.4), (0, 40), (0, 33), (-1, 33), (-1, 24.5), (0, 24.5)]
PENTAGON_1 = {
    "PD": PD,
    "D1": D1,
    "D2": D2,
    "T3": [(0, -3), (24.3, -30), (23.5, -32.4), (1, -32.4), (-6, -4)],
    "T2": [(-6, -4), (1, -32.4), (-22.5, -32.4)],
    "T1": [(-6, -4), (-22.5, -32.4), (-23.5, -32.4), (-35, 3.1), (0, 1.5), (0, -3)],
    "S": S,
}
PENTAGON_2 = {
    "PD": PD,
    "D1": D1,
    "D2": D2,
    "S": S,
    "T3H": [(0, -3), (24.3, -30), (23.5, -32.4), (2.5, -32.4), (-3.5, -3)],
    "C": [(-3.5, -3), (2.5, -32.4), (-21.5, -32.4), (-11, -8)],
    "O": [(-3.5, -3), (-11, -8), (-21.5, -32.4), (-23.5, -32.4), (-35, 3.1), (0, 1.5), (0, -3)],
}

ROOT_5 = Decimal(5).sqrt()
COS_18, SIN_18 = (10 + 2 * ROOT_5).sqrt() / 4, (ROOT_5 - 1) / 4
COS_54, SIN_54 = (10 - 2 * ROOT_5).sqrt() / 4, (ROOT_5 + 1) / 4
AXES = {
    "h2": (Decimal(0), Decimal(1)),
    "c2h6": (-COS_18, SIN_18),
    "ch4": (-COS_54, -SIN_54),
    "c2h4": (COS_54, -SIN_54),
    "c2h2": (COS_18, SIN_18),
}


def pentagon_point(g):
    """Computes the area centroid (shoelace formula), every gas larger by a billionth of the sum."""
    total = sum(g[gas] for gas in AXES)
    if not total:
        return None
    gases = {gas: g[gas] + total / 10**9 for gas in AXES}
    total = sum(gases.values())
    corners = []
    for gas, (x, y) in AXES.items():
        share = 100 * gases[gas] / total
        share = Decimal(share.numerator) / Decimal(share.denominator)
        corners.append((x * share, y * share))
    area = x_sum = y_sum = Decimal(0)
    for (xi, yi), (xj, yj) in zip(corners, corners[1:] + corners[:1]):
        cross = xi * yj - xj * yi
        area += cross / 2
        x_sum += (xi + xj) * cross
        y_sum += (yi + yj) * cross
    return x_sum / (6 * area), y_sum / (6 * area)


def edges(polygon):
    corners = [(Decimal(str(x)), Decimal(str(y))) for x, y in polygon]
    return list(zip(corners, corners[1:] + corners[:1]))


def distance(point, edge):
    (x, y), ((ax, ay), (bx, by)) = point, edge
    dx, dy = bx - ax, by - ay
    t = ((x - ax) * dx + (y - ay) * dy) / (dx * dx + dy * dy)
    t = min(max(t, Decimal(0)), Decimal(1))
    return ((x - ax - t * dx) ** 2 + (y - ay - t * dy) ** 2).sqrt()


def winding(point, polygon):
    x, y = point
    turns = 0
    for (ax, ay), (bx, by) in edges(polygon):
        side = (bx - ax) * (y - ay) - (x - ax) * (by - ay)
        if ay <= y < by and side > 0:
            turns += 1
        elif by <= y < ay and side < 0:
            turns -= 1
    return turns


ON_BORDER = Decimal("1e-9")


def zone(point, pentagon):
    """Returns the first zone that contains the point, its border included."""
    for name, polygon in pentagon.items():
        near = min(distance(point, edge) for edge in edges(polygon))
        if near <= ON_BORDER or winding(point, polygon):
            return name
    raise ValueError(f"{point} is nowhere")


TABLE_1 = {True: [80, 90, 90, 50, 1, 900, 9000], False: [40, 20, 15, 50, 2, 500, 5000]}
TABLE_2 = {True: [200, 150, 175, 100, 2, 1100, 12500], False: [90, 50, 40, 100, 7, 600, 7000]}
C57_GASES = ["h2", "ch4", "c2h6", "c2h4", "c2h2", "co", "co2"]


def c57_status(g):
    """Judges by tables 1 and 2 for an unknown age; rates need more than one sample."""
    if g["o2"] is None or g["n2"] is None:
        return "NA"
    ratio = Ratio(g["o2"], g["n2"])
    if ratio.value is None:
        return "NA"
    low = ratio.within(None, F(1, 5))
    known = [i for i, gas in enumerate(C57_GASES) if g[gas] is not None]
    if any(g[C57_GASES[i]] > TABLE_2[low][i] for i in known):
        return "3"
    return "2" if any(g[C57_GASES[i]] > TABLE_1[low][i] for i in known) else "1"


def diagnose(g):
    first = triangle_1(g)
    row = {
        "iec": iec(g), "rogers": rogers(g), "doernenburg": doernenburg(g),
        "keygas": keygas(g), "dlt722": dlt722(g), "tri1": first, "tri4": triangle_4(g),
        "tri5": triangle_5(g), "c57_status": c57_status(g),
        "tri4_applicable": "yes" if first in ("PD", "T1", "T2") else "no",
        "tri5_applicable": "yes" if first in ("T2", "T3") else "no",
    }
    point = pentagon_point(g)
    if point is None:
        return row | {"pent1": "NA", "pent2": "NA", "pent_x": "NA", "pent_y": "NA", "edge": "NA"}
    near = min(
        distance(point, edge)
        for pentagon in (PENTAGON_1, PENTAGON_2)
        for polygon in pentagon.values()
        for edge in edges(polygon)
    )
    return row | {
        "pent1": zone(point, PENTAGON_1), "pent2": zone(point, PENTAGON_2),
        "pent_x": f"{point[0]:.9f}", "pent_y": f"{point[1]:.9f}", "edge": f"{near:.3e}",
    }


def main():
    gases = ["h2", "ch4", "c2h6", "c2h4", "c2h2", "co", "co2", "o2", "n2"]
    writer = csv.DictWriter(sys.stdout, RESULTS, lineterminator="\n")
    writer.writeheader()
    for row in csv.DictReader(sys.stdin):
        writer.writerow(diagnose({gas: F(row[gas]) if row.get(gas) else None for gas in gases}))


if __name__ == "__main__":
    main()
