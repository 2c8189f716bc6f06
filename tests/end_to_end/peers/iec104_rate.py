"""An IEC 60870-5-104 controlling station by c104 (lib60870-C) that interrogates as fast
as it can, one request at a time.

    iec104_rate.py PORT COMMON_ADDRESSES

Asks the common addresses 1 to COMMON_ADDRESSES once, which makes its points, and prints
`READY`. Then it takes one JSON a line on stdin, {"addresses": N}: it interrogates 1 to N,
each to its end before the next, and answers with {"seconds", "points"}: how long that
took, and how many points these addresses have.
"""

import json
import sys
import threading
import time

import c104

from c104_connection import is_of, open_transfer

PATIENCE_SECONDS = 60
INTERROGATION, TERMINATED, CAUSE_BITS = 100, 10, 0x3F

ended = threading.Event()


def look(connection: c104.Connection, data: bytes) -> None:
    if is_of(data, [INTERROGATION], TERMINATED, CAUSE_BITS):
        ended.set()


def take(
    client: c104.Client, station: c104.Station, io_address: int, point_type: c104.Type
) -> None:
    station.add_point(io_address=io_address, type=point_type)


def interrogate(connection, addresses):
    for address in range(1, addresses + 1):
        ended.clear()
        if not connection.interrogation(common_address=address, wait_for_response=False):
            sys.exit("no connection")
        if not ended.wait(PATIENCE_SECONDS):
            sys.exit(f"the interrogation of common address {address} does not end")


def main():
    port, addresses = int(sys.argv[1]), int(sys.argv[2])
    client = c104.Client(tick_rate_ms=100, command_timeout_ms=PATIENCE_SECONDS * 1000)
    client.on_new_point(callable=take)
    connection = client.add_connection(ip="127.0.0.1", port=port, init=c104.Init.NONE)
    stations = [connection.add_station(common_address=n + 1) for n in range(addresses)]
    connection.on_receive_raw(callable=look)
    open_transfer(client, connection, PATIENCE_SECONDS)
    interrogate(connection, addresses)
    print("READY", flush=True)
    for line in sys.stdin:
        wanted = json.loads(line)["addresses"]
        begun = time.perf_counter()
        interrogate(connection, wanted)
        seconds = time.perf_counter() - begun
        points = sum(len(station.points) for station in stations[:wanted])
        print(json.dumps({"seconds": seconds, "points": points}), flush=True)
    client.stop()


main()
