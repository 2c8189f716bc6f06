"""Reads a COMTRADE recording with the package comtrade and prints it as JSON, for recordings.rs."""

import json
import math
import os
import sys
import warnings

import comtrade

ENCODINGS = ["utf-8", "gb18030", "iso-8859-1"]


def numbers(values):
    """Values as JSON has them: a missing one is null."""
    return [None if math.isnan(value) else float(value) for value in values]


def load(path):
    """Loads a recording in the first encoding that fits."""
    fault = None
    for encoding in ENCODINGS:
        recording = comtrade.Comtrade(use_double_precision=True, ignore_warnings=True)
        try:
            if path.lower().endswith(".cff"):
                recording.load(path, encoding=encoding)
            else:
                root, extension = os.path.splitext(path)
                names = [".dat", ".DAT", ".Dat"]
                names = [root + name for name in names if os.path.exists(root + name)]
                recording.load(path, names[0], encoding=encoding)
            return recording
        except Exception as error:  # The package raises many kinds.
            fault = fault or error
    raise fault


def main():
    warnings.simplefilter("ignore")
    try:
        recording = load(sys.argv[1])
    except Exception as error:
        print(json.dumps({"fault": f"{type(error).__name__}: {error}"[:200]}))
        return
    print(json.dumps({
        "time": numbers(recording.time),
        "analog": [numbers(values) for values in recording.analog],
        "status": [[int(value) for value in values] for values in recording.status],
    }))


if __name__ == "__main__":
    main()
