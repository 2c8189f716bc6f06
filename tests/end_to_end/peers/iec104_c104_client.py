"""An IEC 60870-5-104 controlling station by c104 (lib60870-C): asks a station for all
that it has, and tells what came.

    iec104_c104_client.py PORT COMMON_ADDRESS SECONDS

Starts data transfer, asks for all values, for counters, sets the clock, tests, and
listens for some seconds. Prints one line of JSON: {"interrogation", "counters",
"clock", "test": whether the station confirmed it, "points": {IOA: {"type", "value",
"is_good"}}}.
"""

import json
import sys
import threading
import time

import c104

from c104_connection import is_of, open_transfer

PATIENCE_SECONDS = 10
# A positive confirmation, whoever asked for a test.
CONFIRMED, CAUSE_BITS = 7, 0x7F

frames = []
arrived = threading.Condition()


def look(connection: c104.Connection, data: bytes) -> None:
    with arrived:
        frames.append(data)
        arrived.notify()


def is_confirmed(types, send):
    """Reports whether the station confirms a request. c104 itself waits for an answer only
    once it has sent, and misses one that comes at once."""

    def is_there():
        return any(is_of(frame, types, CONFIRMED, CAUSE_BITS) for frame in frames)

    if not send():
        return False
    with arrived:
        return arrived.wait_for(is_there, PATIENCE_SECONDS)


def value(point):
    value = point.value
    # Enumerations, and numbers in classes of their own.
    if name := getattr(value, "name", None):
        return name
    try:
        return float(value)
    except TypeError:
        return str(value)


def report(point):
    return {
        "type": point.type.name,
        "value": value(point),
        "is_good": point.quality is None or point.quality.is_good(),
    }


def take(
    client: c104.Client, station: c104.Station, io_address: int, point_type: c104.Type
) -> None:
    station.add_point(io_address=io_address, type=point_type)


def main():
    port, common_address, seconds = int(sys.argv[1]), int(sys.argv[2]), float(sys.argv[3])
    client = c104.Client(tick_rate_ms=100, command_timeout_ms=PATIENCE_SECONDS * 1000)
    client.on_new_point(callable=take)
    connection = client.add_connection(ip="127.0.0.1", port=port, init=c104.Init.NONE)
    station = connection.add_station(common_address=common_address)
    connection.on_receive_raw(callable=look)
    open_transfer(client, connection, PATIENCE_SECONDS)
    requests = {
        "interrogation": ([100], connection.interrogation),
        "counters": ([101], connection.counter_interrogation),
        "clock": ([103], connection.clock_sync),
        "test": ([104, 107], connection.test),
    }
    answers = {
        name: is_confirmed(
            types, lambda: send(common_address=common_address, wait_for_response=False)
        )
        for name, (types, send) in requests.items()
    }
    time.sleep(seconds)
    points = {point.io_address: report(point) for point in station.points}
    print(json.dumps(answers | {"points": points}), flush=True)
    client.stop()


main()
