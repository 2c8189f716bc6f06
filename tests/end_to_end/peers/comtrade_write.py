"""Writes a COMTRADE recording with the package comtraderecord: FOLDER/peer.cfg and
.dat, of two channels and 400 samples. Prints the values as JSON."""

import importlib.util
import json
import math
import os
import sys

import numpy

SAMPLES = 400
HERTZ = 1000


def load_writer():
    """Imports the package's writer alone: its other modules need pandas without declaring it."""
    package = importlib.util.find_spec("comtraderecord")
    path = os.path.join(os.path.dirname(package.origin), "comtradeWriter.py")
    spec = importlib.util.spec_from_file_location("comtrade_writer", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.comtradeWriter


def main():
    angles = [sample * 2 * math.pi * 50 / HERTZ for sample in range(SAMPLES)]
    values = numpy.array([
        [600 * math.sin(angle) for angle in angles],
        [100 * math.cos(angle) for angle in angles],
    ])
    writer = load_writer()(os.path.join(sys.argv[1], "peer"), values, HERTZ)
    writer.createFile()
    print(json.dumps(values.tolist()))


if __name__ == "__main__":
    main()
