"""Shared parts of the decimating peers of the bench.

    PEER MESH OUT_DIR CALLS VERTICES:TRIANGLES...

MESH holds, little-endian: the numbers of positions and of triangles as 32-bit
integers, positions as three 32-bit floats, triangles as three 32-bit indices.
For each number of VERTICES the peer's target is searched, from TRIANGLES on and
with at most CALLS calls, until its level has about as many; levels go to OUT_DIR
as 0.mesh, 1.mesh and so on, in the same form.

Prints one line of JSON: seconds of processor time of the first level and of all,
each that of one call alone, and the bytes by which the process's resident memory
grew at most in its first call. The process stays on one core.
"""

import json
import os
import pathlib
import sys
import time

import numpy

# A count may miss the wanted one by this share of it: calls are slow.
NEAR = 0.01
# A guess stays this share of the bracket away from its ends.
INWARD = 0.03


def read(path):
    data = numpy.fromfile(path, dtype="<u4")
    positions, triangles = int(data[0]), int(data[1])
    points = data[2 : 2 + 3 * positions].view("<f4").reshape(-1, 3)
    start = 2 + 3 * positions
    return points, data[start : start + 3 * triangles].reshape(-1, 3)


def write(path, points, faces):
    with open(path, "wb") as file:
        numpy.array([len(points), len(faces)], dtype="<u4").tofile(file)
        numpy.ascontiguousarray(points, dtype="<f4").tofile(file)
        numpy.ascontiguousarray(faces, dtype="<u4").tofile(file)


def resident(field):
    """Reads a figure of the process's memory, bytes."""
    for line in open("/proc/self/status"):
        if line.startswith(field + ":"):
            return int(line.split()[1]) * 1024
    raise RuntimeError("/proc/self/status has no " + field)


def timed(simplify, triangles):
    start = time.process_time()
    level = simplify(triangles)
    return time.process_time() - start, level


def search(simplify, arrays, full, wanted, guess, calls):
    """Searches for the level nearest to a number of vertices; returns the seconds too."""
    low, high, best = (0, 0), full, None
    for _ in range(calls):
        if best is not None and not low[0] < guess < high[0]:
            break
        seconds, level = timed(simplify, guess)
        points, faces = arrays(level)
        count = len(numpy.unique(faces))
        if best is None or abs(count - wanted) <= abs(best[0] - wanted):
            best = (count, seconds, points, faces)
        if abs(count - wanted) <= NEAR * wanted:
            break
        if count > wanted:
            high = (guess, count)
        else:
            low = (guess, count)
        share = (wanted - low[1]) / max(high[1] - low[1], 1)
        share = min(max(share, INWARD), 1 - INWARD)
        guess = round(low[0] + (high[0] - low[0]) * share)
    return best


def main(prepare, simplify, arrays):
    """Runs a peer: `prepare` takes points and faces, `simplify` what that gives
    and a number of triangles, `arrays` gives points and faces of a level."""
    mesh, out, calls, *wanted = sys.argv[1:]
    os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    points, faces = read(mesh)
    full = (len(faces), len(numpy.unique(faces)))
    prepared = prepare(points, faces)
    peaks, times = [], []

    def call(triangles):
        level = simplify(prepared, triangles)
        peaks.append(resident("VmHWM") - before)
        return level

    # The peak is that from here on.
    pathlib.Path("/proc/self/clear_refs").write_text("5")
    before = resident("VmRSS")
    for index, target in enumerate(wanted):
        vertices, triangles = map(int, target.split(":"))
        _, seconds, *level = search(call, arrays, full, vertices, triangles, int(calls))
        write(pathlib.Path(out) / f"{index}.mesh", *level)
        times.append(seconds)
    costs = {"one_seconds": times[0], "all_seconds": sum(times), "peak_bytes": peaks[0]}
    print(json.dumps(costs))
