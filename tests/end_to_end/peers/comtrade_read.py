"""Reads a COMTRADE recording with the package comtrade and prints it as JSON."""

import json
import math
import sys

import comtrade


def numbers(values):
    """Converts values for JSON: a missing one is null."""
    return [None if math.isnan(value) else float(value) for value in values]


def main():
    recording = comtrade.load(sys.argv[1], use_double_precision=True)
    print(json.dumps({
        "start": recording.start_timestamp.isoformat(),
        "analog_ids": recording.analog_channel_ids,
        "status_ids": recording.status_channel_ids,
        "time": numbers(recording.time),
        "analog": [numbers(values) for values in recording.analog],
        "status": [[int(value) for value in values] for values in recording.status],
    }))


if __name__ == "__main__":
    main()
